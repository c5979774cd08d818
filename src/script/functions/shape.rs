//! What the shapes are: exaggeration, and other edits of h.

use rhai::Engine;
use rhai::plugin::*;

use super::time::edited;
use crate::pipeline::{Edit, LoomValue};
use crate::script::arguments::{Raw, number};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

#[export_module]
mod functions {
    /// Moves every shape away from the mean shape (above 1) or towards it (below 1).
    ///
    /// `loom.exaggerate(amount)`
    ///
    /// x becomes amount * x; 1 changes nothing.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.exaggerate(1.5).frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "exaggerate", return_raw)]
    pub fn exaggerate(call: NativeCallContext, loom: LoomValue, amount: Dynamic) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::Exaggerate {
                amount: number(&amount, "amount")?,
            },
        )
    }
}
