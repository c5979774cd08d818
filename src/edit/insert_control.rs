//! One more control point where finer edits are wanted; the curve stays.

use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::signal::time::TimeSignal;

/// The loom with one more control point about time `t`, by knot insertion: psi is unchanged but for
/// rounding, and frames outside the five spans about it keep their bits.
///
/// # Errors
/// `t` lies outside \[1, n\]; nothing moves; or there is a knot at that time.
pub fn insert_control(loom: &Loom, t: f64) -> Result<Loom> {
    super::check_time(loom, t)?;
    let time = loom.time();
    let place = time.place_at(t).map(|(place, _)| place);
    let Some(inserted) = place.and_then(|place| time.curve().insert_knot(place)) else {
        return Diagnostic::error(format!("no control point can be inserted at time {t}"))
            .hint("there is a knot already, or nothing moves; a time beside it will do")
            .err();
    };
    let places = time
        .places()
        .iter()
        .map(|&place| inserted.place(place))
        .collect();
    let (slopes, warps) = (time.slopes().to_vec(), time.warps().to_vec());
    let time = TimeSignal::new(inserted.curve, places, slopes, warps);
    loom.with_time(time.map_err(super::impossible)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn the_motion_is_the_same_with_one_control_more() {
        let loom = ring(10, 30, false);
        let more = insert_control(&loom, 11.37).unwrap();
        assert_eq!(
            more.time().controls().len(),
            loom.time().controls().len() + 1
        );
        for i in 0..=290 {
            let t = 1.0 + f64::from(i) / 10.0;
            let (p, q) = (loom.position_at(t).unwrap(), more.position_at(t).unwrap());
            // a few roundings of numbers of size 1
            assert!((p[0] - q[0]).abs() < 1e-14 && (p[1] - q[1]).abs() < 1e-14);
        }
        assert_eq!(loom.at(2.0).unwrap(), more.at(2.0).unwrap());
        assert_eq!(loom.at(28.0).unwrap(), more.at(28.0).unwrap());
    }

    #[test]
    fn a_knot_is_not_doubled() {
        let loom = ring(5, 10, true);
        // every frame is a knot
        assert!(insert_control(&loom, 4.0).is_err());
        assert!(insert_control(&loom, 11.0).is_err());
    }
}
