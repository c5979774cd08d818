//! Shape spaces (CH12 §5): a shape as one point of a Euclidean space. A space is made for one
//! connectivity and one reference pose; factors are computed then and shared ([`Spaces`]).
//!
//! # Laws, tested over every space in `tests/space_laws.rs`
//! - `decode(encode(v)) = v` to 1e-6 of the bounding box, position and orientation included;
//! - coordinates do not change (1e-9) under what [`Invariance`] promises, the named blocks apart;
//! - a straight path between the coordinates of a pose and of its copy turned by 179 degrees is a rigid
//!   motion (1e-6), except in `vertices`;
//! - between a bar and its copy bent by 170 degrees edges keep their lengths to 2 % halfway, except in
//!   `vertices`;
//! - the sum of squares of a coordinate difference is comparable between the blocks, and with the sum
//!   over all vertices of their squared displacements: see [`Block`].

mod gradients;
mod lengths_angles;
mod living;
mod lri;
mod orientation;
mod patch_lri;
mod patching;
mod placement;
mod refine;
mod registry;
mod scales;
mod sequence;
mod straight;
mod vertices;

use std::fmt;
use std::ops::Range;

use crate::diag::Diagnostic;
use crate::math::sparse::SparseError;

pub use gradients::Gradients;
pub use lengths_angles::LengthsAngles;
pub use lri::Lri;
pub use patch_lri::{CoarsePatchLri, PatchLri};
pub use patching::Fine;
pub use registry::{SPACES, SpaceKind, Spaces, State};
pub use sequence::{LARGE_TURN, encode_frames, follow_frames};
pub use straight::StraightPath;
pub use vertices::Vertices;

/// What may happen to a shape without a change of its coordinates (the stored position and
/// orientation apart).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Invariance {
    /// Nothing: every motion shows.
    None,
    /// Rigid motions: they show in the blocks [`MEAN_ROTATION`] and [`MEAN_VERTEX`] only, six numbers.
    Rigid,
}

/// The name of the block that carries a shape's orientation against the reference pose.
pub const MEAN_ROTATION: &str = "mean rotation";

/// The name of the block that carries a shape's position.
pub const MEAN_VERTEX: &str = "mean vertex";

/// Coordinates of one kind, and the factor that makes their differences comparable with the others'.
///
/// Weights are lengths: a change that happens everywhere at once (a turn by a small angle, a stretch by
/// a small factor, a shift) counts as the root of the sum of the squared displacements of all vertices
/// that it causes. Within a block, triangles count by area, edges by squared length and pairs of patches by the area that
/// turns with them.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    /// What they are ("rotation", "scale/shear", ..).
    pub name: &'static str,
    /// Which coordinates.
    pub range: Range<usize>,
    /// By what the bare quantities (radians, ratios, lengths) are multiplied.
    pub weight: f64,
}

/// Why there is no space for a mesh. Indices count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum SpaceError {
    /// The system that finds positions is singular at this vertex: the reference pose there has numbers
    /// that are not finite, or sizes beyond double precision.
    Singular {
        /// A vertex of the part of the mesh that nothing holds.
        vertex: usize,
        /// Which of the mesh's connected parts it lies in and how many there are, where they were told
        /// apart.
        part: Option<[usize; 2]>,
    },
    /// The factors do not fit in memory.
    TooLarge,
    /// The space needs what the mesh or the stored state does not have.
    Unsuitable {
        /// What is missing, in words.
        reason: String,
    },
}

impl fmt::Display for SpaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SpaceError::Singular { vertex, part } => {
                write!(
                    f,
                    "the position system is singular at vertex {}",
                    vertex + 1
                )?;
                match part {
                    Some([part, parts]) if *parts > 1 => {
                        write!(f, ", in part {} of {parts}", part + 1)
                    }
                    _ => Ok(()),
                }
            }
            SpaceError::TooLarge => f.write_str("the mesh is too large for this machine"),
            SpaceError::Unsuitable { reason } => f.write_str(reason),
        }
    }
}

impl std::error::Error for SpaceError {}

/// As something to tell a person, with the vertex counted from 1.
impl From<SpaceError> for Box<Diagnostic> {
    fn from(error: SpaceError) -> Self {
        let diagnostic = Diagnostic::error(error.to_string());
        Box::new(match error {
            SpaceError::Singular { vertex, .. } => diagnostic
                .at_vertex(vertex + 1)
                .hint("the reference pose has numbers there that are not finite or far too large"),
            SpaceError::TooLarge | SpaceError::Unsuitable { .. } => diagnostic,
        })
    }
}

impl SpaceError {
    /// Why there is no system for the rotations of `nodes` ("patch", ..), which are no vertices.
    fn of_rotations(error: SparseError, nodes: &str) -> Self {
        match error {
            SparseError::TooLarge => SpaceError::TooLarge,
            SparseError::NotPositiveDefinite { unknown } => SpaceError::Unsuitable {
                reason: format!(
                    "the system of rotations is singular at {nodes} {}",
                    unknown + 1
                ),
            },
        }
    }
}

impl From<SparseError> for SpaceError {
    fn from(error: SparseError) -> Self {
        match error {
            SparseError::NotPositiveDefinite { unknown } => SpaceError::Singular {
                vertex: unknown,
                part: None,
            },
            SparseError::TooLarge => SpaceError::TooLarge,
        }
    }
}

/// A shape space S of dimension d over one connectivity. Positions are 3V numbers, x y z interleaved.
///
/// Encoding and decoding keep their working memory inside and may be called from many threads at once;
/// one call uses several threads by itself, with the same bits on any number of them.
pub trait ShapeSpace: Send + Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// d, the number of coordinates.
    fn dimension(&self) -> usize;

    /// What leaves the coordinates alone.
    fn invariance(&self) -> Invariance;

    /// The kinds of coordinates, in order, covering 0..d.
    fn blocks(&self) -> Vec<Block>;

    /// What the space is made of besides connectivity: [`Spaces::restore`] makes it again.
    fn state(&self) -> State;

    /// Coordinates of a shape, scaled by their weights. What has several branches (the logarithm of a
    /// rotation, an angle) takes the principal one, or the one nearest the reference pose's.
    ///
    /// # Panics
    /// `positions` is not 3V or `coordinates` not d long.
    fn encode(&self, positions: &[f64], coordinates: &mut [f64]);

    /// Moves the coordinates of a shape to the branch nearest `near`, the coordinates of its neighbour
    /// in a sequence; the shape stays. Gives the number of rotations that differ from their neighbour's
    /// by more than [`LARGE_TURN`] even so: there the path between the two shapes is a guess.
    fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let _ = (near, coordinates);
        0
    }

    /// The shape of given coordinates. Any coordinates are accepted, also those of no shape: the
    /// nearest shape in the space's own least-squares sense comes back.
    ///
    /// # Panics
    /// `coordinates` is not d or `positions` not 3V long.
    fn decode(&self, coordinates: &[f64], positions: &mut [f64]);

    /// Whether coordinates are the positions themselves, so that [`ShapeSpace::decode`] may be skipped.
    fn is_identity(&self) -> bool {
        false
    }
}
