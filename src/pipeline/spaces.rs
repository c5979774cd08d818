//! Which shape space suits a capture: every second frame fitted in each, measured at the frames between
//! in vertex positions, beside linear and cubic blending of the coordinates.

use std::sync::Arc;

use rayon::prelude::*;

use crate::diag::{Diagnostic, Result};
use crate::loom::fit::FitOptions;
use crate::loom::fitted::fit_rows;
use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::pca::Table;
use crate::mesh::{FrameSource, Sequence};
use crate::space::{SPACES, ShapeSpace, Spaces, encode_frames};
use crate::task::Task;

/// The fewest frames that leave enough to fit and to measure.
const FEWEST: usize = 5;

/// Frames that show an adapting space what it has to hold.
const SAMPLES: usize = 16;

/// Above this error between frames nothing is known of them: the mean pose would do as well.
const NO_MOTION: f64 = 1.0;

/// How one space does. Errors are at the left-out frames, relative:
/// sqrt(sum |v - w|^2) / sqrt(sum |v - mean|^2) over vertex positions.
#[derive(Debug, Clone, PartialEq)]
pub struct SpaceReport {
    /// The space's name.
    pub name: &'static str,
    /// What it stores and when to use it.
    pub summary: &'static str,
    /// d, its dimension.
    pub dimension: usize,
    /// m, the modes that the tolerance needs.
    pub modes: usize,
    /// Stored numbers: d (m + 1) of h, l m of g, 2 k of f.
    pub numbers: usize,
    /// Error of psi.
    pub psi: f64,
    /// Error of linear blending of the two neighbours' coordinates.
    pub linear: f64,
    /// Error of a cubic spline in every coordinate.
    pub cubic: f64,
    /// Rotations that turn by more than 150 degrees between neighbouring frames.
    pub large_turns: usize,
}

impl SpaceReport {
    /// Itself as the command line's JSON, without the time it took.
    pub fn data(&self) -> serde_json::Value {
        serde_json::json!({
            "space": self.name,
            "dimension": self.dimension,
            "modes": self.modes,
            "numbers": self.numbers,
            "left_out": { "psi": self.psi, "linear": self.linear, "cubic": self.cubic },
            "large_turns": self.large_turns,
        })
    }
}

/// Compares all spaces on a capture. Each is a phase of `task` by its name, so whoever observes it knows
/// what each takes.
///
/// # Errors
/// Fewer than 5 frames; a space does not suit the mesh; the task was cancelled.
pub fn compare_spaces(sequence: &Sequence, task: &Task) -> Result<Vec<SpaceReport>> {
    let n = sequence.frames();
    if n < FEWEST {
        return Diagnostic::error(format!("{n} frames are too few to leave every second out"))
            .hint(format!("{FEWEST} are enough"))
            .err();
    }
    let spaces = Spaces::new(Arc::clone(sequence.topology()), &doubles(sequence, 0));
    let samples: Vec<Vec<f64>> = (0..n.min(SAMPLES))
        .map(|i| doubles(sequence, i * (n - 1) / (n.min(SAMPLES) - 1)))
        .collect();
    let samples: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
    SPACES
        .iter()
        .map(|kind| {
            task.phase(kind.name, n);
            let space = spaces.open(kind.name, &samples)?;
            measure(sequence, &*space, kind.summary, task)
        })
        .collect()
}

/// The name of the space whose psi is nearest the left-out frames; of those within a tenth of it the
/// one with the fewest numbers.
pub fn best_space(reports: &[SpaceReport]) -> Option<&SpaceReport> {
    let least = reports
        .iter()
        .map(|report| report.psi)
        .fold(f64::INFINITY, f64::min);
    let near = reports.iter().filter(|report| report.psi <= 1.1 * least);
    near.min_by_key(|report| report.numbers)
}

/// An error with three digits.
fn percent(error: f64) -> String {
    let percent = 100.0 * error;
    let digits = match percent {
        p if p >= 100.0 => 0,
        p if p >= 10.0 => 1,
        p if p >= 1.0 => 2,
        _ => 3,
    };
    format!("{percent:.digits$} %")
}

/// Why [`best_space`] suits the capture, and what speaks against it, in sentences; none without reports.
pub fn why(reports: &[SpaceReport]) -> Option<String> {
    let best = best_space(reports)?;
    let least = reports.iter().min_by(|a, b| a.psi.total_cmp(&b.psi))?;
    if least.psi > NO_MOTION {
        return Some(format!(
            "no space tells the frames between ({} off at best): these are poses rather than a motion, or far too few frames of one",
            percent(least.psi)
        ));
    }
    let times = |numbers: usize| numbers as f64 / best.numbers.max(1) as f64;
    let mut text = match least.name == best.name {
        true => format!("no space errs less between frames ({})", percent(best.psi)),
        false => format!(
            "it errs by {} between frames, {} by {} but with {:.1} times its numbers",
            percent(best.psi),
            least.name,
            percent(least.psi),
            times(least.numbers),
        ),
    };
    let plain = reports.iter().find(|report| report.name == "vertices");
    if let Some(plain) = plain.filter(|plain| plain.name != best.name && plain.psi > best.psi) {
        text += &format!(
            "; vertices, which shrink what turns, err by {} with {:.2} times its numbers",
            percent(plain.psi),
            times(plain.numbers),
        );
    }
    let doubtful: Vec<&str> = reports
        .iter()
        .filter(|report| report.large_turns > 0)
        .map(|report| report.name)
        .collect();
    if !doubtful.is_empty() {
        text += &format!(
            "; the frames kept are more than 150 degrees apart in places, where {} guess which way round",
            doubtful.join(", ")
        );
    }
    if best.linear < 0.9 * best.psi {
        text += &format!(
            "; even so a straight line between frames errs less ({}): little moves smoothly at half the rate",
            percent(best.linear)
        );
    }
    if best.name == "vertices" {
        text +=
            "; for transfer or exaggeration gradients keep limbs in shape where vertices do not";
    }
    Some(text)
}

fn measure(
    sequence: &Sequence,
    space: &dyn ShapeSpace,
    summary: &'static str,
    task: &Task,
) -> Result<SpaceReport> {
    let d = space.dimension();
    let kept = sequence.frames().div_ceil(2);
    let mut rows = vec![0.0; kept * d];
    let read = |row: usize, positions: &mut [f64]| -> Result<()> {
        positions.copy_from_slice(&doubles(sequence, 2 * row));
        Ok(())
    };
    let vertices = sequence.topology().vertices();
    let large_turns = encode_frames(space, vertices, read, &mut rows, task)?;
    let options = FitOptions {
        left_out: false,
        ..FitOptions::default()
    };
    // the phase that is being timed is the space's own
    let quiet = Task::default();
    let fitted = fit_rows(&Table::new(&rows, d), &options, &quiet)?;
    let signals = &fitted.signals;
    let psi = |time: f64, z: &mut [f64]| {
        let mut x = vec![0.0; fitted.shape.modes()];
        let p = signals.time.at(time).unwrap_or_default();
        signals.pose.evaluate(p, &mut x);
        fitted.shape.evaluate(&x, z);
    };
    let linear = |time: f64, z: &mut [f64]| {
        let first = (time - 1.0) as usize * d;
        let pairs = rows[first..first + d].iter().zip(&rows[first + d..]);
        z.iter_mut()
            .zip(pairs)
            .for_each(|(z, (a, b))| *z = 0.5 * (a + b));
    };
    let knots: Vec<f64> = (1..=kept).map(|i| i as f64).collect();
    let spline = CubicSpline::new(&knots, &rows, d, Ends::NotAKnot)
        .map_err(|_| Diagnostic::error("the coordinates are not finite"))?;
    let cubic = |time: f64, z: &mut [f64]| spline.evaluate(time, z);
    Ok(SpaceReport {
        name: space.name(),
        summary,
        dimension: d,
        modes: fitted.shape.modes(),
        numbers: d * (fitted.shape.modes() + 1)
            + signals.pose.sites().len() * fitted.shape.modes()
            + 2 * signals.time.controls().len(),
        psi: error(sequence, space, &psi, task)?,
        linear: error(sequence, space, &linear, task)?,
        cubic: error(sequence, space, &cubic, task)?,
        large_turns,
    })
}

/// The relative error at the left-out frames of coordinates given by time, counted from 1 in frames that
/// were kept.
fn error(
    sequence: &Sequence,
    space: &dyn ShapeSpace,
    coordinates: &(dyn Fn(f64, &mut [f64]) + Sync),
    task: &Task,
) -> Result<f64> {
    let left_out = (sequence.frames() - 1) / 2;
    let width = 3 * sequence.topology().vertices();
    let mut mean = vec![0.0; width];
    for i in 0..left_out {
        let row = doubles(sequence, 2 * i + 1);
        mean.iter_mut()
            .zip(row)
            .for_each(|(mean, x)| *mean += x / left_out as f64);
    }
    let squares = (0..left_out)
        .into_par_iter()
        .map(|i| {
            task.check()?;
            let mut z = vec![0.0; space.dimension()];
            coordinates(i as f64 + 1.5, &mut z);
            let mut shape = vec![0.0; width];
            space.decode(&z, &mut shape);
            let row = doubles(sequence, 2 * i + 1);
            Ok((distance(&row, &shape), distance(&row, &mean)))
        })
        .collect::<Result<Vec<(f64, f64)>>>()?;
    let missed: f64 = squares.iter().map(|(missed, _)| missed).sum();
    let spread: f64 = squares.iter().map(|(_, spread)| spread).sum();
    Ok(if spread > 0.0 {
        (missed / spread).sqrt()
    } else {
        0.0
    })
}

/// Squared.
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn doubles(sequence: &Sequence, frame: usize) -> Vec<f64> {
    sequence
        .frame(frame)
        .iter()
        .map(|&x| f64::from(x))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(name: &'static str, psi: f64, numbers: usize, large_turns: usize) -> SpaceReport {
        SpaceReport {
            name,
            summary: "",
            dimension: 0,
            modes: 1,
            numbers,
            psi,
            linear: 2.0 * psi,
            cubic: psi,
            large_turns,
        }
    }

    #[test]
    fn the_smallest_of_those_that_err_alike_is_chosen_and_the_reason_told() {
        let found = [
            report("vertices", 0.0105, 100, 0),
            report("gradients", 0.01, 300, 7),
        ];
        assert_eq!(best_space(&found).unwrap().name, "vertices");
        let text = why(&found).unwrap();
        assert!(
            text.contains("gradients by 1.00 % but with 3.0 times its numbers"),
            "{text}"
        );
        assert!(text.contains("where gradients guess"), "{text}");
    }

    #[test]
    fn a_space_that_errs_much_less_is_worth_its_numbers() {
        let found = [
            report("vertices", 0.04, 100, 0),
            report("gradients", 0.01, 300, 0),
        ];
        assert_eq!(best_space(&found).unwrap().name, "gradients");
        let text = why(&found).unwrap();
        assert!(text.contains("no space errs less"), "{text}");
        assert!(
            text.contains("vertices, which shrink what turns, err by 4.00 %"),
            "{text}"
        );
        assert!(why(&[]).is_none() && best_space(&[]).is_none());
        let poses = why(&[report("vertices", 1.4, 100, 0)]).unwrap();
        assert!(poses.contains("140 % off at best"), "{poses}");
    }
}
