//! What is to be shown, made from what was opened, fitted or edited.

use std::sync::Arc;

use super::state::{Content, Same, Scene, Signals};
use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::mesh::{Bounds, Sequence};
use crate::pipeline::plot::plot_loom;

/// A loom's box is taken from so many of its frames.
const BOUNDS_SAMPLES: usize = 32;

/// Frames alone; `None` for a capture without vertices.
///
/// # Errors
/// A frame cannot be fetched.
pub(super) fn frames(sequence: Sequence) -> Result<Option<Content>> {
    let bounds = Bounds::of_frames(&sequence)
        .map_err(|error| Diagnostic::error(format!("a frame cannot be fetched: {error}")))?;
    Ok(bounds.map(|bounds| {
        Content::Capture(Scene {
            of: Same::new(sequence),
            bounds,
        })
    }))
}

/// A loom with its plots.
///
/// # Errors
/// A frame cannot be evaluated.
pub(super) fn loom(loom: Arc<Loom>) -> Result<Content> {
    let bounds = box_of(&loom)?;
    Ok(loom_within(loom, bounds))
}

/// A loom with its plots, in a box that is known.
pub(super) fn loom_within(loom: Arc<Loom>, bounds: Bounds) -> Content {
    let (map, times) = plot_loom(&loom);
    let scene = Scene {
        of: Same(loom),
        bounds,
    };
    Content::Loom(scene, Same::new(Signals { map, times }))
}

/// The box around some of a loom's frames, the first and the last among them.
fn box_of(loom: &Loom) -> Result<Bounds> {
    let n = loom.frames();
    let count = n.min(BOUNDS_SAMPLES);
    let mut all: Option<Bounds> = None;
    for index in 0..count {
        let t = 1.0 + (index * (n - 1)) as f64 / (count - 1).max(1) as f64;
        let one = Bounds::of(&loom.at(t)?);
        all = all.into_iter().chain(one).reduce(Bounds::join);
    }
    Ok(all.unwrap_or(Bounds {
        min: [0.0; 3],
        max: [0.0; 3],
    }))
}
