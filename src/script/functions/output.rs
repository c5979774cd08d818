//! What comes out: files, pictures, measures, checks.

use std::sync::Arc;

use rhai::Engine;
use rhai::plugin::*;

use super::frames_of;
use super::sources::dynamic;
use crate::diag::Diagnostic;
use crate::pipeline::{LoomValue, Value};
use crate::script::arguments::{Raw, number};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

#[export_module]
mod functions {
    /// How far b is from a: KG error in percent, rms and largest distance, edge errors in percent.
    ///
    /// `compare(a, b)`
    ///
    /// Gives a map with frames, kg_percent, rms, max, edge_rms_percent, edge_max_percent.
    ///
    /// ```rhai
    /// let bar = demo("bar");
    /// check(compare(bar, bar).kg_percent == 0, "no distance to itself");
    /// ```
    #[rhai_fn(name = "compare", return_raw)]
    pub fn compare(call: NativeCallContext, a: Dynamic, b: Dynamic) -> Raw<Dynamic> {
        let context = Context::of(&call)?;
        let (a, b) = (
            pass(frames_of(&context, a, "a"))?,
            pass(frames_of(&context, b, "b"))?,
        );
        Ok(dynamic(&pass(context.bench().compare(&a, &b))?))
    }

    /// How well a loop of [a, b] would close: how large step and changes are at its seam.
    ///
    /// `seam(loom, a, b)`
    ///
    /// Gives a map with step, velocity, acceleration and worst: steps over the motion's mean, changes of
    /// velocity over its largest, accelerations over its median; above 1.5 the seam shows. What the motion
    /// does by itself on either side is no part of the seam.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(seam(bar, 1, 5).worst >= 0, "a ratio");
    /// ```
    #[rhai_fn(name = "seam", return_raw)]
    pub fn seam(call: NativeCallContext, loom: LoomValue, a: Dynamic, b: Dynamic) -> Raw<Dynamic> {
        let context = Context::of(&call)?;
        Ok(dynamic(&pass(context.bench().seam(
            &loom,
            number(&a, "a")?,
            number(&b, "b")?,
        ))?))
    }

    /// Fails the run unless the condition holds.
    ///
    /// `check(condition, message)`
    ///
    /// ```rhai
    /// check(1 + 1 == 2, "sums are right");
    /// ```
    #[rhai_fn(name = "check", return_raw)]
    pub fn check(condition: bool, message: &str) -> Raw<()> {
        if condition {
            Ok(())
        } else {
            raise(Diagnostic::error(format!("check failed: {message}")).hint("nothing is written"))
        }
    }

    /// Writes frames, a loom, a mesh or a picture below `-o`, after the whole recipe has run.
    ///
    /// `save(value, path)`
    ///
    /// The path says how, as `-o` does: one file, a folder, a pattern.
    ///
    /// ```rhai
    /// save(demo("bar"), "bar/frame_####.obj");
    /// ```
    #[rhai_fn(name = "save", return_raw)]
    pub fn save(call: NativeCallContext, value: Dynamic, path: &str) -> Raw<()> {
        let value = pass(super::super::value(value))?;
        pass(Context::of(&call)?.save(value, path))
    }

    /// Draws pose space and time signals of a loom, or poses by their principal components, and writes
    /// them below `-o`.
    ///
    /// `plot(loom, path)`, `plot(pca, path)`
    ///
    /// The path ends in `.png` or `.svg`.
    ///
    /// ```rhai
    /// plot(fit(demo("bar"), #{ tolerance: 0.05 }), "bar.png");
    /// ```
    #[rhai_fn(name = "plot", return_raw)]
    pub fn plot(call: NativeCallContext, loom: LoomValue, path: &str) -> Raw<()> {
        let context = Context::of(&call)?;
        let picture = pass(context.bench().plot(&loom, path))?;
        pass(context.save(Value::Picture(Arc::new(picture)), path))
    }

    /// Draws a contact sheet of shaded frames, and writes it below `-o`.
    ///
    /// `sheet(value, path)`
    ///
    /// The path ends in `.png`. Of a long sequence at most 48 frames are shown, evenly.
    ///
    /// ```rhai
    /// sheet(demo("bar"), "bar.png");
    /// ```
    #[rhai_fn(name = "sheet", return_raw)]
    pub fn sheet(call: NativeCallContext, value: Dynamic, path: &str) -> Raw<()> {
        let context = Context::of(&call)?;
        let frames = pass(frames_of(&context, value, "value"))?;
        let picture = pass(context.bench().sheet(&frames, path))?;
        pass(context.save(Value::Picture(Arc::new(picture)), path))
    }
}
