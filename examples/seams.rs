//! How much loops show: a spread of loops of every demo that moves, or of the capture of the command line.
//!
//! Loops of an eighth to three quarters of the motion are laid over it evenly and added as a recipe adds
//! them, by `fit(input()).add_loop(a, b)`. The table gives for each the frames of the bridge, how many of them
//! are the motion's own, how many frames before the seam and after it turn, how far out its shapes lie for 1 of
//! the motion's farthest, the ratios of its seam (PEERS.md E.6), and how the motion accelerates by itself about
//! the ends a and b.
//!
//! ```text
//! cargo run --release --example seams [CAPTURE] [--out FOLDER]
//! ```

mod support;

use std::process::ExitCode;

use meshloom::demo::{DEMOS, Kind};
use meshloom::diag::Result;
use meshloom::edit::{Looped, add_loop};
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::Sequence;
use meshloom::signal::root::RootKind;
use meshloom::task::Task;
use support::{Figure, table};

/// Seams above this show, ..
const SHOWS: f64 = 1.5;
/// .. and shapes so many times as far out as the motion's look strange.
const STRANGE: f64 = 1.75;

fn main() -> ExitCode {
    support::run("seams", |figure| {
        for (name, sequence, travels) in captures(figure)? {
            let root = if travels {
                Some(RootKind::Ground)
            } else {
                None
            };
            let options = FitOptions {
                root,
                ..FitOptions::default()
            };
            let loom = fit(&sequence, &options, &Task::default())?.output;
            spread(figure, &name, &loom)?;
        }
        Ok(())
    })
}

fn captures(figure: &Figure) -> Result<Vec<(String, Sequence, bool)>> {
    if !figure.is_demo() {
        return Ok(vec![("capture".to_string(), figure.capture("")?.0, false)]);
    }
    let motions = DEMOS.iter().filter(|demo| demo.kind == Kind::Motion);
    Ok(motions
        .map(|demo| (demo.name.to_string(), demo.generate(), demo.travels))
        .collect())
}

/// The loops that are tried: from, to.
fn loops(frames: usize) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    for eighths in [1, 2, 3, 4, 6] {
        let length = (frames * eighths / 8).max(4);
        let room = frames - 1 - length;
        all.extend(
            (0..=4)
                .map(|i| 1 + room * i / 4)
                .map(|from| (from, from + length)),
        );
    }
    all
}

fn spread(figure: &mut Figure, name: &str, loom: &Loom) -> Result<()> {
    let mut rows = Vec::new();
    let (mut worst, mut strangest) = (0.0_f64, 0.0_f64);
    let mut shown = 0;
    let all = loops(loom.frames());
    for &(from, to) in &all {
        let began = std::time::Instant::now();
        let looped = add_loop(loom, from as f64, to as f64, 1, None, &Task::default())?;
        worst = worst.max(looped.seam.worst());
        strangest = strangest.max(looped.strangeness);
        shown += usize::from(looped.seam.worst() > SHOWS);
        let mut row = row((from, to), &looped, began.elapsed().as_millis());
        row.extend(own(loom, from, to)?);
        rows.push(row);
    }
    println!("{name}");
    table(
        &[
            "loop",
            "bridge",
            "own",
            "turned",
            "strange",
            "step",
            "velocity",
            "acceleration",
            "ms",
            "b-1",
            "b",
            "a",
            "a+1",
        ],
        &rows,
    );
    let statement = format!(
        "{name}: {shown} of {} loops above {SHOWS}, the worst {worst:.2}",
        all.len()
    );
    figure.goal(&statement, shown == 0);
    let statement =
        format!("{name}: the strangest shape {strangest:.2} times as far out as the motion's");
    figure.goal(&statement, strangest <= STRANGE);
    Ok(())
}

fn row((from, to): (usize, usize), looped: &Looped, ms: u128) -> Vec<String> {
    let seam = looped.seam;
    let ratio = |value: f64| format!("{value:.2}{}", if value > SHOWS { " *" } else { "" });
    vec![
        format!("{from}..{to}"),
        looped.bridge.to_string(),
        (looped.own.0 + looped.own.1).to_string(),
        format!(
            "{} {}",
            (to + looped.own.0).saturating_sub(looped.kept.0),
            looped.kept.1.saturating_sub(from - looped.own.1 + 1)
        ),
        format!("{:.2}", looped.strangeness),
        ratio(seam.step),
        ratio(seam.velocity),
        ratio(seam.acceleration),
        ms.to_string(),
    ]
}

/// The motion's own accelerations about the ends over their median.
fn own(loom: &Loom, from: usize, to: usize) -> Result<Vec<String>> {
    let n = loom.frames();
    let x = (1..=n)
        .map(|t| loom.coordinates_at(t as f64))
        .collect::<Result<Vec<_>>>()?;
    let difference = |frames: &[usize], factors: &[f64]| -> f64 {
        let known = |&frame: &usize| (1..=n).contains(&frame);
        if !frames.iter().all(known) {
            return 0.0;
        }
        let parts = || frames.iter().zip(factors);
        let along = |k: usize| {
            parts()
                .map(|(frame, factor)| factor * x[frame - 1][k])
                .sum()
        };
        let square = |k: usize| {
            let sum: f64 = along(k);
            sum * sum
        };
        (0..x[0].len()).map(square).sum::<f64>().sqrt()
    };
    let bend = |i: usize| difference(&[i.wrapping_sub(1), i, i + 1], &[1.0, -2.0, 1.0]);
    let mut all: Vec<f64> = (2..n).map(bend).collect();
    all.sort_by(f64::total_cmp);
    let median = all[all.len() / 2];
    let bends = [to - 1, to, from, from + 1].map(|i| bend(i) / median);
    Ok(bends.iter().map(|ratio| format!("{ratio:.2}")).collect())
}
