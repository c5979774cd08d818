//! Frames to files: staged, then moved to their places in order.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;

use super::lanes;
use super::output::{Output, Plan, plan};
use crate::diag::{Diagnostic, Result};
use crate::format::{Kind, MeshFormat};
use crate::mesh::FrameSource;
use crate::task::Task;
use crate::world::{Stage, World};

/// What was saved.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Saved {
    /// The files written, in order.
    pub outputs: Vec<PathBuf>,
    /// Frames of an earlier, longer run that were removed.
    pub removed: Vec<PathBuf>,
    /// How many frames were written.
    pub frames: usize,
}

/// Writes all frames of `source` to `output`, in parallel. Nothing is there until all is written; on an
/// error or cancellation nothing has changed.
///
/// # Errors
/// As [`plan`]; a frame cannot be fetched or is not finite; the output cannot be written.
pub fn save(
    world: &dyn World,
    source: &dyn FrameSource,
    output: &Output,
    task: &Task,
) -> Result<Saved> {
    let frames = source.frames();
    if frames == 0 {
        return Diagnostic::error("there are no frames to write").err();
    }
    let plan = plan(world, output, frames)?;
    let stage = world.stage(&plan.stage)?;
    task.phase("write", frames);
    match plan.format.0.kind {
        Kind::Mesh(format) => write_meshes(&*stage, source, format, task)?,
    }
    task.check()?;
    let names = (0..plan.writes.len()).map(|file| file.to_string());
    let moves: Vec<_> = names.zip(plan.writes.iter().cloned()).collect();
    stage.commit(&moves, &plan.removals)?;
    let Plan {
        writes, removals, ..
    } = plan;
    Ok(Saved {
        outputs: writes,
        removed: removals,
        frames,
    })
}

/// One file a frame, each lane with its own buffers.
fn write_meshes(
    stage: &dyn Stage,
    source: &dyn FrameSource,
    format: &dyn MeshFormat,
    task: &Task,
) -> Result<()> {
    let topology: &Arc<_> = source.topology();
    let writer = format.writer(topology, source.fps());
    let lanes = rayon::current_num_threads();
    lanes::run(
        0..source.frames(),
        lanes,
        task,
        |(positions, bytes): &mut (Vec<f32>, Vec<u8>), frame| {
            fetch(source, frame, positions)?;
            writer.write(positions, bytes);
            stage.write(&frame.to_string(), bytes)
        },
    )
}

/// The coordinates of one frame (from 0), finite.
fn fetch(source: &dyn FrameSource, frame: usize, positions: &mut Vec<f32>) -> Result<()> {
    positions.resize(3 * source.topology().vertices(), 0.0);
    let read = source.read_frame(frame, positions);
    read.map_err(|error: io::Error| {
        let told = Diagnostic::error(format!("the frame cannot be fetched: {error}"));
        Box::new(told.at_frame(frame + 1))
    })?;
    match positions.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Diagnostic::error("a coordinate is not a finite number")
            .at_frame(frame + 1)
            .at_vertex(at / 3 + 1)
            .err(),
    }
}
