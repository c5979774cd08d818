//! Two sequences side by side, a block of frames at a time.

use std::io;

use rayon::prelude::*;

use super::MetricError;
use crate::mesh::FrameSource;
use crate::task::Task;

/// Frames of one block: enough to keep the processors busy while they are fetched.
const BLOCK: usize = 8;

/// The same frame of both sequences, 3V coordinates each.
#[derive(Debug, Clone)]
pub struct FramePair {
    /// Of the reference.
    pub first: Vec<f32>,
    /// Of what is measured.
    pub second: Vec<f32>,
}

/// Calls `visit` with blocks of frames in order; the frames of a block are fetched in parallel.
///
/// # Errors
/// Different numbers of vertices or frames, a frame that cannot be fetched, cancellation.
pub fn each_block(
    first: &dyn FrameSource,
    second: &dyn FrameSource,
    task: &Task,
    mut visit: impl FnMut(&[FramePair]),
) -> Result<(), MetricError> {
    let width = check_counts(first, second)?;
    let frames = first.frames();
    let mut block = vec![
        FramePair {
            first: vec![0.0; width],
            second: vec![0.0; width],
        };
        BLOCK.min(frames)
    ];
    for start in (0..frames).step_by(BLOCK) {
        let present = BLOCK.min(frames - start);
        block[..present]
            .par_iter_mut()
            .enumerate()
            .try_for_each(|(at, pair)| {
                task.check()?;
                fetch(first, second, start + at, pair).map_err(|source| MetricError::Read {
                    frame: start + at,
                    source,
                })?;
                task.step();
                Ok::<(), MetricError>(())
            })?;
        visit(&block[..present]);
    }
    Ok(())
}

fn fetch(
    first: &dyn FrameSource,
    second: &dyn FrameSource,
    frame: usize,
    pair: &mut FramePair,
) -> io::Result<()> {
    first.read_frame(frame, &mut pair.first)?;
    second.read_frame(frame, &mut pair.second)
}

/// 3V, the same for both.
fn check_counts(first: &dyn FrameSource, second: &dyn FrameSource) -> Result<usize, MetricError> {
    let vertices = [first, second].map(|source| source.topology().vertices());
    let frames = [first, second].map(FrameSource::frames);
    if vertices[0] != vertices[1] {
        return Err(MetricError::Vertices {
            first: vertices[0],
            second: vertices[1],
        });
    }
    if frames[0] != frames[1] {
        return Err(MetricError::Frames {
            first: frames[0],
            second: frames[1],
        });
    }
    Ok(3 * vertices[0])
}
