//! Curves and plates for ordered data: a layout that respects the order, refined until the motion is
//! right between its frames too.
//!
//! Input are n points x_i of R^m in their order; what lies between them is taken from the cubic
//! spline S through them. Found are control points C of a uniform clamped cubic B-spline f over
//! \[0, n-1\] and a thin-plate spline g from the plane to R^m with free sites, so that g(f(t)) is near
//! S(t) for *all* t, not for the frames alone:
//!
//! - `layout`: the frames are laid out by distances along the motion (geodesics of the order graph),
//!   then walked towards plain distances as long as no saddle between the frames results;
//! - `refine`: curve and sites together, by variable projection;
//! - `check`: what is not right between the samples sends the fit back to the next layout in reserve;
//! - `drag`: a few steps from the last state while a pin is moved.
//!
//! The plane is measured in radii of the unpinned layout: its frames have a root mean square distance of
//! 1 from their centre.

mod check;
mod drag;
mod layout;
mod refine;
mod samples;

use faer::{Mat, MatRef};

use self::layout::{Candidate, Order};
use self::refine::{Draft, LOOSE, firm};
use self::samples::{Curve, Samples};
use super::b_spline::Point;
use super::variable_projection::Plate;
use crate::task::{Cancelled, Task};

pub use check::Quality;
pub use drag::{Drag, Moving};
pub use layout::Choice;

/// A later candidate is taken only where it costs so many times less: the earlier ones are better maps,
/// and a choice between equals would change with every frame more.
const CLEARLY: f64 = 0.8;

/// So many rounds more are spent on a fit that is not yet right.
const AGAIN: usize = 4;

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
#[derive(Debug, Clone)]
pub struct Motion {
    frames: Mat<f64>,
    floor: f64,
    samples: Samples,
    order: Order,
    candidates: Vec<Candidate>,
    /// The candidate that is refined first, and what it was at the usual fidelity.
    chosen: usize,
    trial: Option<Draft>,
}

impl Motion {
    /// Lays out `frames` (n x m, n >= 3, m >= 1, not all equal) and chooses a layout: the first that a
    /// short refinement at the usual fidelity (k = .8n, l = .6n) makes good. `floor` is what the m
    /// coordinates leave out of the motion, relative to its spread.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn new(frames: MatRef<'_, f64>, floor: f64, task: &Task) -> Result<Self, Cancelled> {
        let samples = Samples::new(frames);
        let order = Order::new(&samples);
        let mut motion = Motion {
            candidates: layout::candidates(&order, &samples, floor, task)?,
            frames: frames.to_owned(),
            floor,
            samples,
            order,
            chosen: 0,
            trial: None,
        };
        motion.choose(task)?;
        Ok(motion)
    }

    /// The same, but with a layout chosen `before` (for other fidelity, or nearly the same frames) kept
    /// unless it has a spike now: a map that somebody knows does not change for a little.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn near(
        frames: MatRef<'_, f64>,
        floor: f64,
        before: Choice,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let samples = Samples::new(frames);
        let order = Order::new(&samples);
        let mut motion = Motion {
            candidates: vec![layout::known(&order, &samples, before, task)?],
            frames: frames.to_owned(),
            floor,
            samples,
            order,
            chosen: 0,
            trial: None,
        };
        let quality = motion.choose(task)?;
        if quality.is_some_and(|quality| !quality.spiked) {
            return Ok(motion);
        }
        Motion::new(frames, floor, task)
    }

    /// The chosen layout at the frames, n x 2, before any pins.
    pub fn layout(&self) -> Mat<f64> {
        self.samples
            .frames_of(self.candidates[self.chosen].layout.as_ref())
    }

    /// Its radius, the unit of the plane, in units of the motion.
    pub fn radius(&self) -> f64 {
        self.candidates[self.chosen].natural()
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

    /// Chooses the first candidate that promises to become good; the best of them where none does.
    /// Returns how good it is.
    fn choose(&mut self, task: &Task) -> Result<Option<Quality>, Cancelled> {
        let samples = &self.samples;
        let curve = samples.curve(samples.usual_controls());
        let mut chosen: Option<Quality> = None;
        for (index, candidate) in self.candidates.iter().enumerate() {
            let draft = Draft::over(samples, &curve, samples.usual_sites(), candidate, &[])
                .refined(samples, &curve, &[], LOOSE, task)?;
            let quality = draft.quality(samples, &curve, self.floor);
            task.step();
            // The earlier ones are better maps: they are kept unless another is clearly better.
            if quality.promising || chosen.is_none_or(|best| quality.cost() < CLEARLY * best.cost())
            {
                chosen = Some(quality);
                self.chosen = index;
                self.trial = Some(draft);
            }
            if quality.promising {
                break;
            }
        }
        Ok(chosen)
    }

    /// Refines one candidate at the wanted fidelity.
    fn finish(&self, index: usize, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let (samples, pins) = (&self.samples, &options.pins[..]);
        let curve = samples.curve(options.controls);
        let sample_pins = samples.layout_pins(pins);
        let candidate = self
            .order
            .pinned(&self.candidates[index], &sample_pins, task)?;
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
        let draft = self.firm(draft, &curve, pins, task)?;
        task.step();
        Ok(self.fitted(draft, &curve, &candidate))
    }

    /// Refined to the end: once more, held less firmly, as long as frames or what lies between them are
    /// not met and that helps.
    fn firm(
        &self,
        draft: Draft,
        curve: &Curve,
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Draft, Cancelled> {
        let (samples, round) = (&self.samples, firm(self.samples.frames));
        let mut draft = draft.refined(samples, curve, pins, round, task)?;
        for _ in 0..AGAIN {
            let before = draft.quality(samples, curve, self.floor);
            if before.is_settled(self.floor) {
                break;
            }
            let next = draft.clone().refined(samples, curve, pins, round, task)?;
            let after = next.quality(samples, curve, self.floor);
            if after.between >= before.between && after.at_frames >= before.at_frames {
                break;
            }
            draft = next;
        }
        Ok(draft)
    }

    /// A spiked fit refined once more with twice as many samples: what was between them is now met.
    fn despiked(&self, fit: Fit, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let samples = Samples::at_rate(self.frames.as_ref(), 2 * self.samples.rate);
        let curve = samples.curve(options.controls);
        let controls = fit.controls.clone();
        let draft = Draft::at(&samples, &curve, controls, &fit.plate.sites).refined(
            &samples,
            &curve,
            &[],
            firm(samples.frames),
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

/// The fit whose plane is that of the two leading coordinates, g being the identity there (and 0 in the
/// others): for `frames` (n x m, n >= 2) with m <= 2, where nothing between them can go wrong, or with
/// fewer sites than a surface needs. Its unit is that of the motion; three sites without weight lie on
/// the curve of `controls` control points (>= 4).
pub fn flat(frames: MatRef<'_, f64>, floor: f64, controls: usize) -> Fit {
    let samples = Samples::new(frames);
    let curve = samples.curve(controls);
    let leading = |of: MatRef<'_, f64>| {
        let width = of.ncols();
        Mat::from_fn(
            of.nrows(),
            2,
            |i, a| if a < width { of[(i, a)] } else { 0.0 },
        )
    };
    let controls = curve.fitted.fit(leading(samples.dense.as_ref()).as_ref());
    let mut plate = Plate::zero(3, frames.ncols());
    plate.sites = curve.even_points(controls.as_ref(), 3);
    for a in 0..frames.ncols().min(2) {
        plate.affine[(1 + a, a)] = 1.0;
    }
    let draft = Draft::of(controls, plate);
    Fit {
        quality: draft.quality(&samples, &curve, floor),
        layout: leading(frames),
        radius: 1.0,
        choice: Choice {
            tau: 0.0,
            theta: 0.0,
        },
        controls: draft.controls,
        plate: draft.plate,
        evaluations: 0,
        converged: true,
    }
}

impl Fit {
    /// Moves the plane: every place by `shift` radii, the motion unchanged.
    pub fn shift(&mut self, shift: Point) {
        for a in 0..2 {
            for places in [&mut self.controls, &mut self.plate.sites, &mut self.layout] {
                let places = places.col_as_slice_mut(a);
                places.iter_mut().for_each(|x| *x += shift[a]);
            }
            for c in 0..self.plate.affine.ncols() {
                self.plate.affine[(0, c)] -= shift[a] * self.plate.affine[(1 + a, c)];
            }
        }
    }
}

#[cfg(test)]
mod tests;
