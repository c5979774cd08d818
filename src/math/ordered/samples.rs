//! Where the motion is looked at: frames, samples that are fitted, samples that check the fit.

use faer::{Mat, MatRef};

use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::uniform_spline::{UniformDesign, UniformFitter};

/// Up to so many samples the layout itself is made on the fitted samples, not on the frames.
const DENSE_LAYOUT: usize = 120;

/// Times and the motion at them.
pub(super) struct Samples {
    /// n.
    pub(super) frames: usize,
    /// Fitted samples an interval: 2, or 4 for a short motion.
    pub(super) rate: usize,
    /// The fitted samples, N x m, N = rate (n-1) + 1.
    pub(super) dense: Mat<f64>,
    /// Twice as many to check with.
    pub(super) finer: Mat<f64>,
    /// Samples an interval of the layout: 1 or `rate`.
    pub(super) layout_rate: usize,
    /// The motion at the layout's samples.
    pub(super) laid_out: Mat<f64>,
    /// Norm of the check samples about their mean.
    pub(super) spread: f64,
    /// Norm of linear interpolation's error at the check samples.
    pub(super) linear: f64,
}

/// Designs of one number of control points at the samples.
pub(super) struct Curve {
    length: f64,
    /// At the fitted samples.
    pub(super) fitted: UniformFitter,
    /// At the check samples.
    pub(super) finer: UniformDesign,
}

impl Samples {
    pub(super) fn new(frames: MatRef<'_, f64>) -> Self {
        let count = frames.nrows();
        let rate = if count < 64 { 4 } else { 2 };
        let layout_rate = if count > DENSE_LAYOUT { 1 } else { rate };
        let finer_times = times(count, 2 * rate);
        let finer = through(frames, &finer_times);
        let chord = Mat::from_fn(finer.nrows(), finer.ncols(), |row, c| {
            let time = finer_times[row];
            let i = (time as usize).min(count - 2);
            let x = time - i as f64;
            (1.0 - x) * frames[(i, c)] + x * frames[(i + 1, c)]
        });
        let mean = mean(finer.as_ref());
        let spread = Mat::from_fn(finer.nrows(), finer.ncols(), |i, c| finer[(i, c)] - mean[c]);
        Samples {
            frames: count,
            rate,
            dense: through(frames, &times(count, rate)),
            layout_rate,
            laid_out: through(frames, &times(count, layout_rate)),
            spread: spread.norm_l2(),
            linear: (&finer - chord).norm_l2(),
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
    /// The curve's points at `count` times evenly spread over its domain.
    pub(super) fn even_points(&self, controls: MatRef<'_, f64>, count: usize) -> Mat<f64> {
        let last = count.max(2) - 1;
        let times: Vec<f64> = (0..count)
            .map(|i| self.length * i as f64 / last as f64)
            .collect();
        UniformDesign::new(controls.nrows(), self.length, &times).apply(controls)
    }
}

/// The C2 cubic spline without a knot at the first and last inner frame ("not a knot") through `frames`
/// (n x c) at 0, 1, .., n-1: its values at `times`, one row each.
pub(super) fn through(frames: MatRef<'_, f64>, times: &[f64]) -> Mat<f64> {
    let width = frames.ncols();
    let knots: Vec<f64> = (0..frames.nrows()).map(|i| i as f64).collect();
    let values: Vec<f64> = (0..frames.nrows() * width)
        .map(|at| frames[(at / width, at % width)])
        .collect();
    let mut found = Mat::zeros(times.len(), width);
    let Ok(spline) = CubicSpline::new(&knots, &values, width, Ends::NotAKnot) else {
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
