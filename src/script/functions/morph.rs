//! What lies between poses.

use rhai::plugin::*;
use rhai::{Engine, Map};

use super::keys::shapes;
use crate::diag::Diagnostic;
use crate::pipeline::{Frames, MorphMethod, MorphRequest};
use crate::script::arguments::{Options, Raw};
use crate::script::context::Context;
use crate::script::diagnostics::pass;

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

fn request(options: Map) -> Raw<MorphRequest> {
    let options = Options::new(options, &["method", "space", "frames"])?;
    let method = options
        .word("method")?
        .map_or(Ok(MorphMethod::default()), |name| {
            name.parse()
                .or_else(|told: String| Diagnostic::error(told).err())
        });
    Ok(MorphRequest {
        method: pass(method)?,
        frames: options.count("frames", 2)?,
        space: options.word("space")?,
    })
}

#[export_module]
mod functions {
    /// The frames between poses of one mesh; those at the poses are the poses themselves.
    ///
    /// `morph(poses)`, `morph(poses, #{ method, space, frames })`
    ///
    /// poses is an array of meshes, or a sequence; frames is their number over the whole (24 from each pose
    /// to the next). method "isometric": edge lengths go linearly, triangles turn as their neighbours do;
    /// "spline": one curve through all poses in a shape space (patch-lri).
    ///
    /// ```rhai
    /// let bar = demo("bar");
    /// let bend = morph([bar.frame(1), bar.frame(20)], #{ frames: 5 });
    /// check(bend.frames == 5, "both ends are among them");
    /// check(compare(bend.frame(5), bar.frame(20)).max == 0, "the last is the second pose");
    /// ```
    #[rhai_fn(name = "morph", return_raw)]
    pub fn morph(call: NativeCallContext, poses: Dynamic) -> Raw<Frames> {
        morph_with(call, poses, Map::new())
    }

    #[rhai_fn(name = "morph", return_raw)]
    pub fn morph_with(call: NativeCallContext, poses: Dynamic, options: Map) -> Raw<Frames> {
        let context = Context::of(&call)?;
        let poses = shapes(&context, poses, "the poses")?;
        let found = pass(context.bench().morph(&poses, &super::request(options)?))?;
        Ok(context.warned(found))
    }
}
