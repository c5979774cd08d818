//! glTF 2.0 (.gltf, .glb): skinned, morphed and moving meshes, sampled to frames.
//!
//! All meshes of the scene become one. Exporters split vertices where texture coordinates or normals
//! have a seam; vertices that stand at the same place in bind pose and are moved by the same joints and
//! morph targets are one vertex again, so that connectivity does not depend on the animation.
//!
//! Frames are taken at the animation's own rate where all keys lie on one grid of 10 to 240 a second,
//! else at 30 a second. A scene without animation is one frame. Texture coordinates keep OBJ's sense
//! (v up); names of nodes and materials become objects and materials.

mod accessor;
mod animation;
mod gather;
mod hierarchy;
mod pose;
mod sampling;

use std::sync::Arc;

use ::gltf as crates_gltf;
use crates_gltf::Document;
use crates_gltf::json::validation::Checked;
use rayon::prelude::*;

use super::{SceneFormat, nothing_in_it};
use crate::diag::{Diagnostic, Result, Warned};
use crate::mesh::Sequence;

use accessor::Buffers;
use animation::Track;
use hierarchy::Hierarchy;

/// glTF 2.0.
pub struct Gltf;

impl SceneFormat for Gltf {
    fn read(
        &self,
        bytes: &[u8],
        animation: Option<&str>,
        resource: &dyn Fn(&str) -> Result<Vec<u8>>,
    ) -> Result<Warned<Sequence>> {
        if bytes.is_empty() {
            return nothing_in_it().err();
        }
        let (document, blob) = parse(bytes)?;
        let buffers = Buffers::load(&document, blob, resource)?;
        let hierarchy = Hierarchy::new(&document)?;
        let (chosen, warnings) = choose(&document, animation)?;
        let tracks = match chosen {
            Some(chosen) => animation::tracks(&chosen, &buffers)?,
            None => Vec::new(),
        };
        let gathered = gather::gather(&document, &hierarchy, &buffers)?;
        let output = sample(&gathered, &hierarchy, &tracks)?;
        Ok(Warned { output, warnings })
    }
}

/// The crate's validation is run after what it takes for granted: see [`prepare`].
fn parse(bytes: &[u8]) -> Result<(Document, Option<Vec<u8>>)> {
    // the length in the header of a GLB counts the header
    let short = bytes.starts_with(b"glTF")
        && bytes
            .get(8..12)
            .is_none_or(|length| length[0] < 12 && length[1..] == [0; 3]);
    if short {
        return damaged("the header of the GLB is too short").err();
    }
    let failed = |error: crates_gltf::Error| Box::new(damaged(&error.to_string()));
    let parsed = crates_gltf::Gltf::from_slice_without_validation(bytes).map_err(failed)?;
    let mut root = parsed.document.into_json();
    prepare(&mut root)?;
    let document = Document::from_json(root).map_err(failed)?;
    Ok((document, parsed.blob))
}

/// Refuses places that the validation would look up without a check, and gives positions the bounds
/// that it insists on and nothing here needs.
fn prepare(root: &mut crates_gltf::json::Root) -> Result<()> {
    let origin = || Some(serde_json::json!([0.0, 0.0, 0.0]));
    let primitives = root.meshes.iter().flat_map(|mesh| &mesh.primitives);
    for primitive in primitives {
        let positions = crates_gltf::Semantic::Positions;
        let Some(index) = primitive.attributes.get(&Checked::Valid(positions)) else {
            continue;
        };
        let Some(accessor) = root.accessors.get_mut(index.value()) else {
            return damaged("positions that are not there").err();
        };
        accessor.min = accessor.min.take().or_else(origin);
        accessor.max = accessor.max.take().or_else(origin);
    }
    for channel in root.animations.iter().flat_map(|one| &one.channels) {
        let known = matches!(channel.target.path, Checked::Valid(_));
        if !known || channel.target.node.value() >= root.nodes.len() {
            return damaged("an animation moves what is not there").err();
        }
    }
    Ok(())
}

fn damaged(reason: &str) -> Diagnostic {
    Diagnostic::error(format!("not a whole glTF file: {reason}"))
        .hint("the file is cut short, damaged, or needs an extension that is not known")
}

/// The animation of this name, or the first, with a warning if there are others.
fn choose<'a>(
    document: &'a Document,
    name: Option<&str>,
) -> Result<(Option<crates_gltf::Animation<'a>>, Vec<Diagnostic>)> {
    let title = |animation: &crates_gltf::Animation| match animation.name() {
        Some(name) => name.to_string(),
        None => (animation.index() + 1).to_string(),
    };
    let names: Vec<String> = document.animations().map(|one| title(&one)).collect();
    let Some(name) = name else {
        let warning = || {
            Diagnostic::warning(format!(
                "{} animations, `{}` is taken",
                names.len(),
                names[0]
            ))
            .hint(format!("choose with FILE#NAME: {}", names.join(", ")))
        };
        let warnings = (names.len() > 1).then(warning).into_iter().collect();
        return Ok((document.animations().next(), warnings));
    };
    match document.animations().find(|one| title(one) == name) {
        Some(animation) => Ok((Some(animation), Vec::new())),
        None if names.is_empty() => {
            Diagnostic::error(format!("no animation `{name}`: the scene does not move")).err()
        }
        None => Diagnostic::error(format!("no animation `{name}`"))
            .hint(format!("there are {}", names.join(", ")))
            .err(),
    }
}

fn sample(
    gathered: &gather::Gathered,
    hierarchy: &Hierarchy,
    tracks: &[Track],
) -> Result<Sequence> {
    let times = sampling::times(tracks)?;
    let width = 3 * gathered.topology.vertices();
    let mut positions = Vec::new();
    let length = width.saturating_mul(times.frames);
    if positions.try_reserve_exact(length).is_err() {
        let frames = times.frames;
        return Diagnostic::error(format!("{frames} frames do not fit in memory")).err();
    }
    positions.resize(length, 0.0);
    let frames = positions.par_chunks_exact_mut(width).enumerate();
    frames.for_each(|(frame, positions)| {
        pose::pose(gathered, hierarchy, tracks, times.at(frame), positions);
    });
    Ok(Sequence::new(
        Arc::clone(&gathered.topology),
        positions,
        times.fps,
    ))
}
