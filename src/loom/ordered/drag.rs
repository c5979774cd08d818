//! A pin in motion, on an ordered fit: tau and theta stay, and a few refinement steps run from the last
//! state.

use super::{matrix, positions};
use crate::diag::Result;
use crate::loom::ch12::Signals;
use crate::loom::report::Ordered;
use crate::loom::subspace::Subspace;
use crate::math::b_spline::Point;
use crate::math::ordered::{Drag as Following, Moving};
use crate::math::variable_projection::Plate;
use crate::signal::pose::PoseSignal;
use crate::signal::time::TimeSignal;
use crate::task::Task;

use faer::Mat;

/// Curve and plate while pins move.
#[derive(Debug, Clone)]
pub struct Drag {
    following: Following,
    controls: Mat<f64>,
    plate: Plate,
    ordered: Ordered,
}

impl Drag {
    /// From signals of an ordered fit to `subspace`; None where they are CH12's, or nothing moves.
    pub fn new(
        subspace: &Subspace,
        time: &TimeSignal,
        pose: &PoseSignal,
        ordered: Option<Ordered>,
    ) -> Option<Self> {
        let ordered = ordered?;
        let controls = time.controls();
        let unit = ordered.radius;
        let controls = Mat::from_fn(controls.len(), 2, |i, a| controls[i][a] / unit);
        let plate = plate(pose, unit);
        let floor = subspace.relative(subspace.residual);
        Some(Drag {
            following: Following::new(matrix(subspace).as_ref(), floor, controls.as_ref()),
            controls,
            plate,
            ordered,
        })
    }

    /// (tau, theta), which stay.
    pub fn choice(&self) -> (f64, f64) {
        (self.ordered.tau, self.ordered.theta)
    }

    /// Signals with the `pins` (frames from 0) held, near those before.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn to(
        &mut self,
        subspace: &Subspace,
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Signals> {
        let unit = self.ordered.radius;
        let pins: Vec<(usize, Point)> = pins
            .iter()
            .map(|&(frame, at)| (frame, at.map(|x| x / unit)))
            .collect();
        let last = (self.controls.as_ref(), &self.plate);
        let Moving {
            controls,
            plate,
            quality,
        } = self.following.to(last, &pins, task)?;
        (self.controls, self.plate) = (controls, plate);
        self.ordered = Ordered {
            at_samples: quality.at_samples,
            between: quality.between,
            worst: quality.worst,
            ..self.ordered
        };
        let controls = positions(self.controls.as_ref(), unit);
        super::assembled(subspace, controls, &self.plate, unit, Some(self.ordered))
    }
}

/// The plate of signals for positions in `unit`s.
fn plate(pose: &PoseSignal, unit: f64) -> Plate {
    let plate = pose.plate();
    let width = plate.width();
    // Ordered fits keep their plate in units of the layout about the origin.
    debug_assert!(plate.frame() == ([0.0; 2], unit));
    let rows = |numbers: &[f64], count: usize| {
        Mat::from_fn(count, width, |row, c| numbers[row * width + c])
    };
    let sites = plate.sites();
    Plate {
        sites: Mat::from_fn(sites.len(), 2, |j, a| sites[j][a] / unit),
        weights: rows(plate.weights(), sites.len()),
        affine: rows(plate.affine(), 3),
    }
}
