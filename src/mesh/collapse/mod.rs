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

mod cost;
mod quadric;
mod queue;
mod surface;
#[cfg(test)]
mod tests;

use std::fmt;

use super::VertexCorners;
use surface::Mesh;

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
