//! A skin over bones that turn and move in planes z = constant.
//!
//! Weights: each vertex belongs to the bones of the nearest blobs, then the weights diffuse over the
//! mesh (not through the air, so that one leg does not pull the other). Motion: planar dual
//! quaternions (Kavan et al. 2008 restricted to turns about z), which neither collapse bent joints
//! nor wring them like sweets' wrappers.

use nalgebra::Vector3;

use super::implicit::{Blob, Flesh};
use crate::task::{Cancelled, Task};

/// Where a bone went: turned about its `rest` joint, which went to `joint`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Motion {
    /// The joint at rest.
    pub(super) rest: Vector3<f64>,
    /// The joint now.
    pub(super) joint: Vector3<f64>,
    /// The turn about z in radians, counter-clockwise seen from +z; not reduced to a half turn.
    pub(super) turn: f64,
}

/// For each vertex the bones that move it and their shares, which sum to 1.
#[derive(Debug, Clone)]
pub(super) struct Skin {
    rest: Vec<Vector3<f64>>,
    weights: Vec<Vec<(usize, f64)>>,
}

impl Skin {
    /// Attaches `points` to the bones of the flesh around them; shares fall by e in `reach`, and then
    /// diffuse for `rounds` over the edges of the mesh. What lies on the `stiff` bones does not bend.
    pub(super) fn attach(
        points: &[Vector3<f64>],
        neighbours: &[Vec<u32>],
        flesh: &Flesh,
        reach: f64,
        rounds: usize,
        stiff: &[usize],
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let blobs: Vec<Blob> = flesh.blobs().copied().collect();
        let bones = blobs.iter().map(|blob| blob.bone + 1).max().unwrap_or(0);
        let mut weights: Vec<Vec<f64>> = points
            .iter()
            .map(|&point| nearest_bones(point, &blobs, bones, reach))
            .collect();
        let holds = |row: &Vec<f64>| stiff.iter().any(|&bone| row[bone] > 0.5);
        let held: Vec<bool> = weights.iter().map(holds).collect();
        for (row, _) in weights.iter_mut().zip(&held).filter(|(_, held)| **held) {
            row.iter_mut()
                .for_each(|weight| *weight = if *weight > 0.5 { 1.0 } else { 0.0 });
        }
        for _ in 0..rounds {
            task.check()?;
            weights = diffuse(&weights, neighbours, &held);
        }
        Ok(Skin {
            rest: points.to_vec(),
            weights: weights.iter().map(|row| leading(row)).collect(),
        })
    }

    /// Appends the 3V coordinates of the skin over moved bones.
    pub(super) fn pose(&self, bones: &[Motion], positions: &mut Vec<f32>) {
        let quaternions: Vec<[f64; 5]> = bones.iter().map(Motion::dual).collect();
        for (&point, weights) in self.rest.iter().zip(&self.weights) {
            let mut sum = [0.0; 5];
            for &(bone, weight) in weights {
                for i in 0..5 {
                    sum[i] += weight * quaternions[bone][i];
                }
            }
            positions.extend(applied(sum, point).iter().map(|&value| value as f32));
        }
    }
}

impl Motion {
    /// cos and sin of half the turn, the dual part's two numbers, and the shift along z.
    fn dual(&self) -> [f64; 5] {
        let (sin, cos) = (libm::sin(self.turn), libm::cos(self.turn));
        let (w, z) = (libm::cos(0.5 * self.turn), libm::sin(0.5 * self.turn));
        let x = self.joint.x - (cos * self.rest.x - sin * self.rest.y);
        let y = self.joint.y - (sin * self.rest.x + cos * self.rest.y);
        [
            w,
            z,
            0.5 * (x * w + y * z),
            0.5 * (y * w - x * z),
            self.joint.z - self.rest.z,
        ]
    }
}

/// A sum of weighted [`Motion::dual`]s, made unit, applied to a point.
fn applied([w, z, dual_x, dual_y, shift]: [f64; 5], point: Vector3<f64>) -> Vector3<f64> {
    let square = w * w + z * z;
    let (cos, sin) = ((w * w - z * z) / square, 2.0 * w * z / square);
    let x = 2.0 * (dual_x * w - dual_y * z) / square;
    let y = 2.0 * (dual_y * w + dual_x * z) / square;
    Vector3::new(
        cos * point.x - sin * point.y + x,
        sin * point.x + cos * point.y + y,
        point.z + shift,
    )
}

fn nearest_bones(point: Vector3<f64>, blobs: &[Blob], bones: usize, reach: f64) -> Vec<f64> {
    let distances: Vec<f64> = blobs.iter().map(|blob| blob.distance(point).0).collect();
    let least = distances
        .iter()
        .fold(f64::INFINITY, |least, &one| least.min(one));
    let mut row = vec![0.0; bones];
    for (blob, distance) in blobs.iter().zip(distances) {
        row[blob.bone] += libm::exp((least - distance) / reach);
    }
    let sum: f64 = row.iter().sum();
    row.iter().map(|weight| weight / sum).collect()
}

/// Each row that is not held goes half the way to the mean of its neighbours' rows.
fn diffuse(weights: &[Vec<f64>], neighbours: &[Vec<u32>], held: &[bool]) -> Vec<Vec<f64>> {
    weights
        .iter()
        .zip(neighbours)
        .zip(held)
        .map(|((row, around), &held)| {
            if held {
                return row.clone();
            }
            let mut mixed: Vec<f64> = row.iter().map(|weight| 0.5 * weight).collect();
            let share = 0.5 / around.len() as f64;
            for &other in around {
                for (sum, weight) in mixed.iter_mut().zip(&weights[other as usize]) {
                    *sum += share * weight;
                }
            }
            mixed
        })
        .collect()
}

/// The weights above 1e-4, made to sum to 1.
fn leading(row: &[f64]) -> Vec<(usize, f64)> {
    let kept = || {
        row.iter()
            .copied()
            .enumerate()
            .filter(|&(_, weight)| weight > 1e-4)
    };
    let sum: f64 = kept().map(|(_, weight)| weight).sum();
    kept().map(|(bone, weight)| (bone, weight / sum)).collect()
}
