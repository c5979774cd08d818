//! How a shape, and parts of it, are turned against the reference pose.

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::placement::triple;
use crate::math::columns::{BLOCK, widely};
use crate::math::rotation::nearest;
use crate::mesh::{Polar, PolarBlock, ReferenceTriangle};

/// Triangles that one thread takes at a time, a multiple of [`BLOCK`]; sums are taken chunk by chunk in this
/// order.
const CHUNK: usize = 512;

/// The polar factors of all triangles of a shape and its mean rotation: the rotation nearest the
/// area-weighted sum of the triangles' rotations, those without a plane (in the reference or the shape)
/// left out.
pub(super) fn polar_factors(
    reference: &[ReferenceTriangle],
    triangles: &[[u32; 3]],
    positions: &[f64],
    factors: &mut Vec<Polar>,
) -> UnitQuaternion<f64> {
    let none = Polar {
        rotation: UnitQuaternion::identity(),
        stretch: [0.0; 3],
    };
    factors.resize(triangles.len(), none);
    let sums: Vec<(Matrix3<f64>, Vec<usize>)> = factors
        .par_chunks_mut(CHUNK)
        .zip(reference.par_chunks(CHUNK))
        .zip(triangles.par_chunks(CHUNK))
        .enumerate()
        .map(|(chunk, ((factors, reference), triangles))| {
            let mut part = Part {
                reference,
                triangles,
                positions,
                sum: Matrix3::zeros(),
                flat: Vec::new(),
            };
            widely(
                #[inline(always)]
                || part.run(factors),
            );
            let flat = part.flat.iter().map(|face| CHUNK * chunk + face);
            (part.sum, flat.collect())
        })
        .collect();
    let mean = nearest(&sums.iter().map(|(sum, _)| sum).sum()).rotation;
    for face in sums.into_iter().flat_map(|(_, flat)| flat) {
        let [e1, e2] = sides(&triangles[face], positions);
        factors[face] = reference[face].polar_near(&e1, &e2, &mean);
    }
    mean
}

/// One thread's triangles.
struct Part<'a> {
    reference: &'a [ReferenceTriangle],
    triangles: &'a [[u32; 3]],
    positions: &'a [f64],
    /// Area-weighted sum of the rotations.
    sum: Matrix3<f64>,
    /// Triangles without a plane in the shape, whose factors are still to be found.
    flat: Vec<usize>,
}

impl Part<'_> {
    #[inline(always)]
    fn run(&mut self, factors: &mut [Polar]) {
        let mut block = PolarBlock::default();
        for (at, factors) in factors.chunks_mut(BLOCK).enumerate() {
            let first = BLOCK * at;
            for i in 0..factors.len() {
                let face = first + i;
                let sides = sides(&self.triangles[face], self.positions);
                block.set(i, &self.reference[face], sides);
            }
            block.factor();
            for (i, out) in factors.iter_mut().enumerate() {
                match block.get(i) {
                    Some((polar, turn)) => {
                        self.sum += turn * self.reference[first + i].area();
                        *out = polar;
                    }
                    None => self.one(first + i, out),
                }
            }
        }
    }

    #[inline(never)]
    fn one(&mut self, face: usize, out: &mut Polar) {
        let triangle = &self.reference[face];
        let [e1, e2] = sides(&self.triangles[face], self.positions);
        match triangle.polar(&e1, &e2) {
            Some(polar) => {
                if !triangle.degenerate {
                    let turn = polar.rotation.to_rotation_matrix();
                    self.sum += turn.matrix() * triangle.area();
                }
                *out = polar;
            }
            None => self.flat.push(face),
        }
    }
}

/// From corner 0 to corners 1 and 2.
#[inline(always)]
pub(super) fn sides(triangle: &[u32; 3], positions: &[f64]) -> [Vector3<f64>; 2] {
    let [a, b, c] = triangle.map(|vertex| triple(positions, vertex as usize));
    [b - a, c - a]
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
