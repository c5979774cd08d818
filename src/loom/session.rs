//! Moving pins about: everything that does not change is kept between one place and the next.

use std::sync::Arc;

use super::ch12::{self, Signals};
use super::fit::Method;
use super::ordered::Laid;
use super::ordered::drag::Drag;
use super::pins::{self, Pin, PinPlace};
use super::report::FitReport;
use super::subspace::Subspace;
use super::{Layout as Fitted, Loom, Parts};
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::layout::{Distances, Layout};
use crate::signal::pose::PoseSignal;
use crate::task::Task;

/// A fit whose pins are being moved. While one is dragged ([`Session::drag`]) the layout starts from where
/// it was and the sites stay at their frames; when it is let go ([`Session::settle`]) everything is
/// solved as a fit with these pins would.
#[derive(Debug, Clone)]
pub struct Session {
    subspace: Subspace,
    distances: Distances,
    alpha: f64,
    pins: Vec<(usize, Point)>,
    layout: Layout,
    pose: PoseSignal,
    controls: usize,
    /// What follows the pins of an ordered fit.
    ordered: Option<Drag>,
    /// Distinct positions, and the error that merging the others makes, when sites were last chosen.
    merged: (usize, f64),
}

impl Session {
    /// Of a fit: its subspace and signals, the pins it was made under (frames from 0) and the exponent of
    /// its parametrisation. k and l stay what they are.
    pub fn new(
        subspace: Subspace,
        signals: &Signals,
        pins: Vec<(usize, Point)>,
        alpha: f64,
    ) -> Self {
        Session {
            distances: subspace.distances(),
            alpha,
            pins,
            layout: signals.layout.clone(),
            pose: signals.pose.clone(),
            controls: signals.time.controls().len(),
            merged: (signals.distinct, signals.merged),
            ordered: Drag::new(&subspace, &signals.time, &signals.pose, signals.ordered),
            subspace,
        }
    }

    /// Of a loom as it was fitted.
    ///
    /// # Errors
    /// The loom's time was edited since, or its signals were not fitted to frames: a new layout would
    /// undo that.
    pub fn of(loom: &Loom) -> Result<Self> {
        let (fitted, report, time) = (loom.layout(), loom.report(), loom.time());
        let frames = fitted.positions.len();
        if frames == 0
            || !Method::ALL
                .iter()
                .any(|method| method.name() == report.method)
        {
            return Diagnostic::error("this loom has no layout of frames to pin")
                .hint("pins belong to looms that were fitted to frames")
                .err();
        }
        if time.places().len() != frames || !time.warps().is_empty() {
            return Diagnostic::error(
                "this loom was edited since it was fitted: pins would undo that",
            )
            .hint("pin first, then edit the time or add poses")
            .err();
        }
        let modes = loom.shape().modes();
        // ||Y||^2 = ||X||^2 + residual^2, of which the report has the ratio
        let inside: f64 = fitted.coordinates.iter().map(|x| x * x).sum();
        let left_out = report.error.shape;
        let spread = (inside / (1.0 - left_out * left_out).max(f64::MIN_POSITIVE)).sqrt();
        let subspace = Subspace {
            frames,
            modes,
            x: fitted.coordinates.clone(),
            spread,
            residual: left_out * spread,
            residuals: fitted.residuals.clone(),
        };
        Ok(Session {
            distances: subspace.distances(),
            alpha: report.alpha,
            pins: fitted.pins.clone(),
            layout: Layout {
                positions: fitted.positions.clone(),
                stress: 0.0,
                relative_stress: report.stress,
                steps: report.layout.steps,
                converged: report.layout.converged,
            },
            pose: loom.pose().as_ref().clone(),
            controls: time.controls().len(),
            merged: (frames - report.merged.frames, report.merged.error * spread),
            ordered: Drag::new(&subspace, time, loom.pose(), report.ordered),
            subspace,
        })
    }

    /// `loom` with these signals, found for its frames under the present pins, and a report of them.
    ///
    /// # Errors
    /// The signals are not of the loom's shape subspace.
    pub fn loom(&self, loom: &Loom, signals: Signals) -> Result<Loom> {
        let before = loom.report();
        let report = FitReport {
            vertices: before.vertices,
            faces: before.faces,
            space: before.space.clone(),
            dimension: before.dimension,
            fps: before.fps,
            left_out: before.left_out,
            warnings: before.warnings.clone(),
            method: before.method.clone(),
            alpha: before.alpha,
            rank: before.rank,
            ..FitReport::of_signals(&self.subspace, &signals, self.pins.len())
        };
        Loom::new(Parts {
            layout: Arc::new(Fitted {
                positions: signals.layout.positions,
                coordinates: self.subspace.x.clone(),
                residuals: self.subspace.residuals.clone(),
                pins: self.pins.clone(),
            }),
            pose: Arc::new(signals.pose),
            time: Arc::new(signals.time),
            report: Arc::new(report),
            ..loom.parts()
        })
    }

    /// The pins, frames from 0.
    pub fn pins(&self) -> &[(usize, Point)] {
        &self.pins
    }

    /// Where the frames lie now.
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Holds `frame` (from 0) at `to`, whether it was held before or not, and gives the signals near by.
    ///
    /// # Errors
    /// There is no such frame, or `to` is not finite; the task was cancelled.
    pub fn drag(&mut self, frame: usize, to: Point, task: &Task) -> Result<Signals> {
        self.hold(frame, to)?;
        if let Some(ordered) = &mut self.ordered {
            let signals = ordered.to(&self.subspace, &self.pins, task)?;
            self.layout = signals.layout.clone();
            self.pose = signals.pose.clone();
            return Ok(signals);
        }
        let start = &self.layout.positions;
        let layout = ch12::place_from(&self.distances, start, &self.pins, task)?;
        let rows = ch12::rows(&self.subspace, &layout.positions);
        let pose = match self.pose.site_frames() {
            [] => self.pose.clone(),
            _ => self.pose.refit(&rows).map_err(ch12::unfit)?,
        };
        self.layout = layout;
        self.pose = pose;
        self.signals()
    }

    /// Holds `frame` (from 0) at `to` without solving anything.
    ///
    /// # Errors
    /// There is no such frame, or `to` is not finite.
    pub fn hold(&mut self, frame: usize, to: Point) -> Result<()> {
        let at = PinPlace::Layout(to);
        let pin = Pin {
            frame: frame + 1,
            at,
        };
        pins::check(&[pin], self.subspace.frames)?;
        self.release(frame);
        self.pins.push((frame, to));
        Ok(())
    }

    /// Lets `frame` (from 0) go, without solving anything; nothing where it was not held.
    pub fn release(&mut self, frame: usize) {
        self.pins.retain(|&(held, _)| held != frame);
    }

    /// The signals of a fit under the present pins: sites chosen anew, k and l as before. The layout starts
    /// from the leading coordinates; that of an ordered fit keeps its tau and theta, so that the map stays
    /// the one that is known.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn settle(&mut self, task: &Task) -> Result<Signals> {
        if self.ordered.is_some() {
            return self.settle_ordered(task);
        }
        let start = self.subspace.leading();
        self.layout = ch12::place_from(&self.distances, &start, &self.pins, task)?;
        let sites = self.pose.sites().len();
        let fit = ch12::pose(&self.subspace, &self.layout.positions, sites)?;
        self.pose = fit.signal;
        self.merged = (fit.distinct, fit.spread);
        self.signals()
    }

    fn settle_ordered(&mut self, task: &Task) -> Result<Signals> {
        let pins: Vec<Pin> = self
            .pins
            .iter()
            .map(|&(frame, to)| Pin::at(frame, to))
            .collect();
        let sites = self.pose.sites().len();
        let near = self.ordered.as_ref().map(Drag::choice);
        let laid = Laid::out(&self.subspace, near, task)?;
        let signals = laid.signals(self.controls, sites, &pins, task)?;
        self.layout = signals.layout.clone();
        self.pose = signals.pose.clone();
        let (time, pose) = (&signals.time, &signals.pose);
        self.ordered = Drag::new(&self.subspace, time, pose, signals.ordered);
        Ok(signals)
    }

    fn signals(&self) -> Result<Signals> {
        let (distinct, merged) = self.merged;
        Ok(Signals {
            layout: self.layout.clone(),
            pose: self.pose.clone(),
            time: ch12::time_within(&self.layout.positions, self.controls, self.alpha)?,
            distinct,
            merged,
            ordered: None,
        })
    }
}
