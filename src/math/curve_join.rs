//! One B-spline curve passing into another: C2, with as little change of acceleration as the fixed control
//! points allow, or with all of both curves left as it was.

use std::ops::Range;

use faer::Mat;

use super::b_spline::{Curve, Place, Point, basis_derivatives};
use super::least_squares::least_squares;

/// Spans 0..`left_spans` of `left`, then spans of the lengths `bridge`, then the spans of `right` from
/// `right_start` on. Control points up to number `left_spans` of `left` and from `right_start` + 2 on of
/// `right` stay; the bridge's length + 1 between them minimise the integral of the squared third
/// derivative. So of `left` its last two spans change, of `right` the first two, and all others keep
/// their bits.
///
/// None when a curve is a point, the spans do not exist, or nothing determines the control points.
pub fn join(
    (left, left_spans): (&Curve, usize),
    (right, right_start): (&Curve, usize),
    bridge: &[f64],
) -> Option<Curve> {
    let (intervals, mut controls) = laid((left, left_spans), (right, right_start), bridge)?;
    let (first, free) = (left_spans + 1, bridge.len() + 1);
    smooth(&intervals, &mut controls, first, free, third_derivative)?;
    Curve::new(intervals, controls).ok()
}

/// The same spans joined by a bridge of 3 spans or more so that `left` up to its end and `right` from its
/// start on are what they were, to rounding in the two spans on each side of the bridge. The first two
/// and the last two of the bridge's control points are determined by that; the rest minimise the integral
/// of the squared third derivative.
///
/// A control point is the blossom of the cubic at its three knots. About the end b of the last span, of
/// length w, the next knots being b + v_1 and b + v_1 + v_2, those two are
///
/// ```text
/// F(b-w, b, b+v_1) = f + (v_1 - w) f'/3 - w v_1 f''/6
/// F(b, b+v_1, b+v_1+v_2) = f + (2 v_1 + v_2) f'/3 + v_1 (v_1 + v_2) f''/6
/// ```
///
/// (with f and its derivatives at b; the third appears in neither), and mirrored at the start.
///
/// None where [`join`] is none, the bridge is shorter, or a span beside it has no length.
pub fn join_exactly(
    (left, left_spans): (&Curve, usize),
    (right, right_start): (&Curve, usize),
    bridge: &[f64],
) -> Option<Curve> {
    let (intervals, mut controls) = laid((left, left_spans), (right, right_start), bridge)?;
    let (first, free) = (left_spans + 1, bridge.len() + 1);
    let last = left_spans.checked_sub(1).filter(|_| bridge.len() >= 3)?;
    let end = Place {
        span: last,
        offset: left.span_length(last),
    };
    let start = Place {
        span: right_start,
        offset: 0.0,
    };
    let (before, after) = (end.offset, right.span_length(right_start));
    if before <= 0.0 || after <= 0.0 {
        return None;
    }
    let [slope, bend] = left.derivatives(end);
    let ahead = blossoms(left.at(end), slope, bend, (before, [bridge[0], bridge[1]]));
    let [slope, bend] = right.derivatives(start);
    let back = slope.map(|x| -x);
    let ends = [bridge[bridge.len() - 1], bridge[bridge.len() - 2]];
    let behind = blossoms(right.at(start), back, bend, (after, ends));
    controls[first..first + 2].copy_from_slice(&ahead);
    (controls[first + free - 1], controls[first + free - 2]) = (behind[0], behind[1]);
    if free > 4 {
        let inner = first + 2;
        smooth(&intervals, &mut controls, inner, free - 4, third_derivative)?;
    }
    Curve::new(intervals, controls).ok()
}

/// The two control points after a span of length `w`, at whose end a curve has this point, slope and second
/// derivative, where the next two intervals are `ahead`.
fn blossoms(at: Point, slope: Point, bend: Point, (w, ahead): (f64, [f64; 2])) -> [Point; 2] {
    let [v, next] = ahead;
    let factors = [
        ((v - w) / 3.0, -w * v / 6.0),
        ((2.0 * v + next) / 3.0, v * (v + next) / 6.0),
    ];
    factors.map(|(a, b)| [0, 1].map(|axis| at[axis] + a * slope[axis] + b * bend[axis]))
}

/// Intervals and control points of a curve through the spans of both and the bridge; the control points of
/// the bridge, one more than it has spans, are 0.
fn laid(
    (left, left_spans): (&Curve, usize),
    (right, right_start): (&Curve, usize),
    bridge: &[f64],
) -> Option<(Vec<f64>, Vec<Point>)> {
    let sound = left_spans <= left.spans() && right_start < right.spans() && left.spans() > 0;
    if !sound || bridge.iter().any(|&w| w.is_nan() || w <= 0.0) {
        return None;
    }
    let intervals = [
        &left.intervals()[..left_spans + 2],
        bridge,
        &right.intervals()[right_start + 2..],
    ]
    .concat();
    let mut controls = left.controls()[..=left_spans].to_vec();
    controls.extend(vec![[0.0; 2]; bridge.len() + 1]);
    controls.extend(&right.controls()[right_start + 2..]);
    Some((intervals, controls))
}

/// The curve with control points `free` where the integral of the squared second derivative is least; the
/// others stay. None for a point, or when nothing determines them.
pub fn least_bending(curve: &Curve, free: Range<usize>) -> Option<Curve> {
    let mut controls = curve.controls().to_vec();
    if curve.spans() == 0 || free.is_empty() || free.end > controls.len() {
        return None;
    }
    smooth(
        curve.intervals(),
        &mut controls,
        free.start,
        free.len(),
        bending,
    )?;
    Curve::new(curve.intervals().to_vec(), controls).ok()
}

/// Row of a span's energy: its weights of the four control points, squared and summed over spans.
type Energy = fn([f64; 5]) -> Vec<[f64; 4]>;

/// Sets `count` control points from `first` on so that the sum of `energy` over the spans they touch is
/// least; the others stay.
fn smooth(
    intervals: &[f64],
    controls: &mut [Point],
    first: usize,
    count: usize,
    energy: Energy,
) -> Option<()> {
    let spans = controls.len() - 3;
    let touched = first.saturating_sub(3)..(first + count).min(spans);
    let about = controls[first.saturating_sub(1)];
    let (mut rows, mut right) = (Vec::new(), Vec::new());
    for span in touched.filter(|&span| intervals[span + 2] > 0.0) {
        let around = [0, 1, 2, 3, 4].map(|i| intervals[span + i]);
        for weights in energy(around) {
            let mut row = vec![0.0; count];
            let mut known = [0.0; 2];
            for (i, weight) in weights.into_iter().enumerate() {
                match (span + i).checked_sub(first).filter(|&j| j < count) {
                    Some(j) => row[j] += weight,
                    None => {
                        for axis in 0..2 {
                            known[axis] -= weight * (controls[span + i][axis] - about[axis]);
                        }
                    }
                }
            }
            rows.push(row);
            right.push(known);
        }
    }
    let matrix = Mat::from_fn(rows.len(), count, |i, j| rows[i][j]);
    let right = Mat::from_fn(rows.len(), 2, |i, axis| right[i][axis]);
    let found = least_squares(matrix, right)?;
    for j in 0..count {
        controls[first + j] = [0, 1].map(|axis| found[(j, axis)] + about[axis]);
    }
    Some(())
}

/// sqrt(length) f''': its square is the integral over the span.
fn third_derivative(around: [f64; 5]) -> Vec<[f64; 4]> {
    let length = around[2];
    let second = |x: f64| basis_derivatives(around, x)[1];
    let (a, b) = (second(0.0), second(length));
    vec![[0, 1, 2, 3].map(|i| (b[i] - a[i]) / length.sqrt())]
}

/// Two rows whose squares sum to the integral of |f''|^2 over a span, f'' being linear there from a to
/// b: length/3 (a^2 + a b + b^2) = length/3 ((a + b/2)^2 + 3/4 b^2).
pub fn bending(around: [f64; 5]) -> Vec<[f64; 4]> {
    let length = around[2];
    let second = |x: f64| basis_derivatives(around, x)[1];
    let (a, b) = (second(0.0), second(length));
    let root = (length / 3.0).sqrt();
    vec![
        [0, 1, 2, 3].map(|i| root * (a[i] + 0.5 * b[i])),
        b.map(|b| root * 0.75_f64.sqrt() * b),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::b_spline::Place;

    fn circle(spans: usize) -> Curve {
        let mut intervals = vec![1.0; spans + 4];
        intervals[1] = 0.5;
        let angle = |j: usize| 0.4 * j as f64;
        let controls = (0..spans + 3).map(|j| [libm::cos(angle(j)), libm::sin(angle(j))]);
        Curve::new(intervals, controls.collect()).unwrap()
    }

    fn at(curve: &Curve, span: usize, offset: f64) -> Point {
        curve.at(Place { span, offset })
    }

    #[test]
    fn only_two_spans_on_each_side_change() {
        let curve = circle(20);
        for bridge in [&[][..], &[0.7], &[1.0, 1.2, 0.5]] {
            let joined = join((&curve, 14), (&curve, 4), bridge).unwrap();
            let shift = 14 + bridge.len() - 4;
            assert_eq!(joined.spans(), 20 + shift);
            for x in [0.0, 0.3, 1.0] {
                (0..12).for_each(|s| assert_eq!(at(&joined, s, x), at(&curve, s, x)));
                (6..20).for_each(|s| assert_eq!(at(&joined, s + shift, x), at(&curve, s, x)));
            }
        }
    }

    /// A curve between clamped ends, its knots uneven.
    fn clamped() -> Curve {
        let inner = (0..9).map(|i| 0.5 + 0.25 * f64::from(i * i % 5));
        let ends = [0.0, 0.0];
        let intervals = ends.into_iter().chain(inner).chain(ends).collect();
        let controls = (0..12).map(|j| [f64::from(j), f64::from(j * j % 7)]);
        Curve::new(intervals, controls.collect()).unwrap()
    }

    #[test]
    fn both_sides_of_an_exact_join_are_what_they_were() {
        let curve = clamped();
        let near = |p: Point, q: Point| (0..2).all(|k| (p[k] - q[k]).abs() < 1e-12);
        // the end and the start of a motion, and places within it
        for (end, start) in [(9, 0), (7, 2), (4, 4), (2, 6)] {
            for bridge in [&[0.5, 0.4, 0.3][..], &[1.0, 0.2, 0.7, 0.9, 0.4, 1.5]] {
                let joined = join_exactly((&curve, end), (&curve, start), bridge).unwrap();
                let shift = end + bridge.len() - start;
                for part in [0.0, 0.3, 1.0] {
                    let there = |s: usize, shift: usize| {
                        let x = part * curve.span_length(s);
                        (at(&joined, s + shift, x), at(&curve, s, x))
                    };
                    for (span, (p, q)) in (0..end).map(|s| (s, there(s, 0))) {
                        assert!(near(p, q), "{span}");
                        assert!(span + 2 >= end || p == q);
                    }
                    for (span, (p, q)) in (start..9).map(|s| (s, there(s, shift))) {
                        assert!(near(p, q), "{span}");
                        assert!(span < start + 2 || p == q);
                    }
                }
                // C2 from span to span, over the joins too
                for s in 1..joined.spans() {
                    let (before, after) = (joined.span_length(s - 1), 0.0);
                    let ends = [(s - 1, before), (s, after)];
                    let [a, b] = ends.map(|(span, offset)| Place { span, offset });
                    assert!(near(joined.at(a), joined.at(b)));
                    let (a, b) = (joined.derivatives(a), joined.derivatives(b));
                    // second derivatives reach 1e3 here
                    let same = |p: Point, q: Point| (0..2).all(|k| (p[k] - q[k]).abs() < 1e-9);
                    assert!(same(a[0], b[0]) && same(a[1], b[1]), "{s}");
                }
            }
        }
        assert!(join_exactly((&curve, 7), (&curve, 2), &[1.0, 1.0]).is_none());
        assert!(join_exactly((&curve, 0), (&curve, 2), &[1.0; 3]).is_none());
    }

    #[test]
    fn a_cut_that_is_joined_again_is_the_curve() {
        // a cubic has no change of third derivative to smooth
        let line: Vec<Point> = (0..12)
            .map(|j| [f64::from(j), 2.0 - f64::from(j)])
            .collect();
        let curve = Curve::new(vec![1.0; 13], line).unwrap();
        let joined = join((&curve, 5), (&curve, 5), &[]).unwrap();
        for (a, b) in joined.controls().iter().zip(curve.controls()) {
            assert!((a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn what_does_not_exist_is_not_joined() {
        let (curve, point) = (circle(5), Curve::point([0.0; 2]));
        assert!(join((&curve, 6), (&curve, 0), &[]).is_none());
        assert!(join((&curve, 5), (&curve, 5), &[]).is_none());
        assert!(join((&point, 0), (&curve, 0), &[]).is_none());
        assert!(join((&curve, 3), (&curve, 0), &[0.0]).is_none());
    }
}
