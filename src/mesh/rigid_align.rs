//! The rigid motion that brings one shape nearest another: least squares over the vertices.

use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion, Vector3};

use crate::math::rotation;

/// An axis of space.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

impl Axis {
    /// Its number, from 0.
    pub fn index(self) -> usize {
        self as usize
    }

    /// The vector along it.
    pub fn unit(self) -> Vector3<f64> {
        Vector3::ith(self.index(), 1.0)
    }
}

/// The rigid motion M that minimises sum |M `from` - `to`|^2 over vertices; 3V coordinates each.
/// A shape without vertices, or all at one point, is only translated.
///
/// # Panics
/// The shapes differ in length.
pub fn rigid(from: &[f64], to: &[f64]) -> Isometry3<f64> {
    let (a, b, covariance) = moments(from, to);
    let turn = match covariance.iter().all(|&x| x == 0.0) {
        true => UnitQuaternion::identity(),
        false => rotation::nearest(&covariance).rotation,
    };
    about(turn, a, b)
}

/// The same among motions over the ground: translations across `up` and turns about it.
///
/// # Panics
/// The shapes differ in length.
pub fn ground(from: &[f64], to: &[f64], up: Axis) -> Isometry3<f64> {
    let (a, mut b, m) = moments(from, to);
    let (u, v, w) = (up.index(), (up.index() + 1) % 3, (up.index() + 2) % 3);
    let (sine, cosine) = (m[(w, v)] - m[(v, w)], m[(v, v)] + m[(w, w)]);
    b[u] = a[u];
    about(
        rotation::exp(&(up.unit() * libm::atan2(sine, cosine))),
        a,
        b,
    )
}

/// Means of both shapes and sum (to - mean) (from - mean)^T.
fn moments(from: &[f64], to: &[f64]) -> (Vector3<f64>, Vector3<f64>, Matrix3<f64>) {
    assert_eq!(from.len(), to.len(), "shapes must have the same vertices");
    let (a, b) = (mean(from), mean(to));
    let mut sum = Matrix3::zeros();
    for (p, q) in from.chunks_exact(3).zip(to.chunks_exact(3)) {
        let (p, q) = (
            Vector3::from_column_slice(p) - a,
            Vector3::from_column_slice(q) - b,
        );
        sum += q * p.transpose();
    }
    (a, b, sum)
}

/// Mean of the vertices; the origin where there are none.
pub fn mean(positions: &[f64]) -> Vector3<f64> {
    let mut sum = Vector3::zeros();
    for p in positions.chunks_exact(3) {
        sum += Vector3::from_column_slice(p);
    }
    sum / (positions.len() / 3).max(1) as f64
}

/// The motion that turns about `a` and takes it to `b`.
fn about(turn: UnitQuaternion<f64>, a: Vector3<f64>, b: Vector3<f64>) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(b - turn * a), turn)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cloud(scale: f64) -> Vec<f64> {
        (0..30)
            .map(|i| scale * libm::sin(f64::from(i * i) * 0.7))
            .collect()
    }

    fn moved(positions: &[f64], motion: &Isometry3<f64>) -> Vec<f64> {
        let points = positions.chunks_exact(3).map(Vector3::from_column_slice);
        points
            .flat_map(|p| (motion.rotation * p + motion.translation.vector).data.0[0])
            .collect()
    }

    #[test]
    fn a_rigid_copy_is_found_at_any_scale() {
        for scale in [1.0, 1e8, 1e-8] {
            let turn = rotation::exp(&Vector3::new(1.0, -2.0, 0.5));
            let shift = Translation3::new(3.0 * scale, -scale, 0.2 * scale);
            let motion = Isometry3::from_parts(shift, turn);
            let (from, to) = (cloud(scale), moved(&cloud(scale), &motion));
            let found = moved(&from, &rigid(&from, &to));
            assert!(
                found
                    .iter()
                    .zip(&to)
                    .all(|(a, b)| (a - b).abs() < 1e-13 * scale)
            );
        }
    }

    #[test]
    fn ground_motion_turns_about_the_axis_and_stays_on_the_ground() {
        for up in [Axis::X, Axis::Y, Axis::Z] {
            let turn = rotation::exp(&(up.unit() * 2.5));
            let mut shift = Vector3::new(4.0, 5.0, 6.0);
            shift[up.index()] = 0.0;
            let motion = Isometry3::from_parts(Translation3::from(shift), turn);
            let to = moved(&cloud(1.0), &motion);
            let found = ground(&cloud(1.0), &to, up);
            assert!((found.to_matrix() - motion.to_matrix()).norm() < 1e-13);
            // lifted, it is still the same motion over the ground
            let lifted = Isometry3::translation(up.unit()[0], up.unit()[1], up.unit()[2]);
            let found = ground(&cloud(1.0), &moved(&to, &lifted), up);
            assert!((found.to_matrix() - motion.to_matrix()).norm() < 1e-13);
        }
    }

    #[test]
    fn nothing_and_a_point_are_only_translated() {
        assert_eq!(rigid(&[], &[]), Isometry3::identity());
        let found = rigid(&[1.0; 6], &[3.0; 6]);
        assert_eq!(found, Isometry3::translation(2.0, 2.0, 2.0));
        assert_eq!(
            ground(&[1.0; 6], &[3.0; 6], Axis::Y),
            Isometry3::translation(2.0, 0.0, 2.0)
        );
    }
}
