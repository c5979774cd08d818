//! How much loops show: a spread of loops of every demo that moves, or of the capture of the command line.
//!
//! Loops of an eighth to three quarters of the motion are laid over it evenly and added as a recipe adds
//! them, by `fit(input()).add_loop(a, b)`; but the fits do not look between frames, which may ask for more
//! sites and control points. The table gives for each the frames of the bridge and the ratios
//! of its seam (PEERS.md E.6), and how the motion accelerates by itself about the ends a and b.
//!
//! `least` is what no bridge is below. Next to the bridge steps and second differences count whole, those
//! of the motion by their change: a ratio T leaves T mean steps to the first step of the bridge, T medians
//! to the turn from there, and T mean steps to the change of the motion's own next step s. So
//! |s| <= T (2 mean + median), whatever leads there.
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

/// Seams above this show.
const SHOWS: f64 = 1.5;

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
                left_out: false,
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
    let mut worst = 0.0_f64;
    let (mut shown, mut impossible) = (0, 0);
    let all = loops(loom.frames());
    for &(from, to) in &all {
        let began = std::time::Instant::now();
        let looped = add_loop(loom, from as f64, to as f64, 1, None, &Task::default())?;
        worst = worst.max(looped.seam.worst());
        shown += usize::from(looped.seam.worst() > SHOWS);
        let mut row = row((from, to), &looped, began.elapsed().as_millis());
        let (least, own) = own(loom, from, to)?;
        impossible += usize::from(least > SHOWS);
        row.extend(own);
        rows.push(row);
    }
    println!("{name}");
    table(
        &[
            "loop",
            "bridge",
            "step",
            "velocity",
            "acceleration",
            "ms",
            "b-1",
            "b",
            "a",
            "a+1",
            "least",
        ],
        &rows,
    );
    let statement = format!(
        "{name}: {shown} of {} loops above {SHOWS}, the worst {worst:.2} ({impossible} cannot be below)",
        all.len()
    );
    figure.goal(&statement, shown == 0);
    Ok(())
}

fn row((from, to): (usize, usize), looped: &Looped, ms: u128) -> Vec<String> {
    let seam = looped.seam;
    let ratio = |value: f64| format!("{value:.2}{}", if value > SHOWS { " *" } else { "" });
    vec![
        format!("{from}..{to}"),
        looped.bridge.to_string(),
        ratio(seam.step),
        ratio(seam.velocity),
        ratio(seam.acceleration),
        ms.to_string(),
    ]
}

/// The least that a seam can show, and the motion's own accelerations about the ends over their median.
fn own(loom: &Loom, from: usize, to: usize) -> Result<(f64, Vec<String>)> {
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
    let step = |i: usize| difference(&[i, i + 1], &[-1.0, 1.0]);
    let bend = |i: usize| difference(&[i.wrapping_sub(1), i, i + 1], &[1.0, -2.0, 1.0]);
    let mut all: Vec<f64> = (2..n).map(bend).collect();
    all.sort_by(f64::total_cmp);
    let median = all[all.len() / 2];
    let mean = (1..n).map(step).sum::<f64>() / (n - 1) as f64;
    let least = step(to - 1).max(step(from + 1)) / (2.0 * mean + median);
    let bends = [to - 1, to, from, from + 1].map(|i| bend(i) / median);
    let cells = bends.iter().chain([&least]);
    Ok((least, cells.map(|ratio| format!("{ratio:.2}")).collect()))
}
