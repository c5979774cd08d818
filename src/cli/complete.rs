//! `meshloom complete KEY.. -o OUT`: key poses to motion.

use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use serde_json::{Value, json};

use super::args::{Input, positive};
use super::fit::spaces;
use super::print::Style;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::inbetween::{GhostReport, MotionFrames, MotionReport};
use crate::pipeline::{
    self, CompleteRequest, Frames, InputSpec, Key, Keyed, Output, PictureFormat, Velocities,
    key_path, plot_motion,
};
use crate::plot::Theme;
use crate::sample::Times;

/// The phases whose times are reported.
const PHASES: [&str; 5] = ["load", "collapse", "encode", "follow", "write"];

/// Pixels to the picture's unit in a PNG file.
const SHARP: f32 = 2.0;

/// Complete key poses to a motion
///
/// Splines run through the keys' coordinates in a shape space (Xia et al. 2019), so that shapes bend and
/// turn between keys instead of shrinking. Keys are files in the order of the motion, or a capture of so
/// many frames. Key times and the times of the frames count in frames; beyond the ends the motion goes on.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    input: Input,

    /// One file, or a folder or pattern (frame_####.obj) for a file a frame
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,

    #[command(flatten)]
    when: When,

    #[command(flatten)]
    how: How,

    #[command(flatten)]
    controls: Controls,

    #[command(flatten)]
    ghost: Ghost,

    /// Draw the keys and the splines through them, in the plane of their two principal components, and
    /// what the collapses to the ghost cost: PNG or SVG
    #[arg(long, value_name = "P.png|P.svg")]
    plot: Option<PathBuf>,

    /// Say what would be written and removed; write nothing
    #[arg(long)]
    plan: bool,
}

/// Times of keys and frames.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Time")]
struct When {
    /// When each key is reached, rising [default: 1,25,49,..]
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    key_times: Option<Vec<f64>>,

    /// This many frames, evenly from the first key to the last [default: a frame at every step of 1]
    #[arg(long, value_name = "N", conflicts_with = "times")]
    frames: Option<usize>,

    /// Frames at these times, also before the first key and after the last
    #[arg(long, value_name = "LIST|START:END:STEP", allow_hyphen_values = true)]
    times: Option<Times>,

    /// Frames per second, for formats that carry a rate
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,
}

/// Between the keys and at the ends.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Motion")]
struct How {
    /// The shape space
    #[arg(long, value_parser = spaces(), default_value = crate::inbetween::complete::SPACE)]
    space: String,

    /// The ends: bend least; close, the last key being the first; or have given velocities
    #[arg(long, value_parser = words(&["natural", "periodic", "hermite"]), default_value = "natural")]
    boundary: String,

    /// Of periodic ends: the last key may be the first moved rigidly
    #[arg(long, value_parser = words(&["none", "rigid"]), default_value = "none")]
    drift: String,

    /// Hermite: the pose that the first key moves towards within 24 frames, or two poses that are 24
    /// frames apart at that velocity
    #[arg(long, value_name = "POSE", num_args = 1..=2)]
    start_velocity: Vec<PathBuf>,

    /// Hermite: the same for the last key
    #[arg(long, value_name = "POSE", num_args = 1..=2)]
    end_velocity: Vec<PathBuf>,

    /// Hermite: a motion, spread over the time of the keys, whose first and last step are the velocities
    #[arg(long, value_name = "INPUT")]
    velocities_from: Option<PathBuf>,
}

/// How keys are passed.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Keys")]
struct Controls {
    /// From -1 to 1, one number or one a key: 1 comes to rest at the key
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    tension: Vec<f64>,

    /// From -1 to 1, one number or one a key: not 0 makes a corner
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    continuity: Vec<f64>,

    /// From -1 to 1, one number or one a key: the turn comes after the key (positive) or before
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        allow_negative_numbers = true
    )]
    bias: Vec<f64>,

    /// Let no coordinate leave the range of its two neighbouring keys by more than this share of it
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true)]
    overshoot: Option<f64>,
}

/// Large meshes.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Ghost mesh")]
struct Ghost {
    /// Run the splines on a mesh collapsed to so many faces, which the full mesh follows; auto: 2000 for
    /// meshes of more than 20 000 faces
    #[arg(long, value_name = "FACES|auto|off", default_value = "auto")]
    ghost: String,

    /// How the full mesh follows: one sparse solve a frame for gradients and places; for gradients only
    /// (X19's deformation transfer); or each vertex by itself
    #[arg(long, value_parser = words(&["solve", "transfer", "direct"]), default_value = "solve")]
    lift: String,

    /// Whether what the ghost cannot carry at the keys is kept and blended, so that keys are met
    #[arg(long, value_parser = words(&["on", "off"]), default_value = "on")]
    ghost_residual: String,
}

fn words(known: &'static [&'static str]) -> PossibleValuesParser {
    PossibleValuesParser::new(known)
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let (world, task) = (session.world(), &session.task);
    let capture = session.open(&args.input.part.of(&args.input.inputs, args.when.fps))?;
    let keys = capture.content.sequence(task)?;
    let mut inputs = capture.origin.files;
    let request = args.request(session, &mut inputs)?;
    let output = Output::from(&args.output).protecting(&inputs);
    // a wrong output is told before the work begins
    let plan = pipeline::plan(world, &output, request.times_of(&keys)?.len())?;
    let picture = args
        .plot
        .as_ref()
        .map(|path| Output::from(path).protecting(&inputs));
    if let Some(picture) = &picture {
        PictureFormat::of(&picture.path)?;
    }
    if args.plan {
        return Ok(planned(session, &plan));
    }
    let frames = session.keep(pipeline::complete(&keys, &request, task)?);
    let saved = pipeline::save(world, &frames, &output, task)?;
    let motion = frames.motion();
    if let Some(picture) = &picture {
        let scene = plot_motion(motion, &key_path(motion, task)?, &Theme::light());
        pipeline::save_picture(world, &scene, picture, SHARP)?;
    }
    Ok(Outcome {
        object: object(session, motion.report(), &saved),
        report: told(session, &frames, &saved),
        ..Outcome::default()
    })
}

impl Args {
    fn request(&self, session: &Session, inputs: &mut Vec<PathBuf>) -> Result<CompleteRequest> {
        let Args {
            when,
            how,
            controls,
            ghost,
            ..
        } = self;
        let mut poses = |paths: &[PathBuf]| -> Result<Option<Frames>> {
            match paths {
                [] => Ok(None),
                paths => shapes(session, paths, inputs).map(Some),
            }
        };
        let velocities = Velocities {
            start: poses(&how.start_velocity)?,
            end: poses(&how.end_velocity)?,
            both: poses(how.velocities_from.as_slice())?,
        };
        let count = when.frames.map(Times::Count);
        Ok(CompleteRequest {
            times: when.key_times.clone(),
            at: count.or(when.times.clone()).unwrap_or_default(),
            fps: when.fps,
            space: Some(how.space.clone()),
            boundary: Some(how.boundary.clone()),
            drift: Some(how.drift.clone()),
            velocities,
            tension: controls.tension.clone(),
            continuity: controls.continuity.clone(),
            bias: controls.bias.clone(),
            overshoot: controls.overshoot,
            ghost: Some(ghost.ghost.clone()),
            lift: Some(ghost.lift.clone()),
            residual: Some(ghost.ghost_residual == "on"),
        })
    }
}

/// Shapes that velocities come from.
fn shapes(session: &Session, paths: &[PathBuf], inputs: &mut Vec<PathBuf>) -> Result<Frames> {
    let spec = InputSpec {
        paths: paths.to_vec(),
        ..InputSpec::default()
    };
    let capture = session.open(&spec)?;
    inputs.extend(capture.origin.files.iter().cloned());
    let sequence = capture.content.sequence(&session.task)?;
    // nothing is remembered here, so the key has to tell nothing apart
    Ok(Keyed::new(sequence, Key::of("velocity").finish()))
}

fn planned(session: &Session, plan: &pipeline::Plan) -> Outcome {
    let listed = |files: &[PathBuf]| match files {
        [] => "nothing".to_string(),
        [one] => one.display().to_string(),
        [first, .., last] => {
            format!(
                "{} .. {} ({})",
                first.display(),
                last.display(),
                files.len()
            )
        }
    };
    let rows = [
        ("writes", listed(&plan.writes)),
        ("removes", listed(&plan.removals)),
    ];
    Outcome {
        object: json!(plan),
        report: report::table(session.style, "plan", &rows),
        ..Outcome::default()
    }
}

fn object(session: &Session, report: &MotionReport, saved: &pipeline::Saved) -> Value {
    json!({
        "outputs": report::paths(&saved.outputs),
        "frames": saved.frames,
        "report": report,
        "seconds": session.progress.seconds(&PHASES),
        "warnings": [],
    })
}

fn told(session: &Session, frames: &MotionFrames, saved: &pipeline::Saved) -> String {
    let found = frames.motion().report();
    let [first, last] = frames.motion().ends();
    let mut rows = vec![
        ("keys", format!("{}, times {first} to {last}", found.keys)),
        ("frames", saved.frames.to_string()),
        (
            "space",
            format!("{}, dimension {}", found.space, found.dimension),
        ),
    ];
    if let Some(ghost) = &found.ghost {
        rows.push((
            "ghost",
            format!("{} faces, {} vertices", ghost.faces, ghost.vertices),
        ));
    }
    let costs = found
        .ghost
        .as_ref()
        .map(|ghost| collapses(session.style, ghost));
    format!(
        "{}{}{}",
        report::saved(session.style, saved),
        report::table(session.style, "motion", &rows),
        costs.unwrap_or_default()
    )
}

/// What the collapses to a ghost cost by the faces that they leave, from the first to the last; bars
/// are as long as the logarithm of the cost.
fn collapses(style: Style, ghost: &GhostReport) -> String {
    const ROWS: usize = 12;
    const WIDTH: f64 = 40.0;
    let step = ghost.curve.len().div_ceil(ROWS).max(1);
    let mut shown: Vec<(usize, f64)> = ghost.curve.iter().rev().step_by(step).copied().collect();
    shown.reverse();
    let costs = || {
        shown
            .iter()
            .map(|(_, cost)| *cost)
            .filter(|cost| *cost > 0.0)
    };
    let (least, most) = costs().fold((f64::INFINITY, 0.0), |(least, most), cost| {
        (f64::min(least, cost), f64::max(most, cost))
    });
    let bar = |cost: f64| match most > least && cost > 0.0 {
        true => (1.0 + (WIDTH - 1.0) * (cost / least).ln() / (most / least).ln()) as usize,
        false => 0,
    };
    let row = |&(faces, cost): &(usize, f64)| {
        let text = format!("{:<10}{}", report::number(cost), "#".repeat(bar(cost)));
        (faces.to_string(), text.trim_end().to_string())
    };
    let rows: Vec<(String, String)> = shown.iter().map(row).collect();
    let rows: Vec<(&str, String)> = rows
        .iter()
        .map(|(faces, text)| (faces.as_str(), text.clone()))
        .collect();
    report::table(
        style,
        "collapses: faces left and what the last one cost",
        &rows,
    )
}
