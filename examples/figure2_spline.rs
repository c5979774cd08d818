//! Figure 2 of Cashman & Hormann 2012: a time signal of n = 8 frames and k = 6 control points; and how its
//! error falls as k grows to n + 2, where the curve passes through every position.

mod support;

use std::process::ExitCode;

use meshloom::diag::{Diagnostic, Result};
use meshloom::plot::{PoseSpace, Scene, Theme, pose_space};
use meshloom::signal::time::TimeSignal;

use support::{Figure, diameter, distance, table};

fn main() -> ExitCode {
    support::run("figure2_spline", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, _) = figure.capture("gallop")?;
    let eight = support::first(&sequence, 8);
    let loom = support::fit(&eight, [6, 8, 7])?;
    let positions = &loom.layout().positions;
    let size = diameter(positions);
    let mut last = f64::INFINITY;
    let mut rows = Vec::new();
    for k in 4..=positions.len() + 2 {
        let time = time_signal(positions, k)?;
        last = farthest(&time, positions) / size;
        let paper = if k == 6 { "8" } else { "" };
        rows.push(vec![
            k.to_string(),
            paper.into(),
            positions.len().to_string(),
            format!("{last:.2e}"),
        ]);
    }
    table(
        &[
            "k",
            "n in the paper",
            "n here",
            "largest |f(i) - p_i| / size",
        ],
        &rows,
    );
    figure.goal(
        "k = n + 2 passes through every position (1e-12 of the size)",
        last < 1e-12,
    );
    figure.picture(&compose(positions, &time_signal(positions, 6)?))
}

fn time_signal(positions: &[[f64; 2]], controls: usize) -> Result<TimeSignal> {
    TimeSignal::fit(positions, controls, 0.5)
        .map_err(|error| Box::new(Diagnostic::error(format!("no time signal: {error:?}"))))
}

fn reached(time: &TimeSignal) -> Vec<[f64; 2]> {
    (1..=time.frames())
        .filter_map(|i| time.at(i as f64))
        .collect()
}

fn farthest(time: &TimeSignal, positions: &[[f64; 2]]) -> f64 {
    let pairs = reached(time).into_iter().zip(positions);
    pairs.map(|(at, p)| distance(at, *p)).fold(0.0, f64::max)
}

/// The curve, its control points, the frames' positions and where it passes them.
fn compose(positions: &[[f64; 2]], time: &TimeSignal) -> Scene {
    let n = time.frames() as f64;
    let times: Vec<f64> = (0..=400)
        .map(|i| 1.0 + (n - 1.0) * f64::from(i) / 400.0)
        .collect();
    let map = PoseSpace {
        curve: times.iter().filter_map(|&t| time.at(t)).collect(),
        times,
        frames: positions.to_vec(),
        reached: reached(time),
        controls: time.controls().to_vec(),
        ..PoseSpace::default()
    };
    pose_space(&map, 640.0, 480.0, &Theme::light()).0
}
