//! Sets of shapes: maps from scratch, poses put on a loom's map, motions transferred by examples.

use rhai::plugin::*;
use rhai::{Array, Engine, Map};

use super::{frames_of, shapes};
use crate::diag::Diagnostic;
use crate::pipeline::{Examples, Frames, Keyed, LoomValue, ShapeValue};
use crate::script::arguments::{Options, Raw, items, point};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

/// Meshes and places of `[[mesh, [x, y]], ..]`.
fn placed(poses: Array) -> Raw<(Vec<ShapeValue>, Vec<[f64; 2]>)> {
    let (mut meshes, mut places) = (Array::new(), Vec::new());
    for pose in poses {
        match items(&pose, "a pose [mesh, [x, y]]")?.as_slice() {
            [mesh, place] => {
                meshes.push(mesh.clone());
                places.push(point(place, "a pose's place")?);
            }
            other => {
                let found = other.len();
                return raise(Diagnostic::error(format!(
                    "a pose is [mesh, [x, y]], got {found} items"
                )));
            }
        }
    }
    Ok((pass(shapes(meshes))?, places))
}

/// One side of examples: what stands for frames, or where they are.
fn side(context: &Context, shapes: Dynamic) -> Raw<Frames> {
    match shapes.clone().into_string() {
        Ok(pattern) => pass(super::sources::open_pattern(context, &pattern)),
        Err(_) => pass(frames_of(context, shapes, "the examples")),
    }
}

#[export_module]
mod functions {
    /// A loom from scratch: shapes put on a map by hand.
    ///
    /// `pose_map([[mesh, [x, y]], ..])`, `pose_map([[mesh, [x, y]], ..], #{ space, fps })`
    ///
    /// The map shows each mesh at its place and blends between them; all meshes have the same faces. Its
    /// motion visits them in order, one a frame; `path` sketches another. space is "vertices" where it is
    /// not given.
    ///
    /// ```rhai
    /// let poses = demo("cactus");
    /// let map = pose_map([[poses.frame(1), [0, 0]], [poses.frame(2), [2, 0]], [poses.frame(3), [1, 1]]]);
    /// check(compare(map.pose([2, 0]), poses.frame(2)).max < 1e-6, "each place shows its shape");
    /// check(map.path([[0, 0], [1, 0.5], [2, 0]], #{ frames: 48 }).frames == 48, "a motion");
    /// ```
    #[rhai_fn(name = "pose_map", return_raw)]
    pub fn pose_map(call: NativeCallContext, poses: Array) -> Raw<LoomValue> {
        pose_map_with(call, poses, Map::new())
    }

    #[rhai_fn(name = "pose_map", return_raw)]
    pub fn pose_map_with(call: NativeCallContext, poses: Array, options: Map) -> Raw<LoomValue> {
        let options = Options::new(options, &["space", "fps"])?;
        let (meshes, places) = placed(poses)?;
        let context = Context::of(&call)?;
        let poses = pass(context.bench().gather(&meshes))?;
        let space = options.word("space")?.unwrap_or_else(|| "vertices".into());
        let fps = options.number("fps")?;
        pass(context.bench().pose_map(&poses, &places, &space, fps))
    }

    /// Puts a shape on the map of a loom, so that a motion can pass through it.
    ///
    /// `loom.add_pose(mesh)`, `loom.add_pose(mesh, [x, y])`
    ///
    /// Without a place it lies where its distances from the frames say. The map shows exactly this shape
    /// there; frames that are sites stay, others near the place follow a little. On a site it replaces the
    /// shape there. The mesh has the loom's faces; a loom with root motion takes it as aligned with its
    /// first frame. Pin before, not after.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// let odd = bar.exaggerate(1.5).at(4);
    /// check(compare(bar.add_pose(odd, [2, 2]).pose([2, 2]), odd).max < 1e-5, "the shape is there");
    /// check(bar.add_pose(odd).frames == bar.frames, "time stays");
    /// ```
    #[rhai_fn(name = "add_pose", return_raw)]
    pub fn add_pose(call: NativeCallContext, loom: LoomValue, mesh: ShapeValue) -> Raw<LoomValue> {
        pass(Context::of(&call)?.bench().add_pose(&loom, &mesh, None))
    }

    #[rhai_fn(name = "add_pose", return_raw)]
    pub fn add_pose_at(
        call: NativeCallContext,
        loom: LoomValue,
        mesh: ShapeValue,
        at: Array,
    ) -> Raw<LoomValue> {
        let at = point(&at.into(), "the place")?;
        pass(Context::of(&call)?.bench().add_pose(&loom, &mesh, Some(at)))
    }

    /// Pairs of shapes of two meshes for `transfer`; the first pair is the reference pose of both.
    ///
    /// `examples(sources, targets)`
    ///
    /// Each is a sequence, an array of meshes, or a folder or pattern to open. Shape j of one belongs to
    /// shape j of the other; the two meshes need not have the same faces.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// let sources = [bar.at(1), bar.at(4), bar.at(8)];
    /// let big = bar.exaggerate(1.2);
    /// let pairs = examples(sources, [big.at(1), big.at(4), big.at(8)]);
    /// check(bar.transfer(pairs).frames == bar.frames, "time stays");
    /// ```
    #[rhai_fn(name = "examples", return_raw)]
    pub fn examples(
        call: NativeCallContext,
        sources: Dynamic,
        targets: Dynamic,
    ) -> Raw<Keyed<Examples>> {
        let context = Context::of(&call)?;
        let (sources, targets) = (side(&context, sources)?, side(&context, targets)?);
        pass(context.bench().examples(&sources, &targets))
    }

    /// The motion on another character, by example shapes.
    ///
    /// `loom.transfer(examples(sources, targets))`
    ///
    /// Source examples become their targets, and what lies between follows; what was done to time and
    /// poses stays. Frames far from what the examples span are warned of. Fit in "gradients" or
    /// "patch-lri" unless the motion is small.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ modes: 3 });
    /// let shapes = [bar.at(1), bar.at(30), bar.at(60), bar.at(100)];
    /// let same = bar.transfer(examples(shapes, shapes));
    /// check(compare(same, bar).max < 1e-5, "onto itself it is the same motion");
    /// ```
    #[rhai_fn(name = "transfer", return_raw)]
    pub fn transfer(
        call: NativeCallContext,
        loom: LoomValue,
        examples: Keyed<Examples>,
    ) -> Raw<LoomValue> {
        let context = Context::of(&call)?;
        let transferred = pass(context.bench().transfer(&loom, &examples))?;
        Ok(context.warned(transferred))
    }
}
