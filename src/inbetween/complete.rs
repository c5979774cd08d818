//! Splines through key poses in a shape space (X19 §4): each coordinate of the space follows a cubic
//! spline through its values at the keys. Mean rotation and mean vertex are coordinates too, the
//! rotation as a logarithm about the first key, its branches followed from key to key, so that a turn by
//! more than 180 degrees over several keys stays a turn. The splines of a large mesh run on its ghost
//! ([`super::ghost`]).

use std::sync::Arc;

use rayon::prelude::*;

use super::drift::Drift;
use super::ghost::{Following, Ghost, GhostOptions};
use super::keys::{Keys, same_faces, widened};
use super::motion::{Motion, MotionReport};
use crate::diag::{Diagnostic, Result, Warned};
use crate::math::cubic_spline::Ends;
use crate::math::key_spline::{Controls, Handle, KeySpline};
use crate::mesh::rigid_align::{mean, rigid};
use crate::mesh::{Bounds, FrameSource, Topology, torn};
use crate::space::{Fine, ShapeSpace, Spaces, follow_frames};
use crate::task::Task;

/// The space that takes the largest motions (X19 §4.2).
pub const SPACE: &str = "patch-lri";

/// How to complete keys.
#[derive(Debug, Clone)]
pub struct CompleteOptions {
    /// The shape space's name.
    pub space: String,
    /// What happens at the ends.
    pub boundary: Boundary,
    /// How the motion passes the keys: one handle a key, one for all, or none.
    pub handles: Vec<Handle>,
    /// By what share of the range of two neighbouring keys a coordinate may leave it between them
    /// (>= 0; 0 keeps the shape); none: no bound, and the motion is C2.
    pub overshoot: Option<f64>,
    /// The coarser mesh that the splines run on.
    pub ghost: GhostOptions,
}

impl Default for CompleteOptions {
    fn default() -> Self {
        CompleteOptions {
            space: SPACE.to_string(),
            boundary: Boundary::Natural,
            handles: Vec::new(),
            overshoot: None,
            ghost: GhostOptions::default(),
        }
    }
}

/// What happens at the ends. Beyond the first and the last key natural and Hermite motions go on
/// straight (X19 §3.2), periodic ones go round again.
#[derive(Debug, Clone, Default)]
pub enum Boundary {
    /// Second derivatives 0: least bending.
    #[default]
    Natural,
    /// The last key is the first again; both are passed smoothly.
    Periodic {
        /// The last key may be the first moved rigidly: that motion is split off and put back.
        drift: bool,
    },
    /// Given velocities.
    Hermite {
        /// At the first key.
        start: Option<Velocity>,
        /// At the last key.
        end: Option<Velocity>,
    },
}

/// A velocity in the shape space: the difference of two shapes' coordinates over a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Velocity {
    /// The shape that is left, 3V positions; none: the key itself.
    pub from: Option<Vec<f32>>,
    /// The shape that is reached.
    pub to: Vec<f32>,
    /// The time between, in frames; not 0. Negative where `to` lies before `from`.
    pub time: f64,
}

/// The motion through the keys.
///
/// # Errors
/// Periodic ends with different first and last key, Hermite ends without velocities, another number of
/// handles than keys, a bound on overshoot below 0, a space that does not suit the mesh; the task was
/// cancelled.
pub fn complete(keys: &Keys, options: &CompleteOptions, task: &Task) -> Result<Warned<Motion>> {
    let handles = handles(keys, &options.handles)?;
    check_overshoot(options.overshoot)?;
    let drift = drift(keys, &options.boundary)?;
    check_velocities(keys, &options.boundary)?;
    let poses = level_poses(keys, drift.as_ref());
    let mut warnings = Vec::new();
    task.phase("collapse", 0);
    let ghost = Ghost::of(keys, &poses, &options.space, options.ghost.size)?.unpack(&mut warnings);
    task.check()?;
    task.phase("encode", keys.count());
    let track = Track {
        keys,
        boundary: &options.boundary,
        controls: Controls {
            handles: &handles,
            overshoot: options.overshoot,
        },
    };
    let topology = keys.poses().topology();
    let (space, (spline, large_turns)) = match &ghost {
        None => {
            let space = open_space(topology, &options.space, &poses)?;
            let encode = |shape: &[f64], row: &mut [f64]| space.encode(shape, row);
            let through = track.through(&*space, &encode, &poses, task)?;
            (space, through)
        }
        Some(ghost) => track.behind(ghost, &options.space, &poses, task)?,
    };
    let following = match &ghost {
        Some(ghost) => Some(track.follow(ghost, &poses, options.ghost, task)?),
        None => None,
    };
    let report = MotionReport {
        keys: keys.count(),
        space: space.name(),
        dimension: space.dimension(),
        large_turns,
        ghost: ghost.map(|ghost| ghost.report(options.ghost)),
    };
    warnings.extend(of_turns(large_turns));
    Ok(Warned {
        output: Motion::new(
            Arc::clone(topology),
            (space, spline),
            following,
            drift,
            report,
        ),
        warnings,
    })
}

/// The space of `topology` about the first of `poses`.
fn open_space(
    topology: &Arc<Topology>,
    name: &str,
    poses: &[Vec<f64>],
) -> Result<Arc<dyn ShapeSpace>> {
    let spaces = Spaces::new(Arc::clone(topology), &poses[0]);
    let poses = slices(poses);
    let weights = match name {
        "patch-lri" => torn(topology.triangles(), &poses),
        _ => Vec::new(),
    };
    Ok(match weights.is_empty() {
        true => spaces.open(name, &poses)?,
        false => spaces.open_weighted(&poses, &weights)?,
    })
}

fn slices(poses: &[Vec<f64>]) -> Vec<&[f64]> {
    poses.iter().map(Vec::as_slice).collect()
}

/// The keys' shapes, without the drift.
fn level_poses(keys: &Keys, drift: Option<&Drift>) -> Vec<Vec<f64>> {
    let mut poses: Vec<Vec<f64>> = (0..keys.count()).map(|key| keys.pose(key)).collect();
    if let Some(drift) = drift {
        for (pose, &time) in poses.iter_mut().zip(keys.times()) {
            drift.remove(time, pose);
        }
    }
    poses
}

/// What a spline through keys is made of besides their shapes.
struct Track<'a> {
    keys: &'a Keys,
    boundary: &'a Boundary,
    controls: Controls<'a>,
}

/// Writes the coordinates of a shape of the mesh: its own, its ghost's, its mean.
type Encode<'a> = &'a (dyn Fn(&[f64], &mut [f64]) + Sync);

impl Track<'_> {
    /// The space of a ghost and the spline through its coordinates. In `patch-lri` the ghost has the
    /// patches of the mesh, turned as there: what rotations are taken relative to decides on the way
    /// between keys.
    fn behind(
        &self,
        ghost: &Ghost,
        name: &str,
        poses: &[Vec<f64>],
        task: &Task,
    ) -> Result<(Arc<dyn ShapeSpace>, (KeySpline, usize))> {
        let ghosts: Vec<Vec<f64>> = poses.iter().map(|pose| ghost.pick(pose)).collect();
        if name != "patch-lri" {
            let space = open_space(&ghost.topology, name, &ghosts)?;
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
    fn through(
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
    fn follow(
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

/// One handle a key.
fn handles(keys: &Keys, given: &[Handle]) -> Result<Vec<Handle>> {
    let numbers = |handle: &Handle| [handle.tension, handle.continuity, handle.bias];
    if let Some(number) = given
        .iter()
        .flat_map(numbers)
        .find(|number| !(-1.0..=1.0).contains(number))
    {
        return Diagnostic::error(format!(
            "tension, continuity and bias lie in [-1, 1], got {number}"
        ))
        .hint("0 is the smooth curve; tension 1 comes to rest at the key")
        .err();
    }
    match given {
        [one] => Ok(vec![*one; keys.count()]),
        given if given.is_empty() || given.len() == keys.count() => Ok(given.to_vec()),
        given => Diagnostic::error(format!("{} handles for {} keys", given.len(), keys.count()))
            .hint("give one for all keys, or one for each")
            .err(),
    }
}

fn check_overshoot(share: Option<f64>) -> Result<()> {
    match share.filter(|share| !(share.is_finite() && *share >= 0.0)) {
        None => Ok(()),
        Some(share) => Diagnostic::error(format!("an overshoot of {share} is no share"))
            .hint("0 lets no coordinate leave the range of its neighbouring keys, 0.1 by a tenth of it")
            .err(),
    }
}

/// How far, in sizes of the mesh, two shapes may differ that are one: files keep six digits.
const SAME: f64 = 1e-5;

/// The rigid motion to be split off, if any; the first and the last key of a period agree.
fn drift(keys: &Keys, boundary: &Boundary) -> Result<Option<Drift>> {
    let Boundary::Periodic { drift } = boundary else {
        return Ok(None);
    };
    let last = keys.count() - 1;
    let (first, end) = (keys.pose(0), keys.pose(last));
    let size = Bounds::of(keys.poses().frame(0)).map_or(0.0, |bounds| {
        let along = |axis: usize| f64::from(bounds.max[axis] - bounds.min[axis]);
        (0..3).map(along).fold(0.0, f64::max)
    });
    let near = |shape: &[f64], share: f64| {
        let pairs = shape.iter().zip(&end);
        pairs
            .into_iter()
            .all(|(a, b)| (a - b).abs() <= share * size)
    };
    let motion = rigid(&first, &end);
    let moved: Vec<f64> = first
        .chunks_exact(3)
        .flat_map(|point| {
            let point = nalgebra::Point3::from_slice(point);
            (motion * point).coords.data.0[0]
        })
        .collect();
    // a rigid fit to rounded files is a little less exact
    let rigidly = near(&moved, 10.0 * SAME);
    if *drift && rigidly {
        return Ok(Some(Drift::between(&first, &end, keys.ends())));
    }
    if near(&first, SAME) {
        return Ok(None);
    }
    let told = Diagnostic::error(format!(
        "the last key ({}) differs from the first: a period ends where it began",
        last + 1
    ));
    match rigidly {
        true => told.hint(
            "it is the first key, moved: `--drift rigid` (drift: \"rigid\") splits the motion off",
        ),
        false => told.hint("repeat the first key as the last"),
    }
    .err()
}

fn check_velocities(keys: &Keys, boundary: &Boundary) -> Result<()> {
    let Boundary::Hermite { start, end } = boundary else {
        return Ok(());
    };
    let vertices = keys.poses().topology().vertices();
    for (velocity, name, key) in [(start, "start", "first"), (end, "end", "last")] {
        let Some(velocity) = velocity else {
            return Diagnostic::error(format!("Hermite ends without a velocity at the {key} key"))
                .hint(format!(
                    "`--{name}-velocity POSE` or `--velocities-from SEQUENCE` gives it ({name}_velocity, \
                     velocities_from in recipes)"
                ))
                .err();
        };
        for shape in velocity.from.iter().chain([&velocity.to]) {
            if shape.len() != 3 * vertices {
                return Diagnostic::error(format!(
                    "a shape of {} vertices gives no velocity to keys of {vertices}",
                    shape.len() / 3
                ))
                .hint("velocities are differences of shapes of the keys' mesh")
                .err();
            }
        }
    }
    Ok(())
}

impl Velocity {
    /// The velocity at an end of a motion, from its frames (X26): of the first two, or of the last two,
    /// for frames spread evenly over `time`.
    ///
    /// # Errors
    /// Fewer than two frames, or another mesh than `topology`.
    pub fn at_end(
        frames: &crate::mesh::Sequence,
        topology: &Topology,
        last: bool,
        time: f64,
    ) -> Result<Self> {
        same_faces(topology, frames.topology(), 1)?;
        let n = frames.frames();
        if n < 2 {
            return Diagnostic::error("one frame has no velocity")
                .hint("name a sequence of two or more frames")
                .err();
        }
        let from = if last { n - 2 } else { 0 };
        Ok(Velocity {
            from: Some(frames.frame(from).to_vec()),
            to: frames.frame(from + 1).to_vec(),
            time: time / (n - 1) as f64,
        })
    }

    /// The velocity that one pose (from the key towards it) or two (from the first to the second) give,
    /// in a time of [`super::SPACING`] frames.
    ///
    /// # Errors
    /// No pose or more than two, or another mesh than `topology`.
    pub fn of_poses(poses: &crate::mesh::Sequence, topology: &Topology) -> Result<Self> {
        same_faces(topology, poses.topology(), 1)?;
        let (from, to) = match poses.frames() {
            1 => (None, 0),
            2 => (Some(poses.frame(0).to_vec()), 1),
            n => {
                return Diagnostic::error(format!("{n} poses give no velocity"))
                    .hint("one is what the key moves towards, two are left and reached")
                    .err();
            }
        };
        Ok(Velocity {
            from,
            to: poses.frame(to).to_vec(),
            time: super::SPACING,
        })
    }
}

fn of_turns(turns: usize) -> Option<Diagnostic> {
    (turns > 0).then(|| {
        Diagnostic::warning(format!(
            "{turns} rotations turn by more than 150 degrees from one key to the next: which way round \
             is a guess"
        ))
        .hint(
            "add a key between; of whole limbs --space patch-lri takes the largest turns, and where thin \
             triangles of shapes that lie close turn over, --space vertices is right",
        )
    })
}
