//! Refinement of one layout: curve and sites together, in rounds that hold on ever less firmly.

use faer::Mat;

use super::check::{self, Quality};
use super::layout::Candidate;
use super::samples::{Curve, Samples};
use crate::math::b_spline::Point;
use crate::math::uniform_spline::UniformDesign;
use crate::math::variable_projection::{self, Options, Plate, Problem, Refined};
use crate::task::{Cancelled, Task};

/// How far the curve may stray from its layout before that costs [`STRAYING`] of a round's first
/// residual, in radii of the layout: what is held on to for little is let go later.
const STRAY: f64 = 0.1;
const STRAYING: f64 = 0.05;
/// What sites cost that stray by one radius each, of a round's first residual: without it some run
/// tens of radii away and gain nothing.
const SITE_STRAYING: f64 = 0.01;

/// Sites are offered so many places on the curve at most.
const PLACES: usize = 500;

/// Frames nearer than this part of a step are the same.
const AGAIN: f64 = 0.01;

/// One round: how many evaluations, and what the curve's bending costs, of the round's first residual.
/// Wiggles that buy nothing are smoothed away; later rounds must not be biased by it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Round {
    evaluations: usize,
    bending: f64,
}

/// From a layout.
pub(super) const LOOSE: Round = Round {
    evaluations: 15,
    bending: 0.15,
};
/// To the end, for n frames: short motions cost little and are taken further.
pub(super) fn firm(frames: usize) -> Round {
    Round {
        evaluations: (5000 / frames.max(1)).clamp(25, 60),
        bending: 0.025,
    }
}

/// After an exchange of sites: what is not soon better than before will not be.
pub(super) fn after_exchange(frames: usize) -> Round {
    let round = firm(frames);
    Round {
        evaluations: round.evaluations / 2,
        ..round
    }
}

/// While a pin is dragged.
pub(super) const QUICK: Round = Round {
    evaluations: 2,
    bending: 0.025,
};

/// A curve and a plate on their way.
#[derive(Debug, Clone)]
pub(super) struct Draft {
    /// C, k x 2.
    pub(super) controls: Mat<f64>,
    /// g.
    pub(super) plate: Plate,
    /// Where the curve is held, k x 2, and whether it is.
    pub(super) anchor: Mat<f64>,
    pub(super) held: bool,
    /// What each fitted sample's difference is multiplied by, N.
    weights: Vec<f64>,
    pub(super) evaluations: usize,
    pub(super) converged: bool,
}

impl Draft {
    /// The least-squares curve over a layout (through the pins), sites on it where the motion bends, and the
    /// plate of least squares over both.
    pub(super) fn over(
        samples: &Samples,
        curve: &Curve,
        sites: usize,
        candidate: &Candidate,
        pins: &[(usize, Point)],
    ) -> Self {
        let points = samples.dense_layout(candidate.layout.as_ref());
        let controls = curve.fit(points.as_ref(), pins);
        let met = met_again(samples, &samples.frames_on(curve, controls.as_ref()));
        let controls = match pins {
            [] => curve.through_pins(controls, &met),
            _ => controls,
        };
        let sites = curve.points_at(controls.as_ref(), &samples.site_times(sites));
        let mut draft = Draft::at(samples, curve, controls, &sites);
        draft.held = true;
        draft
    }

    /// The plate of least squares over given controls and sites; the curve is not held.
    pub(super) fn at(
        samples: &Samples,
        curve: &Curve,
        controls: Mat<f64>,
        sites: &Mat<f64>,
    ) -> Self {
        let positions = curve.fitted.design().apply(controls.as_ref());
        let targets = samples.dense.as_ref();
        let (positions, weights) = (positions.as_ref(), &samples.weights);
        let plate = variable_projection::fit_plate(positions, targets, weights, sites.as_ref());
        Draft::of(samples, controls, plate)
    }

    /// A curve and a plate as they are; the curve is not held.
    pub(super) fn of(samples: &Samples, controls: Mat<f64>, plate: Plate) -> Self {
        Draft {
            weights: samples.weights.clone(),
            anchor: controls.clone(),
            controls,
            plate,
            held: false,
            evaluations: 0,
            converged: false,
        }
    }

    /// Squared residual at the fitted samples.
    fn residual(&self, samples: &Samples, curve: &Curve) -> f64 {
        let positions = curve.fitted.design().apply(self.controls.as_ref());
        (&samples.dense - self.plate.at(positions.as_ref())).squared_norm_l2()
    }

    /// One round further. The curve keeps passing through what it passes through at `pins`.
    pub(super) fn refined(
        self,
        samples: &Samples,
        curve: &Curve,
        pins: &[(usize, Point)],
        round: Round,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let residual = self.residual(samples, curve);
        let spline = curve.fitted.design();
        let second = second_differences(spline.controls());
        let bent = (&second * &self.controls).squared_norm_l2();
        let price = if bent > 0.0 {
            round.bending * residual / bent
        } else {
            0.0
        };
        let bending = second.transpose() * &second * faer::Scale(price);
        let hold = match self.held {
            true => STRAYING * residual / (samples.dense.nrows() as f64 * STRAY * STRAY),
            false => 0.0,
        };
        let hold = spline.gram() * faer::Scale(hold);
        let fixed = curve.rows_at(pins);
        let problem = Problem {
            spline,
            targets: samples.dense.as_ref(),
            weights: &self.weights,
            anchor: self.anchor.as_ref(),
            hold: hold.as_ref(),
            bending: bending.as_ref(),
            fixed: fixed.as_ref(),
            site_hold: SITE_STRAYING * residual / self.plate.sites.nrows() as f64,
        };
        let options = Options {
            evaluations: round.evaluations,
            ..Options::default()
        };
        let (controls, sites) = (self.controls.as_ref(), self.plate.sites.as_ref());
        let refined = variable_projection::refine(&problem, controls, sites, &options, task)?;
        Ok(self.with(refined))
    }

    fn with(self, refined: Refined) -> Self {
        Draft {
            controls: refined.controls,
            plate: refined.plate,
            evaluations: self.evaluations + refined.evaluations,
            converged: refined.converged,
            ..self
        }
    }

    /// How good it is at the samples and between them.
    pub(super) fn quality(&self, samples: &Samples, curve: &Curve, floor: f64) -> Quality {
        let at = self.value(curve.fitted.design());
        Quality::of(samples, &at, &self.value(&curve.finer), floor)
    }

    /// The same, but samples count more where what is missed is seen.
    pub(super) fn reweighted(mut self, samples: &Samples, curve: &Curve) -> Self {
        let growth = check::growth(samples, &self.value(&curve.finer));
        let weights = self.weights.iter_mut().zip(growth);
        weights.for_each(|(weight, growth)| *weight *= growth);
        let squares: f64 = self.weights.iter().map(|weight| weight * weight).sum();
        let scale = (self.weights.len() as f64 / squares).sqrt();
        self.weights.iter_mut().for_each(|weight| *weight *= scale);
        self
    }

    /// The `count` sites that are missed least go to where on the curve they are wanted most.
    pub(super) fn exchanged(self, samples: &Samples, curve: &Curve, count: usize) -> Self {
        let points = curve.fitted.design().apply(self.controls.as_ref());
        let places = curve.even_points(self.controls.as_ref(), points.nrows().min(PLACES));
        let (points, targets) = (points.as_ref(), samples.dense.as_ref());
        let (weights, sites) = (&self.weights, self.plate.sites.as_ref());
        let places = places.as_ref();
        let sites = variable_projection::exchange(points, targets, weights, sites, count, places);
        let plate = variable_projection::fit_plate(points, targets, weights, sites.as_ref());
        Draft { plate, ..self }
    }

    /// Squared residual at the fitted samples as refinement weighs it.
    pub(super) fn missed(&self, samples: &Samples, curve: &Curve) -> f64 {
        let missed = &samples.dense - self.value(curve.fitted.design());
        let rows = self.weights.iter().enumerate();
        let squares = rows.map(|(row, weight)| (weight * missed.row(row).norm_l2()).powi(2));
        squares.sum()
    }

    /// g(f(t)) at the samples of a design.
    fn value(&self, design: &UniformDesign) -> Mat<f64> {
        let curve = design.apply(self.controls.as_ref());
        self.plate.at(curve.as_ref())
    }
}

/// D with (D C)_i = C_i - 2 C_(i+1) + C_(i+2), (k-2) x k.
fn second_differences(controls: usize) -> Mat<f64> {
    Mat::from_fn(controls - 2, controls, |i, j| match j.wrapping_sub(i) {
        0 | 2 => 1.0,
        1 => -2.0,
        _ => 0.0,
    })
}

/// Where the first and the last frame belong that come again within the motion: `places` of those frames. The
/// curve cuts corners on its way, but not at its ends.
fn met_again(samples: &Samples, places: &Mat<f64>) -> Vec<(usize, Point)> {
    let (last, rate) = (samples.frames - 1, samples.rate);
    let same = |end: usize, frame: usize| {
        let (one, other) = (
            samples.dense.row(end * rate),
            samples.dense.row(frame * rate),
        );
        (one - other).norm_l2() < AGAIN * samples.step
    };
    let met = |end: usize| {
        let again =
            (2..last.max(3) - 1).find(|&frame| end.abs_diff(frame) > 1 && same(end, frame))?;
        Some((end, [places[(again, 0)], places[(again, 1)]]))
    };
    [0, last].into_iter().filter_map(met).collect()
}
