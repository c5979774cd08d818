//! The polar factors of many triangles side by side, for the many that need no care.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use super::gradients::{COLLINEAR, Polar, ReferenceTriangle};
use crate::math::columns::{BLOCK, Column, Vectors, row, set_row};

/// Triangles of the reference pose with the same triangles of a shape, and [`ReferenceTriangle::polar`] of each.
///
/// Left out are triangles without a plane, in the reference or the shape, and those turned by more than 138
/// degrees (trace below -1/2), where the quaternion would lose digits: these are to be taken one by one.
pub struct PolarBlock {
    along: Vectors,
    normal: Vectors,
    /// Length, offset and height.
    rest: Vectors,
    sides: [Column; 6],
    /// R, column by column.
    matrix: [Column; 9],
    /// R as w, x, y, z.
    quaternion: [Column; 4],
    stretch: Vectors,
    /// 1 for a triangle that needs no care.
    plain: Column,
}

impl Default for PolarBlock {
    fn default() -> Self {
        const NONE: Column = [0.0; BLOCK];
        PolarBlock {
            along: [NONE; 3],
            normal: [NONE; 3],
            rest: [NONE; 3],
            sides: [NONE; 6],
            matrix: [NONE; 9],
            quaternion: [NONE; 4],
            stretch: [NONE; 3],
            plain: NONE,
        }
    }
}

impl PolarBlock {
    /// Puts a triangle into row `i`, with a shape's sides from corner 0 to corners 1 and 2.
    #[inline(always)]
    pub fn set(&mut self, i: usize, triangle: &ReferenceTriangle, sides: [Vector3<f64>; 2]) {
        set_row(&mut self.along, i, triangle.along.into());
        set_row(&mut self.normal, i, triangle.normal.into());
        let height = match triangle.degenerate {
            true => f64::NAN,
            false => triangle.height,
        };
        set_row(
            &mut self.rest,
            i,
            [triangle.length, triangle.offset, height],
        );
        let [e1, e2] = sides;
        set_row(&mut self.sides, i, [e1.x, e1.y, e1.z, e2.x, e2.y, e2.z]);
    }

    /// The factors of all rows, those never set too.
    #[inline(always)]
    pub fn factor(&mut self) {
        for i in 0..BLOCK {
            let (along, normal) = (vector(&self.along, i), vector(&self.normal, i));
            let [length, offset, height] = row(&self.rest, i);
            let sides = row(&self.sides, i);
            let e1 = Vector3::new(sides[0], sides[1], sides[2]);
            let e2 = Vector3::new(sides[3], sides[4], sides[5]);
            let cross = e1.cross(&e2);
            let size = cross.norm();
            let n = cross * (1.0 / size);
            let f1 = e1 * (1.0 / length);
            let f2 = (e2 - f1 * offset) * (1.0 / height);
            let towards = f1 - n.cross(&f2);
            let r1 = towards * (1.0 / towards.norm());
            let r2 = n.cross(&r1);
            let across = normal.cross(&along);
            let entry =
                |i: usize, j: usize| r1[i] * along[j] + r2[i] * across[j] + n[i] * normal[j];
            let mut m = [0.0; 9];
            for (k, m) in m.iter_mut().enumerate() {
                *m = entry(k % 3, k / 3);
            }
            let trace = m[0] + m[4] + m[8];
            let root = (1.0 + trace).sqrt();
            let scale = 0.5 * (1.0 / root);
            let turned = [
                (m[5] - m[7]) * scale,
                (m[6] - m[2]) * scale,
                (m[1] - m[3]) * scale,
            ];
            set_row(
                &mut self.quaternion,
                i,
                [0.5 * root, turned[0], turned[1], turned[2]],
            );
            set_row(&mut self.matrix, i, m);
            let shear = 0.5 * (r1.dot(&f2) + r2.dot(&f1));
            set_row(&mut self.stretch, i, [r1.dot(&f1), shear, r2.dot(&f2)]);
            // what is not a number is not plain; of a degenerate triangle nothing is a number
            let squares = e1.norm_squared() + e2.norm_squared();
            let plain = (trace > -0.5) & (size > COLLINEAR * squares) & (size < f64::INFINITY);
            self.plain[i] = if plain { 1.0 } else { 0.0 };
        }
    }

    /// The factors of row `i` and R as a matrix; none for a triangle that needs care.
    #[inline(always)]
    pub fn get(&self, i: usize) -> Option<(Polar, Matrix3<f64>)> {
        let [w, x, y, z] = row(&self.quaternion, i);
        let polar = Polar {
            rotation: UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)),
            stretch: row(&self.stretch, i),
        };
        let matrix = Matrix3::from_column_slice(&row(&self.matrix, i));
        (self.plain[i] > 0.0).then_some((polar, matrix))
    }
}

/// The vector in row `i`.
#[inline(always)]
fn vector(columns: &Vectors, i: usize) -> Vector3<f64> {
    Vector3::from(row(columns, i))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation;
    use proptest::prelude::*;

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
    }

    proptest! {
        #[test]
        fn a_block_is_as_its_triangles_one_by_one(
            rest in prop::collection::vec(prop::array::uniform3(point()), 5),
            turn in point(),
            offsets in prop::collection::vec(prop::array::uniform2(point()), 5),
        ) {
            let triangles: Vec<_> =
                rest.iter().map(|&rest| ReferenceTriangle::new(rest, 1.0)).collect();
            // turned by up to the length of a unit cube's diagonal in radians, and deformed
            let turn = rotation::exp(&turn);
            let sides = |i: usize| {
                let ([a, b, c], [near, far]) = (rest[i], offsets[i]);
                [turn * (b - a) + near * 0.1, turn * (c - a) + far * 0.1]
            };
            let mut block = PolarBlock::default();
            for (i, triangle) in triangles.iter().enumerate() {
                block.set(i, triangle, sides(i));
            }
            block.factor();
            for (i, triangle) in triangles.iter().enumerate() {
                let [e1, e2] = sides(i);
                let one = triangle.polar(&e1, &e2).unwrap();
                let expected = *one.rotation.to_rotation_matrix().matrix();
                let Some((found, matrix)) = block.get(i) else {
                    prop_assert!(expected.trace() < -0.5 + 1e-9);
                    continue;
                };
                // thin triangles enlarge rounding
                let thin = triangle.height.min(triangle.length);
                let bound = 1e-13 / (thin * e1.cross(&e2).norm()).min(1.0);
                prop_assert!((matrix - expected).norm() < bound);
                let turned = found.rotation.to_rotation_matrix();
                prop_assert!((turned.matrix() - expected).norm() < 4.0 * bound);
                for (found, expected) in found.stretch.iter().zip(one.stretch) {
                    prop_assert!((found - expected).abs() < bound * (1.0 + expected.abs()));
                }
            }
        }
    }

    #[test]
    fn what_needs_care_is_left_out() {
        let (o, x, y) = (Vector3::zeros(), Vector3::x(), Vector3::y());
        let sound = ReferenceTriangle::new([o, x, y], 1.0);
        let mut block = PolarBlock::default();
        block.set(0, &sound, [x, y]);
        block.set(1, &ReferenceTriangle::new([o, x, x * 2.0], 1.0), [x, y]);
        for (i, sides) in [[x, x * 2.0], [o, o], [x * f64::NAN, y], [-x, -y], [y, x]]
            .into_iter()
            .enumerate()
        {
            block.set(2 + i, &sound, sides);
        }
        block.factor();
        // rows that were never set are left out, too
        let found: Vec<usize> = (0..BLOCK).filter(|&i| block.get(i).is_some()).collect();
        assert_eq!(found, [0]);
    }
}
