//! `meshloom sample F.loom -o OUT`: frames of a loom at any times.

use std::path::PathBuf;

use serde_json::json;

use super::args::positive;
use super::report;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::pipeline::{self, FrameRange, Output};
use crate::sample::{Sampled, Sampling, Times};

/// Write frames of a loom, at any times and rate
///
/// Without a choice of times these are the frames of the capture, 1 to n.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The loom
    #[arg(value_name = "F.loom")]
    loom: PathBuf,

    /// One file, or a folder or pattern (frame_####.obj) for a file a frame
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,

    #[command(flatten)]
    which: Which,

    /// Frames per second: as many as that makes, or, beside another choice of times, what is written
    /// into formats that carry a rate
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,

    /// Only times A to B
    #[arg(long, value_name = "A:B", conflicts_with = "times")]
    range: Option<FrameRange>,
}

#[derive(Debug, Clone, clap::Args)]
#[group(multiple = false)]
struct Which {
    /// This many frames, evenly over the whole, both ends among them
    #[arg(long, value_name = "N")]
    frames: Option<usize>,

    /// This many times as many frames
    #[arg(long, value_name = "X", value_parser = positive)]
    rate: Option<f64>,

    /// At these times: T,T,.. or START:END:STEP
    #[arg(long, value_name = "LIST|START:END:STEP")]
    times: Option<Times>,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let loom = session.open_loom(&args.loom)?;
    let sampling = args.sampling(loom.frames(), loom.fps())?;
    let output = Output::from(&args.output).protecting(std::slice::from_ref(&args.loom));
    let frames = Sampled::new(loom, sampling);
    let saved = pipeline::save(session.world(), &frames, &output, &session.task)?;
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

impl Args {
    fn sampling(&self, frames: usize, fps: Option<f64>) -> Result<Sampling> {
        let part = self.range.unwrap_or_default().within(frames)?;
        let mut sampling = self.times().over(part.len(), fps)?;
        for time in &mut sampling.times {
            *time += part.start as f64;
        }
        sampling.fps = self.fps.or(sampling.fps);
        Ok(sampling)
    }

    fn times(&self) -> Times {
        let Which {
            frames,
            rate,
            times,
        } = &self.which;
        let count = frames.map(Times::Count);
        let rate = || rate.map(Times::Rate);
        let fps = || self.fps.map(Times::PerSecond);
        count
            .or_else(rate)
            .or_else(|| times.clone())
            .or_else(fps)
            .unwrap_or_default()
    }
}
