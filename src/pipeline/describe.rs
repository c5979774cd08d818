//! What a capture is, and how far one is from another.

use serde::Serialize;

use super::open::Capture;
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Bounds, Edges};
use crate::metric::Comparison;

/// What a capture is: its counts, its surface, its place in space, where it came from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Description {
    /// n.
    pub frames: usize,
    /// V.
    pub vertices: usize,
    /// Polygons.
    pub faces: usize,
    /// Sides of polygons, each once.
    pub edges: usize,
    /// Parts that no edge joins.
    pub components: usize,
    /// Edges of one face only.
    pub boundary_edges: usize,
    /// Whether there are faces and no boundary edge.
    pub closed: bool,
    /// The box around all frames; none without vertices.
    pub bounds: Option<Bounds>,
    /// Frames per second, where it is known.
    pub fps: Option<f64>,
    /// The name of the format it was read from.
    pub format: &'static str,
    /// The length of its files in bytes.
    pub bytes: u64,
}

/// Describes a capture; looks at every frame.
///
/// # Errors
/// A frame cannot be fetched.
pub fn describe(capture: &Capture) -> Result<Description> {
    let frames = capture.content.frames();
    let topology = frames.topology();
    let edges = Edges::new(topology);
    let bounds = Bounds::of_frames(&*frames)
        .map_err(|error| Diagnostic::error(format!("a frame cannot be fetched: {error}")))?;
    Ok(Description {
        frames: frames.frames(),
        vertices: topology.vertices(),
        faces: topology.faces(),
        edges: edges.ends().len(),
        components: edges.components(),
        boundary_edges: edges.boundary(),
        closed: topology.faces() > 0 && edges.boundary() == 0,
        bounds,
        fps: frames.fps(),
        format: capture.origin.format,
        bytes: capture.origin.bytes,
    })
}

/// What a comparison found under the names that the command line and recipes give it: `frames`,
/// `kg_percent`, `rms`, `max`, `edge_rms_percent`, `edge_max_percent`.
pub fn compared(found: &Comparison) -> serde_json::Value {
    serde_json::json!({
        "frames": found.frames,
        "kg_percent": found.vertices.kg_percent,
        "rms": found.vertices.rms,
        "max": found.vertices.max,
        "edge_rms_percent": found.edges.rms_percent,
        "edge_max_percent": found.edges.max_percent,
    })
}
