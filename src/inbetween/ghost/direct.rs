//! The direct lift: each vertex of the mesh moves with the turns of its carrier's corners, no solve.
//!
//! x(t) = sum over the corners v of w_v (g_v(t) + R_v S_v (x - g_v)) + R sum over the keys of c_j(t) e_j,
//! where x and g_v are places in the first key, R the blended rotation and e_j what is missing at key j,
//! turned back.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::carrier::Carrier;
use super::residual::Residual;
use super::turns::Turn;

/// Vertices that one thread takes at a time.
const CHUNK: usize = 2048;

/// The vertices of a mesh under a ghost.
pub(super) struct Direct {
    /// Places in the first key.
    places: Vec<Vector3<f64>>,
    ghost: Vec<Vector3<f64>>,
    carriers: Vec<Carrier>,
    residual: Residual<3>,
    keep: bool,
}

/// x -> linear x + shift.
struct Motion {
    linear: Matrix3<f64>,
    shift: Vector3<f64>,
}

impl Direct {
    /// For the shapes of the mesh and of the ghost at the keys; `turns` gives the turns of the ghost's
    /// vertices at a key. The residual is kept where `keep` says so.
    pub(super) fn new(
        poses: &[Vec<f64>],
        ghosts: &[Vec<f64>],
        carriers: Vec<Carrier>,
        turns: impl Fn(usize) -> Vec<Turn>,
        keep: bool,
    ) -> Self {
        let points = |pose: &[f64]| -> Vec<Vector3<f64>> {
            pose.chunks_exact(3)
                .map(Vector3::from_column_slice)
                .collect()
        };
        let mut direct = Direct {
            places: points(&poses[0]),
            ghost: points(&ghosts[0]),
            carriers,
            residual: Residual::new(0, 0, |_, _| [0.0; 3]),
            keep,
        };
        if keep {
            let turns: Vec<Vec<Turn>> = (0..poses.len()).map(turns).collect();
            let motions: Vec<Vec<Motion>> = turns
                .iter()
                .zip(ghosts)
                .map(|(turns, ghost)| direct.motions(turns, ghost))
                .collect();
            direct.residual = Residual::new(direct.places.len(), poses.len(), |vertex, key| {
                let there = Vector3::from_column_slice(&poses[key][3 * vertex..3 * vertex + 3]);
                let missing = there - direct.carried(vertex, &motions[key]);
                let turn = direct.carriers[vertex].turn(&turns[key]);
                turn.turned_back(&missing).data.0[0]
            });
        }
        direct
    }

    /// Writes the positions for the ghost's turns and places and the weights of the keys.
    pub(super) fn place(
        &self,
        turns: &[Turn],
        ghost: &[f64],
        weights: &[f64],
        positions: &mut [f64],
    ) {
        let motions = self.motions(turns, ghost);
        positions
            .par_chunks_mut(3 * CHUNK)
            .enumerate()
            .for_each(|(chunk, positions)| {
                for (at, place) in positions.chunks_exact_mut(3).enumerate() {
                    let vertex = CHUNK * chunk + at;
                    let mut found = self.carried(vertex, &motions);
                    if self.keep {
                        let more = Vector3::from(self.residual.blend(vertex, weights));
                        found += self.carriers[vertex].turn(turns).turned(&more);
                    }
                    place.copy_from_slice(found.as_slice());
                }
            });
    }

    /// The motions of the ghost's vertices.
    fn motions(&self, turns: &[Turn], ghost: &[f64]) -> Vec<Motion> {
        let now = ghost.chunks_exact(3).map(Vector3::from_column_slice);
        turns
            .iter()
            .zip(now)
            .zip(&self.ghost)
            .map(|((turn, now), first)| {
                let column = |axis| turn.turned(&turn.stretched(&Vector3::ith(axis, 1.0)));
                let linear = Matrix3::from_columns(&[column(0), column(1), column(2)]);
                Motion {
                    linear,
                    shift: now - linear * first,
                }
            })
            .collect()
    }

    fn carried(&self, vertex: usize, motions: &[Motion]) -> Vector3<f64> {
        let carrier = &self.carriers[vertex];
        let mut sum = Vector3::zeros();
        for (&corner, weight) in carrier.vertices.iter().zip(carrier.weights) {
            let motion = &motions[corner as usize];
            sum += (motion.linear * self.places[vertex] + motion.shift) * f64::from(weight);
        }
        // weights in single precision do not quite sum to 1
        let total: f32 = carrier.weights.iter().sum();
        sum / f64::from(total)
    }
}
