//! The method `spline`: the poses are keys at equal distances, completed by a natural cubic spline.

use super::{Found, Moment, MorphRequest};
use crate::diag::{Result, Warned};
use crate::mesh::{FrameSource, Sequence};
use crate::pipeline::complete::{CompleteRequest, complete};
use crate::pipeline::frames::in_memory;
use crate::sample::Times;
use crate::task::Task;

/// The frames at `moments` of a spline through all poses.
pub(super) fn morph(
    poses: &Sequence,
    moments: &[Moment],
    request: &MorphRequest,
    task: &Task,
) -> Result<Warned<Found>> {
    let keys = 1..=poses.frames();
    let at = moments
        .iter()
        .map(|moment| 1.0 + moment.pose as f64 + moment.t);
    let request = CompleteRequest {
        times: Some(keys.map(|key| key as f64).collect()),
        at: Times::List(at.collect()),
        space: request.space.clone(),
        ..CompleteRequest::default()
    };
    let mut warnings = Vec::new();
    let frames = complete(poses, &request, task)?.unpack(&mut warnings);
    let frames = in_memory(&frames, task)?;
    let mut positions = frames.positions().to_vec();
    let width = positions.len() / moments.len();
    for (row, moment) in positions.chunks_exact_mut(width.max(1)).zip(moments) {
        if moment.t == 0.0 {
            row.copy_from_slice(poses.frame(moment.pose));
        }
    }
    Ok(Warned {
        output: Found {
            positions,
            alignment: None,
        },
        warnings,
    })
}
