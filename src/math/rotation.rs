//! Rotations of space: exponential and logarithm, the branch of a logarithm nearest a given one, the
//! rotation nearest a matrix, and blending.
//!
//! Rotations are unit quaternions; their logarithms are rotation vectors (axis times angle, radians).
//! Only `+ - * / sqrt` and [`libm`] are used, so results are the same on every machine.

use std::f64::consts::{PI, TAU};

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3, Vector4};

/// The rotation by |w| radians about w. Rotations by more than a half turn are allowed.
pub fn exp(w: &Vector3<f64>) -> UnitQuaternion<f64> {
    let angle = w.norm();
    if angle < 1e-8 {
        // sin(x/2)/x = 1/2 - x^2/48: the neglected term is below the rounding error
        return UnitQuaternion::new_normalize(Quaternion::from_parts(1.0, w * 0.5));
    }
    let (sine, cosine) = libm::sincos(0.5 * angle);
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cosine, w * (sine / angle)))
}

/// The rotation vector of length at most pi whose [`exp`] is `rotation` (either sign of the
/// quaternion). At a half turn one of the two vectors is taken.
///
/// With w = cos(a/2) >= 0 and s = sin(a/2), t = s / (1 + w) is tan(a/4), at most 1, and
/// u = t / (1 + sqrt(1 + t^2)) is tan(a/8): the angle a is 8 atan(u), and a/s needs neither s nor a case.
#[inline(always)]
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let axis = rotation.imag();
    let below = 1.0 + sign * rotation.w;
    let t = axis.norm_squared() / (below * below);
    let half = 1.0 + (1.0 + t).sqrt();
    axis * (8.0 * sign * atan_over(t / (half * half)) / (below * half))
}

/// atan(u) / u for z = u^2 up to tan(pi/8)^2, to rounding.
#[inline(always)]
fn atan_over(z: f64) -> f64 {
    COEFFICIENTS.iter().fold(0.0, |sum, c| sum * z + c)
}

/// atan(u) / u as a polynomial of u^2 up to tan(pi/8)^2, highest power first: a Chebyshev fit whose error
/// is 3.5e-17.
const COEFFICIENTS: [f64; 11] = [
    0.021_135_373_157_693_246,
    -0.043_480_522_157_164_62,
    0.056_883_492_268_090_106,
    -0.066_402_339_304_294_08,
    0.076_899_534_963_068_57,
    -0.090_907_730_748_084_14,
    0.111_111_061_804_559_46,
    -0.142_857_141_809_764_67,
    0.199_999_999_988_551_1,
    -0.333_333_333_333_284_4,
    1.0,
];

/// Among all rotation vectors of the rotation of `w`, the one nearest `near`. The identity has one in
/// every direction at a whole number of turns; there the direction of `near` is taken.
pub fn nearest_branch(w: &Vector3<f64>, near: &Vector3<f64>) -> Vector3<f64> {
    let angle = w.norm();
    let reach = near.norm();
    if angle + reach <= PI {
        return *w;
    }
    let axis = match angle > 1e-9 {
        true => w / angle,
        false if reach > 0.0 => near / reach,
        false => return *w,
    };
    let turns = libm::round((axis.dot(near) - angle) / TAU);
    match turns == 0.0 {
        true => *w,
        false => axis * (angle + TAU * turns),
    }
}

/// The rotation with these columns, which must be orthonormal and right-handed up to rounding.
pub fn from_matrix(m: &Matrix3<f64>) -> UnitQuaternion<f64> {
    let (x, y, z) = (m[(0, 0)], m[(1, 1)], m[(2, 2)]);
    // Shepperd: the largest of the four components is found by a square root, the others by division
    let q = if x + y + z > 0.0 {
        let w = 1.0 + x + y + z;
        Quaternion::new(
            w,
            m[(2, 1)] - m[(1, 2)],
            m[(0, 2)] - m[(2, 0)],
            m[(1, 0)] - m[(0, 1)],
        )
    } else if x >= y && x >= z {
        let i = 1.0 + x - y - z;
        Quaternion::new(
            m[(2, 1)] - m[(1, 2)],
            i,
            m[(1, 0)] + m[(0, 1)],
            m[(0, 2)] + m[(2, 0)],
        )
    } else if y >= z {
        let j = 1.0 - x + y - z;
        Quaternion::new(
            m[(0, 2)] - m[(2, 0)],
            m[(1, 0)] + m[(0, 1)],
            j,
            m[(2, 1)] + m[(1, 2)],
        )
    } else {
        let k = 1.0 - x - y + z;
        Quaternion::new(
            m[(1, 0)] - m[(0, 1)],
            m[(0, 2)] + m[(2, 0)],
            m[(2, 1)] + m[(1, 2)],
            k,
        )
    };
    // one division: new_normalize takes four
    let scale = 1.0 / q.norm();
    UnitQuaternion::new_unchecked(q * scale)
}

/// The rotation nearest a matrix, and how well it is determined.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The rotation R that minimises |R - M| in the Frobenius norm: the one that maximises tr(R^T M).
    pub rotation: UnitQuaternion<f64>,
    /// How sharp that maximum is, relative to the size of M: 0 where R is not unique (M of rank one or
    /// none, some reflections), at most 4/sqrt 3, reached by a rotation times a scale.
    pub certainty: f64,
}

/// The rotation nearest `m`, never a reflection: the dominant eigenvector of Horn's 4 x 4 matrix
/// (Horn 1987, J. Opt. Soc. Am. A 4), by Jacobi's method. The zero matrix gives the identity with
/// certainty 0.
pub fn nearest(m: &Matrix3<f64>) -> Nearest {
    let size = m.norm();
    if size == 0.0 || !size.is_finite() {
        return Nearest {
            rotation: UnitQuaternion::identity(),
            certainty: 0.0,
        };
    }
    let (values, vectors) = symmetric_eigen(horn(&(m / size)));
    let best = (0..4).fold(0, |best, i| if values[i] > values[best] { i } else { best });
    let second = (0..4)
        .filter(|&i| i != best)
        .map(|i| values[i])
        .fold(f64::NEG_INFINITY, f64::max);
    let v = vectors.column(best);
    let q = match v[0] < 0.0 {
        true => Quaternion::new(-v[0], -v[1], -v[2], -v[3]),
        false => Quaternion::new(v[0], v[1], v[2], v[3]),
    };
    Nearest {
        rotation: UnitQuaternion::new_normalize(q),
        certainty: values[best] - second,
    }
}

/// R and S with M = R S, R the [`nearest`] rotation and S symmetric: the polar factors. S is positive
/// semidefinite when det M >= 0; a reflection leaves it with one negative eigenvalue, the smallest in
/// size.
pub fn polar(m: &Matrix3<f64>) -> (UnitQuaternion<f64>, Matrix3<f64>) {
    let rotation = nearest(m).rotation;
    let s = rotation.to_rotation_matrix().matrix().transpose() * m;
    (rotation, (s + s.transpose()) * 0.5)
}

/// The rotation a fraction `t` of the way from `a` to `b` along the shorter arc; t outside \[0, 1\]
/// goes on at the same speed.
pub fn slerp(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, t: f64) -> UnitQuaternion<f64> {
    a * exp(&(log(&(a.inverse() * b)) * t))
}

/// Horn's matrix: q^T N q = tr(R(q)^T M), scalar part first.
fn horn(m: &Matrix3<f64>) -> Matrix4<f64> {
    let s = |i: usize, j: usize| m[(i, j)] + m[(j, i)];
    let d = |i: usize, j: usize| m[(i, j)] - m[(j, i)];
    let (x, y, z) = (m[(0, 0)], m[(1, 1)], m[(2, 2)]);
    Matrix4::new(
        x + y + z,
        d(2, 1),
        d(0, 2),
        d(1, 0),
        d(2, 1),
        x - y - z,
        s(0, 1),
        s(0, 2),
        d(0, 2),
        s(0, 1),
        y - x - z,
        s(1, 2),
        d(1, 0),
        s(0, 2),
        s(1, 2),
        z - x - y,
    )
}

/// Eigenvalues and orthonormal eigenvectors (columns) of a symmetric matrix, by cyclic Jacobi
/// rotations until the off-diagonal is rounding error.
fn symmetric_eigen(mut a: Matrix4<f64>) -> (Vector4<f64>, Matrix4<f64>) {
    let mut vectors = Matrix4::identity();
    for _ in 0..16 {
        let mut off = 0.0;
        for p in 0..3 {
            for q in p + 1..4 {
                off += a[(p, q)] * a[(p, q)];
                annihilate(&mut a, &mut vectors, p, q);
            }
        }
        if off <= 1e-33 {
            break;
        }
    }
    (a.diagonal(), vectors)
}

/// One Jacobi rotation: makes a_pq zero.
fn annihilate(a: &mut Matrix4<f64>, vectors: &mut Matrix4<f64>, p: usize, q: usize) {
    let off = a[(p, q)];
    if off == 0.0 {
        return;
    }
    let theta = (a[(q, q)] - a[(p, p)]) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
    let c = 1.0 / (t * t + 1.0).sqrt();
    let s = t * c;
    for k in 0..4 {
        let (x, y) = (a[(k, p)], a[(k, q)]);
        (a[(k, p)], a[(k, q)]) = (c * x - s * y, s * x + c * y);
    }
    for k in 0..4 {
        let (x, y) = (a[(p, k)], a[(q, k)]);
        (a[(p, k)], a[(q, k)]) = (c * x - s * y, s * x + c * y);
        let (x, y) = (vectors[(k, p)], vectors[(k, q)]);
        (vectors[(k, p)], vectors[(k, q)]) = (c * x - s * y, s * x + c * y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(size: f64) -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-size..size).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn log_undoes_exp_up_to_whole_turns(w in vector(12.0)) {
            // the angle is good to an ulp of 21 radians
            let back = nearest_branch(&log(&exp(&w)), &w);
            prop_assert!((back - w).norm() < 1e-13, "{w} {back}");
        }

        #[test]
        fn matrices_and_quaternions_are_the_same_rotation(w in vector(4.0)) {
            let q = exp(&w);
            let back = from_matrix(q.to_rotation_matrix().matrix());
            prop_assert!(log(&(q.inverse() * back)).norm() < 1e-14);
        }

        #[test]
        fn polar_factors_multiply_to_the_matrix(rows in prop::array::uniform9(-1.0..1.0)) {
            let m = Matrix3::from_row_slice(&rows);
            let (r, s) = polar(&m);
            // a near-double eigenvalue costs digits: Jacobi keeps the residual at the rounding level
            prop_assert!((r.to_rotation_matrix().matrix() * s - m).norm() < 1e-12);
            prop_assert!((r.to_rotation_matrix().matrix().determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn half_turns_and_tiny_turns_are_exact() {
        for axis in [Vector3::x(), Vector3::new(0.6, 0.0, -0.8)] {
            for angle in [0.0, 1e-300, 1e-12, 1e-8, 1e-4, 3.0, PI - 1e-9, PI] {
                let w = axis * angle;
                let back = nearest_branch(&log(&exp(&w)), &w);
                assert!((back - w).norm() <= 1e-15 * (1.0 + angle), "{angle}");
            }
        }
    }

    #[test]
    fn branches_follow_a_turning_body_for_many_turns() {
        let axis = Vector3::new(2.0, -1.0, 2.0) / 3.0;
        let mut near = Vector3::zeros();
        for step in 0..100 {
            let w = axis * (0.4 * f64::from(step));
            near = nearest_branch(&log(&exp(&w)), &near);
            assert!((near - w).norm() < 1e-12);
        }
    }

    #[test]
    fn a_reflection_has_a_nearest_rotation() {
        let m = Matrix3::from_diagonal(&Vector3::new(2.0, 1.0, -0.1));
        let (r, s) = polar(&m);
        assert!(log(&r).norm() < 1e-12);
        assert!((s - m).norm() < 1e-12);
    }

    #[test]
    fn certainty_tells_rank_one_from_rank_two() {
        let line = Matrix3::from_diagonal(&Vector3::new(3.0, 0.0, 0.0));
        let plane = Matrix3::from_diagonal(&Vector3::new(3.0, 1.0, 0.0));
        assert!(nearest(&line).certainty < 1e-12);
        assert!(nearest(&plane).certainty > 0.1);
        assert_eq!(nearest(&Matrix3::zeros()).certainty, 0.0);
    }

    #[test]
    fn slerp_halves_a_turn_of_179_degrees() {
        let whole = Vector3::z() * (179.0_f64).to_radians();
        let half = slerp(&UnitQuaternion::identity(), &exp(&whole), 0.5);
        assert!((log(&half) - whole * 0.5).norm() < 1e-14);
    }
}
