//! Values to files: frames, looms, meshes and pictures, each by the ending of its path.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::output::{Output, Plan, plan, refuse_inputs};
use super::save::{Saved, save};
use super::value::{Picture, Value};
use super::{is_loom, save_loom};
use crate::diag::{Diagnostic, Result};
use crate::mesh::{FrameSource, Sequence};
use crate::sample::Sampled;
use crate::task::Task;
use crate::world::World;

/// Writes a value to `output`.
///
/// # Errors
/// The value cannot be written under this ending; as [`save`].
pub fn deliver(world: &dyn World, value: &Value, output: &Output, task: &Task) -> Result<Saved> {
    match value {
        Value::Loom(loom) if is_loom(&output.path) => {
            save_loom(world, &loom.loom.value, output, task)
        }
        Value::Picture(picture) => save_bytes(world, picture, output),
        _ => save(world, &*frames(value, &output.path)?, output, task),
    }
}

/// What [`deliver`] would write and remove.
///
/// # Errors
/// As [`deliver`], as far as names tell.
pub fn plan_delivery(
    world: &dyn World,
    value: &Value,
    output: &Output,
) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    match value {
        Value::Loom(_) if is_loom(&output.path) => one_file(world, output),
        Value::Picture(_) => one_file(world, output),
        _ => {
            let Plan {
                writes, removals, ..
            } = plan(world, output, frames(value, &output.path)?.frames())?;
            Ok((writes, removals))
        }
    }
}

fn one_file(world: &dyn World, output: &Output) -> Result<(Vec<PathBuf>, Vec<PathBuf>)> {
    refuse_inputs(world, [&output.path], &output.inputs)?;
    Ok((vec![output.path.clone()], Vec::new()))
}

/// The frames that a value stands for.
fn frames(value: &Value, path: &Path) -> Result<Arc<dyn FrameSource>> {
    match value {
        Value::Sequence(frames) => Ok(Arc::clone(&frames.value) as Arc<dyn FrameSource>),
        Value::Loom(loom) => Ok(Arc::new(Sampled::integers((*loom.loom.value).clone()))),
        Value::Shape(shape) => Ok(Arc::new(shape.value.sequence()) as Arc<Sequence>),
        Value::Nothing | Value::Statistics(_) | Value::Text(_) | Value::Picture(_) => {
            Diagnostic::error(format!(
                "there are no frames to write: the recipe ends in {}",
                value.kind()
            ))
            .in_file(path)
            .hint("let the last line be a loom, a sequence or a mesh, without a semicolon")
            .err()
        }
    }
}

fn save_bytes(world: &dyn World, picture: &Picture, output: &Output) -> Result<Saved> {
    refuse_inputs(world, [&output.path], &output.inputs)?;
    let stage = world.stage(&output.path)?;
    stage.write("picture", &picture.bytes)?;
    stage.commit(&[("picture".to_string(), output.path.clone())], &[])?;
    Ok(Saved {
        outputs: vec![output.path.clone()],
        removed: Vec::new(),
        frames: 0,
    })
}
