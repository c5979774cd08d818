//! Shape spaces (CH12 §5): a shape as one point of a Euclidean space. A space is made for one
//! connectivity and one reference pose; factors are computed then and shared.
//!
//! # Laws, tested over every space in `tests/space_laws.rs`
//! - `decode(encode(v)) = v` to 1e-6 of the bounding box, after rigid alignment where the space is
//!   invariant to rigid motions;
//! - coordinates do not change (1e-9) under what [`Invariance`] promises;
//! - the weighted sum of squares of a coordinate difference is comparable between the blocks.

mod vertices;

use std::fmt;
use std::ops::Range;

pub use vertices::Vertices;

/// What may happen to a shape without a change of its coordinates (the stored position and
/// orientation apart).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invariance {
    /// Nothing: every motion shows.
    None,
    /// Translations are kept apart, three numbers a component.
    Translation,
    /// Rigid motions are kept apart, six numbers.
    Rigid,
}

/// Coordinates of one kind, and the factor that makes their differences comparable with the others'.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// What they are ("rotation", "scale/shear", ..).
    pub name: &'static str,
    /// Which coordinates.
    pub range: Range<usize>,
}

/// Why a shape has no coordinates, or coordinates no shape. Indices count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum SpaceError {
    /// The system that finds positions is singular at this vertex.
    Singular {
        /// A vertex of the part of the mesh that nothing holds.
        vertex: usize,
    },
    /// The space needs what the mesh does not have.
    Unsuitable {
        /// What is missing, in words.
        reason: String,
    },
}

impl fmt::Display for SpaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SpaceError::Singular { vertex } => write!(
                f,
                "the position system is singular at vertex {}",
                vertex + 1
            ),
            SpaceError::Unsuitable { reason } => f.write_str(reason),
        }
    }
}

impl std::error::Error for SpaceError {}

/// A shape space S of dimension d over one connectivity. Positions are 3V numbers, x y z interleaved.
pub trait ShapeSpace: Send + Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// d, the number of coordinates.
    fn dimension(&self) -> usize;

    /// What leaves the coordinates alone.
    fn invariance(&self) -> Invariance;

    /// The kinds of coordinates, in order, covering 0..d.
    fn blocks(&self) -> Vec<Block>;

    /// Coordinates of a shape. `near`, where given, are the coordinates of a neighbouring shape (the
    /// frame before): whatever has several branches, such as the logarithm of a rotation, takes the
    /// nearest. Coordinates are already scaled by their block's weight.
    ///
    /// # Errors
    /// The shape has no coordinates in this space.
    fn encode(
        &self,
        positions: &[f64],
        near: Option<&[f64]>,
        coordinates: &mut [f64],
    ) -> Result<(), SpaceError>;

    /// The shape of given coordinates. Any coordinates are accepted, also those of no shape: the
    /// nearest shape in the space's own least-squares sense comes back.
    ///
    /// # Errors
    /// The position system is singular.
    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) -> Result<(), SpaceError>;
}
