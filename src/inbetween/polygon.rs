//! Isometric morphs of triangulated polygons (Wuhrer et al., "Isometric morphing of triangular meshes",
//! theorem 1): meshes whose triangles form a tree, with no vertex inside.
//!
//! Edge lengths go linearly, normals along great circles (slerp). From the root triangle outwards every
//! triangle has two vertices placed already; its third follows from its three lengths and its normal.
//! Each vertex is placed once, so a frame takes O(n) and every length is exact.
//!
//! The paper has 4n - 2 numbers for 3n freedoms: an interpolated normal is in general not perpendicular
//! to the edge e that is placed already. The triangle then lies in the plane through e nearest to the
//! normal, whose own normal is n - (n.e) e, made a unit vector; [`Polygon::normal_deviation`] tells how
//! far that is from n. A normal along e, or a triangle without area in both poses, takes its parent's.

use nalgebra::Vector3;

use crate::math::direction::Arc;
use crate::mesh::DualTree;

/// Two poses of a triangulated polygon, ready to be morphed.
#[derive(Debug, Clone)]
pub struct Polygon {
    /// The root first, then the others, parents before children.
    faces: Vec<Face>,
    opposite: Vec<u32>,
}

/// A triangle with its corners turned so that the first two are placed when it is reached.
#[derive(Debug, Clone)]
struct Face {
    triangle: u32,
    corners: [u32; 3],
    /// The place of its parent among the faces; the root has its own.
    parent: u32,
    /// Its sides 01, 12, 20 in both poses.
    sides: [[f64; 3]; 2],
    /// The direction of its normal; none without area in both poses.
    normal: Option<Arc>,
}

/// Whether `triangles` triangles over `vertices` vertices, connected across `hinges` edges, form a
/// triangulated polygon: a tree of triangles that brings a new vertex with each.
pub fn is_polygon(vertices: usize, triangles: usize, hinges: usize) -> bool {
    triangles > 0 && hinges + 1 == triangles && vertices == triangles + 2
}

impl Polygon {
    /// The polygon whose triangles `tree` spans, in two poses of 3V positions each; vertices of other
    /// triangles are left alone. Opposite normals have no shortest arc between them: such a triangle
    /// turns over about the edge to its parent, and is listed in [`Polygon::opposite`].
    pub fn new(triangles: &[[u32; 3]], tree: &DualTree, from: &[f64], to: &[f64]) -> Self {
        let mut polygon = Polygon {
            faces: Vec::with_capacity(tree.steps.len() + 1),
            opposite: Vec::new(),
        };
        let mut place = vec![0; triangles.len()];
        polygon.push(triangles, [from, to], 3 * tree.root, 0);
        for step in &tree.steps {
            place[step.child()] = polygon.faces.len() as u32;
            polygon.push(triangles, [from, to], step.to, place[step.parent()]);
        }
        polygon
    }

    fn push(&mut self, triangles: &[[u32; 3]], poses: [&[f64]; 2], side: u32, parent: u32) {
        let triangle = triangles[side as usize / 3];
        let corners = [0, 1, 2].map(|k| triangle[(side as usize + k) % 3]);
        let [first, second] = poses.map(|pose| normal(pose, corners));
        let normal = match (first, second) {
            (Some(a), Some(b)) => Some(Arc::between(&a, &b).unwrap_or_else(|| {
                self.opposite.push(side / 3);
                let [p, q, _] = corners.map(|vertex| point(poses[0], vertex));
                Arc::half_circle(&a, &(q - p))
            })),
            (one, other) => one.or(other).map(|n| Arc::still(&n)),
        };
        self.faces.push(Face {
            triangle: side / 3,
            corners,
            parent,
            sides: poses.map(|pose| side_lengths(pose, corners)),
            normal,
        });
    }

    /// Triangles whose normals are opposite in the two poses.
    pub fn opposite(&self) -> &[u32] {
        &self.opposite
    }

    /// The shape a fraction `t` of the way, in \[0, 1\], about the mean of its vertices' own straight
    /// paths between `from` and `to`, the poses it was made for. Other vertices of `positions` stay.
    pub fn at(&self, t: f64, from: &[f64], to: &[f64], positions: &mut [f64]) {
        self.place(t, from, to, positions, |_, _, _| {});
        let mut shift = Vector3::zeros();
        let path = |vertex| point(from, vertex) * (1.0 - t) + point(to, vertex) * t;
        self.each_vertex(|vertex| shift += path(vertex) - point(positions, vertex));
        shift /= (self.faces.len() + 2) as f64;
        self.each_vertex(|vertex| {
            let at = point(positions, vertex) + shift;
            put(positions, vertex, &at);
        });
    }

    /// Mean and largest angle in radians between the triangles' normals and the arcs that they should
    /// follow, at `t`.
    pub fn normal_deviation(&self, t: f64, from: &[f64], to: &[f64]) -> [f64; 2] {
        let mut positions = vec![0.0; from.len()];
        let (mut sum, mut worst) = (0.0, 0.0_f64);
        self.place(t, from, to, &mut positions, |_, wanted, found| {
            let angle = libm::atan2(wanted.cross(found).norm(), wanted.dot(found));
            sum += angle;
            worst = worst.max(angle);
        });
        [sum / self.faces.len() as f64, worst]
    }

    fn each_vertex(&self, mut visit: impl FnMut(u32)) {
        self.faces[0].corners[..2].iter().for_each(|&v| visit(v));
        self.faces.iter().for_each(|face| visit(face.corners[2]));
    }

    /// Places the root where its first corner is on its straight path, and all others from there.
    /// `tell` learns of each triangle the normal that was wanted and the one it has.
    fn place(
        &self,
        t: f64,
        from: &[f64],
        to: &[f64],
        positions: &mut [f64],
        mut tell: impl FnMut(u32, &Vector3<f64>, &Vector3<f64>),
    ) {
        let mut normals: Vec<Vector3<f64>> = Vec::with_capacity(self.faces.len());
        self.place_first_edge(t, from, to, positions);
        for face in &self.faces {
            let [a, b, c] = face.corners;
            let (p, q) = (point(positions, a), point(positions, b));
            let inherited = normals.get(face.parent as usize).copied();
            let wanted = face.normal.map(|arc| arc.at(t)).or(inherited);
            let wanted = wanted.unwrap_or_else(Vector3::z);
            let along = (q - p).try_normalize(0.0);
            let along = along.unwrap_or_else(|| perpendicular(&wanted));
            let across = |n: &Vector3<f64>| (n - along * n.dot(&along)).try_normalize(1e-9);
            let normal = across(&wanted)
                .or_else(|| inherited.as_ref().and_then(across))
                .unwrap_or_else(|| perpendicular(&along));
            let [x, y] = apex(face.lengths(t));
            put(positions, c, &(p + along * x + normal.cross(&along) * y));
            tell(face.triangle, &wanted, &normal);
            normals.push(normal);
        }
    }

    /// The first edge of the root: from its first corner on its straight path, along the arc between its
    /// directions, turned into the plane of the root's normal.
    fn place_first_edge(&self, t: f64, from: &[f64], to: &[f64], positions: &mut [f64]) {
        let root = &self.faces[0];
        let [a, b, _] = root.corners;
        let start = point(from, a) * (1.0 - t) + point(to, a) * t;
        let direction = |pose: &[f64]| (point(pose, b) - point(pose, a)).try_normalize(0.0);
        let arc = match (direction(from), direction(to)) {
            (Some(d), Some(e)) => Arc::between(&d, &e).unwrap_or_else(|| {
                let axis = root.normal.map_or_else(Vector3::zeros, |arc| arc.at(0.0));
                Arc::half_circle(&d, &axis)
            }),
            (one, other) => Arc::still(&one.or(other).unwrap_or_else(Vector3::x)),
        };
        let along = arc.at(t);
        let normal = root.normal.map(|arc| arc.at(t));
        let along = match normal {
            Some(n) => (along - n * n.dot(&along))
                .try_normalize(1e-9)
                .unwrap_or_else(|| perpendicular(&n)),
            None => along,
        };
        put(positions, a, &start);
        put(positions, b, &(start + along * root.lengths(t)[0]));
    }
}

impl Face {
    fn lengths(&self, t: f64) -> [f64; 3] {
        let [from, to] = &self.sides;
        std::array::from_fn(|side| from[side] * (1.0 - t) + to[side] * t)
    }
}

/// Lengths of the sides 01, 12, 20.
pub(super) fn side_lengths(pose: &[f64], corners: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = corners.map(|vertex| point(pose, vertex));
    [(b - a).norm(), (c - b).norm(), (a - c).norm()]
}

/// Where corner 2 of a triangle with sides 01, 12, 20 lies: along the side 01 from corner 0, and above
/// it (>= 0). Kahan's arrangement, stable for needles; lengths that break a triangle inequality by
/// rounding make it flat.
pub(super) fn apex([ab, bc, ca]: [f64; 3]) -> [f64; 2] {
    if ab == 0.0 {
        return [0.0, ca];
    }
    let x = 0.5 * (ab + (ca - bc) * ((ca + bc) / ab));
    let mut sorted = [ab, bc, ca];
    sorted.sort_by(f64::total_cmp);
    let [c, b, a] = sorted;
    let square = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
    [x, 0.5 * square.max(0.0).sqrt() / ab]
}

/// The unit normal of a triangle; none without area.
pub(super) fn normal(pose: &[f64], corners: [u32; 3]) -> Option<Vector3<f64>> {
    let [a, b, c] = corners.map(|vertex| point(pose, vertex));
    let (e1, e2) = (b - a, c - a);
    let cross = e1.cross(&e2);
    let size = cross.norm();
    (size > 1e-12 * (e1.norm_squared() + e2.norm_squared())).then(|| cross / size)
}

/// Position of a vertex in a row of 3V coordinates.
pub(super) fn point(positions: &[f64], vertex: u32) -> Vector3<f64> {
    let at = 3 * vertex as usize;
    Vector3::new(positions[at], positions[at + 1], positions[at + 2])
}

/// Puts a vertex into a row of 3V coordinates.
pub(super) fn put(positions: &mut [f64], vertex: u32, at: &Vector3<f64>) {
    let start = 3 * vertex as usize;
    positions[start..start + 3].copy_from_slice(at.as_slice());
}

/// A unit vector perpendicular to `v`: from the coordinate axis least along it.
pub(super) fn perpendicular(v: &Vector3<f64>) -> Vector3<f64> {
    let axis = Vector3::ith(v.iamin(), 1.0);
    let side = axis * v.norm_squared() - v * v.dot(&axis);
    side.try_normalize(0.0).unwrap_or(axis)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Cost, Hinges, VertexCorners, dual_trees};

    /// A ribbon of `n` triangles whose cross bars turn by `twist` and whose course bends by `bend` a
    /// step; `stretch` scales it.
    fn ribbon(n: usize, twist: f64, bend: f64, stretch: f64) -> (Vec<[u32; 3]>, Vec<f64>) {
        let rows = n.div_ceil(2) + 1;
        let (mut at, mut heading) = ([0.0, 0.0], 0.0);
        let mut positions = Vec::new();
        for row in 0..rows {
            let (s, c) = libm::sincos(twist * row as f64);
            let (hs, hc) = libm::sincos(heading);
            // the cross bar turns about the course
            let bar = [-hs * c, hc * c, s];
            for side in [-0.5, 0.5] {
                positions.extend([
                    stretch * (at[0] + side * bar[0]),
                    stretch * (at[1] + side * bar[1]),
                    stretch * side * bar[2],
                ]);
            }
            at = [at[0] + hc, at[1] + hs];
            heading += bend;
        }
        positions.truncate(3 * (n + 2));
        let triangles = (0..n as u32).map(|i| match i % 2 {
            0 => [i, i + 2, i + 1],
            _ => [i, i + 1, i + 2],
        });
        (triangles.collect(), positions)
    }

    fn polygon(triangles: &[[u32; 3]], from: &[f64], to: &[f64]) -> Polygon {
        let vertices = from.len() / 3;
        let corners = VertexCorners::new(vertices, triangles);
        let hinges = Hinges::new(vertices, triangles, &corners);
        assert!(is_polygon(vertices, triangles.len(), hinges.hinges().len()));
        let cost = |hinge: usize| Cost {
            weight: 0.0,
            place: [hinge as f64, 0.0, 0.0],
        };
        let trees = dual_trees(triangles.len(), hinges.hinges(), cost, |f| [f as f64; 3]);
        Polygon::new(triangles, &trees[0], from, to)
    }

    /// Largest difference of the edges' lengths from the straight path between them.
    fn miss(triangles: &[[u32; 3]], from: &[f64], to: &[f64], t: f64, at: &[f64]) -> f64 {
        let sides = triangles.iter().flat_map(|&corners| {
            let [a, b, c] = [from, to, at].map(|pose| side_lengths(pose, corners));
            (0..3).map(move |k| (c[k] - (a[k] * (1.0 - t) + b[k] * t)).abs())
        });
        sides.fold(0.0, f64::max)
    }

    #[test]
    fn lengths_are_linear_and_isometric_poses_stay_isometric() {
        for n in [1, 2, 8, 200] {
            let (triangles, from) = ribbon(n, 0.0, 0.0, 1.0);
            for (twist, bend, stretch) in [(0.02, 0.01, 1.0), (0.0, 0.05, 1.3), (0.01, 0.0, 0.5)] {
                let to = ribbon(n, twist, bend, stretch).1;
                let morph = polygon(&triangles, &from, &to);
                let mut at = vec![0.0; from.len()];
                for t in [0.0, 0.25, 0.5, 1.0] {
                    morph.at(t, &from, &to, &mut at);
                    // rounding of coordinates up to the ribbon's length
                    let bound = 1e-14 * (4.0 + n as f64);
                    assert!(miss(&triangles, &from, &to, t, &at) < bound, "{n} {t}");
                }
            }
        }
    }

    #[test]
    fn both_poses_are_met_up_to_a_translation() {
        let (triangles, from) = ribbon(50, 0.0, 0.0, 1.0);
        let to = ribbon(50, 0.03, 0.02, 1.1).1;
        let morph = polygon(&triangles, &from, &to);
        let mut at = vec![0.0; from.len()];
        for (t, pose) in [(0.0, &from), (1.0, &to)] {
            morph.at(t, &from, &to, &mut at);
            let apart = at.iter().zip(pose).map(|(a, b)| (a - b).abs());
            assert!(apart.fold(0.0, f64::max) < 1e-12);
            assert!(morph.normal_deviation(t, &from, &to)[1] < 1e-7);
        }
    }

    #[test]
    fn positions_are_continuous_in_time() {
        let (triangles, from) = ribbon(50, 0.0, 0.0, 1.0);
        let to = ribbon(50, 0.03, 0.05, 1.0).1;
        let morph = polygon(&triangles, &from, &to);
        let (mut one, mut two) = (vec![0.0; from.len()], vec![0.0; from.len()]);
        for t in [0.1, 0.37, 0.9] {
            let step = |h: f64, one: &mut [f64], two: &mut [f64]| {
                morph.at(t, &from, &to, one);
                morph.at(t + h, &from, &to, two);
                let apart = one.iter().zip(&*two).map(|(a, b)| (a - b).abs());
                apart.fold(0.0, f64::max)
            };
            let (wide, narrow) = (
                step(1e-3, &mut one, &mut two),
                step(1e-4, &mut one, &mut two),
            );
            assert!((wide / narrow - 10.0).abs() < 0.5, "{wide} {narrow}");
        }
    }

    #[test]
    fn a_triangle_that_turns_over_is_told_and_does_so_about_the_edge_to_its_parent() {
        let triangles = [[0, 1, 2], [1, 0, 3], [1, 3, 4]];
        let from = [0., 0., 0., 1., 0., 0., 0., 1., 0., 0., -1., 0., 1., -1., 0.];
        let mut to = from;
        // vertex 2 folded over the edge 0 1, onto the other side
        to[7] = -1.0;
        let morph = polygon(&triangles, &from, &to);
        assert_eq!(morph.opposite(), [0]);
        let mut at = vec![0.0; 15];
        morph.at(0.5, &from, &to, &mut at);
        assert!(miss(&triangles, &from, &to, 0.5, &at) < 1e-15);
        let [a, c] = [0, 2].map(|vertex| point(&at, vertex));
        assert!((c - a).z.abs() > 1.0 - 1e-12, "{c}");
    }

    #[test]
    fn triangles_without_area_follow_their_parents() {
        // the third corner of the second triangle lies on its first edge, in both poses
        let triangles = [[0, 1, 2], [1, 0, 3], [3, 0, 4]];
        let from = [0., 0., 0., 2., 0., 0., 0., 1., 0., 1., 0., 0., 0., -1., 0.];
        let to = [0., 0., 0., 2., 0., 0., 0., 0., 1., 1., 0., 0., 0., 0., -1.];
        let morph = polygon(&triangles, &from, &to);
        let mut at = vec![0.0; 15];
        for t in [0.0, 0.5, 1.0] {
            morph.at(t, &from, &to, &mut at);
            assert!(miss(&triangles, &from, &to, t, &at) < 1e-14);
        }
    }

    #[test]
    fn apexes_of_needles_are_where_their_lengths_say() {
        for [ab, bc, ca] in [
            [1.0, 1.0, 1.0],
            [1e-9, 1.0, 1.0],
            [3.0, 4.0, 5.0],
            [2.0, 1.0, 1.0],
        ] {
            let [x, y] = apex([ab, bc, ca]);
            assert!((x * x + y * y - ca * ca).abs() < 1e-15 * ca * ca * 8.0);
            assert!(((x - ab) * (x - ab) + y * y - bc * bc).abs() < 1e-15 * bc * bc * 8.0);
        }
        assert_eq!(apex([0.0, 2.0, 2.0]), [0.0, 2.0]);
        assert_eq!(apex([1.0, 1.0, 2.0 + 1e-15])[1], 0.0);
    }
}
