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
//! - `rounds`: again, where that is not enough, with other weights and other sites;
//! - `check`: what is not right between the samples sends the fit back to the next layout in reserve;
//! - `drag`: a few steps from the last state while a pin is moved.
//!
//! The plane is measured in radii of the unpinned layout: its frames have a root mean square distance of
//! 1 from their centre.

mod check;
mod drag;
mod layout;
mod refine;
mod rounds;
mod samples;

use faer::{Mat, MatRef};

use self::layout::{Candidate, Order};
use self::refine::{Draft, LOOSE, firm};
use self::rounds::Rounds;
use self::samples::{Curve, Samples};
use super::b_spline::Point;
use super::layout::Distances;
use super::variable_projection::Plate;
use crate::task::{Cancelled, Task};

pub use check::Quality;
pub use drag::{Drag, Moving};
pub use layout::Choice;

/// A layout is given up for one that promises so many times less deviation: those before it are better
/// maps, and a choice between near equals would change with every frame more.
const CLEARLY: f64 = 1.75;
/// The same for a fit that has a spike: the layout must not depend on the fidelity, unless it ruins a fit.
const RUINED: f64 = 3.0;

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

/// A motion with its samples, and the layout that is refined first.
#[derive(Debug, Clone)]
pub struct Motion {
    ground: Ground,
    chosen: Trial,
}

/// What is fitted.
#[derive(Debug, Clone)]
struct Ground {
    frames: Mat<f64>,
    floor: f64,
    samples: Samples,
    order: Order,
}

/// A layout and what it promises: a short refinement at the usual fidelity (k = .8n, l = .6n).
#[derive(Debug, Clone)]
struct Trial {
    candidate: Candidate,
    draft: Draft,
    quality: Quality,
}

impl Motion {
    /// Lays out `frames` (n x m, n >= 3, m >= 1, not all equal) and chooses a layout: the first that a
    /// short refinement at the usual fidelity makes good, or else the first that is not clearly worse than
    /// another. `floor` is what the m coordinates leave out of the motion, relative to its spread.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn new(frames: MatRef<'_, f64>, floor: f64, task: &Task) -> Result<Self, Cancelled> {
        Ground::new(frames, floor).chosen(task)
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
        let ground = Ground::new(frames, floor);
        let graph = ground.order.graph(before.tau);
        let walked = ground.order.walk(before, &graph, task)?.pop();
        let trial = walked.map(|candidate| ground.tried(candidate, task));
        match trial.transpose()? {
            Some(chosen) if !chosen.quality.spiked => Ok(Motion { ground, chosen }),
            _ => ground.chosen(task),
        }
    }

    /// The chosen layout at the frames, n x 2, before any pins.
    pub fn layout(&self) -> Mat<f64> {
        let layout = self.chosen.candidate.layout.as_ref();
        self.ground.samples.frames_of(layout)
    }

    /// Its radius, the unit of the plane, in units of the motion.
    pub fn radius(&self) -> f64 {
        self.chosen.candidate.natural
    }

    /// Which layout it is.
    pub fn choice(&self) -> Choice {
        self.chosen.candidate.choice
    }

    /// The full fit.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn fit(&self, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
        let ground = &self.ground;
        let first = ground.finished(&self.chosen.candidate, self.begun(options), options, task)?;
        if !first.quality.spiked || !options.pins.is_empty() {
            return Ok(first);
        }
        let mut best = ground.despiked(first, options, task)?;
        ground.visit(task, |candidate| {
            if best.quality.spiked && candidate.choice != self.choice() {
                let other = ground.finished(&candidate, None, options, task)?;
                if RUINED * other.quality.cost() < best.quality.cost() {
                    best = other;
                }
            }
            Ok(best.quality.spiked)
        })?;
        Ok(best)
    }

    /// The trial's curve and plate, where they are what `options` ask for.
    fn begun(&self, options: &Options) -> Option<&Draft> {
        let draft = &self.chosen.draft;
        let size = (draft.controls.nrows(), draft.plate.sites.nrows());
        let asked = (options.controls, options.sites);
        Some(draft).filter(|_| options.pins.is_empty() && size == asked)
    }
}

impl Ground {
    fn new(frames: MatRef<'_, f64>, floor: f64) -> Self {
        let samples = Samples::new(frames);
        Ground {
            frames: frames.to_owned(),
            floor,
            order: Order::new(&samples),
            samples,
        }
    }

    /// Shows `visitor` what is worth trying, the better maps first, as long as it returns true.
    fn visit(
        &self,
        task: &Task,
        mut visitor: impl FnMut(Candidate) -> Result<bool, Cancelled>,
    ) -> Result<(), Cancelled> {
        let mut graphs: Vec<Distances> = Vec::new();
        for tau in layout::REACHES {
            let graph = self.order.graph(tau);
            if graphs.iter().any(|before| layout::alike(before, &graph)) {
                continue;
            }
            for candidate in self.order.candidates(tau, &graph, task)? {
                if !visitor(candidate)? {
                    return Ok(());
                }
            }
            graphs.push(graph);
        }
        Ok(())
    }

    /// The motion with the first candidate that promises to become good, or else the first that is not
    /// clearly worse than another.
    fn chosen(self, task: &Task) -> Result<Motion, Cancelled> {
        let mut trials: Vec<Trial> = Vec::new();
        self.visit(task, |candidate| {
            trials.push(self.tried(candidate, task)?);
            Ok(!trials[trials.len() - 1].quality.promising)
        })?;
        let costs = trials.iter().map(|trial| trial.quality.cost());
        let least = costs.fold(f64::INFINITY, f64::min);
        let close =
            |trial: &Trial| trial.quality.promising || trial.quality.cost() <= CLEARLY * least;
        let first = trials.iter().position(close).unwrap_or(0);
        let chosen = trials.swap_remove(first);
        Ok(Motion {
            ground: self,
            chosen,
        })
    }

    fn tried(&self, candidate: Candidate, task: &Task) -> Result<Trial, Cancelled> {
        let samples = &self.samples;
        let curve = samples.curve(samples.usual_controls());
        let draft = Draft::over(samples, &curve, samples.usual_sites(), &candidate, &[]).refined(
            samples,
            &curve,
            &[],
            LOOSE,
            task,
        )?;
        task.step();
        Ok(Trial {
            quality: draft.quality(samples, &curve, self.floor),
            candidate,
            draft,
        })
    }

    /// Refines one candidate at the wanted fidelity, from where a trial has `begun` if one has.
    fn finished(
        &self,
        candidate: &Candidate,
        begun: Option<&Draft>,
        options: &Options,
        task: &Task,
    ) -> Result<Fit, Cancelled> {
        let (samples, pins) = (&self.samples, &options.pins[..]);
        let curve = samples.curve(options.controls);
        let sample_pins = samples.layout_pins(pins);
        let candidate = self.order.pinned(candidate, &sample_pins, task)?;
        let draft = match begun {
            Some(draft) => draft.clone(),
            None => Draft::over(samples, &curve, options.sites, &candidate, pins)
                .refined(samples, &curve, pins, LOOSE, task)?,
        };
        task.step();
        let rounds = Rounds {
            samples,
            curve: &curve,
            pins,
            floor: self.floor,
            task,
        };
        let draft = rounds.run(draft)?;
        Ok(self.fitted(draft, &curve, &candidate))
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
            radius: candidate.natural,
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
    let draft = Draft::of(&samples, controls, plate);
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
