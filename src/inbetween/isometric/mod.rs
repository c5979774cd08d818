//! Isometric morphs of meshes (Wuhrer et al., "Isometric morphing of triangular meshes"): edge lengths go
//! linearly from one pose to the other, and triangles turn as their neighbours do.
//!
//! Parts that are triangulated polygons are exact: see [`Polygon`]. For meshes with vertices inside the
//! paper has a heuristic only (its section is lost); ours, in O(F) and one solve a step:
//!
//! 1. A minimum spanning tree of the triangles, where crossing an edge costs how much its two triangles
//!    turn against each other between the poses: it stays within what moves as one and crosses joints
//!    where they bend least. Along it every triangle's turn is its parent's, then a fraction t of its own
//!    turn against the parent. Such a relative turn is small, so there is no doubt about its branch, even
//!    where the whole turns around several times; and which triangle is the root makes no difference.
//! 2. Each triangle gets the shape of its interpolated lengths. Turned and shaped, the triangles fit
//!    together along the tree only; positions follow by the Poisson system ([`crate::mesh::Poisson`]).
//! 3. [`FITS`] times: each triangle of interpolated lengths is laid onto the one that was found, a little
//!    further on the way of the step before, and positions are solved for again. Each brings edges nearer
//!    to their lengths.
//!
//! The rigid motion between the poses (and between parts) is taken off first and put back at the end, so
//! that both poses are met as they are given. Nothing depends on the numbering of vertices and
//! triangles: ties are broken by where things are.

mod mesh;

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, Vector3};

use mesh::{Mesh, between};

use super::polygon::{Polygon, is_polygon, normal, point, put};
use crate::math::direction;
use crate::math::rotation::{exp, log};
use crate::math::sparse::SparseError;
use crate::mesh::rigid_align::{mean, rigid};
use crate::mesh::{Cost, DualTree, Hinges, NO_EDGE, PoissonAnalysis, Topology, dual_trees};

/// How often triangles are laid onto what was found and positions solved for again. On all pairs of ten
/// poses of a horse four times leave half of the mean error of gradients and one edge off by 50 %; six
/// times stay below that everywhere.
pub const FITS: usize = 6;

/// Whether the rigid motion between the poses is taken off before they are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Alignment {
    /// It is, for the whole and for each part.
    Rigid,
    /// Poses are compared as they lie.
    None,
}

/// Costs of crossing two hinges closer than this are the same: mirror images differ by rounding.
const SAME_TURN: f64 = 1e-8;

/// What morphs of one connectivity share.
#[derive(Debug, Clone)]
pub struct Connectivity {
    /// Triangles, each beginning at its corner of smallest x, then y, then z in a given pose, so that
    /// how a file turns a triangle does not show.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) hinges: Arc<Hinges>,
    pub(super) analysis: Arc<PoissonAnalysis>,
    pub(super) members: Vec<Vec<u32>>,
}

impl Connectivity {
    /// Analyses a mesh; `pose` is any pose of it, 3V positions.
    ///
    /// # Errors
    /// The position system would be too large.
    pub fn new(topology: &Topology, pose: &[f64]) -> Result<Self, SparseError> {
        let vertices = topology.vertices();
        let triangles: Vec<_> = topology
            .triangles()
            .iter()
            .map(|&t| turned(t, pose))
            .collect();
        let analysis = PoissonAnalysis::new(vertices, &triangles)?;
        let parts = analysis.components();
        let mut members = vec![Vec::new(); parts.count()];
        for (vertex, &part) in parts.part().iter().enumerate() {
            members[part as usize].push(vertex as u32);
        }
        Ok(Connectivity {
            hinges: Arc::new(Hinges::new(vertices, &triangles, analysis.corners())),
            triangles,
            analysis,
            members,
        })
    }
}

impl Connectivity {
    /// The edges of the triangles, the diagonals that cut polygons among them: the smaller vertex first,
    /// in ascending order.
    pub fn edges(&self) -> &[[u32; 2]] {
        self.hinges.edges()
    }

    /// The three edges of each triangle of the mesh, by their places in [`Connectivity::edges`]; none for
    /// a side from a vertex to itself.
    pub fn sides(&self) -> impl Iterator<Item = [Option<usize>; 3]> {
        let edge = |edge: u32| (edge != NO_EDGE).then_some(edge as usize);
        let sides = self.hinges.side_edges().as_chunks::<3>().0.iter();
        sides.map(move |sides| sides.map(edge))
    }
}

/// The triangle from its smallest corner on.
fn turned(triangle: [u32; 3], pose: &[f64]) -> [u32; 3] {
    let before = |a: u32, b: u32| {
        let (a, b) = (point(pose, a), point(pose, b));
        a.iter()
            .zip(b.iter())
            .fold(std::cmp::Ordering::Equal, |order, (a, b)| {
                order.then(a.total_cmp(b))
            })
            .is_lt()
    };
    let [a, b, c] = triangle;
    if before(b, a) && !before(c, b) {
        [b, c, a]
    } else if before(c, a) && before(c, b) {
        [c, a, b]
    } else {
        triangle
    }
}

/// A morph between two poses of a mesh.
#[derive(Debug)]
pub struct Isometric {
    /// The rigid motion of the whole between the poses.
    motion: Path,
    parts: Vec<Part>,
    /// The poses with the motions of whole and parts taken off, the mean of each part at the origin.
    poses: [Vec<f64>; 2],
    mesh: Option<Mesh>,
    polygons: Vec<Polygon>,
    opposite: Vec<u32>,
}

/// How a connected part moves.
#[derive(Debug, Clone)]
struct Part {
    members: Vec<u32>,
    path: Path,
    /// Whether it comes out as it is to lie, or up to a rigid motion.
    settled: bool,
}

/// A rigid motion that goes on steadily: its centre along a line, turning about it.
#[derive(Debug, Clone, Copy)]
struct Path {
    from: Vector3<f64>,
    to: Vector3<f64>,
    turn: Vector3<f64>,
}

impl Path {
    /// Where what lies about the origin is at `t`.
    fn at(&self, t: f64) -> Isometry3<f64> {
        let centre = self.from * (1.0 - t) + self.to * t;
        Isometry3::from_parts(Translation3::from(centre), exp(&(self.turn * t)))
    }
}

impl Isometric {
    /// Two poses of 3V positions.
    ///
    /// # Errors
    /// The first pose has sizes beyond double precision.
    ///
    /// # Panics
    /// A pose is not 3V long.
    pub fn new(
        connectivity: &Connectivity,
        from: &[f64],
        to: &[f64],
        alignment: Alignment,
    ) -> Result<Self, SparseError> {
        let motion = path(from, to, alignment);
        let mut poses = [unmoved(from, &motion.at(0.0)), unmoved(to, &motion.at(1.0))];
        let members = &connectivity.members;
        let mut parts: Vec<Part> = members
            .iter()
            .map(|members| Part::new(members, &mut poses, alignment))
            .collect();
        let trees = connectivity.trees([from, to]);
        let (polygons, others) = connectivity.sort_out(trees, &poses, &mut parts);
        let mesh = match others.is_empty() {
            true => None,
            false => Some(Mesh::new(connectivity, others, &poses)?),
        };
        Ok(Isometric {
            motion,
            parts,
            opposite: polygons
                .iter()
                .flat_map(|polygon| polygon.opposite().to_vec())
                .collect(),
            poses,
            mesh,
            polygons,
        })
    }

    /// The shape a fraction `t` of the way.
    ///
    /// # Panics
    /// `positions` is not 3V long.
    pub fn at(&self, t: f64, positions: &mut [f64]) {
        let whole = self.motion.at(t);
        self.shaped(t, positions);
        for part in &self.parts {
            let place = whole * part.path.at(t);
            for &vertex in &part.members {
                let at = place * nalgebra::Point3::from(point(positions, vertex));
                put(positions, vertex, &at.coords);
            }
        }
    }

    /// Triangles of polygons whose normals are opposite in the two poses: which way they turn over is a
    /// guess. They count from 0.
    pub fn opposite(&self) -> &[u32] {
        &self.opposite
    }

    /// How many parts of the mesh are triangulated polygons, whose lengths are exact.
    pub fn polygons(&self) -> usize {
        self.polygons.len()
    }

    /// The angle in radians by which the whole turns between the poses.
    pub fn turn(&self) -> f64 {
        self.motion.turn.norm()
    }

    /// Mean and largest angle in radians between the triangles' normals at `t` and the great circles
    /// between their normals in the two poses; triangles without area are left out.
    pub fn normal_deviation(&self, t: f64, triangles: &[[u32; 3]]) -> [f64; 2] {
        let mut positions = vec![0.0; self.poses[0].len()];
        self.shaped(t, &mut positions);
        let angles = triangles.iter().filter_map(|&corners| {
            let [from, to] = [0, 1].map(|pose| normal(&self.poses[pose], corners));
            let wanted = direction::Arc::between(&from?, &to?)?.at(t);
            let found = normal(&positions, corners)?;
            Some(libm::atan2(wanted.cross(&found).norm(), wanted.dot(&found)))
        });
        let (count, sum, worst) = angles.fold((0, 0.0, 0.0_f64), |(count, sum, worst), angle| {
            (count + 1, sum + angle, worst.max(angle))
        });
        [sum / f64::from(count.max(1)), worst]
    }

    /// The shape without the motions of whole and parts.
    fn shaped(&self, t: f64, positions: &mut [f64]) {
        let [from, to] = &self.poses;
        match &self.mesh {
            Some(mesh) => mesh.at(t, positions),
            None => positions.fill(0.0),
        }
        for polygon in &self.polygons {
            polygon.at(t, from, to, positions);
        }
        for part in self.parts.iter().filter(|part| !part.settled) {
            part.settle(t, &self.poses, positions);
        }
    }
}

impl Part {
    /// Takes the part's own motion off both poses.
    fn new(members: &[u32], poses: &mut [Vec<f64>; 2], alignment: Alignment) -> Self {
        let [from, to] = [0, 1].map(|pose| gathered(&poses[pose], members));
        let path = path(&from, &to, alignment);
        for (pose, positions) in [(0, from), (1, to)] {
            let local = unmoved(&positions, &path.at(pose as f64));
            for (&vertex, at) in members.iter().zip(local.chunks_exact(3)) {
                let start = 3 * vertex as usize;
                poses[pose][start..start + 3].copy_from_slice(at);
            }
        }
        Part {
            members: members.to_vec(),
            path,
            settled: false,
        }
    }

    /// Lays the part, found up to a rigid motion, onto the mean of its two poses at `t`.
    fn settle(&self, t: f64, [from, to]: &[Vec<f64>; 2], positions: &mut [f64]) {
        let blend: Vec<f64> = self
            .members
            .iter()
            .flat_map(|&v| (point(from, v) * (1.0 - t) + point(to, v) * t).data.0[0])
            .collect();
        let motion = rigid(&gathered(positions, &self.members), &blend);
        for &vertex in &self.members {
            let at = motion * nalgebra::Point3::from(point(positions, vertex));
            put(positions, vertex, &at.coords);
        }
    }
}

/// The rigid motion from one pose to the other about their means.
fn path(from: &[f64], to: &[f64], alignment: Alignment) -> Path {
    let turn = match alignment {
        Alignment::Rigid => log(&rigid(from, to).rotation),
        Alignment::None => Vector3::zeros(),
    };
    Path {
        from: mean(from),
        to: mean(to),
        turn,
    }
}

/// `positions` with a motion undone.
fn unmoved(positions: &[f64], motion: &Isometry3<f64>) -> Vec<f64> {
    let back = motion.rotation.inverse();
    let points = positions.chunks_exact(3).map(Vector3::from_column_slice);
    points
        .flat_map(|p| (back * (p - motion.translation.vector)).data.0[0])
        .collect()
}

pub(super) fn gathered(positions: &[f64], members: &[u32]) -> Vec<f64> {
    let points = members.iter().map(|&vertex| point(positions, vertex));
    points.flat_map(|p| p.data.0[0]).collect()
}

impl Connectivity {
    /// The trees of all parts; crossing a hinge costs the squared sine of half the angle by which its
    /// triangles turn against each other, times four. That does not see rigid motions, so the poses are
    /// taken as they are given: their bits do not depend on the numbering.
    fn trees(&self, poses: [&[f64]; 2]) -> Vec<DualTree> {
        let turns = between(&self.triangles, poses).1;
        let middle = |vertices: &[u32]| {
            let points = vertices.iter().map(|&v| point(poses[0], v));
            let low = points
                .clone()
                .fold(Vector3::repeat(f64::MAX), |a, b| a.inf(&b));
            let high = points.fold(Vector3::repeat(f64::MIN), |a, b| a.sup(&b));
            (low + high).data.0[0]
        };
        let cost = |hinge: usize| {
            let hinge = self.hinges.hinges()[hinge];
            let [a, b] = hinge.triangles().map(|face| turns[face as usize]);
            // a quaternion and its opposite are the same turn
            let apart = (a.coords - b.coords).norm_squared();
            let apart = apart.min((a.coords + b.coords).norm_squared());
            Cost {
                weight: libm::round(apart / SAME_TURN),
                place: middle(&self.hinges.edges()[hinge.edge as usize]),
            }
        };
        dual_trees(self.triangles.len(), self.hinges.hinges(), cost, |face| {
            middle(&self.triangles[face])
        })
    }

    /// Polygons made of the trees that span one, and the other trees. Their parts need no more settling:
    /// they are marked.
    fn sort_out(
        &self,
        trees: Vec<DualTree>,
        poses: &[Vec<f64>; 2],
        parts: &mut [Part],
    ) -> (Vec<Polygon>, Vec<DualTree>) {
        let part = |face: u32| {
            let vertex = self.triangles[face as usize][0];
            self.analysis.components().part()[vertex as usize] as usize
        };
        let mut hinges = vec![0; parts.len()];
        for hinge in self.hinges.hinges() {
            hinges[part(hinge.triangles()[0])] += 1;
        }
        let (mut polygons, mut others) = (Vec::new(), Vec::new());
        for tree in trees {
            let at = part(tree.root);
            let (triangles, vertices) = (tree.steps.len() + 1, parts[at].members.len());
            if is_polygon(vertices, triangles, hinges[at]) {
                parts[at].settled = true;
                polygons.push(Polygon::new(&self.triangles, &tree, &poses[0], &poses[1]));
            } else {
                others.push(tree);
            }
        }
        // vertices without a triangle go straight
        let mut loose = vec![true; parts.len()];
        (0..self.triangles.len() as u32).for_each(|face| loose[part(face)] = false);
        for (part, loose) in parts.iter_mut().zip(loose) {
            part.settled |= loose;
        }
        (polygons, others)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;
    use crate::mesh::Sequence;

    fn demo(name: &str, frames: [usize; 2]) -> (Topology, [Vec<f64>; 2]) {
        let capture: Sequence = Demo::find(name).unwrap().generate();
        let pose = |frame| {
            let row = capture.frame(frame).iter();
            row.map(|&x| f64::from(x)).collect::<Vec<f64>>()
        };
        let topology = crate::mesh::FrameSource::topology(&capture);
        ((**topology).clone(), frames.map(pose))
    }

    fn morph(topology: &Topology, [from, to]: &[Vec<f64>; 2]) -> Isometric {
        let connectivity = Connectivity::new(topology, from).unwrap();
        Isometric::new(&connectivity, from, to, Alignment::Rigid).unwrap()
    }

    fn at(morph: &Isometric, t: f64) -> Vec<f64> {
        let mut positions = vec![f64::NAN; morph.poses[0].len()];
        morph.at(t, &mut positions);
        positions
    }

    fn farthest(a: &[f64], b: &[f64]) -> f64 {
        let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max)
    }

    /// A permutation of 0..n that mixes well.
    fn mixed(n: usize) -> Vec<u32> {
        let mut order: Vec<u32> = (0..n as u32).collect();
        order.sort_by_key(|&i| u64::from(i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
        order
    }

    #[test]
    fn both_poses_are_met() {
        for (name, frames) in [("bar", [0, 20]), ("cactus", [0, 2])] {
            let (topology, poses) = demo(name, frames);
            let found = morph(&topology, &poses);
            for (t, pose) in [(0.0, &poses[0]), (1.0, &poses[1])] {
                // solves of well-shaped meshes of unit size
                assert!(farthest(&at(&found, t), pose) < 1e-9, "{name} {t}");
            }
        }
    }

    #[test]
    fn numbering_and_the_first_corner_of_a_triangle_do_not_show() {
        for (name, frames) in [("bar", [0, 20]), ("cactus", [0, 2])] {
            let (topology, poses) = demo(name, frames);
            let vertices = mixed(topology.vertices());
            let faces = mixed(topology.triangles().len());
            let mut renumbered = vec![[0; 3]; faces.len()];
            for (i, (&face, triangle)) in faces.iter().zip(topology.triangles()).enumerate() {
                let corners = triangle.map(|vertex| vertices[vertex as usize]);
                renumbered[face as usize] = [0, 1, 2].map(|k| corners[(k + i) % 3]);
            }
            let moved = |pose: &Vec<f64>| {
                let mut row = vec![0.0; pose.len()];
                for (vertex, at) in pose.chunks_exact(3).enumerate() {
                    let start = 3 * vertices[vertex] as usize;
                    row[start..start + 3].copy_from_slice(at);
                }
                row
            };
            let other = Topology::from_triangles(topology.vertices(), &renumbered).unwrap();
            let others = [moved(&poses[0]), moved(&poses[1])];
            let (one, two) = (morph(&topology, &poses), morph(&other, &others));
            for t in [0.2, 0.5] {
                let apart = farthest(&moved(&at(&one, t)), &at(&two, t));
                assert!(apart < 1e-9, "{name} {t}: {apart}");
            }
        }
    }

    #[test]
    fn a_turned_copy_is_reached_by_a_rigid_motion() {
        let (topology, [from, _]) = demo("cactus", [0, 1]);
        let turn = exp(&Vector3::new(1.0, 2.0, -1.5));
        let to: Vec<f64> = from
            .chunks_exact(3)
            .flat_map(|p| (turn * Vector3::from_column_slice(p) + Vector3::x()).data.0[0])
            .collect();
        let middle = at(&morph(&topology, &[from.clone(), to]), 0.4);
        let back = rigid(&middle, &from);
        let again: Vec<f64> = middle
            .chunks_exact(3)
            .flat_map(|p| (back * nalgebra::Point3::from_slice(p)).coords.data.0[0])
            .collect();
        assert!(farthest(&again, &from) < 1e-9);
        assert!((back.rotation.angle() - 0.4 * turn.angle()).abs() < 1e-9);
    }

    #[test]
    fn where_the_poses_lie_and_their_size_do_not_matter() {
        let (topology, poses) = demo("cactus", [0, 2]);
        let middle = at(&morph(&topology, &poses), 0.5);
        for (size, away) in [(1e8, 0.0), (1e-8, 0.0), (1.0, 1e4)] {
            let moved =
                |pose: &[f64]| -> Vec<f64> { pose.iter().map(|x| x * size + away).collect() };
            let other = [moved(&poses[0]), moved(&poses[1])];
            let found = at(&morph(&topology, &other), 0.5);
            // rounding of coordinates far from the origin
            let bound = 1e-9 * size + 1e-11 * away;
            assert!(farthest(&moved(&middle), &found) < bound, "{size} {away}");
        }
    }

    #[test]
    fn a_bar_bends_and_twists_with_its_lengths() {
        let (topology, poses) = demo("bar", [0, 20]);
        let edges = crate::mesh::Edges::new(&topology);
        let length = |pose: &[f64], [a, b]: [u32; 2]| (point(pose, a) - point(pose, b)).norm();
        let middle = at(&morph(&topology, &poses), 0.5);
        let errors = edges.ends().iter().map(|&ends| {
            let wanted = 0.5 * (length(&poses[0], ends) + length(&poses[1], ends));
            (length(&middle, ends) / wanted - 1.0).abs()
        });
        // two of a hundred is what the spaces promise for this bar
        assert!(errors.fold(0.0, f64::max) < 0.02);
    }

    #[test]
    fn flat_and_repeated_triangles_and_loose_vertices_are_carried_along() {
        let triangles = [[0, 1, 2], [1, 0, 3], [0, 0, 1], [0, 1, 4], [0, 1, 2]];
        let from = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [2.0, 0.0, 0.0], // on the line of 0 and 1
            [5.0, 5.0, 5.0], // of no triangle
        ];
        let mut to = from;
        to[3] = [0.0, 0.0, -1.0];
        to[5] = [7.0, 5.0, 5.0];
        let topology = Topology::from_triangles(6, &triangles).unwrap();
        let poses = [from.as_flattened().to_vec(), to.as_flattened().to_vec()];
        let found = morph(&topology, &poses);
        assert!(farthest(&at(&found, 1.0), &poses[1]) < 1e-9);
        let middle = at(&found, 0.5);
        assert!(middle.iter().all(|x| x.is_finite()));
    }
}
