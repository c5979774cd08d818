//! Statistics of shapes.

use std::sync::Arc;

use rhai::plugin::*;
use rhai::{Engine, Map};

use super::frames_of;
use super::sources::dynamic;
use crate::pipeline::{ShapeValue, StatisticsRequest, StatisticsValue, Value};
use crate::script::arguments::{Options, Raw, count, number};
use crate::script::context::Context;
use crate::script::diagnostics::pass;

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
    engine.register_global_module(exported_module!(fields).into());
}

fn request(options: Map) -> Raw<StatisticsRequest> {
    let options = Options::new(options, &["space", "scale_free"])?;
    let default = StatisticsRequest::default();
    let free = options.truth("scale_free")?;
    Ok(StatisticsRequest {
        space: options.word("space")?.unwrap_or(default.space),
        scale_free: free.unwrap_or(default.scale_free),
    })
}

fn analysed(call: &NativeCallContext, given: Dynamic, options: Map) -> Raw<StatisticsValue> {
    let context = Context::of(call)?;
    let poses = pass(frames_of(&context, given, "the poses"))?;
    pass(context.bench().statistics(&poses, &request(options)?))
}

#[export_module]
mod functions {
    /// The mean shape of poses of one mesh; it lies where the first one lies.
    ///
    /// `mean(poses)`, `mean(poses, #{ space, scale_free })`
    ///
    /// poses is an array of meshes, or a sequence; space a shape space or "edge-lengths" (gradients);
    /// scale_free: true makes all poses the same size first.
    ///
    /// ```rhai
    /// let bar = demo("bar");
    /// let straight = bar.frame(1);
    /// check(compare(mean([straight, straight]), straight).rms < 0.0001, "copies are their mean");
    /// ```
    #[rhai_fn(name = "mean", return_raw)]
    pub fn mean(call: NativeCallContext, poses: Dynamic) -> Raw<ShapeValue> {
        mean_with(call, poses, Map::new())
    }

    #[rhai_fn(name = "mean", return_raw)]
    pub fn mean_with(call: NativeCallContext, poses: Dynamic, options: Map) -> Raw<ShapeValue> {
        let found = super::analysed(&call, poses, options)?;
        let context = Context::of(&call)?;
        let mean = pass(context.bench().mean_shape(&found))?;
        Ok(context.warned(mean))
    }

    /// The principal components of poses of one mesh.
    ///
    /// `pca(poses)`, `pca(poses, #{ space, scale_free })`
    ///
    /// As `mean`. Fields: modes, explained (shares of the variance), sigmas, coordinates (of each pose along
    /// each mode). `plot(pca, path)` draws the poses by their first two modes.
    ///
    /// ```rhai
    /// let bends = pca(demo("bar").slice(1, 6), #{ space: "gradients" });
    /// check(bends.explained[0] > 0.9, "bending is one direction");
    /// check(bends.coordinates.len == 6, "a point for each pose");
    /// ```
    #[rhai_fn(name = "pca", return_raw)]
    pub fn pca(call: NativeCallContext, poses: Dynamic) -> Raw<StatisticsValue> {
        super::analysed(&call, poses, Map::new())
    }

    #[rhai_fn(name = "pca", return_raw)]
    pub fn pca_with(call: NativeCallContext, poses: Dynamic, options: Map) -> Raw<StatisticsValue> {
        super::analysed(&call, poses, options)
    }

    /// The shape so many standard deviations along a mode (from 1) of principal components.
    ///
    /// `pca.sample(mode, sigmas)`
    ///
    /// ```rhai
    /// let bends = pca(demo("bar").slice(1, 6));
    /// let more = bends.sample(1, 2);
    /// check(more.vertices == demo("bar").vertices, "a mesh");
    /// ```
    #[rhai_fn(name = "sample", return_raw)]
    pub fn sample(
        call: NativeCallContext,
        found: StatisticsValue,
        mode: Dynamic,
        sigmas: Dynamic,
    ) -> Raw<ShapeValue> {
        let context = Context::of(&call)?;
        let (mode, sigmas) = (count(&mode, "mode", 1)?, number(&sigmas, "sigmas")?);
        let shape = pass(context.bench().sample_mode(&found, mode, sigmas))?;
        Ok(context.warned(shape))
    }

    /// Expression transfer: the shape that a pose becomes when the difference between two other shapes of
    /// the same mesh is added to it.
    ///
    /// `add_difference(pose, from, to)`, `add_difference(pose, from, to, #{ space })`
    ///
    /// space is a shape space or "edge-lengths" (gradients). The result lies where the pose lies.
    ///
    /// ```rhai
    /// let face = demo("face");
    /// let smile = add_difference(face.frame(1), face.frame(1), face.frame(8));
    /// check(compare(smile, face.frame(8)).edge_rms_percent < 0.01, "from itself it leads to the other");
    /// ```
    #[rhai_fn(name = "add_difference", return_raw)]
    pub fn add_difference(
        call: NativeCallContext,
        pose: ShapeValue,
        from: ShapeValue,
        to: ShapeValue,
    ) -> Raw<ShapeValue> {
        add_difference_with(call, pose, from, to, Map::new())
    }

    #[rhai_fn(name = "add_difference", return_raw)]
    pub fn add_difference_with(
        call: NativeCallContext,
        pose: ShapeValue,
        from: ShapeValue,
        to: ShapeValue,
        options: Map,
    ) -> Raw<ShapeValue> {
        let options = Options::new(options, &["space"])?;
        let space = options.word("space")?;
        let space = space.unwrap_or(StatisticsRequest::default().space);
        let context = Context::of(&call)?;
        let moved = pass(context.bench().add_difference(&[pose, from, to], &space))?;
        Ok(context.warned(moved))
    }

    #[rhai_fn(name = "plot", return_raw)]
    pub fn plot_pca(call: NativeCallContext, found: StatisticsValue, path: &str) -> Raw<()> {
        let context = Context::of(&call)?;
        let picture = pass(context.bench().plot_statistics(&found, path))?;
        pass(context.save(Value::Picture(Arc::new(picture)), path))
    }
}

/// Fields of principal components.
#[export_module]
mod fields {
    #[rhai_fn(get = "modes", pure)]
    pub fn modes(found: &mut StatisticsValue) -> i64 {
        found.value.modes() as i64
    }

    #[rhai_fn(get = "explained", pure)]
    pub fn explained(found: &mut StatisticsValue) -> Dynamic {
        dynamic(&serde_json::json!(found.value.report().explained))
    }

    #[rhai_fn(get = "sigmas", pure)]
    pub fn sigmas(found: &mut StatisticsValue) -> Dynamic {
        dynamic(&serde_json::json!(found.value.report().sigmas))
    }

    #[rhai_fn(get = "coordinates", pure)]
    pub fn coordinates(found: &mut StatisticsValue) -> Dynamic {
        dynamic(&serde_json::json!(found.value.report().coordinates))
    }
}
