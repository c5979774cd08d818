//! `meshloom demo [NAME]`: a built-in capture, fitted, sampled and drawn.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::report;
use super::session::{Outcome, Session};
use super::{fit, plot};
use crate::demo::{DEMOS, Demo};
use crate::diag::Result;
use crate::loom::fit::FitOptions;
use crate::mesh::FrameSource;
use crate::pipeline::{self, Output};
use crate::plot::Theme;
use crate::sample::{Sampled, Times};
use crate::signal::root::RootKind;

/// In-betweens are what a loom is for: frames are written at twice the rate.
const RATE: f64 = 2.0;

/// Fit a built-in capture; write its frames at twice the rate and a picture
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Which capture
    #[arg(value_name = "NAME", value_parser = names(), default_value = DEMOS[0].name)]
    name: String,

    /// Only say which captures there are
    #[arg(long)]
    list: bool,

    /// The folder to write into
    #[arg(long, value_name = "DIR", default_value = "meshloom-demo")]
    write: PathBuf,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    if args.list {
        return Ok(list(session));
    }
    let demo = Demo::find(&args.name).unwrap_or(&DEMOS[0]);
    session.task.phase("load", 0);
    let capture = (demo.generate)();
    let options = FitOptions {
        root: demo.travels.then_some(RootKind::Ground),
        ..FitOptions::default()
    };
    let loom = fit::fitted(session, &capture, &options)?;
    let file = |ending: &str| args.write.join(demo.name).with_extension(ending);
    let mut outputs = Vec::new();
    let mut save = |saved: pipeline::Saved| outputs.extend(saved.outputs);
    let loom_file = Output::from(file("loom"));
    save(pipeline::save_loom(
        session.world(),
        &loom,
        &loom_file,
        &session.task,
    )?);
    let picture = Output::from(file("png"));
    save(plot::draw(
        session,
        &loom,
        demo.name,
        &picture,
        [1200.0, 560.0],
        &Theme::light(),
    )?);
    let frames = Sampled::new(
        loom.clone(),
        Times::Rate(RATE).over(loom.frames(), loom.fps())?,
    );
    let pattern = Output::from(args.write.join("frames").join("frame_####.obj"));
    save(pipeline::save(
        session.world(),
        &frames,
        &pattern,
        &session.task,
    )?);
    Ok(Outcome {
        object: json!({
            "demo": demo.name,
            "outputs": report::paths(&outputs),
            "frames": frames.frames(),
            "report": fit::report(session, loom.report()),
            "seconds": session.progress.seconds(&fit::PHASES),
            "warnings": [],
        }),
        report: told(
            args,
            demo,
            session,
            &fit::summary(session, demo.name, loom.report()),
        ),
        ..Outcome::default()
    })
}

/// The report, what was written, and what to try next.
fn told(args: &Args, demo: &Demo, session: &Session, summary: &str) -> String {
    let shown = |path: &Path| path.display().to_string();
    let loom = shown(&args.write.join(demo.name).with_extension("loom"));
    let rows = [
        (
            shown(&args.write.join(demo.name).with_extension("png")),
            "its map and time signals",
        ),
        (
            shown(&args.write.join("frames")),
            "its frames at twice the rate",
        ),
        (
            loom.clone(),
            "the loom; try `meshloom sample` and `meshloom plot` on it",
        ),
    ];
    let rows: Vec<(&str, String)> = rows
        .iter()
        .map(|(name, what)| (name.as_str(), what.to_string()))
        .collect();
    format!(
        "{}\n{}{}",
        demo.about,
        summary,
        report::table(session.style, "written", &rows)
    )
}

fn list(session: &Session) -> Outcome {
    let rows: Vec<(&str, String)> = DEMOS
        .iter()
        .map(|demo| (demo.name, demo.about.to_string()))
        .collect();
    let demos: Vec<Value> = DEMOS
        .iter()
        .map(|demo| json!({ "name": demo.name, "about": demo.about }))
        .collect();
    Outcome {
        object: json!({ "demos": demos }),
        report: report::table(session.style, "built-in captures", &rows),
        ..Outcome::default()
    }
}

fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(DEMOS.iter().map(|demo| demo.name))
}
