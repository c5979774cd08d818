//! Shapes from sums of the edge lengths of poses: by the embedding of Rojas et al. 2014, and where that
//! finds none, by triangles laid out as they fit.

use std::sync::Arc;

use super::ground::Returned;
use crate::inbetween::Layout;
use crate::inbetween::edge_lengths::{Blend, EdgeFit, Embedding, KeyShapes, Memory};
use crate::inbetween::isometric::Connectivity;
use crate::mesh::Topology;
use crate::space::SpaceError;

/// How a shape came back from its edge lengths.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// Dihedral angles summed as the lengths are, changed until the walks around all vertices close
    /// (R14 §2, [`crate::inbetween::edge_lengths`]).
    Embedding,
    /// Triangles laid onto a near pose and put together as they fit ([`Layout`]): no vertex has a closed
    /// walk, a triangle does not close, or this meets the lengths better.
    Layout,
}

impl Way {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Way::Embedding => "embedding",
            Way::Layout => "layout",
        }
    }
}

/// An embedding that misses lengths by more than this (root mean square, percent) is compared with a
/// layout.
const MISSED: f64 = 0.5;

/// Poses with what their lengths need to become shapes again.
pub(super) struct Lengths {
    topology: Arc<Topology>,
    embedding: Embedding,
    keys: KeyShapes,
}

impl Lengths {
    pub(super) fn new(topology: &Arc<Topology>, poses: &[Vec<f64>]) -> Result<Self, SpaceError> {
        let embedding = Embedding::new(topology)?;
        let poses: Vec<&[f64]> = poses.iter().map(Vec::as_slice).collect();
        Ok(Lengths {
            keys: KeyShapes::new(&embedding, &poses),
            topology: Arc::clone(topology),
            embedding,
        })
    }

    pub(super) fn dimension(&self) -> usize {
        self.embedding.edges().len()
    }

    pub(super) fn of(&self, positions: &[f64]) -> Vec<f64> {
        self.embedding.lengths(positions)
    }

    /// The shape of lengths that are, or come near, the sum of the poses' with these weights.
    pub(super) fn shape(&self, lengths: &[f64], weights: &[f64]) -> Result<Returned, SpaceError> {
        let embedded = self.embedded(lengths, weights);
        if let Some((positions, fit)) = &embedded
            && fit.rms_percent <= MISSED
        {
            return Ok(Returned::new(positions.clone(), Way::Embedding, fit));
        }
        let laid = self.laid_out(lengths)?;
        let fit = EdgeFit::new(lengths, &self.of(&laid));
        Ok(match embedded {
            Some((positions, better)) if better.rms_percent <= fit.rms_percent => {
                Returned::new(positions, Way::Embedding, &better)
            }
            _ => Returned::new(laid, Way::Layout, &fit),
        })
    }

    fn embedded(&self, lengths: &[f64], weights: &[f64]) -> Option<(Vec<f64>, EdgeFit)> {
        if self.embedding.walks() == 0 {
            return None;
        }
        let mut target = self.keys.blend(weights, Blend::Lengths);
        target.lengths = lengths.to_vec();
        let found = self.embedding.embed(&target, &mut Memory::default());
        found
            .ok()
            .map(|found| (found.positions, found.report.edges))
    }

    /// Laid out from the pose whose lengths are nearest.
    fn laid_out(&self, lengths: &[f64]) -> Result<Vec<f64>, SpaceError> {
        let distance = |&pose: &usize| -> f64 {
            let pairs = self.keys.lengths(pose).iter().zip(lengths);
            pairs.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let nearest = (0..self.keys.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let near = self.keys.pose(nearest.unwrap_or(0));
        let connectivity = Connectivity::new(&self.topology, self.keys.pose(0))?;
        Ok(Layout::new(&connectivity, near)?.laid_out(lengths))
    }

    /// The first triangle, from 0, whose lengths are those of no triangle.
    pub(super) fn broken(&self, lengths: &[f64]) -> Option<usize> {
        self.embedding.broken_triangle(lengths)
    }
}
