//! How a shape, and parts of it, are turned against the reference pose.

use nalgebra::{Matrix3, UnitQuaternion};
use rayon::prelude::*;

use super::placement::triple;
use crate::math::rotation::nearest;
use crate::mesh::{Polar, ReferenceTriangle};

/// Triangles that one thread takes at a time; sums are taken chunk by chunk in this order.
const CHUNK: usize = 512;

/// The polar factors of all triangles of a shape and its mean rotation: the rotation nearest the
/// area-weighted sum of the triangles' rotations, those without a plane (in the reference or the shape)
/// left out.
pub(super) fn polar_factors(
    reference: &[ReferenceTriangle],
    triangles: &[[u32; 3]],
    positions: &[f64],
    polars: &mut Vec<Polar>,
) -> UnitQuaternion<f64> {
    let sides = |face: usize| {
        let [a, b, c] = triangles[face].map(|vertex| triple(positions, vertex as usize));
        [b - a, c - a]
    };
    polars.resize(
        triangles.len(),
        Polar {
            rotation: UnitQuaternion::identity(),
            stretch: [0.0; 3],
        },
    );
    let sums: Vec<(Matrix3<f64>, Vec<usize>)> = polars
        .par_chunks_mut(CHUNK)
        .enumerate()
        .map(|(chunk, polars)| {
            let mut sum = Matrix3::zeros();
            let mut flat = Vec::new();
            for (at, out) in polars.iter_mut().enumerate() {
                let face = CHUNK * chunk + at;
                let [e1, e2] = sides(face);
                match reference[face].polar(&e1, &e2) {
                    Some(polar) => {
                        if !reference[face].degenerate {
                            let turn = polar.rotation.to_rotation_matrix();
                            sum += turn.matrix() * reference[face].area();
                        }
                        *out = polar;
                    }
                    None => flat.push(face),
                }
            }
            (sum, flat)
        })
        .collect();
    let mean = nearest(&sums.iter().map(|(sum, _)| sum).sum()).rotation;
    for face in sums.into_iter().flat_map(|(_, flat)| flat) {
        let [e1, e2] = sides(face);
        polars[face] = reference[face].polar_near(&e1, &e2, &mean);
    }
    mean
}

/// The rotation of each group of triangles (the one nearest their area-weighted sum), and of all
/// together; triangles without a plane in the reference have no say.
pub(super) fn group_rotations(
    reference: &[ReferenceTriangle],
    rotations: impl Iterator<Item = UnitQuaternion<f64>>,
    group: &[u32],
    groups: usize,
) -> (Vec<UnitQuaternion<f64>>, UnitQuaternion<f64>) {
    let mut sums = vec![Matrix3::zeros(); groups];
    for ((rotation, triangle), &group) in rotations.zip(reference).zip(group) {
        if !triangle.degenerate {
            sums[group as usize] += rotation.to_rotation_matrix().matrix() * triangle.area();
        }
    }
    let whole = nearest(&sums.iter().sum()).rotation;
    (
        sums.iter().map(|sum| nearest(sum).rotation).collect(),
        whole,
    )
}
