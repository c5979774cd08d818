//! Splines through key poses in a shape space (X19 §4): each coordinate of the space follows a cubic
//! spline through its values at the keys. Mean rotation and mean vertex are coordinates too, the
//! rotation as a logarithm about the first key, its branches followed from key to key, so that a turn by
//! more than 180 degrees over several keys stays a turn. The splines of a large mesh run on its ghost
//! ([`super::ghost`]).

use std::sync::Arc;

use super::drift::Drift;
use super::ends::{Boundary, check_velocities, drift};
use super::ghost::{Ghost, GhostOptions};
use super::keys::Keys;
use super::motion::{Motion, MotionReport};
use super::track::{Track, open_space, slices};
use crate::diag::{Diagnostic, Result, Warned};
use crate::math::key_spline::{Controls, Handle};
use crate::mesh::{FrameSource, torn};
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
    let torn = torn(keys.poses().topology().triangles(), &slices(&poses));
    let ghost = Ghost::of(
        keys,
        &poses,
        (options.space.as_str(), &torn[..]),
        options.ghost.size,
    )?
    .unpack(&mut warnings);
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
            let space = open_space(topology, &options.space, &poses, &torn)?;
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
        torn: torn.iter().filter(|weight| **weight < 1.0).count(),
        ghost: ghost.map(|ghost| ghost.report(options.ghost)),
    };
    warnings.extend(of_torn(&torn));
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

/// Where keys' vertices do not correspond, nothing between can be right: the first such place is told.
fn of_torn(weights: &[f64]) -> Option<Diagnostic> {
    let torn = || weights.iter().filter(|weight| **weight < 1.0).count();
    let first = weights.iter().position(|weight| *weight < 1.0)?;
    Some(
        Diagnostic::warning(format!(
            "{} triangles are torn between keys, such as triangle {}: their longest side changes more than \
             tenfold beside the others'",
            torn(),
            first + 1
        ))
        .hint("do the vertices of all keys correspond there? Torn triangles hardly bend the rest"),
    )
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
