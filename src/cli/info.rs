//! `meshloom info INPUT..`: what a capture is.

use serde_json::json;

use super::args::Input;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::{Diagnostic, Result};
use crate::mesh::{Bounds, Edges};

/// Say what a capture holds
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let capture = session.open(&args.input.part.of(&args.input.inputs, None))?;
    let frames = capture.content.frames();
    let topology = frames.topology();
    let edges = Edges::new(topology);
    let bounds = Bounds::of_frames(&*frames)
        .map_err(|error| Diagnostic::error(format!("a frame cannot be fetched: {error}")))?;
    let closed = topology.faces() > 0 && edges.boundary() == 0;
    let origin = &capture.origin;
    let rows = [
        ("frames", frames.frames().to_string()),
        (
            "frames a second",
            frames.fps().map_or("not known".into(), report::number),
        ),
        ("vertices", topology.vertices().to_string()),
        ("faces", topology.faces().to_string()),
        ("edges", edges.ends().len().to_string()),
        ("components", edges.components().to_string()),
        (
            "boundary edges",
            format!(
                "{}{}",
                edges.boundary(),
                if closed { " (closed)" } else { "" }
            ),
        ),
        (
            "from",
            bounds.map_or("nothing".into(), |bounds| point(bounds.min)),
        ),
        (
            "to",
            bounds.map_or("nothing".into(), |bounds| point(bounds.max)),
        ),
        (
            "format",
            format!(
                "{}, {} in {}",
                origin.format,
                report::bytes(origin.bytes),
                report::count(origin.files.len(), "file")
            ),
        ),
    ];
    Ok(Outcome {
        object: json!({
            "frames": frames.frames(),
            "vertices": topology.vertices(),
            "faces": topology.faces(),
            "edges": edges.ends().len(),
            "components": edges.components(),
            "boundary_edges": edges.boundary(),
            "closed": closed,
            "bounds": bounds.map(|bounds| json!({ "min": bounds.min, "max": bounds.max })),
            "fps": frames.fps(),
            "format": origin.format,
            "bytes": origin.bytes,
        }),
        report: report::table(session.style, &title(args), &rows),
        ..Outcome::default()
    })
}

fn title(args: &Args) -> String {
    let inputs = &args.input.inputs;
    match inputs.len() {
        1 => inputs[0].display().to_string(),
        many => format!("{} and {} more", inputs[0].display(), many - 1),
    }
}

fn point(point: [f32; 3]) -> String {
    point.map(|x| report::number(f64::from(x))).join("  ")
}
