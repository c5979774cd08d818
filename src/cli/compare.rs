//! `meshloom compare A B`: how far B is from A.

use std::path::{Path, PathBuf};

use super::args::Part;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::{Diagnostic, Result};
use crate::metric::{self, Comparison, MetricError};
use crate::pipeline::compared;
use crate::task::Cancelled;

/// Measure how far one sequence is from another
///
/// Both have the same vertices and the same number of frames. KG error: 100 |A - B| / |A - mean frame|.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The reference: a capture or a loom
    #[arg(value_name = "A")]
    first: PathBuf,

    /// What is measured: a capture or a loom
    #[arg(value_name = "B")]
    second: PathBuf,

    #[command(flatten)]
    part: Part,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let open = |path: &PathBuf| session.open(&args.part.of(std::slice::from_ref(path), None));
    let (first, second) = (open(&args.first)?, open(&args.second)?);
    let (first, second) = (first.content.frames(), second.content.frames());
    session.task.phase("compare", first.frames());
    let found = metric::compare(&*first, &*second, &session.task)
        .map_err(|error| explained(&error, &args.second))?;
    Ok(Outcome {
        object: compared(&found),
        report: report(args, session, &found),
        ..Outcome::default()
    })
}

fn report(args: &Args, session: &Session, found: &Comparison) -> String {
    let kg = if found.vertices.kg_percent.is_finite() {
        report::percent(found.vertices.kg_percent)
    } else {
        "not defined: the first sequence does not move".to_string()
    };
    let units = |value| format!("{} (mesh units)", report::number(value));
    let title = format!(
        "{} against {}, {}",
        args.second.display(),
        args.first.display(),
        report::count(found.frames, "frame")
    );
    let rows = [
        ("KG error", kg),
        ("rms distance", units(found.vertices.rms)),
        ("largest distance", units(found.vertices.max)),
        ("edge length rms", report::percent(found.edges.rms_percent)),
        (
            "edge length largest",
            report::percent(found.edges.max_percent),
        ),
    ];
    report::table(session.style, &title, &rows)
}

fn explained(error: &MetricError, second: &Path) -> Box<Diagnostic> {
    let told = match error {
        MetricError::Cancelled => return Cancelled.into(),
        MetricError::Vertices { .. } => Diagnostic::error(error.to_string())
            .hint("only frames of one connectivity can be compared"),
        MetricError::Frames { .. } => Diagnostic::error(error.to_string())
            .hint("choose as many frames of both with --range A:B"),
        MetricError::Read { frame, .. } => Diagnostic::error(error.to_string()).at_frame(frame + 1),
    };
    Box::new(told.in_file(second))
}
