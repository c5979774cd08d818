//! A control point of the time signal moved: a local edit (CH12 §4.1).

use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::math::b_spline::Point;

/// The loom with control point `control` (from 1) of the time signal at `to`. Frames outside its four
/// spans keep their bits.
///
/// # Errors
/// There is no such control point, or `to` is not finite.
pub fn move_control(loom: &Loom, control: usize, to: Point) -> Result<Loom> {
    let time = loom.time();
    let count = time.controls().len();
    if !(1..=count).contains(&control) {
        return Diagnostic::error(format!("there is no control point {control}"))
            .hint(format!("they are numbered from 1 to {count}"))
            .err();
    }
    if !(to[0].is_finite() && to[1].is_finite()) {
        return Diagnostic::error("a control point must lie at finite coordinates").err();
    }
    let curve = time.curve().with_control(control - 1, to);
    loom.with_time(time.with_curve(curve).map_err(super::impossible)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn only_frames_in_the_four_spans_move() {
        let loom = ring(20, 40, false);
        let (control, place) = (12, loom.time().controls()[11]);
        let moved = move_control(&loom, control, [place[0] + 0.3, place[1]]).unwrap();
        let mut changed = 0;
        for frame in 1..=40 {
            let span = loom.time().places()[frame - 1].span;
            let (before, after) = (
                loom.at(frame as f64).unwrap(),
                moved.at(frame as f64).unwrap(),
            );
            let inside = (8..=11).contains(&span);
            if !inside {
                assert_eq!(before, after, "frame {frame}");
            }
            changed += usize::from(before != after);
        }
        assert!(changed > 0);
    }

    #[test]
    fn a_small_move_is_a_small_change() {
        let loom = ring(20, 30, true);
        let place = loom.time().controls()[9];
        let change = |by: f64| {
            let moved = move_control(&loom, 10, [place[0] + by, place[1]]).unwrap();
            let (a, b) = (loom.shape_at(8.5).unwrap(), moved.shape_at(8.5).unwrap());
            a.iter()
                .zip(&b)
                .map(|(a, b)| (a - b) * (a - b))
                .sum::<f64>()
                .sqrt()
        };
        // differentiable: half the move, half the change, to second order
        assert!((change(1e-4) / change(5e-5) - 2.0).abs() < 1e-2);
    }

    #[test]
    fn a_control_point_that_does_not_exist_is_refused_with_the_numbers() {
        let loom = ring(5, 10, true);
        let error = move_control(&loom, 13, [0.0; 2]).unwrap_err();
        assert!(error.hints[0].contains("1 to 12"));
        assert!(move_control(&loom, 0, [0.0; 2]).is_err());
        assert!(move_control(&loom, 3, [f64::NAN, 0.0]).is_err());
    }
}
