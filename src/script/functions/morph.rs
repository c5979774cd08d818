//! What lies between poses.

use rhai::plugin::*;
use rhai::{Engine, Map};

use super::frames_of;
use crate::diag::Diagnostic;
use crate::pipeline::{Frames, MorphMethod, MorphPath, MorphRequest};
use crate::script::arguments::{Options, Raw, items, numbers};
use crate::script::context::Context;
use crate::script::diagnostics::pass;

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

fn request(options: Map) -> Raw<MorphRequest> {
    let known = ["method", "space", "frames", "path", "squared", "every"];
    let options = Options::new(options, &known)?;
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
        path: options.get("path").map(path).transpose()?,
        squared: options.truth("squared")?.unwrap_or(false),
        every: options.count("every", 1)?,
    })
}

/// A path as a text, or as an array of points.
fn path(value: &Dynamic) -> Raw<MorphPath> {
    if value.is_string() {
        let text = value.to_string();
        return pass(
            text.parse()
                .or_else(|told: String| Diagnostic::error(told).err()),
        );
    }
    let points = items(value, "path")?;
    let points: Raw<Vec<Vec<f64>>> = points.iter().map(|point| numbers(point, "path")).collect();
    let points = points?;
    match points.len() >= 2 && points.iter().all(|point| point.len() == points[0].len()) {
        true => Ok(MorphPath::Points(points)),
        false => pass(
            Diagnostic::error(
                "a path needs two or more points with the same number of coordinates",
            )
            .err(),
        ),
    }
}

#[export_module]
mod functions {
    /// The frames between poses of one mesh; those at the poses are the poses themselves.
    ///
    /// `morph(poses)`, `morph(poses, #{ method, space, frames, path, squared, every })`
    ///
    /// poses is an array of meshes, or a sequence; frames is their number over the whole (24 from each pose
    /// to the next). method "isometric": edge lengths go linearly, triangles turn as their neighbours do;
    /// "spline": one curve through all poses in a shape space (patch-lri); "edge-lengths": lengths go
    /// linearly and are met as near as a shape can. With that, path may be "circle" (four poses at the
    /// corners of a square) or points ([x, y] in that square, else one weight a pose), squared blends the
    /// squares of lengths, and every embeds each so many frames only. "conformal": one factor a vertex scales
    /// the edges at it, between conformally equivalent poses, or from one closed mesh to the sphere.
    ///
    /// ```rhai
    /// let bar = demo("bar");
    /// let bend = morph([bar.frame(1), bar.frame(20)], #{ frames: 5 });
    /// check(bend.frames == 5, "both ends are among them");
    /// check(compare(bend.frame(5), bar.frame(20)).max == 0, "the last is the second pose");
    /// let back = morph([bar.frame(1), bar.frame(20)],
    ///     #{ method: "edge-lengths", path: [[0, 1], [0.5, 0.5]], frames: 2 });
    /// check(compare(back.frame(2), bend.frame(3)).edge_rms_percent < 1, "half way both keep lengths");
    /// let ball = morph([demo("cactus").frame(1)], #{ method: "conformal", frames: 3 });
    /// check(ball.frames == 3, "the last is the sphere");
    /// ```
    #[rhai_fn(name = "morph", return_raw)]
    pub fn morph(call: NativeCallContext, poses: Dynamic) -> Raw<Frames> {
        morph_with(call, poses, Map::new())
    }

    #[rhai_fn(name = "morph", return_raw)]
    pub fn morph_with(call: NativeCallContext, poses: Dynamic, options: Map) -> Raw<Frames> {
        let context = Context::of(&call)?;
        let poses = pass(frames_of(&context, poses, "the poses"))?;
        let found = pass(context.bench().morph(&poses, &super::request(options)?))?;
        Ok(context.warned(found))
    }
}
