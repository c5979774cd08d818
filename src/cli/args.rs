//! Arguments that several subcommands share, and how their values are read.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;

use crate::pipeline::{FrameRange, InputSpec};

/// What every subcommand takes.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Everywhere")]
pub(super) struct Global {
    /// Worker threads [default: SLURM_CPUS_PER_TASK, else the cores]
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,

    /// Print one JSON object on stdout
    #[arg(long, global = true)]
    pub(super) json: bool,

    /// No progress and no report; warnings and errors only
    #[arg(long, short, global = true)]
    pub(super) quiet: bool,
}

/// A capture to read.
#[derive(Debug, Clone, Args)]
pub(super) struct Input {
    /// A directory, a pattern (frame_####.obj, %04d, a quoted glob), files, or one file with many frames
    #[arg(value_name = "INPUT", required = true)]
    pub(super) inputs: Vec<PathBuf>,

    #[command(flatten)]
    pub(super) part: Part,
}

/// Which part of a capture, and the mesh of a cache.
#[derive(Debug, Clone, Args)]
pub(super) struct Part {
    /// Only frames A to B, counted from 1; either may be left out
    #[arg(long, value_name = "A:B", value_parser = FrameRange::from_str)]
    pub(super) range: Option<FrameRange>,

    /// The mesh whose faces a point cache has
    #[arg(long, value_name = "BASE.obj")]
    pub(super) mesh: Option<PathBuf>,
}

impl Part {
    /// This part of the capture at `paths`; `fps` says how fast it is played, if the files do not.
    pub(super) fn of(&self, paths: &[PathBuf], fps: Option<f64>) -> InputSpec {
        InputSpec {
            paths: paths.to_vec(),
            mesh: self.mesh.clone(),
            range: self.range,
            fps,
        }
    }
}

/// A rate in frames per second.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(number) if number.is_finite() && number > 0.0 => Ok(number),
        _ => Err("a positive number is wanted".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_positive_and_finite() {
        assert_eq!(positive("23.976"), Ok(23.976));
        for wrong in ["0", "-1", "inf", "nan", "x"] {
            assert!(positive(wrong).is_err(), "{wrong}");
        }
    }
}
