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

use body::Body;
use gait::Gait;

/// Two strides of a gallop in place; the second a little longer, higher and prouder.
pub(super) fn gallop() -> Sequence {
    animate(&gait::gallop(), 60, 60.0)
}

/// Two and a half strides of a walk over the ground towards +x.
pub(super) fn walk() -> Sequence {
    animate(&gait::walk(), 83, 30.0)
}

fn animate(gait: &Gait, frames: usize, fps: f64) -> Sequence {
    let body = Body::new();
    let mut positions = Vec::with_capacity(3 * body.topology.vertices() * frames);
    for frame in 0..frames {
        let stance = gait.at(frame as f64 / fps);
        body.skin.pose(&pose::bones(&stance), &mut positions);
    }
    Sequence::new(Arc::new(body.topology), positions, Some(fps))
}

#[cfg(test)]
mod tests;
