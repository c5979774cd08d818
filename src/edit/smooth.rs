//! A stretch of the time signal towards the curve that bends least.

use super::forward::forward;
use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::math::b_spline::Curve;
use crate::math::curve_join::least_bending;

/// The loom with the control points that act within \[`from`, `to`\] only moved a part `amount` in
/// \[0, 1\] of the way to those of the least-bending curve, the ends of the signal held. Frames outside
/// keep their bits.
///
/// # Errors
/// The stretch leaves \[1, n\] or has no length, or is too short to hold a control point; the amount lies
/// outside \[0, 1\].
pub fn smooth(loom: &Loom, from: f64, to: f64, amount: f64) -> Result<Loom> {
    super::check_stretch(loom, from, to)?;
    if !(0.0..=1.0).contains(&amount) {
        return Diagnostic::error(format!(
            "the amount of smoothing is {amount}, outside [0, 1]"
        ))
        .err();
    }
    let forward = forward(loom)?;
    let (from, to) = forward.stretch(from, to);
    let time = forward.loom.time();
    let curve = time.curve();
    let ends = time.place_at(from).zip(time.place_at(to));
    let inside = ends.map_or(0..0, |((a, _), (b, _))| {
        let first = if a.offset > 0.0 { a.span + 1 } else { a.span };
        let end = if b.offset < curve.span_length(b.span) {
            b.span
        } else {
            b.span + 1
        };
        // Control point j acts on spans j-3..=j; those of the ends act beyond.
        let least = if first == 0 { 1 } else { first + 3 };
        let most = if end == curve.spans() {
            curve.controls().len() - 1
        } else {
            end
        };
        least..most
    });
    if inside.is_empty() {
        return Diagnostic::error(format!("no control point acts within [{from}, {to}] only"))
            .hint("take a longer stretch, or insert control points with `insert_control`")
            .err();
    }
    let smoothed = least_bending(curve, inside.clone()).ok_or_else(|| {
        Box::new(Diagnostic::error(
            "the stretch has no curve that bends least",
        ))
    })?;
    let blended = blend(curve, &smoothed, amount, inside);
    let time = time.with_curve(blended).map_err(super::impossible)?;
    forward.restore(&forward.loom.with_time(time)?)
}

/// Control points of `inside` a part of the way from one curve to the other.
fn blend(a: &Curve, b: &Curve, amount: f64, inside: std::ops::Range<usize>) -> Curve {
    let first = inside.start;
    let blended = inside.map(|j| {
        let (from, to) = (a.controls()[j], b.controls()[j]);
        [0, 1].map(|axis| from[axis] + amount * (to[axis] - from[axis]))
    });
    a.with_controls(first, blended)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::reverse;
    use crate::loom::test_looms::ring;

    /// Sum of the squared second differences of positions.
    fn roughness(loom: &Loom, from: usize, to: usize) -> f64 {
        let at = |t: f64| loom.position_at(t).unwrap();
        (10 * from + 1..10 * to)
            .map(|i| {
                let t = i as f64 / 10.0;
                let (a, b, c) = (at(t - 0.1), at(t), at(t + 0.1));
                (0..2)
                    .map(|k| (a[k] - 2.0 * b[k] + c[k]).powi(2))
                    .sum::<f64>()
            })
            .sum()
    }

    #[test]
    fn more_smoothing_bends_less_and_leaves_the_rest_alone() {
        let loom = ring(10, 40, true);
        let mut before = roughness(&loom, 10, 25);
        assert_eq!(smooth(&loom, 10.0, 25.0, 0.0).unwrap().time(), loom.time());
        for amount in [0.3, 0.7, 1.0] {
            let smoothed = smooth(&loom, 10.0, 25.0, amount).unwrap();
            let now = roughness(&smoothed, 10, 25);
            assert!(now < before);
            before = now;
            for frame in (1..=10).chain(25..=40).map(f64::from) {
                assert_eq!(smoothed.at(frame).unwrap(), loom.at(frame).unwrap());
            }
        }
    }

    #[test]
    fn all_of_it_smoothed_is_the_straight_way() {
        let loom = ring(10, 20, true);
        let straight = smooth(&loom, 1.0, 20.0, 1.0).unwrap();
        let (a, b) = (
            loom.position_at(1.0).unwrap(),
            loom.position_at(20.0).unwrap(),
        );
        assert_eq!(straight.position_at(1.0).unwrap(), a);
        for t in [3.3, 9.0, 17.2] {
            let p = straight.position_at(t).unwrap();
            let area = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]);
            assert!(area.abs() < 1e-9);
        }
    }

    #[test]
    fn a_reversed_loom_is_smoothed_where_it_says() {
        let loom = ring(10, 40, true);
        let there = reverse(&smooth(&loom, 10.0, 25.0, 0.5).unwrap()).unwrap();
        let here = smooth(&reverse(&loom).unwrap(), 16.0, 31.0, 0.5).unwrap();
        assert_eq!(there.time(), here.time());
    }

    #[test]
    fn short_stretches_and_odd_amounts_are_refused() {
        let loom = ring(5, 20, false);
        assert!(smooth(&loom, 5.0, 5.5, 0.5).is_err());
        assert!(smooth(&loom, 5.0, 15.0, 1.5).is_err());
        assert!(smooth(&loom, 5.0, 15.0, f64::NAN).is_err());
    }
}
