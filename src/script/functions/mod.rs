//! What a recipe can call, a file for each kind of work. The doc comment of each function is its page in
//! the reference: a sentence, its forms in backticks, notes, an example that the tests run.

// `export_module` takes functions that are `pub`, though nobody outside of the engine calls them.
#![allow(unreachable_pub)]

mod keys;
mod morph;
mod output;
mod params;
mod pose;
mod poses;
mod shape;
mod sources;
mod statistics;
mod time;

use rhai::{Array, Dynamic, Engine};

pub(super) use params::written_param;

use super::context::Context;
use crate::diag::{Diagnostic, Result};
use crate::pipeline::{
    Examples, Frames, Keyed, LoomValue, Picture, ShapeValue, StatisticsValue, Value,
};
use std::sync::Arc;

/// Makes all functions and types known to `engine`.
pub(super) fn register(engine: &mut Engine) {
    engine.register_type_with_name::<Frames>("Sequence");
    engine.register_type_with_name::<LoomValue>("Loom");
    engine.register_type_with_name::<ShapeValue>("Shape");
    engine.register_type_with_name::<time::Clock>("Clock");
    engine.register_type_with_name::<Keyed<Examples>>("Examples");
    engine.register_type_with_name::<Arc<Picture>>("Image");
    engine.register_type_with_name::<StatisticsValue>("Statistics");
    params::register(engine);
    sources::register(engine);
    time::register(engine);
    pose::register(engine);
    poses::register(engine);
    shape::register(engine);
    keys::register(engine);
    morph::register(engine);
    statistics::register(engine);
    output::register(engine);
}

/// The frames that a value stands for: a sequence, a loom, a mesh, an array of meshes. `what` names the
/// argument.
pub(super) fn frames_of(context: &Context, value: Dynamic, what: &str) -> Result<Frames> {
    if value.is_array() {
        let meshes = value.into_array().unwrap_or_default();
        return context.bench().gather(&shapes(meshes)?);
    }
    match self::value(value)? {
        Value::Sequence(frames) => Ok(frames),
        Value::Loom(loom) => context.bench().frames_of(&loom),
        Value::Shape(shape) => Ok(context.bench().single(&shape)),
        other => {
            let message = format!("{what} must be frames, this is {}", other.kind());
            let forms = "a sequence, a loom, a mesh or an array of meshes";
            let hint = format!(
                "{forms}, such as `demo(\"cactus\")` or `[mesh(\"a.obj\"), mesh(\"b.obj\")]`"
            );
            Diagnostic::error(message).hint(hint).err()
        }
    }
}

/// The meshes of an array.
pub(super) fn shapes(meshes: Array) -> Result<Vec<ShapeValue>> {
    let shape = |(index, mesh): (usize, Dynamic)| match value(mesh)? {
        Value::Shape(shape) => Ok(shape),
        other => {
            let (item, kind) = (index + 1, other.kind());
            Diagnostic::error(format!(
                "item {item} of the array is {kind}, a mesh is wanted"
            ))
            .err()
        }
    };
    meshes.into_iter().enumerate().map(shape).collect()
}

/// The last value of a script as what the studio shows and `-o` saves.
pub(super) fn value(result: Dynamic) -> Result<Value> {
    if result.is_unit() {
        return Ok(Value::Nothing);
    }
    let result = match result.try_cast_result::<LoomValue>() {
        Ok(loom) => return Ok(Value::Loom(loom)),
        Err(result) => result,
    };
    let result = match result.try_cast_result::<Frames>() {
        Ok(frames) => return Ok(Value::Sequence(frames)),
        Err(result) => result,
    };
    let result = match result.try_cast_result::<ShapeValue>() {
        Ok(shape) => return Ok(Value::Shape(shape)),
        Err(result) => result,
    };
    let result = match result.try_cast_result::<Arc<Picture>>() {
        Ok(picture) => return Ok(Value::Picture(picture)),
        Err(result) => result,
    };
    if result.is::<Keyed<Examples>>() {
        return Diagnostic::error("the recipe ends in examples without a loom")
            .hint("`loom.transfer(examples(sources, targets))` takes them")
            .err();
    }
    let result = match result.try_cast_result::<StatisticsValue>() {
        Ok(found) => return Ok(Value::Statistics(found)),
        Err(result) => result,
    };
    if result.is::<time::Clock>() {
        return Diagnostic::error("the recipe ends in times without a loom")
            .hint("`loom.resample(fps(60))` takes them")
            .err();
    }
    Ok(Value::Text(result.to_string()))
}
