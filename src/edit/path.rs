//! A new time signal sketched in the map (CH12 §4.4).

use super::forward::assembled;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::math::b_spline::{Place, Point};
use crate::signal::time::{TimeError, TimeSignal};

/// The loom whose time signal is a smooth curve through `points` of the map, in order, over as many
/// frames as it had. Between points it takes time in proportion to the root of their distance. Root
/// motion, which belongs to the old signal, is dropped, and that is told.
///
/// # Errors
/// No points, or one that is not finite.
pub fn path(loom: &Loom, points: &[Point]) -> Result<Warned<Loom>> {
    let most = crate::signal::control_bounds(points).1;
    let sketched = TimeSignal::fit(points, most, 0.5).map_err(explained)?;
    let frames = loom.frames();
    let curve = sketched.curve().clone();
    let end = sketched.places().last().copied().unwrap_or_default();
    let length = curve.distance(Place::default(), end);
    let step = length / frames.saturating_sub(1).max(1) as f64;
    let places = (0..frames).map(|i| curve.advance(Place::default(), step * i as f64));
    let places = places.collect::<Vec<_>>();
    let time = TimeSignal::new(curve, places, vec![step; frames], Vec::new());
    let mut all = Warned::clean(assembled(loom, time.map_err(super::impossible)?, None)?);
    if loom.root().is_some() {
        all.warnings.push(
            Diagnostic::warning("the root motion belonged to the old time signal and is dropped")
                .hint("`root: \"none\"` at the fit leaves it in the shapes"),
        );
    }
    Ok(all)
}

fn explained(error: TimeError) -> Box<Diagnostic> {
    Box::new(match error {
        TimeError::Frame { frame } => {
            Diagnostic::error(format!("point {} of the path is not finite", frame + 1))
        }
        _ => Diagnostic::error("a path needs at least one point"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::travelling;

    #[test]
    fn the_points_are_passed_in_order() {
        let loom = travelling(10, 25);
        let points = [[0.0, 0.0], [0.5, 0.1], [0.6, 0.6], [-0.2, 0.3]];
        let drawn = path(&loom, &points).unwrap();
        assert_eq!((drawn.output.frames(), drawn.warnings.len()), (25, 1));
        let mut after = 1.0;
        for point in points {
            let times = (0..=4800).map(|i| 1.0 + f64::from(i) / 200.0);
            let far = |t: f64| {
                let p = drawn.output.position_at(t).unwrap();
                libm::hypot(p[0] - point[0], p[1] - point[1])
            };
            let nearest = times.min_by(|a, b| far(*a).total_cmp(&far(*b))).unwrap();
            // half a step of 1/200 frame at a tenth of the map a frame
            assert!(far(nearest) < 1e-3 && nearest >= after - 0.01);
            after = nearest;
        }
    }

    #[test]
    fn one_point_stays_and_none_is_refused() {
        let loom = travelling(5, 10);
        let still = path(&loom, &[[0.3, 0.2]]).unwrap().output;
        assert_eq!(still.position_at(7.7).unwrap(), [0.3, 0.2]);
        assert!(path(&loom, &[]).is_err() && path(&loom, &[[f64::NAN, 0.0]]).is_err());
    }
}
