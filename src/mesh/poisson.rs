//! Positions from gradients: the Poisson system of a mesh (Botsch et al. 2006; X19 §4.2).
//!
//! Minimises sum_f a_f |grad v - D_f|^2 over vertex positions v, where a_f is the area of triangle f in
//! the reference pose. The V x V matrix is the cotangent Laplacian of the reference; it does not depend
//! on the gradients, so it is factored once and x, y, z are solved for together.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::Vector3;
use rayon::prelude::*;

use super::{Components, ReferenceTriangle, VertexCorners};
use crate::math::sparse::{Analysis, Factor, Pattern, SparseError};

/// Triangles or vertices that one thread takes at a time.
const CHUNK: usize = 2048;

/// The connectivity of a Poisson system with its symbolic factor: shared by all reference poses.
#[derive(Debug)]
pub struct PoissonAnalysis {
    triangles: Vec<[u32; 3]>,
    corners: VertexCorners,
    components: Components,
    symbolic: Arc<Analysis>,
}

impl PoissonAnalysis {
    /// Analyses `triangles` over vertices 0..`vertices`.
    ///
    /// # Errors
    /// The factor would be too large.
    pub fn new(vertices: usize, triangles: &[[u32; 3]]) -> Result<Arc<Self>, SparseError> {
        let sides = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
        let (symbolic, (corners, components)) = rayon::join(
            || Analysis::new(Pattern::new(vertices, sides)),
            || {
                let corners = VertexCorners::new(vertices, triangles);
                (corners, Components::new(vertices, triangles))
            },
        );
        Ok(Arc::new(PoissonAnalysis {
            triangles: triangles.to_vec(),
            corners,
            components,
            symbolic: symbolic?,
        }))
    }

    /// The connected parts; each has one translation that gradients do not determine.
    pub fn components(&self) -> &Components {
        &self.components
    }

    /// The pattern of the vertices that share a triangle, analysed.
    pub fn symbolic(&self) -> &Arc<Analysis> {
        &self.symbolic
    }

    /// V, the number of vertices.
    pub fn vertices(&self) -> usize {
        self.symbolic.pattern().unknowns()
    }

    /// The triangles.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// The corners at each vertex.
    pub fn corners(&self) -> &VertexCorners {
        &self.corners
    }
}

/// The factored system of one reference pose.
pub struct Poisson {
    analysis: Arc<PoissonAnalysis>,
    reference: Arc<[ReferenceTriangle]>,
    factor: Factor,
    /// By what each triangle counts beside its area; empty where all count fully.
    weights: Vec<f64>,
    /// How strongly each vertex is drawn to its place; empty where none is.
    springs: Vec<f64>,
    pool: Mutex<Vec<Workspace>>,
}

#[derive(Default)]
struct Workspace {
    pulls: Vec<[Vector3<f64>; 2]>,
    sides: Vec<f64>,
}

impl Poisson {
    /// Factors the system for the triangles of a reference pose ([`reference_triangles`]).
    ///
    /// # Errors
    /// The pose has numbers that are not finite, or a size that double precision does not hold; the
    /// unknown is then a vertex.
    pub fn new(
        analysis: Arc<PoissonAnalysis>,
        reference: Arc<[ReferenceTriangle]>,
    ) -> Result<Self, SparseError> {
        Poisson::with(analysis, reference, Vec::new(), Vec::new())
    }

    /// The system in which each triangle counts by one of `weights` (> 0) beside its area; without weights
    /// that of [`Poisson::new`].
    ///
    /// # Errors
    /// As [`Poisson::new`].
    ///
    /// # Panics
    /// There are weights, but not one a triangle.
    pub fn weighted(
        analysis: Arc<PoissonAnalysis>,
        reference: Arc<[ReferenceTriangle]>,
        weights: Vec<f64>,
    ) -> Result<Self, SparseError> {
        Poisson::with(analysis, reference, weights, Vec::new())
    }

    /// The screened system: places are given too, and count beside gradients over lengths above
    /// `screening` (in the mesh's unit, > 0). Minimises sum_f a_f |grad v - D_f|^2 + sum_i m_i |v_i - p_i|^2
    /// / screening^2 with a third m_i of the area around each vertex; areas count by `weights` as in
    /// [`Poisson::weighted`].
    ///
    /// # Errors
    /// As [`Poisson::new`].
    ///
    /// # Panics
    /// As [`Poisson::weighted`].
    pub fn screened(
        analysis: Arc<PoissonAnalysis>,
        reference: Arc<[ReferenceTriangle]>,
        weights: Vec<f64>,
        screening: f64,
    ) -> Result<Self, SparseError> {
        let mut springs = vec![0.0; analysis.symbolic.pattern().unknowns()];
        for (face, triangle) in analysis.triangles.iter().enumerate() {
            let area = reference[face].area() * weight(&weights, face);
            for &vertex in triangle {
                springs[vertex as usize] += area / (3.0 * screening * screening);
            }
        }
        // no part is without a hold, however small it is
        for &vertex in analysis.components.first() {
            springs[vertex as usize] += 1.0;
        }
        Poisson::with(analysis, reference, weights, springs)
    }

    fn with(
        analysis: Arc<PoissonAnalysis>,
        reference: Arc<[ReferenceTriangle]>,
        weights: Vec<f64>,
        springs: Vec<f64>,
    ) -> Result<Self, SparseError> {
        assert!(
            weights.is_empty() || weights.len() == reference.len(),
            "one weight a triangle"
        );
        let entries = laplacian(&analysis, (&reference, &weights), &springs);
        let factor = analysis.symbolic.factor(&entries)?;
        Ok(Poisson {
            analysis,
            reference,
            factor,
            weights,
            springs,
            pool: Mutex::default(),
        })
    }

    /// The connectivity.
    pub fn analysis(&self) -> &Arc<PoissonAnalysis> {
        &self.analysis
    }

    /// The triangles of the reference pose.
    pub fn reference(&self) -> &Arc<[ReferenceTriangle]> {
        &self.reference
    }

    /// The 3V positions whose gradients come nearest those given: `images` tells where the gradient of
    /// a triangle takes the two basis vectors of its reference plane. The first vertex of each connected
    /// part comes out at the origin; vertices without a triangle too. In a screened system `positions`
    /// holds the places p_i before.
    pub fn solve(&self, images: impl Fn(usize) -> [Vector3<f64>; 2] + Sync, positions: &mut [f64]) {
        let mut workspace = self.take();
        let Workspace { pulls, sides } = &mut workspace;
        pulls
            .par_chunks_mut(CHUNK)
            .enumerate()
            .for_each(|(chunk, pulls)| {
                for (at, pull) in pulls.iter_mut().enumerate() {
                    let face = CHUNK * chunk + at;
                    *pull = pulled(&self.reference[face], &images(face));
                    if !self.weights.is_empty() {
                        *pull = pull.map(|pull| pull * self.weights[face]);
                    }
                }
            });
        self.gather(pulls, sides);
        self.draw(positions, sides);
        self.factor.solve(3, sides);
        interleave(sides, positions);
        self.lock().push(workspace);
    }

    /// The right sides: what the triangles around each vertex pull at it.
    fn gather(&self, pulls: &[[Vector3<f64>; 2]], sides: &mut [f64]) {
        let n = self.factor.unknowns();
        let corners = &self.analysis.corners;
        let (x, rest) = sides.split_at_mut(n);
        let (y, z) = rest.split_at_mut(n);
        x.par_chunks_mut(CHUNK)
            .zip(y.par_chunks_mut(CHUNK))
            .zip(z.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((x, y), z))| {
                for at in 0..x.len() {
                    let mut sum = Vector3::zeros();
                    for &corner in corners.at(CHUNK * chunk + at) {
                        let [one, two] = &pulls[corner as usize / 3];
                        match corner % 3 {
                            0 => sum -= one + two,
                            1 => sum += one,
                            _ => sum += two,
                        }
                    }
                    (x[at], y[at], z[at]) = (sum.x, sum.y, sum.z);
                }
            });
    }

    /// Adds the pull of the places to the right sides.
    fn draw(&self, places: &[f64], sides: &mut [f64]) {
        let n = self.factor.unknowns();
        for (axis, side) in sides.chunks_exact_mut(n.max(1)).enumerate() {
            side.par_iter_mut()
                .zip(&self.springs)
                .zip(places.par_chunks_exact(3))
                .with_min_len(CHUNK)
                .for_each(|((side, spring), place)| *side += spring * place[axis]);
        }
    }

    fn take(&self) -> Workspace {
        self.lock().pop().unwrap_or_else(|| Workspace {
            pulls: vec![Default::default(); self.reference.len()],
            sides: vec![0.0; 3 * self.factor.unknowns()],
        })
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Workspace>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl std::fmt::Debug for Poisson {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Poisson")
            .field("factor", &self.factor)
            .finish()
    }
}

/// The triangles of a pose of 3V positions, those without a plane replaced on the scale of the mean
/// side.
pub fn reference_triangles(triangles: &[[u32; 3]], pose: &[f64]) -> Arc<[ReferenceTriangle]> {
    let corner = |vertex: u32| point(pose, vertex as usize);
    let total: f64 = triangles
        .iter()
        .map(|&[a, b, _]| (corner(b) - corner(a)).norm())
        .sum();
    let mean = match total > 0.0 {
        true => total / triangles.len() as f64,
        false => 1.0,
    };
    triangles
        .par_iter()
        .map(|triangle| ReferenceTriangle::new(triangle.map(corner), mean))
        .collect()
}

/// Position of `vertex` in a row of 3V coordinates.
fn point(positions: &[f64], vertex: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&positions[3 * vertex..3 * vertex + 3])
}

/// The entries of the Laplacian: sum over triangles of a (grad phi_i . grad phi_j); the first vertex of
/// each part is held by a spring of stiffness 1 (the entries have no unit), which no solution stretches,
/// unless there are `springs`. Columns are summed side by side, each over the corners at its vertex.
fn laplacian(
    analysis: &PoissonAnalysis,
    (reference, factors): (&[ReferenceTriangle], &[f64]),
    springs: &[f64],
) -> Vec<f64> {
    let pattern = analysis.symbolic.pattern();
    let mut entries = vec![0.0; pattern.entries()];
    let mut rest = &mut entries[..];
    let mut chunks = Vec::new();
    for first in (0..pattern.unknowns()).step_by(CHUNK) {
        let last = (first + CHUNK).min(pattern.unknowns());
        let length = (first..last).map(|column| pattern.rows(column).len()).sum();
        let (chunk, after) = rest.split_at_mut(length);
        chunks.push((first..last, chunk));
        rest = after;
    }
    chunks.into_par_iter().for_each(|(columns, mut entries)| {
        for vertex in columns {
            let rows = pattern.rows(vertex);
            let (column, after) = entries.split_at_mut(rows.len());
            for &corner in analysis.corners.at(vertex) {
                let (face, from) = (corner as usize / 3, corner as usize % 3);
                let factor = weight(factors, face);
                let weights = half_cotangents(&reference[face]).map(|half| half * factor);
                for to in [(from + 1) % 3, (from + 2) % 3] {
                    // sides 01, 12, 20: the one between two corners
                    let weight = weights[if (from + 1) % 3 == to { from } else { to }];
                    column[0] += weight;
                    // pairs stand below the diagonal; a vertex named twice meets itself
                    if let Ok(at) = rows.binary_search(&analysis.triangles[face][to]) {
                        column[at] -= weight;
                    }
                }
            }
            entries = after;
        }
    });
    let mut hold = |vertex: usize, spring: f64| {
        let diagonal = pattern.entry(vertex, vertex);
        diagonal.into_iter().for_each(|at| entries[at] += spring);
    };
    match springs {
        [] => {
            let first = analysis.components.first().iter();
            first.for_each(|&vertex| hold(vertex as usize, 1.0));
        }
        springs => {
            let all = springs.iter().enumerate();
            all.for_each(|(vertex, &spring)| hold(vertex, spring));
        }
    }
    entries
}

/// By what a triangle counts.
fn weight(weights: &[f64], face: usize) -> f64 {
    match weights {
        [] => 1.0,
        weights => weights[face],
    }
}

/// Half the cotangents of the angles opposite the sides 01, 12, 20.
fn half_cotangents(rest: &ReferenceTriangle) -> [f64; 3] {
    let (l, x, h) = (rest.length, rest.offset, rest.height);
    [
        0.5 * (h / l - x * (l - x) / (l * h)),
        0.5 * x / h,
        0.5 * (l - x) / h,
    ]
}

/// a D grad phi_1 and a D grad phi_2, for D b1 and D b2.
fn pulled(rest: &ReferenceTriangle, [d1, d2]: &[Vector3<f64>; 2]) -> [Vector3<f64>; 2] {
    [
        (d1 * rest.height - d2 * rest.offset) * 0.5,
        d2 * (0.5 * rest.length),
    ]
}

/// Three columns of V numbers as V points, in chunks side by side.
fn interleave(columns: &[f64], positions: &mut [f64]) {
    let n = columns.len() / 3;
    positions
        .par_chunks_mut(3 * CHUNK)
        .enumerate()
        .for_each(|(chunk, points)| {
            for (at, point) in points.chunks_exact_mut(3).enumerate() {
                let vertex = CHUNK * chunk + at;
                for axis in 0..3 {
                    point[axis] = columns[axis * n + vertex];
                }
            }
        });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn solve(triangles: &[[u32; 3]], pose: &[f64]) -> Vec<f64> {
        let analysis = PoissonAnalysis::new(pose.len() / 3, triangles).unwrap();
        let poisson = Poisson::new(analysis, reference_triangles(triangles, pose)).unwrap();
        let mut positions = vec![f64::NAN; pose.len()];
        poisson.solve(
            |face| {
                let rest = &poisson.reference()[face];
                let [a, b, c] = triangles[face].map(|v| point(pose, v as usize));
                rest.images(&(b - a), &(c - a))
            },
            &mut positions,
        );
        positions
    }

    #[test]
    fn the_gradients_of_a_pose_give_it_back_part_by_part() {
        // a tetrahedron, a loose triangle and a vertex without a triangle, in no plane of the axes
        let pose: Vec<f64> = [
            [0.1, 0.0, 0.0],
            [1.0, 0.2, 0.0],
            [0.0, 1.0, 0.3],
            [0.2, 0.1, 1.0],
            [5.0, 5.0, 5.0],
            [6.0, 5.0, 5.5],
            [5.0, 6.5, 5.0],
            [9.0, 9.0, 9.0],
        ]
        .concat();
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3], [4, 5, 6]];
        let found = solve(&triangles, &pose);
        for (vertex, first) in [0, 0, 0, 0, 4, 4, 4, 7].into_iter().enumerate() {
            let expected = point(&pose, vertex) - point(&pose, first);
            assert!((point(&found, vertex) - expected).norm() < 1e-13);
        }
    }

    #[test]
    fn a_screened_system_gives_a_pose_back_where_its_places_are_and_follows_them() {
        let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
        let pose = [
            0.1, 0.0, 0.0, 1.0, 0.2, 0.0, 0.0, 1.0, 0.3, 0.2, 0.1, 1.0, 9.0, 8.0, 7.0,
        ];
        let analysis = PoissonAnalysis::new(5, &triangles).unwrap();
        let reference = reference_triangles(&triangles, &pose);
        let poisson = Poisson::screened(analysis, reference, Vec::new(), 2.0).unwrap();
        let images = |face: usize| {
            let rest = &poisson.reference()[face];
            let [a, b, c] = triangles[face].map(|v: u32| point(&pose, v as usize));
            rest.images(&(b - a), &(c - a))
        };
        for shift in [0.0, 3.0, -1e6] {
            // the gradients do not know where the pose is
            let places: Vec<f64> = pose.iter().map(|x| x + shift).collect();
            let mut found = places.clone();
            poisson.solve(images, &mut found);
            let size = 1.0 + f64::abs(shift);
            assert!(
                found
                    .iter()
                    .zip(&places)
                    .all(|(a, b)| (a - b).abs() < 1e-13 * size)
            );
        }
    }

    #[test]
    fn degenerate_duplicate_and_repeated_corners_are_solved_with_the_rest() {
        let pose = [
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 2.0, 2.0, 2.0,
        ];
        // collinear; the same twice; a vertex named twice; a triangle of one vertex
        let triangles = [[0, 1, 2], [0, 1, 3], [0, 1, 3], [4, 4, 3], [1, 1, 1]];
        let found = solve(&triangles, &pose);
        assert!(found.iter().zip(&pose).all(|(a, b)| (a - b).abs() < 1e-12));
    }

    #[test]
    fn numbers_that_are_not_finite_are_refused_with_a_vertex() {
        let analysis = PoissonAnalysis::new(3, &[[0, 1, 2]]).unwrap();
        let pose = [0.0, 0.0, 0.0, 1.0, 0.0, f64::NAN, 0.0, 1.0, 0.0];
        assert!(matches!(
            Poisson::new(analysis, reference_triangles(&[[0, 1, 2]], &pose)),
            Err(SparseError::NotPositiveDefinite { unknown: 0..3 })
        ));
    }

    #[test]
    fn a_triangle_of_little_weight_gives_way_to_the_others() {
        // a square in two triangles, and a third beside it that wants to be elsewhere
        let triangles = [[0, 1, 2], [1, 3, 2], [1, 4, 3]];
        let pose = [
            0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 2.0, 0.5, 0.0,
        ];
        let off = |weights: Vec<f64>| {
            let analysis = PoissonAnalysis::new(5, &triangles).unwrap();
            let reference = reference_triangles(&triangles, &pose);
            let poisson = Poisson::weighted(analysis, reference, weights).unwrap();
            let mut found = vec![0.0; 15];
            let images = |face: usize| {
                let rest = &poisson.reference()[face];
                let grown = if face == 2 { 3.0 } else { 1.0 };
                [rest.along * grown, rest.across() * grown]
            };
            poisson.solve(images, &mut found);
            let square = found[..12].iter().zip(&pose);
            square.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        };
        let full = off(Vec::new());
        assert!(full > 0.1 && (off(vec![1.0; 3]) - full).abs() < 1e-14);
        assert!(off(vec![1.0, 1.0, 1e-6]) < 1e-5);
    }
}
