//! A scene that moves: one animation of it.

use super::{Origin, Read, finite, in_file, no_mesh};
use crate::diag::{Result, Warned};
use crate::format::SceneFormat;
use crate::mesh::FrameSource;
use crate::pipeline::find::{Files, parent};
use crate::pipeline::input::InputSpec;
use crate::task::Task;
use crate::world::World;

/// Samples the animation and keeps the frames that are wanted.
pub(super) fn read(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn SceneFormat,
    task: &Task,
) -> Result<Read> {
    no_mesh(spec)?;
    let path = files.only()?;
    task.phase("load", 1);
    let bytes = world.read(path)?;
    let resource = |name: &str| world.read(&parent(path).join(name));
    let read = format.read(&bytes, files.animation.as_deref(), &resource);
    let read = read.map_err(|error| match error.place.file {
        Some(_) => error,
        None => in_file(error, path, &bytes),
    })?;
    let warnings = read.warnings.into_iter();
    let warnings = warnings.map(|warning| warning.in_file(path)).collect();
    let sequence = read.output;
    let range = spec.range.unwrap_or_default().within(sequence.frames())?;
    for frame in range.clone() {
        finite(sequence.frame(frame), frame).map_err(|error| Box::new(error.in_file(path)))?;
    }
    let origin = Origin {
        format: files.format.name,
        files: vec![path.clone()],
        bytes: bytes.len() as u64,
    };
    Ok(Warned {
        output: (sequence.slice(range), origin),
        warnings,
    })
}
