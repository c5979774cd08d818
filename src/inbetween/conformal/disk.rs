//! A closed mesh without one vertex, flattened: Newton's method on the convex energy of Springborn,
//! Schroeder & Pinkall 2008 (§3), and the plane that the flat triangles make.

use std::collections::VecDeque;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use super::{ConformalError, scaled};
use crate::math::sparse::{Analysis, Factor, Pattern};
use crate::mesh::Hinges;
use crate::mesh::dihedral::triangle_of_lengths;

/// Newton steps at most; ten are usual.
const STEPS: usize = 100;

/// Angle sums are right to this many radians; rounding stops some meshes short of it, but not above
/// a hundred times as much.
const FLAT: f64 = 1e-12;
const NEARLY_FLAT: f64 = 1e-10;

/// A step is halved at most so often.
const HALVINGS: usize = 40;

/// What is added to the Hessian's diagonal: least, and most before the iteration gives up.
const DAMPING: [f64; 2] = [1e-12, 1e2];

/// The mesh without one vertex and its triangles.
pub(super) struct Disk<'a> {
    triangles: &'a [[u32; 3]],
    hinges: &'a Hinges,
    /// Which triangles are left.
    kept: Vec<u32>,
    /// Vertices whose angle sum is prescribed: neither the pole nor next to it.
    inner: Vec<bool>,
    pole: u32,
}

impl<'a> Disk<'a> {
    pub(super) fn new(
        triangles: &'a [[u32; 3]],
        hinges: &'a Hinges,
        pole: u32,
        vertices: usize,
    ) -> Self {
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
    ///
    /// The energy's gradient is half the angle defects. It is convex on all of R^V where a broken triangle
    /// has the angles pi, 0, 0, so the iteration may pass through broken triangles; a minimum with one
    /// means that this triangulation has no flat metric.
    pub(super) fn flatten(&self, lengths: &[f64]) -> Result<Vec<f64>, ConformalError> {
        let edges = self.hinges.edges();
        let mut factors = self.around_the_pole(lengths);
        let analysis = Analysis::new(Pattern::new(self.inner.len(), edges.iter().copied()))?;
        let mut factor: Option<Factor> = None;
        let mut state = self.angles(&scaled(edges, lengths, &factors, 1.0));
        let mut damping = DAMPING[0];
        for _ in 0..STEPS {
            if state.largest() < FLAT || damping > DAMPING[1] {
                break;
            }
            let step = self.step(&analysis, &state, damping, &mut factor)?;
            match self.searched(lengths, &factors, &state, &step) {
                Some((moved, found)) => {
                    (factors, state) = (moved, found);
                    damping = (damping * 0.1).max(DAMPING[0]);
                }
                None if state.largest() < NEARLY_FLAT => break,
                None => damping *= 100.0,
            }
        }
        match (state.broken, state.largest()) {
            (Some(triangle), _) => Err(ConformalError::Degenerates {
                triangle: triangle as usize,
            }),
            (None, defect) if defect > NEARLY_FLAT => Err(ConformalError::NotConverged { defect }),
            (None, _) => Ok(scaled(edges, lengths, &factors, 1.0)),
        }
    }

    /// Factors that give all edges at the pole the mean length; 0 elsewhere.
    fn around_the_pole(&self, lengths: &[f64]) -> Vec<f64> {
        let mut factors = vec![0.0; self.inner.len()];
        let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
        for (&[i, j], &length) in self.hinges.edges().iter().zip(lengths) {
            if i == self.pole || j == self.pole {
                let other = if i == self.pole { j } else { i };
                factors[other as usize] = -2.0 * libm::log(length / mean);
            }
        }
        factors
    }

    /// The Newton step.
    fn step(
        &self,
        analysis: &Arc<Analysis>,
        state: &Angles,
        damping: f64,
        kept: &mut Option<Factor>,
    ) -> Result<Vec<f64>, ConformalError> {
        let entries = self.hessian(analysis, state, damping);
        let mut step = state.defects.clone();
        match kept {
            Some(factor) => factor.refactor(&entries)?,
            None => *kept = Some(analysis.factor(&entries)?),
        }
        if let Some(factor) = kept {
            factor.solve(1, &mut step);
        }
        Ok(step)
    }

    /// The first of the whole step, its half, .. that does not pass the least energy along it, or that makes
    /// the defects smaller; none where rounding leaves no such.
    fn searched(
        &self,
        lengths: &[f64],
        factors: &[f64],
        state: &Angles,
        step: &[f64],
    ) -> Option<(Vec<f64>, Angles)> {
        let size = |defects: &[f64]| dot(defects, defects);
        (0..HALVINGS).find_map(|halvings| {
            let part = 0.5_f64.powi(halvings as i32);
            let moved: Vec<f64> = factors
                .iter()
                .zip(step)
                .map(|(u, d)| u - part * d)
                .collect();
            let found = self.angles(&scaled(self.hinges.edges(), lengths, &moved, 1.0));
            let short = dot(&found.defects, step) > 0.0 && found.largest() > FLAT;
            (size(&found.defects) < size(&state.defects) || short).then_some((moved, found))
        })
    }

    /// The angle defects of inner vertices and the angles of the triangles that are left.
    fn angles(&self, lengths: &[f64]) -> Angles {
        let prescribed = self.inner.iter().map(|&i| if i { TAU } else { 0.0 });
        let mut defects: Vec<f64> = prescribed.collect();
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

    /// The derivative of the angle defects: half the cotangent Laplacian, vertices that are held apart.
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
            let angles = state.corners[triangle as usize];
            // a broken triangle's angles do not change
            if angles
                .iter()
                .any(|angle| !(1e-9..PI - 1e-9).contains(angle))
            {
                continue;
            }
            for k in 0..3 {
                // the edge opposite corner k; its angle changes the sums at both ends
                let (sine, cosine) = libm::sincos(angles[k]);
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
            let own = if inner { damping } else { 1.0 };
            add(vertex as u32, vertex as u32, own);
        }
        entries
    }

    /// Positions in the plane of a flat metric, triangle after triangle from the one farthest inside.
    ///
    /// Headings of sides are added up from corner angles, not read off the points placed so far: rounding
    /// of a short side's ends turns all that is built on it, and over a hundred rings of triangles that grew
    /// from 1e-16 to more than the sides themselves.
    pub(super) fn lay_out(&self, lengths: &[f64]) -> Vec<[f64; 2]> {
        let mut plane = vec![[0.0; 2]; self.inner.len()];
        let across = self.across();
        let Some(&any) = self.kept.first() else {
            return plane;
        };
        let first = self.innermost(&across).unwrap_or(any);
        let mut placed = vec![false; self.inner.len()];
        let mut seen = vec![false; self.triangles.len()];
        placed[self.triangles[first as usize][0] as usize] = true;
        seen[first as usize] = true;
        // a side whose first corner is placed, and its heading
        let mut queue = VecDeque::from([(3 * first, 0.0)]);
        while let Some((begin, heading)) = queue.pop_front() {
            let triangle = begin / 3;
            let edges = self.edges_of(triangle);
            let angles = corner_angles(edges.map(|edge| lengths[edge]));
            let (mut k, mut heading) = (begin as usize % 3, heading);
            for _ in 0..3 {
                let points = self.triangles[triangle as usize];
                let [a, b] = [k, (k + 1) % 3].map(|corner| points[corner] as usize);
                if !std::mem::replace(&mut placed[b], true) {
                    let (sine, cosine) = libm::sincos(heading);
                    let length = lengths[edges[k]];
                    plane[b] = [plane[a][0] + length * cosine, plane[a][1] + length * sine];
                }
                let next = across[3 * triangle as usize + k];
                let there = next / 3;
                let left = !self.triangles[there as usize].contains(&self.pole);
                if left && !std::mem::replace(&mut seen[there as usize], true) {
                    queue.push_back((next, heading + PI));
                }
                k = (k + 1) % 3;
                heading += PI - angles[k];
            }
        }
        plane
    }

    /// For each side of a triangle the side of the other triangle there.
    fn across(&self) -> Vec<u32> {
        let mut across = vec![0; 3 * self.triangles.len()];
        for hinge in self.hinges.hinges() {
            let [a, b] = hinge.sides;
            (across[a as usize], across[b as usize]) = (b, a);
        }
        across
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

/// Angles under a metric.
struct Angles {
    defects: Vec<f64>,
    corners: Vec<[f64; 3]>,
    /// The first triangle without an interior.
    broken: Option<u32>,
}

impl Angles {
    fn largest(&self) -> f64 {
        self.defects.iter().fold(0.0, |most, d| most.max(d.abs()))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Angles at corners 0, 1, 2 from the sides 01, 12, 20; a broken triangle has pi opposite its longest side
/// (the extension that keeps the energy convex).
fn corner_angles(sides: [f64; 3]) -> [f64; 3] {
    let [length, offset, height] = triangle_of_lengths(sides);
    let first = libm::atan2(height, offset);
    let second = libm::atan2(height, length - offset);
    [first, second, PI - first - second]
}
