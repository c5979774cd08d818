//! Half-edge collapses under quadric errors (Garland & Heckbert 1997; X19 §4.3): one coarser
//! connectivity for several poses of a mesh.
//!
//! A collapse moves a vertex onto a neighbour, so the vertices that remain are vertices of the original
//! and need no correspondences. Its cost is the sum over the poses of the squared distances (weighted by
//! area) of the place it moves to from the planes of all triangles that have gone through it, plus a
//! small multiple of its distance from the places themselves, which spreads what is left over flat
//! regions; borders count as planes perpendicular to them. Cheapest first, as last looked at; ties by the
//! vertices' numbers.
//!
//! A collapse keeps the surface a manifold (the link condition of Dey et al. 1999), keeps borders where
//! they are, and turns no triangle by more than about 78 degrees in any pose; when no such collapse is
//! left, triangles may turn further, at last at all.
//!
//! Degenerate input: vertices without triangles stay. A vertex where several fans of triangles meet stays
//! too. Triangles without area in some pose count nothing there.

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::fmt;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::VertexCorners;
use super::components::root;

/// Distances from places against distances from planes.
const SPREAD: f64 = 1e-3;

/// Borders against planes of triangles.
const BORDER: f64 = 10.0;

/// Vertices that one thread takes at a time.
const CHUNK: usize = 2048;

/// Why a mesh cannot be collapsed. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CollapseError {
    /// More than two triangles meet at the edge of these vertices.
    EdgeOfMany {
        /// The edge.
        edge: [u32; 2],
    },
    /// A triangle names a vertex twice.
    Degenerate {
        /// The triangle.
        triangle: usize,
    },
    /// No collapse is left that keeps the surface.
    Stuck {
        /// The number of triangles reached.
        triangles: usize,
    },
}

impl fmt::Display for CollapseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CollapseError::EdgeOfMany { edge: [a, b] } => write!(
                f,
                "more than two triangles meet at the edge of vertices {} and {}",
                a + 1,
                b + 1
            ),
            CollapseError::Degenerate { triangle } => {
                write!(f, "triangle {} names a vertex twice", triangle + 1)
            }
            CollapseError::Stuck { triangles } => {
                write!(f, "the surface holds at {triangles} triangles")
            }
        }
    }
}

impl std::error::Error for CollapseError {}

/// A coarser mesh and how it came to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Collapsed {
    /// The original vertices that remain, ascending.
    pub vertices: Vec<u32>,
    /// Triangles over 0..`vertices.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// For each original vertex the one that absorbed it, among 0..`vertices.len()`.
    pub absorber: Vec<u32>,
    /// The collapses in order: the number of triangles after each, and its cost (squared length times
    /// area, summed over the poses).
    pub curve: Vec<(usize, f64)>,
}

/// Collapses `triangles` until at most `target` are left. `poses` are 3V positions each, at least one.
///
/// # Errors
/// See [`CollapseError`].
///
/// # Panics
/// Poses of other lengths.
pub fn collapse(
    triangles: &[[u32; 3]],
    poses: &[&[f64]],
    target: usize,
) -> Result<Collapsed, CollapseError> {
    let vertices = poses[0].len() / 3;
    check(vertices, triangles)?;
    let mut mesh = Mesh::new(vertices, triangles, poses);
    mesh.add_planes();
    let mut curve = Vec::new();
    for limit in TURNS {
        if mesh.left > target {
            mesh.run(target, limit, &mut curve);
        }
    }
    match mesh.left > target {
        true => Err(CollapseError::Stuck {
            triangles: mesh.left,
        }),
        false => Ok(mesh.compact(curve)),
    }
}

/// Cosines of the angles that triangles may turn by, one after the other where nothing else is left.
const TURNS: [f64; 3] = [0.2, -0.5, f64::NEG_INFINITY];

/// Edges have one or two triangles, triangles three vertices.
fn check(vertices: usize, triangles: &[[u32; 3]]) -> Result<(), CollapseError> {
    let twice = |&[a, b, c]: &[u32; 3]| a == b || b == c || c == a;
    if let Some(triangle) = triangles.iter().position(twice) {
        return Err(CollapseError::Degenerate { triangle });
    }
    let corners = VertexCorners::new(vertices, triangles);
    let mut others = Vec::new();
    for vertex in 0..vertices as u32 {
        others.clear();
        for &corner in corners.at(vertex as usize) {
            let sides = triangles[corner as usize / 3];
            others.extend(sides.into_iter().filter(|&other| other > vertex));
        }
        others.sort_unstable();
        if let Some(three) = others.windows(3).find(|three| three[0] == three[2]) {
            return Err(CollapseError::EdgeOfMany {
                edge: [vertex, three[0]],
            });
        }
    }
    Ok(())
}

/// A quadric x^T A x - 2 b^T x + c about a vertex's own place: A as xx xy xz yy yz zz, b, c.
type Quadric = [f64; 10];

fn plane(normal: &Vector3<f64>, offset: f64, weight: f64) -> Quadric {
    let (n, b) = (normal, normal * offset);
    [
        n.x * n.x,
        n.x * n.y,
        n.x * n.z,
        n.y * n.y,
        n.y * n.z,
        n.z * n.z,
        b.x,
        b.y,
        b.z,
        offset * offset,
    ]
    .map(|x| x * weight)
}

fn at(q: &Quadric, p: &Vector3<f64>) -> f64 {
    let square = q[0] * p.x * p.x
        + q[3] * p.y * p.y
        + q[5] * p.z * p.z
        + 2.0 * (q[1] * p.x * p.y + q[2] * p.x * p.z + q[4] * p.y * p.z);
    square - 2.0 * (q[6] * p.x + q[7] * p.y + q[8] * p.z) + q[9]
}

/// Adds a quadric that is about another origin: `other` is the other origin seen from this one.
fn add(sum: &mut Quadric, q: &Quadric, other: &Vector3<f64>) {
    // x - o in the place of x
    let o = other;
    let a = [
        q[0] * o.x + q[1] * o.y + q[2] * o.z,
        q[1] * o.x + q[3] * o.y + q[4] * o.z,
        q[2] * o.x + q[4] * o.y + q[5] * o.z,
    ];
    for entry in 0..6 {
        sum[entry] += q[entry];
    }
    for axis in 0..3 {
        sum[6 + axis] += q[6 + axis] + a[axis];
    }
    let square = a[0] * o.x + a[1] * o.y + a[2] * o.z;
    sum[9] += q[9] + 2.0 * (q[6] * o.x + q[7] * o.y + q[8] * o.z) + square;
}

/// The mesh while it is collapsed.
struct Mesh {
    poses: usize,
    /// Place of each vertex in each pose.
    places: Vec<Vector3<f64>>,
    /// Quadric of each vertex in each pose, about its place.
    quadrics: Vec<Quadric>,
    triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    left: usize,
    /// The triangles at each vertex.
    around: Vec<Vec<u32>>,
    border: Vec<bool>,
    /// Where fans meet.
    fixed: Vec<bool>,
    /// Where each removed vertex went.
    parent: Vec<u32>,
    /// How often what lies around each vertex has changed.
    stamp: Vec<u32>,
}

/// The cheapest collapse of a vertex, when it was found.
#[derive(Clone, Copy, PartialEq)]
struct Candidate {
    cost: f64,
    vertex: u32,
    onto: u32,
    stamp: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// The cheapest is the greatest.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then(other.vertex.cmp(&self.vertex))
            .then(other.onto.cmp(&self.onto))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Memory of one evaluation.
#[derive(Default)]
struct Scratch {
    neighbours: Vec<(u32, u32)>,
    sorted: Vec<(f64, u32)>,
    others: Vec<u32>,
}

impl Mesh {
    fn new(vertices: usize, triangles: &[[u32; 3]], poses: &[&[f64]]) -> Self {
        let corners = VertexCorners::new(vertices, triangles);
        let around: Vec<Vec<u32>> = (0..vertices)
            .map(|vertex| corners.at(vertex).iter().map(|corner| corner / 3).collect())
            .collect();
        let place = |at: usize| {
            let (vertex, pose) = (at / poses.len(), at % poses.len());
            Vector3::from_column_slice(&poses[pose][3 * vertex..3 * vertex + 3])
        };
        let mut mesh = Mesh {
            poses: poses.len(),
            places: (0..vertices * poses.len()).map(place).collect(),
            quadrics: vec![[0.0; 10]; vertices * poses.len()],
            triangles: triangles.to_vec(),
            alive: vec![true; triangles.len()],
            left: triangles.len(),
            around,
            border: Vec::new(),
            fixed: Vec::new(),
            parent: (0..vertices as u32).collect(),
            stamp: vec![0; vertices],
        };
        let kinds: Vec<(bool, bool)> = (0..vertices as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map_init(Scratch::default, |scratch, vertex| {
                mesh.kind(vertex, scratch)
            })
            .collect();
        mesh.border = kinds.iter().map(|kind| kind.0).collect();
        mesh.fixed = kinds.iter().map(|kind| kind.1).collect();
        mesh
    }

    /// Whether a vertex lies on a border, and whether its triangles make more than one fan. A fan of k
    /// triangles has k neighbours, or k + 1 with a border.
    fn kind(&self, vertex: u32, scratch: &mut Scratch) -> (bool, bool) {
        self.neighbours(vertex, &mut scratch.neighbours);
        let ends = scratch
            .neighbours
            .iter()
            .filter(|(_, count)| *count == 1)
            .count();
        let fans = self.fans(vertex);
        (ends > 0, fans > 1)
    }

    /// How many fans the triangles around a vertex make.
    fn fans(&self, vertex: u32) -> usize {
        let around = &self.around[vertex as usize];
        let mut fan: Vec<usize> = (0..around.len()).collect();
        let joined = |a: u32, b: u32| {
            let [a, b] = [a, b].map(|triangle| self.triangles[triangle as usize]);
            a.iter().any(|v| *v != vertex && b.contains(v))
        };
        for i in 0..around.len() {
            for j in 0..i {
                let (one, other) = (fan[i], fan[j]);
                if one != other && joined(around[i], around[j]) {
                    fan.iter_mut()
                        .filter(|fan| **fan == one.max(other))
                        .for_each(|fan| *fan = one.min(other));
                }
            }
        }
        fan.iter().enumerate().filter(|(i, fan)| i == *fan).count()
    }

    /// The neighbours of a vertex, ascending, and how many of its triangles each lies in.
    fn neighbours(&self, vertex: u32, found: &mut Vec<(u32, u32)>) {
        found.clear();
        for &triangle in &self.around[vertex as usize] {
            for other in self.triangles[triangle as usize] {
                if other != vertex {
                    match found.iter_mut().find(|(known, _)| *known == other) {
                        Some((_, count)) => *count += 1,
                        None => found.push((other, 1)),
                    }
                }
            }
        }
        found.sort_unstable();
    }

    fn place(&self, vertex: u32, pose: usize) -> &Vector3<f64> {
        &self.places[vertex as usize * self.poses + pose]
    }

    /// The quadrics of the original mesh.
    fn add_planes(&mut self) {
        let mut quadrics = std::mem::take(&mut self.quadrics);
        let poses = self.poses;
        quadrics
            .par_chunks_mut(poses)
            .with_min_len(CHUNK)
            .enumerate()
            .for_each_init(Vec::new, |neighbours, (vertex, quadrics)| {
                let vertex = vertex as u32;
                self.neighbours(vertex, neighbours);
                for (pose, quadric) in quadrics.iter_mut().enumerate() {
                    self.add_planes_at(vertex, pose, neighbours, quadric);
                }
            });
        self.quadrics = quadrics;
    }

    fn add_planes_at(
        &self,
        vertex: u32,
        pose: usize,
        neighbours: &[(u32, u32)],
        quadric: &mut Quadric,
    ) {
        let here = self.place(vertex, pose);
        for &triangle in &self.around[vertex as usize] {
            let corners = self.triangles[triangle as usize];
            let [a, b, c] = corners.map(|corner| self.place(corner, pose) - here);
            let cross = (b - a).cross(&(c - a));
            let size = cross.norm();
            if size > 0.0 {
                let (normal, weight) = (cross / size, size / 6.0);
                add(quadric, &plane(&normal, 0.0, weight), &Vector3::zeros());
                let spread = SPREAD * weight;
                for entry in [0, 3, 5] {
                    quadric[entry] += spread;
                }
            }
            // the sides at the vertex that no other triangle has
            for other in corners.into_iter().filter(|other| *other != vertex) {
                let lone = neighbours.contains(&(other, 1));
                let side = self.place(other, pose) - here;
                let outward = side.cross(&cross);
                let length = outward.norm();
                if lone && length > 0.0 {
                    let weight = BORDER * side.norm_squared() / 2.0;
                    let wall = plane(&(outward / length), 0.0, weight);
                    add(quadric, &wall, &Vector3::zeros());
                }
            }
        }
    }

    /// Collapses while there are candidates and more than `target` triangles. What has changed around a
    /// vertex is looked at when its turn comes, or at once where it had no collapse before.
    fn run(&mut self, target: usize, limit: f64, curve: &mut Vec<(usize, f64)>) {
        let candidates: Vec<Option<Candidate>> = (0..self.around.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map_init(Scratch::default, |scratch, vertex| {
                self.candidate(vertex, limit, scratch)
            })
            .collect();
        let mut idle: Vec<bool> = candidates.iter().map(Option::is_none).collect();
        let mut heap: BinaryHeap<Candidate> = candidates.into_iter().flatten().collect();
        let (mut scratch, mut ring) = (Scratch::default(), Vec::new());
        while self.left > target {
            let Some(candidate) = heap.pop() else { return };
            let vertex = candidate.vertex;
            if self.stamp[vertex as usize] != candidate.stamp {
                let found = self.candidate(vertex, limit, &mut scratch);
                idle[vertex as usize] = found.is_none();
                heap.extend(found);
                continue;
            }
            self.apply(&candidate);
            curve.push((self.left, candidate.cost.max(0.0)));
            self.neighbours(candidate.onto, &mut ring);
            for near in ring.iter().map(|(near, _)| *near).chain([candidate.onto]) {
                self.stamp[near as usize] += 1;
                if idle[near as usize] {
                    let found = self.candidate(near, limit, &mut scratch);
                    idle[near as usize] = found.is_none();
                    heap.extend(found);
                }
            }
        }
    }

    /// The cheapest allowed collapse of a vertex.
    fn candidate(&self, vertex: u32, limit: f64, scratch: &mut Scratch) -> Option<Candidate> {
        if self.fixed[vertex as usize] {
            return None;
        }
        let Scratch {
            neighbours,
            sorted,
            others,
        } = scratch;
        self.neighbours(vertex, neighbours);
        sorted.clear();
        sorted.extend(
            neighbours
                .iter()
                .map(|&(onto, _)| (self.cost(vertex, onto), onto)),
        );
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let allowed = |onto: u32, others: &mut Vec<u32>| {
            self.keeps_the_surface(vertex, onto, neighbours, others)
                && self.turns_little(vertex, onto, limit)
        };
        let found = sorted.iter().find(|(_, onto)| allowed(*onto, others));
        found.map(|&(cost, onto)| Candidate {
            cost,
            vertex,
            onto,
            stamp: self.stamp[vertex as usize],
        })
    }

    /// The cost of moving a vertex onto another.
    fn cost(&self, vertex: u32, onto: u32) -> f64 {
        let quadrics = &self.quadrics[vertex as usize * self.poses..][..self.poses];
        let costs = quadrics.iter().enumerate().map(|(pose, quadric)| {
            let step = self.place(onto, pose) - self.place(vertex, pose);
            at(quadric, &step)
        });
        costs.sum()
    }

    /// The link condition: what both ends neighbour are the corners opposite their edge; a border vertex
    /// moves along its border.
    fn keeps_the_surface(
        &self,
        vertex: u32,
        onto: u32,
        neighbours: &[(u32, u32)],
        others: &mut Vec<u32>,
    ) -> bool {
        let Some(&(_, shared)) = neighbours.iter().find(|(other, _)| *other == onto) else {
            return false;
        };
        let [from, to] = [vertex, onto].map(|v| self.border[v as usize]);
        if from && (shared != 1 || !to) {
            return false;
        }
        others.clear();
        for &triangle in &self.around[onto as usize] {
            let corners = self.triangles[triangle as usize];
            others.extend(corners.into_iter().filter(|corner| *corner != onto));
        }
        others.sort_unstable();
        others.dedup();
        let common = neighbours
            .iter()
            .filter(|(other, _)| others.binary_search(other).is_ok())
            .count();
        // a closed surface of four triangles and a border of three sides are as small as they get
        let smallest = match from {
            true => {
                self.around[vertex as usize].len() < 2 && self.border_is_a_triangle(onto, vertex)
            }
            false => neighbours.len() < 4 && others.len() < 4 && !to,
        };
        common == shared as usize && !smallest
    }

    /// Whether the border through two neighbours has three sides only.
    fn border_is_a_triangle(&self, a: u32, b: u32) -> bool {
        let mut found = Vec::new();
        let mut ends = |vertex: u32| {
            self.neighbours(vertex, &mut found);
            let lone = found.iter().filter(|(_, count)| *count == 1);
            lone.map(|(other, _)| *other).collect::<Vec<u32>>()
        };
        let (of_a, of_b) = (ends(a), ends(b));
        of_a.iter().any(|vertex| of_b.contains(vertex))
    }

    /// Whether no triangle that stays turns far in any pose.
    fn turns_little(&self, vertex: u32, onto: u32, limit: f64) -> bool {
        if limit == f64::NEG_INFINITY {
            return true;
        }
        self.around[vertex as usize].iter().all(|&triangle| {
            let corners = self.triangles[triangle as usize];
            corners.contains(&onto)
                || (0..self.poses).all(|pose| {
                    let normal = |corners: [u32; 3]| {
                        let [a, b, c] = corners.map(|corner| self.place(corner, pose));
                        (b - a).cross(&(c - a))
                    };
                    let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
                    let (before, after) = (normal(corners), normal(moved));
                    before.dot(&after) >= limit * before.norm() * after.norm()
                })
        })
    }

    /// Moves a vertex onto another.
    fn apply(&mut self, candidate: &Candidate) {
        let (vertex, onto) = (candidate.vertex, candidate.onto);
        for pose in 0..self.poses {
            let from = vertex as usize * self.poses + pose;
            let to = onto as usize * self.poses + pose;
            let origin = self.places[from] - self.places[to];
            let quadric = self.quadrics[from];
            add(&mut self.quadrics[to], &quadric, &origin);
        }
        let triangles = std::mem::take(&mut self.around[vertex as usize]);
        for triangle in triangles {
            let corners = self.triangles[triangle as usize];
            if corners.contains(&onto) {
                self.alive[triangle as usize] = false;
                self.left -= 1;
                for corner in corners.into_iter().filter(|corner| *corner != vertex) {
                    self.around[corner as usize].retain(|other| *other != triangle);
                }
            } else {
                let moved = corners.map(|corner| if corner == vertex { onto } else { corner });
                self.triangles[triangle as usize] = moved;
                self.around[onto as usize].push(triangle);
            }
        }
        self.parent[vertex as usize] = onto;
        self.fixed[vertex as usize] = true;
        self.stamp[vertex as usize] += 1;
    }

    /// What is left, its vertices numbered anew.
    fn compact(mut self, curve: Vec<(usize, f64)>) -> Collapsed {
        let stays = |vertex: u32, parent: &[u32]| parent[vertex as usize] == vertex;
        let all = 0..self.parent.len() as u32;
        let vertices: Vec<u32> = all.filter(|&vertex| stays(vertex, &self.parent)).collect();
        let mut number = vec![0; self.parent.len()];
        for (new, &old) in vertices.iter().enumerate() {
            number[old as usize] = new as u32;
        }
        let absorber = (0..self.parent.len() as u32)
            .map(|vertex| number[root(&mut self.parent, vertex) as usize])
            .collect();
        let alive = self.triangles.iter().zip(&self.alive);
        let triangles = alive
            .filter(|(_, alive)| **alive)
            .map(|(triangle, _)| triangle.map(|vertex| number[vertex as usize]))
            .collect();
        Collapsed {
            vertices,
            triangles,
            absorber,
            curve,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// A torus of `rows` x `columns` squares cut in two.
    fn torus(rows: usize, columns: usize) -> (Vec<[u32; 3]>, Vec<f64>) {
        let at = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
        let (mut triangles, mut points) = (Vec::new(), Vec::new());
        for i in 0..rows {
            for j in 0..columns {
                let turn = |i: usize, n: usize| std::f64::consts::TAU * i as f64 / n as f64;
                let ((s, c), (t, d)) =
                    (libm::sincos(turn(i, rows)), libm::sincos(turn(j, columns)));
                points.extend([(2.0 + d) * c, (2.0 + d) * s, t]);
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        (triangles, points)
    }

    /// A flat sheet of `side` x `side` squares with a border.
    fn sheet(side: usize) -> (Vec<[u32; 3]>, Vec<f64>) {
        let at = |x: usize, y: usize| (y * (side + 1) + x) as u32;
        let (mut triangles, mut points) = (Vec::new(), Vec::new());
        for y in 0..=side {
            for x in 0..=side {
                points.extend([x as f64, y as f64, 0.0]);
                if x < side && y < side {
                    let (a, b) = (at(x, y), at(x + 1, y));
                    let (c, d) = (at(x + 1, y + 1), at(x, y + 1));
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        (triangles, points)
    }

    /// How many triangles lie at each edge; vertices and edges that are used.
    fn edges(triangles: &[[u32; 3]]) -> (HashMap<[u32; 2], usize>, usize) {
        let mut edges = HashMap::new();
        let mut vertices: Vec<u32> = triangles.concat();
        for &[a, b, c] in triangles {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                *edges.entry([a.min(b), a.max(b)]).or_insert(0) += 1;
            }
        }
        vertices.sort_unstable();
        vertices.dedup();
        (edges, vertices.len())
    }

    #[test]
    fn a_torus_stays_a_closed_torus() {
        let (triangles, points) = torus(30, 20);
        for target in [400, 60, 20] {
            let found = collapse(&triangles, &[&points], target).unwrap();
            assert!(found.triangles.len() <= target);
            let (edges, vertices) = edges(&found.triangles);
            assert!(edges.values().all(|&count| count == 2));
            assert_eq!(vertices + found.triangles.len(), edges.len(), "Euler's 0");
            assert_eq!(vertices, found.vertices.len());
        }
    }

    #[test]
    fn a_flat_sheet_keeps_its_corners_and_its_border() {
        let (triangles, points) = sheet(12);
        let found = collapse(&triangles, &[&points], 40).unwrap();
        for corner in [0, 12, 13 * 12, 13 * 13 - 1] {
            assert!(found.vertices.contains(&corner));
        }
        let area: f64 = found
            .triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(|vertex| {
                    let at = 3 * found.vertices[vertex as usize] as usize;
                    Vector3::from_column_slice(&points[at..at + 3])
                });
                0.5 * (b - a).cross(&(c - a)).z
            })
            .sum();
        assert!((area - 144.0).abs() < 1e-9, "{area}");
    }

    #[test]
    fn one_sequence_serves_all_poses() {
        let (triangles, flat) = sheet(12);
        // folded along a line in the second pose: its vertices must stay
        let fold = |p: &[f64]| [p[0], p[1], (p[0] - 5.0).abs()];
        let folded: Vec<f64> = flat.chunks_exact(3).flat_map(fold).collect();
        let found = collapse(&triangles, &[&flat, &folded], 60).unwrap();
        let on_the_fold = |triangle: &[u32; 3]| {
            let x = triangle.map(|v| flat[3 * found.vertices[v as usize] as usize]);
            x.iter().all(|x| *x <= 5.0) || x.iter().all(|x| *x >= 5.0)
        };
        assert!(found.triangles.iter().all(on_the_fold));
    }

    #[test]
    fn every_vertex_is_absorbed_by_one_that_remains() {
        let (triangles, points) = torus(20, 12);
        let found = collapse(&triangles, &[&points], 100).unwrap();
        for (new, &old) in found.vertices.iter().enumerate() {
            assert_eq!(found.absorber[old as usize] as usize, new);
        }
        assert!(
            found
                .absorber
                .iter()
                .all(|&to| (to as usize) < found.vertices.len())
        );
        let mut counts = found.curve.iter().map(|(count, _)| *count);
        assert!(counts.next_back() == Some(found.triangles.len()));
        assert!(found.curve.windows(2).all(|pair| pair[1].0 < pair[0].0));
    }

    #[test]
    fn what_is_no_surface_or_holds_is_named() {
        let points = [
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -1.0, 0.0,
        ];
        let three = [[0, 1, 2], [1, 0, 3], [0, 1, 4]];
        let error = collapse(&three, &[&points], 1).unwrap_err();
        assert_eq!(error, CollapseError::EdgeOfMany { edge: [0, 1] });
        let twice = [[0, 1, 2], [0, 3, 3]];
        let error = collapse(&twice, &[&points], 1).unwrap_err();
        assert_eq!(error, CollapseError::Degenerate { triangle: 1 });
        let solid = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let error = collapse(&solid, &[&points], 2).unwrap_err();
        assert_eq!(error, CollapseError::Stuck { triangles: 4 });
        let (triangles, points) = sheet(6);
        assert!(matches!(
            collapse(&triangles, &[&points], 0),
            Err(CollapseError::Stuck { triangles: 1.. })
        ));
    }

    #[test]
    fn where_fans_meet_the_vertex_stays() {
        // two sheets that share one corner
        let (one, points) = sheet(4);
        let shift = |[a, b, c]: &[u32; 3]| [a, b, c].map(|&v| if v == 0 { 0 } else { v + 24 });
        let both: Vec<[u32; 3]> = one.iter().copied().chain(one.iter().map(shift)).collect();
        let mirrored = points[3..].iter().map(|x| -x);
        let points: Vec<f64> = points.iter().copied().chain(mirrored).collect();
        let found = collapse(&both, &[&points], 12).unwrap();
        assert!(found.vertices.contains(&0));
    }
}
