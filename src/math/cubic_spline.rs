//! C2 cubic splines through many coordinates at once: one tridiagonal system in the second derivatives,
//! factored once for all columns.

/// What happens at the ends of a spline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Ends<'a> {
    /// Second derivatives 0 (minimal bending).
    Natural,
    /// The third derivative does not jump at the second knot and the last but one: cubics are
    /// reproduced. Two values give a line, three a parabola.
    NotAKnot,
    /// Values and two derivatives meet; the last value must repeat the first, and is taken to.
    Periodic,
    /// Given slopes, m numbers each.
    Clamped {
        /// At the first knot.
        first: &'a [f64],
        /// At the last.
        last: &'a [f64],
    },
}

/// Why knots and values have no spline. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SplineError {
    /// There are no knots, or values and slopes are not as many as they ask for.
    Counts,
    /// This knot does not lie after the one before it, or is not finite.
    Knot {
        /// Which one.
        index: usize,
    },
}

/// A C2 cubic spline from the line to R^m, continued straight beyond its ends.
#[derive(Debug, Clone, PartialEq)]
pub struct CubicSpline {
    knots: Vec<f64>,
    width: usize,
    values: Vec<f64>,
    seconds: Vec<f64>,
}

impl CubicSpline {
    /// The spline through `values` (n rows of `width`) at n strictly rising `knots`. One knot gives a
    /// constant.
    ///
    /// # Errors
    /// See [`SplineError`].
    pub fn new(
        knots: &[f64],
        values: &[f64],
        width: usize,
        ends: Ends<'_>,
    ) -> Result<Self, SplineError> {
        let n = knots.len();
        let slopes_fit = match ends {
            Ends::Clamped { first, last } => first.len() == width && last.len() == width,
            _ => true,
        };
        if n == 0 || values.len() != n * width || !slopes_fit {
            return Err(SplineError::Counts);
        }
        let faulty = (0..n).find(|&i| !knots[i].is_finite() || (i > 0 && knots[i] <= knots[i - 1]));
        if let Some(index) = faulty {
            return Err(SplineError::Knot { index });
        }
        let mut spline = CubicSpline {
            knots: knots.to_vec(),
            width,
            values: values.to_vec(),
            seconds: vec![0.0; values.len()],
        };
        if n > 1 {
            spline.find_seconds(ends);
        }
        Ok(spline)
    }

    /// The knots.
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Second derivatives at the knots, n rows of m.
    pub fn seconds(&self) -> &[f64] {
        &self.seconds
    }

    /// Writes the value at `t`, m numbers.
    ///
    /// # Panics
    /// `value` is not m long.
    pub fn evaluate(&self, t: f64, value: &mut [f64]) {
        self.each(t, value, |[v, b, c, e], d| v + d * (b + d * (c + d * e)));
    }

    /// Writes the derivative at `t`, m numbers.
    ///
    /// # Panics
    /// `slope` is not m long.
    pub fn derivative(&self, t: f64, slope: &mut [f64]) {
        self.each(t, slope, |[_, b, c, e], d| {
            b + d * (2.0 * c + d * (3.0 * e))
        });
    }

    /// Slopes at knot `index`, m numbers.
    pub fn slope_at_knot(&self, index: usize) -> Vec<f64> {
        let mut slope = vec![0.0; self.width];
        self.derivative(self.knots[index], &mut slope);
        slope
    }

    /// `law` of the coefficients (of powers of the distance from a knot) and that distance, for each
    /// coordinate.
    fn each(&self, t: f64, out: &mut [f64], law: impl Fn([f64; 4], f64) -> f64) {
        let (n, m) = (self.knots.len(), self.width);
        assert_eq!(out.len(), m, "room for m numbers is needed");
        if n == 1 {
            for (out, v) in out.iter_mut().zip(&self.values) {
                *out = law([*v, 0.0, 0.0, 0.0], 0.0);
            }
            return;
        }
        let after = self.knots.partition_point(|&knot| knot <= t);
        let i = after.saturating_sub(1).min(n - 2);
        let h = self.knots[i + 1] - self.knots[i];
        for (j, out) in out.iter_mut().enumerate() {
            let coefficients = self.piece(i, j, h);
            *out = if t < self.knots[0] {
                law(
                    [coefficients[0], coefficients[1], 0.0, 0.0],
                    t - self.knots[0],
                )
            } else if t > self.knots[n - 1] {
                law(self.tangent_at_end(i, j, h), t - self.knots[n - 1])
            } else {
                law(coefficients, t - self.knots[i])
            };
        }
    }

    /// Coefficients of coordinate j on piece i.
    fn piece(&self, i: usize, j: usize, h: f64) -> [f64; 4] {
        let m = self.width;
        let (v0, v1) = (self.values[i * m + j], self.values[(i + 1) * m + j]);
        let (s0, s1) = (self.seconds[i * m + j], self.seconds[(i + 1) * m + j]);
        let slope = (v1 - v0) / h - h * (2.0 * s0 + s1) / 6.0;
        [v0, slope, 0.5 * s0, (s1 - s0) / (6.0 * h)]
    }

    /// Value and slope at the end of the last piece.
    fn tangent_at_end(&self, i: usize, j: usize, h: f64) -> [f64; 4] {
        let m = self.width;
        let (v0, v1) = (self.values[i * m + j], self.values[(i + 1) * m + j]);
        let (s0, s1) = (self.seconds[i * m + j], self.seconds[(i + 1) * m + j]);
        [v1, (v1 - v0) / h + h * (s0 + 2.0 * s1) / 6.0, 0.0, 0.0]
    }

    /// Solves for the second derivatives.
    fn find_seconds(&mut self, ends: Ends<'_>) {
        let (n, m) = (self.knots.len(), self.width);
        let h: Vec<f64> = self.knots.windows(2).map(|k| k[1] - k[0]).collect();
        let secant =
            |i: usize, j: usize| (self.values[(i + 1) * m + j] - self.values[i * m + j]) / h[i];
        // Row i: 6 (secant_i - secant_(i-1)).
        let mut right = vec![0.0; n * m];
        for i in 1..n - 1 {
            for j in 0..m {
                right[i * m + j] = 6.0 * (secant(i, j) - secant(i - 1, j));
            }
        }
        match ends {
            Ends::Natural => {
                let inner = &mut right[m..(n - 1) * m];
                Tridiagonal::inner(&h).solve(inner, m);
            }
            Ends::NotAKnot => not_a_knot(&h, &mut right, m),
            Ends::Periodic => {
                for j in 0..m {
                    right[j] = 6.0 * (secant(0, j) - secant(n - 2, j));
                }
                periodic(&h, &mut right, m);
            }
            Ends::Clamped { first, last } => {
                for j in 0..m {
                    right[j] = 6.0 * (secant(0, j) - first[j]);
                    right[(n - 1) * m + j] = 6.0 * (last[j] - secant(n - 2, j));
                }
                Tridiagonal::clamped(&h).solve(&mut right, m);
            }
        }
        self.seconds = right;
    }
}

/// A tridiagonal matrix whose rows are dominated by their diagonal; solved without pivots.
pub(super) struct Tridiagonal {
    /// The entry left of the diagonal of each row; the first is not used.
    pub(super) below: Vec<f64>,
    pub(super) diagonal: Vec<f64>,
    /// The entry right of the diagonal of each row; the last is not used.
    pub(super) above: Vec<f64>,
}

impl Tridiagonal {
    /// Rows of the inner knots: h_(i-1), 2 (h_(i-1) + h_i), h_i.
    fn inner(h: &[f64]) -> Self {
        Tridiagonal {
            below: h[..h.len() - 1].to_vec(),
            diagonal: h.windows(2).map(|h| 2.0 * (h[0] + h[1])).collect(),
            above: h[1..].to_vec(),
        }
    }

    /// Inner rows between those of given end slopes.
    fn clamped(h: &[f64]) -> Self {
        let last = h[h.len() - 1];
        let inner = Tridiagonal::inner(h);
        Tridiagonal {
            below: [&[0.0], &inner.below[..], &[last]].concat(),
            diagonal: [&[2.0 * h[0]], &inner.diagonal[..], &[2.0 * last]].concat(),
            above: [&[h[0]], &inner.above[..], &[0.0]].concat(),
        }
    }

    /// Replaces rows of m right sides by the solutions.
    pub(super) fn solve(mut self, right: &mut [f64], m: usize) {
        let n = self.diagonal.len();
        for i in 1..n {
            let factor = self.below[i] / self.diagonal[i - 1];
            self.diagonal[i] -= factor * self.above[i - 1];
            let (before, row) = right[(i - 1) * m..(i + 1) * m].split_at_mut(m);
            row.iter_mut()
                .zip(before)
                .for_each(|(x, y)| *x -= factor * *y);
        }
        for i in (0..n).rev() {
            let (row, after) = right[i * m..].split_at_mut(m);
            for (j, x) in row.iter_mut().enumerate() {
                let next = if i + 1 < n {
                    self.above[i] * after[j]
                } else {
                    0.0
                };
                *x = (*x - next) / self.diagonal[i];
            }
        }
    }
}

/// The end knots' second derivatives are those of the inner pieces' continuations.
fn not_a_knot(h: &[f64], right: &mut [f64], m: usize) {
    let n = h.len() + 1;
    if n < 4 {
        if n == 3 {
            for j in 0..m {
                let second = right[m + j] / (3.0 * (h[0] + h[1]));
                (0..3).for_each(|i| right[i * m + j] = second);
            }
        }
        return;
    }
    let (ratio, last) = (h[0] / h[1], h[n - 2] / h[n - 3]);
    let mut matrix = Tridiagonal::inner(h);
    let inner = n - 2;
    matrix.diagonal[0] += h[0] * (1.0 + ratio);
    matrix.above[0] -= h[0] * ratio;
    matrix.diagonal[inner - 1] += h[n - 2] * (1.0 + last);
    matrix.below[inner - 1] -= h[n - 2] * last;
    matrix.solve(&mut right[m..(n - 1) * m], m);
    for j in 0..m {
        right[j] = (1.0 + ratio) * right[m + j] - ratio * right[2 * m + j];
        let (one, two) = (right[(n - 2) * m + j], right[(n - 3) * m + j]);
        right[(n - 1) * m + j] = (1.0 + last) * one - last * two;
    }
}

/// The cyclic system over the first n-1 knots, by a correction of rank one (Sherman-Morrison).
fn periodic(h: &[f64], right: &mut [f64], m: usize) {
    let count = h.len();
    if count == 1 {
        return right.fill(0.0);
    }
    let before = |i: usize| h[(i + count - 1) % count];
    let corner = before(0);
    let mut matrix = Tridiagonal {
        below: (0..count).map(before).collect(),
        diagonal: (0..count).map(|i| 2.0 * (before(i) + h[i])).collect(),
        above: h.to_vec(),
    };
    if count == 2 {
        // Both neighbours are the same knot.
        matrix.below[1] += h[1];
        matrix.above[0] += before(0);
        matrix.solve(&mut right[..2 * m], m);
    } else {
        // A = T + u v^T with u = (g, 0.., corner), v = (1, 0.., corner / g).
        let g = -matrix.diagonal[0];
        matrix.diagonal[0] -= g;
        matrix.diagonal[count - 1] -= corner * corner / g;
        let wide = m + 1;
        let mut sides = vec![0.0; count * wide];
        for i in 0..count {
            sides[i * wide..i * wide + m].copy_from_slice(&right[i * m..(i + 1) * m]);
        }
        sides[m] = g;
        sides[(count - 1) * wide + m] = corner;
        matrix.solve(&mut sides, wide);
        let dot = |j: usize| sides[j] + corner / g * sides[(count - 1) * wide + j];
        let correction = 1.0 + dot(m);
        for j in 0..m {
            let factor = dot(j) / correction;
            for i in 0..count {
                right[i * m + j] = sides[i * wide + j] - factor * sides[i * wide + m];
            }
        }
    }
    right.copy_within(..m, count * m);
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOTS: [f64; 7] = [0.0, 0.5, 2.0, 2.2, 3.5, 5.0, 5.5];

    fn at(spline: &CubicSpline, t: f64) -> f64 {
        let mut value = [0.0; 2];
        spline.evaluate(t, &mut value);
        value[1]
    }

    /// Two coordinates, the second by `law`.
    fn spline(law: impl Fn(f64) -> f64, ends: Ends<'_>) -> CubicSpline {
        let values: Vec<f64> = KNOTS.iter().flat_map(|&t| [1.0, law(t)]).collect();
        CubicSpline::new(&KNOTS, &values, 2, ends).unwrap()
    }

    fn wave(t: f64) -> f64 {
        libm::sin(std::f64::consts::TAU * t / 5.5)
    }

    #[test]
    fn cubics_are_reproduced_by_given_slopes_and_without_knots_at_the_ends() {
        let law = |t: f64| 1.0 - t + 0.5 * t * t - 0.2 * t * t * t;
        let slope = |t: f64| -1.0 + t - 0.6 * t * t;
        let (first, last) = ([0.0, slope(0.0)], [0.0, slope(5.5)]);
        let clamped = Ends::Clamped {
            first: &first,
            last: &last,
        };
        for ends in [Ends::NotAKnot, clamped] {
            let spline = spline(law, ends);
            for i in 0..=110 {
                let t = f64::from(i) * 0.05;
                assert!((at(&spline, t) - law(t)).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn every_kind_passes_through_its_values_with_two_continuous_derivatives() {
        let slopes = [0.3, -2.0];
        let clamped = Ends::Clamped {
            first: &slopes,
            last: &slopes,
        };
        for ends in [Ends::Natural, Ends::NotAKnot, Ends::Periodic, clamped] {
            let spline = spline(wave, ends);
            for (i, &t) in KNOTS.iter().enumerate().take(6).skip(1) {
                assert!((at(&spline, t) - wave(t)).abs() < 1e-14);
                let before = spline.tangent_at_end(i - 1, 1, t - KNOTS[i - 1])[1];
                assert!((before - spline.slope_at_knot(i)[1]).abs() < 1e-13);
            }
            let end = spline.slope_at_knot(6)[1];
            match ends {
                Ends::Natural => assert_eq!((spline.seconds[1], spline.seconds[13]), (0.0, 0.0)),
                Ends::Periodic => {
                    let last = spline.tangent_at_end(5, 1, 0.5)[1];
                    assert!((last - spline.slope_at_knot(0)[1]).abs() < 1e-13);
                    assert_eq!(spline.seconds[1], spline.seconds[13]);
                }
                Ends::Clamped { .. } => assert!((end + 2.0).abs() < 1e-13),
                Ends::NotAKnot => {}
            }
        }
    }

    #[test]
    fn short_periods_close() {
        for n in [2, 3, 4] {
            let values: Vec<f64> = (0..n).map(|i| f64::from(i % (n - 1))).collect();
            let knots: Vec<f64> = (0..n).map(|i| f64::from(i * i)).collect();
            let spline = CubicSpline::new(&knots, &values, 1, Ends::Periodic).unwrap();
            let last = n as usize - 1;
            let h = knots[last] - knots[last - 1];
            let end = spline.tangent_at_end(last - 1, 0, h)[1];
            assert!((end - spline.slope_at_knot(0)[0]).abs() < 1e-13, "{n}");
        }
    }

    #[test]
    fn few_values_give_a_constant_a_line_a_parabola() {
        let values = [2.0, 5.0, 6.0];
        let value = |n: usize, t: f64, ends| {
            let mut value = [0.0];
            let knots = [0.0, 1.0, 2.0];
            let spline = CubicSpline::new(&knots[..n], &values[..n], 1, ends).unwrap();
            spline.evaluate(t, &mut value);
            value[0]
        };
        for ends in [Ends::Natural, Ends::NotAKnot] {
            assert_eq!(value(1, 9.0, ends), 2.0);
            assert!((value(2, 0.25, ends) - 2.75).abs() < 1e-15);
        }
        // through 2, 5, 6: 2 + 4 t - t^2
        assert!((value(3, 1.5, Ends::NotAKnot) - 5.75).abs() < 1e-14);
    }

    #[test]
    fn beyond_the_ends_it_goes_on_straight() {
        let spline = spline(wave, Ends::Natural);
        for (t, end, by) in [(-2.0, 0.0, -2.0), (7.5, 5.5, 2.0)] {
            let mut slope = [0.0; 2];
            spline.derivative(end, &mut slope);
            assert!((at(&spline, t) - (at(&spline, end) + by * slope[1])).abs() < 1e-13);
            spline.derivative(t, &mut slope);
            assert!(
                (slope[1] - spline.slope_at_knot(if t < 0.0 { 0 } else { 6 })[1]).abs() < 1e-13
            );
        }
    }

    #[test]
    fn knots_that_do_not_rise_are_named() {
        let new = |knots: &[f64]| CubicSpline::new(knots, &[0.0; 3], 1, Ends::Natural).map(|_| ());
        assert_eq!(new(&[0.0, 1.0, 1.0]), Err(SplineError::Knot { index: 2 }));
        assert_eq!(
            new(&[0.0, f64::NAN, 1.0]),
            Err(SplineError::Knot { index: 1 })
        );
        assert_eq!(new(&[0.0, 1.0]), Err(SplineError::Counts));
    }
}
