//! Where the motion is looked at: frames, samples that are fitted, samples that check the fit.

use faer::prelude::Solve;
use faer::{Mat, MatRef, Side};

use crate::math::b_spline::Point;
use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::uniform_spline::{UniformDesign, UniformFitter};

/// Motions shorter than this are sampled twice as densely.
const SHORT: usize = 64;
/// Up to so many frames the layout itself is made on the fitted samples, not on the frames.
const DENSE_LAYOUT: usize = 120;

/// What a frame counts, for 1 of a sample between frames.
const KNOWN: f64 = 2.25;
/// The density of sites is this power of how much the motion bends, ..
const BENT: f64 = 0.35;
/// .. which counts at least so much of its mean everywhere.
const STRAIGHT: f64 = 0.1;

/// Times and the motion at them.
#[derive(Debug, Clone)]
pub(super) struct Samples {
    /// n.
    pub(super) frames: usize,
    /// Fitted samples an interval: 2, or 4 for a short motion.
    pub(super) rate: usize,
    /// The fitted samples, N x m, N = rate (n-1) + 1.
    pub(super) dense: Mat<f64>,
    /// What each fitted sample's difference is multiplied by, N.
    pub(super) weights: Vec<f64>,
    /// Twice as many to check with.
    pub(super) finer: Mat<f64>,
    /// How many sites belong before each check sample, up to a factor.
    bends: Vec<f64>,
    /// Samples an interval of the layout: 1 or `rate`.
    layout_rate: usize,
    /// The motion at the layout's samples.
    pub(super) laid_out: Mat<f64>,
    /// Norm of the check samples about their mean.
    pub(super) spread: f64,
    /// Root mean square distance between consecutive frames.
    pub(super) step: f64,
    /// Norm of linear interpolation's error at the check samples.
    pub(super) linear: f64,
}

/// Designs of one number of control points at the samples.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    length: f64,
    /// At the fitted samples.
    pub(super) fitted: UniformFitter,
    /// At the check samples.
    pub(super) finer: UniformDesign,
}

impl Samples {
    /// `frames`, n x m, n >= 2.
    pub(super) fn new(frames: MatRef<'_, f64>) -> Self {
        Samples::at_rate(frames, if frames.nrows() < SHORT { 4 } else { 2 })
    }

    /// Half as many, for what must be quick.
    pub(super) fn coarse(frames: MatRef<'_, f64>) -> Self {
        Samples::at_rate(frames, if frames.nrows() < SHORT { 2 } else { 1 })
    }

    /// The same with `rate` fitted samples an interval.
    pub(super) fn at_rate(frames: MatRef<'_, f64>, rate: usize) -> Self {
        let count = frames.nrows();
        let layout_rate = if count > DENSE_LAYOUT { 1 } else { rate };
        let finer = through(frames, &times(count, 2 * rate));
        let chords = Mat::from_fn(finer.nrows(), finer.ncols(), |row, c| {
            let i = (row / (2 * rate)).min(count - 2);
            let x = row as f64 / (2 * rate) as f64 - i as f64;
            (1.0 - x) * frames[(i, c)] + x * frames[(i + 1, c)]
        });
        let mean = mean(finer.as_ref());
        let moved = Mat::from_fn(finer.nrows(), finer.ncols(), |i, c| finer[(i, c)] - mean[c]);
        let steps = (1..count).map(|i| (frames.row(i) - frames.row(i - 1)).squared_norm_l2());
        Samples {
            frames: count,
            rate,
            dense: through(frames, &times(count, rate)),
            weights: weights(count, rate),
            layout_rate,
            laid_out: through(frames, &times(count, layout_rate)),
            spread: moved.norm_l2(),
            step: (steps.sum::<f64>() / (count - 1) as f64).sqrt(),
            linear: (&finer - chords).norm_l2(),
            bends: bends(finer.as_ref()),
            finer,
        }
    }

    /// A layout of the layout's samples at the fitted samples.
    pub(super) fn dense_layout(&self, layout: MatRef<'_, f64>) -> Mat<f64> {
        if self.layout_rate == self.rate {
            return layout.to_owned();
        }
        through(layout, &times(self.frames, self.rate))
    }

    /// A layout of the layout's samples at the frames.
    pub(super) fn frames_of(&self, layout: MatRef<'_, f64>) -> Mat<f64> {
        Mat::from_fn(self.frames, 2, |i, a| layout[(i * self.layout_rate, a)])
    }

    /// Numbers of the frames (n x c) at the fitted samples.
    pub(super) fn dense_of(&self, frames: &Mat<f64>) -> Mat<f64> {
        through(frames.as_ref(), &times(self.frames, self.rate))
    }

    /// Where the frames lie on a curve, n x 2.
    pub(super) fn frames_on(&self, curve: &Curve, controls: MatRef<'_, f64>) -> Mat<f64> {
        let frames = times(self.frames, 1);
        UniformDesign::new(curve.controls(), curve.length, &frames).apply(controls)
    }

    /// Pins of frames as pins of the layout's samples.
    pub(super) fn layout_pins(&self, pins: &[(usize, Point)]) -> Vec<(usize, Point)> {
        let sample = |&(frame, at): &(usize, Point)| (frame * self.layout_rate, at);
        pins.iter().map(sample).collect()
    }

    /// `count` times for sites, both ends among them: closer together where the motion bends.
    pub(super) fn site_times(&self, count: usize) -> Vec<f64> {
        let last = (count.max(2) - 1) as f64;
        let (sums, pace) = (&self.bends, (self.frames - 1) as f64);
        let total = sums[sums.len() - 1];
        let mut at = 0;
        let time = |j: usize| {
            let sought = total * j as f64 / last;
            while at + 2 < sums.len() && sums[at + 1] < sought {
                at += 1;
            }
            let inside = (sought - sums[at]) / (sums[at + 1] - sums[at]);
            pace * (at as f64 + inside.clamp(0.0, 1.0)) / (sums.len() - 1) as f64
        };
        (0..count).map(time).collect()
    }

    /// .8 n control points.
    pub(super) fn usual_controls(&self) -> usize {
        (self.frames * 4 / 5).max(4)
    }

    /// .6 n sites.
    pub(super) fn usual_sites(&self) -> usize {
        (self.frames * 3 / 5).max(4)
    }

    /// Designs for `controls` control points.
    pub(super) fn curve(&self, controls: usize) -> Curve {
        let length = (self.frames - 1) as f64;
        let design = |rate| UniformDesign::new(controls, length, &times(self.frames, rate));
        Curve {
            length,
            fitted: design(self.rate).fitter(),
            finer: design(2 * self.rate),
        }
    }
}

impl Curve {
    /// k.
    pub(super) fn controls(&self) -> usize {
        self.fitted.design().controls()
    }

    /// The curve's points at `count` times evenly spread over its domain.
    pub(super) fn even_points(&self, controls: MatRef<'_, f64>, count: usize) -> Mat<f64> {
        let last = count.max(2) - 1;
        let times: Vec<f64> = (0..count)
            .map(|i| self.length * i as f64 / last as f64)
            .collect();
        self.points_at(controls, &times)
    }

    /// Its points at `times`.
    pub(super) fn points_at(&self, controls: MatRef<'_, f64>, times: &[f64]) -> Mat<f64> {
        UniformDesign::new(controls.nrows(), self.length, times).apply(controls)
    }

    /// The curve nearest to `points` at the fitted samples among those through the pins.
    pub(super) fn fit(&self, points: MatRef<'_, f64>, pins: &[(usize, Point)]) -> Mat<f64> {
        let controls = self.fitted.fit(points);
        self.through_pins(controls, pins)
    }

    /// The curve through the pins that is nearest to that of `controls` at the fitted samples:
    /// C + V J^T (J V J^T)^-1 (pins - J C), V = (A^T A)^-1.
    pub(super) fn through_pins(&self, mut controls: Mat<f64>, pins: &[(usize, Point)]) -> Mat<f64> {
        if pins.is_empty() {
            return controls;
        }
        let rows = self.rows_at(pins);
        let missed = Mat::from_fn(pins.len(), 2, |q, a| pins[q].1[a]) - &rows * &controls;
        let spread = self.fitted.solve(rows.transpose().to_owned());
        let mut gram = &rows * &spread;
        let shift = 1e-13 * gram.norm_max();
        for q in 0..pins.len() {
            gram[(q, q)] += shift;
        }
        if let Ok(factor) = gram.llt(Side::Lower) {
            controls += spread * factor.solve(missed);
        }
        controls
    }

    /// J: the curve's rows at pinned frames, q x k.
    pub(super) fn rows_at(&self, pins: &[(usize, Point)]) -> Mat<f64> {
        let times: Vec<f64> = pins.iter().map(|&(frame, _)| frame as f64).collect();
        let design = UniformDesign::new(self.controls(), self.length, &times);
        design.apply(Mat::identity(self.controls(), self.controls()).as_ref())
    }
}

/// The C2 cubic spline without a knot at the first and last inner frame ("not a knot") through `frames`
/// (n x c) at 0, 1, .., n-1: its values at `times`, one row each.
pub(super) fn through(frames: MatRef<'_, f64>, times: &[f64]) -> Mat<f64> {
    let width = frames.ncols();
    let knots: Vec<f64> = (0..frames.nrows()).map(|i| i as f64).collect();
    let mut found = Mat::zeros(times.len(), width);
    let Ok(spline) = CubicSpline::new(&knots, &rows(frames), width, Ends::NotAKnot) else {
        return found;
    };
    let mut value = vec![0.0; width];
    for (row, &time) in times.iter().enumerate() {
        spline.evaluate(time, &mut value);
        for (c, value) in value.iter().enumerate() {
            found[(row, c)] = *value;
        }
    }
    found
}

/// The entries of a matrix row after row.
pub(super) fn rows(matrix: MatRef<'_, f64>) -> Vec<f64> {
    let width = matrix.ncols();
    (0..matrix.nrows() * width)
        .map(|at| matrix[(at / width, at % width)])
        .collect()
}

/// Weights of the fitted samples, 1 in root mean square: frames are known, what lies between them is a
/// spline's guess.
fn weights(frames: usize, rate: usize) -> Vec<f64> {
    let rows = rate * (frames - 1) + 1;
    let squares = KNOWN * KNOWN * frames as f64 + (rows - frames) as f64;
    let scale = (rows as f64 / squares).sqrt();
    let weight = |row: usize| if row.is_multiple_of(rate) { KNOWN } else { 1.0 };
    (0..rows).map(|row| scale * weight(row)).collect()
}

/// Sums of the density of sites up to each of `samples`: powers of second differences over two steps.
fn bends(samples: MatRef<'_, f64>) -> Vec<f64> {
    let last = samples.nrows() - 1;
    let bend = |i: usize| {
        let i = i.clamp(2.min(last), last.saturating_sub(2));
        let (before, after) = (i.saturating_sub(2), (i + 2).min(last));
        let chord = samples.row(before) + samples.row(after);
        (chord - samples.row(i) * faer::Scale(2.0)).norm_l2()
    };
    let bend: Vec<f64> = (0..=last).map(bend).collect();
    let mean = bend.iter().sum::<f64>() / bend.len() as f64;
    let density = |bend: &f64| match mean > 0.0 {
        true => libm::pow(bend / mean + STRAIGHT, BENT),
        false => 1.0,
    };
    let density: Vec<f64> = bend.iter().map(density).collect();
    let mut sums = vec![0.0];
    for pair in density.windows(2) {
        sums.push(sums[sums.len() - 1] + 0.5 * (pair[0] + pair[1]));
    }
    sums
}

/// `rate` times an interval over \[0, n-1\], the frames included.
fn times(frames: usize, rate: usize) -> Vec<f64> {
    (0..=rate * (frames - 1))
        .map(|i| i as f64 / rate as f64)
        .collect()
}

/// Mean of each column.
pub(super) fn mean(matrix: MatRef<'_, f64>) -> Vec<f64> {
    let rows = matrix.nrows().max(1) as f64;
    (0..matrix.ncols())
        .map(|c| matrix.col(c).sum() / rows)
        .collect()
}
