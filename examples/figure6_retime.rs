//! Figure 6 of Cashman & Hormann 2012: non-uniform resampling. An elastic body is lifted and dropped, 204
//! frames with k = 155, l = 144, m = 42; the curve stays and the frames are taken from other places on it,
//! slower where the body is lifted and faster where it falls.

mod support;

use std::process::ExitCode;

use meshloom::diag::{Diagnostic, Result};
use meshloom::loom::Loom;
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Anchor, PoseSpace, Scene, Theme, pose_space};
use meshloom::signal::warp::{Keys, Warp};

use support::{Figure, View, percent, table};

/// Output frames that a captured frame becomes where the body rises, and where it falls.
const SLOW: f64 = 2.0;
const FAST: f64 = 0.5;

/// Shapes in each row of the picture.
const SHOWN: usize = 9;

fn main() -> ExitCode {
    support::run("figure6_retime", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, view) = figure.capture("jelly")?;
    let sequence = support::first(&sequence, 204);
    let n = sequence.frames();
    let scaled = |number: usize| (number * n).div_ceil(204); // shorter captures keep the paper's shares
    let loom = support::fit(
        &sequence,
        [
            scaled(155).clamp(4, n + 2),
            scaled(144).max(3).min(n),
            scaled(42).min(n - 1),
        ],
    )?;
    let times = retimed(&sequence)?;
    let [rising, falling] = rates(&sequence, &times);
    let row = |name: &str, paper: &str, here: String| vec![name.into(), paper.into(), here];
    let error = loom.report().error;
    table(
        &["", "paper", "here"],
        &[
            row(
                "dimension d",
                "8712",
                (3 * sequence.topology().vertices()).to_string(),
            ),
            row("frames n", "204", n.to_string()),
            row(
                "control points k",
                "155",
                loom.time().controls().len().to_string(),
            ),
            row("sites l", "144", loom.pose().sites().len().to_string()),
            row("modes m", "42", loom.shape().modes().to_string()),
            row("shape error", "", percent(error.shape)),
            row("pose error", "", percent(error.pose)),
            row("time error", "", percent(error.time)),
            row("total error", "", percent(error.total)),
            row("frames after resampling", "", times.len().to_string()),
            row(
                "frames a captured one, rising",
                "more",
                format!("{rising:.2}"),
            ),
            row(
                "frames a captured one, falling",
                "fewer",
                format!("{falling:.2}"),
            ),
        ],
    );
    figure.goal("the total error is below 5 %", error.total < 0.05);
    figure.goal(
        "rising is slower, falling faster than captured",
        rising > 1.3 && falling < 0.8,
    );
    let covered = times[0] == 1.0 && times[times.len() - 1] == n as f64;
    figure.goal(
        "the whole motion is still there, in order",
        covered && times.is_sorted(),
    );
    figure.picture(&compose(&loom, &times, &view)?)
}

/// Height of the middle of each frame.
fn heights(sequence: &Sequence) -> Vec<f64> {
    let middle = |frame: usize| {
        let positions = sequence.frame(frame);
        positions
            .iter()
            .skip(1)
            .step_by(3)
            .map(|&y| f64::from(y))
            .sum::<f64>()
            / (positions.len() / 3) as f64
    };
    (0..sequence.frames()).map(middle).collect()
}

/// Source times of the output frames: a monotone cubic from output time to source time through one key a
/// captured frame, whose output times are farther apart where the body rises than where it falls.
fn retimed(sequence: &Sequence) -> Result<Vec<f64>> {
    let heights = heights(sequence);
    let largest = heights
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .fold(0.0, f64::max);
    let stretch = |pair: &[f64]| {
        let climb = if largest > 0.0 {
            (pair[1] - pair[0]) / (0.25 * largest)
        } else {
            0.0
        };
        if climb > 0.0 {
            SLOW.powf(climb.min(1.0))
        } else {
            FAST.powf((-climb).min(1.0))
        }
    };
    let mut output = vec![1.0];
    for pair in heights.windows(2) {
        output.push(output[output.len() - 1] + stretch(pair));
    }
    let last = output[output.len() - 1];
    let whole = last.round().max(2.0); // a warp ends at a whole frame
    output
        .iter_mut()
        .for_each(|t| *t = 1.0 + (*t - 1.0) * (whole - 1.0) / (last - 1.0));
    let source = (1..=sequence.frames()).map(|frame| frame as f64).collect();
    let end = output.len() - 1;
    output[end] = whole;
    let keys = Keys::monotone(output, source)
        .map_err(|error| Box::new(Diagnostic::error(format!("no change of time: {error:?}"))))?;
    let warp = Warp::Keys(keys);
    Ok((1..=warp.frames())
        .map(|frame| warp.at(frame as f64).0)
        .collect())
}

/// Output frames a captured frame while the body rises, and while it falls.
fn rates(sequence: &Sequence, times: &[f64]) -> [f64; 2] {
    let heights = heights(sequence);
    [1.0, -1.0].map(|sign| {
        let spans = heights
            .windows(2)
            .enumerate()
            .filter(|(_, pair)| sign * (pair[1] - pair[0]) > 0.0);
        let spans: Vec<f64> = spans.map(|(i, _)| i as f64 + 1.0).collect();
        let inside = |from: f64| {
            times
                .iter()
                .filter(|&&t| from <= t && t < from + 1.0)
                .count()
        };
        let frames: usize = spans.iter().map(|&from| inside(from)).sum();
        frames as f64 / spans.len().max(1) as f64
    })
}

/// The curve with the frames as captured and as resampled, and both motions as rows of shapes.
fn compose(loom: &Loom, times: &[f64], view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let (side, tall) = (140.0, 440.0);
    let wide = SHOWN as f32 * side;
    let mut scene = Scene::new(wide, tall + 50.0 + 2.0 * (side + 40.0), theme.background);
    let (map, _) = plot_loom(loom);
    let resampled: Vec<[f64; 2]> = times.iter().filter_map(|&t| loom.time().at(t)).collect();
    let frames: Vec<f64> = (1..=loom.frames()).map(|frame| frame as f64).collect();
    let halves = [
        (map.reached.clone(), &frames, "(a) frames as captured"),
        (
            resampled,
            &times.to_vec(),
            "(b) resampled: slower rising, faster falling",
        ),
    ];
    for (i, (points, times, name)) in halves.into_iter().enumerate() {
        let half = PoseSpace {
            curve: map.curve.clone(),
            times: map.times.clone(),
            frames: points,
            ..PoseSpace::default()
        };
        let (half, _) = pose_space(&half, 0.5 * wide, tall, &theme);
        scene.place(half, [0.5 * wide * i as f32, 24.0]);
        scene.write(
            name,
            [wide * (0.25 + 0.5 * i as f32), 16.0],
            Anchor::Middle,
            &theme,
        );
        let mut row = Vec::new();
        for column in 0..SHOWN {
            // even steps through the first half: the same share of time in both rows
            let frame = column * times.len() / (2 * (SHOWN - 1));
            let t = times[frame.min(times.len() - 1)];
            let shape = loom.at(t)?;
            row.push((
                format!("{}: ψ({t:.1})", frame + 1),
                view.picture(&shape, 2 * side as usize, [150, 170, 200]),
            ));
        }
        support::row(
            &mut scene,
            [0.0, tall + 40.0 + i as f32 * (side + 40.0)],
            side,
            &row,
            &theme,
        );
    }
    Ok(scene)
}
