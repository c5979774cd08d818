//! `meshloom transfer F.loom --examples SOURCES TARGETS -o OUT`: a motion on another character.

use std::path::PathBuf;

use serde_json::json;

use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::edit::transfer::transfer;
use crate::pipeline::{self, InputSpec, Output};
use crate::sample::{Sampled, Sampling, Times};

/// Transfer a motion to another mesh by example shapes
///
/// Examples pair up in order: the first pair is the reference pose of both meshes, the others show which
/// shape of the target a shape of the source stands for. The meshes need not have the same faces. Fit the
/// loom with --space gradients or patch-lri unless the motion is small.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The loom
    #[arg(value_name = "F.loom")]
    loom: PathBuf,

    /// Shapes of the loom's mesh and, in the same order, shapes of the other: folders, patterns or files
    /// of many frames
    #[arg(long, num_args = 2, value_names = ["SOURCES", "TARGETS"], required = true)]
    examples: Vec<PathBuf>,

    /// A loom, one file of frames, or a folder or pattern (frame_####.obj) for a file a frame
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let (world, task) = (session.world(), &session.task);
    let loom = session.open_loom(&args.loom)?;
    let [sources, targets] = [0, 1].map(|side| InputSpec::new(&args.examples[side]));
    let examples = session.keep(pipeline::open_examples(world, &sources, &targets, task)?);
    let found = session.keep(transfer(&loom, &examples, task)?);
    let inputs: Vec<PathBuf> = [&args.loom]
        .into_iter()
        .chain(&args.examples)
        .cloned()
        .collect();
    let output = Output::from(&args.output).protecting(&inputs);
    let saved = if pipeline::is_loom(&args.output) {
        pipeline::save_loom(world, &found.loom, &output, task)?
    } else {
        let mut sampling: Sampling =
            Times::default().over(found.loom.frames(), found.loom.fps())?;
        sampling.fps = found.loom.fps();
        pipeline::save(
            world,
            &Sampled::new(found.loom.clone(), sampling),
            &output,
            task,
        )?
    };
    let worst = found.coverage.iter().copied().fold(0.0, f64::max);
    let mean = found.coverage.iter().sum::<f64>() / found.coverage.len().max(1) as f64;
    let coverage = format!(
        "frames lie {} on average and {} at most from what {} pairs span",
        report::percent(100.0 * mean),
        report::percent(100.0 * worst),
        examples.pairs(),
    );
    Ok(Outcome {
        object: json!({
            "outputs": report::paths(&saved.outputs),
            "frames": saved.frames,
            "report": { "coverage": found.coverage, "space": found.loom.space().name() },
            "seconds": session.progress.seconds(&["load", "examples", "transfer", "write"]),
            "warnings": [],
        }),
        report: format!("{}{coverage}", report::saved(session.style, &saved)),
        ..Outcome::default()
    })
}
