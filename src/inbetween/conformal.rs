//! Discretely conformal metrics (Springborn, Schroeder & Pinkall 2008; Rojas et al. 2014, §5): edge lengths
//! b_ij = exp((u_i + u_j) / 2) a_ij, one factor u a vertex.
//!
//! [`factors`] finds u between two meshes that are equivalent. [`sphere`] finds a mesh inscribed in the
//! unit sphere that is equivalent to a closed mesh of genus 0: one vertex is sent to infinity (all its
//! edges scaled to length 1), the rest is flattened by Newton's method on the convex energy whose gradient
//! is 2 pi minus the angle sum at each inner vertex, laid out in the plane, and taken to the sphere by
//! stereographic projection; a Moebius transformation then moves the mean of the vertices to the centre.
//! Edges are not flipped: a mesh whose flat metric would break a triangle inequality is refused, with the
//! triangle.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use std::fmt;

use nalgebra::Vector3;

use crate::math::sparse::{Analysis, Factor, Pattern, SparseError};
use crate::mesh::dihedral::triangle_of_lengths;
use crate::mesh::{Hinges, Topology, VertexCorners};

/// Newton steps at most; ten are usual.
const STEPS: usize = 60;

/// Angle sums are right to this many radians.
const FLAT: f64 = 1e-10;

/// The mean of the vertices on the sphere is at the centre to this part of the radius.
const CENTRED: f64 = 1e-10;

/// Why there are no conformal factors. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConformalError {
    /// The mesh is no closed surface of genus 0 in one part.
    NotASphere {
        /// Vertices, edges and triangles, whose alternating sum must be 2.
        counts: [usize; 3],
    },
    /// The flat metric needs an edge flipped: this triangle breaks its inequality.
    Degenerates {
        /// The triangle.
        triangle: usize,
    },
    /// The iteration did not end; the largest angle defect left, in radians.
    NotConverged {
        /// The defect.
        defect: f64,
    },
    /// A factor failed.
    Solver(SparseError),
}

impl fmt::Display for ConformalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ConformalError::NotASphere { counts: [v, e, t] } => write!(
                f,
                "only a closed mesh without handles has a map to the sphere; this one has {v} vertices, {e} edges and {t} triangles"
            ),
            ConformalError::Degenerates { triangle } => write!(
                f,
                "the map to the sphere degenerates at triangle {}",
                triangle + 1
            ),
            ConformalError::NotConverged { defect } => write!(
                f,
                "the map to the sphere did not converge: angles are off by up to {defect:.2e}"
            ),
            ConformalError::Solver(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for ConformalError {}

impl From<SparseError> for ConformalError {
    fn from(error: SparseError) -> Self {
        ConformalError::Solver(error)
    }
}

/// Factors between two metrics, and how far they are from explaining the second.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors {
    /// u of each vertex.
    pub factors: Vec<f64>,
    /// Root mean square over the edges of log b - log a - (u_i + u_j) / 2: 0 for equivalent metrics, about
    /// the relative error of the lengths otherwise.
    pub residual: f64,
}

/// The factors that take lengths `a` to `b` as well as can be: least squares in the logarithms, the least
/// factors where that leaves a choice. Edges without length in either are left out.
///
/// # Errors
/// The system is too large.
///
/// # Panics
/// `a`, `b` and `edges` differ in length, or an edge names a vertex that does not exist.
pub fn factors(
    vertices: usize,
    edges: &[[u32; 2]],
    a: &[f64],
    b: &[f64],
) -> Result<Factors, ConformalError> {
    assert!(
        a.len() == edges.len() && b.len() == edges.len(),
        "one length an edge"
    );
    let analysis = Analysis::new(Pattern::new(vertices, edges.iter().copied()))?;
    let pattern = analysis.pattern();
    let mut entries = vec![0.0; pattern.entries()];
    let mut factors = vec![0.0; vertices];
    let log = |edge: usize| match a[edge] > 0.0 && b[edge] > 0.0 {
        true => Some(libm::log(b[edge] / a[edge])),
        false => None,
    };
    for (edge, &[i, j]) in edges.iter().enumerate() {
        let Some(ratio) = log(edge) else { continue };
        let (i, j) = (i as usize, j as usize);
        factors[i] += 0.5 * ratio;
        factors[j] += 0.5 * ratio;
        for (row, column) in [(i, i), (j, j), (i, j)] {
            if let Some(at) = pattern.entry(row, column) {
                entries[at] += 0.25;
            }
        }
    }
    // u and -u alternate around even rings: the least factors are taken there
    for vertex in 0..vertices {
        if let Some(at) = pattern.entry(vertex, vertex) {
            entries[at] += 1e-12;
        }
    }
    analysis.factor(&entries)?.solve(1, &mut factors);
    let off = |(edge, &[i, j]): (usize, &[u32; 2])| {
        let mean = 0.5 * (factors[i as usize] + factors[j as usize]);
        log(edge).map_or(0.0, |ratio| ratio - mean)
    };
    let squares: f64 = edges.iter().enumerate().map(off).map(|e| e * e).sum();
    Ok(Factors {
        residual: (squares / edges.len().max(1) as f64).sqrt(),
        factors,
    })
}

/// Lengths exp(t (u_i + u_j) / 2) a_ij, the path of R14 Fig. 11: `a` at t = 0, the other metric at t = 1.
///
/// # Panics
/// `lengths` and `edges` differ in length.
pub fn scaled(edges: &[[u32; 2]], lengths: &[f64], factors: &[f64], t: f64) -> Vec<f64> {
    assert_eq!(lengths.len(), edges.len(), "one length an edge");
    let each = edges.iter().zip(lengths);
    each.map(|(&[i, j], length)| {
        length * libm::exp(0.5 * t * (factors[i as usize] + factors[j as usize]))
    })
    .collect()
}

/// An equivalent mesh inscribed in the unit sphere about the origin, the mean of its vertices at the
/// centre; 3V positions, faces seen from outside as before.
///
/// # Errors
/// [`ConformalError`].
///
/// # Panics
/// `lengths` is not in the order of the edges of `topology`'s triangles ([`Hinges::edges`]).
pub fn sphere(topology: &Topology, lengths: &[f64]) -> Result<Vec<f64>, ConformalError> {
    let (vertices, triangles) = (topology.vertices(), topology.triangles());
    let corners = VertexCorners::new(vertices, triangles);
    let hinges = Hinges::new(vertices, triangles, &corners);
    assert_eq!(
        lengths.len(),
        hinges.edges().len(),
        "lengths of another mesh"
    );
    check_sphere(vertices, triangles, &hinges)?;
    let pole = (0..vertices).fold(0, |best, v| {
        if corners.at(v).len() > corners.at(best).len() {
            v
        } else {
            best
        }
    });
    let disk = Disk::new(triangles, &hinges, pole as u32, vertices);
    let flat = disk.flatten(lengths)?;
    let plane = disk.lay_out(&flat);
    let mut points: Vec<Vector3<f64>> = plane.into_iter().map(lifted).collect();
    points[pole] = Vector3::z();
    centre(&mut points);
    Ok(points.iter().flat_map(|p| [p.x, p.y, p.z]).collect())
}

/// Every edge between two triangles that run through it opposite ways, one part, Euler characteristic 2.
fn check_sphere(
    vertices: usize,
    triangles: &[[u32; 3]],
    hinges: &Hinges,
) -> Result<(), ConformalError> {
    let (edges, faces) = (hinges.edges().len(), triangles.len());
    let start = |side: u32| triangles[side as usize / 3][side as usize % 3];
    let closed = hinges.hinges().len() == edges
        && 2 * edges == 3 * faces
        && hinges
            .hinges()
            .iter()
            .all(|h| start(h.sides[0]) != start(h.sides[1]));
    let parts = crate::mesh::Components::new(vertices, triangles).count();
    match closed && parts == 1 && vertices + faces == edges + 2 {
        true => Ok(()),
        false => Err(ConformalError::NotASphere {
            counts: [vertices, edges, faces],
        }),
    }
}

/// The mesh without one vertex and its triangles.
struct Disk<'a> {
    triangles: &'a [[u32; 3]],
    hinges: &'a Hinges,
    /// Which triangles are left.
    kept: Vec<u32>,
    /// Vertices whose angle sum is prescribed: neither the pole nor next to it.
    inner: Vec<bool>,
    pole: u32,
}

impl<'a> Disk<'a> {
    fn new(triangles: &'a [[u32; 3]], hinges: &'a Hinges, pole: u32, vertices: usize) -> Self {
        let mut inner = vec![true; vertices];
        for triangle in triangles.iter().filter(|t| t.contains(&pole)) {
            triangle.iter().for_each(|&v| inner[v as usize] = false);
        }
        let kept = (0..triangles.len() as u32)
            .filter(|&t| !triangles[t as usize].contains(&pole))
            .collect();
        Disk {
            triangles,
            hinges,
            kept,
            inner,
            pole,
        }
    }

    fn edges_of(&self, triangle: u32) -> [usize; 3] {
        std::array::from_fn(|k| self.hinges.side_edges()[3 * triangle as usize + k] as usize)
    }

    /// The lengths of a flat metric equivalent to the one given: the factors of the pole's neighbours make
    /// its edges one length, those of the others follow.
    fn flatten(&self, lengths: &[f64]) -> Result<Vec<f64>, ConformalError> {
        let vertices = self.inner.len();
        let mut factors = vec![0.0; vertices];
        let edges = self.hinges.edges();
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        for (&[i, j], &length) in edges.iter().zip(lengths) {
            if i == self.pole || j == self.pole {
                let other = if i == self.pole { j } else { i };
                factors[other as usize] = -2.0 * libm::log(length / mean);
            }
        }
        let inner_edges = edges.iter().copied();
        let analysis = Analysis::new(Pattern::new(vertices, inner_edges))?;
        let mut factor: Option<Factor> = None;
        let mut state = self.angles(&scaled(edges, lengths, &factors, 1.0));
        let mut damping = 1e-8;
        for _ in 0..STEPS {
            if self.largest(&state.defects) < FLAT && state.broken.is_none() {
                return Ok(scaled(edges, lengths, &factors, 1.0));
            }
            let entries = self.hessian(&analysis, &state, damping);
            match factor.as_mut() {
                Some(factor) => factor.refactor(&entries)?,
                None => factor = Some(analysis.factor(&entries)?),
            }
            let mut step = state.defects.clone();
            if let Some(factor) = &factor {
                factor.solve(1, &mut step);
            }
            // half steps until the angle defects shrink (the energy is convex)
            let mut moved = false;
            let mut part = 1.0;
            for _ in 0..20 {
                let trial: Vec<f64> = factors
                    .iter()
                    .zip(&step)
                    .map(|(u, d)| u - part * d)
                    .collect();
                let found = self.angles(&scaled(edges, lengths, &trial, 1.0));
                if norm(&found.defects) < norm(&state.defects) {
                    (factors, state, moved) = (trial, found, true);
                    break;
                }
                part *= 0.5;
            }
            damping = if moved && part > 0.9 {
                (damping * 0.1).max(1e-10)
            } else {
                damping * 10.0
            };
            if !moved && damping > 1e2 {
                break;
            }
        }
        Err(match state.broken {
            Some(triangle) => ConformalError::Degenerates {
                triangle: triangle as usize,
            },
            None if self.largest(&state.defects) < 100.0 * FLAT => {
                return Ok(scaled(edges, lengths, &factors, 1.0));
            }
            None => ConformalError::NotConverged {
                defect: self.largest(&state.defects),
            },
        })
    }

    fn largest(&self, defects: &[f64]) -> f64 {
        defects.iter().fold(0.0, |most, d| most.max(d.abs()))
    }

    /// The angle defects of inner vertices and the angles of the triangles that are left.
    fn angles(&self, lengths: &[f64]) -> Angles {
        let mut defects: Vec<f64> = self
            .inner
            .iter()
            .map(|&i| if i { TAU } else { 0.0 })
            .collect();
        let mut corners = vec![[0.0; 3]; self.triangles.len()];
        let mut broken = None;
        for &triangle in &self.kept {
            let sides = self.edges_of(triangle).map(|edge| lengths[edge]);
            let angles = corner_angles(sides);
            let longest = sides.into_iter().fold(0.0, f64::max);
            if 2.0 * longest >= sides.iter().sum::<f64>() && broken.is_none() {
                broken = Some(triangle);
            }
            for (k, &vertex) in self.triangles[triangle as usize].iter().enumerate() {
                if self.inner[vertex as usize] {
                    defects[vertex as usize] -= angles[k];
                }
            }
            corners[triangle as usize] = angles;
        }
        Angles {
            defects,
            corners,
            broken,
        }
    }

    /// The derivative of the angle sums: half the cotangent Laplacian, vertices that are held apart.
    fn hessian(&self, analysis: &Analysis, state: &Angles, damping: f64) -> Vec<f64> {
        let pattern = analysis.pattern();
        let mut entries = vec![0.0; pattern.entries()];
        let mut add = |i: u32, j: u32, value: f64| {
            if let Some(at) = pattern.entry(i as usize, j as usize) {
                entries[at] += value;
            }
        };
        for &triangle in &self.kept {
            let points = self.triangles[triangle as usize];
            for k in 0..3 {
                let angle = state.corners[triangle as usize][k];
                if !(1e-9..PI - 1e-9).contains(&angle) {
                    continue;
                }
                let (sine, cosine) = libm::sincos(angle);
                // the edge opposite corner k; its angle changes the sums at both ends
                let weight = 0.5 * cosine / sine;
                let (i, j) = (points[(k + 1) % 3], points[(k + 2) % 3]);
                let free = [i, j].map(|v| self.inner[v as usize]);
                for (v, free) in [i, j].into_iter().zip(free) {
                    if free {
                        add(v, v, weight);
                    }
                }
                if free[0] && free[1] {
                    add(i, j, -weight);
                }
            }
        }
        for (vertex, &inner) in self.inner.iter().enumerate() {
            add(
                vertex as u32,
                vertex as u32,
                if inner { damping } else { 1.0 },
            );
        }
        // a triangle that is nearly broken may make a diagonal negative: no pivot below the damping
        for vertex in 0..self.inner.len() {
            if let Some(at) = pattern.entry(vertex, vertex) {
                entries[at] = entries[at].max(damping);
            }
        }
        entries
    }

    /// Positions in the plane of a flat metric, triangle after triangle from the one farthest inside.
    fn lay_out(&self, lengths: &[f64]) -> Vec<[f64; 2]> {
        let mut plane = vec![[0.0; 2]; self.inner.len()];
        let mut placed = vec![false; self.inner.len()];
        let mut seen = vec![false; self.triangles.len()];
        let mut across = vec![u32::MAX; 3 * self.triangles.len()];
        for hinge in self.hinges.hinges() {
            let [a, b] = hinge.sides;
            (across[a as usize], across[b as usize]) = (b, a);
        }
        let Some(&first) = self.kept.first() else {
            return plane;
        };
        let first = self.innermost(&across).unwrap_or(first);
        let mut queue = VecDeque::from([3 * first]);
        seen[first as usize] = true;
        let [a, b, _] = self.triangles[first as usize];
        plane[b as usize] = [lengths[self.edges_of(first)[0]], 0.0];
        (placed[a as usize], placed[b as usize]) = (true, true);
        while let Some(side) = queue.pop_front() {
            let (triangle, k) = (side / 3, side % 3);
            let points = self.triangles[triangle as usize];
            let [a, b, c] = std::array::from_fn(|i| points[(k as usize + i) % 3] as usize);
            if !placed[c] {
                let edges = self.edges_of(triangle);
                let sides = std::array::from_fn(|i| lengths[edges[(k as usize + i) % 3]]);
                let [length, offset, height] = triangle_of_lengths(sides);
                let along = [0, 1].map(|axis| (plane[b][axis] - plane[a][axis]) / length);
                plane[c] = [
                    plane[a][0] + offset * along[0] - height * along[1],
                    plane[a][1] + offset * along[1] + height * along[0],
                ];
                placed[c] = true;
            }
            for next in [0, 1, 2].map(|i| across[(3 * triangle + i) as usize]) {
                let there = next / 3;
                let left = !self.triangles[there as usize].contains(&self.pole);
                if left && !std::mem::replace(&mut seen[there as usize], true) {
                    queue.push_back(next);
                }
            }
        }
        plane
    }

    /// The triangle last reached by a walk over triangles from those around the pole.
    fn innermost(&self, across: &[u32]) -> Option<u32> {
        let around = |t: &u32| self.triangles[*t as usize].contains(&self.pole);
        let mut queue: VecDeque<u32> = (0..self.triangles.len() as u32).filter(around).collect();
        let mut seen = vec![false; self.triangles.len()];
        queue.iter().for_each(|&t| seen[t as usize] = true);
        let mut last = None;
        while let Some(triangle) = queue.pop_front() {
            last = Some(triangle);
            for side in 3 * triangle..3 * triangle + 3 {
                let next = across[side as usize] / 3;
                if !std::mem::replace(&mut seen[next as usize], true) {
                    queue.push_back(next);
                }
            }
        }
        last
    }
}

struct Angles {
    defects: Vec<f64>,
    corners: Vec<[f64; 3]>,
    /// The first triangle without an interior.
    broken: Option<u32>,
}

fn norm(defects: &[f64]) -> f64 {
    defects.iter().map(|d| d * d).sum()
}

/// Angles at corners 0, 1, 2 from the sides 01, 12, 20; a broken triangle has pi opposite its longest side
/// (the extension that keeps the energy convex).
fn corner_angles(sides: [f64; 3]) -> [f64; 3] {
    let [length, offset, height] = triangle_of_lengths(sides);
    let first = libm::atan2(height, offset);
    let second = libm::atan2(height, length - offset);
    [first, second, PI - first - second]
}

/// The plane to the unit sphere from its north pole, turned over: what is counter-clockwise in the plane is
/// so seen from outside.
fn lifted([x, y]: [f64; 2]) -> Vector3<f64> {
    let square = x * x + y * y;
    Vector3::new(2.0 * x, -2.0 * y, square - 1.0) / (square + 1.0)
}

/// Moves the mean of points on the unit sphere to the centre by Moebius transformations: hyperbolic
/// translations that take the mean to the origin, over and over.
fn centre(points: &mut [Vector3<f64>]) {
    for _ in 0..2000 {
        let mean = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
        if mean.norm() < CENTRED {
            return;
        }
        // the inversion in the sphere about c = -a/|a|^2 scaled, written for points of the unit sphere
        let square = mean.norm_squared();
        for point in points.iter_mut() {
            let away = *point - mean;
            let moved = away * ((1.0 - square) / away.norm_squared()) - mean;
            *point = moved.normalize();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A closed mesh of genus 0: an octahedron divided, each vertex at a bumpy radius.
    fn bumpy(divisions: usize, bump: f64) -> (Topology, Vec<f64>) {
        let mut points: Vec<Vector3<f64>> = [
            [1., 0., 0.],
            [-1., 0., 0.],
            [0., 1., 0.],
            [0., -1., 0.],
            [0., 0., 1.],
            [0., 0., -1.],
        ]
        .map(Vector3::from)
        .to_vec();
        let mut triangles = vec![
            [0, 2, 4],
            [2, 1, 4],
            [1, 3, 4],
            [3, 0, 4],
            [2, 0, 5],
            [1, 2, 5],
            [3, 1, 5],
            [0, 3, 5],
        ];
        for _ in 0..divisions {
            let mut middles = std::collections::BTreeMap::new();
            let mut next = Vec::new();
            for [a, b, c] in triangles {
                let mut middle = |i: u32, j: u32| {
                    *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                        points.push((points[i as usize] + points[j as usize]).normalize());
                        points.len() as u32 - 1
                    })
                };
                let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
                next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            triangles = next;
        }
        let radius =
            |p: &Vector3<f64>| 1.0 + bump * ((3.0 * p.x + 1.0).sin() + (2.0 * p.y).cos() * p.z);
        let pose = points
            .iter()
            .flat_map(|p| (p * radius(p)).data.0[0])
            .collect();
        (
            Topology::from_triangles(points.len(), &triangles).unwrap(),
            pose,
        )
    }

    fn edges(topology: &Topology) -> Vec<[u32; 2]> {
        let corners = VertexCorners::new(topology.vertices(), topology.triangles());
        Hinges::new(topology.vertices(), topology.triangles(), &corners)
            .edges()
            .to_vec()
    }

    fn lengths(edges: &[[u32; 2]], pose: &[f64]) -> Vec<f64> {
        let point = |v: u32| Vector3::from_column_slice(&pose[3 * v as usize..][..3]);
        edges
            .iter()
            .map(|&[a, b]| (point(b) - point(a)).norm())
            .collect()
    }

    #[test]
    fn factors_between_equivalent_metrics_are_found() {
        let (topology, pose) = bumpy(2, 0.1);
        let edges = edges(&topology);
        let a = lengths(&edges, &pose);
        let wanted: Vec<f64> = (0..topology.vertices())
            .map(|v| (1.7 * v as f64).sin())
            .collect();
        let b = scaled(&edges, &a, &wanted, 1.0);
        let found = factors(topology.vertices(), &edges, &a, &b).unwrap();
        // the regularisation of 1e-12 is relative to diagonals of order one
        assert!(found.residual < 1e-10);
        assert!(
            found
                .factors
                .iter()
                .zip(&wanted)
                .all(|(a, b)| (a - b).abs() < 1e-8)
        );
        let halfway = scaled(&edges, &a, &wanted, 0.5);
        assert!(
            halfway
                .iter()
                .zip(a.iter().zip(&b))
                .all(|(h, (a, b))| (h * h - a * b).abs() < 1e-12)
        );
        // two shapes are not equivalent in general
        let other = lengths(&edges, &bumpy(2, 0.3).1);
        assert!(
            factors(topology.vertices(), &edges, &a, &other)
                .unwrap()
                .residual
                > 1e-3
        );
    }

    #[test]
    fn a_closed_mesh_is_equivalent_to_one_in_the_sphere() {
        for (divisions, bump) in [(1, 0.3), (3, 0.25), (4, 0.15)] {
            let (topology, pose) = bumpy(divisions, bump);
            let edges = edges(&topology);
            let a = lengths(&edges, &pose);
            let round = sphere(&topology, &a).unwrap();
            for point in round.chunks_exact(3) {
                assert!((Vector3::from_column_slice(point).norm() - 1.0).abs() < 1e-12);
            }
            let mean = crate::mesh::rigid_align::mean(&round);
            assert!(mean.norm() < 1e-9);
            let found = factors(topology.vertices(), &edges, &a, &lengths(&edges, &round)).unwrap();
            // angle sums are right to 1e-10; the layout adds them up over the mesh
            assert!(found.residual < 1e-7, "{}", found.residual);
            // seen from outside as before
            let volume: f64 = topology
                .triangles()
                .iter()
                .map(|t| {
                    let [a, b, c] =
                        t.map(|v| Vector3::from_column_slice(&round[3 * v as usize..][..3]));
                    a.cross(&b).dot(&c)
                })
                .sum();
            assert!(volume > 0.0);
        }
    }

    #[test]
    fn the_sphere_is_its_own_map_up_to_moebius_transformations() {
        let (topology, pose) = bumpy(3, 0.0);
        let edges = edges(&topology);
        let a = lengths(&edges, &pose);
        let found = lengths(&edges, &sphere(&topology, &a).unwrap());
        // the octahedron's symmetry leaves the mean at the centre only for the identity
        assert!(a.iter().zip(&found).all(|(a, b)| (a - b).abs() < 1e-6));
    }

    #[test]
    fn other_surfaces_are_refused() {
        let open = Topology::from_triangles(4, &[[0, 1, 2], [0, 2, 3]]).unwrap();
        let error = sphere(&open, &[1.0; 5]).unwrap_err();
        assert_eq!(error, ConformalError::NotASphere { counts: [4, 5, 2] });
        assert!(
            error
                .to_string()
                .contains("4 vertices, 5 edges and 2 triangles")
        );
    }
}
