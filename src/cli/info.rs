//! `meshloom info INPUT..`: what a capture is.

use serde_json::{Value, json};

use super::args::Input;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::mesh::Bounds;
use crate::pipeline::{SpaceReport, best_space, compare_spaces, describe, why_best_space};

/// Say what a capture holds
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,

    /// Fit every second frame in each shape space and measure the frames between: which suits this
    /// capture
    #[arg(long)]
    spaces: bool,
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
    let mut object = json!(what);
    let mut text = report::table(session.style, &title(args), &rows);
    if args.spaces {
        let sequence = capture.content.sequence(&session.task)?;
        let found = compare_spaces(&sequence, &session.task)?;
        let names: Vec<&str> = found.iter().map(|space| space.name).collect();
        let seconds = session.progress.seconds(&names);
        object["spaces"] = found.iter().map(|space| as_data(space, &seconds)).collect();
        object["best_space"] = json!(best_space(&found).map(|space| space.name));
        object["why"] = json!(why_best_space(&found));
        text += &spaces_table(session, &found, &seconds);
    }
    Ok(Outcome {
        object,
        report: text,
        ..Outcome::default()
    })
}

fn as_data(space: &SpaceReport, seconds: &Value) -> Value {
    let mut data = space.data();
    data["seconds"] = seconds[space.name].clone();
    data
}

/// Errors between frames in each space, and which suits the capture.
fn spaces_table(session: &Session, found: &[SpaceReport], seconds: &Value) -> String {
    let rows: Vec<(&str, String)> = found
        .iter()
        .map(|space| {
            let of = |error: f64| report::percent(100.0 * error);
            let size = report::bytes(8 * space.numbers as u64);
            let took = report::number(seconds[space.name].as_f64().unwrap_or(0.0));
            let text = format!(
                "psi {:<8} linear {:<8} cubic {:<8} m = {:<4} {size:>9} {took:>6} s{}",
                of(space.psi),
                of(space.linear),
                of(space.cubic),
                space.modes,
                match space.large_turns {
                    0 => String::new(),
                    turns => format!("  {turns} turns in doubt"),
                },
            );
            (space.name, text)
        })
        .collect();
    let title = "between frames, in vertex positions";
    let mut text = report::table(session.style, title, &rows);
    if let Some(best) = best_space(found) {
        text += &format!("  {} suits it best ({})\n", best.name, best.summary);
        text += &format!("  {}\n", why_best_space(found).unwrap_or_default());
    }
    text
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
