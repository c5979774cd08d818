//! How the time signal is fitted (CH12 §3.3): centripetal parameters, the knots of Piegl & Tiller 9.4.1,
//! control points by banded least squares.
//!
//! ```text
//! t_(i+1) - t_i = |p_(i+1) - p_i|^alpha
//! minimise  sum_i |p_i - f~(t_i)|^2 + lambda integral |f~''|^2
//! ```
//!
//! Without the second term the control points run away for k near n (the system's condition reaches
//! 2e14, and k = n+1 has no unique solution). lambda is 1e-8 of the ratio of the two terms' squared norms,
//! and ten times that as often as control points lie more than 2.5 extents from the layout. k = n+2 is
//! the natural interpolating spline. n counts distinct consecutive positions.

use super::time::{TimeError, TimeSignal};
use crate::math::b_spline::{Curve, Place, Point, basis};
use crate::math::banded::BandedQr;
use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::curve_join::bending;

/// Weight of the bending term relative to the squared norms of both terms' matrices.
const BENDING: f64 = 1e-8;

/// Control points farther from the first frame than this many extents have run away.
const FAR: f64 = 2.5;

/// Steps below this part of the layout's extent are rests: their positions are the same.
const REST: f64 = 1e-9;

/// The least and the most control points for frames at these positions: 4 and n+2, n counting distinct
/// consecutive positions; 1 and 1 where none moves.
pub fn control_bounds(positions: &[Point]) -> (usize, usize) {
    match distinct(&steps(positions)) {
        0 | 1 => (1, 1),
        n => (4, n + 2),
    }
}

impl TimeSignal {
    /// The time signal with `controls` control points of frames at n `positions`, parametrised with
    /// exponent `alpha` (1/2: centripetal). Positions that all coincide give a point, whatever
    /// `controls`.
    ///
    /// # Errors
    /// No frames; a position that is not finite; too few or too many control points; alpha outside
    /// \[0, 1\].
    pub fn fit(positions: &[Point], controls: usize, alpha: f64) -> Result<Self, TimeError> {
        if positions.is_empty() {
            return Err(TimeError::Empty);
        }
        if let Some(frame) = positions
            .iter()
            .position(|p| !p[0].is_finite() || !p[1].is_finite())
        {
            return Err(TimeError::Frame { frame });
        }
        if !(0.0..=1.0).contains(&alpha) {
            return Err(TimeError::Exponent);
        }
        let steps = steps(positions);
        let n = distinct(&steps);
        if n == 1 {
            let curve = Curve::point(positions[0]);
            return TimeSignal::through(curve, vec![Place::default(); positions.len()]);
        }
        let (least, most) = (4, n + 2);
        if !(least..=most).contains(&controls) {
            return Err(TimeError::Controls {
                given: controls,
                least,
                most,
            });
        }
        let parameters = parameters(&steps, alpha);
        let knots = knots(&parameters, controls);
        let places = places(&knots, &parameters);
        let curve = if controls == most {
            interpolate(positions, &parameters, &knots)
        } else {
            approximate(positions, &places, &knots)
        };
        TimeSignal::through(curve.ok_or(TimeError::Counts)?, places)
    }

    /// The time signal with `controls` control points over uniform knots and rho the identity, of n >= 2
    /// frames: the control points are given.
    ///
    /// # Errors
    /// Fewer than 2 frames or 4 control points; numbers that are not finite.
    pub fn uniform(controls: Vec<Point>, frames: usize) -> Result<Self, TimeError> {
        if frames < 2 {
            return Err(TimeError::Empty);
        }
        let given = controls.len();
        let intervals = uniform_intervals(given, frames);
        let curve = Curve::new(intervals, controls).map_err(|_| TimeError::Controls {
            given,
            least: 4,
            most: usize::MAX,
        })?;
        let places = (0..frames).map(|frame| uniform_place(given, frames, frame as f64));
        let places = places.collect::<Vec<_>>();
        TimeSignal::new(curve, places, vec![1.0; frames], Vec::new())
    }
}

/// The k+1 intervals of uniform clamped knots over n frames (domain length n-1).
pub fn uniform_intervals(controls: usize, frames: usize) -> Vec<f64> {
    let spans = controls.saturating_sub(3);
    let length = frames.saturating_sub(1) as f64 / spans.max(1) as f64;
    let mut intervals = vec![0.0; 2];
    intervals.extend(vec![length; spans]);
    intervals.extend([0.0; 2]);
    intervals
}

/// The place of time `t` (from 0) on a curve of uniform knots over n frames.
pub fn uniform_place(controls: usize, frames: usize, t: f64) -> Place {
    let spans = controls - 3;
    let length = (frames - 1) as f64 / spans as f64;
    let span = ((t / length) as usize).min(spans - 1);
    let offset = (t - span as f64 * length).clamp(0.0, length);
    Place { span, offset }
}

/// Rows of the design matrix of a curve of `controls` uniform control points over n `frames` at `times`
/// (from 0): the first of the four control points each time depends on, and their weights.
pub fn uniform_design(controls: usize, frames: usize, times: &[f64]) -> Vec<(usize, [f64; 4])> {
    let intervals = uniform_intervals(controls, frames);
    let row = |&t: &f64| {
        let place = uniform_place(controls, frames, t);
        (
            place.span,
            basis(around(&intervals, place.span), place.offset),
        )
    };
    times.iter().map(row).collect()
}

/// The five intervals around a span.
fn around(intervals: &[f64], span: usize) -> [f64; 5] {
    [0, 1, 2, 3, 4].map(|i| intervals[span + i])
}

/// Distances between consecutive positions, 0 for rests.
fn steps(positions: &[Point]) -> Vec<f64> {
    let mut extent: f64 = 0.0;
    for p in positions {
        for axis in 0..2 {
            extent = extent.max((p[axis] - positions[0][axis]).abs());
        }
    }
    positions
        .windows(2)
        .map(|pair| libm::hypot(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]))
        .map(|step| if step <= REST * extent { 0.0 } else { step })
        .collect()
}

/// How many distinct consecutive positions there are.
fn distinct(steps: &[f64]) -> usize {
    1 + steps.iter().filter(|&&step| step > 0.0).count()
}

/// t_i, from 0.
fn parameters(steps: &[f64], alpha: f64) -> Vec<f64> {
    let mut parameters = vec![0.0];
    for &step in steps {
        let length = match step {
            0.0 => 0.0,
            _ if alpha == 0.5 => step.sqrt(),
            _ => libm::pow(step, alpha),
        };
        parameters.push(parameters[parameters.len() - 1] + length);
    }
    parameters
}

/// The k-2 knots of the domain, ends included: u_(j+2) for j = 0..k-3.
fn knots(parameters: &[f64], controls: usize) -> Vec<f64> {
    let mut t = parameters.to_vec();
    t.dedup();
    let (n, spans) = (t.len(), controls - 3);
    let knot = |j: usize| {
        let x = (j * (n - 1)) as f64 / spans as f64;
        let i = (j * (n - 1)) / spans;
        if i + 1 >= n {
            return t[n - 1];
        }
        let a = x - i as f64;
        t[i] + a * (t[i + 1] - t[i])
    };
    (0..=spans).map(knot).collect()
}

/// The place of each parameter among the knots; one at a knot starts the span after it.
fn places(knots: &[f64], parameters: &[f64]) -> Vec<Place> {
    let spans = knots.len() - 1;
    let place = |&t: &f64| {
        let span = (knots.partition_point(|&knot| knot <= t) - 1).min(spans - 1);
        let length = knots[span + 1] - knots[span];
        Place {
            span,
            offset: (t - knots[span]).clamp(0.0, length),
        }
    };
    parameters.iter().map(place).collect()
}

/// Clamped intervals of the domain's knots.
fn intervals(knots: &[f64]) -> Vec<f64> {
    let mut intervals = vec![0.0; 2];
    intervals.extend(knots.windows(2).map(|knots| knots[1] - knots[0]));
    intervals.extend([0.0; 2]);
    intervals
}

/// The natural spline through the positions: each control point is the blossom of its three knots.
fn interpolate(positions: &[Point], parameters: &[f64], knots: &[f64]) -> Option<Curve> {
    let first_at = |t: f64| parameters.partition_point(|&other| other < t);
    let points: Vec<Point> = knots.iter().map(|&t| positions[first_at(t)]).collect();
    let values = points.concat();
    let spline = CubicSpline::new(knots, &values, 2, Ends::Natural).ok()?;
    let last = knots.len() - 1;
    let mut controls = vec![points[0]];
    for (i, point) in points.iter().enumerate() {
        let before = knots[i.saturating_sub(1)] - knots[i];
        let after = knots[(i + 1).min(last)] - knots[i];
        let (slope, seconds) = (spline.slope_at_knot(i), spline.seconds());
        controls.push([0, 1].map(|axis| {
            point[axis]
                + slope[axis] / 3.0 * (before + after)
                + seconds[2 * i + axis] / 6.0 * (before * after)
        }));
    }
    controls.push(points[last]);
    Curve::new(intervals(knots), controls).ok()
}

/// Least squares over all frames plus as little bending as keeps the control points near the layout.
fn approximate(positions: &[Point], places: &[Place], knots: &[f64]) -> Option<Curve> {
    let intervals = intervals(knots);
    let spans = knots.len() - 1;
    // Positions about their first: far from the origin nothing is lost.
    let offsets: Vec<Point> = positions
        .iter()
        .map(|p| [p[0] - positions[0][0], p[1] - positions[0][1]])
        .collect();
    let system = System {
        rows: places
            .iter()
            .map(|place| {
                (
                    place.span,
                    basis(around(&intervals, place.span), place.offset),
                )
            })
            .collect(),
        bends: (0..spans)
            .map(|span| bending(around(&intervals, span)))
            .collect(),
    };
    let reach = FAR * largest(&offsets);
    let mut controls = system.solve(&offsets, BENDING)?;
    for raise in [1e1, 1e2, 1e3, 1e4, 1e5, 1e6] {
        if largest(&controls) <= reach {
            break;
        }
        controls = system.solve(&offsets, raise * BENDING)?;
    }
    let back = |c: &Point| [c[0] + positions[0][0], c[1] + positions[0][1]];
    Curve::new(intervals, controls.iter().map(back).collect()).ok()
}

/// Largest coordinate.
fn largest(points: &[Point]) -> f64 {
    points.iter().flatten().fold(0.0, |a, x| a.max(x.abs()))
}

/// Rows of the frames (first control point, weights), and of each span's bending.
struct System {
    rows: Vec<(usize, [f64; 4])>,
    bends: Vec<Vec<[f64; 4]>>,
}

impl System {
    /// Control points for `offsets` with bending of `relative` weight.
    fn solve(&self, offsets: &[Point], relative: f64) -> Option<Vec<Point>> {
        let sum = |row: &[f64; 4]| row.iter().map(|x| x * x).sum::<f64>();
        let data: f64 = self.rows.iter().map(|(_, row)| sum(row)).sum();
        let bends: f64 = self.bends.iter().flatten().map(sum).sum();
        let weight = (relative * data / bends).sqrt();
        let mut qr = BandedQr::<2>::new(self.bends.len() + 3);
        let mut frames = self.rows.iter().zip(offsets).peekable();
        for (span, bends) in self.bends.iter().enumerate() {
            while let Some(((_, row), offset)) = frames.next_if(|((first, _), _)| *first == span) {
                qr.add(span, *row, *offset);
            }
            for row in bends {
                qr.add(span, row.map(|x| weight * x), [0.0; 2]);
            }
        }
        qr.solve().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walk(n: usize) -> Vec<Point> {
        (0..n)
            .map(|i| {
                let t = i as f64 * 0.4;
                [libm::cos(t) + 0.1 * t, 0.7 * libm::sin(1.3 * t)]
            })
            .collect()
    }

    fn error(signal: &TimeSignal, positions: &[Point]) -> f64 {
        let each = positions.iter().enumerate().map(|(i, p)| {
            let q = signal.at((i + 1) as f64).unwrap();
            libm::hypot(q[0] - p[0], q[1] - p[1])
        });
        each.fold(0.0, f64::max)
    }

    #[test]
    fn two_more_controls_than_frames_interpolate_with_straight_ends() {
        for n in [2, 3, 4, 30, 200] {
            let positions = walk(n);
            let signal = TimeSignal::fit(&positions, n + 2, 0.5).unwrap();
            assert!(error(&signal, &positions) < 1e-12);
            let end = signal.places()[n - 1];
            for place in [Place::default(), end] {
                // second derivatives of the unit-size layout are of size 10
                let [_, second] = signal.curve().derivatives(place);
                assert!(second.iter().all(|x| x.abs() < 1e-10), "{n}: {second:?}");
            }
        }
    }

    #[test]
    fn scale_and_place_of_the_layout_do_not_matter() {
        let positions = walk(40);
        let plain = TimeSignal::fit(&positions, 25, 0.5).unwrap();
        for (scale, shift) in [(1e8, 0.0), (1e-8, 0.0), (1.0, 1e6)] {
            let moved: Vec<Point> = positions
                .iter()
                .map(|p| p.map(|x| x * scale + shift))
                .collect();
            let signal = TimeSignal::fit(&moved, 25, 0.5).unwrap();
            for i in 0..=390 {
                let t = 1.0 + f64::from(i) / 10.0;
                let (a, b) = (plain.at(t).unwrap(), signal.at(t).unwrap());
                for axis in 0..2 {
                    // positions lose 1e-10 of themselves 1e6 from the origin; fits magnify that a little
                    let tolerance = 1e-9 + 1e-7 * (shift / 1e6);
                    assert!(((b[axis] - shift) / scale - a[axis]).abs() < tolerance);
                }
            }
        }
    }

    #[test]
    fn controls_stay_near_the_layout_for_every_count() {
        let positions = walk(48);
        for k in 4..=50 {
            let signal = TimeSignal::fit(&positions, k, 0.5).unwrap();
            let far = signal
                .controls()
                .iter()
                .flatten()
                .fold(0.0, |a: f64, x| a.max(x.abs()));
            // the layout reaches from -1 to 2.9; the first frame lies at (1, 0)
            assert!(far < 1.0 + FAR * 3.9, "k = {k}: {far}");
            if k > 44 {
                // without bending 0, with control points 1e3 layouts away
                assert!(error(&signal, &positions) < 0.02, "k = {k}");
            }
        }
    }

    #[test]
    fn a_straight_uniform_motion_is_met_by_any_count() {
        let positions: Vec<Point> = (0..20)
            .map(|i| [f64::from(i), 3.0 - 2.0 * f64::from(i)])
            .collect();
        for k in [4, 9, 21, 22] {
            let signal = TimeSignal::fit(&positions, k, 0.5).unwrap();
            let p = signal.at(7.25).unwrap();
            assert!((p[0] - 6.25).abs() < 1e-10 && (p[1] + 9.5).abs() < 1e-10);
            let v = signal.velocity(7.25).unwrap();
            assert!((v[0] - 1.0).abs() < 1e-9 && (v[1] + 2.0).abs() < 1e-9);
        }
    }

    #[test]
    fn velocity_matches_central_differences() {
        let positions = walk(30);
        for k in [12, 32] {
            let signal = TimeSignal::fit(&positions, k, 0.5).unwrap();
            let h = 1e-5;
            for i in 0..140 {
                let t = 1.1 + f64::from(i) * 0.2003;
                let (a, b) = (signal.at(t - h).unwrap(), signal.at(t + h).unwrap());
                let v = signal.velocity(t).unwrap();
                for axis in 0..2 {
                    assert!(((b[axis] - a[axis]) / (2.0 * h) - v[axis]).abs() < 1e-7);
                }
            }
        }
    }

    #[test]
    fn rests_and_repeats_stay_where_they_are() {
        let mut positions = walk(10);
        positions.insert(4, positions[3]);
        positions.insert(4, positions[3]);
        assert_eq!(control_bounds(&positions), (4, 12));
        let signal = TimeSignal::fit(&positions, 12, 0.5).unwrap();
        assert!(error(&signal, &positions) < 1e-12);
        for t in [4.0, 4.3, 5.0, 5.9, 6.0] {
            assert_eq!(signal.at(t), signal.at(4.0));
            assert_eq!(signal.velocity(t).unwrap().map(f64::abs), [0.0; 2]);
        }
    }

    #[test]
    fn one_frame_and_no_motion_are_a_point_and_two_frames_a_segment() {
        for n in [1, 5] {
            let signal = TimeSignal::fit(&vec![[2.0, 3.0]; n], 7, 0.5).unwrap();
            assert_eq!(signal.frames(), n);
            assert_eq!(signal.at(n as f64), Some([2.0, 3.0]));
            assert_eq!(signal.velocity(1.0), Some([0.0; 2]));
        }
        let two = TimeSignal::fit(&[[0.0, 0.0], [2.0, 4.0]], 4, 0.5).unwrap();
        let middle = two.at(1.5).unwrap();
        assert!((middle[0] - 1.0).abs() < 1e-15 && (middle[1] - 2.0).abs() < 1e-15);
    }

    #[test]
    fn uniform_signals_have_rho_the_identity() {
        let controls: Vec<Point> = walk(9);
        let signal = TimeSignal::uniform(controls, 25).unwrap();
        for (i, t) in signal.parameters().iter().enumerate() {
            assert!((t - i as f64).abs() < 1e-14);
        }
        for t in [1.0, 3.25, 11.5, 24.9] {
            let (place, rate) = signal.place_at(t).unwrap();
            let distance = signal.curve().distance(Place::default(), place);
            assert!((distance - (t - 1.0)).abs() < 1e-13 && (rate - 1.0).abs() < 1e-13);
        }
        let rows = uniform_design(9, 25, &[0.0, 7.3, 24.0]);
        for (row, t) in rows.iter().zip([1.0, 8.3, 25.0]) {
            let sum: f64 = (0..4)
                .map(|i| row.1[i] * signal.controls()[row.0 + i][0])
                .sum();
            assert!((sum - signal.at(t).unwrap()[0]).abs() < 1e-13);
        }
    }

    #[test]
    fn what_cannot_be_is_told_with_the_bounds() {
        let positions = walk(5);
        let controls = |given| TimeError::Controls {
            given,
            least: 4,
            most: 7,
        };
        for given in [3, 8] {
            assert_eq!(
                TimeSignal::fit(&positions, given, 0.5),
                Err(controls(given))
            );
        }
        assert_eq!(TimeSignal::fit(&[], 4, 0.5), Err(TimeError::Empty));
        assert_eq!(
            TimeSignal::fit(&positions, 4, 2.0),
            Err(TimeError::Exponent)
        );
        let broken = [[0.0, 0.0], [f64::NAN, 0.0]];
        assert_eq!(
            TimeSignal::fit(&broken, 4, 0.5),
            Err(TimeError::Frame { frame: 1 })
        );
        assert_eq!(TimeSignal::fit(&positions, 7, 0.5).unwrap().at(5.01), None);
        assert_eq!(
            TimeSignal::fit(&positions, 7, 0.5).unwrap().at(f64::NAN),
            None
        );
    }
}
