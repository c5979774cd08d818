//! Figure 1 of Cashman & Hormann 2012: a gallop of two strides in 24 frames, with k = 16, l = 12, m = 7.
//! The time signal loops twice, and the second loop lies on the first.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::Result;
use meshloom::loom::Loom;
use meshloom::mesh::FrameSource;
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Scene, Theme, pose_space};

use support::{Figure, distance, percent, table};

/// Frames whose shapes are shown, as in the paper: one stride.
const SHOWN: [usize; 6] = [1, 3, 5, 7, 9, 11];

fn main() -> ExitCode {
    support::run("figure1_horse", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, view) = figure.capture("gallop")?;
    let step = (sequence.frames() as f64 / 24.0).round().max(1.0) as usize;
    let sequence = support::every(&sequence, step);
    let loom = support::fit(&sequence, [16, 12, 7])?;

    let row = |name: &str, paper: &str, here: String| vec![name.into(), paper.into(), here];
    let error = loom.report().error;
    let apart = apart(&loom);
    table(
        &["", "paper", "here"],
        &[
            row("frames n", "24", loom.frames().to_string()),
            row(
                "dimension d",
                "25293",
                (3 * sequence.topology().vertices()).to_string(),
            ),
            row(
                "control points k",
                "16",
                loom.time().controls().len().to_string(),
            ),
            row("sites l", "12", loom.pose().sites().len().to_string()),
            row("modes m", "7", loom.shape().modes().to_string()),
            row("shape error", "", percent(error.shape)),
            row("pose error", "", percent(error.pose)),
            row("time error", "", percent(error.time)),
            row("total error", "", percent(error.total)),
            row("second loop off the first", "\"close\"", percent(apart)),
        ],
    );
    figure.goal(
        "the loops lie within 10 % of the map's size of each other",
        apart < 0.1,
    );
    figure.picture(&compose(&loom, &view)?)
}

/// Largest distance of the second half of the curve from the first, over the map's size.
fn apart(loom: &Loom) -> f64 {
    let n = loom.frames() as f64;
    let half = 0.5 * (1.0 + n);
    let at = |t: f64| loom.time().at(t).unwrap_or_default();
    let steps = 400;
    let along = |from: f64, to: f64| {
        (0..=steps).map(move |i| from + (to - from) * f64::from(i) / f64::from(steps))
    };
    let first: Vec<_> = along(1.0, half + 0.5).map(at).collect();
    let off = along(half, n).map(at).map(|p| {
        first
            .iter()
            .map(|q| distance(p, *q))
            .fold(f64::INFINITY, f64::min)
    });
    off.fold(0.0, f64::max) / support::diameter(&first)
}

/// Shapes on the left, the map with their frames marked on the right.
fn compose(loom: &Loom, view: &support::View) -> Result<Scene> {
    let theme = Theme::light();
    let side = 190.0;
    let mut scene = Scene::new(
        3.0 * side + 640.0,
        2.0 * (side + 24.0) + 20.0,
        theme.background,
    );
    let mut pictures = Vec::new();
    for frame in SHOWN.into_iter().filter(|frame| *frame <= loom.frames()) {
        let shape = loom.at(frame as f64)?;
        let image: Arc<_> = view.picture(&shape, 2 * side as usize, [150, 170, 200]);
        pictures.push((format!("ψ({frame})"), image));
    }
    for (i, three) in pictures.chunks(3).enumerate() {
        support::row(
            &mut scene,
            [0.0, i as f32 * (side + 24.0)],
            side,
            three,
            &theme,
        );
    }
    let (mut map, _) = plot_loom(loom);
    map.shown = SHOWN.to_vec();
    let (map, _) = pose_space(&map, 640.0, scene.height, &theme);
    scene.place(map, [3.0 * side, 0.0]);
    Ok(scene)
}
