//! Cubic B-spline curves in the plane, held by knot *intervals* and evaluated from the five intervals
//! and four control points around a span, so that shifting a stretch along the parameter leaves every
//! bit of it alone.
//!
//! A curve of k control points has k+2 knots u_0 <= .. <= u_(k+1) and k-3 spans; span s runs from
//! u_(s+2) to u_(s+3), its shape follows from intervals s..s+5 and control points s..s+4. A clamped
//! curve has u_0 = u_1 = u_2 and u_(k-1) = u_k = u_(k+1): its first two and last two intervals are 0.

use std::ops::Range;

/// A point of the plane.
pub type Point = [f64; 2];

/// Where on a curve: a span and the parameter counted from its start, in \[0, length of the span\].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Place {
    /// The span, in 0..k-3.
    pub span: usize,
    /// Parameter from the start of the span.
    pub offset: f64,
}

/// Why intervals and control points are not a curve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurveError {
    /// k control points need k+1 intervals, and k is 1 (a point, no intervals) or at least 4.
    Counts {
        /// How many control points were given.
        controls: usize,
        /// How many intervals.
        intervals: usize,
    },
    /// An interval is negative or not finite.
    Interval {
        /// Which one, from 0.
        index: usize,
    },
    /// A control point is not finite.
    Control {
        /// Which one, from 0.
        index: usize,
    },
    /// All spans have length 0.
    Empty,
}

/// A cubic B-spline curve in the plane, or a single point (one control point, no spans).
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    intervals: Vec<f64>,
    controls: Vec<Point>,
}

impl Curve {
    /// A curve of k `controls` over k+1 knot `intervals`; one control point over none is a point.
    ///
    /// # Errors
    /// See [`CurveError`].
    pub fn new(intervals: Vec<f64>, controls: Vec<Point>) -> Result<Self, CurveError> {
        let k = controls.len();
        let fits = (k == 1 && intervals.is_empty()) || (k >= 4 && intervals.len() == k + 1);
        if !fits {
            return Err(CurveError::Counts {
                controls: k,
                intervals: intervals.len(),
            });
        }
        if let Some(index) = intervals.iter().position(|w| !w.is_finite() || *w < 0.0) {
            return Err(CurveError::Interval { index });
        }
        if let Some(index) = controls
            .iter()
            .position(|c| !c[0].is_finite() || !c[1].is_finite())
        {
            return Err(CurveError::Control { index });
        }
        if k > 1 && intervals[2..k - 1].iter().all(|&w| w == 0.0) {
            return Err(CurveError::Empty);
        }
        Ok(Curve {
            intervals,
            controls,
        })
    }

    /// The curve that stays at `point`.
    pub fn point(point: Point) -> Self {
        Curve {
            intervals: Vec::new(),
            controls: vec![point],
        }
    }

    /// The k+1 knot intervals u_(i+1) - u_i; none for a point.
    pub fn intervals(&self) -> &[f64] {
        &self.intervals
    }

    /// The k control points.
    pub fn controls(&self) -> &[Point] {
        &self.controls
    }

    /// How many spans there are: k-3, or 0 for a point.
    pub fn spans(&self) -> usize {
        self.controls.len().saturating_sub(3)
    }

    /// Length of a span in the parameter.
    pub fn span_length(&self, span: usize) -> f64 {
        self.intervals[span + 2]
    }

    /// The k+2 knots, counted from the start of the domain (u_2 = 0).
    pub fn knots(&self) -> Vec<f64> {
        if self.intervals.is_empty() {
            return vec![0.0; 3];
        }
        let mut knots = vec![
            -self.intervals[0] - self.intervals[1],
            -self.intervals[1],
            0.0,
        ];
        for &interval in &self.intervals[2..] {
            knots.push(knots[knots.len() - 1] + interval);
        }
        knots
    }

    /// The place `distance` >= 0 further along the curve than `place`; the end of the curve when it
    /// would lie beyond. A knot between two spans belongs to the one before it.
    pub fn advance(&self, place: Place, distance: f64) -> Place {
        let mut place = Place {
            offset: place.offset + distance,
            ..place
        };
        while place.span + 1 < self.spans() && place.offset > self.span_length(place.span) {
            place.offset -= self.span_length(place.span);
            place.span += 1;
        }
        if self.spans() > 0 {
            place.offset = place.offset.min(self.span_length(place.span));
        }
        place
    }

    /// Parameter length from `from` to `to`; negative when `to` lies before.
    pub fn distance(&self, from: Place, to: Place) -> f64 {
        if from.span > to.span {
            return -self.distance(to, from);
        }
        if from.span == to.span {
            return to.offset - from.offset;
        }
        let mut length = self.span_length(from.span) - from.offset;
        for span in from.span + 1..to.span {
            length += self.span_length(span);
        }
        length + to.offset
    }

    /// The point at `place`.
    pub fn at(&self, place: Place) -> Point {
        if self.intervals.is_empty() {
            return self.controls[0];
        }
        let weights = basis(self.around(place.span), place.offset);
        let c = &self.controls[place.span..place.span + 4];
        [0, 1].map(|axis| {
            ((weights[0] * c[0][axis] + weights[1] * c[1][axis]) + weights[2] * c[2][axis])
                + weights[3] * c[3][axis]
        })
    }

    /// First and second derivative with respect to the parameter at `place`; 0 for a point.
    pub fn derivatives(&self, place: Place) -> [Point; 2] {
        if self.intervals.is_empty() {
            return [[0.0; 2]; 2];
        }
        let weights = basis_derivatives(self.around(place.span), place.offset);
        let c = &self.controls[place.span..place.span + 4];
        weights.map(|w| {
            [0, 1].map(|axis| {
                // Differences first: the weights sum to 0, so far from the origin nothing is lost.
                (w[0] * (c[0][axis] - c[1][axis]) + w[2] * (c[2][axis] - c[1][axis]))
                    + w[3] * (c[3][axis] - c[1][axis])
            })
        })
    }

    /// The same curve with control point `index` at `to`.
    ///
    /// # Panics
    /// There is no such control point.
    #[must_use]
    pub fn with_control(&self, index: usize, to: Point) -> Self {
        self.with_controls(index, [to])
    }

    /// The same curve with the control points from number `first` on at `to`, one after the other.
    ///
    /// # Panics
    /// There are not so many control points.
    #[must_use]
    pub fn with_controls(&self, first: usize, to: impl IntoIterator<Item = Point>) -> Self {
        let mut curve = self.clone();
        for (i, to) in to.into_iter().enumerate() {
            curve.controls[first + i] = to;
        }
        curve
    }

    /// The same curve with one more knot, at `place` (Boehm): one more control point and span; two control
    /// points become three, so the five spans about the place are the same up to rounding, all others to
    /// the bit. None at the ends of a span, where a knot is already,
    /// and on a point.
    pub fn insert_knot(&self, place: Place) -> Option<Inserted> {
        let x = place.offset;
        if self.intervals.is_empty() || !(x > 0.0 && x < self.span_length(place.span)) {
            return None;
        }
        let (s, [a, b, c, d, e]) = (place.span, self.around(place.span));
        let rises = [(a + b + x, a + b + c), (b + x, b + c + d), (x, c + d + e)];
        let mut controls = self.controls[..=s].to_vec();
        for (i, (part, whole)) in rises.into_iter().enumerate() {
            let (from, to) = (self.controls[s + i], self.controls[s + i + 1]);
            let part = part / whole;
            controls.push([0, 1].map(|axis| from[axis] + part * (to[axis] - from[axis])));
        }
        controls.extend(&self.controls[s + 3..]);
        let mut intervals = self.intervals.clone();
        intervals[s + 2] = x;
        intervals.insert(s + 3, c - x);
        let curve = Curve {
            intervals,
            controls,
        };
        Some(Inserted { curve, at: place })
    }

    /// The curve run through backwards.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Curve {
            intervals: self.intervals.iter().rev().copied().collect(),
            controls: self.controls.iter().rev().copied().collect(),
        }
    }

    /// Spans `range` of the curve alone, bits kept.
    ///
    /// # Panics
    /// The range is empty or leaves the curve.
    #[must_use]
    pub fn spans_of(&self, range: Range<usize>) -> Self {
        Curve {
            intervals: self.intervals[range.start..range.end + 4].to_vec(),
            controls: self.controls[range.start..range.end + 3].to_vec(),
        }
    }

    /// The five intervals around `span`.
    pub fn around(&self, span: usize) -> [f64; 5] {
        let w = &self.intervals[span..span + 5];
        [w[0], w[1], w[2], w[3], w[4]]
    }
}

/// A curve with a knot more, and where.
#[derive(Debug, Clone, PartialEq)]
pub struct Inserted {
    /// The same curve.
    pub curve: Curve,
    at: Place,
}

impl Inserted {
    /// Where a place of the former curve is on this one.
    pub fn place(&self, former: Place) -> Place {
        let Place { span, offset } = former;
        let at = self.at;
        if span < at.span || (span == at.span && offset < at.offset) {
            return former;
        }
        if span > at.span {
            return Place {
                span: span + 1,
                offset,
            };
        }
        let length = self.curve.span_length(span + 1);
        Place {
            span: span + 1,
            offset: (offset - at.offset).min(length),
        }
    }
}

/// The four basis functions of a span, given the five intervals around it and the offset x in the
/// middle one (Cox-de Boor). They are >= 0 and sum to 1.
pub fn basis(around: [f64; 5], x: f64) -> [f64; 4] {
    let [a, b, c, d, e] = around;
    let [q0, q1, q2] = quadratic([b, c, d], x);
    let (t0, t1, t2) = (q0 / (a + b + c), q1 / (b + c + d), q2 / (c + d + e));
    let rest = c - x;
    [
        rest * t0,
        (a + b + x) * t0 + (rest + d) * t1,
        (b + x) * t1 + (rest + d + e) * t2,
        x * t2,
    ]
}

/// First and second derivatives of the four basis functions with respect to x.
pub fn basis_derivatives(around: [f64; 5], x: f64) -> [[f64; 4]; 2] {
    let [a, b, c, d, e] = around;
    let q = quadratic([b, c, d], x);
    let (t0, t1, t2) = (
        3.0 * q[0] / (a + b + c),
        3.0 * q[1] / (b + c + d),
        3.0 * q[2] / (c + d + e),
    );
    let (n0, n1) = ((c - x) / c, x / c);
    let (s0, s1) = (2.0 * n0 / (b + c), 2.0 * n1 / (c + d));
    let (v0, v1, v2) = (
        3.0 * -s0 / (a + b + c),
        3.0 * (s0 - s1) / (b + c + d),
        3.0 * s1 / (c + d + e),
    );
    [[-t0, t0 - t1, t1 - t2, t2], [-v0, v0 - v1, v1 - v2, v2]]
}

/// The three quadratic basis functions of a span with its two neighbours.
fn quadratic(around: [f64; 3], x: f64) -> [f64; 3] {
    let [b, c, d] = around;
    let (n0, n1) = ((c - x) / c, x / c);
    let (t0, t1) = (n0 / (b + c), n1 / (c + d));
    [(c - x) * t0, (b + x) * t0 + (c - x + d) * t1, x * t1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wavy() -> Curve {
        let intervals = vec![0.0, 0.0, 0.7, 0.0, 1.3, 0.2, 2.0, 0.0, 0.0];
        let controls = (0..8)
            .map(|j| [f64::from(j), f64::from(j * j % 5)])
            .collect();
        Curve::new(intervals, controls).unwrap()
    }

    fn places(curve: &Curve) -> impl Iterator<Item = Place> + '_ {
        (0..curve.spans())
            .filter(|&span| curve.span_length(span) > 0.0)
            .flat_map(move |span| {
                (0..=8).map(move |i| Place {
                    span,
                    offset: curve.span_length(span) * f64::from(i) / 8.0,
                })
            })
    }

    #[test]
    fn basis_functions_are_a_partition_of_unity() {
        let curve = wavy();
        for place in places(&curve) {
            let weights = basis(curve.around(place.span), place.offset);
            assert!(weights.iter().all(|&w| w >= 0.0));
            // a few roundings of numbers below 1
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            for row in basis_derivatives(curve.around(place.span), place.offset) {
                let size: f64 = row.iter().map(|w| w.abs()).sum();
                assert!(row.iter().sum::<f64>().abs() <= 1e-15 * size);
            }
        }
    }

    #[test]
    fn control_points_at_the_knot_averages_give_the_straight_line() {
        let mut curve = wavy();
        let knots = curve.knots();
        for (j, control) in curve.controls.iter_mut().enumerate() {
            let u = (knots[j] + knots[j + 1] + knots[j + 2]) / 3.0;
            *control = [u, 1.0 - 2.0 * u];
        }
        for place in places(&curve) {
            let u = knots[place.span + 2] + place.offset;
            let [x, y] = curve.at(place);
            assert!((x - u).abs() < 1e-14 && (y - (1.0 - 2.0 * u)).abs() < 3e-14);
            let [first, second] = curve.derivatives(place);
            assert!((first[0] - 1.0).abs() < 1e-13 && (first[1] + 2.0).abs() < 1e-13);
            assert!(second[0].abs() < 1e-11 && second[1].abs() < 1e-11);
        }
    }

    #[test]
    fn derivatives_match_central_differences() {
        let curve = wavy();
        let h = 1e-5;
        for place in places(&curve) {
            let inside = place.offset >= h && place.offset + h <= curve.span_length(place.span);
            if !inside {
                continue;
            }
            let moved = |by: f64| Place {
                offset: place.offset + by,
                ..place
            };
            let (before, after) = (moved(-h), moved(h));
            let [first, second] = curve.derivatives(place);
            for axis in 0..2 {
                let slope = (curve.at(after)[axis] - curve.at(before)[axis]) / (2.0 * h);
                let bend = (curve.derivatives(after)[0][axis] - curve.derivatives(before)[0][axis])
                    / (2.0 * h);
                // truncation h^2 f'''/6 with f''' < 1e3 here, rounding 1e-15/h
                assert!((slope - first[axis]).abs() < 1e-7);
                assert!((bend - second[axis]).abs() < 1e-7 * (1.0 + second[axis].abs()));
            }
        }
    }

    #[test]
    fn advancing_goes_as_far_as_the_distance_says_and_stops_at_the_end() {
        let curve = wavy();
        let start = Place::default();
        for step in [0.0, 0.3, 0.7, 0.71, 1.9, 2.0, 4.2] {
            let place = curve.advance(start, step);
            assert!((curve.distance(start, place) - step).abs() < 1e-15 * 8.0);
            assert_eq!(curve.distance(place, start), -curve.distance(start, place));
        }
        let end = curve.advance(start, 99.0);
        assert_eq!((end.span, end.offset), (4, 2.0));
        assert_eq!(curve.at(end), curve.controls()[7]);
    }

    #[test]
    fn a_stretch_that_is_shifted_keeps_its_bits() {
        let curve = wavy();
        let mut intervals = vec![0.0, 0.0, 0.123_456_789, 0.3, 0.1];
        intervals.extend(&curve.intervals);
        let mut controls = vec![[9.0, 9.0]; 5];
        controls.extend(&curve.controls);
        let shifted = Curve::new(intervals, controls).unwrap();
        for place in places(&curve) {
            let there = Place {
                span: place.span + 5,
                ..place
            };
            assert_eq!(curve.at(place), shifted.at(there));
        }
    }

    #[test]
    fn an_inserted_knot_changes_the_curve_by_rounding_only_and_far_places_not_at_all() {
        let intervals = (0..14).map(|i| 0.5 + f64::from(i * i % 7)).collect();
        let controls = (0..13).map(|j| [f64::from(j), f64::from(j * j % 5)]);
        let curve = Curve::new(intervals, controls.collect()).unwrap();
        let at = Place {
            span: 4,
            offset: 0.5,
        };
        let inserted = curve.insert_knot(at).unwrap();
        assert_eq!(inserted.curve.spans(), curve.spans() + 1);
        for place in places(&curve) {
            let (p, q) = (curve.at(place), inserted.curve.at(inserted.place(place)));
            // a few roundings of numbers of size 8
            assert!((p[0] - q[0]).abs() < 1e-14 && (p[1] - q[1]).abs() < 1e-14);
            if !(2..=6).contains(&place.span) {
                assert_eq!(p, q);
            }
        }
        let knot = Place {
            span: 4,
            offset: 0.0,
        };
        assert_eq!(curve.insert_knot(knot), None);
    }

    #[test]
    fn parts_keep_their_bits_and_the_curve_runs_backwards() {
        let curve = wavy();
        let part = curve.spans_of(2..4);
        let back = curve.reversed();
        for place in places(&curve) {
            if (2..4).contains(&place.span) {
                let there = Place {
                    span: place.span - 2,
                    ..place
                };
                assert_eq!(part.at(there), curve.at(place));
            }
            let mirrored = Place {
                span: curve.spans() - 1 - place.span,
                offset: curve.span_length(place.span) - place.offset,
            };
            let (p, q) = (curve.at(place), back.at(mirrored));
            assert!((p[0] - q[0]).abs() < 1e-14 && (p[1] - q[1]).abs() < 1e-14);
        }
    }

    #[test]
    fn what_is_not_a_curve_is_refused() {
        let point = [0.0; 2];
        let counts = Curve::new(vec![0.0; 3], vec![point; 2]).unwrap_err();
        assert_eq!(
            counts,
            CurveError::Counts {
                controls: 2,
                intervals: 3
            }
        );
        assert_eq!(
            Curve::new(vec![0.0; 5], vec![point; 4]),
            Err(CurveError::Empty)
        );
        assert_eq!(
            Curve::new(vec![0.0, 0.0, -1.0, 0.0, 0.0], vec![point; 4]),
            Err(CurveError::Interval { index: 2 })
        );
        let mut controls = vec![point; 4];
        controls[3][1] = f64::NAN;
        assert_eq!(
            Curve::new(vec![0.0, 0.0, 1.0, 0.0, 0.0], controls),
            Err(CurveError::Control { index: 3 })
        );
    }

    #[test]
    fn a_point_stays() {
        let curve = Curve::point([3.0, 4.0]);
        assert_eq!(curve.at(Place::default()), [3.0, 4.0]);
        assert_eq!(curve.derivatives(Place::default()), [[0.0; 2]; 2]);
        assert_eq!(curve.advance(Place::default(), 0.0), Place::default());
    }
}
