//! Figure 9 of Xia et al. 2019: the size of the second derivative along a sequence completed from ten
//! poses, divided by the mean step from key to key: piecewise-linear paths, splines of the vertices, and
//! splines in the shape space, all measured in the coordinates of that space. Keys are ten frames of the
//! galloping horse, or the capture of the command line.
//!
//! ```text
//! cargo run --release --example xia_smoothness [CAPTURE] [--out FOLDER]
//! ```

#[path = "support/key_sets.rs"]
mod key_sets;
mod support;

use std::process::ExitCode;

use key_sets::demo_keys;
use meshloom::diag::Result;
use meshloom::inbetween::{CompleteOptions, GhostOptions, GhostSize, Keys, Motion, complete};
use meshloom::metric::smoothness::{Peaks, mean_step, second_differences};
use meshloom::plot::{Chart, Panel, Series, Style, Theme, Tint, chart};
use meshloom::task::Task;
use support::{Figure, table};

/// Keys of the demo, and frames from one to the next.
const KEYS: usize = 10;
const EVERY: usize = 3;

/// Steps from key to key.
const STEPS: usize = 12;

fn main() -> ExitCode {
    support::run("xia_smoothness", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let keys = if figure.is_demo() {
        let frames: Vec<usize> = (0..KEYS).map(|i| EVERY * i).collect();
        demo_keys("gallop", &frames, 0)
    } else {
        Keys::new(figure.capture("")?.0, None)?
    };
    let ours = motion(&keys, "patch-lri")?;
    let vertices = motion(&keys, "vertices")?;
    let [first, last] = keys.ends();
    let count = STEPS * (keys.count() - 1);
    let step = (last - first) / count as f64;
    let times: Vec<f64> = (0..=count).map(|i| first + step * i as f64).collect();
    let width = ours.spline().width();
    let rows = |at: &dyn Fn(f64, &mut [f64])| {
        let mut rows = vec![0.0; times.len() * width];
        for (time, row) in times.iter().zip(rows.chunks_exact_mut(width)) {
            at(*time, row);
        }
        rows
    };
    let spline = rows(&|time, row| ours.spline().evaluate(time, row));
    let linear = rows(&|time, row| straight(&ours, time, row));
    let encoded = rows(&|time, row| {
        ours.space().encode(&vertices.at(time), row);
        let mut near = vec![0.0; width];
        ours.spline().evaluate(time, &mut near);
        ours.space().follow(&near, row);
    });
    let at_keys: Vec<f64> = spline
        .chunks_exact(width)
        .step_by(STEPS)
        .flatten()
        .copied()
        .collect();
    let unit = mean_step(&at_keys, width);
    let inner = &times[1..count];
    println!(
        "Figure 9: second derivatives over the mean step between {} keys",
        keys.count()
    );
    let mut series = Vec::new();
    let mut found = Vec::new();
    for (at, (name, rows)) in [
        ("geodesics, piecewise linear", &linear),
        ("splines of the vertices", &encoded),
        ("splines in patch-lri", &spline),
    ]
    .into_iter()
    .enumerate()
    {
        let sizes: Vec<f64> = second_differences(rows, width, step)
            .iter()
            .map(|size| size / unit)
            .collect();
        let peaks = Peaks::at_keys(inner, &sizes, keys.times());
        let points = inner
            .iter()
            .zip(&sizes)
            .map(|(time, size)| [*time, *size])
            .collect();
        let style = if at == 1 { Style::Dashed } else { Style::Line };
        series.push(Series::line(name, Tint::Series(at), points).styled(style));
        found.push((name, peaks));
    }
    // that of straight paths is rounding
    let of_spline = found[2].1.median;
    let table_rows: Vec<Vec<String>> = found
        .iter()
        .map(|(name, peaks)| {
            let ratio = |size: f64| format!("{:.2}", size / of_spline);
            let numbers = [peaks.median, peaks.typical, peaks.highest].map(ratio);
            [vec![name.to_string()], numbers.to_vec()].concat()
        })
        .collect();
    println!("in units of the spline's median, {of_spline:.2e}:");
    table(&["path", "median", "peak at a key", "highest"], &table_rows);
    if figure.is_demo() {
        let peaks = of_the_capture(keys.times(), &times, step)?;
        let [typical, highest] = [peaks.typical, peaks.highest].map(|peak| peak / peaks.median);
        println!(
            "the gallop that the keys are taken from, by itself: {typical:.2} times its median about a key, {highest:.2} at most"
        );
    }
    println!("X19: geodesics \"very large around the key-frames\", splines small throughout");
    figure.goal(
        "the spline's peaks at keys are at most 1.5 times the median",
        found[2].1.typical <= 1.5 * found[2].1.median,
    );
    figure.goal(
        "the geodesics' peaks are more than five times the spline's",
        found[0].1.typical > 5.0 * found[2].1.typical,
    );
    let panel = Panel {
        name: "|z''| / mean step".into(),
        from_zero: true,
        series,
        ..Panel::default()
    };
    let both = Chart {
        name: "time (frames); keys are marked".into(),
        panels: vec![panel],
        rug: Some(("keys".into(), keys.times().to_vec())),
        ..Chart::default()
    };
    figure.picture(&chart(&both, 900.0, 420.0, &Theme::light()).0)
}

/// What the motion that the keys were taken from does about them: all its frames as keys.
fn of_the_capture(keys: &[f64], times: &[f64], step: f64) -> Result<Peaks> {
    let frames: Vec<usize> = (0..=EVERY * (KEYS - 1)).collect();
    let whole = motion(&demo_keys("gallop", &frames, 0), "patch-lri")?;
    let width = whole.spline().width();
    let mut rows = vec![0.0; times.len() * width];
    for (time, row) in times.iter().zip(rows.chunks_exact_mut(width)) {
        let frame = 1.0 + EVERY as f64 * (time - times[0]);
        whole.spline().evaluate(frame, row);
    }
    let sizes = second_differences(&rows, width, step);
    Ok(Peaks::at_keys(&times[1..times.len() - 1], &sizes, keys))
}

fn motion(keys: &Keys, space: &str) -> Result<Motion> {
    let options = CompleteOptions {
        space: space.to_string(),
        ghost: GhostOptions {
            size: GhostSize::Off,
            ..GhostOptions::default()
        },
        ..CompleteOptions::default()
    };
    Ok(complete(keys, &options, &Task::default())?.output)
}

/// The piecewise-linear path through the keys.
fn straight(motion: &Motion, time: f64, row: &mut [f64]) {
    let times = motion.spline().times();
    let after = times
        .partition_point(|key| *key <= time)
        .clamp(1, times.len() - 1);
    let mut end = vec![0.0; row.len()];
    motion.spline().evaluate(times[after - 1], row);
    motion.spline().evaluate(times[after], &mut end);
    let share = (time - times[after - 1]) / (times[after] - times[after - 1]);
    row.iter_mut()
        .zip(&end)
        .for_each(|(a, b)| *a += share * (b - *a));
}
