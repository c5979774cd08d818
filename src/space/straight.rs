//! The straight path between two shapes in a space.

use std::sync::Arc;

use super::ShapeSpace;

/// Shapes evenly between two, in the coordinates of a space; turns take the branch near the first shape's.
pub struct StraightPath {
    space: Arc<dyn ShapeSpace>,
    ends: [Vec<f64>; 2],
}

impl StraightPath {
    /// From one shape of 3V positions to another.
    ///
    /// # Panics
    /// A shape is not 3V long.
    pub fn new(space: Arc<dyn ShapeSpace>, from: &[f64], to: &[f64]) -> Self {
        let encoded = |pose: &[f64]| {
            let mut row = vec![0.0; space.dimension()];
            space.encode(pose, &mut row);
            row
        };
        let (first, mut last) = (encoded(from), encoded(to));
        space.follow(&first, &mut last);
        StraightPath {
            ends: [first, last],
            space,
        }
    }

    /// The shape a fraction `t` of the way, into `positions`.
    ///
    /// # Panics
    /// `positions` is not 3V long.
    pub fn at(&self, t: f64, positions: &mut [f64]) {
        let [first, last] = &self.ends;
        let pairs = first.iter().zip(last);
        let row: Vec<f64> = pairs.map(|(a, b)| a + t * (b - a)).collect();
        self.space.decode(&row, positions);
    }
}
