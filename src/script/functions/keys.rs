//! What lies between key poses.

use rhai::plugin::*;
use rhai::{Engine, Map};

use super::frames_of;
use crate::diag::Diagnostic;
use crate::pipeline::{CompleteRequest, Frames, Times, Velocities};
use crate::script::arguments::{Options, Raw, numbers};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

const OPTIONS: [&str; 17] = [
    "times",
    "frames",
    "at",
    "fps",
    "space",
    "boundary",
    "drift",
    "start_velocity",
    "end_velocity",
    "velocities_from",
    "tension",
    "continuity",
    "bias",
    "overshoot",
    "ghost",
    "lift",
    "residual",
];

fn request(context: &Context, options: Map) -> Raw<CompleteRequest> {
    let options = Options::new(options, &OPTIONS)?;
    let list = |name: &str| match options.get(name) {
        None => Ok(None),
        Some(value) if value.is_array() => numbers(value, name).map(Some),
        Some(_) => Ok(options.number(name)?.map(|number| vec![number])),
    };
    let poses = |name: &str| {
        let value = options.get(name).cloned();
        value
            .map(|value| pass(frames_of(context, value, name)))
            .transpose()
    };
    let count = options.count("frames", 1)?.map(Times::Count);
    let at = list("at")?.map(Times::List);
    if count.is_some() && at.is_some() {
        return raise(
            Diagnostic::error("`frames` and `at` both say which frames are made")
                .hint("`frames` counts them, evenly; `at` lists their times"),
        );
    }
    Ok(CompleteRequest {
        times: list("times")?,
        at: count.or(at).unwrap_or_default(),
        fps: options.number("fps")?,
        space: options.word("space")?,
        boundary: options.word("boundary")?,
        drift: options.word("drift")?,
        velocities: Velocities {
            start: poses("start_velocity")?,
            end: poses("end_velocity")?,
            both: poses("velocities_from")?,
        },
        tension: list("tension")?.unwrap_or_default(),
        continuity: list("continuity")?.unwrap_or_default(),
        bias: list("bias")?.unwrap_or_default(),
        overshoot: options.number("overshoot")?,
        ghost: match options.get("ghost") {
            Some(value) if value.is_string() => options.word("ghost")?,
            _ => options.count("ghost", 1)?.map(|faces| faces.to_string()),
        },
        lift: options.word("lift")?,
        residual: options.truth("residual")?,
    })
}

#[export_module]
mod functions {
    /// Key poses completed to a motion by splines in a shape space: a sequence.
    ///
    /// `complete(keys)`, `complete(keys, #{ times, frames, at, fps, space, boundary, drift, start_velocity, end_velocity, velocities_from, tension, continuity, bias, overshoot, ghost, lift, residual })`
    ///
    /// keys is a sequence or an array of meshes. times are the keys' (1, 25, 49, ..), in frames; frames
    /// counts the frames made, at lists their times (by default every step of 1). boundary is "natural",
    /// "periodic" (drift: "rigid" where the last key is the first, moved) or "hermite", with velocities
    /// as a pose that is reached within 24 frames, two poses, or from a sequence. tension, continuity and
    /// bias, from -1 to 1, are one number or one a key; overshoot (0, 0.1, ..) is the share of the range
    /// of two neighbouring keys by which a coordinate may leave it. Splines of a mesh of more than 20 000
    /// faces run on a ghost mesh of 2000: ghost is another number of faces or "off", lift "solve",
    /// "transfer" or "direct", residual false leaves out at the keys what the ghost cannot carry.
    ///
    /// ```rhai
    /// let keys = demo("bar").slice(1, 3);
    /// let motion = complete(keys, #{ times: [1, 5, 12], tension: [0, 0.5, 0] });
    /// check(motion.frames == 12, "frames 1 to 12");
    /// check(compare(keys.slice(2, 2), motion.slice(5, 5)).max < 0.0001, "a key at its time");
    /// ```
    #[rhai_fn(name = "complete", return_raw)]
    pub fn complete(call: NativeCallContext, keys: Dynamic) -> Raw<Frames> {
        complete_with(call, keys, Map::new())
    }

    #[rhai_fn(name = "complete", return_raw)]
    pub fn complete_with(call: NativeCallContext, keys: Dynamic, options: Map) -> Raw<Frames> {
        let context = Context::of(&call)?;
        let keys = pass(frames_of(&context, keys, "keys"))?;
        let request = request(&context, options)?;
        let completed = pass(context.bench().complete(&keys, &request))?;
        Ok(context.warned(completed))
    }
}
