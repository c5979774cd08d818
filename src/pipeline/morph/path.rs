//! Paths through the space of several poses: one weight a pose for each frame.
//!
//! R14 goes around a circle between four poses by bilinear weights (Fig. 4) and along a spline between
//! three by barycentric ones (Fig. 5).

use std::f64::consts::TAU;
use std::str::FromStr;

use super::{Moment, moments};
use crate::diag::{Diagnostic, Result};
use crate::math::cubic_spline::{CubicSpline, Ends};

/// A path between poses.
#[derive(Debug, Clone, PartialEq)]
pub enum MorphPath {
    /// Once around the circle inside the unit square at whose corners (0,0), (1,0), (0,1), (1,1) four poses
    /// lie, blended bilinearly.
    Circle,
    /// A smooth curve (natural C2 cubic spline) through points: two coordinates in the unit square of four
    /// poses, or one weight a pose, made to sum to 1.
    Points(Vec<Vec<f64>>),
}

impl FromStr for MorphPath {
    type Err = String;

    /// `circle`, or points separated by spaces or semicolons: `0,0 0.5,1 1,1`.
    fn from_str(text: &str) -> Result<Self, String> {
        if text.trim() == "circle" {
            return Ok(MorphPath::Circle);
        }
        let number = |word: &str| -> Result<f64, String> {
            match word.trim().parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                _ => Err(format!("`{}` is no number", word.trim())),
            }
        };
        let words = text.split([' ', ';']).filter(|word| !word.is_empty());
        let points: Vec<Vec<f64>> = words
            .map(|word| word.split(',').map(number).collect())
            .collect::<Result<_, String>>()?;
        let alike = points.iter().all(|point| point.len() == points[0].len());
        match points.len() >= 2 && alike && points[0].len() >= 2 {
            true => Ok(MorphPath::Points(points)),
            false => Err(
                "a path is `circle`, or two or more points with the same number of coordinates, as in `0,0 0.5,1 1,1`"
                    .to_string(),
            ),
        }
    }
}

/// One weight a pose for each of `frames` frames: along `path`, or from pose to pose without one.
pub(super) fn weights(
    path: Option<&MorphPath>,
    frames: usize,
    poses: usize,
) -> Result<Vec<Vec<f64>>> {
    let along = |frame: usize| frame as f64 / (frames - 1) as f64;
    let needs_four = || {
        Diagnostic::error(format!(
            "a path in the square needs four poses, here are {poses}"
        ))
        .hint("or give one weight a pose at each point")
    };
    match path {
        None => {
            let moments = moments(frames, poses);
            let rows = moments.into_iter().map(|moment| between(moment, poses));
            Ok(rows.collect())
        }
        Some(MorphPath::Circle) if poses != 4 => needs_four().err(),
        Some(MorphPath::Circle) => Ok((0..frames)
            .map(|frame| {
                let (sine, cosine) = libm::sincos(TAU * along(frame));
                bilinear(0.5 + 0.5 * cosine, 0.5 + 0.5 * sine)
            })
            .collect()),
        Some(MorphPath::Points(points)) => {
            let square = points[0].len() == 2 && poses == 4;
            if points[0].len() == 2 && poses > 2 && !square {
                return needs_four().err();
            }
            if !square && points[0].len() != poses {
                return Diagnostic::error(format!(
                    "the points of the path have {} coordinates, but there are {poses} poses",
                    points[0].len()
                ))
                .err();
            }
            let curve = Curve::new(points)?;
            (0..frames)
                .map(|frame| {
                    let point = curve.at(along(frame));
                    match square {
                        true => Ok(bilinear(point[0], point[1])),
                        false => barycentric(point),
                    }
                })
                .collect()
        }
    }
}

fn between(moment: Moment, poses: usize) -> Vec<f64> {
    let mut weights = vec![0.0; poses];
    weights[moment.pose] = 1.0 - moment.t;
    if moment.t > 0.0 {
        weights[moment.pose + 1] = moment.t;
    }
    weights
}

fn bilinear(x: f64, y: f64) -> Vec<f64> {
    vec![(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y]
}

/// Weights divided by their sum.
fn barycentric(mut weights: Vec<f64>) -> Result<Vec<f64>> {
    let sum: f64 = weights.iter().sum();
    if sum.abs() < 1e-9 {
        return Diagnostic::error("the weights of a point of the path sum to zero")
            .hint("weights are shares: they should sum to 1")
            .err();
    }
    weights.iter_mut().for_each(|weight| *weight /= sum);
    Ok(weights)
}

/// A curve through points, even in the distances between them.
struct Curve {
    spline: CubicSpline,
    dimension: usize,
}

impl Curve {
    fn new(points: &[Vec<f64>]) -> Result<Self> {
        let mut knots = vec![0.0];
        for pair in points.windows(2) {
            let squares = pair[0].iter().zip(&pair[1]).map(|(a, b)| (a - b) * (a - b));
            let distance = squares.sum::<f64>().sqrt();
            if distance == 0.0 {
                return Diagnostic::error("two neighbouring points of the path are the same").err();
            }
            knots.push(knots[knots.len() - 1] + distance);
        }
        let dimension = points[0].len();
        let values = points.concat();
        let spline = CubicSpline::new(&knots, &values, dimension, Ends::Natural);
        let told = |_| {
            Box::new(Diagnostic::error(
                "the points of the path are too close together",
            ))
        };
        Ok(Curve {
            spline: spline.map_err(told)?,
            dimension,
        })
    }

    /// t in [0, 1]; the points themselves at their knots.
    fn at(&self, t: f64) -> Vec<f64> {
        let knots = self.spline.knots();
        let mut point = vec![0.0; self.dimension];
        self.spline.evaluate(t * knots[knots.len() - 1], &mut point);
        point
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str) -> MorphPath {
        text.parse().unwrap()
    }

    fn near(a: &[f64], b: &[f64]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn without_a_path_poses_follow_each_other() {
        let found = weights(None, 5, 3).unwrap();
        assert_eq!(found[0], [1.0, 0.0, 0.0]);
        assert_eq!(found[1], [0.5, 0.5, 0.0]);
        assert_eq!(found[2], [0.0, 1.0, 0.0]);
        assert_eq!(found[4], [0.0, 0.0, 1.0]);
    }

    #[test]
    fn weights_sum_to_one_and_points_are_met() {
        let circle = weights(Some(&path("circle")), 41, 4).unwrap();
        assert!(
            circle
                .iter()
                .all(|row| (row.iter().sum::<f64>() - 1.0).abs() < 1e-12)
        );
        // the circle begins at (1, 1/2): half of the second pose, half of the fourth
        assert!(near(&circle[0], &[0.0, 0.5, 0.0, 0.5]) && near(&circle[40], &circle[0]));
        let square = weights(Some(&path("0,0 1,0; 1,1")), 3, 4).unwrap();
        assert!(near(&square[1], &[0.0, 1.0, 0.0, 0.0]));
        let three = weights(Some(&path("1,0,0 0,2,0 1,1,2")), 9, 3).unwrap();
        assert!(
            three
                .iter()
                .all(|row| (row.iter().sum::<f64>() - 1.0).abs() < 1e-12)
        );
        assert!(near(&three[0], &[1.0, 0.0, 0.0]) && near(&three[8], &[0.25, 0.25, 0.5]));
    }

    #[test]
    fn paths_that_do_not_fit_are_told() {
        for text in ["", "1,2", "0,0 1", "0,x 1,1", "0,nan 1,1", "spiral"] {
            assert!(text.parse::<MorphPath>().is_err(), "{text}");
        }
        assert!(weights(Some(&path("circle")), 5, 3).is_err());
        assert!(weights(Some(&path("0,0 1,1")), 5, 3).is_err());
        assert!(weights(Some(&path("1,0,0 0,1,0")), 5, 2).is_err());
        assert!(weights(Some(&path("1,-1 -1,1")), 3, 2).is_err());
        assert!(weights(Some(&path("1,0 1,0")), 3, 2).is_err());
        // two poses: weights
        assert!(weights(Some(&path("1,0 0,1")), 3, 2).is_ok());
    }
}
