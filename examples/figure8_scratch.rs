//! Figure 8 of Cashman & Hormann 2012: a motion from scratch. Nine expressions are put on a map by hand; the
//! time signal begins at the neutral one, loops three times through a smile and ends in surprise.

mod support;

use std::f64::consts::TAU;
use std::process::ExitCode;

use meshloom::diag::{Diagnostic, Result};
use meshloom::edit::{Sketch, path};
use meshloom::loom::Loom;
use meshloom::loom::pose_map::pose_map;
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::pipeline::plot::plot_loom;
use meshloom::plot::{Anchor, Item, PoseSpace, Rect, Scene, Theme, pose_space};
use meshloom::task::Task;

use support::{Figure, View, distance, percent, table};

/// Expressions of the demo, frames from 0.
const NEUTRAL: usize = 0;
const SMILE: usize = 7;
const SURPRISE: usize = 8;
const NAMES: [&str; 9] = [
    "neutral", "anger", "cry", "grin", "laugh", "rage", "sad", "smile", "surprise",
];

/// How often the smile is looped through.
const LOOPS: usize = 3;

/// Frames of the motion, and those shown.
const FRAMES: usize = 121;
const SHOWN: usize = 11;

fn main() -> ExitCode {
    support::run("figure8_scratch", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (poses, view) = figure.capture("face")?;
    if poses.frames() != NAMES.len() {
        let message = format!("nine expressions are wanted, these are {}", poses.frames());
        return Diagnostic::error(message).err();
    }
    let places = places();
    let task = Task::default();
    let map = pose_map(&poses, &places, "vertices", Some(24.0), &task)?;
    let motion = path(&map, &way(&places), Sketch::Controls, Some(FRAMES))?.output;
    let error = reproduction(&map, &poses, &places)?;
    let visits = visits(&motion, places[SMILE]);
    let far = unseen(&motion, &places);
    let row = |name: &str, paper: &str, here: String| vec![name.into(), paper.into(), here];
    table(
        &["", "paper", "here"],
        &[
            row(
                "expressions, sites l",
                "9",
                motion.pose().sites().len().to_string(),
            ),
            row(
                "modes m",
                "smallest m/n",
                motion.shape().modes().to_string(),
            ),
            row("frames n", "", motion.frames().to_string()),
            row(
                "control points k",
                "",
                motion.time().controls().len().to_string(),
            ),
            row("expressions at their places, worst", "", percent(error)),
            row("passes of the smile", "3", visits.to_string()),
            row("expressions that do not appear", "4", far.len().to_string()),
        ],
    );
    println!(
        "not seen: {}",
        far.iter()
            .map(|&pose| NAMES[pose])
            .collect::<Vec<_>>()
            .join(", ")
    );
    // single precision over a head of 20 cm
    figure.goal("every place shows its expression, to 1e-6", error < 1e-6);
    figure.goal("the smile is passed three times", visits == LOOPS);
    let ends = [1.0, FRAMES as f64].map(|t| motion.position_at(t).unwrap_or_default());
    figure.goal(
        "it begins at the neutral expression and ends in surprise",
        distance(ends[0], places[NEUTRAL]) < 0.1 && distance(ends[1], places[SURPRISE]) < 0.1,
    );
    figure.goal(
        "four expressions or more lie far from the curve",
        far.len() >= 4,
    );
    figure.picture(&compose(&motion, &poses, &places, &view)?)
}

/// The neutral expression in the middle, the others around it.
fn places() -> [[f64; 2]; 9] {
    std::array::from_fn(|pose| match pose {
        NEUTRAL => [0.0, 0.0],
        _ => {
            let angle = TAU * (pose as f64 - SMILE as f64) / 8.0;
            [angle.cos(), angle.sin()]
        }
    })
}

/// Control points f_j of a uniform cubic B-spline: rest at the neutral expression, loops as wide as a
/// third of the way, and the way to surprise, where it rests again.
fn way(places: &[[f64; 2]; 9]) -> Vec<[f64; 2]> {
    let [x, y] = places[SMILE];
    let aside = |along: f64, across: f64| [along * x - across * y, along * y + across * x];
    let mut way = vec![places[NEUTRAL]; 3];
    for _ in 0..LOOPS {
        way.extend([
            aside(0.45, 0.35),
            aside(1.05, 0.25),
            aside(1.05, -0.25),
            aside(0.45, -0.35),
            aside(-0.15, 0.0),
        ]);
    }
    let [u, v] = places[SURPRISE];
    way.extend([[0.5 * u, 0.5 * v], [u, v], [u, v], [u, v]]);
    way
}

/// The largest distance of a map's shape from the expression put there, over the size of the head.
fn reproduction(map: &Loom, poses: &Sequence, places: &[[f64; 2]]) -> Result<f64> {
    let size = poses
        .positions()
        .iter()
        .fold(0.0_f32, |size, x| size.max(x.abs()));
    let mut worst = 0.0_f32;
    for (pose, &place) in places.iter().enumerate() {
        let shape = map.pose_at(place)?;
        let apart = shape
            .iter()
            .zip(poses.frame(pose))
            .map(|(a, b)| (a - b).abs());
        worst = worst.max(apart.fold(0.0, f32::max));
    }
    Ok(f64::from(worst / size))
}

/// How often the curve comes near a place and leaves it again.
fn visits(motion: &Loom, place: [f64; 2]) -> usize {
    let near: Vec<bool> = (0..=10 * (FRAMES - 1))
        .filter_map(|i| motion.position_at(1.0 + i as f64 / 10.0).ok())
        .map(|p| distance(p, place) < 0.2)
        .collect();
    near.windows(2).filter(|pair| !pair[0] && pair[1]).count()
}

/// Expressions farther from the curve than half of the map's radius.
fn unseen(motion: &Loom, places: &[[f64; 2]]) -> Vec<usize> {
    let curve: Vec<_> = (1..=FRAMES)
        .filter_map(|frame| motion.position_at(frame as f64).ok())
        .collect();
    let nearest = |place: [f64; 2]| {
        let far = curve.iter().map(|&p| distance(p, place));
        far.fold(f64::INFINITY, f64::min)
    };
    (0..places.len())
        .filter(|&pose| nearest(places[pose]) > 0.5)
        .collect()
}

/// The map with the expressions at their places, and frames of the motion below.
fn compose(motion: &Loom, poses: &Sequence, places: &[[f64; 2]], view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let (wide, tall, face) = (1100.0, 620.0, 110.0);
    let side = wide / SHOWN as f32;
    let mut scene = Scene::new(wide, tall + side + 90.0, theme.background);
    let (map, _) = plot_loom(motion);
    let map = PoseSpace {
        curve: map.curve,
        times: map.times,
        marked: places.to_vec(),
        window: Some([[-2.1, 2.1], [-1.4, 1.3]]),
        ..PoseSpace::default()
    };
    let (map, plane) = pose_space(&map, wide, tall, &theme);
    scene.write(
        "(a) expressions on the map, and the time signal",
        [0.5 * wide, 16.0],
        Anchor::Middle,
        &theme,
    );
    scene.place(map, [0.0, 24.0]);
    for (pose, &[x, y]) in places.iter().enumerate() {
        // outside of the ring; the neutral one to its left
        let out = match pose {
            NEUTRAL => [-0.33, 0.0],
            _ if x.abs() < 0.1 => [x + 0.28, y],
            _ => [1.28 * x, y],
        };
        let at = plane.pixel(out);
        let image = view.picture(poses.frame(pose), 2 * face as usize, [215, 180, 150]);
        let corner = [at[0] - 0.5 * face, at[1] + 24.0 - 0.5 * face];
        scene.items.push(Item::Picture {
            rect: Rect::new(corner[0], corner[1], face, face),
            image,
        });
        let name = [at[0], corner[1] + face + 2.0];
        scene.write(NAMES[pose], name, Anchor::Middle, &theme);
    }
    let mut shapes = Vec::new();
    for shown in 0..SHOWN {
        let frame = 1 + shown * (FRAMES - 1) / (SHOWN - 1);
        let shape = motion.at(frame as f64)?;
        let image = view.picture(&shape, 2 * side as usize, [215, 180, 150]);
        shapes.push((format!("ψ({frame})"), image));
    }
    scene.write(
        "(b) frames of the motion",
        [0.5 * wide, tall + 44.0],
        Anchor::Middle,
        &theme,
    );
    support::row(&mut scene, [0.0, tall + 54.0], side, &shapes, &theme);
    Ok(scene)
}
