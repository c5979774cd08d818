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

mod disk;
mod sphere;

#[cfg(test)]
mod tests;

use std::fmt;

use crate::math::sparse::{Analysis, Pattern, SparseError};

pub use sphere::sphere;

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
