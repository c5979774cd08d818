//! Pairs of example shapes from files.

use super::input::InputSpec;
use super::open::open;
use crate::diag::{Result, Warned};
use crate::edit::transfer::Examples;
use crate::task::Task;
use crate::world::World;

/// Opens source and target examples: each a folder, pattern or list of meshes (or one file of many
/// frames), paired in order, the first pair being the reference pose.
///
/// # Errors
/// As [`open`], for either; different numbers of shapes.
pub fn open_examples(
    world: &dyn World,
    sources: &InputSpec,
    targets: &InputSpec,
    task: &Task,
) -> Result<Warned<Examples>> {
    let mut warnings = Vec::new();
    let mut shapes = |spec: &InputSpec| {
        let capture = open(world, spec, task)?.unpack(&mut warnings);
        capture.content.sequence(task)
    };
    let examples = Examples::new(shapes(sources)?, shapes(targets)?)?;
    Ok(Warned {
        output: examples,
        warnings,
    })
}
