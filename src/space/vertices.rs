//! Vertex coordinates, R^3V: the identity. Right where frames are close together; large rotations
//! shrink between distant ones.

use super::{Block, Invariance, ShapeSpace, State};

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
            weight: 1.0,
        }]
    }

    fn state(&self) -> State {
        State::new(self, &[])
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        coordinates.copy_from_slice(positions);
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        positions.copy_from_slice(coordinates);
    }

    fn is_identity(&self) -> bool {
        true
    }
}
