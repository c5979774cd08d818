//! Figure 3 of Cashman & Hormann 2012: a saddle in the pose signal, and its cure by pins.
//!
//! A figure of eight through the three leading modes of the gallop, in 12 frames: where it crosses itself
//! in the map, the third mode tells both branches apart. Every frame is reproduced exactly; the frames
//! between them, which are known too, are compared with psi halfway. Laid out by distances alone, the
//! four frames around the crossing force g into a saddle, and psi goes from frame to frame through shapes
//! of the other branch; pinned to a circle in the order of time, it does not. A capture given by path is
//! taken as it is, every second of its frames.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::Result;
use meshloom::image::Image;
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, Method};
use meshloom::loom::pins::{Pin, PinPlace};
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Anchor, Scene, Theme, pose_space};

use support::{Figure, View, percent, table};

/// The shapes shown between two frames: where, and how that is written.
const BETWEEN: [(f64, &str); 5] = [(0.0, ""), (0.25, "¼"), (0.5, "½"), (0.75, "¾"), (1.0, "")];

fn main() -> ExitCode {
    support::run("figure3_saddle", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (sequence, view) = figure.capture("gallop")?;
    let truth = if figure.is_demo() {
        figure_of_eight(&sequence)?
    } else {
        sequence
    };
    let kept = support::every(&truth, 2);
    let before = fit(&kept, Vec::new())?;
    let after = fit(&kept, around(&kept, &before))?;
    let errors = [&before, &after].map(|loom| between(loom, &truth));
    let linear = linear(&kept, &truth);
    let [psi, pinned] = &errors;
    let worst = worst(psi, &linear);
    let lines = psi.iter().zip(pinned).zip(&linear).enumerate();
    let lines: Vec<Vec<String>> = lines
        .map(|(i, ((psi, pinned), linear))| {
            let mark = if i == worst { "saddle" } else { "" };
            let span = format!("{}-{}", i + 1, i + 2);
            vec![
                span,
                percent(*psi),
                percent(*pinned),
                percent(*linear),
                mark.into(),
            ]
        })
        .collect();
    println!(
        "errors halfway between frames, relative to the motion (the paper shows them, gives no numbers):"
    );
    table(&["frames", "psi", "psi pinned", "linear", ""], &lines);
    let [psi_mean, pinned_mean, linear_mean] = [psi, pinned, &linear].map(|all| mean(all));
    println!(
        "all: psi {}, psi pinned {}, linear {}",
        percent(psi_mean),
        percent(pinned_mean),
        percent(linear_mean)
    );
    figure.goal(
        "unpinned, psi is worse than linear blending on some span",
        psi[worst] > linear[worst],
    );
    figure.goal(
        "the pins cut the worst span's error to less than half",
        pinned[worst] < 0.5 * psi[worst],
    );
    figure.goal(
        "pinned, psi is better than linear blending overall",
        pinned_mean < linear_mean,
    );
    let captured = view.picture(truth.frame(2 * worst + 1), SIDE, CAPTURED);
    figure.picture(&compose([&before, &after], worst, &captured, &view)?)
}

/// Frames of the figure of eight, with those between.
const FRAMES: usize = 23;

/// mean + r (sin t, 0.8 sin 2t, 0.5 cos t) in the sequence's three leading modes, r the size of the first;
/// not quite once around.
fn figure_of_eight(sequence: &Sequence) -> Result<Sequence> {
    let n = sequence.frames();
    let loom = support::fit(sequence, [n + 2, n, 3])?;
    let first = loom.layout().coordinates.iter().step_by(3);
    let size = first.fold(0.0_f64, |size, x| size.max(x.abs()));
    let shape = |frame: usize| {
        let t = 0.3 + 1.85 * std::f64::consts::PI * frame as f64 / (FRAMES - 1) as f64;
        let x = [t.sin(), 0.8 * (2.0 * t).sin(), 0.5 * t.cos()].map(|x| size * x);
        let mut z = vec![0.0; loom.shape().dimension()];
        loom.shape().evaluate(&x, &mut z);
        z.into_iter().map(|z| z as f32)
    };
    let positions = (0..FRAMES).flat_map(shape).collect();
    Ok(Sequence::new(
        sequence.topology().clone(),
        positions,
        sequence.fps(),
    ))
}

/// Nothing left out: k - 2 = l = m + 1 = n.
fn fit(kept: &Sequence, pins: Vec<Pin>) -> Result<Loom> {
    let n = kept.frames();
    let options = FitOptions {
        method: Method::Ch12,
        pins,
        ..FitOptions::ch12()
    };
    support::fit_with(kept, [n + 2, n, n - 1], options)
}

/// Every frame on three quarters of a circle as wide as the layout, in the order of time, as far apart as
/// the shapes are.
fn around(kept: &Sequence, loom: &Loom) -> Vec<Pin> {
    let steps = (1..kept.frames()).map(|i| difference(kept.frame(i - 1), kept.frame(i)));
    let mut walked = vec![0.0];
    for step in steps {
        walked.push(walked[walked.len() - 1] + step);
    }
    let whole = walked[walked.len() - 1];
    let radius = 0.5 * support::diameter(&loom.layout().positions);
    let pin = |(frame, walked): (usize, &f64)| {
        let angle = std::f64::consts::PI * (1.25 - 1.5 * walked / whole);
        Pin {
            frame: frame + 1,
            at: PinPlace::Layout([radius * angle.cos(), radius * angle.sin()]),
        }
    };
    walked.iter().enumerate().map(pin).collect()
}

/// Error of psi halfway along every span, relative to the root mean square motion.
fn between(loom: &Loom, truth: &Sequence) -> Vec<f64> {
    let motion = motion(truth);
    let spans = (truth.frames() - 1) / 2;
    let halfway = |i: usize| loom.at(i as f64 + 1.5).unwrap_or_default();
    (0..spans)
        .map(|i| difference(&halfway(i), truth.frame(2 * i + 1)) / motion)
        .collect()
}

fn linear(kept: &Sequence, truth: &Sequence) -> Vec<f64> {
    let motion = motion(truth);
    let blend = |i: usize| -> Vec<f32> {
        let ends = kept.frame(i).iter().zip(kept.frame(i + 1));
        ends.map(|(a, b)| 0.5 * (a + b)).collect()
    };
    let spans = (truth.frames() - 1) / 2;
    (0..spans)
        .map(|i| difference(&blend(i), truth.frame(2 * i + 1)) / motion)
        .collect()
}

/// Root mean square distance of the frames from their mean.
fn motion(sequence: &Sequence) -> f64 {
    let n = sequence.frames();
    let mut mean = vec![0.0; sequence.frame(0).len()];
    for frame in 0..n {
        let frame = sequence.frame(frame);
        mean.iter_mut()
            .zip(frame)
            .for_each(|(mean, x)| *mean += x / n as f32);
    }
    let squares = (0..n).map(|frame| difference(sequence.frame(frame), &mean).powi(2));
    (squares.sum::<f64>() / n as f64).sqrt()
}

fn difference(a: &[f32], b: &[f32]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

/// The span that loses most against linear blending.
fn worst(psi: &[f64], linear: &[f64]) -> usize {
    let losses = psi.iter().zip(linear).map(|(psi, linear)| psi - linear);
    losses
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .map_or(0, |(i, _)| i)
}

fn mean(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len().max(1) as f64).sqrt()
}

/// Side of a small picture in pixels of the file, twice that of the scene.
const SIDE: usize = 340;
const SHAPE: [u8; 3] = [150, 170, 200];
const CAPTURED: [u8; 3] = [196, 188, 150];

/// The two maps with the worst span darkened, below each the shapes along it, and the captured one.
fn compose(looms: [&Loom; 2], worst: usize, captured: &Arc<Image>, view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let side = 0.5 * SIDE as f32;
    let (wide, tall) = (6.0 * side, 420.0);
    let mut scene = Scene::new(wide, tall + 30.0 + 2.0 * (side + 30.0), theme.background);
    for (i, (loom, name)) in looms
        .into_iter()
        .zip(["distances alone", "pinned"])
        .enumerate()
    {
        let from = (worst + 1) as f64;
        let (mut map, _) = plot_loom(loom);
        (map.sites, map.controls) = (Vec::new(), Vec::new());
        map.span = Some([from, from + 1.0]);
        let times = BETWEEN[1..4].iter();
        map.marked = times
            .filter_map(|(share, _)| loom.time().at(from + share))
            .collect();
        let (map, _) = pose_space(&map, 0.5 * wide, tall, &theme);
        scene.place(map, [0.5 * wide * i as f32, 24.0]);
        scene.write(
            name,
            [wide * (0.25 + 0.5 * i as f32), 16.0],
            Anchor::Middle,
            &theme,
        );
        let mut row = Vec::new();
        for (share, text) in BETWEEN {
            let shape = loom.at(from + share)?;
            let whole = (from + share).floor();
            row.push((
                format!("ψ({whole}{text})"),
                view.picture(&shape, SIDE, SHAPE),
            ));
        }
        row.push(("true shape halfway".into(), captured.clone()));
        let top = tall + 30.0 + i as f32 * (side + 30.0);
        support::row(&mut scene, [0.0, top], side, &row, &theme);
    }
    Ok(scene)
}
