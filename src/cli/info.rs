//! `meshloom info INPUT..`: what a capture is.

use serde_json::json;

use super::args::Input;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::mesh::Bounds;
use crate::pipeline::describe;

/// Say what a capture holds
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let capture = session.open(&args.input.part.of(&args.input.inputs, None))?;
    let what = describe(&capture)?;
    let closed = if what.closed { " (closed)" } else { "" };
    let corner = |of: fn(&Bounds) -> [f32; 3]| {
        let corner = what.bounds.as_ref().map(of);
        corner.map_or("nothing".into(), point)
    };
    let rate = what.fps.map_or("not known".into(), report::number);
    let size = report::bytes(what.bytes);
    let files = report::count(capture.origin.files.len(), "file");
    let rows = [
        ("frames", what.frames.to_string()),
        ("frames a second", rate),
        ("vertices", what.vertices.to_string()),
        ("faces", what.faces.to_string()),
        ("edges", what.edges.to_string()),
        ("components", what.components.to_string()),
        ("boundary edges", format!("{}{closed}", what.boundary_edges)),
        ("from", corner(|bounds| bounds.min)),
        ("to", corner(|bounds| bounds.max)),
        ("format", format!("{}, {size} in {files}", what.format)),
    ];
    Ok(Outcome {
        object: json!(what),
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
