//! `meshloom demo [NAME]`: a built-in capture, fitted, sampled and drawn.

use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::report;
use super::runs::Runs;
use super::session::{Outcome, Session};
use super::{fit, open, recipes};
use crate::demo::{DEMOS, Demo, Kind};
use crate::diag::Result;
use crate::loom::fit::FitOptions;
use crate::mesh::FrameSource;
use crate::pipeline::plot::save_plot;
use crate::pipeline::{self, contact_sheet, save_picture};
use crate::plot::Theme;
use crate::recipe::{Input, Request};
use crate::sample::{Sampled, Times};
use crate::signal::root::RootKind;

/// In-betweens are what a loom is for: frames are written at twice the rate.
const RATE: f64 = 2.0;
/// Frames on the contact sheet.
const SHEET: usize = 24;

/// Look at a built-in capture; without a terminal, fit it and write frames at twice its rate and pictures
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Which capture
    #[arg(value_name = "NAME", value_parser = names(), default_value = DEMOS[0].name)]
    name: String,

    /// Only say which captures there are
    #[arg(long)]
    list: bool,

    /// Write the loom, its frames and pictures to this folder
    /// [default without a terminal, or with --json: meshloom-demo]
    #[arg(long, value_name = "DIR")]
    write: Option<PathBuf>,
}

/// Where a demo is written unless a folder is named.
const FOLDER: &str = "meshloom-demo";

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    if args.list {
        return Ok(list(session));
    }
    let demo = Demo::find(&args.name).unwrap_or(&DEMOS[0]);
    if args.write.is_none() && !session.json && open::at_a_terminal() {
        return open::demo(demo, session);
    }
    let folder = args.write.as_deref().unwrap_or(Path::new(FOLDER));
    session.task.phase("load", 0);
    let capture = (demo.make)(&session.task)?;
    let loom = fit::fitted(session, &capture, &options(demo))?;
    let files = Files::of(demo, folder);
    let frames = Sampled::new(
        loom.clone(),
        Times::Rate(RATE).over(loom.frames(), loom.fps())?,
    );
    let (world, task) = (session.world(), &session.task);
    let theme = Theme::light();
    let sheet = contact_sheet(&capture, SHEET, demo.view, &theme, task)?;
    let saved = [
        pipeline::save_loom(world, &loom, &files.loom.as_path().into(), task)?,
        save_plot(world, &loom, &files.map.as_path().into(), &theme)?,
        save_picture(world, &sheet, &files.sheet.as_path().into(), 1.0)?,
        pipeline::save(
            world,
            &frames,
            &files.frames.join("frame_####.obj").into(),
            task,
        )?,
    ];
    let outputs = saved.into_iter().flat_map(|saved| saved.outputs);
    let mut outputs: Vec<PathBuf> = outputs.collect();
    outputs.extend(played_on(demo, &files.played_on, session)?);
    Ok(Outcome {
        object: json!({
            "demo": demo.name,
            "outputs": report::paths(&outputs),
            "frames": frames.frames(),
            "report": **loom.report(),
            "seconds": session.progress.seconds(&fit::PHASES),
            "warnings": [],
        }),
        report: format!(
            "{}\n{}{}",
            demo.about,
            fit::summary(session, demo.name, loom.report()),
            files.table(session)
        ),
        ..Outcome::default()
    })
}

/// Runs the stock recipe that lets a motion go on. Poses are no motion.
fn played_on(demo: &Demo, folder: &Path, session: &Session) -> Result<Vec<PathBuf>> {
    if demo.kind == Kind::Poses {
        return Ok(Vec::new());
    }
    let name = if demo.travels { "longer-walk" } else { "loop" };
    let recipe = recipes::find(session.world(), Path::new(name))?;
    let request = Request {
        input: Some(Input::Demo(demo.name.to_string())),
        ..Request::default()
    };
    let runs = Runs::new();
    let outcome = runs.run(&recipe, &request, None, &session.task);
    let outcome = outcome.map_err(|failure| failure.diagnostic)?;
    runs.write(&outcome, Some(folder), &request, &session.task)
}

/// Where a demo's results go.
struct Files {
    loom: PathBuf,
    map: PathBuf,
    sheet: PathBuf,
    frames: PathBuf,
    played_on: PathBuf,
}

impl Files {
    fn of(demo: &Demo, folder: &Path) -> Self {
        let file = |ending: &str| folder.join(format!("{}{ending}", demo.name));
        Files {
            loom: file(".loom"),
            map: file(".png"),
            sheet: file("-frames.png"),
            frames: folder.join("frames"),
            played_on: folder.join("played-on"),
        }
    }

    fn table(&self, session: &Session) -> String {
        let rows = [
            (&self.map, "its map of poses and its time signals"),
            (&self.sheet, "what it looks like"),
            (&self.frames, "its frames at twice the rate"),
            (&self.played_on, "a motion played on by a stock recipe"),
            (
                &self.loom,
                "the loom, for `meshloom sample` and `meshloom plot`",
            ),
        ];
        let rows = rows.map(|(path, what)| (path.display().to_string(), what.to_string()));
        let rows = rows
            .each_ref()
            .map(|(path, what)| (path.as_str(), what.clone()));
        report::table(session.style, "written", &rows)
    }
}

/// How a demo is fitted.
pub(super) fn options(demo: &Demo) -> FitOptions {
    FitOptions {
        root: demo.travels.then_some(RootKind::Ground),
        ..FitOptions::default()
    }
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
