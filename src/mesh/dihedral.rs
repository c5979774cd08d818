//! Dihedral angles of hinges and how they change with the vertices.

use nalgebra::{UnitQuaternion, Vector3};

use crate::math::rotation::from_matrix;

/// The signed angle from unit normal `from` to unit normal `to` about the unit vector `axis`, to which
/// both are perpendicular; in (-pi, pi].
pub fn signed_angle(axis: &Vector3<f64>, from: &Vector3<f64>, to: &Vector3<f64>) -> f64 {
    libm::atan2(from.cross(to).dot(axis), from.dot(to))
}

/// The gradient of the angle by which the half plane through `wing` is turned about the axis from `a`
/// to `b`, with respect to `a`, `b` and `wing`. A dihedral angle is the difference of two such angles.
/// None when the three are collinear.
pub fn wing_gradient(
    a: &Vector3<f64>,
    b: &Vector3<f64>,
    wing: &Vector3<f64>,
) -> Option<[Vector3<f64>; 3]> {
    let (e, w) = (b - a, wing - a);
    let normal = e.cross(&w);
    let (length, size) = (e.norm_squared(), normal.norm_squared());
    // the wing's distance from the axis is |normal| / |e|: below this the angle is noise
    if size <= 1e-16 * length * (length + w.norm_squared()) {
        return None;
    }
    let step = normal * (length.sqrt() / size);
    let foot = w.dot(&e) / length;
    Some([step * (foot - 1.0), step * -foot, step])
}

/// The plane of a triangle given by its three side lengths (01, 12, 20): corners 1 and 2 relative to
/// corner 0 at (length, 0) and (offset, height), height >= 0. Lengths that no triangle has are shortened
/// to a flat one.
pub fn triangle_of_lengths([l01, l12, l20]: [f64; 3]) -> [f64; 3] {
    if l01 <= 0.0 {
        return [0.0, l20, 0.0];
    }
    let offset = 0.5 * (l01 + (l20 - l12) * (l20 + l12) / l01);
    let offset = offset.clamp(-l20, l20);
    // twice the area by Kahan's formula, which keeps the digits of thin triangles
    let mut sides = [l01, l12, l20];
    sides.sort_by(f64::total_cmp);
    let [c, b, a] = sides;
    let squared = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    [l01, offset, 0.5 * squared.max(0.0).sqrt() / l01]
}

/// The rotation about the third axis that takes the first to the unit vector along (x, y); none at
/// the origin.
pub fn heading(x: f64, y: f64) -> Option<UnitQuaternion<f64>> {
    let size = (x * x + y * y).sqrt();
    (size > 0.0).then(|| {
        let along = Vector3::new(x / size, y / size, 0.0);
        let columns = [along, Vector3::z().cross(&along), Vector3::z()];
        from_matrix(&nalgebra::Matrix3::from_columns(&columns))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
    }

    /// The dihedral angle at the edge from p0 to p1 between the triangles with p2 and p3.
    fn angle(p: &[Vector3<f64>; 4]) -> f64 {
        let e = p[1] - p[0];
        let normal = |wing: Vector3<f64>| e.cross(&(wing - p[0])).normalize();
        signed_angle(&e.normalize(), &normal(p[2]), &normal(p[3]))
    }

    proptest! {
        #[test]
        fn gradients_are_the_limits_of_differences(points in prop::array::uniform4(point())) {
            let far = |i: usize| {
                let e = points[1] - points[0];
                e.cross(&(points[i] - points[0])).norm() > 0.1 && e.norm() > 0.2
            };
            prop_assume!(far(2) && far(3) && angle(&points).abs() < 3.0);
            let first = wing_gradient(&points[0], &points[1], &points[2]).unwrap();
            let second = wing_gradient(&points[0], &points[1], &points[3]).unwrap();
            let gradient = [second[0] - first[0], second[1] - first[1], -first[2], second[2]];
            for vertex in 0..4 {
                for axis in 0..3 {
                    let step = 1e-6;
                    let (mut low, mut high) = (points, points);
                    low[vertex][axis] -= step;
                    high[vertex][axis] += step;
                    let difference = (angle(&high) - angle(&low)) / (2.0 * step);
                    // third derivatives grow with the inverse cube of the distances assumed above
                    prop_assert!((difference - gradient[vertex][axis]).abs() < 1e-6);
                }
            }
        }

        #[test]
        fn lengths_give_the_triangle(points in prop::array::uniform3(point())) {
            let [a, b, c] = points;
            let lengths = [(b - a).norm(), (c - b).norm(), (a - c).norm()];
            let [length, offset, height] = triangle_of_lengths(lengths);
            let back = [length, (offset - length).hypot(height), offset.hypot(height)];
            for (found, expected) in back.iter().zip(lengths) {
                // half the digits are lost where a triangle is flat
                prop_assert!((found - expected).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn lengths_of_no_triangle_give_a_flat_one() {
        let [length, offset, height] = triangle_of_lengths([1.0, 1.0, 3.0]);
        assert_eq!((length, height), (1.0, 0.0));
        assert!((offset - 3.0).abs() < 1e-15);
        assert_eq!(triangle_of_lengths([0.0, 2.0, 2.0]), [0.0, 2.0, 0.0]);
    }
}
