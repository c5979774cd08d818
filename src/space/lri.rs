//! Linear rotation-invariant coordinates, R^(6E+6) (Lipman et al. 2005; CH12 §5): for each directed edge
//! its vector in the local frame of its start, then the shape's placement. Edges are those of the
//! triangles; a loose part or vertex adds 6 or 3 numbers to the placement.
//!
//! A frame is the area-weighted normal at a vertex and the direction in its tangent plane of one edge,
//! the one that lies best in the plane in the reference pose. Both vectors of an edge are kept: three
//! numbers an edge do not tell on which side a folded ring lies.
//!
//! Right for poses that differ by large local motions, and for going beyond the given poses; noisier
//! than patch-lri where vertex frames are (thin or crumpled triangles).
//!
//! Decoding: the vectors around an edge, seen from both its ends, give the rotation between the two
//! frames (Procrustes); all frames follow from these ([`RotationGraph`]), all positions from the frames
//! (v_j - v_i = F_i c_ij in the least-squares sense). Both systems are Laplacians of the edges. That of
//! the frames trusts an edge as far as the vectors around it keep off a line in the reference pose: between
//! slivers, rotations are noise that would add up along a limb.
//!
//! Degenerate input: a vertex whose triangles cancel (one and its copy turned over) takes its normal
//! from two of its edges; one whose edges are all parallel any perpendicular one, which its coordinates
//! do not see. An edge between parallel vectors only does not tell the rotation between its frames and
//! is passed over where others do; where none do, the rotation about it is lost. Duplicate and
//! non-manifold faces need no care.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::orientation::{group_rotations, polar_factors};
use super::placement::{Placement, blocks_from, triple};
use super::registry::State;
use super::scales::Scales;
use super::{Block, Invariance, ShapeSpace, SpaceError};
use crate::math::rotation::{from_matrix, nearest};
use crate::math::rotation_graph::RotationGraph;
use crate::mesh::{Components, Hinges, NO_EDGE, PoissonAnalysis, ReferenceTriangle};

/// Edges or vertices that one thread takes at a time.
const CHUNK: usize = 1024;

/// An edge is trusted at least so much in the system of the frames.
const LEAST_TRUST: f64 = 1e-4;

/// Below this [`nearest`] certainty an edge does not tell the rotation between its frames.
const PARALLEL: f64 = 1e-6;

/// The space of edge vectors in local frames.
pub struct Lri {
    triangles: Vec<[u32; 3]>,
    reference: Arc<[f64]>,
    rest: Arc<[ReferenceTriangle]>,
    hinges: Arc<Hinges>,
    /// Positions from the vectors of the edges.
    graph: RotationGraph,
    /// Frames from the rotations across the edges.
    turns: RotationGraph,
    /// Sides at each edge: those of edge e are `sides[starts[e]..starts[e + 1]]`.
    starts: Vec<u32>,
    sides: Vec<u32>,
    /// Edges at each vertex: those of vertex v are `at[first[v]..first[v + 1]]`, best lying first.
    first: Vec<u32>,
    at: Vec<u32>,
    components: Components,
    /// The group of each triangle: a connected part that has triangles.
    group: Vec<u32>,
    groups: usize,
    weight: f64,
    placement: Placement,
    pool: Mutex<Vec<Workspace>>,
}

#[derive(Default)]
struct Workspace {
    relative: Vec<UnitQuaternion<f64>>,
    certain: Vec<bool>,
    frames: Vec<UnitQuaternion<f64>>,
    sides: Vec<f64>,
}

impl Lri {
    /// The space about a reference pose with its triangles, over an analysed connectivity.
    pub(super) fn new(
        analysis: &PoissonAnalysis,
        reference: Arc<[f64]>,
        rest: Arc<[ReferenceTriangle]>,
        hinges: Arc<Hinges>,
    ) -> Result<Self, SpaceError> {
        let (triangles, components) = (analysis.triangles(), analysis.components());
        let edges = hinges.edges();
        let vertices = reference.len() / 3;
        let scales = Scales::new(&reference);
        let squares: f64 = edges
            .iter()
            .map(|&[a, b]| (point(&reference, b) - point(&reference, a)).norm_squared())
            .sum();
        let (group, shares) = triangle_groups(triangles, components, &rest);
        let (starts, sides) = sides_of_edges(&hinges);
        let graph =
            |weights: Vec<f64>| RotationGraph::on(analysis.symbolic(), edges.to_vec(), weights);
        let trust = trust(edges, (&starts, &sides), triangles, &reference);
        let mut space = Lri {
            graph: graph(vec![1.0; edges.len()])?,
            turns: graph(trust)?,
            placement: Placement::new(components.clone(), &shares, &scales),
            weight: match squares > 0.0 {
                true => scales.size() / (2.0 * squares).sqrt(),
                false => 1.0,
            },
            triangles: triangles.to_vec(),
            reference,
            rest,
            hinges,
            starts,
            sides,
            first: Vec::new(),
            at: Vec::new(),
            components: components.clone(),
            groups: shares.len(),
            group,
            pool: Mutex::default(),
        };
        space.choose_edges(vertices);
        Ok(space)
    }

    /// Sorts the edges at each vertex by how well they lie in its tangent plane in the reference.
    fn choose_edges(&mut self, vertices: usize) {
        let edges = self.hinges.edges();
        let mut at: Vec<Vec<u32>> = vec![Vec::new(); vertices];
        for (edge, ends) in edges.iter().enumerate() {
            ends.iter().for_each(|&v| at[v as usize].push(edge as u32));
        }
        let normals = self.normals(&self.reference);
        self.first = vec![0];
        for (vertex, list) in at.iter_mut().enumerate() {
            let lying = |edge: u32| {
                let e = self.along(&self.reference, vertex, edge);
                let n = normals[vertex].0;
                let size = n.norm() * e.norm();
                if size > 0.0 {
                    n.cross(&e).norm() / size
                } else {
                    0.0
                }
            };
            // what lies within a thousandth counts as equal, so that rounding does not choose
            list.sort_by_cached_key(|&edge| (-(lying(edge) * 1000.0).round() as i32, edge));
            self.at.extend(list.iter());
            self.first.push(self.at.len() as u32);
        }
    }

    /// The vector of `edge` away from `vertex`, one of its ends.
    fn along(&self, positions: &[f64], vertex: usize, edge: u32) -> Vector3<f64> {
        let [a, b] = self.hinges.edges()[edge as usize];
        let other = if a as usize == vertex { b } else { a };
        point(positions, other) - point(positions, vertex as u32)
    }

    /// For each vertex the sum of its triangles' area normals, and of their sizes.
    fn normals(&self, positions: &[f64]) -> Vec<(Vector3<f64>, f64)> {
        let mut normals = vec![(Vector3::zeros(), 0.0); positions.len() / 3];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.map(|vertex| point(positions, vertex));
            let normal = (b - a).cross(&(c - a));
            let size = normal.norm();
            for &vertex in triangle {
                let (sum, total) = &mut normals[vertex as usize];
                *sum += normal;
                *total += size;
            }
        }
        normals
    }

    /// The local frame at a vertex: first axis tangent, third normal.
    fn frame(
        &self,
        positions: &[f64],
        vertex: usize,
        (normal, size): (Vector3<f64>, f64),
    ) -> UnitQuaternion<f64> {
        let range = self.first[vertex] as usize..self.first[vertex + 1] as usize;
        let edges = || {
            let list = self.at[range.clone()].iter();
            list.map(|&edge| self.along(positions, vertex, edge))
                .filter(|e| e.norm_squared() > 0.0)
        };
        let Some(longest) = edges().max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
        else {
            return UnitQuaternion::identity();
        };
        let upright = |n: Vector3<f64>| -> Option<Matrix3<f64>> {
            let n = n.normalize();
            let tangent = |e: &Vector3<f64>| e - n * n.dot(e);
            let lies = |e: &Vector3<f64>| tangent(e).norm() > 0.1 * e.norm();
            let e = edges().find(lies).or_else(|| {
                let length = |e: &Vector3<f64>| tangent(e).norm();
                edges().max_by(|a, b| length(a).total_cmp(&length(b)))
            })?;
            let t = tangent(&e);
            let size = t.norm();
            (size > PARALLEL * e.norm()).then(|| {
                let t = t / size;
                Matrix3::from_columns(&[t, n.cross(&t), n])
            })
        };
        let widest = || {
            let cross = |e: Vector3<f64>| longest.cross(&e);
            edges()
                .map(cross)
                .max_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared()))
                .filter(|n| n.norm() > PARALLEL * longest.norm_squared())
        };
        let whole = (normal.norm() > PARALLEL * size).then_some(normal);
        let frame = whole
            .and_then(upright)
            .or_else(|| widest().and_then(upright));
        from_matrix(&frame.unwrap_or_else(|| about(&longest)))
    }

    fn frames(&self, positions: &[f64], frames: &mut Vec<UnitQuaternion<f64>>) {
        let normals = self.normals(positions);
        frames.resize(normals.len(), UnitQuaternion::identity());
        frames
            .par_iter_mut()
            .enumerate()
            .with_min_len(CHUNK)
            .for_each(|(vertex, frame)| *frame = self.frame(positions, vertex, normals[vertex]));
    }

    /// Where the vector of `edge` from `vertex` stands among the coordinates, in threes.
    fn slot(&self, edge: u32, vertex: u32) -> usize {
        2 * edge as usize + usize::from(self.hinges.edges()[edge as usize][0] != vertex)
    }

    /// The rotation that takes vectors in the frame of the edge's second end to the frame of its first,
    /// and whether they tell it.
    fn between(&self, coordinates: &[f64], edge: usize) -> (UnitQuaternion<f64>, bool) {
        let [a, b] = self.hinges.edges()[edge];
        let vector = |edge: u32, vertex: u32| triple(coordinates, self.slot(edge, vertex));
        let (ab, ba) = (vector(edge as u32, a), vector(edge as u32, b));
        let mut sum = -ab * ba.transpose();
        let range = self.starts[edge] as usize..self.starts[edge + 1] as usize;
        for &side in &self.sides[range] {
            let (triangle, k) = (side / 3, side % 3);
            let at = |k: u32| 3 * triangle + k % 3;
            let [after, before] =
                [at(k + 1), at(k + 2)].map(|s| self.hinges.side_edges()[s as usize]);
            if after == NO_EDGE || before == NO_EDGE {
                continue;
            }
            // the side runs from `start`; `before` joins its start with the third corner
            let start = self.triangles[triangle as usize][k as usize];
            let (to_a, to_b) = if start == a {
                (before, after)
            } else {
                (after, before)
            };
            let (ac, bc) = (vector(to_a, a), vector(to_b, b));
            sum += ac * (bc - ba).transpose() + (ac - ab) * bc.transpose();
        }
        let found = nearest(&sum);
        (found.rotation, found.certainty > PARALLEL)
    }

    /// Positions from frames: the Laplacian of the edges with right sides (F_i c_ij - F_j c_ji) / 2.
    fn positions(&self, coordinates: &[f64], workspace: &mut Workspace, positions: &mut [f64]) {
        let n = positions.len() / 3;
        let Workspace { frames, sides, .. } = workspace;
        sides.clear();
        sides.resize(3 * n, 0.0);
        for (edge, &[a, b]) in self.hinges.edges().iter().enumerate() {
            let forth = frames[a as usize] * triple(coordinates, 2 * edge);
            let back = frames[b as usize] * triple(coordinates, 2 * edge + 1);
            let pull = (forth - back) * (0.5 / self.weight);
            for axis in 0..3 {
                sides[axis * n + a as usize] -= pull[axis];
                sides[axis * n + b as usize] += pull[axis];
            }
        }
        self.graph.factor().solve(3, sides);
        for (vertex, place) in positions.chunks_exact_mut(3).enumerate() {
            for axis in 0..3 {
                place[axis] = sides[axis * n + vertex];
            }
        }
    }

    /// Turns each part as its group is turned against the mean.
    fn orient(&self, placement: &[f64], positions: &mut [f64]) {
        let mut polars = Vec::new();
        polar_factors(&self.rest, &self.triangles, positions, &mut polars);
        let turns = polars.iter().map(|polar| polar.rotation);
        let (groups, _) = group_rotations(&self.rest, turns, &self.group, self.groups);
        let mut back = vec![UnitQuaternion::identity(); self.components.count()];
        for (triangle, &group) in self.triangles.iter().zip(&self.group) {
            let part = self.components.part()[triangle[0] as usize] as usize;
            let turn = self.placement.group_rotation(placement, group as usize);
            back[part] = turn * groups[group as usize].inverse();
        }
        for (place, &part) in positions.chunks_exact_mut(3).zip(self.components.part()) {
            let turned = back[part as usize] * Vector3::from_column_slice(place);
            place.copy_from_slice(turned.as_slice());
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Workspace>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ShapeSpace for Lri {
    fn name(&self) -> &'static str {
        "lri"
    }

    fn dimension(&self) -> usize {
        6 * self.hinges.edges().len() + self.placement.dimension()
    }

    fn invariance(&self) -> Invariance {
        match self.triangles.len() {
            0 => Invariance::None,
            _ => Invariance::Rigid,
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let edges = 6 * self.hinges.edges().len();
        let mut blocks = blocks_from(0, &[("edge in local frame", edges, self.weight)]);
        blocks.extend(self.placement.blocks(edges));
        blocks
    }

    fn state(&self) -> State {
        State::new(self, &self.reference)
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        let edges = self.hinges.edges();
        let (vectors, placement) = coordinates.split_at_mut(6 * edges.len());
        let mut workspace = self.lock().pop().unwrap_or_default();
        self.frames(positions, &mut workspace.frames);
        let frames = &workspace.frames;
        vectors
            .par_chunks_mut(6)
            .zip(edges)
            .with_min_len(CHUNK)
            .for_each(|(out, &[a, b])| {
                let e = (point(positions, b) - point(positions, a)) * self.weight;
                out[..3]
                    .copy_from_slice(frames[a as usize].inverse_transform_vector(&e).as_slice());
                out[3..]
                    .copy_from_slice(frames[b as usize].inverse_transform_vector(&-e).as_slice());
            });
        self.lock().push(workspace);
        let mut polars = Vec::new();
        polar_factors(&self.rest, &self.triangles, positions, &mut polars);
        let turns = polars.iter().map(|polar| polar.rotation);
        let (groups, mean) = group_rotations(&self.rest, turns, &self.group, self.groups);
        self.placement.encode(positions, &mean, &groups, placement);
    }

    fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let start = 6 * self.hinges.edges().len();
        self.placement
            .follow(&near[start..], &mut coordinates[start..])
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        let edges = self.hinges.edges().len();
        let (vectors, placement) = coordinates.split_at(6 * edges);
        let mut workspace = self.lock().pop().unwrap_or_default();
        let Workspace {
            relative,
            certain,
            frames,
            ..
        } = &mut workspace;
        (0..edges)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|edge| self.between(vectors, edge))
            .unzip_into_vecs(relative, certain);
        frames.resize(positions.len() / 3, UnitQuaternion::identity());
        self.turns.solve(relative, &|edge| certain[edge], frames);
        self.positions(vectors, &mut workspace, positions);
        self.lock().push(workspace);
        self.orient(placement, positions);
        self.placement.decode(placement, positions);
    }
}

/// How far the vectors around each edge keep off a line, squared: (l2 + l3) / l1 of the eigenvalues of their
/// second moments.
fn trust(
    edges: &[[u32; 2]],
    (starts, sides): (&[u32], &[u32]),
    triangles: &[[u32; 3]],
    positions: &[f64],
) -> Vec<f64> {
    let of = |edge: usize| {
        let [a, b] = edges[edge].map(|vertex| point(positions, vertex));
        let square = |v: Vector3<f64>| v * v.transpose();
        let range = starts[edge] as usize..starts[edge + 1] as usize;
        let corners = sides[range].iter().map(|&side| {
            let corner = triangles[(side / 3) as usize][(side as usize % 3 + 2) % 3];
            let c = point(positions, corner);
            square(c - a) + square(c - b)
        });
        let moments = square(b - a) + corners.sum::<Matrix3<f64>>();
        let values = moments.symmetric_eigenvalues();
        let off = (values.sum() - values.max()) / values.max();
        match off.is_finite() {
            true => (off * off).max(LEAST_TRUST),
            false => LEAST_TRUST,
        }
    };
    (0..edges.len())
        .into_par_iter()
        .with_min_len(CHUNK)
        .map(of)
        .collect()
}

/// The position of a vertex.
fn point(positions: &[f64], vertex: u32) -> Vector3<f64> {
    triple(positions, vertex as usize)
}

/// A frame whose first axis is along `e`.
fn about(e: &Vector3<f64>) -> Matrix3<f64> {
    let t = e.normalize();
    let axis = Vector3::ith(t.iamin(), 1.0);
    let n = t.cross(&axis).normalize();
    Matrix3::from_columns(&[t, n.cross(&t), n])
}

/// The connected part of each triangle, counting parts with triangles only, and the share of each in the
/// area.
pub(super) fn triangle_groups(
    triangles: &[[u32; 3]],
    components: &Components,
    rest: &[ReferenceTriangle],
) -> (Vec<u32>, Vec<f64>) {
    let mut number = vec![u32::MAX; components.count()];
    let mut areas: Vec<f64> = Vec::new();
    let mut group = Vec::with_capacity(triangles.len());
    for (triangle, rest) in triangles.iter().zip(rest) {
        let number = &mut number[components.part()[triangle[0] as usize] as usize];
        if *number == u32::MAX {
            *number = areas.len() as u32;
            areas.push(0.0);
        }
        areas[*number as usize] += rest.area();
        group.push(*number);
    }
    let total: f64 = areas.iter().sum();
    areas.iter_mut().for_each(|area| *area /= total);
    (group, areas)
}

/// The sides at each edge, ascending.
fn sides_of_edges(hinges: &Hinges) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; hinges.edges().len() + 1];
    let used = || hinges.side_edges().iter().enumerate();
    for (_, &edge) in used().filter(|(_, edge)| **edge != NO_EDGE) {
        starts[edge as usize + 1] += 1;
    }
    for edge in 1..starts.len() {
        starts[edge] += starts[edge - 1];
    }
    let mut next = starts.clone();
    let mut sides = vec![0; starts.last().copied().unwrap_or(0) as usize];
    for (side, &edge) in used().filter(|(_, edge)| **edge != NO_EDGE) {
        sides[next[edge as usize] as usize] = side as u32;
        next[edge as usize] += 1;
    }
    (starts, sides)
}
