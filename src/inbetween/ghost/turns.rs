//! How a ghost has turned and stretched around each of its vertices since the first key.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::mesh::{ReferenceTriangle, VertexCorners, reference_triangles};

/// A rotation and a stretch: the polar factors R and S of a gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Turn {
    /// R.
    pub(super) rotation: Quaternion<f64>,
    /// S: xx, xy, xz, yy, yz, zz.
    pub(super) stretch: [f64; 6],
}

/// Finds the turns of a ghost's vertices.
pub(super) struct Turns {
    triangles: Vec<[u32; 3]>,
    corners: VertexCorners,
    reference: Vec<ReferenceTriangle>,
    /// By what the triangles count.
    areas: Vec<f64>,
}

impl Turns {
    /// For a ghost whose first key is `reference`, 3G positions; triangles count by area, and by `weights`
    /// unless there are none.
    pub(super) fn new(triangles: &[[u32; 3]], reference: &[f64], weights: &[f64]) -> Self {
        let rest = reference_triangles(triangles, reference).to_vec();
        let mut areas: Vec<f64> = rest.iter().map(ReferenceTriangle::area).collect();
        for (area, weight) in areas.iter_mut().zip(weights) {
            *area *= weight;
        }
        Turns {
            triangles: triangles.to_vec(),
            corners: VertexCorners::new(reference.len() / 3, triangles),
            reference: rest,
            areas,
        }
    }

    /// The turn at each vertex of the ghost in a shape: the mean of those of the triangles there,
    /// weighted by area, rotations as quaternions of one side. Triangles without a plane have no say; a
    /// vertex without triangles has not turned.
    pub(super) fn of(&self, positions: &[f64]) -> Vec<Turn> {
        let place =
            |vertex: u32| Vector3::from_column_slice(&positions[3 * vertex as usize..][..3]);
        let faces: Vec<Option<(UnitQuaternion<f64>, [f64; 6])>> = self
            .triangles
            .iter()
            .zip(&self.reference)
            .map(|(triangle, reference)| {
                let [a, b, c] = triangle.map(place);
                let polar = reference.polar(&(b - a), &(c - a));
                polar
                    .filter(|_| !reference.degenerate)
                    .map(|polar| (polar.rotation, reference.stretch_in_space(polar.stretch)))
            })
            .collect();
        (0..positions.len() / 3)
            .map(|vertex| {
                let around = self.corners.at(vertex).iter();
                let around = around.filter_map(|corner| {
                    let face = *corner as usize / 3;
                    let (rotation, stretch) = faces[face]?;
                    let turn = Turn {
                        rotation: rotation.into_inner(),
                        stretch,
                    };
                    Some((self.areas[face], turn))
                });
                mean(around)
            })
            .collect()
    }
}

impl Turn {
    /// No change.
    const NONE: Turn = Turn {
        rotation: Quaternion::new(1.0, 0.0, 0.0, 0.0),
        stretch: [1.0, 0.0, 0.0, 1.0, 0.0, 1.0],
    };

    /// S v.
    pub(super) fn stretched(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let [xx, xy, xz, yy, yz, zz] = self.stretch;
        Vector3::new(
            xx * v.x + xy * v.y + xz * v.z,
            xy * v.x + yy * v.y + yz * v.z,
            xz * v.x + yz * v.y + zz * v.z,
        )
    }

    /// R v.
    pub(super) fn turned(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let axis = self.rotation.imag();
        let cross = axis.cross(v) * 2.0;
        v + cross * self.rotation.w + axis.cross(&cross)
    }

    /// R^T v.
    pub(super) fn turned_back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let axis = -self.rotation.imag();
        let cross = axis.cross(v) * 2.0;
        v + cross * self.rotation.w + axis.cross(&cross)
    }
}

/// The weighted mean of some turns; no change where there are none.
pub(super) fn mean(turns: impl Iterator<Item = (f64, Turn)>) -> Turn {
    let mut first: Option<Quaternion<f64>> = None;
    let mut rotation = Quaternion::new(0.0, 0.0, 0.0, 0.0);
    let mut stretch = [0.0; 6];
    let mut total = 0.0;
    for (weight, turn) in turns {
        let side = *first.get_or_insert(turn.rotation);
        let sign = if side.dot(&turn.rotation) < 0.0 {
            -weight
        } else {
            weight
        };
        rotation += turn.rotation * sign;
        for (sum, entry) in stretch.iter_mut().zip(turn.stretch) {
            *sum += weight * entry;
        }
        total += weight;
    }
    let size = rotation.norm();
    if total <= 0.0 || size <= 0.0 {
        return Turn::NONE;
    }
    Turn {
        rotation: rotation / size,
        stretch: stretch.map(|entry| entry / total),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation::exp;

    #[test]
    fn a_turned_and_stretched_ghost_has_turned_and_stretched_everywhere() {
        let points: [[f64; 3]; 4] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.2],
            [0.0, 1.0, 0.1],
            [1.0, 1.2, 0.0],
        ];
        let turns = Turns::new(&[[0, 1, 2], [1, 3, 2]], points.as_flattened(), &[]);
        let turn = exp(&Vector3::new(1.0, 2.0, -0.5));
        let shape: Vec<f64> = points
            .iter()
            .flat_map(|&p| (turn * Vector3::from(p) * 2.0).data.0[0])
            .collect();
        for found in turns.of(&shape) {
            let v = Vector3::new(0.3, -0.4, 0.5);
            assert!((found.turned(&v) - turn * v).norm() < 1e-14);
            assert!((found.turned_back(&(turn * v)) - v).norm() < 1e-14);
            // in its plane by 2, the normal stays: seen along a side
            let side = Vector3::from(points[1]) - Vector3::from(points[2]);
            let error = (found.stretched(&side) - side * 2.0).norm();
            assert!(error < 1e-13, "{error}");
        }
    }

    #[test]
    fn opposite_quaternions_are_one_rotation() {
        let turn = Turn {
            rotation: exp(&Vector3::new(0.1, 0.2, 0.3)).into_inner(),
            ..Turn::NONE
        };
        let other = Turn {
            rotation: -turn.rotation,
            ..turn
        };
        let found = mean([(1.0, turn), (2.0, other)].into_iter());
        assert!((found.rotation - turn.rotation).norm() < 1e-15);
        assert_eq!(mean([].into_iter()), Turn::NONE);
    }
}
