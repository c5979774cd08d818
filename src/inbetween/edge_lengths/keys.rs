//! Poses as points of the space of edge lengths, and blends of them.

use nalgebra::{UnitQuaternion, Vector3};

use super::{Embedding, Target, near_branch};
use crate::math::rotation::{exp, log};
use crate::mesh::rigid_align::{mean, rigid};

/// What of the lengths of edges is summed between poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Blend {
    /// The lengths themselves.
    #[default]
    Lengths,
    /// Their squares (R14 §6: right for anisotropic stretch, where diagonals do not scale with the sides).
    /// A negative sum becomes length 0.
    Squares,
    /// Their logarithms: between discretely conformally equivalent poses, b_ij = exp((u_i + u_j) / 2) a_ij,
    /// this interpolates the factors u (R14 §5, [`crate::inbetween::conformal::scaled`]). Unlike lengths
    /// and squares, it need not give triangles between triangles.
    Logarithms,
}

impl Blend {
    /// One edge between poses in which it has these lengths; poses of weight 0 do not count.
    pub fn length(self, weights: &[f64], lengths: impl Iterator<Item = f64>) -> f64 {
        let pairs = weights.iter().zip(lengths).filter(|(w, _)| **w != 0.0);
        match self {
            Blend::Lengths => pairs.map(|(w, l)| w * l).sum(),
            Blend::Squares => pairs.map(|(w, l)| w * l * l).sum::<f64>().max(0.0).sqrt(),
            Blend::Logarithms => libm::exp(pairs.map(|(w, l)| w * libm::log(l)).sum()),
        }
    }
}

/// Poses of one connectivity with what blends need of each: lengths, dihedral angles on a common branch,
/// and how each is turned against the first.
#[derive(Debug, Clone)]
pub struct KeyShapes {
    poses: Vec<Vec<f64>>,
    lengths: Vec<Vec<f64>>,
    dihedrals: Vec<Vec<f64>>,
    /// The part of each vertex, and for each pose and part its mean vertex and its rotation vector.
    part: Vec<u32>,
    places: Vec<Vec<(Vector3<f64>, Vector3<f64>)>>,
}

/// How far poses are from being isometric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strain {
    /// Root mean square over the edges and poses of |l - l0| / l0 against the first pose, in percent.
    pub rms_percent: f64,
    /// The largest, in percent.
    pub max_percent: f64,
    /// Its edge, an index into [`Embedding::edges`].
    pub edge: usize,
}

impl KeyShapes {
    /// Measures poses of 3V positions; the first is the one others are compared with.
    ///
    /// # Panics
    /// There is no pose, or one is of another mesh.
    pub fn new(embedding: &Embedding, poses: &[&[f64]]) -> Self {
        let first = poses[0];
        let rest = embedding.dihedrals(first);
        let members = embedding.members();
        let place = |pose: &[f64]| -> Vec<(Vector3<f64>, Vector3<f64>)> {
            let each = members.iter().map(|members| {
                let gather = |from: &[f64]| -> Vec<f64> {
                    let at = |&v: &u32| 3 * v as usize..3 * v as usize + 3;
                    members.iter().flat_map(|v| from[at(v)].to_vec()).collect()
                };
                let (there, here) = (gather(first), gather(pose));
                (mean(&here), log(&rigid(&there, &here).rotation))
            });
            each.collect()
        };
        KeyShapes {
            poses: poses.iter().map(|pose| pose.to_vec()).collect(),
            lengths: poses.iter().map(|pose| embedding.lengths(pose)).collect(),
            dihedrals: poses
                .iter()
                .map(|pose| near_branch(embedding.dihedrals(pose), &rest))
                .collect(),
            part: embedding.parts.part().to_vec(),
            places: poses.iter().map(|pose| place(pose)).collect(),
        }
    }

    /// How many poses there are.
    pub fn len(&self) -> usize {
        self.poses.len()
    }

    /// Never: there is at least one pose.
    pub fn is_empty(&self) -> bool {
        self.poses.is_empty()
    }

    /// The 3V positions of a pose.
    pub fn pose(&self, pose: usize) -> &[f64] {
        &self.poses[pose]
    }

    /// The lengths of a pose.
    pub fn lengths(&self, pose: usize) -> &[f64] {
        &self.lengths[pose]
    }

    /// The dihedral angles of a pose, within a half turn of the first pose's.
    pub fn dihedrals(&self, pose: usize) -> &[f64] {
        &self.dihedrals[pose]
    }

    /// Weighted sums of lengths and dihedral angles, to be embedded. Weights should sum to 1.
    ///
    /// The guide has each part's own vertices blended in the frame of its mean rotation, so that it does
    /// not collapse where poses are turned against each other.
    ///
    /// # Panics
    /// There is not one weight a pose.
    pub fn blend(&self, weights: &[f64], blend: Blend) -> Target {
        assert_eq!(weights.len(), self.poses.len(), "one weight a pose");
        let lengths = (0..self.lengths[0].len())
            .map(|edge| blend.length(weights, self.lengths.iter().map(|row| row[edge])));
        Target {
            lengths: lengths.collect(),
            dihedrals: sum(weights, &self.dihedrals),
            guide: self.guide(weights),
        }
    }

    fn guide(&self, weights: &[f64]) -> Vec<f64> {
        let parts = self.places[0].len();
        let turn = |part: usize| {
            let logs = self.places.iter().map(|places| places[part].1);
            exp(&logs.zip(weights).map(|(log, w)| log * *w).sum())
        };
        let turns: Vec<UnitQuaternion<f64>> = (0..parts).map(turn).collect();
        let mut guide = vec![0.0; self.poses[0].len()];
        for ((pose, places), &weight) in self.poses.iter().zip(&self.places).zip(weights) {
            let moves: Vec<_> = places
                .iter()
                .zip(&turns)
                .map(|((centre, log), turn)| (*centre, turn * exp(log).inverse()))
                .collect();
            for (vertex, &part) in self.part.iter().enumerate() {
                let (centre, turn) = &moves[part as usize];
                let at = 3 * vertex..3 * vertex + 3;
                let own = Vector3::from_column_slice(&pose[at.clone()]) - centre;
                let moved = (turn * own + centre) * weight;
                guide[at]
                    .iter_mut()
                    .zip(moved.iter())
                    .for_each(|(g, m)| *g += m);
            }
        }
        guide
    }

    /// How much edges change their lengths between the first pose and the others.
    pub fn strain(&self) -> Strain {
        let first = &self.lengths[0];
        let (mut squares, mut count) = (0.0, 0_usize);
        let (mut largest, mut edge) = (0.0, 0);
        for other in &self.lengths[1..] {
            for (at, (a, b)) in first.iter().zip(other).enumerate() {
                let change = if *a > 0.0 { ((b - a) / a).abs() } else { 0.0 };
                squares += change * change;
                count += 1;
                if change > largest {
                    (largest, edge) = (change, at);
                }
            }
        }
        Strain {
            rms_percent: 100.0 * (squares / count.max(1) as f64).sqrt(),
            max_percent: 100.0 * largest,
            edge,
        }
    }
}

/// The weighted sum of rows.
fn sum(weights: &[f64], rows: &[Vec<f64>]) -> Vec<f64> {
    let mut total = vec![0.0; rows[0].len()];
    for (row, weight) in rows.iter().zip(weights) {
        for (total, &entry) in total.iter_mut().zip(row) {
            *total += weight * entry;
        }
    }
    total
}
