//! Frames over one connectivity.

use std::io;
use std::ops::Range;
use std::sync::Arc;

use super::Topology;

/// Anything that gives frames one at a time: a capture in memory, one spooled to disk, a loom sampled
/// at chosen times. Frames are numbered from 0 here.
pub trait FrameSource: Send + Sync {
    /// The connectivity that all frames share.
    fn topology(&self) -> &Arc<Topology>;

    /// How many frames there are.
    fn frames(&self) -> usize;

    /// Frames per second, where it is known.
    fn fps(&self) -> Option<f64>;

    /// Writes the 3V coordinates of `frame` to `positions`.
    ///
    /// # Errors
    /// The frame could not be fetched (never for frames in memory).
    fn read_frame(&self, frame: usize, positions: &mut [f32]) -> io::Result<()>;
}

/// A capture in memory: n frames of 3V coordinates in one row. Slices share the store.
#[derive(Debug, Clone)]
pub struct Sequence {
    topology: Arc<Topology>,
    positions: Arc<Vec<f32>>,
    range: Range<usize>,
    fps: Option<f64>,
}

impl Sequence {
    /// Frames given as one row of n times 3V coordinates.
    ///
    /// # Panics
    /// `positions` is not a whole number of frames: whoever reads files has checked it.
    pub fn new(topology: Arc<Topology>, positions: Vec<f32>, fps: Option<f64>) -> Self {
        let width = 3 * topology.vertices();
        let frames = positions.len().checked_div(width).unwrap_or(0);
        assert_eq!(
            frames * width,
            positions.len(),
            "positions must be whole frames"
        );
        Sequence {
            topology,
            positions: Arc::new(positions),
            range: 0..frames,
            fps,
        }
    }

    /// The 3V coordinates of `frame`, from 0.
    pub fn frame(&self, frame: usize) -> &[f32] {
        let width = 3 * self.topology.vertices();
        let start = (self.range.start + frame) * width;
        &self.positions[start..start + width]
    }

    /// All coordinates in a row, frame after frame.
    pub fn positions(&self) -> &[f32] {
        let width = 3 * self.topology.vertices();
        &self.positions[self.range.start * width..self.range.end * width]
    }

    /// Frames `range` (from 0, half open) as a sequence that shares the store.
    ///
    /// # Panics
    /// `range` leaves the sequence.
    #[must_use]
    pub fn slice(&self, range: Range<usize>) -> Self {
        assert!(
            range.start <= range.end && range.end <= self.frames(),
            "slice leaves the sequence"
        );
        let start = self.range.start;
        Sequence {
            range: start + range.start..start + range.end,
            ..self.clone()
        }
    }

    /// The same frames at another rate.
    #[must_use]
    pub fn with_fps(mut self, fps: Option<f64>) -> Self {
        self.fps = fps;
        self
    }
}

impl FrameSource for Sequence {
    fn topology(&self) -> &Arc<Topology> {
        &self.topology
    }

    fn frames(&self) -> usize {
        self.range.len()
    }

    fn fps(&self) -> Option<f64> {
        self.fps
    }

    fn read_frame(&self, frame: usize, positions: &mut [f32]) -> io::Result<()> {
        positions.copy_from_slice(self.frame(frame));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slices_count_from_their_own_start() {
        let topology = Arc::new(Topology::from_triangles(1, &[]).unwrap());
        let sequence = Sequence::new(topology, (0..12).map(|i| i as f32).collect(), None);
        let part = sequence.slice(1..4).slice(1..3);
        assert_eq!(part.frames(), 2);
        assert_eq!(part.frame(0), [6.0, 7.0, 8.0]);
        assert_eq!(part.positions(), [6.0, 7.0, 8.0, 9.0, 10.0, 11.0]);
    }
}
