//! A horse with a smooth closed skin, which gallops in place and walks over the ground.
//!
//! `anatomy` says where its joints and its flesh are, `body` makes the skin, `gait` says where the
//! hooves and the trunk go in the course of a stride, `pose` bends the joints so that they do.

mod anatomy;
mod body;
mod gait;
mod pose;

use std::sync::Arc;

use crate::mesh::Sequence;
use crate::task::{Cancelled, Task};

use super::undisturbed;

use anatomy::HOOVES;
use body::Body;
use gait::Gait;
use pose::Stance;

/// Horses of the same bones and joints under different flesh, their skins cut into different faces.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Build {
    /// A riding horse: that of the demos `gallop` and `walk`.
    Light,
    /// A draught horse: heavy limbs and trunk, a coarser mesh.
    Heavy,
}

/// Two strides of a gallop in place; the second a little longer, higher and prouder.
pub(super) fn gallop(task: &Task) -> Result<Sequence, Cancelled> {
    animate(Build::Light, &gait::gallop(), 60, 60.0, task)
}

/// Two and a half strides of a walk over the ground towards +x.
pub(super) fn walk(task: &Task) -> Result<Sequence, Cancelled> {
    animate(Build::Light, &gait::walk(), 83, 30.0, task)
}

/// The gallop of the demo `gallop` by a horse of that build: 60 frames.
pub fn horse_gallop(build: Build) -> Sequence {
    undisturbed(|task| animate(build, &gait::gallop(), 60, 60.0, task))
}

/// Ten poses of a horse of that build, the same for all: at rest; each leg, the others standing, pushed
/// off far behind and folded in the swing; neck and back as in a gallop.
pub fn horse_poses(build: Build) -> Sequence {
    const MOMENTS: [f64; 2] = [1.05, 1.4];
    let gallop = gait::gallop();
    let mut stances = vec![Stance::default()];
    for leg in 0..HOOVES.len() {
        stances.extend(MOMENTS.map(|time| gallop.one_leg(leg, time)));
    }
    stances.push(gallop.trunk_only(0.0));
    undisturbed(|task| skinned(build, stances.into_iter(), None, task))
}

fn animate(
    build: Build,
    gait: &Gait,
    frames: usize,
    fps: f64,
    task: &Task,
) -> Result<Sequence, Cancelled> {
    let stances = (0..frames).map(|frame| gait.at(frame as f64 / fps));
    skinned(build, stances, Some(fps), task)
}

fn skinned(
    build: Build,
    stances: impl Iterator<Item = Stance>,
    fps: Option<f64>,
    task: &Task,
) -> Result<Sequence, Cancelled> {
    let body = Body::new(build, task)?;
    let mut positions = Vec::new();
    for stance in stances {
        task.check()?;
        body.skin.pose(&pose::bones(&stance), &mut positions);
    }
    Ok(Sequence::new(Arc::new(body.topology), positions, fps))
}

#[cfg(test)]
mod tests;
