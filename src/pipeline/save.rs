//! Frames to files: staged, then moved to their places in order.

use std::io;
use std::path::PathBuf;

use super::lanes;
use super::open::finite;
use super::output::{Output, Plan, not_written, plan};
use crate::diag::{Diagnostic, Result};
use crate::format::cache::CacheHeader;
use crate::format::{CacheFormat, FrameWriter, Kind, WriteOptions};
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
        Kind::Mesh(format) => {
            let options = WriteOptions {
                fps: source.fps(),
                encoding: output.encoding,
            };
            let writer = format.writer(source.topology(), options);
            write_meshes(&*stage, source, &*writer, task)?;
        }
        Kind::Cache(format) => write_cache(&*stage, source, format, task)?,
        Kind::Scene(_) | Kind::Loom => return not_written(plan.format.0, &output.path).err(),
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
    writer: &dyn FrameWriter,
    task: &Task,
) -> Result<()> {
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

/// One file; frames are fetched and encoded a batch at a time in parallel and written in order.
fn write_cache(
    stage: &dyn Stage,
    source: &dyn FrameSource,
    format: &dyn CacheFormat,
    task: &Task,
) -> Result<()> {
    let header = CacheHeader {
        vertices: source.topology().vertices(),
        frames: source.frames(),
        fps: source.fps(),
        start: 0,
    };
    let mut file = stage.create("0")?;
    let written = |done: io::Result<()>| done.map_err(|error| stage.failure(&error));
    written(file.write_all(&format.encode_header(&header)?))?;
    let frames: Vec<usize> = (0..header.frames).collect();
    let mut batch: Vec<(Vec<f32>, Vec<u8>)> = Vec::new();
    let fit = WRITE_BEHIND / (2 * header.frame_bytes()).max(1);
    batch.resize_with(fit.clamp(1, 64) as usize, Default::default);
    for frames in frames.chunks(batch.len()) {
        let lanes = rayon::current_num_threads();
        let items = frames.iter().zip(&mut batch);
        lanes::run(
            items,
            lanes,
            task,
            |(): &mut (), (&frame, (positions, bytes))| {
                fetch(source, frame, positions)?;
                format.encode(positions, bytes);
                Ok(())
            },
        )?;
        for (_, bytes) in &batch[..frames.len()] {
            written(file.write_all(bytes))?;
        }
    }
    written(file.flush())
}

/// Frames that wait to be written hold at most this many bytes, unless one alone is longer.
const WRITE_BEHIND: u64 = 16 << 20;

/// The coordinates of one frame (from 0), finite.
fn fetch(source: &dyn FrameSource, frame: usize, positions: &mut Vec<f32>) -> Result<()> {
    positions.resize(3 * source.topology().vertices(), 0.0);
    let read = source.read_frame(frame, positions);
    read.map_err(|error: io::Error| {
        let told = Diagnostic::error(format!("the frame cannot be fetched: {error}"));
        Box::new(told.at_frame(frame + 1))
    })?;
    finite(positions, frame)
}
