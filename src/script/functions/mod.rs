//! What a recipe can call, a file for each kind of work. The doc comment of each function is its page in
//! the reference: a sentence, its forms in backticks, notes, an example that the tests run.

// `export_module` takes functions that are `pub`, though nobody outside of the engine calls them.
#![allow(unreachable_pub)]

mod keys;
mod output;
mod params;
mod pose;
mod shape;
mod sources;
mod time;

use rhai::{Dynamic, Engine};

pub(super) use params::written_param;

use crate::diag::{Diagnostic, Result};
use crate::pipeline::{Frames, LoomValue, Picture, ShapeValue, Value};
use std::sync::Arc;

/// Makes all functions and types known to `engine`.
pub(super) fn register(engine: &mut Engine) {
    engine.register_type_with_name::<Frames>("Sequence");
    engine.register_type_with_name::<LoomValue>("Loom");
    engine.register_type_with_name::<ShapeValue>("Shape");
    engine.register_type_with_name::<time::Clock>("Clock");
    engine.register_type_with_name::<Arc<Picture>>("Image");
    params::register(engine);
    sources::register(engine);
    time::register(engine);
    pose::register(engine);
    shape::register(engine);
    keys::register(engine);
    output::register(engine);
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
    if result.is::<time::Clock>() {
        return Diagnostic::error("the recipe ends in times without a loom")
            .hint("`loom.resample(fps(60))` takes them")
            .err();
    }
    Ok(Value::Text(result.to_string()))
}
