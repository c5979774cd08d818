//! A new time signal sketched in the map (CH12 §4.4).

use super::forward::assembled;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::math::b_spline::{Curve, CurveError, Place, Point};
use crate::signal::time::{TimeError, TimeSignal};

/// What the points of a sketch are to its curve.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Sketch {
    /// The curve passes them, in order.
    #[default]
    Through,
    /// They are the control points f_j of a cubic B-spline with uniform knots u_j = j (CH12 §4.4): smooth
    /// however they lie; it begins and ends near the second and the last but one.
    Controls,
}

/// The loom whose time signal is a curve sketched by `points` of the map over `frames` frames (or as many
/// as it had), at times t_i = h i uniform in the curve's parameter: between points that it passes that
/// grows with the root of their distance. Root motion, which belongs to the old signal, is dropped, and
/// that is told.
///
/// # Errors
/// No points, or one that is not finite; fewer than 4 control points; no frames, or too many.
pub fn path(
    loom: &Loom,
    points: &[Point],
    sketch: Sketch,
    frames: Option<usize>,
) -> Result<Warned<Loom>> {
    let frames = frames.unwrap_or_else(|| loom.frames());
    super::check_frames(frames)?;
    if frames == 0 {
        return Diagnostic::error("a path needs at least one frame").err();
    }
    let (curve, end) = match sketch {
        Sketch::Through => passing(points)?,
        Sketch::Controls => controlled(points)?,
    };
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

/// The natural spline through points, and its end.
fn passing(points: &[Point]) -> Result<(Curve, Place)> {
    let most = crate::signal::control_bounds(points).1;
    let sketched = TimeSignal::fit(points, most, 0.5).map_err(explained)?;
    let end = sketched.places().last().copied().unwrap_or_default();
    Ok((sketched.curve().clone(), end))
}

/// The uniform cubic B-spline of control points, and its end.
fn controlled(points: &[Point]) -> Result<(Curve, Place)> {
    if points.len() < 4 {
        let message = format!("{} control points make no cubic curve", points.len());
        return Diagnostic::error(message)
            .hint("it takes four or more")
            .err();
    }
    let intervals = vec![1.0; points.len() + 1];
    let curve = Curve::new(intervals, points.to_vec()).map_err(|error| match error {
        CurveError::Control { index } => explained(TimeError::Frame { frame: index }),
        other => Box::new(Diagnostic::error(format!(
            "the sketch is no curve: {other:?}"
        ))),
    })?;
    let end = Place {
        span: curve.spans() - 1,
        offset: 1.0,
    };
    Ok((curve, end))
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
        let drawn = path(&loom, &points, Sketch::Through, None).unwrap();
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
        let still = path(&loom, &[[0.3, 0.2]], Sketch::Through, None)
            .unwrap()
            .output;
        assert_eq!(still.position_at(7.7).unwrap(), [0.3, 0.2]);
        for points in [&[][..], &[[f64::NAN, 0.0]], &[[f64::NAN, 0.0]; 5]] {
            for sketch in [Sketch::Through, Sketch::Controls] {
                assert!(path(&loom, points, sketch, None).is_err());
            }
        }
        assert!(path(&loom, &[[0.0, 0.0]], Sketch::Through, Some(0)).is_err());
    }

    #[test]
    fn control_points_make_the_uniform_b_spline() {
        let loom = travelling(10, 25);
        let f = [[0.0, 0.0], [0.5, 0.1], [0.6, 0.6], [-0.2, 0.3], [0.0, -0.4]];
        let sketched = path(&loom, &f, Sketch::Controls, Some(41)).unwrap().output;
        // two spans over forty frames: frame 21 is where they meet
        for (frame, middle) in [(1, 1), (21, 2), (41, 3)] {
            let p = sketched.position_at(f64::from(frame)).unwrap();
            for axis in 0..2 {
                let [a, b, c] = [middle - 1, middle, middle + 1].map(|j: usize| f[j][axis]);
                // the closed form of a uniform cubic B-spline at a knot
                assert!((p[axis] - (a + 4.0 * b + c) / 6.0).abs() < 1e-14);
            }
        }
        assert!(path(&loom, &f[..3], Sketch::Controls, None).is_err());
    }
}
