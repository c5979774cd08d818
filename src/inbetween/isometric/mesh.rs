//! Parts with vertices inside: turns along a tree of triangles, lengths from both poses, positions by the
//! Poisson system.

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::{Connectivity, FITS};
use crate::inbetween::fitting::{Fitting, Target, forward};
use crate::inbetween::polygon::{point, side_lengths};
use crate::math::rotation::{exp, log};
use crate::math::sparse::SparseError;
use crate::mesh::{DualTree, reference_triangles};

/// The triangles of parts that are no polygons.
#[derive(Debug)]
pub(super) struct Mesh {
    fitting: Fitting,
    trees: Vec<DualTree>,
    /// The turn of each triangle in the first pose against the reference: none but where that has no
    /// plane.
    rest: Vec<UnitQuaternion<f64>>,
    /// For the root of each tree its turn between the poses, for other triangles the turn against the
    /// parent's, as rotation vectors.
    turns: Vec<Vector3<f64>>,
    sides: [Vec<[f64; 3]>; 2],
}

/// The turn of each triangle in the first pose against a reference triangle of that pose, and from the
/// first pose to the second.
pub(super) fn between(
    triangles: &[[u32; 3]],
    poses: [&[f64]; 2],
) -> (Vec<UnitQuaternion<f64>>, Vec<UnitQuaternion<f64>>) {
    let reference = reference_triangles(triangles, poses[0]);
    triangles
        .par_iter()
        .zip(&reference[..])
        .map(|(corners, rest)| {
            let still = UnitQuaternion::identity();
            let turn = |pose: &[f64]| {
                let [a, b, c] = corners.map(|vertex| point(pose, vertex));
                rest.polar_near(&(b - a), &(c - a), &still).rotation
            };
            let first = match rest.degenerate {
                true => turn(poses[0]),
                false => still,
            };
            (first, turn(poses[1]) * first.inverse())
        })
        .unzip()
}

impl Mesh {
    pub(super) fn new(
        connectivity: &Connectivity,
        trees: Vec<DualTree>,
        poses: &[Vec<f64>; 2],
    ) -> Result<Self, SparseError> {
        let triangles = &connectivity.triangles;
        let (rest, turned) = between(triangles, [&poses[0], &poses[1]]);
        let mut turns: Vec<_> = turned.iter().map(log).collect();
        for step in trees.iter().flat_map(|tree| &tree.steps) {
            let against = turned[step.parent()].inverse() * turned[step.child()];
            turns[step.child()] = log(&against);
        }
        let sides = |pose: &[f64]| {
            let all = triangles.iter();
            all.map(|&corners| side_lengths(pose, corners)).collect()
        };
        Ok(Mesh {
            fitting: Fitting::new(connectivity, &poses[0])?,
            trees,
            rest,
            turns,
            sides: [sides(&poses[0]), sides(&poses[1])],
        })
    }

    /// The shape at `t`, up to a rigid motion of each part.
    pub(super) fn at(&self, t: f64, positions: &mut [f64]) {
        let [from, to] = &self.sides;
        let blend = |(a, b): (&[f64; 3], &[f64; 3])| {
            Target::new(std::array::from_fn(|k| a[k] * (1.0 - t) + b[k] * t))
        };
        let targets: Vec<Target> = from.iter().zip(to).map(blend).collect();
        self.fitting.turned(&targets, &self.turns_at(t), positions);
        let (mut before, mut ahead) = (positions.to_vec(), vec![0.0; positions.len()]);
        for _ in 0..FITS {
            forward(&before, positions, &mut ahead);
            before.copy_from_slice(positions);
            self.fitting.fit(&targets, &ahead, positions);
        }
    }

    /// The turn of each triangle against its reference.
    fn turns_at(&self, t: f64) -> Vec<UnitQuaternion<f64>> {
        let own: Vec<_> = self.turns.iter().map(|turn| exp(&(turn * t))).collect();
        let mut turns = own.clone();
        for step in self.trees.iter().flat_map(|tree| &tree.steps) {
            turns[step.child()] = turns[step.parent()] * own[step.child()];
        }
        for (turn, rest) in turns.iter_mut().zip(&self.rest) {
            *turn *= rest;
        }
        turns
    }
}
