//! What shapes are measured in: a shape space, or the lengths of edges.

use std::sync::Arc;

use super::lengths::{Lengths, Way};
use crate::inbetween::edge_lengths::EdgeFit;
use crate::mesh::Topology;
use crate::space::{ShapeSpace, SpaceError, Spaces};

/// What the lengths of edges are called beside the names of the shape spaces.
pub const EDGE_LENGTHS: &str = "edge-lengths";

/// A linear space that shapes have coordinates in, and how to come back from there.
pub struct Ground {
    kind: Kind,
    vertices: usize,
}

enum Kind {
    Space(Arc<dyn ShapeSpace>),
    Lengths(Box<Lengths>),
}

/// A shape that came back from its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Returned {
    /// 3V positions.
    pub positions: Vec<f64>,
    /// How lengths became it; none in a shape space.
    pub by: Option<ByLengths>,
}

/// How edge lengths became a shape, and how well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ByLengths {
    /// How.
    pub way: Way,
    /// Root mean square error of the lengths over their mean, in percent.
    pub rms_percent: f64,
    /// The largest error of an edge in percent of its length.
    pub worst_percent: f64,
}

impl Returned {
    pub(super) fn new(positions: Vec<f64>, way: Way, fit: &EdgeFit) -> Self {
        let by = ByLengths {
            way,
            rms_percent: fit.rms_percent,
            worst_percent: fit.max_percent(),
        };
        Returned {
            positions,
            by: Some(by),
        }
    }
}

impl Ground {
    /// The shape space called `name` about the first of the poses, or [`EDGE_LENGTHS`]: the lengths of all
    /// edges of the triangles, the diagonals that cut polygons among them.
    ///
    /// # Errors
    /// As [`Spaces::open`].
    ///
    /// # Panics
    /// There is no pose, or one is not 3V long.
    pub fn open(
        name: &str,
        topology: &Arc<Topology>,
        poses: &[Vec<f64>],
    ) -> Result<Self, SpaceError> {
        let vertices = topology.vertices();
        let kind = if name == EDGE_LENGTHS {
            Kind::Lengths(Box::new(Lengths::new(topology, poses)?))
        } else {
            let poses: Vec<&[f64]> = poses.iter().map(Vec::as_slice).collect();
            Kind::Space(Spaces::new(Arc::clone(topology), poses[0]).open(name, &poses)?)
        };
        Ok(Ground { kind, vertices })
    }

    /// d, how many coordinates a shape has.
    pub fn dimension(&self) -> usize {
        match &self.kind {
            Kind::Space(space) => space.dimension(),
            Kind::Lengths(lengths) => lengths.dimension(),
        }
    }

    /// The coordinates of a shape of 3V positions.
    pub fn encode(&self, positions: &[f64]) -> Vec<f64> {
        match &self.kind {
            Kind::Space(space) => {
                let mut code = vec![0.0; space.dimension()];
                space.encode(positions, &mut code);
                code
            }
            Kind::Lengths(lengths) => lengths.of(positions),
        }
    }

    /// The shape of coordinates. Lengths do not say which of several shapes: theirs is the one whose
    /// dihedral angles come nearest the sum, with these weights, of those of the poses the ground was
    /// opened with (R14 §2.1: the average of the input dihedrals); it lies on the same sum of the poses.
    ///
    /// # Errors
    /// A pose has sizes beyond double precision.
    ///
    /// # Panics
    /// There is not one weight a pose.
    pub fn decode(&self, code: &[f64], weights: &[f64]) -> Result<Returned, SpaceError> {
        match &self.kind {
            Kind::Space(space) => {
                let mut positions = vec![0.0; 3 * self.vertices];
                space.decode(code, &mut positions);
                Ok(Returned {
                    positions,
                    by: None,
                })
            }
            Kind::Lengths(lengths) => lengths.shape(code, weights),
        }
    }

    /// The coordinates of `pose` with the difference from one shape to another added.
    pub fn moved(&self, pose: &[f64], from: &[f64], to: &[f64]) -> Vec<f64> {
        let mut code = self.encode(pose);
        let steps = self.encode(from).into_iter().zip(self.encode(to));
        for (x, (from, to)) in code.iter_mut().zip(steps) {
            *x += to - from;
        }
        code
    }

    /// The first triangle, from 0, whose lengths are those of no triangle; never in a shape space.
    pub fn broken(&self, code: &[f64]) -> Option<usize> {
        match &self.kind {
            Kind::Space(_) => None,
            Kind::Lengths(lengths) => lengths.broken(code),
        }
    }
}
