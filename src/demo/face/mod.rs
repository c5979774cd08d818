//! A head with nine expressions, as poses.
//!
//! `head` is the face at rest, `muscle` the few movements that a face can make, each a smooth field
//! over the head, `expression` how much of each makes an expression.

mod expression;
mod head;
mod muscle;

use std::sync::Arc;

use nalgebra::Vector3;

use crate::mesh::{Sequence, Topology};
use crate::task::{Cancelled, Task};

use super::surface_nets::polygonise;

use expression::POSES;

pub use expression::NAMES;

/// The nine poses, neutral first.
pub(super) fn generate(task: &Task) -> Result<Sequence, Cancelled> {
    let head = head::Head::new();
    let mut mesh = polygonise(&head, &head::grid(), task)?;
    mesh.relax(&head, 5, task)?;
    let neighbours = mesh.neighbours();
    let mut positions = Vec::with_capacity(3 * mesh.points.len() * POSES.len());
    for expression in &POSES {
        task.check()?;
        let shifts = mesh
            .points
            .iter()
            .map(|&point| muscle::moved(point, expression) - point);
        let shifts = softened(shifts.collect(), &neighbours);
        for (point, shift) in mesh.points.iter().zip(shifts) {
            let moved = (point + shift) * head::METRES;
            // built facing +x with its right side towards +z; shown facing +z
            positions.extend([-moved.z as f32, moved.y as f32, moved.x as f32]);
        }
    }
    let topology = Topology::from_triangles(mesh.points.len(), &mesh.triangles());
    let topology = topology.expect("faces name their own points");
    Ok(Sequence::new(Arc::new(topology), positions, None))
}

/// Rounds in which the skin evens out what the muscles do to neighbouring vertices.
const SOFTNESS: usize = 4;

/// Shifts that went half the way to the mean of their neighbours' [`SOFTNESS`] times. Lips touch but
/// are far from each other over the skin, so they still part.
fn softened(mut shifts: Vec<Vector3<f64>>, neighbours: &[Vec<u32>]) -> Vec<Vector3<f64>> {
    for _ in 0..SOFTNESS {
        let old = shifts.clone();
        for (shift, around) in shifts.iter_mut().zip(neighbours) {
            let sum: Vector3<f64> = around.iter().map(|&other| old[other as usize]).sum();
            *shift = shift.lerp(&(sum / around.len() as f64), 0.5);
        }
    }
    shifts
}
