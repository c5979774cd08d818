//! What a capture is.

use serde::Serialize;

use super::open::Capture;
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Bounds, Edges};

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
