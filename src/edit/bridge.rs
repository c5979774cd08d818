//! The way over a seam: control points that let the shapes change their velocity least.

use faer::Mat;

use crate::math::b_spline::{Curve, Place, basis};
use crate::math::least_squares::least_squares;
use crate::signal::pose::PoseSignal;

/// Steps of the solver; it stops earlier when a step gains less than a thousandth.
const STEPS: usize = 40;

/// Moves the `count` control points from `first` on so that the sum of the squared second differences of
/// g(f~(u_i)), the shapes at consecutive `places`, is least (Levenberg-Marquardt, analytic derivatives).
/// The curve so far is the start; what does not improve on it is not taken.
pub(super) fn ease(
    pose: &PoseSignal,
    curve: &Curve,
    places: &[Place],
    first: usize,
    count: usize,
) -> Curve {
    let mut best = State::new(pose, curve.clone(), places);
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        let (matrix, right) = best.system(pose, places, (first, count), damping);
        let Some(step) = least_squares(matrix, right) else {
            break;
        };
        let moved = (0..count).fold(best.curve.clone(), |curve, j| {
            let at = curve.controls()[first + j];
            curve.with_control(
                first + j,
                [at[0] + step[(2 * j, 0)], at[1] + step[(2 * j + 1, 0)]],
            )
        });
        let next = State::new(pose, moved, places);
        if next.energy < best.energy {
            let gain = 1.0 - next.energy / best.energy;
            best = next;
            damping *= 0.2;
            if gain < 1e-3 {
                break;
            }
        } else {
            damping *= 5.0;
            if damping > 1e6 {
                break;
            }
        }
    }
    best.curve
}

/// A curve, the second differences of the shapes along it, and their sum of squares.
struct State {
    curve: Curve,
    bends: Vec<f64>,
    energy: f64,
}

impl State {
    fn new(pose: &PoseSignal, curve: Curve, places: &[Place]) -> Self {
        let m = pose.modes();
        let mut x = vec![0.0; m * places.len()];
        for (place, x) in places.iter().zip(x.chunks_mut(m.max(1))) {
            pose.evaluate(curve.at(*place), x);
        }
        let bends: Vec<f64> = (0..x.len().saturating_sub(2 * m))
            .map(|i| x[i] - 2.0 * x[i + m] + x[i + 2 * m])
            .collect();
        State {
            curve,
            energy: bends.iter().map(|b| b * b).sum(),
            bends,
        }
    }

    /// The damped Gauss-Newton system for the control points: rows of the second differences, then those of
    /// the damping, relative to each unknown's own column.
    fn system(
        &self,
        pose: &PoseSignal,
        places: &[Place],
        (first, count): (usize, usize),
        damping: f64,
    ) -> (Mat<f64>, Mat<f64>) {
        let (m, rows, unknowns) = (pose.modes(), self.bends.len(), 2 * count);
        let mut matrix = Mat::<f64>::zeros(rows + unknowns, unknowns);
        let mut slopes = vec![0.0; 2 * m];
        for (i, place) in places.iter().enumerate() {
            pose.jacobian(self.curve.at(*place), &mut slopes);
            let weights = basis(self.curve.around(place.span), place.offset);
            for (c, weight) in weights.into_iter().enumerate() {
                let Some(j) = (place.span + c).checked_sub(first).filter(|&j| j < count) else {
                    continue;
                };
                // Place i is in the second differences that begin at i-2, i-1, i.
                for (back, factor) in [(2, 1.0), (1, -2.0), (0, 1.0)] {
                    let Some(row) = i.checked_sub(back).map(|b| b * m).filter(|&r| r < rows) else {
                        continue;
                    };
                    for axis in 0..2 {
                        for k in 0..m {
                            matrix[(row + k, 2 * j + axis)] +=
                                factor * weight * slopes[axis * m + k];
                        }
                    }
                }
            }
        }
        for j in 0..unknowns {
            let size: f64 = (0..rows).map(|i| matrix[(i, j)] * matrix[(i, j)]).sum();
            matrix[(rows + j, j)] = (damping * size).sqrt();
        }
        let right = Mat::from_fn(rows + unknowns, 1, |i, _| {
            if i < rows { -self.bends[i] } else { 0.0 }
        });
        (matrix, right)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn the_shapes_bend_less_and_other_control_points_stay() {
        let loom = ring(5, 21, true);
        let (curve, places) = (loom.time().curve(), &loom.time().places()[4..16]);
        let rough = (8..13).fold(curve.clone(), |curve, j| {
            let at = curve.controls()[j];
            curve.with_control(j, [at[0] + 0.1 * libm::sin(j as f64), at[1]])
        });
        let eased = ease(loom.pose(), &rough, places, 8, 5);
        let energy = |curve: &Curve| State::new(loom.pose(), curve.clone(), places).energy;
        assert!(energy(&eased) < energy(&rough));
        // the smooth motion's own control points are among the choices
        assert!(energy(&eased) < 1.05 * energy(curve));
        for (j, (a, b)) in eased.controls().iter().zip(rough.controls()).enumerate() {
            assert!((8..13).contains(&j) || a == b);
        }
    }
}
