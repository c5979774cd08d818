//! The splines through some keys: of their coordinates in a space, of those of their ghosts, of their
//! means, and the weights of the keys by time.

use std::sync::Arc;

use rayon::prelude::*;

use super::ends::{Boundary, Velocity};
use super::ghost::{Following, Ghost, GhostOptions};
use super::keys::{Keys, widened};
use crate::diag::{Diagnostic, Result};
use crate::math::cubic_spline::Ends;
use crate::math::key_spline::{Controls, KeySpline};
use crate::mesh::rigid_align::mean;
use crate::mesh::{FrameSource, Topology};
use crate::space::{Fine, ShapeSpace, Spaces, follow_frames};
use crate::task::Task;

/// What a spline through keys is made of besides their shapes.
pub(super) struct Track<'a> {
    pub(super) keys: &'a Keys,
    pub(super) boundary: &'a Boundary,
    pub(super) controls: Controls<'a>,
}

/// Writes the coordinates of a shape of the mesh: its own, its ghost's, its mean.
pub(super) type Encode<'a> = &'a (dyn Fn(&[f64], &mut [f64]) + Sync);

impl Track<'_> {
    /// The space of a ghost and the spline through its coordinates. In `patch-lri` the ghost has the
    /// patches of the mesh, turned as there: what rotations are taken relative to decides on the way
    /// between keys.
    pub(super) fn behind(
        &self,
        ghost: &Ghost,
        name: &str,
        poses: &[Vec<f64>],
        task: &Task,
    ) -> Result<(Arc<dyn ShapeSpace>, (KeySpline, usize))> {
        let ghosts: Vec<Vec<f64>> = poses.iter().map(|pose| ghost.pick(pose)).collect();
        if name != "patch-lri" {
            let space = open_space(&ghost.topology, name, &ghosts, &ghost.torn)?;
            let encode = |shape: &[f64], row: &mut [f64]| space.encode(&ghost.pick(shape), row);
            let through = self.through(&*space, &encode, poses, task)?;
            return Ok((space, through));
        }
        let fine = Fine {
            topology: self.keys.poses().topology(),
            poses: &slices(poses),
            weights: &ghost.torn_of_mesh,
            carriers: &ghost.carriers(),
        };
        let spaces = Spaces::new(Arc::clone(&ghost.topology), &ghosts[0]);
        let coarse = spaces.open_coarse(&fine, &ghost.torn)?;
        let encode = |shape: &[f64], row: &mut [f64]| coarse.encode(shape, &ghost.pick(shape), row);
        let through = self.through(&*coarse.space(), &encode, poses, task)?;
        Ok((coarse.space(), through))
    }

    /// The spline through the coordinates in `space` of the shapes `poses` of the mesh, and how many
    /// rotations turn far between keys.
    pub(super) fn through(
        &self,
        space: &dyn ShapeSpace,
        encode: Encode<'_>,
        poses: &[Vec<f64>],
        task: &Task,
    ) -> Result<(KeySpline, usize)> {
        let d = space.dimension();
        let mut rows = vec![0.0; poses.len() * d];
        rows.par_chunks_mut(d.max(1))
            .zip(poses)
            .try_for_each(|(row, pose)| {
                task.check()?;
                encode(pose, row);
                task.step();
                Ok::<_, Box<Diagnostic>>(())
            })?;
        let turns = follow_frames(space, &mut rows);
        let slope = |velocity: &Option<Velocity>, row: &[f64]| match velocity {
            Some(velocity) => slope(velocity, space, encode, row),
            None => Vec::new(),
        };
        let slopes = match self.boundary {
            Boundary::Hermite { start, end } => [
                slope(start, &rows[..d]),
                slope(end, &rows[rows.len() - d..]),
            ],
            _ => Default::default(),
        };
        let ends = match self.boundary {
            Boundary::Natural => Ends::Natural,
            Boundary::Periodic { .. } => Ends::Periodic,
            Boundary::Hermite { .. } => Ends::Clamped {
                first: &slopes[0],
                last: &slopes[1],
            },
        };
        Ok((self.spline(&rows, d, ends)?, turns))
    }

    fn spline(&self, rows: &[f64], width: usize, ends: Ends<'_>) -> Result<KeySpline> {
        let spline = KeySpline::new(self.keys.times(), rows, width, ends, self.controls);
        Ok(spline.map_err(|_| Diagnostic::error("the keys' coordinates are not finite"))?)
    }

    /// The mesh behind its ghost.
    pub(super) fn follow(
        &self,
        ghost: &Ghost,
        poses: &[Vec<f64>],
        options: GhostOptions,
        task: &Task,
    ) -> Result<Following> {
        task.phase("follow", 0);
        let point = Arc::new(Topology::points(1));
        let space = Spaces::new(point, &middle(&poses[0])).open("vertices", &[])?;
        let encode = |shape: &[f64], row: &mut [f64]| row.copy_from_slice(&middle(shape));
        let (mean, _) = self.through(&*space, &encode, poses, &Task::default())?;
        let weights = options.residual.then(|| self.cardinal()).transpose()?;
        let topology = self.keys.poses().topology();
        Following::new(ghost, topology, poses, options.lift, weights, mean)
    }

    /// The weight of each key by time: splines through 1 at one key and 0 at the others. The last key of
    /// a period is the first.
    fn cardinal(&self) -> Result<KeySpline> {
        let n = self.keys.count();
        let periodic = matches!(self.boundary, Boundary::Periodic { .. });
        let mut rows = vec![0.0; n * n];
        for key in 0..n {
            let weight = if periodic && key + 1 == n { 0 } else { key };
            rows[key * n + weight] = 1.0;
        }
        let ends = if periodic {
            Ends::Periodic
        } else {
            Ends::Natural
        };
        self.spline(&rows, n, ends)
    }
}

/// The mean vertex.
fn middle(pose: &[f64]) -> [f64; 3] {
    mean(pose).into()
}

/// A velocity at a key in the space whose coordinates `encode` finds; `row` are the key's.
fn slope(velocity: &Velocity, space: &dyn ShapeSpace, encode: Encode<'_>, row: &[f64]) -> Vec<f64> {
    let encoded = |shape: &[f32], near: &[f64]| {
        let mut coordinates = vec![0.0; row.len()];
        encode(&widened(shape), &mut coordinates);
        space.follow(near, &mut coordinates);
        coordinates
    };
    let from = match &velocity.from {
        Some(shape) => encoded(shape, row),
        None => row.to_vec(),
    };
    let mut slope = encoded(&velocity.to, &from);
    for (slope, from) in slope.iter_mut().zip(&from) {
        *slope = (*slope - from) / velocity.time;
    }
    slope
}

/// The space of `topology` about the first of `poses`; in `patch-lri` triangles count by `torn`, unless that
/// is empty.
pub(super) fn open_space(
    topology: &Arc<Topology>,
    name: &str,
    poses: &[Vec<f64>],
    torn: &[f64],
) -> Result<Arc<dyn ShapeSpace>> {
    let spaces = Spaces::new(Arc::clone(topology), &poses[0]);
    let poses = slices(poses);
    Ok(match name == "patch-lri" && !torn.is_empty() {
        true => spaces.open_weighted(&poses, torn)?,
        false => spaces.open(name, &poses)?,
    })
}

/// Shapes as spaces take them.
pub(super) fn slices(poses: &[Vec<f64>]) -> Vec<&[f64]> {
    poses.iter().map(Vec::as_slice).collect()
}
