//! Figure 4 of Cashman & Hormann 2012: a flag in the wind, 100 frames in the space of deformation gradients
//! with k = 98, l = 100, m = 79. The wind drives it around in circles, in the map too.

mod support;

use std::process::ExitCode;

use meshloom::diag::Result;
use meshloom::loom::Loom;
use meshloom::loom::fit::FitOptions;
use meshloom::mesh::FrameSource;
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Anchor, Item, Path, Plane, Rect, Scene, Stroke, Theme, pose_space};

use support::{Figure, View, percent, table};

/// Frames whose shapes are shown around the map.
const SHOWN: usize = 8;

fn main() -> ExitCode {
    support::run("figure4_flag", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, view) = figure.capture("flag")?;
    let sequence = support::last(&sequence, 100); // once the wind has taken hold of it
    let n = sequence.frames();
    let scaled = |number: usize| number * n / 100; // shorter captures keep the paper's shares of n
    let loom = support::fit_with(
        &sequence,
        [scaled(98).max(4), n.max(3), scaled(79).min(n - 1)],
        FitOptions {
            space: "gradients".to_string(),
            ..FitOptions::ch12()
        },
    )?;
    let positions = loom.report().error.positions.unwrap_or(f64::NAN);
    let (turns, steadiness) = turning(&loom);
    let row = |name: &str, paper: &str, here: String| vec![name.into(), paper.into(), here];
    table(
        &["", "paper", "here"],
        &[
            row("shape space", "R^(9F+3)", "R^(9F+6)".into()),
            row("dimension d", "51987", loom.space().dimension().to_string()),
            row("frames n", "100", n.to_string()),
            row(
                "control points k",
                "98",
                loom.time().controls().len().to_string(),
            ),
            row("sites l", "100", loom.pose().sites().len().to_string()),
            row("modes m", "79", loom.shape().modes().to_string()),
            row("total error", "", percent(loom.report().error.total)),
            row("in vertex positions", "", percent(positions)),
            row(
                "turns about the middle",
                "\"circular motion\"",
                format!("{turns:.1}"),
            ),
            row(
                "turning in one sense",
                "\"consistent\"",
                percent(steadiness),
            ),
        ],
    );
    figure.goal("vertices are within 3 % of their motion", positions < 0.03);
    figure.goal(
        "at least two turns, two fifths of all turning in one sense",
        turns.abs() >= 2.0 && steadiness >= 0.4,
    );
    figure.picture(&compose(&loom, &view)?)
}

/// How often the curve turns around the mean of the positions, and which share of its turning goes in
/// that sense.
fn turning(loom: &Loom) -> (f64, f64) {
    let positions = &loom.layout().positions;
    let middle =
        [0, 1].map(|axis| positions.iter().map(|p| p[axis]).sum::<f64>() / positions.len() as f64);
    let angle = |p: &[f64; 2]| (p[1] - middle[1]).atan2(p[0] - middle[0]);
    let whole = std::f64::consts::TAU;
    let steps = positions.windows(2).map(|pair| {
        let step = angle(&pair[1]) - angle(&pair[0]);
        step - whole * (step / whole).round()
    });
    let (net, all) = steps.fold((0.0, 0.0), |(net, all), step| {
        (net + step, all + step.abs())
    });
    (net / whole, if all > 0.0 { net.abs() / all } else { 0.0 })
}

/// The map with shapes above and below it, each linked to its place.
fn compose(loom: &Loom, view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let (side, width, height) = (190.0, 760.0, 520.0);
    let mut scene = Scene::new(width, height + 2.0 * side + 12.0, theme.background);
    let (mut map, _) = plot_loom(loom);
    (map.controls, map.sites) = (Vec::new(), Vec::new()); // as many as frames: they would hide the curve
    let frames: Vec<usize> = (0..SHOWN)
        .map(|i| 1 + i * (loom.frames() - 1) / (SHOWN - 1))
        .collect();
    map.shown = frames.clone();
    let (map, plane) = pose_space(&map, width, height, &theme);
    scene.place(map, [0.0, side]);
    let places: Vec<_> = frames
        .iter()
        .filter_map(|&frame| loom.time().at(frame as f64))
        .collect();
    for (slot, frame) in slots(&plane, &places)
        .into_iter()
        .zip(frames.iter().zip(&places))
    {
        let (frame, place) = frame;
        let (column, below) = (slot / 2, slot % 2 == 1);
        let left = column as f32 * width / 4.0;
        let top = if below { side + height } else { 0.0 };
        let image = view.picture(&loom.at(*frame as f64)?, 2 * side as usize, [150, 170, 200]);
        let middle = [left + 0.5 * side, if below { top } else { side }];
        let at = plane.pixel(*place);
        let link = Stroke::new(theme.muted.with_alpha(0.7), 0.8);
        let area = Rect {
            top: plane.area.top + side,
            ..plane.area
        };
        scene.clipped(area, |scene| {
            scene.stroke(Path::polyline(&[middle, [at[0], at[1] + side]]), link);
        });
        let name = [middle[0], if below { top + side + 4.0 } else { side - 2.0 }];
        scene.write(&format!("ψ({frame})"), name, Anchor::Middle, &theme);
        scene.items.push(Item::Picture {
            rect: Rect::new(left, top, side, side),
            image,
        });
    }
    Ok(scene)
}

/// A place in the rows for each frame: upper ones above, from left to right. Slot 2c is column c above,
/// 2c + 1 below.
fn slots(plane: &Plane, places: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..places.len()).collect();
    order.sort_by(|&a, &b| places[b][1].total_cmp(&places[a][1]));
    let mut slots = vec![0; places.len()];
    for (below, half) in order.chunks_mut(places.len().div_ceil(2)).enumerate() {
        half.sort_by(|&a, &b| plane.pixel(places[a])[0].total_cmp(&plane.pixel(places[b])[0]));
        for (column, &i) in half.iter().enumerate() {
            slots[i] = 2 * column + below;
        }
    }
    slots
}
