//! The C2 cubic spline through values at 0, 1, .., n-1 that has no knot at the first and the last
//! inner one (de Boor's "not a knot"): the measure of what a motion does between its frames.

use faer::{Mat, MatRef};

/// A spline of c coordinates through n frames.
pub struct FrameSpline<'a> {
    values: MatRef<'a, f64>,
    slopes: Mat<f64>,
}

impl<'a> FrameSpline<'a> {
    /// Through the rows of `values` (n x c, n >= 1): constant for one row, a line for two, a parabola
    /// for three.
    pub fn new(values: MatRef<'a, f64>) -> Self {
        FrameSpline {
            slopes: slopes(values),
            values,
        }
    }

    /// Values at `times` (clamped to \[0, n-1\]), one row each.
    pub fn at(&self, times: &[f64]) -> Mat<f64> {
        let frames = self.values.nrows();
        Mat::from_fn(times.len(), self.values.ncols(), |row, c| {
            let time = times[row].clamp(0.0, (frames - 1) as f64);
            let i = (time as usize).min(frames.saturating_sub(2));
            let x = time - i as f64;
            if time.fract() == 0.0 {
                return self.values[(time as usize, c)];
            }
            let (a, b) = (self.values[(i, c)], self.values[(i + 1, c)]);
            let (da, db) = (self.slopes[(i, c)], self.slopes[(i + 1, c)]);
            let rise = b - a;
            a + x * (da + x * (3.0 * rise - 2.0 * da - db + x * (da + db - 2.0 * rise)))
        })
    }
}

/// Slopes at the frames: s_(i-1) + 4 s_i + s_(i+1) = 3 (y_(i+1) - y_(i-1)) inside, at the ends
/// s_0 + 2 s_1 = (5 (y_1 - y_0) + (y_2 - y_1)) / 2.
fn slopes(values: MatRef<'_, f64>) -> Mat<f64> {
    let frames = values.nrows();
    let rise = |i: usize, c: usize| values[(i + 1, c)] - values[(i, c)];
    match frames {
        0 | 1 => Mat::zeros(frames, values.ncols()),
        2 => Mat::from_fn(2, values.ncols(), |_, c| rise(0, c)),
        3 => Mat::from_fn(3, values.ncols(), |i, c| {
            let (first, second) = (rise(0, c), rise(1, c));
            0.5 * (first + second) + (i as f64 - 1.0) * (second - first)
        }),
        _ => {
            let mut right = Mat::from_fn(frames, values.ncols(), |i, c| match i {
                0 => 2.5 * rise(0, c) + 0.5 * rise(1, c),
                i if i == frames - 1 => 2.5 * rise(i - 1, c) + 0.5 * rise(i - 2, c),
                i => 3.0 * (rise(i, c) + rise(i - 1, c)),
            });
            eliminate(&mut right);
            right
        }
    }
}

/// Solves the tridiagonal system of [`slopes`] in place, all columns together.
fn eliminate(right: &mut Mat<f64>) {
    let frames = right.nrows();
    let below = |i: usize| if i == frames - 1 { 2.0 } else { 1.0 };
    let above = |i: usize| if i == 0 { 2.0 } else { 1.0 };
    let mut pivots = vec![1.0; frames];
    for i in 1..frames {
        let factor = below(i) / pivots[i - 1];
        let middle = if i == frames - 1 { 1.0 } else { 4.0 };
        pivots[i] = middle - factor * above(i - 1);
        for c in 0..right.ncols() {
            right[(i, c)] -= factor * right[(i - 1, c)];
        }
    }
    for i in (0..frames).rev() {
        for c in 0..right.ncols() {
            let next = if i + 1 < frames {
                above(i) * right[(i + 1, c)]
            } else {
                0.0
            };
            right[(i, c)] = (right[(i, c)] - next) / pivots[i];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubics_are_reproduced_whatever_the_count() {
        for frames in 1..9 {
            let degree = (frames - 1).min(3) as i32;
            let cubic = |t: f64| 1.0 + 2.0 * t - 0.7 * t.powi(degree.min(2)) + 0.1 * t.powi(degree);
            let cubic = |t: f64| {
                if degree == 0 {
                    5.0
                } else if degree == 1 {
                    2.0 * t
                } else {
                    cubic(t)
                }
            };
            let values = Mat::from_fn(frames, 1, |i, _| cubic(i as f64));
            let spline = FrameSpline::new(values.as_ref());
            let times: Vec<f64> = (0..=10)
                .map(|i| i as f64 / 10.0 * (frames - 1) as f64)
                .collect();
            let found = spline.at(&times);
            for (i, &t) in times.iter().enumerate() {
                // Rounding of a few operations on numbers below 50.
                assert!(
                    (found[(i, 0)] - cubic(t)).abs() < 1e-12,
                    "{frames} frames at {t}"
                );
            }
        }
    }

    #[test]
    fn frames_are_met_exactly() {
        let values = Mat::from_fn(7, 2, |i, c| ((i * i + c) as f64).sin());
        let spline = FrameSpline::new(values.as_ref());
        let times: Vec<f64> = (0..7).map(f64::from).collect();
        assert_eq!(spline.at(&times), values);
    }
}
