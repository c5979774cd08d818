//! Ghost meshes (X19 §4.3): splines and decoding run on a mesh of a few thousand triangles, the shapes of
//! the full mesh follow it.
//!
//! One sequence of half-edge collapses serves all keys ([`crate::mesh::collapse`]), so the ghost's
//! vertices are vertices of the mesh. How the ghost's triangles around each of its vertices have turned
//! and stretched since the first key (`turns`) is carried to the mesh (`carrier`): to its vertices
//! (`direct`) and, unless that is to be all, to its triangles, whose gradients are then integrated
//! (`gradients`, deformation transfer). What is missing at the keys is kept in the carried frames and
//! blended by the spline's cardinal weights, so keys are reproduced.
//!
//! A ghost in `patch-lri` has the patches of its mesh ([`crate::space::CoarsePatchLri`]). With patches of
//! its own it takes other ways between keys than the mesh, however many triangles it has (a galloping
//! horse of 74 240: 6 % off at any size, at some 11 %).

mod carrier;
mod direct;
mod gradients;
mod residual;
mod turns;

use std::collections::HashMap;
use std::sync::Arc;

use nalgebra::Vector3;
use serde::Serialize;

use super::keys::Keys;
use crate::diag::{Diagnostic, Result, Warned};
use crate::math::key_spline::{Controls, KeySpline};
use crate::mesh::collapse::{CollapseError, Collapsed, collapse};
use crate::mesh::rigid_align::mean as mean_vertex;
use crate::mesh::{FrameSource, Topology, torn};
use carrier::{Carrier, Walk};
use direct::Direct;
use gradients::Gradients;
use turns::Turns;

/// Triangles of a ghost where none are asked for.
pub const GHOST_FACES: usize = 2000;

/// Meshes of more triangles than this have a ghost unless it is refused.
const LARGE: usize = 20_000;

/// Whether splines run on a ghost, and of how many triangles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum GhostSize {
    /// [`GHOST_FACES`] for meshes of more than 20 000 triangles in other spaces than `vertices`; none
    /// where such a mesh cannot be collapsed.
    #[default]
    Auto,
    /// None.
    Off,
    /// At most this many triangles.
    Faces(usize),
}

/// How the mesh follows its ghost.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Lift {
    /// Gradients carried to the triangles, then one sparse solve a frame, in which the places of the direct
    /// lift count too: gradients alone do not say where a limb ends.
    #[default]
    Solve,
    /// Gradients only: deformation transfer to the letter (X19 §4.3). Without the residual the ends of limbs
    /// are off by as much as the gradients along them.
    Transfer,
    /// Places carried to the vertices: no solve.
    Direct,
}

/// What is asked of a ghost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GhostOptions {
    /// Its size.
    pub size: GhostSize,
    /// How the mesh follows.
    pub lift: Lift,
    /// Whether what is missing at the keys is kept; without it keys are met but for the detail that the
    /// ghost cannot carry. X19's own way is [`Lift::Transfer`] without it.
    pub residual: bool,
}

impl Default for GhostOptions {
    fn default() -> Self {
        GhostOptions {
            size: GhostSize::Auto,
            lift: Lift::Solve,
            residual: true,
        }
    }
}

/// What is known about a ghost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GhostReport {
    /// Its triangles.
    pub faces: usize,
    /// Its vertices.
    pub vertices: usize,
    /// How the mesh follows.
    pub lift: Lift,
    /// Whether what is missing at the keys is kept.
    pub residual: bool,
    /// The collapses: triangles left and the cost of the collapse that led there (squared length times
    /// area over the keys), at most 64 of them, evenly in the logarithm of the triangles.
    pub curve: Vec<(usize, f64)>,
}

/// A coarser mesh under some keys.
#[derive(Debug, Clone)]
pub(super) struct Ghost {
    pub(super) topology: Arc<Topology>,
    /// The vertices of the mesh that are its vertices.
    vertices: Vec<u32>,
    absorber: Vec<u32>,
    /// Where the triangles of the mesh are carried.
    faces: Vec<Carrier>,
    /// By what its triangles count where some are torn, and those of the mesh.
    pub(super) torn: Vec<f64>,
    pub(super) torn_of_mesh: Vec<f64>,
    curve: Vec<(usize, f64)>,
}

impl Ghost {
    /// The ghost for some keys, whose shapes are `poses` and whose triangles count by `torn`; none where
    /// none is wanted or needed.
    pub(super) fn of(
        keys: &Keys,
        poses: &[Vec<f64>],
        (space, torn): (&str, &[f64]),
        size: GhostSize,
    ) -> Result<Warned<Option<Self>>> {
        let triangles = keys.poses().topology().triangles();
        let (faces, asked) = match size {
            GhostSize::Off => return Ok(Warned::clean(None)),
            GhostSize::Auto if triangles.len() <= LARGE || space == "vertices" => {
                return Ok(Warned::clean(None));
            }
            GhostSize::Auto => (GHOST_FACES, false),
            GhostSize::Faces(faces) => (faces, true),
        };
        if faces >= triangles.len() {
            return Ok(Warned::clean(None));
        }
        let all: Vec<&[f64]> = poses.iter().map(Vec::as_slice).collect();
        match collapse(triangles, &all, faces) {
            Err(error) if asked => Err(refused(error, faces)),
            Err(error) => Ok(Warned {
                output: None,
                warnings: vec![without(error)],
            }),
            Ok(found) => {
                Ghost::made(found, triangles, &all, torn).map(|ghost| Warned::clean(Some(ghost)))
            }
        }
    }

    fn made(
        found: Collapsed,
        triangles: &[[u32; 3]],
        poses: &[&[f64]],
        torn_of_mesh: &[f64],
    ) -> Result<Self> {
        let topology = Topology::from_triangles(found.vertices.len(), &found.triangles);
        let topology =
            topology.map_err(|error| Diagnostic::error(format!("the ghost: {error}")))?;
        let ghosts: Vec<Vec<f64>> = poses
            .iter()
            .map(|pose| picked(&found.vertices, pose))
            .collect();
        let shapes: Vec<&[f64]> = ghosts.iter().map(Vec::as_slice).collect();
        let walk = Walk::new(&found.triangles, shapes[0]);
        Ok(Ghost {
            faces: walk.to_faces(triangles, poses[0], &found.absorber),
            torn: torn_of_ghost(&found, &shapes, (triangles, torn_of_mesh)),
            torn_of_mesh: torn_of_mesh.to_vec(),
            topology: Arc::new(topology),
            vertices: found.vertices,
            absorber: found.absorber,
            curve: found.curve,
        })
    }

    /// The triangle of the ghost that carries each triangle of the mesh.
    pub(super) fn carriers(&self) -> Vec<u32> {
        self.faces.iter().map(|carrier| carrier.triangle).collect()
    }

    /// The ghost's 3G positions in a shape of the mesh.
    pub(super) fn pick(&self, positions: &[f64]) -> Vec<f64> {
        picked(&self.vertices, positions)
    }

    /// What is known about it.
    pub(super) fn report(&self, options: GhostOptions) -> GhostReport {
        GhostReport {
            faces: self.topology.triangles().len(),
            vertices: self.vertices.len(),
            lift: options.lift,
            residual: options.residual,
            curve: self.sampled_curve(),
        }
    }

    /// The curve of costs at no more than 64 sizes, the last among them.
    fn sampled_curve(&self) -> Vec<(usize, f64)> {
        const POINTS: usize = 64;
        let (Some(first), Some(last)) = (self.curve.first(), self.curve.last()) else {
            return Vec::new();
        };
        let (from, to) = (libm::log(first.0 as f64), libm::log(last.0.max(1) as f64));
        let mut sampled: Vec<(usize, f64)> = (0..POINTS)
            .filter_map(|i| {
                let faces = libm::exp(from + (to - from) * i as f64 / (POINTS - 1) as f64);
                let at = self.curve.partition_point(|(left, _)| *left as f64 > faces);
                self.curve.get(at).copied()
            })
            .chain([*last])
            .collect();
        sampled.dedup_by_key(|(faces, _)| *faces);
        sampled
    }
}

/// The places of some vertices.
fn picked(vertices: &[u32], positions: &[f64]) -> Vec<f64> {
    let place = |&vertex: &u32| &positions[3 * vertex as usize..3 * vertex as usize + 3];
    vertices.iter().flat_map(place).copied().collect()
}

/// What is said where a ghost would have been made unasked.
fn without(error: CollapseError) -> Diagnostic {
    Diagnostic::warning(format!("no ghost mesh, frames take longer: {error}"))
        .hint("`--ghost FACES` asks for another size, `--ghost off` for none")
}

fn refused(error: CollapseError, faces: usize) -> Box<Diagnostic> {
    let told = |text: String| Diagnostic::error(text);
    Box::new(match error {
        CollapseError::Stuck { triangles } => told(format!(
            "the mesh cannot be collapsed to {faces} faces: its surface holds at {triangles}"
        ))
        .hint(format!(
            "`--ghost {triangles}` or more, or `--ghost off` (ghost: \"off\" in recipes)"
        )),
        CollapseError::EdgeOfMany { edge: [a, _] } => {
            told(format!("no ghost of a mesh that is no manifold: {error}"))
                .at_vertex(a as usize + 1)
                .hint("`--ghost off` completes any mesh (ghost: \"off\" in recipes)")
        }
        CollapseError::Degenerate { triangle } => {
            told(format!("no ghost of a mesh that is no manifold: {error}"))
                .at_face(triangle + 1)
                .hint("`--ghost off` completes any mesh (ghost: \"off\" in recipes)")
        }
    })
}

/// Places count beside gradients over more than so many edges of the ghost. For deformation transfer that
/// is beyond any mesh: all that they tell is where each part of it lies.
fn screening(lift: Lift) -> f64 {
    match lift {
        Lift::Transfer => 1e4,
        Lift::Solve | Lift::Direct => 0.7,
    }
}

/// A mesh that follows its ghost.
pub(super) struct Following {
    turns: Arc<Turns>,
    direct: Arc<Direct>,
    /// None for the direct lift.
    gradients: Option<Arc<Gradients>>,
    /// Cardinal weights of the keys by time; none without a residual.
    weights: Option<KeySpline>,
    /// The mean vertex of the mesh by time.
    mean: KeySpline,
    topology: Arc<Topology>,
}

impl Following {
    /// Follows `ghost` through the keys' shapes `poses`; `weights` are the cardinal splines of the keys,
    /// where the residual is wanted.
    pub(super) fn new(
        ghost: &Ghost,
        topology: &Topology,
        poses: &[Vec<f64>],
        lift: Lift,
        weights: Option<KeySpline>,
        mean: KeySpline,
    ) -> Result<Self> {
        let ghosts: Vec<Vec<f64>> = poses.iter().map(|pose| ghost.pick(pose)).collect();
        let turns = Turns::new(ghost.topology.triangles(), &ghosts[0], &ghost.torn);
        let walk = Walk::new(ghost.topology.triangles(), &ghosts[0]);
        let (keep, at_key) = (weights.is_some(), |key: usize| turns.of(&ghosts[key]));
        let gradients = match lift {
            Lift::Direct => None,
            Lift::Solve | Lift::Transfer => {
                let carriers = ghost.faces.clone();
                let screening = screening(lift) * walk.edge();
                let weights = ghost.torn_of_mesh.clone();
                Some(Gradients::new(
                    topology,
                    poses,
                    carriers,
                    (weights, screening),
                    at_key,
                    keep,
                )?)
            }
        };
        let carriers = walk.to_vertices(&poses[0], &ghost.absorber);
        Ok(Following {
            direct: Arc::new(Direct::new(poses, &ghosts, carriers, at_key, keep)),
            gradients: gradients.map(Arc::new),
            turns: Arc::new(turns),
            weights,
            mean,
            topology: Arc::clone(&ghost.topology),
        })
    }

    /// The same mesh with its keys at other times, see [`KeySpline::again`].
    pub(super) fn again(&self, times: &[f64], controls: Controls<'_>) -> Option<Self> {
        let weights = match &self.weights {
            Some(weights) => Some(weights.again(times, controls)?),
            None => None,
        };
        Some(Following {
            turns: Arc::clone(&self.turns),
            direct: Arc::clone(&self.direct),
            gradients: self.gradients.clone(),
            weights,
            mean: self.mean.again(times, controls)?,
            topology: Arc::clone(&self.topology),
        })
    }

    /// The ghost's connectivity.
    pub(super) fn ghost(&self) -> &Arc<Topology> {
        &self.topology
    }

    /// Writes the 3V positions of the mesh for the ghost's positions at time `t`.
    pub(super) fn place(&self, t: f64, ghost: &[f64], positions: &mut [f64]) {
        let turns = self.turns.of(ghost);
        let mut weights = Vec::new();
        if let Some(spline) = &self.weights {
            weights.resize(spline.width(), 0.0);
            spline.evaluate(t, &mut weights);
        }
        self.direct.place(&turns, ghost, &weights, positions);
        if let Some(gradients) = &self.gradients {
            gradients.integrate(&turns, &weights, positions);
        }
        let mut mean = [0.0; 3];
        self.mean.evaluate(t, &mut mean);
        let off = Vector3::from(mean) - mean_vertex(positions);
        for place in positions.chunks_exact_mut(3) {
            for axis in 0..3 {
                place[axis] += off[axis];
            }
        }
    }
}

/// By what a ghost's triangles count: as they are torn between its `shapes`, and as those of the mesh are that
/// they are left of. Beside the longer sides of a ghost a tear is less, but it is where it was.
fn torn_of_ghost(
    found: &Collapsed,
    shapes: &[&[f64]],
    (triangles, torn_of_mesh): (&[[u32; 3]], &[f64]),
) -> Vec<f64> {
    let mut weights = torn(&found.triangles, shapes);
    if torn_of_mesh.is_empty() {
        return weights;
    }
    let sorted = |mut corners: [u32; 3]| {
        corners.sort_unstable();
        corners
    };
    let mut left: HashMap<[u32; 3], f64> = HashMap::new();
    for (triangle, &weight) in triangles.iter().zip(torn_of_mesh) {
        if weight < 1.0 {
            let corners = triangle.map(|vertex| found.absorber[vertex as usize]);
            let least = left.entry(sorted(corners)).or_insert(1.0);
            *least = least.min(weight);
        }
    }
    weights.resize(found.triangles.len(), 1.0);
    for (weight, &triangle) in weights.iter_mut().zip(&found.triangles) {
        if let Some(&of_mesh) = left.get(&sorted(triangle)) {
            *weight = weight.min(of_mesh);
        }
    }
    match weights.iter().all(|weight| *weight == 1.0) {
        true => Vec::new(),
        false => weights,
    }
}
