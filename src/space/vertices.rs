//! Vertex coordinates, R^3V: the identity. Right where frames are close together; large rotations
//! shrink between distant ones.

use super::{Block, Invariance, ShapeSpace, SpaceError};

/// The space of vertex coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Vertices {
    vertices: usize,
}

impl Vertices {
    /// The space of shapes with this many vertices; faces and reference pose do not matter.
    pub fn new(vertices: usize) -> Self {
        Vertices { vertices }
    }
}

impl ShapeSpace for Vertices {
    fn name(&self) -> &'static str {
        "vertices"
    }

    fn dimension(&self) -> usize {
        3 * self.vertices
    }

    fn invariance(&self) -> Invariance {
        Invariance::None
    }

    fn blocks(&self) -> Vec<Block> {
        vec![Block {
            name: "position",
            range: 0..self.dimension(),
        }]
    }

    fn encode(
        &self,
        positions: &[f64],
        _near: Option<&[f64]>,
        coordinates: &mut [f64],
    ) -> Result<(), SpaceError> {
        coordinates.copy_from_slice(positions);
        Ok(())
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) -> Result<(), SpaceError> {
        positions.copy_from_slice(coordinates);
        Ok(())
    }
}
