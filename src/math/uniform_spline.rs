//! Uniform clamped cubic B-splines over frame numbers, as sparse design matrices: row i holds the
//! four basis functions that are not 0 at time t_i, so f(t_i) = (A C)_i for k control points C.

use std::ops::Range;

use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, MatRef, Side};

use super::b_spline::basis;

/// The design matrix A (N x k) of a uniform clamped cubic B-spline with domain \[0, length\].
#[derive(Debug, Clone)]
pub struct UniformDesign {
    controls: usize,
    first: Vec<usize>,
    weights: Vec<[f64; 4]>,
}

impl UniformDesign {
    /// Rows at `times` (clamped to \[0, length\]) for `controls` >= 4 control points; `length` > 0.
    pub fn new(controls: usize, length: f64, times: &[f64]) -> Self {
        let spans = controls - 3;
        let step = length / spans as f64;
        let row = |&time: &f64| {
            let span = ((time / step) as usize).min(spans - 1);
            let inside = (time - span as f64 * step).clamp(0.0, step);
            (span, basis(intervals_around(span, spans, step), inside))
        };
        let (first, weights) = times.iter().map(row).unzip();
        UniformDesign {
            controls,
            first,
            weights,
        }
    }

    /// N, the number of rows.
    pub fn rows(&self) -> usize {
        self.first.len()
    }

    /// k, the number of control points.
    pub fn controls(&self) -> usize {
        self.controls
    }

    /// First control point and the four weights of row `row`.
    pub fn row(&self, row: usize) -> (usize, [f64; 4]) {
        (self.first[row], self.weights[row])
    }

    /// The control points that `rows` touch.
    pub fn support(&self, rows: Range<usize>) -> Range<usize> {
        match (self.first.get(rows.start), rows.end.checked_sub(1)) {
            (Some(&first), Some(last)) => first..self.first[last] + 4,
            _ => 0..0,
        }
    }

    /// A C, N x c for control points `controls` of k x c.
    pub fn apply(&self, controls: MatRef<'_, f64>) -> Mat<f64> {
        let mut points = Mat::zeros(self.rows(), controls.ncols());
        self.apply_to(controls, &mut points);
        points
    }

    /// Writes A C into `points` (N x c).
    pub fn apply_to(&self, controls: MatRef<'_, f64>, points: &mut Mat<f64>) {
        for column in 0..controls.ncols() {
            for (row, point) in points.col_as_slice_mut(column).iter_mut().enumerate() {
                let (first, weights) = self.row(row);
                *point = (0..4)
                    .map(|a| weights[a] * controls[(first + a, column)])
                    .sum();
            }
        }
    }

    /// Adds A\[from..\]^T v to `sums` (k numbers), v being `values` (N - `from` numbers).
    pub fn add_transposed(&self, from: usize, values: &[f64], sums: &mut [f64]) {
        for (row, value) in values.iter().enumerate() {
            let (first, weights) = self.row(from + row);
            for a in 0..4 {
                sums[first + a] += weights[a] * value;
            }
        }
    }

    /// A^T A, k x k.
    pub fn gram(&self) -> Mat<f64> {
        let mut gram = Mat::zeros(self.controls, self.controls);
        for row in 0..self.rows() {
            let (first, weights) = self.row(row);
            for a in 0..4 {
                for b in 0..4 {
                    gram[(first + a, first + b)] += weights[a] * weights[b];
                }
            }
        }
        gram
    }

    /// A door for many least-squares solves with this matrix.
    pub fn fitter(self) -> UniformFitter {
        let mut gram = self.gram();
        // Full column rank whenever every span holds samples; the shift (1e-14 of the largest entry)
        // only keeps a span without any from stopping the factorisation.
        let shift = 1e-14
            * (0..self.controls)
                .map(|i| gram[(i, i)])
                .fold(1e-300, f64::max);
        for i in 0..self.controls {
            gram[(i, i)] += shift;
        }
        let factor = gram.llt(Side::Lower).ok();
        UniformFitter {
            design: self,
            factor,
        }
    }
}

/// Least squares against one [`UniformDesign`]: the normal equations, factored once.
#[derive(Debug, Clone)]
pub struct UniformFitter {
    design: UniformDesign,
    factor: Option<Llt<f64>>,
}

impl UniformFitter {
    /// The design matrix.
    pub fn design(&self) -> &UniformDesign {
        &self.design
    }

    /// Control points (k x c) whose curve is nearest to `points` (N x c) at the rows' times.
    pub fn fit(&self, points: MatRef<'_, f64>) -> Mat<f64> {
        let mut controls = Mat::zeros(self.design.controls, points.ncols());
        let mut column = vec![0.0; points.nrows()];
        for c in 0..points.ncols() {
            for (i, value) in column.iter_mut().enumerate() {
                *value = points[(i, c)];
            }
            self.design
                .add_transposed(0, &column, controls.col_as_slice_mut(c));
        }
        self.solve(controls)
    }

    /// (A^T A)^-1 `right` for any right sides, k x c.
    pub fn solve(&self, right: Mat<f64>) -> Mat<f64> {
        match &self.factor {
            Some(factor) => factor.solve(right),
            None => right,
        }
    }
}

/// The five knot intervals around `span` of a clamped curve with `spans` spans of length `step`.
fn intervals_around(span: usize, spans: usize, step: f64) -> [f64; 5] {
    std::array::from_fn(|i| match (span + i).checked_sub(2) {
        Some(at) if at < spans => step,
        _ => 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(count: usize, length: f64) -> Vec<f64> {
        (0..count)
            .map(|i| length * i as f64 / (count - 1) as f64)
            .collect()
    }

    #[test]
    fn rows_are_partitions_of_one_and_reach_the_ends() {
        let design = UniformDesign::new(9, 7.0, &times(31, 7.0));
        for row in 0..31 {
            let (first, weights) = design.row(row);
            assert!(first + 4 <= 9 && weights.iter().all(|&w| w >= 0.0));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        }
        assert_eq!(design.row(0), (0, [1.0, 0.0, 0.0, 0.0]));
        let (first, weights) = design.row(30);
        assert!(first == 5 && (weights[3] - 1.0).abs() < 1e-12);
    }

    #[test]
    fn cubics_are_in_the_space_and_found_by_the_fit() {
        for controls in [4, 5, 12, 22] {
            let times = times(41, 20.0);
            let cubic = Mat::from_fn(41, 2, |i, a| {
                let t = times[i] / 20.0;
                [1.0 - t * t, t * t * t - 0.3 * t][a]
            });
            let fitter = UniformDesign::new(controls, 20.0, &times).fitter();
            let found = fitter.design().apply(fitter.fit(cubic.as_ref()).as_ref());
            // Normal equations of condition below 1e6.
            assert!((found - cubic).norm_max() < 1e-9, "{controls}");
        }
    }

    #[test]
    fn the_transpose_is_the_transpose() {
        let design = UniformDesign::new(6, 3.0, &times(10, 3.0));
        let dense = design.apply(Mat::identity(6, 6).as_ref());
        let values: Vec<f64> = (0..7).map(|i| f64::from(i * i) - 3.0).collect();
        let mut sums = vec![0.0; 6];
        design.add_transposed(3, &values, &mut sums);
        for j in 0..6 {
            let expected: f64 = (0..7).map(|i| dense[(i + 3, j)] * values[i]).sum();
            assert!((sums[j] - expected).abs() < 1e-13);
        }
        let gram = dense.transpose() * &dense;
        assert!((gram - design.gram()).norm_max() < 1e-14);
    }
}
