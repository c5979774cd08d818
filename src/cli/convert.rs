//! `meshloom convert INPUT.. -o OUT`: frames from one format to another.

use std::path::PathBuf;

use serde_json::json;

use super::args::{Input, positive};
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::pipeline::{self, Output};

/// Write the frames of a capture in another format
///
/// USD (.usd, .usda, .usdc, .usdz) and Alembic (.abc) cannot be read or written yet.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,

    /// One file, or a folder or pattern (frame_####.obj) for a file a frame
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,

    /// Frames per second, for formats that carry a rate
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let capture = session.open(&args.input.part.of(&args.input.inputs, args.fps))?;
    let output = Output::from(&args.output).protecting(&capture.origin.files);
    let saved = pipeline::save(
        session.world(),
        &*capture.content.frames(),
        &output,
        &session.task,
    )?;
    Ok(Outcome {
        object: json!({
            "outputs": report::paths(&saved.outputs),
            "frames": saved.frames,
            "seconds": session.progress.seconds(&["load", "write"]),
            "warnings": [],
        }),
        report: report::saved(session.style, &saved),
        ..Outcome::default()
    })
}
