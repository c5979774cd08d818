//! What a workbench does with sets of shapes: maps of poses, poses added, motions transferred by examples.

use super::key::KeyBuilder;
use super::memory::Remembered;
use super::value::{Frames, Keyed, LoomValue, ShapeValue};
use super::workbench::{Found, Workbench};
use super::{best_space, compare_spaces, why_best_space};
use crate::diag::{Diagnostic, Result, Warned};
use crate::edit;
use crate::edit::transfer::{Examples, transfer};
use crate::loom::Loom;
use crate::loom::pose_map::pose_map;
use crate::mesh::FrameSource;

/// What a comparison of spaces found, as JSON.
struct Spaces(String);

impl Remembered for Spaces {
    fn size(&self) -> usize {
        self.0.len()
    }

    fn to_bytes(&self) -> Option<Vec<u8>> {
        Some(self.0.clone().into_bytes())
    }

    fn from_bytes(bytes: &[u8]) -> Option<Self> {
        String::from_utf8(bytes.to_vec()).ok().map(Spaces)
    }
}

impl Workbench {
    /// A loom from scratch: each pose at its place of the map, in `space`.
    ///
    /// # Errors
    /// As [`pose_map`].
    pub fn pose_map(
        &self,
        poses: &Frames,
        places: &[[f64; 2]],
        space: &str,
        fps: Option<f64>,
    ) -> Result<LoomValue> {
        let key = with_places(poses.then("pose_map"), places)
            .text(space)
            .number(fps.unwrap_or(0.0))
            .finish();
        let (loom, made) = self.memory().remember(key, || {
            pose_map(&poses.value, places, space, fps, self.task())
        })?;
        self.hold_loom(&loom)?;
        self.note("pose_map", format!("{} poses", poses.frames()), made);
        Ok(LoomValue::bare(Keyed { value: loom, key }))
    }

    /// The loom with a shape put on its map. It can no longer be laid out anew.
    ///
    /// # Errors
    /// As [`edit::add_pose`].
    pub fn add_pose(
        &self,
        loom: &LoomValue,
        shape: &ShapeValue,
        at: Option<[f64; 2]>,
    ) -> Result<LoomValue> {
        self.task().check()?;
        let of = &loom.loom.value;
        if !shape.value.topology.same_connectivity(of.topology()) {
            let (found, wanted) = (shape.vertices(), of.topology().vertices());
            let message =
                format!("the mesh has other faces than the loom ({found} and {wanted} vertices)");
            return Diagnostic::error(message)
                .hint("a pose is a shape of the loom's own mesh")
                .err();
        }
        let added = edit::add_pose(of, &shape.value.positions, at)?;
        self.hold_loom(&added)?;
        let key = loom.loom.then("add_pose").key(shape.key);
        let key = with_places(key, at.as_slice()).finish();
        Ok(LoomValue::bare(Keyed::new(added, key)))
    }

    /// Pairs of shapes that correspond.
    ///
    /// # Errors
    /// As [`Examples::new`].
    pub fn examples(&self, sources: &Frames, targets: &Frames) -> Result<Keyed<Examples>> {
        let examples = Examples::new((*sources.value).clone(), (*targets.value).clone())?;
        let key = sources.then("examples").key(targets.key).finish();
        Ok(Keyed::new(examples, key))
    }

    /// The loom on the mesh of the target examples; what was done to its time and poses stays. It can no
    /// longer be laid out anew.
    ///
    /// # Errors
    /// As [`transfer`].
    pub fn transfer(
        &self,
        loom: &LoomValue,
        examples: &Keyed<Examples>,
    ) -> Result<Warned<LoomValue>> {
        let key = loom.loom.then("transfer").key(examples.key).finish();
        let (found, made) = self.memory().remember(key, || {
            let mut warnings = Vec::new();
            let source: &Loom = &loom.loom.value;
            let transferred = transfer(source, &examples.value, self.task())?;
            let loom = transferred.unpack(&mut warnings).loom;
            Ok(Found { loom, warnings })
        })?;
        self.note(
            "transfer",
            format!("{} pairs", examples.value.pairs()),
            made,
        );
        Ok(Warned {
            output: LoomValue::bare(Keyed::new(found.loom.clone(), key)),
            warnings: found.warnings.clone(),
        })
    }

    /// psi'(t) as a mesh whose "positions" are the velocities of the vertices: per second where the loom
    /// knows its rate, else per frame.
    ///
    /// # Errors
    /// `t` is outside of the loom.
    pub fn velocity(&self, loom: &LoomValue, t: f64) -> Result<ShapeValue> {
        let of = &loom.loom.value;
        let rate = of.fps().unwrap_or(1.0);
        let velocity = of.velocity(t)?;
        let velocity = velocity.iter().map(|v| (v * rate) as f32).collect();
        self.shape(of, velocity, loom.loom.then("velocity").number(t).finish())
    }

    /// How each shape space does on a capture, as the command line's JSON has it, and the best one's name.
    ///
    /// # Errors
    /// As [`compare_spaces`].
    pub fn spaces(&self, frames: &Frames) -> Result<serde_json::Value> {
        let key = frames.then("spaces").finish();
        let (spaces, made) = self.memory().remember(key, || {
            let found = compare_spaces(&frames.value, self.task())?;
            let spaces: Vec<_> = found.iter().map(super::SpaceReport::data).collect();
            let best = best_space(&found).map(|space| space.name);
            let why = why_best_space(&found);
            let data = serde_json::json!({ "best": best, "why": why, "spaces": spaces });
            Ok(Spaces(data.to_string()))
        })?;
        self.note("spaces", format!("{} frames", frames.value.frames()), made);
        Ok(serde_json::from_str(&spaces.0).unwrap_or_default())
    }
}

fn with_places(key: KeyBuilder, places: &[[f64; 2]]) -> KeyBuilder {
    places
        .iter()
        .fold(key, |key, place| key.number(place[0]).number(place[1]))
}
