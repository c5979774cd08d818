//! The way over a seam: control points that let the shapes change their velocity least.

use faer::Mat;

use crate::math::b_spline::{Curve, Place, basis};
use crate::math::least_squares::least_squares;
use crate::signal::pose::PoseSignal;

/// Steps of the solver; it stops earlier when a step gains less than a thousandth.
const STEPS: usize = 40;

/// Powers of the second differences that weigh their squares, one round after another: the last is nearly
/// least for the largest of them. What shows at a seam is its largest change, and of a motion with the
/// least squares alone that is up to twice what it needs to be.
const POWERS: [i32; 3] = [1, 2, 4];

/// Moves the `count` control points from `first` on so that the sum of the squared second differences of
/// g(f~(u_i)), the shapes at consecutive `places`, is least. The curve so far is the start; what does not
/// improve on it is not taken.
pub(super) fn ease(
    pose: &PoseSignal,
    curve: &Curve,
    places: &[Place],
    first: usize,
    count: usize,
) -> Curve {
    let even = vec![1.0; places.len().saturating_sub(2)];
    descend(pose, curve, places, (first, count), &even)
}

/// The same for the largest second difference rather than their sum: from what [`ease`] gives, sums that
/// weigh large ones more and more are made least, as long as the largest falls.
pub(super) fn even(
    pose: &PoseSignal,
    curve: &Curve,
    places: &[Place],
    first: usize,
    count: usize,
) -> Curve {
    let mut best = ease(pose, curve, places, first, count);
    for power in POWERS {
        let sizes = bends(pose, &best, places);
        let largest = sizes.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            break;
        }
        let weigh = |size: &f64| (size / largest).max(LEAST).powi(power);
        let weights: Vec<f64> = sizes.iter().map(weigh).collect();
        let next = descend(pose, &best, places, (first, count), &weights);
        if bends(pose, &next, places).into_iter().fold(0.0, f64::max) >= largest {
            break;
        }
        best = next;
    }
    best
}

/// Small second differences are weighed as this part of the largest: none is free.
const LEAST: f64 = 0.05;

/// The norms of the second differences of the shapes.
fn bends(pose: &PoseSignal, curve: &Curve, places: &[Place]) -> Vec<f64> {
    let even = vec![1.0; places.len().saturating_sub(2)];
    let state = State::new(pose, curve.clone(), places, &even);
    let norm = |bend: &[f64]| bend.iter().map(|b| b * b).sum::<f64>().sqrt();
    state.bends.chunks(pose.modes().max(1)).map(norm).collect()
}

/// Levenberg-Marquardt with analytic derivatives on the weighted sum of squares. The curve so far is the
/// start; what does not improve on it is not taken.
fn descend(
    pose: &PoseSignal,
    curve: &Curve,
    places: &[Place],
    (first, count): (usize, usize),
    weights: &[f64],
) -> Curve {
    let mut best = State::new(pose, curve.clone(), places, weights);
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
        let next = State::new(pose, moved, places, weights);
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

/// A curve, the second differences of the shapes along it, each times the root of its weight, and their
/// sum of squares.
struct State {
    curve: Curve,
    roots: Vec<f64>,
    bends: Vec<f64>,
    energy: f64,
}

impl State {
    fn new(pose: &PoseSignal, curve: Curve, places: &[Place], weights: &[f64]) -> Self {
        let m = pose.modes();
        let roots: Vec<f64> = weights.iter().map(|weight| weight.sqrt()).collect();
        let mut x = vec![0.0; m * places.len()];
        for (place, x) in places.iter().zip(x.chunks_mut(m.max(1))) {
            pose.evaluate(curve.at(*place), x);
        }
        let bends: Vec<f64> = (0..x.len().saturating_sub(2 * m))
            .map(|i| roots[i / m.max(1)] * (x[i] - 2.0 * x[i + m] + x[i + 2 * m]))
            .collect();
        State {
            curve,
            roots,
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
                    let root = self.roots[row / m.max(1)];
                    for axis in 0..2 {
                        for k in 0..m {
                            matrix[(row + k, 2 * j + axis)] +=
                                root * factor * weight * slopes[axis * m + k];
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
        let bent = |curve: &Curve| bends(loom.pose(), curve, places);
        let energy = |curve: &Curve| bent(curve).iter().map(|b| b * b).sum::<f64>();
        let largest = |curve: &Curve| bent(curve).into_iter().fold(0.0, f64::max);
        let eased = ease(loom.pose(), &rough, places, 8, 5);
        assert!(energy(&eased) < energy(&rough));
        // the smooth motion's own control points are among the choices
        assert!(energy(&eased) < 1.05 * energy(curve));
        let evened = even(loom.pose(), &rough, places, 8, 5);
        assert!(largest(&evened) <= largest(&eased));
        for moved in [eased, evened] {
            for (j, (a, b)) in moved.controls().iter().zip(rough.controls()).enumerate() {
                assert!((8..13).contains(&j) || a == b);
            }
        }
    }
}
