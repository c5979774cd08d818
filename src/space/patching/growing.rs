//! Where the patches of a mesh are.

use nalgebra::UnitQuaternion;

use super::members::spread;
use crate::mesh::{Hinges, ReferenceTriangle, grow_patches};
use crate::space::orientation::polar_factors;

/// Poses that patches are grown on; of more, these many spread evenly.
const POSES: usize = 8;

/// About `sought` patches of a mesh, grown on `poses`, their places those of the `pose` of the reference
/// triangles; one number a triangle. Triangles with a weight below 1 turn with their neighbours.
pub(in crate::space) fn grow(
    (reference, triangles, weights): (&[ReferenceTriangle], &[[u32; 3]], &[f64]),
    hinges: &Hinges,
    (pose, poses): (&[f64], &[&[f64]]),
    sought: usize,
) -> Vec<u32> {
    let step = poses.len().div_ceil(POSES).max(1);
    let mut rotations: Vec<Vec<UnitQuaternion<f64>>> = poses
        .iter()
        .step_by(step)
        .map(|pose| {
            let mut polars = Vec::new();
            polar_factors(reference, triangles, pose, &mut polars);
            polars.iter().map(|polar| polar.rotation).collect()
        })
        .collect();
    if !weights.is_empty() {
        let like = nearest_whole(weights, hinges);
        for rotations in &mut rotations {
            *rotations = like.iter().map(|&face| rotations[face as usize]).collect();
        }
    }
    let rows: Vec<&[UnitQuaternion<f64>]> = rotations.iter().map(Vec::as_slice).collect();
    grow_patches(hinges, &rows, &centres(triangles, pose), sought)
}

/// For each triangle itself, or the nearest across edges with a weight of 1 where its own is less and
/// there is one.
pub(super) fn nearest_whole(weights: &[f64], hinges: &Hinges) -> Vec<u32> {
    let mut found: Vec<Option<u32>> = weights
        .iter()
        .zip(0..)
        .map(|(&weight, face)| (weight >= 1.0).then_some(face))
        .collect();
    spread(&mut found, hinges);
    found
        .iter()
        .zip(0..)
        .map(|(found, face)| found.unwrap_or(face))
        .collect()
}

/// The middle of each triangle, in units of the largest extent of the mesh.
fn centres(triangles: &[[u32; 3]], pose: &[f64]) -> Vec<[f64; 3]> {
    let extent = (0..3)
        .map(|axis| {
            let values = || pose.iter().skip(axis).step_by(3);
            let high = values().fold(f64::MIN, |high, &x| high.max(x));
            let low = values().fold(f64::MAX, |low, &x| low.min(x));
            high - low
        })
        .fold(0.0, f64::max);
    let scale = if extent > 0.0 {
        1.0 / (3.0 * extent)
    } else {
        1.0
    };
    triangles
        .iter()
        .map(|points| {
            let sum = |axis| {
                points
                    .iter()
                    .map(|&v| pose[3 * v as usize + axis])
                    .sum::<f64>()
            };
            std::array::from_fn(|axis| sum(axis) * scale)
        })
        .collect()
}
