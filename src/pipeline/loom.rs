//! Looms to files and back.

use std::path::Path;
use std::sync::Arc;

use super::find::Files;
use super::input::InputSpec;
use super::open::{Capture, Content, Origin, in_file, no_mesh};
use super::output::{Output, refuse_inputs};
use super::save::Saved;
use crate::diag::{Diagnostic, Result};
use crate::format;
use crate::loom::Loom;
use crate::sample::{Sampled, Sampling};
use crate::task::Task;
use crate::world::World;

/// Opens a `.loom` file as a loom.
///
/// # Errors
/// It is not there, or not a loom; cancellation.
pub fn open_loom(world: &dyn World, path: &Path, task: &Task) -> Result<Loom> {
    task.phase("load", 1);
    let bytes = world.read(path)?;
    task.check()?;
    let loom = format::loom::read(&bytes);
    loom.map_err(|error| in_file(error, path, &bytes))
}

/// A `.loom` file as the frames of its capture.
pub(super) fn open_as_frames(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    task: &Task,
) -> Result<Capture> {
    no_mesh(spec)?;
    let path = files.only()?;
    let loom = open_loom(world, path, task)?;
    let part = spec.range.unwrap_or_default().within(loom.frames())?;
    let sampling = Sampling {
        times: part.map(|frame| (frame + 1) as f64).collect(),
        fps: spec.fps.or(loom.fps()),
    };
    let bytes = world.identity(path)?.map_or(0, |found| found.length);
    Ok(Capture {
        content: Content::Loom(Arc::new(Sampled::new(loom, sampling))),
        origin: Origin {
            format: "loom",
            files: vec![path.clone()],
            bytes,
        },
    })
}

/// Whether a loom may be written to `output`, to be asked before the work of fitting it.
///
/// # Errors
/// Another ending than `.loom`, or an input would be written over.
pub fn check_loom_output(world: &dyn World, output: &Output) -> Result<()> {
    let path = &output.path;
    if !is_loom(path) {
        return Diagnostic::error("a loom is written to a file that ends in .loom")
            .in_file(path)
            .hint(format!("such as {}", path.with_extension("loom").display()))
            .err();
    }
    refuse_inputs(world, [path], &output.inputs)
}

/// Writes a loom to a `.loom` file, staged and then moved to its place.
///
/// # Errors
/// As [`check_loom_output`], or the file cannot be written; cancellation.
pub fn save_loom(world: &dyn World, loom: &Loom, output: &Output, task: &Task) -> Result<Saved> {
    check_loom_output(world, output)?;
    task.phase("write", 1);
    let stage = world.stage(&output.path)?;
    let name = "loom".to_string();
    stage.write(&name, &format::loom::write(loom)?)?;
    task.check()?;
    stage.commit(&[(name, output.path.clone())], &[])?;
    Ok(Saved {
        outputs: vec![output.path.clone()],
        removed: Vec::new(),
        frames: loom.frames(),
    })
}

/// Whether the ending is that of a loom.
pub fn is_loom(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("loom"))
}
