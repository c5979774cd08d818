//! What shapes are measured in: a shape space, or the lengths of edges.

use std::sync::Arc;

use super::length;
use crate::inbetween::Layout;
use crate::inbetween::isometric::Connectivity;
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
    Lengths(Connectivity),
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
            Kind::Lengths(Connectivity::new(topology, &poses[0])?)
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
            Kind::Lengths(connectivity) => connectivity.edges().len(),
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
            Kind::Lengths(connectivity) => {
                let edges = connectivity.edges().iter();
                edges.map(|&edge| length(positions, edge)).collect()
            }
        }
    }

    /// The shape of coordinates. Lengths do not say which of several shapes: theirs is the one that is
    /// reached from `near`, which lies where that lies ([`Layout`]).
    ///
    /// # Errors
    /// `near` has sizes beyond double precision.
    pub fn decode(&self, code: &[f64], near: &[f64]) -> Result<Vec<f64>, SpaceError> {
        match &self.kind {
            Kind::Space(space) => {
                let mut positions = vec![0.0; 3 * self.vertices];
                space.decode(code, &mut positions);
                Ok(positions)
            }
            Kind::Lengths(connectivity) => Ok(Layout::new(connectivity, near)?.laid_out(code)),
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
        let Kind::Lengths(connectivity) = &self.kind else {
            return None;
        };
        connectivity.sides().position(|sides| {
            let lengths = sides.map(|side| side.map_or(0.0, |side| code[side]));
            let (sum, longest) = lengths
                .iter()
                .fold((0.0, 0.0_f64), |(sum, most), &x| (sum + x, most.max(x)));
            // a flat triangle may break it by rounding
            2.0 * longest > sum * (1.0 + 1e-9) || lengths.iter().any(|&x| x < 0.0)
        })
    }
}
