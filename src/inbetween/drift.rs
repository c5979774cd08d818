//! The rigid motion from the first key to the last, split off so that a motion that travels can be
//! periodic: a walk comes back to its pose, not to its place.
//!
//! The motion M is a screw: M(tau) = exp(tau xi) with M(1) = M. A share tau of the period is taken back
//! from each key, and put on again to each frame; the shapes between are periodic.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3};

use crate::math::rotation::{exp, log};
use crate::mesh::rigid_align::rigid;

/// A screw motion that takes a period.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Drift {
    start: f64,
    period: f64,
    /// Rotation vector of a period.
    turn: Vector3<f64>,
    /// What a period moves along the screw, before it turns: the other half of xi.
    shift: Vector3<f64>,
}

impl Drift {
    /// The rigid motion nearest the one from shape `first`, at the first time, to `last`, at the last.
    pub(super) fn between(first: &[f64], last: &[f64], ends: [f64; 2]) -> Self {
        let motion = rigid(first, last);
        let turn = log(&motion.rotation);
        let along = travel(&turn);
        Drift {
            start: ends[0],
            period: ends[1] - ends[0],
            turn,
            // turns are at most a half: the matrix is far from singular
            shift: along
                .try_inverse()
                .map_or(motion.translation.vector, |back| {
                    back * motion.translation.vector
                }),
        }
    }

    /// The motion up to time `t`.
    fn at(&self, t: f64) -> Isometry3<f64> {
        let share = (t - self.start) / self.period;
        let turn = self.turn * share;
        let rotation: UnitQuaternion<f64> = exp(&turn);
        Isometry3::from_parts((travel(&turn) * self.shift * share).into(), rotation)
    }

    /// Moves a shape of time `t`.
    pub(super) fn apply(&self, t: f64, positions: &mut [f64]) {
        moved(&self.at(t), positions);
    }

    /// Takes the motion off a shape of time `t`.
    pub(super) fn remove(&self, t: f64, positions: &mut [f64]) {
        moved(&self.at(t).inverse(), positions);
    }
}

fn moved(motion: &Isometry3<f64>, positions: &mut [f64]) {
    let (turn, shift) = (
        motion.rotation.to_rotation_matrix(),
        motion.translation.vector,
    );
    for point in positions.chunks_exact_mut(3) {
        let place = turn * Vector3::from_column_slice(point) + shift;
        point.copy_from_slice(place.as_slice());
    }
}

/// The integral of exp(s w) over s in \[0, 1\]: I + (1 - cos x)/x^2 \[w\] + (x - sin x)/x^3 \[w\]^2, x = |w|.
fn travel(w: &Vector3<f64>) -> Matrix3<f64> {
    let x = w.norm();
    let (first, second) = match x < 1e-4 {
        // the next terms are x^2/24 and x^2/120
        true => (0.5, 1.0 / 6.0),
        false => {
            let (sine, cosine) = libm::sincos(x);
            ((1.0 - cosine) / (x * x), (x - sine) / (x * x * x))
        }
    };
    let cross = w.cross_matrix();
    Matrix3::identity() + cross * first + cross * cross * second
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud() -> Vec<f64> {
        (0..30).map(|i| libm::sin(f64::from(i * i) * 0.7)).collect()
    }

    #[test]
    fn it_goes_from_the_first_to_the_last_and_on_at_the_same_pace() {
        for turn in [Vector3::zeros(), Vector3::new(0.4, -1.0, 2.0)] {
            let motion = Isometry3::from_parts(Vector3::new(3.0, -1.0, 0.2).into(), exp(&turn));
            let (first, mut last) = (cloud(), cloud());
            moved(&motion, &mut last);
            let drift = Drift::between(&first, &last, [2.0, 6.0]);
            let (mut found, mut twice) = (cloud(), last.clone());
            drift.apply(6.0, &mut found);
            moved(&motion, &mut twice);
            let mut beyond = cloud();
            drift.apply(10.0, &mut beyond);
            let far = |a: &[f64], b: &[f64]| {
                a.iter()
                    .zip(b)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max)
            };
            // rounding of a fit to 10 points of size 1
            assert!(far(&found, &last) < 1e-13 && far(&beyond, &twice) < 1e-13);
            drift.remove(6.0, &mut found);
            assert!(far(&found, &first) < 1e-13);
        }
    }
}
