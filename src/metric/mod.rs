//! How far apart two sequences over the same vertices are, one metric a file. Frames are streamed:
//! a few of each sequence are in memory at a time, and sums are taken in a fixed order.

mod edge_lengths;
mod karni_gotsman;
pub mod smoothness;
mod stream;

use std::fmt;
use std::io;

pub use edge_lengths::{EdgeErrors, EdgeLengths};
pub use karni_gotsman::{KarniGotsman, VertexErrors};
pub use stream::{FramePair, each_block};

use crate::mesh::{Edges, FrameSource};
use crate::task::{Cancelled, Task};

/// Why two sequences could not be compared. Frames count from 0.
#[derive(Debug)]
pub enum MetricError {
    /// They have different numbers of vertices.
    Vertices {
        /// Vertices of the first.
        first: usize,
        /// Vertices of the second.
        second: usize,
    },
    /// They have different numbers of frames.
    Frames {
        /// Frames of the first.
        first: usize,
        /// Frames of the second.
        second: usize,
    },
    /// A frame could not be fetched.
    Read {
        /// Which frame.
        frame: usize,
        /// Why.
        source: io::Error,
    },
    /// The task was cancelled.
    Cancelled,
}

impl fmt::Display for MetricError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            MetricError::Vertices { first, second } => write!(
                f,
                "the first sequence has {first} vertices, the second {second}"
            ),
            MetricError::Frames { first, second } => write!(
                f,
                "the first sequence has {first} frames, the second {second}"
            ),
            MetricError::Read { frame, source } => {
                write!(f, "frame {} cannot be read: {source}", frame + 1)
            }
            MetricError::Cancelled => f.write_str("interrupted"),
        }
    }
}

impl std::error::Error for MetricError {}

impl From<Cancelled> for MetricError {
    fn from(_: Cancelled) -> Self {
        MetricError::Cancelled
    }
}

/// What [`compare`] measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// How many frames were compared.
    pub frames: usize,
    /// Differences of positions.
    pub vertices: VertexErrors,
    /// Differences of edge lengths.
    pub edges: EdgeErrors,
}

/// Compares `second` with the reference `first`, frame by frame; edges are those of `first`.
///
/// # Errors
/// Different numbers of vertices or frames, a frame that cannot be fetched, cancellation.
pub fn compare(
    first: &dyn FrameSource,
    second: &dyn FrameSource,
    task: &Task,
) -> Result<Comparison, MetricError> {
    let mut vertices = KarniGotsman::new(first.topology().vertices());
    let mut edges = EdgeLengths::new(&Edges::new(first.topology()));
    each_block(first, second, task, |block| {
        vertices.add(block);
        edges.add(block);
    })?;
    Ok(Comparison {
        frames: first.frames(),
        vertices: vertices.errors(),
        edges: edges.errors(),
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::mesh::{Sequence, Topology};

    fn sequence(vertices: usize, frames: usize) -> Sequence {
        let topology = Topology::from_triangles(vertices, &[[0, 1, 2]]).unwrap();
        let positions = (0..frames * 3 * vertices).map(|i| i as f32).collect();
        Sequence::new(Arc::new(topology), positions, None)
    }

    #[test]
    fn a_sequence_equals_itself_and_order_of_blocks_does_not_matter() {
        let capture = sequence(5, 37);
        let same = compare(&capture, &capture, &Task::default()).unwrap();
        assert_eq!(same.frames, 37);
        assert_eq!((same.vertices.kg_percent, same.vertices.max), (0.0, 0.0));
        assert_eq!((same.edges.rms_percent, same.edges.max_percent), (0.0, 0.0));
    }

    #[test]
    fn counts_that_differ_are_named() {
        let task = Task::default();
        let error = compare(&sequence(5, 4), &sequence(6, 4), &task).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the first sequence has 5 vertices, the second 6"
        );
        let error = compare(&sequence(5, 4), &sequence(5, 3), &task).unwrap_err();
        assert_eq!(
            error.to_string(),
            "the first sequence has 4 frames, the second 3"
        );
    }

    #[test]
    fn a_cancelled_task_stops_it() {
        let task = Task::default();
        task.cancel();
        let capture = sequence(5, 4);
        assert!(matches!(
            compare(&capture, &capture, &task),
            Err(MetricError::Cancelled)
        ));
    }
}
