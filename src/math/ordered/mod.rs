//! Curves and plates for ordered data: a layout that respects the order, refined until the motion is
//! right between its frames too.
//!
//! Input are n points x_i of R^m in their order; what lies between them is taken from the cubic
//! spline S through them. Found are control points C of a uniform clamped cubic B-spline f over
//! \[0, n-1\] and a thin-plate spline g from the plane to R^m with free sites, so that g(f(t)) is near
//! S(t) for *all* t, not for the frames alone:
//!
//! - [`layout`]: the frames are laid out by distances along the motion (geodesics of the order graph),
//!   then walked towards plain distances as long as no saddle between the frames results;
//! - [`refine`]: curve and sites together, by variable projection;
//! - [`check`]: a spike between the samples sends the fit back to the next layout in reserve.
//!
//! The plane is measured in radii of the unpinned layout: its frames have a root mean square distance of
//! 1 from their centre.

mod check;
mod layout;
mod refine;
mod samples;

use faer::{Mat, MatRef};

use self::layout::{Candidate, Order};
use self::refine::{Draft, FIRM, LOOSE, QUICK};
use self::samples::{Curve, Samples};
use super::b_spline::Point;
use super::layout::Stop;
use super::variable_projection::Plate;
use crate::task::{Cancelled, Task};

pub use check::Quality;
pub use layout::Choice;

/// Fidelity of an ordered fit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// k, at least 4.
    pub controls: usize,
    /// l, at least 4.
    pub sites: usize,
    /// Frames (from 0) that stay where they are put, in radii of the unpinned layout.
    pub pins: Vec<(usize, Point)>,
}

/// The fit: f, g and how they were found.
#[derive(Debug, Clone)]
pub struct Fit {
    /// C, k x 2.
    pub controls: Mat<f64>,
    /// g.
    pub plate: Plate,
    /// The layout that was refined, at the frames, n x 2.
    pub layout: Mat<f64>,
    /// Radius of the unpinned layout, the unit of the plane, in units of the motion.
    pub radius: f64,
    /// Which layout it was.
    pub choice: Choice,
    /// How good it is at the samples and between them.
    pub quality: Quality,
    /// Residual evaluations of the refinement.
    pub evaluations: usize,
    /// Whether the refinement had settled.
    pub converged: bool,
}

/// A motion with its samples, and the layouts that are worth refining.
pub struct Motion<'a> {
    frames: MatRef<'a, f64>,
    floor: f64,
    samples: Samples,
    order: Order,
    candidates: Vec<Candidate>,
    /// The candidate that is refined first, and what it was at the usual fidelity.
    chosen: usize,
    trial: Option<Draft>,
}

/// While a pin is dragged the layout is followed for so long.
const FOLLOW: Stop = Stop {
    change: 1e-3,
    steps: 12,
};

impl<'a> Motion<'a> {
    /// Lays out `frames` (n x m, n >= 3, m >= 1, not all equal) and chooses a layout: the first that a
    /// short refinement at the usual fidelity (k = .8n, l = .6n) makes good. `floor` is what the m
    /// coordinates leave out of the motion, relative to its spread.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn new(frames: MatRef<'a, f64>, floor: f64, task: &Task) -> Result<Self, Cancelled> {
        let samples = Samples::new(frames);
        let order = Order::new(&samples);
        let mut motion = Motion {
            candidates: layout::candidates(&order, &samples, floor, task)?,
            frames,
            floor,
            samples,
            order,
            chosen: 0,
            trial: None,
        };
        motion.choose(task)?;
        Ok(motion)
    }

    /// A motion whose layout is known: that of an earlier fit (n x 2, in its radii).
    pub fn known(
        frames: MatRef<'a, f64>,
        floor: f64,
        choice: Choice,
        (layout, radius): (MatRef<'_, f64>, f64),
    ) -> Self {
        let samples = Samples::new(frames);
        let order = Order::new(&samples);
        let layout = samples.layout_of(layout);
        Motion {
            candidates: vec![Candidate::known(choice, layout, radius)],
            frames,
            floor,
            samples,
            order,
            chosen: 0,
            trial: None,
        }
    }

    /// The chosen layout at the frames, n x 2, before any pins.
    pub fn layout(&self) -> Mat<f64> {
        self.samples
            .frames_of(self.candidates[self.chosen].layout.as_ref())
    }

    /// Which layout it is.
    pub fn choice(&self) -> Choice {
        self.candidates[self.chosen].choice
    }

    /// The full fit.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn fit(&self, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let first = self.finish(self.chosen, options, task)?;
        if !first.quality.spiked || !options.pins.is_empty() {
            return Ok(first);
        }
        let mut best = self.despiked(first, options, task)?;
        for candidate in self.chosen + 1..self.candidates.len() {
            if !best.quality.spiked {
                break;
            }
            let other = self.finish(candidate, options, task)?;
            if !other.quality.spiked || other.quality.between < 0.7 * best.quality.between {
                best = other;
            }
        }
        Ok(best)
    }

    /// A few steps from `last` after its pins have moved (or come and gone): the layout follows, and
    /// curve and sites with it.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn drag(&self, last: &Fit, pins: &[(usize, Point)], task: &Task) -> Result<Fit, Cancelled> {
        let samples = &self.samples;
        let curve = samples.curve(last.controls.nrows());
        let before = samples.layout_of(last.layout.as_ref());
        let natural = self.candidates[self.chosen].natural();
        let from = Candidate::known(last.choice, before.clone(), natural);
        let to = self
            .order
            .pinned(&from, &samples.layout_pins(pins), &FOLLOW, task)?;
        let moved = samples.dense_layout((&to.layout - &before).as_ref());
        let controls = &last.controls + curve.fitted.fit(moved.as_ref());
        let controls = curve.through_pins(controls, pins);
        let sites = carried(&last.plate.sites, &before, &to.layout);
        let draft = Draft::at(samples, &curve, controls, &sites);
        let draft = draft.refined(samples, &curve, pins, QUICK, task)?;
        Ok(self.fitted(draft, &curve, &to))
    }

    /// Chooses the first candidate that becomes good; the best of them where none does.
    fn choose(&mut self, task: &Task) -> Result<(), Cancelled> {
        let samples = &self.samples;
        let curve = samples.curve(samples.usual_controls());
        let mut least = f64::INFINITY;
        for (index, candidate) in self.candidates.iter().enumerate() {
            let draft = Draft::over(samples, &curve, samples.usual_sites(), candidate, &[])
                .refined(samples, &curve, &[], LOOSE, task)?;
            let quality = draft.quality(samples, &curve, self.floor);
            task.step();
            // The earlier ones are better maps: they are kept unless another is clearly better.
            if quality.good || quality.between < 0.8 * least {
                least = quality.between;
                self.chosen = index;
                self.trial = Some(draft);
            }
            if quality.good {
                break;
            }
        }
        Ok(())
    }

    /// Refines one candidate at the wanted fidelity.
    fn finish(&self, index: usize, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let (samples, pins) = (&self.samples, &options.pins[..]);
        let curve = samples.curve(options.controls);
        let sample_pins = samples.layout_pins(pins);
        let candidate = self.order.pinned(
            &self.candidates[index],
            &sample_pins,
            &Stop::default(),
            task,
        )?;
        let begun = self.trial.as_ref().filter(|trial| {
            let size = (trial.controls.nrows(), trial.plate.sites.nrows());
            index == self.chosen && pins.is_empty() && size == (options.controls, options.sites)
        });
        let draft = match begun {
            Some(trial) => trial.clone(),
            None => Draft::over(samples, &curve, options.sites, &candidate, pins)
                .refined(samples, &curve, pins, LOOSE, task)?,
        };
        task.step();
        let draft = draft.refined(samples, &curve, pins, FIRM, task)?;
        task.step();
        Ok(self.fitted(draft, &curve, &candidate))
    }

    /// A spiked fit refined once more with twice as many samples: what was between them is now met.
    fn despiked(&self, fit: Fit, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let samples = Samples::at_rate(self.frames, 2 * self.samples.rate);
        let curve = samples.curve(options.controls);
        let controls = fit.controls.clone();
        let draft = Draft::at(&samples, &curve, controls, &fit.plate.sites).refined(
            &samples,
            &curve,
            &[],
            FIRM,
            task,
        )?;
        let quality = draft.quality(&samples, &curve, self.floor);
        if quality.between >= fit.quality.between {
            return Ok(fit);
        }
        Ok(Fit {
            controls: draft.controls,
            plate: draft.plate,
            quality,
            evaluations: fit.evaluations + draft.evaluations,
            converged: draft.converged,
            ..fit
        })
    }

    fn fitted(&self, draft: Draft, curve: &Curve, candidate: &Candidate) -> Fit {
        Fit {
            quality: draft.quality(&self.samples, curve, self.floor),
            layout: self.samples.frames_of(candidate.layout.as_ref()),
            radius: candidate.natural(),
            choice: candidate.choice,
            controls: draft.controls,
            plate: draft.plate,
            evaluations: draft.evaluations,
            converged: draft.converged,
        }
    }
}

/// Lays out and fits in one go; see [`Motion::new`].
///
/// # Errors
/// The task was cancelled.
pub fn fit(
    frames: MatRef<'_, f64>,
    floor: f64,
    options: &Options,
    task: &Task,
) -> Result<Fit, Cancelled> {
    Motion::new(frames, floor, task)?.fit(options, task)
}

/// Sites moved by what the layout's points near them moved (weights 1/distance^2).
fn carried(sites: &Mat<f64>, from: &Mat<f64>, to: &Mat<f64>) -> Mat<f64> {
    let mut carried = sites.clone();
    for j in 0..sites.nrows() {
        let (mut total, mut shift) = (0.0, [0.0; 2]);
        for i in 0..from.nrows() {
            let (dx, dy) = (from[(i, 0)] - sites[(j, 0)], from[(i, 1)] - sites[(j, 1)]);
            let weight = 1.0 / (dx * dx + dy * dy + 1e-6);
            total += weight;
            for a in 0..2 {
                shift[a] += weight * (to[(i, a)] - from[(i, a)]);
            }
        }
        for a in 0..2 {
            carried[(j, a)] += shift[a] / total;
        }
    }
    carried
}

#[cfg(test)]
mod tests;
