//! Edge-length interpolation (Rojas et al. 2014): a mesh as the vector of its edge lengths, and meshes
//! from such vectors.
//!
//! Lengths interpolate linearly; what lengths do not tell (which of several embeddings, which of a mesh
//! and its mirror image, where in space) comes from a guess of the dihedral angles and a guide pose.
//! An [`Embedding`] is made once for a connectivity; [`Embedding::embed`] then
//!
//! 1. changes the dihedral angles until the walks around all inner vertices close (equation 3);
//! 2. turns the frames of all vertices into one space and places the vertices (§2.2);
//! 3. moves the vertices until the lengths themselves are met as well as can be;
//! 4. reflects parts that came out as their mirror image, and lays each part on the guide.
//!
//! Edges are those of the triangles: the diagonals that cut polygons are edges too.
//!
//! Degenerate input: a triangle without area has corner angles 0 and pi; at an edge of no length the
//! dihedral angle stays as guessed. Vertices on borders and where more than two triangles meet at an edge
//! have no equation (1); triangles that name a vertex twice take part with their lengths only. Vertices
//! without a triangle are placed as in the guide.

mod both_ways;
mod closing;
mod damping;
mod evening;
mod fans;
mod finishing;
mod guard;
mod keys;
mod placing;
mod report;
mod sequence;
mod shape;
mod walk;

#[cfg(test)]
mod tests;

use std::fmt;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use closing::Closer;
use fans::Fans;
use finishing::{Finisher, Wanted};
use placing::Placer;
use shape::point;

use crate::math::block_sparse::BlockPattern;
use crate::math::rotation::from_matrix;
use crate::math::sparse::{Factor, SparseError};
use crate::mesh::rigid_align::rigid;
use crate::mesh::{Components, Hinges, Topology, VertexCorners};

pub use guard::{Mending, Repair};
pub use keys::{Blend, KeyShapes, Strain};
pub use report::{EdgeFit, EmbedReport, Missed, PERCENTILES};
pub use sequence::{Morph, Options, SequenceError, morph};

/// Why lengths have no embedding. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EmbedError {
    /// Three lengths make no triangle.
    Triangle {
        /// The triangle, an index into [`Topology::triangles`].
        triangle: usize,
        /// The lengths of its sides 01, 12, 20.
        sides: [f64; 3],
    },
}

impl fmt::Display for EmbedError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            EmbedError::Triangle { triangle, sides } => {
                let [a, b, c] = sides;
                let triangle = triangle + 1;
                write!(
                    f,
                    "triangle {triangle} cannot have sides {a:.4}, {b:.4}, {c:.4}"
                )
            }
        }
    }
}

impl std::error::Error for EmbedError {}

/// What to embed.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// E lengths, in the order of [`Embedding::edges`].
    pub lengths: Vec<f64>,
    /// A guess of the dihedral angle of each hinge, radians ([`Embedding::dihedrals`]).
    pub dihedrals: Vec<f64>,
    /// A pose of 3V positions that each part of the result is laid on by a rigid motion.
    pub guide: Vec<f64>,
}

/// A mesh that was embedded.
#[derive(Debug, Clone, PartialEq)]
pub struct Embedded {
    /// 3V positions.
    pub positions: Vec<f64>,
    /// The dihedral angles of these positions, each on the branch nearest the guess: a start for the
    /// next frame.
    pub dihedrals: Vec<f64>,
    /// How well it went.
    pub report: EmbedReport,
}

/// Working memory of a sequence of embeddings, kept from frame to frame. It never changes a result.
#[derive(Debug, Default)]
pub struct Memory {
    closing: Option<Factor>,
    finishing: Option<Factor>,
}

/// Everything about a connectivity that does not depend on lengths: walks, patterns, symbolic factors, and
/// the two factored systems that find frames and positions.
#[derive(Debug)]
pub struct Embedding {
    triangles: Vec<[u32; 3]>,
    vertices: usize,
    hinges: Hinges,
    fans: Fans,
    parts: Components,
    closer: Closer,
    placer: Placer,
    finisher: Finisher,
}

impl Embedding {
    /// Prepares a connectivity.
    ///
    /// # Errors
    /// The factors would be too large.
    pub fn new(topology: &Topology) -> Result<Self, SparseError> {
        let (vertices, triangles) = (topology.vertices(), topology.triangles());
        let corners = VertexCorners::new(vertices, triangles);
        let hinges = Hinges::new(vertices, triangles, &corners);
        let fans = Fans::new(triangles, &corners, &hinges);
        let finishing = BlockPattern::new(vertices, hinges.edges())?;
        let links = closing::links(&fans);
        let alike =
            fans.fans.len() == vertices && (0..vertices).all(|v| fans.fans[v].vertex as usize == v);
        let shared = if alike {
            finishing.with_links(&links)
        } else {
            None
        };
        let closing = match shared {
            Some(pattern) => pattern,
            None => BlockPattern::new(fans.fans.len(), &links)?,
        };
        Ok(Embedding {
            closer: Closer::new(&fans, closing),
            placer: Placer::new(vertices, triangles, &hinges, &fans)?,
            finisher: Finisher::new(finishing),
            parts: Components::new(vertices, triangles),
            triangles: triangles.to_vec(),
            vertices,
            hinges,
            fans,
        })
    }

    /// V, the number of vertices.
    pub fn vertices(&self) -> usize {
        self.vertices
    }

    /// The two vertices of each edge, the smaller first; lengths stand in this order.
    pub fn edges(&self) -> &[[u32; 2]] {
        self.hinges.edges()
    }

    /// The pairs of triangles at edges; dihedral angles stand in this order.
    pub fn hinges(&self) -> &Hinges {
        &self.hinges
    }

    /// How many vertices have a closed walk: none on a mesh without inner vertices, whose dihedral angles
    /// lengths say nothing about.
    pub fn walks(&self) -> usize {
        self.fans.closed()
    }

    /// The lengths of a pose of 3V positions.
    ///
    /// # Panics
    /// The pose is not 3V long.
    pub fn lengths(&self, pose: &[f64]) -> Vec<f64> {
        assert_eq!(pose.len(), 3 * self.vertices, "pose of another mesh");
        shape::lengths(self.edges(), pose)
    }

    /// The dihedral angle of each hinge of a pose in (-pi, pi]: 0 where its triangles lie in one plane,
    /// positive where they are convex seen from the side the first faces. 0 where one has no plane.
    ///
    /// # Panics
    /// The pose is not 3V long.
    pub fn dihedrals(&self, pose: &[f64]) -> Vec<f64> {
        assert_eq!(pose.len(), 3 * self.vertices, "pose of another mesh");
        shape::dihedrals(&self.triangles, &self.hinges, pose)
    }

    /// E(A) of equation (3): how far the walks are from closing, for lengths and dihedral angles that need
    /// not belong to one shape.
    pub fn energy(&self, lengths: &[f64], dihedrals: &[f64]) -> f64 {
        let corners = walk::corner_halves(&shape::corner_angles(&self.hinges, lengths));
        self.fans.errors(&corners, dihedrals).energy()
    }

    /// The first triangle, from 0, whose sides break its inequality or are no lengths at all.
    ///
    /// # Panics
    /// There is not a length for each edge.
    pub fn broken_triangle(&self, lengths: &[f64]) -> Option<usize> {
        shape::broken_triangle(&self.hinges, lengths).map(|(triangle, _)| triangle)
    }

    /// A shape with these lengths, or whose lengths come nearest them.
    ///
    /// # Errors
    /// The sides of a triangle break its inequality.
    ///
    /// # Panics
    /// The target is of another connectivity.
    pub fn embed(&self, target: &Target, memory: &mut Memory) -> Result<Embedded, EmbedError> {
        let Target {
            lengths,
            dihedrals,
            guide,
        } = target;
        assert_eq!(lengths.len(), self.edges().len(), "lengths of another mesh");
        assert_eq!(
            dihedrals.len(),
            self.hinges.hinges().len(),
            "angles of another mesh"
        );
        assert_eq!(guide.len(), 3 * self.vertices, "guide of another mesh");
        if let Some((triangle, sides)) = shape::broken_triangle(&self.hinges, lengths) {
            return Err(EmbedError::Triangle { triangle, sides });
        }
        let corners = shape::corner_angles(&self.hinges, lengths);
        let mut angles = dihedrals.clone();
        let closed = self
            .closer
            .close(&self.fans, &corners, &mut angles, &mut memory.closing);
        let oriented = |corner| self.corner_frame(corner, guide);
        let mut positions = self
            .placer
            .place(&self.fans, &corners, &angles, lengths, &oriented);
        let kept = &mut memory.finishing;
        let wanted = Wanted {
            edges: self.edges(),
            lengths,
            spring: None,
        };
        let finished = self.finisher.finish(&wanted, &mut positions, kept);
        let mirrored = self.reflect_mirrored(dihedrals, &mut positions);
        self.lay_on(guide, &mut positions);
        Ok(Embedded {
            dihedrals: near_branch(self.dihedrals(&positions), dihedrals),
            report: EmbedReport {
                residual_before: closed.before,
                residual: closed.after,
                walks: self.walks(),
                steps: [closed.steps, finished],
                edges: EdgeFit::new(lengths, &self.lengths(&positions)),
                impossible: self.impossible(&corners),
                mirrored,
            },
            positions,
        })
    }

    /// The height over a hinge's edge of the lower of its two triangles.
    fn lever(&self, hinge: usize, lengths: &[f64]) -> f64 {
        let sides = self.hinges.hinges()[hinge].sides;
        let heights = sides.map(|side| shape::height(&self.hinges, lengths, side));
        heights[0].min(heights[1])
    }

    /// A pose as it is, as if it had been embedded.
    fn known(&self, keys: &KeyShapes, pose: usize) -> Embedded {
        let (lengths, dihedrals) = (keys.lengths(pose), keys.dihedrals(pose));
        let energy = self.energy(lengths, dihedrals);
        Embedded {
            positions: keys.pose(pose).to_vec(),
            dihedrals: dihedrals.to_vec(),
            report: EmbedReport {
                residual_before: energy,
                residual: energy,
                walks: self.walks(),
                steps: [0, 0],
                edges: EdgeFit::new(lengths, lengths),
                impossible: Vec::new(),
                mirrored: 0,
            },
        }
    }

    /// The frame of a corner in a pose: x along the side to the next corner, z the triangle's normal.
    fn corner_frame(&self, corner: u32, pose: &[f64]) -> UnitQuaternion<f64> {
        let at = |k: u32| {
            let vertex = self.triangles[corner as usize / 3][(corner + k) as usize % 3];
            point(pose, vertex)
        };
        let (x, wing) = (at(1) - at(0), at(2) - at(0));
        let normal = x.cross(&wing);
        if x.norm() * normal.norm() <= 0.0 {
            return UnitQuaternion::identity();
        }
        let (x, z) = (x.normalize(), normal.normalize());
        from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z]))
    }

    /// Reflects each part whose dihedral angles are nearer the negated guess; gives their number.
    fn reflect_mirrored(&self, guess: &[f64], positions: &mut [f64]) -> usize {
        let found = self.dihedrals(positions);
        let mut agreement = vec![0.0; self.parts.count()];
        for ((hinge, found), guess) in self.hinges.hinges().iter().zip(&found).zip(guess) {
            let [a, _] = self.edges()[hinge.edge as usize];
            let part = self.parts.part()[a as usize] as usize;
            agreement[part] += libm::sin(0.5 * found) * libm::sin(0.5 * guess);
        }
        for (place, &part) in positions.chunks_exact_mut(3).zip(self.parts.part()) {
            if agreement[part as usize] < 0.0 {
                place[0] = -place[0];
            }
        }
        agreement.iter().filter(|&&sum| sum < 0.0).count()
    }

    /// Moves each part rigidly to where it lies nearest the guide.
    fn lay_on(&self, guide: &[f64], positions: &mut [f64]) {
        for members in self.members() {
            let gather = |from: &[f64]| -> Vec<f64> {
                let each = members.iter().flat_map(|&v| point(from, v).data.0[0]);
                each.collect()
            };
            let motion = rigid(&gather(positions), &gather(guide));
            for &vertex in &members {
                let moved: Vector3<f64> =
                    motion.rotation * point(positions, vertex) + motion.translation.vector;
                let at = 3 * vertex as usize;
                positions[at..at + 3].copy_from_slice(moved.as_slice());
            }
        }
    }

    /// The vertices of each part.
    fn members(&self) -> Vec<Vec<u32>> {
        let mut members = vec![Vec::new(); self.parts.count()];
        for (vertex, &part) in self.parts.part().iter().enumerate() {
            members[part as usize].push(vertex as u32);
        }
        members
    }

    /// Vertices around which corner angles cannot close, the worst first.
    fn impossible(&self, corners: &[f64]) -> Vec<(usize, f64)> {
        let closed = self.fans.fans.iter().filter(|fan| fan.closed);
        let mut found: Vec<(usize, f64)> = closed
            .map(|fan| {
                (
                    fan.vertex as usize,
                    shape::missing(&self.fans, fan, corners),
                )
            })
            .filter(|(_, missing)| *missing > 1e-9)
            .collect();
        found.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        found
    }
}

/// Angles moved by whole turns to within a half turn of `near`.
fn near_branch(mut angles: Vec<f64>, near: &[f64]) -> Vec<f64> {
    for (angle, near) in angles.iter_mut().zip(near) {
        *angle -= std::f64::consts::TAU * libm::round((*angle - near) / std::f64::consts::TAU);
    }
    angles
}

/// A difference of angles within a half turn.
fn wrapped(angle: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    angle - turn * libm::round(angle / turn)
}
