//! Figure 7 of Cashman & Hormann 2012: a gallop transferred to another animal by pairs of example poses.
//! Blends of vertices shrink what turns and stretch what turns far; blends of deformation gradients and of
//! patches do not.
//!
//! By default a riding horse's gallop goes to a draught horse, a mesh of other faces whose own gallop is
//! known; with paths it is any three captures, such as horse-gallop, horse-poses and elephant-poses:
//!
//! ```text
//! cargo run --release --example figure7_transfer [CAPTURE SOURCES TARGETS] [--out FOLDER]
//! ```

mod support;

use std::process::ExitCode;

use meshloom::demo::{Build, horse_gallop, horse_poses};
use meshloom::diag::{Diagnostic, Result};
use meshloom::edit::transfer::{Examples, transfer};
use meshloom::loom::fit::{self, FitOptions};
use meshloom::mesh::{Edges, FrameSource, Sequence, Topology};
use meshloom::plot::{Anchor, Scene, Theme};
use meshloom::task::Task;

use support::{Figure, View, percent, table};

/// The spaces in the order of the picture's rows.
const SPACES: [&str; 3] = ["vertices", "gradients", "patch-lri"];

/// Frames in a row of the picture.
const SHOWN: usize = 6;

fn main() -> ExitCode {
    support::run_with("figure7_transfer", &["CAPTURE", "SOURCES", "TARGETS"], draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (gallop, view) = figure.capture("gallop")?;
    let given = figure.others()?;
    let (sources, targets, own) = match &given[..] {
        [sources, targets] => (sources.clone(), targets.clone(), None),
        _ => {
            let [sources, targets] = [Build::Light, Build::Heavy].map(horse_poses);
            (sources, targets, Some(horse_gallop(Build::Heavy)))
        }
    };
    let examples = Examples::new(sources, targets.clone())?;
    let found: Vec<Moved> = SPACES
        .iter()
        .map(|space| moved(&gallop, &examples, space))
        .collect::<Result<_>>()?;
    let rest = Rest::new(&targets);
    let mut rows = vec![rest.row("the examples", &targets, None)];
    rows.extend(own.iter().map(|own| rest.row("its own gallop", own, None)));
    for (space, moved) in SPACES.iter().zip(&found) {
        let mut row = rest.row(space, &moved.frames, own.as_ref());
        row.push(percent(moved.coverage));
        rows.push(row);
    }
    let heads = [
        "",
        "edges stretched",
        "doubled or halved",
        "volume",
        "off its own",
        "outside the span",
    ];
    table(&heads, &rows);
    let worst = |moved: &Moved| rest.strain(&moved.frames).0;
    let [vertices, gradients, patches] = [0, 1, 2].map(|space| worst(&found[space]));
    figure.goal(
        "gradients and patch-lri stretch edges less than vertices do",
        gradients < vertices && patches < vertices,
    );
    let known = own
        .iter()
        .chain([&targets])
        .map(|known| rest.strain(known).0);
    let most = 1.2 * known.fold(0.0, f64::max);
    figure.goal(
        "and at most a fifth more than the examples or the animal's own gallop",
        gradients < most && patches < most,
    );
    figure.picture(&compose(&gallop, &view, &found, own.as_ref()))
}

/// The gallop on the other animal.
struct Moved {
    frames: Sequence,
    /// Mean distance of the source's frames from what the examples span, relative.
    coverage: f64,
}

fn moved(gallop: &Sequence, examples: &Examples, space: &str) -> Result<Moved> {
    let options = FitOptions {
        space: space.to_string(),
        left_out: false,
        ..FitOptions::ch12()
    };
    let task = Task::default();
    let loom = fit::fit(gallop, &options, &task)?.output;
    let found = transfer(&loom, examples, &task)?.output;
    let mut positions = Vec::new();
    for frame in 1..=found.loom.frames() {
        positions.extend(found.loom.at(frame as f64)?);
    }
    if positions.iter().any(|x| !x.is_finite()) {
        return Diagnostic::error(format!("{space} gives numbers that are not finite")).err();
    }
    Ok(Moved {
        frames: Sequence::new(found.loom.topology().clone(), positions, found.loom.fps()),
        coverage: found.coverage.iter().sum::<f64>() / found.coverage.len() as f64,
    })
}

/// The target at rest.
struct Rest {
    edges: Edges,
    lengths: Vec<f64>,
    volume: f64,
}

impl Rest {
    fn new(targets: &Sequence) -> Self {
        let edges = Edges::new(targets.topology());
        Rest {
            lengths: lengths(&edges, targets.frame(0)),
            volume: volume(targets.topology(), targets.frame(0)),
            edges,
        }
    }

    /// Of the worst frame: root mean square logarithm of the ratio of an edge's length to that at rest, and
    /// the share of edges beyond a factor of two. Edges below a thousandth of the mean are left out.
    fn strain(&self, frames: &Sequence) -> (f64, f64) {
        let mean = self.lengths.iter().sum::<f64>() / self.lengths.len() as f64;
        let of = |frame: usize| {
            let now = lengths(&self.edges, frames.frame(frame));
            let pairs = now.iter().zip(&self.lengths);
            let logs: Vec<f64> = pairs
                .filter(|(_, rest)| **rest > 1e-3 * mean)
                .map(|(now, rest)| (now / rest).ln())
                .collect();
            let squares: f64 = logs.iter().map(|x| x * x).sum();
            let far = logs.iter().filter(|x| x.abs() > 2.0_f64.ln()).count();
            let count = logs.len() as f64;
            ((squares / count).sqrt(), far as f64 / count)
        };
        (0..frames.frames()).map(of).fold((0.0, 0.0), |worst, one| {
            (worst.0.max(one.0), worst.1.max(one.1))
        })
    }

    fn row(&self, name: &str, frames: &Sequence, own: Option<&Sequence>) -> Vec<String> {
        let (strain, far) = self.strain(frames);
        let volumes = (0..frames.frames())
            .map(|frame| volume(frames.topology(), frames.frame(frame)) / self.volume);
        let (least, most) = volumes.fold((f64::MAX, f64::MIN), |(least, most), v| {
            (least.min(v), most.max(v))
        });
        vec![
            name.to_string(),
            percent(strain),
            percent(far),
            format!("{least:.2} to {most:.2}"),
            own.map_or(String::new(), |own| percent(distance(own, frames))),
        ]
    }
}

fn lengths(edges: &Edges, frame: &[f32]) -> Vec<f64> {
    let points = frame.as_chunks::<3>().0;
    let length = |&[a, b]: &[u32; 2]| {
        let (p, q) = (points[a as usize], points[b as usize]);
        let square = |i: usize| f64::from(p[i] - q[i]).powi(2);
        (0..3).map(square).sum::<f64>().sqrt()
    };
    edges.ends().iter().map(length).collect()
}

fn volume(topology: &Topology, frame: &[f32]) -> f64 {
    let points = frame.as_chunks::<3>().0;
    let cone = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|v| points[v as usize].map(f64::from));
        a[0] * (b[1] * c[2] - b[2] * c[1])
            + a[1] * (b[2] * c[0] - b[0] * c[2])
            + a[2] * (b[0] * c[1] - b[1] * c[0])
    };
    topology.triangles().iter().map(cone).sum::<f64>() / 6.0
}

/// |a - b| over |a - the mean frame of a|.
fn distance(a: &Sequence, b: &Sequence) -> f64 {
    let (n, width) = (a.frames(), a.frame(0).len());
    let mut mean = vec![0.0; width];
    for frame in 0..n {
        let row = a.frame(frame).iter();
        mean.iter_mut()
            .zip(row)
            .for_each(|(mean, &x)| *mean += f64::from(x) / n as f64);
    }
    let (mut missed, mut moved) = (0.0, 0.0);
    for frame in 0..n {
        for (at, mean) in mean.iter().enumerate() {
            let (x, y) = (f64::from(a.frame(frame)[at]), f64::from(b.frame(frame)[at]));
            missed += (x - y).powi(2);
            moved += (x - mean).powi(2);
        }
    }
    (missed / moved).sqrt()
}

/// A row of frames for the source, for each space and for the target's own motion.
fn compose(gallop: &Sequence, view: &View, found: &[Moved], own: Option<&Sequence>) -> Scene {
    let theme = Theme::light();
    let (side, left, line) = (170.0, 90.0, 22.0);
    let other = View::looking(&found[1].frames, view.direction());
    let mut rows: Vec<(&str, &View, &Sequence, [u8; 3])> =
        vec![("source", view, gallop, [200, 170, 130])];
    for (space, moved) in SPACES.iter().zip(found) {
        rows.push((space, &other, &moved.frames, [150, 170, 200]));
    }
    rows.extend(own.map(|own| ("its own", &other, own, [160, 190, 160])));
    let width = left + side * SHOWN as f32;
    let height = (side + line) * rows.len() as f32;
    let mut scene = Scene::new(width, height, theme.background);
    // one stride: half of the frames
    let step = (gallop.frames() / 2).div_ceil(SHOWN).max(1);
    for (at, (name, view, frames, colour)) in rows.into_iter().enumerate() {
        let top = at as f32 * (side + line);
        scene.write(name, [0.5 * left, top + 0.5 * side], Anchor::Middle, &theme);
        let pictures: Vec<_> = (0..SHOWN)
            .map(|column| (column * step).min(frames.frames() - 1))
            .map(|frame| {
                let image = view.picture(frames.frame(frame), 2 * side as usize, colour);
                ((frame + 1).to_string(), image)
            })
            .collect();
        support::row(&mut scene, [left, top], side, &pictures, &theme);
    }
    scene
}
