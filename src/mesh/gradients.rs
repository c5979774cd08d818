//! Deformation gradients of triangles (Sumner & Popovic 2004; X19 §4.2): the linear map that takes a
//! triangle of the reference pose, with its unit normal, to the same triangle of a shape.
//!
//! D = [e1 e2 n] [e1~ e2~ n~]^-1 = R S. Because n is perpendicular to the triangle in both poses, the
//! polar factors need no 3 x 3 decomposition: R turns n~ to n, and what is left is a polar
//! decomposition in the plane with a determinant that is never negative, known in closed form.

use std::f64::consts::FRAC_PI_3;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use crate::math::rotation;

/// A triangle of the reference pose, laid in its own plane: corners 0, `length` b1 and
/// `offset` b1 + `height` b2, where b1 = `along` and b2 = `normal` x `along`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ReferenceTriangle {
    /// b1, unit vector from corner 0 to corner 1.
    pub along: Vector3<f64>,
    /// n~, unit normal, counter-clockwise seen from outside.
    pub normal: Vector3<f64>,
    /// Length of the side from corner 0 to corner 1, > 0.
    pub length: f64,
    /// Foot of the height over that side, measured from corner 0.
    pub offset: f64,
    /// Height, > 0.
    pub height: f64,
    /// Whether the triangle has no plane of its own (see [`ReferenceTriangle::new`]).
    pub degenerate: bool,
}

/// Below this ratio of twice the area to the squared longest side a reference triangle counts as
/// degenerate: its gradient would enlarge rounding errors of single precision beyond its size.
const FLAT: f64 = 1e-6;

/// Below this sine of the angle between its sides a triangle of a shape has no normal of its own.
pub(super) const COLLINEAR: f64 = 1e-10;

impl ReferenceTriangle {
    /// The triangle with these corners. A triangle without a plane (collinear or coincident corners, or
    /// a vertex named twice) is replaced by an equilateral one on its longest side (on `fallback` where
    /// all sides are zero): gradients and positions still determine each other exactly, only "no
    /// deformation" is then not the identity.
    pub fn new([a, b, c]: [Vector3<f64>; 3], fallback: f64) -> Self {
        let (ab, ac) = (b - a, c - a);
        let sides = [ab, c - b, a - c];
        let longest = sides.into_iter().fold(ab, |s, t| {
            if t.norm_squared() > s.norm_squared() {
                t
            } else {
                s
            }
        });
        let cross = ab.cross(&ac);
        if cross.norm() > FLAT * longest.norm_squared() {
            let along = ab.normalize();
            let normal = cross.normalize();
            return ReferenceTriangle {
                along,
                normal,
                length: ab.norm(),
                offset: ac.dot(&along),
                height: ac.dot(&normal.cross(&along)),
                degenerate: false,
            };
        }
        let (along, side) = match longest.norm() {
            0.0 => (Vector3::x(), fallback),
            side => (longest / side, side),
        };
        ReferenceTriangle {
            along,
            normal: perpendicular(&along),
            length: side,
            offset: 0.5 * side,
            height: side * libm::sin(FRAC_PI_3),
            degenerate: true,
        }
    }

    /// The triangle's area.
    pub fn area(&self) -> f64 {
        0.5 * self.length * self.height
    }

    /// b2, the unit vector in the plane that completes b1 and the normal.
    pub fn across(&self) -> Vector3<f64> {
        self.normal.cross(&self.along)
    }

    /// Where D takes b1 and b2, for a shape's sides from corner 0 to corners 1 and 2.
    pub fn images(&self, e1: &Vector3<f64>, e2: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let f1 = e1 * (1.0 / self.length);
        [f1, (e2 - f1 * self.offset) * (1.0 / self.height)]
    }

    /// The sides from corner 0 to corners 1 and 2 of the triangle whose gradient takes b1 and b2 to
    /// `images`.
    pub fn sides(&self, [f1, f2]: &[Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
        [f1 * self.length, f1 * self.offset + f2 * self.height]
    }

    /// The polar factors of the gradient of a triangle with these sides. None when the sides are
    /// collinear or zero: see [`ReferenceTriangle::polar_near`].
    pub fn polar(&self, e1: &Vector3<f64>, e2: &Vector3<f64>) -> Option<Polar> {
        let cross = e1.cross(e2);
        let size = cross.norm();
        let flat = size <= COLLINEAR * (e1.norm_squared() + e2.norm_squared());
        (!flat && size.is_finite()).then(|| self.polar_with(e1, e2, &(cross * (1.0 / size))))
    }

    /// The polar factors for a triangle of any kind. One without a normal takes, among the vectors
    /// perpendicular to its longest side, the one nearest the reference normal turned by `around`; a
    /// single point takes `around` itself as its rotation.
    pub fn polar_near(
        &self,
        e1: &Vector3<f64>,
        e2: &Vector3<f64>,
        around: &UnitQuaternion<f64>,
    ) -> Polar {
        self.polar(e1, e2).unwrap_or_else(|| {
            let side = match e1.norm_squared() >= e2.norm_squared() {
                true => e1,
                false => e2,
            };
            let normal = project(&(around * self.normal), side)
                .or_else(|| project(&(around * self.along), side))
                .unwrap_or_else(|| around * self.normal);
            match side.norm() > 0.0 {
                true => self.polar_with(e1, e2, &normal),
                false => Polar {
                    rotation: *around,
                    stretch: [0.0; 3],
                },
            }
        })
    }

    /// R takes (b1, b2, n~) to (r1, n x r1, n) with r1 along f1 - n x f2, the closed form of the polar
    /// decomposition of a plane map with determinant >= 0.
    fn polar_with(&self, e1: &Vector3<f64>, e2: &Vector3<f64>, n: &Vector3<f64>) -> Polar {
        let [f1, f2] = self.images(e1, e2);
        let r1 = f1 - n.cross(&f2);
        let r1 = r1 * (1.0 / r1.norm());
        let r2 = n.cross(&r1);
        let pose = Matrix3::from_columns(&[r1, r2, *n]);
        let rest = Matrix3::from_columns(&[self.along, self.across(), self.normal]);
        Polar {
            rotation: rotation::from_matrix(&(pose * rest.transpose())),
            stretch: [r1.dot(&f1), 0.5 * (r1.dot(&f2) + r2.dot(&f1)), r2.dot(&f2)],
        }
    }

    /// [`stretch_in_space`] of this triangle.
    pub fn stretch_in_space(&self, stretch: [f64; 3]) -> [f64; 6] {
        stretch_in_space(&self.along, &self.normal, stretch)
    }

    /// S b1 and S b2 for S as xx, xy, xz, yy, yz, zz.
    pub fn stretched(&self, s: &[f64; 6]) -> [Vector3<f64>; 2] {
        let [xx, xy, xz, yy, yz, zz] = *s;
        let apply = |v: Vector3<f64>| {
            Vector3::new(
                xx * v.x + xy * v.y + xz * v.z,
                xy * v.x + yy * v.y + yz * v.z,
                xz * v.x + yz * v.y + zz * v.z,
            )
        };
        [apply(self.along), apply(self.across())]
    }
}

/// D = R S of one triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Polar {
    /// R.
    pub rotation: UnitQuaternion<f64>,
    /// S in the plane of the reference triangle: s11, s12, s22 in the basis b1, b2. Positive
    /// semidefinite.
    pub stretch: [f64; 3],
}

/// S of a triangle with `along` and `normal` as xx, xy, xz, yy, yz, zz, from its entries s11, s12, s22 in the
/// plane; S leaves the normal alone.
#[inline(always)]
pub fn stretch_in_space(
    along: &Vector3<f64>,
    normal: &Vector3<f64>,
    [s11, s12, s22]: [f64; 3],
) -> [f64; 6] {
    let (b1, b2, n) = (along, normal.cross(along), normal);
    let (u1, u2) = (b1 * s11 + b2 * s12, b1 * s12 + b2 * s22);
    let entry = |i: usize, j: usize| u1[i] * b1[j] + u2[i] * b2[j] + n[i] * n[j];
    [
        entry(0, 0),
        entry(0, 1),
        entry(0, 2),
        entry(1, 1),
        entry(1, 2),
        entry(2, 2),
    ]
}

/// The unit vector of the part of `v` that is perpendicular to `side`, where there is enough of it.
fn project(v: &Vector3<f64>, side: &Vector3<f64>) -> Option<Vector3<f64>> {
    let rest = v - side * (v.dot(side) / side.norm_squared());
    (rest.norm() > 1e-3).then(|| rest.normalize())
}

/// A unit vector perpendicular to a unit vector: from the coordinate axis least along it.
fn perpendicular(v: &Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith(v.iamin(), 1.0);
    (axis - v * v.dot(&axis)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
    }

    fn gradient(triangle: &ReferenceTriangle, polar: &Polar) -> [Vector3<f64>; 2] {
        let s = triangle.stretch_in_space(polar.stretch);
        triangle.stretched(&s).map(|v| polar.rotation * v)
    }

    proptest! {
        #[test]
        fn the_factors_give_the_sides_back(
            rest in prop::array::uniform3(point()),
            e1 in point(),
            e2 in point(),
        ) {
            let triangle = ReferenceTriangle::new(rest, 1.0);
            let polar = triangle.polar_near(&e1, &e2, &UnitQuaternion::identity());
            let sides = triangle.sides(&gradient(&triangle, &polar));
            // a thin reference triangle enlarges rounding by its aspect
            let bound = 1e-14 / (triangle.height / triangle.length).min(1.0);
            prop_assert!((sides[0] - e1).norm() < bound);
            prop_assert!((sides[1] - e2).norm() < bound);
        }

        #[test]
        fn a_rigid_motion_is_a_rotation_without_stretch(
            rest in prop::array::uniform3(point()),
            w in point(),
        ) {
            let triangle = ReferenceTriangle::new(rest, 1.0);
            prop_assume!(triangle.height > 1e-3 * triangle.length);
            let turn = rotation::exp(&(w * 3.0));
            let [a, b, c] = rest.map(|v| turn * v);
            let polar = triangle.polar(&(b - a), &(c - a)).unwrap();
            prop_assert!(rotation::log(&(turn.inverse() * polar.rotation)).norm() < 1e-10);
            prop_assert!((polar.stretch[0] - 1.0).abs() < 1e-10);
            prop_assert!(polar.stretch[1].abs() < 1e-10);
        }
    }

    #[test]
    fn triangles_without_a_plane_still_carry_their_sides() {
        let (o, x) = (Vector3::zeros(), Vector3::x());
        for rest in [[o, x, x * 2.0], [o, o, x], [o, o, o]] {
            let triangle = ReferenceTriangle::new(rest, 0.5);
            assert!(triangle.degenerate && triangle.area() > 0.0);
            for sides in [[x, x * 3.0], [o, o], [o, Vector3::y()], [x, Vector3::z()]] {
                let around = rotation::exp(&Vector3::new(0.3, 2.0, 0.1));
                let polar = triangle.polar_near(&sides[0], &sides[1], &around);
                let back = triangle.sides(&gradient(&triangle, &polar));
                assert!((back[0] - sides[0]).norm() + (back[1] - sides[1]).norm() < 1e-14);
            }
        }
    }
}
