//! Where frames and looms come from: the command line, files, built-in captures, a fit.

use rhai::plugin::*;
use rhai::{Array, Engine, Map};

use crate::diag::{Diagnostic, Result};
use crate::pipeline::{FitRequest, Frames, InputSpec, LoomValue, ShapeValue};
use crate::recipe::Input;
use crate::script::arguments::{Options, Raw, count, items, point};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
    engine.register_global_module(exported_module!(fields).into());
}

/// Opens files for a script: relative to the recipe, and only where it may read.
pub(super) fn open_pattern(context: &Context, pattern: &str) -> Result<Frames> {
    let path = context.readable(pattern)?;
    let opened = context.bench().open_frames(&InputSpec::new(path))?;
    Ok(context.warned(opened))
}

/// What `input()` stands for.
fn input_frames(context: &Context) -> Result<Frames> {
    let opened = match context.input() {
        Some(Input::Files(spec)) => context.bench().open_frames(spec)?,
        Some(Input::Demo(name)) => context.bench().demo(name)?,
        None => {
            return Diagnostic::error("`input()` needs an input")
                .hint("name a capture behind the recipe: `meshloom run RECIPE INPUT`, or use `demo(\"gallop\")`")
                .err();
        }
    };
    Ok(context.warned(opened))
}

/// The options of `fit`, as the command line has them.
fn request(options: Map) -> Raw<FitRequest> {
    let names = [
        "method",
        "space",
        "controls",
        "sites",
        "modes",
        "tolerance",
        "pins",
        "alpha",
        "root",
        "fps",
    ];
    let options = Options::new(options, &names)?;
    let pin = |pin: &Dynamic| {
        let parts = items(pin, "a pin")?;
        match parts.as_slice() {
            [frame, at] => Ok((
                count(frame, "a pin's frame", 1)?,
                point(at, "a pin's place")?,
            )),
            _ => raise(Diagnostic::error("a pin is [frame, [x, y]]")),
        }
    };
    let pins = options
        .get("pins")
        .map(|pins| {
            items(pins, "pins")?
                .iter()
                .map(pin)
                .collect::<Raw<Vec<_>>>()
        })
        .transpose()?;
    Ok(FitRequest {
        method: options.word("method")?,
        space: options.word("space")?,
        controls: options.count("controls", 0)?,
        sites: options.count("sites", 0)?,
        modes: options.count("modes", 0)?,
        tolerance: options.number("tolerance")?,
        pins: pins.unwrap_or_default(),
        near: None,
        alpha: options.number("alpha")?,
        root: options.word("root")?,
        fps: options.number("fps")?,
    })
}

#[export_module]
mod functions {
    /// The capture named on the command line.
    ///
    /// `input()`
    ///
    /// ```rhai
    /// check(input().frames > 1, "a capture");
    /// ```
    #[rhai_fn(name = "input", return_raw)]
    pub fn input(call: NativeCallContext) -> Raw<Frames> {
        pass(input_frames(&*Context::of(&call)?))
    }

    /// A capture: a folder, a pattern, a cache file; a loom stands for its frames.
    ///
    /// `open(pattern)`
    ///
    /// Relative to the recipe's folder; only below it, below the inputs and below `--allow-read`.
    ///
    /// ```rhai
    /// let frames = open("capture");
    /// check(frames.frames == 4, "a folder of four files");
    /// ```
    #[rhai_fn(name = "open", return_raw)]
    pub fn open(call: NativeCallContext, pattern: &str) -> Raw<Frames> {
        pass(open_pattern(&*Context::of(&call)?, pattern))
    }

    /// A loom from its file.
    ///
    /// `load(path)`
    ///
    /// ```rhai
    /// check(load("bar.loom").frames > 1, "a loom");
    /// ```
    #[rhai_fn(name = "load", return_raw)]
    pub fn load(call: NativeCallContext, path: &str) -> Raw<LoomValue> {
        let context = Context::of(&call)?;
        let path = pass(context.readable(path))?;
        pass(context.bench().load(&path))
    }

    /// One mesh from its file.
    ///
    /// `mesh(path)`
    ///
    /// ```rhai
    /// check(mesh("capture/frame_1.obj").vertices > 3, "a mesh");
    /// ```
    #[rhai_fn(name = "mesh", return_raw)]
    pub fn mesh(call: NativeCallContext, path: &str) -> Raw<ShapeValue> {
        let context = Context::of(&call)?;
        let frames = pass(open_pattern(&context, path))?;
        pass(context.bench().frame(&frames, 1))
    }

    /// A built-in capture.
    ///
    /// `demo(name)`
    ///
    /// ```rhai
    /// check(demo("bar").vertices > 0, "a bar");
    /// ```
    #[rhai_fn(name = "demo", return_raw)]
    pub fn demo(call: NativeCallContext, name: &str) -> Raw<Frames> {
        let context = Context::of(&call)?;
        let opened = pass(context.bench().demo(name))?;
        Ok(context.warned(opened))
    }

    /// Frames a to b of a capture, both included, from 1.
    ///
    /// `sequence.slice(a, b)`
    ///
    /// ```rhai
    /// check(demo("bar").slice(2, 5).frames == 4, "2, 3, 4, 5");
    /// ```
    #[rhai_fn(name = "slice", return_raw)]
    pub fn slice(call: NativeCallContext, frames: Frames, a: Dynamic, b: Dynamic) -> Raw<Frames> {
        pass(
            Context::of(&call)?
                .bench()
                .slice(&frames, count(&a, "a", 1)?, count(&b, "b", 1)?),
        )
    }

    /// Frame i, from 1.
    ///
    /// `sequence.frame(i)`, `loom.frame(i)`
    ///
    /// ```rhai
    /// check(demo("bar").frame(1).vertices > 0, "a mesh");
    /// ```
    #[rhai_fn(name = "frame", return_raw)]
    pub fn frame(call: NativeCallContext, frames: Frames, i: Dynamic) -> Raw<ShapeValue> {
        pass(
            Context::of(&call)?
                .bench()
                .frame(&frames, count(&i, "i", 1)?),
        )
    }

    #[rhai_fn(name = "frame", return_raw)]
    pub fn frame_of_loom(call: NativeCallContext, loom: LoomValue, i: Dynamic) -> Raw<ShapeValue> {
        pass(
            Context::of(&call)?
                .bench()
                .shape_at(&loom, count(&i, "i", 1)? as f64),
        )
    }

    /// Fits the three signals to a capture.
    ///
    /// `fit(sequence)`, `fit(sequence, #{ method, space, controls, sites, modes, tolerance, pins, alpha, root, fps })`
    ///
    /// What controls (k), sites (l) and modes (m) leave open follows from the tolerance, a relative total
    /// error (0.01). pins are [[frame, [x, y]], ..] in layout units; root is "none", "ground" or "rigid".
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.error.total <= 0.05, "the tolerance is met");
    /// ```
    #[rhai_fn(name = "fit", return_raw)]
    pub fn fit(call: NativeCallContext, frames: Frames) -> Raw<LoomValue> {
        fit_with(call, frames, Map::new())
    }

    #[rhai_fn(name = "fit", return_raw)]
    pub fn fit_with(call: NativeCallContext, frames: Frames, options: Map) -> Raw<LoomValue> {
        let context = Context::of(&call)?;
        let fitted = pass(context.bench().fit(&frames, &request(options)?))?;
        Ok(context.warned(fitted))
    }

    /// How each shape space does on a capture: every second frame is fitted, the frames between measured.
    ///
    /// `spaces(sequence)`
    ///
    /// Gives a map: best, the name of the space that suits it; why, in words; spaces, for each its space,
    /// dimension, modes, stored numbers, left_out errors in vertex positions (psi, linear, cubic) and
    /// large_turns.
    ///
    /// ```rhai
    /// let found = spaces(demo("bar").slice(1, 7));
    /// check(found.spaces.len() == 5, "five spaces");
    /// check(found.best != "vertices", "a bar that bends far is not for blending vertices");
    /// ```
    #[rhai_fn(name = "spaces", return_raw)]
    pub fn spaces(call: NativeCallContext, frames: Frames) -> Raw<Dynamic> {
        let context = Context::of(&call)?;
        Ok(super::dynamic(&pass(context.bench().spaces(&frames))?))
    }
}

/// Fields of looms, sequences and shapes.
#[export_module]
mod fields {
    #[rhai_fn(get = "frames", pure)]
    pub fn loom_frames(loom: &mut LoomValue) -> i64 {
        loom.frames() as i64
    }

    #[rhai_fn(get = "frames", pure)]
    pub fn sequence_frames(frames: &mut Frames) -> i64 {
        frames.frames() as i64
    }

    #[rhai_fn(get = "fps", pure)]
    pub fn loom_fps(loom: &mut LoomValue) -> Dynamic {
        loom.fps().map_or(Dynamic::UNIT, Dynamic::from)
    }

    #[rhai_fn(get = "fps", pure)]
    pub fn sequence_fps(frames: &mut Frames) -> Dynamic {
        frames.fps().map_or(Dynamic::UNIT, Dynamic::from)
    }

    #[rhai_fn(get = "controls", pure)]
    pub fn controls(loom: &mut LoomValue) -> i64 {
        loom.controls() as i64
    }

    #[rhai_fn(get = "sites", pure)]
    pub fn sites(loom: &mut LoomValue) -> i64 {
        loom.sites() as i64
    }

    #[rhai_fn(get = "modes", pure)]
    pub fn modes(loom: &mut LoomValue) -> i64 {
        loom.modes() as i64
    }

    #[rhai_fn(get = "space", pure)]
    pub fn space(loom: &mut LoomValue) -> String {
        loom.space().to_string()
    }

    #[rhai_fn(get = "error", pure)]
    pub fn error(loom: &mut LoomValue) -> Dynamic {
        super::dynamic(&loom.report()["error"])
    }

    #[rhai_fn(get = "left_out", pure)]
    pub fn left_out(loom: &mut LoomValue) -> Dynamic {
        super::dynamic(&loom.report()["left_out"])
    }

    #[rhai_fn(get = "report", pure)]
    pub fn report(loom: &mut LoomValue) -> Dynamic {
        super::dynamic(&loom.report())
    }

    #[rhai_fn(get = "vertices", pure)]
    pub fn vertices(shape: &mut ShapeValue) -> i64 {
        shape.vertices() as i64
    }

    #[rhai_fn(get = "vertices", pure)]
    pub fn sequence_vertices(frames: &mut Frames) -> i64 {
        frames.vertices() as i64
    }
}

/// JSON as the language's own maps, arrays and numbers.
pub(super) fn dynamic(json: &serde_json::Value) -> Dynamic {
    use serde_json::Value as Json;
    match json {
        Json::Null => Dynamic::UNIT,
        Json::Bool(value) => (*value).into(),
        Json::Number(number) => number
            .as_i64()
            .map_or_else(|| number.as_f64().unwrap_or(f64::NAN).into(), Dynamic::from),
        Json::String(text) => text.clone().into(),
        Json::Array(items) => items.iter().map(dynamic).collect::<Array>().into(),
        Json::Object(map) => map
            .iter()
            .map(|(name, value)| (name.as_str().into(), dynamic(value)))
            .collect::<Map>()
            .into(),
    }
}
