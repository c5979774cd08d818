//! The frames of a sequence in a space: each encoded on its own, then every branch drawn from the frame
//! before.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::ShapeSpace;
use crate::task::{Cancelled, Task};

/// Rotations by more than this in one step (radians) are counted: the way round is then in doubt.
pub const LARGE_TURN: f64 = PI * 150.0 / 180.0;

/// Encodes n frames, read by `read(frame, positions)`, into n rows of d coordinates, frame after
/// frame; branches follow from row to row. Gives the number of large turns between neighbours, over
/// all rotations and frames. One step of `task` a frame.
///
/// # Errors
/// The task was cancelled, or a frame could not be read.
///
/// # Panics
/// `rows` is not a whole number of rows.
pub fn encode_frames<E: From<Cancelled> + Send>(
    space: &dyn ShapeSpace,
    vertices: usize,
    read: impl Fn(usize, &mut [f64]) -> Result<(), E> + Sync,
    rows: &mut [f64],
    task: &Task,
) -> Result<usize, E> {
    let dimension = space.dimension();
    if dimension == 0 {
        return Ok(0);
    }
    assert_eq!(rows.len() % dimension, 0, "rows of another dimension");
    rows.par_chunks_mut(dimension)
        .enumerate()
        .try_for_each_init(
            || vec![0.0; 3 * vertices],
            |positions, (frame, row)| -> Result<(), E> {
                task.check()?;
                read(frame, positions)?;
                space.encode(positions, row);
                task.step();
                Ok(())
            },
        )?;
    Ok(follow_frames(space, rows))
}

/// Draws the branches of each row from the row before; gives the number of large turns.
pub fn follow_frames(space: &dyn ShapeSpace, rows: &mut [f64]) -> usize {
    let dimension = space.dimension();
    let mut turns = 0;
    let mut rest = rows;
    while rest.len() > dimension {
        let (before, after) = rest.split_at_mut(dimension);
        turns += space.follow(before, &mut after[..dimension]);
        rest = after;
    }
    turns
}
