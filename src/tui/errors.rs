//! How far the vertices of a loom are from those of its capture, as colours.

use super::state::Scene;
use crate::loom::{Loom, Scratch};
use crate::mesh::{FrameSource, Sequence};
use crate::view::heat_colours;

/// Frames from which the scale is taken.
const SAMPLES: usize = 12;
/// The brightest colour stands for so many root mean square distances.
const TOP: f32 = 3.0;

/// Distances between a loom and its capture.
#[derive(Debug)]
pub(super) struct Errors {
    loom: Scene<Loom>,
    capture: Scene<Sequence>,
    /// Distance of the brightest colour.
    top: f32,
    scratch: Scratch,
    positions: Vec<f32>,
    distances: Vec<f32>,
}

impl Errors {
    /// Of a loom whose frames are the capture's.
    pub(super) fn new(loom: &Scene<Loom>, capture: &Scene<Sequence>) -> Self {
        let vertices = loom.of.0.topology().vertices();
        let mut errors = Errors {
            loom: loom.clone(),
            capture: capture.clone(),
            top: 0.0,
            scratch: Scratch::default(),
            positions: vec![0.0; 3 * vertices],
            distances: vec![0.0; vertices],
        };
        errors.top = TOP * errors.mean_distance();
        errors
    }

    /// Whether these are the errors of that loom against that capture.
    pub(super) fn is_of(&self, loom: &Scene<Loom>, capture: &Scene<Sequence>) -> bool {
        self.loom == *loom && self.capture == *capture
    }

    /// Writes a colour for each vertex at the frame nearest to `t`; says what the colours mean.
    pub(super) fn colour(&mut self, t: f64, colours: &mut Vec<[u8; 3]>) -> String {
        let frame = (t.round().max(1.0) as usize - 1).min(self.capture.of.0.frames() - 1);
        self.measure(frame);
        heat_colours(&self.distances, self.top, colours);
        let size = self.size();
        let share = if size > 0.0 {
            100.0 * self.top / size
        } else {
            0.0
        };
        format!(
            " error of frame {}: dark 0, bright {:.2e} ({share:.3} % of the size) ",
            frame + 1,
            self.top
        )
    }

    /// Root mean square over vertices and some of the frames.
    fn mean_distance(&mut self) -> f32 {
        let n = self.capture.of.0.frames();
        let count = n.min(SAMPLES);
        let (mut sum, mut terms) = (0.0_f64, 0);
        for index in 0..count {
            self.measure(index * (n - 1) / (count - 1).max(1));
            sum += self
                .distances
                .iter()
                .map(|d| f64::from(*d).powi(2))
                .sum::<f64>();
            terms += self.distances.len();
        }
        (sum / terms.max(1) as f64).sqrt() as f32
    }

    /// Distances of all vertices at a frame, from 0.
    fn measure(&mut self, frame: usize) {
        let loom = &self.loom.of.0;
        let t = (frame + 1) as f64;
        // The loom has the capture's frames and vertices.
        if loom
            .evaluate(t, &mut self.scratch, &mut self.positions)
            .is_err()
        {
            return;
        }
        let truth = self.capture.of.0.frame(frame);
        let points = self.positions.chunks_exact(3).zip(truth.chunks_exact(3));
        for (distance, (a, b)) in self.distances.iter_mut().zip(points) {
            let square: f32 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
            *distance = square.sqrt();
        }
    }

    fn size(&self) -> f32 {
        let bounds = self.capture.bounds;
        let sides = bounds
            .max
            .iter()
            .zip(bounds.min)
            .map(|(high, low)| high - low);
        sides.map(|side| side * side).sum::<f32>().sqrt()
    }
}
