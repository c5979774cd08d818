//! Where things happen: pins, control points, poses of the map.

use rhai::plugin::*;
use rhai::{Array, Engine};

use super::time::edited;
use crate::pipeline::{Edit, LoomValue, ShapeValue};
use crate::script::arguments::{Raw, count, number, point};
use crate::script::context::Context;
use crate::script::diagnostics::pass;

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

#[export_module]
mod functions {
    /// Holds frame i at a point of the map: the other frames are laid out anew around it, and everything
    /// is fitted again.
    ///
    /// `loom.pin(i, [x, y])`
    ///
    /// Points are in layout units. Pins are for looms as they were fitted, before their time is edited.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.pin(3, [0.5, 0.5]).frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "pin", return_raw)]
    pub fn pin(call: NativeCallContext, loom: LoomValue, i: Dynamic, at: Array) -> Raw<LoomValue> {
        let context = Context::of(&call)?;
        let pinned = pass(context.bench().pin(
            &loom,
            count(&i, "i", 1)?,
            Some(point(&at.into(), "the pin")?),
        ))?;
        Ok(context.warned(pinned))
    }

    /// Lets a pinned frame go.
    ///
    /// `loom.unpin(i)`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.pin(3, [0.5, 0.5]).unpin(3).frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "unpin", return_raw)]
    pub fn unpin(call: NativeCallContext, loom: LoomValue, i: Dynamic) -> Raw<LoomValue> {
        let context = Context::of(&call)?;
        let unpinned = pass(context.bench().pin(&loom, count(&i, "i", 1)?, None))?;
        Ok(context.warned(unpinned))
    }

    /// Moves control point j (from 1) of the time signal.
    ///
    /// `loom.move_control(j, [x, y])`
    ///
    /// Only frames inside its support change; all others keep their bits.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.move_control(1, [0, 0]).frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "move_control", return_raw)]
    pub fn move_control(
        call: NativeCallContext,
        loom: LoomValue,
        j: Dynamic,
        to: Array,
    ) -> Raw<LoomValue> {
        let edit = Edit::MoveControl {
            control: count(&j, "j", 1)?,
            to: point(&to.into(), "the point")?,
        };
        edited(&call, &loom, &edit)
    }

    /// A control point more at time t; the curve does not change.
    ///
    /// `loom.insert_control(t)`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.insert_control(3.5).controls == bar.controls + 1, "one more");
    /// ```
    #[rhai_fn(name = "insert_control", return_raw)]
    pub fn insert_control(call: NativeCallContext, loom: LoomValue, t: Dynamic) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::InsertControl {
                time: number(&t, "t")?,
            },
        )
    }

    /// The shape at time t.
    ///
    /// `loom.at(t)`
    ///
    /// t is in frames, from 1 to n; any number between.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(compare(bar.at(2), bar.frame(2)).max == 0, "a frame is at its own time");
    /// ```
    #[rhai_fn(name = "at", return_raw)]
    pub fn at(call: NativeCallContext, loom: LoomValue, t: Dynamic) -> Raw<ShapeValue> {
        pass(
            Context::of(&call)?
                .bench()
                .shape_at(&loom, number(&t, "t")?),
        )
    }

    /// The shape at a point of the map, on the curve or off it.
    ///
    /// `loom.pose([x, y])`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.pose([0, 0]).vertices == bar.at(1).vertices, "a mesh");
    /// ```
    #[rhai_fn(name = "pose", return_raw)]
    pub fn pose(call: NativeCallContext, loom: LoomValue, at: Array) -> Raw<ShapeValue> {
        pass(
            Context::of(&call)?
                .bench()
                .pose(&loom, point(&at.into(), "the point")?),
        )
    }

    /// How fast the vertices move at time t: psi'(t), without differences of frames.
    ///
    /// `loom.velocity(t)`
    ///
    /// A mesh whose coordinates are the velocities: per second where the loom knows its frame rate, else
    /// per frame.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// let still = compare(bar.velocity(2), bar.hold(2, 4).velocity(3.5));
    /// check(still.max > 0, "while it is held it does not move");
    /// ```
    #[rhai_fn(name = "velocity", return_raw)]
    pub fn velocity(call: NativeCallContext, loom: LoomValue, t: Dynamic) -> Raw<ShapeValue> {
        pass(
            Context::of(&call)?
                .bench()
                .velocity(&loom, number(&t, "t")?),
        )
    }
}
