//! What the figures share: the capture (a demo, or a path on the command line), fitting, small pictures of
//! shapes, tables beside the paper's numbers, goals, and the folder that pictures go to.
//!
//! ```text
//! cargo run --release --example figure1_horse [CAPTURE] [--out FOLDER]
//! ```
#![allow(dead_code)] // every figure uses its part

pub(crate) mod rojas;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use meshloom::demo::Demo;
use meshloom::diag::{Diagnostic, Result};
use meshloom::image::Image;
use meshloom::io::Disk;
use meshloom::loom::Loom;
use meshloom::loom::fit::{self, FitOptions};
use meshloom::mesh::{Bounds, FrameSource, Sequence, Topology};
use meshloom::pipeline::{self, InputSpec, PictureFormat};
use meshloom::plot::{Item, Path, Point, Rect, Scene, Stroke, Theme};
use meshloom::task::Task;
use meshloom::view::{self, Camera, Style, Surface};

/// A figure under way.
pub(crate) struct Figure {
    name: &'static str,
    capture: Option<PathBuf>,
    others: Vec<PathBuf>,
    folder: PathBuf,
    missed: usize,
}

/// Runs `draw`: exit code 0, or 1 if it failed or missed a goal.
pub(crate) fn run(name: &'static str, draw: impl FnOnce(&mut Figure) -> Result<()>) -> ExitCode {
    run_with(name, &["CAPTURE"], draw)
}

/// As [`run`] for a figure of several inputs: all or none of them are given on the command line; any number
/// where the only one ends in "..".
pub(crate) fn run_with(
    name: &'static str,
    inputs: &[&str],
    draw: impl FnOnce(&mut Figure) -> Result<()>,
) -> ExitCode {
    let usage = || {
        eprintln!("usage: {name} [{}] [--out FOLDER]", inputs.join(" "));
        ExitCode::from(2)
    };
    let mut arguments = std::env::args_os().skip(1);
    let mut figure = Figure {
        name,
        capture: None,
        others: Vec::new(),
        folder: PathBuf::from("target/figures"),
        missed: 0,
    };
    while let Some(argument) = arguments.next() {
        match (argument.to_str(), &figure.capture) {
            (Some("--out"), _) => figure.folder = arguments.next().unwrap_or_default().into(),
            (Some(option), _) if option.starts_with('-') => return usage(),
            (_, None) => figure.capture = Some(argument.into()),
            (_, Some(_)) => figure.others.push(argument.into()),
        }
    }
    let given = usize::from(figure.capture.is_some()) + figure.others.len();
    let many = inputs.iter().any(|input| input.ends_with(".."));
    if given != 0 && !many && given != inputs.len() {
        return usage();
    }
    match draw(&mut figure) {
        Ok(()) if figure.missed == 0 => ExitCode::SUCCESS,
        Ok(()) => ExitCode::FAILURE,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

impl Figure {
    /// The capture of the command line, or else the demo of that name; and how to look at it.
    pub(crate) fn capture(&self, demo: &str) -> Result<(Sequence, View)> {
        let (sequence, direction) = match (&self.capture, Demo::find(demo)) {
            (Some(path), _) => (open(path)?, [0.6, 0.25]),
            (None, Some(demo)) => (demo.generate(), demo.view),
            (None, None) => return Diagnostic::error(format!("no demo `{demo}`")).err(),
        };
        let view = View::looking(&sequence, direction);
        Ok((sequence, view))
    }

    /// All captures of the command line with their names.
    pub(crate) fn captures(&self) -> Result<Vec<(String, Sequence)>> {
        let name = |path: &PathBuf| {
            let whole = path.to_string_lossy();
            let last = whole.trim_end_matches('/').rsplit('/').next();
            last.unwrap_or_default().to_string()
        };
        let paths = self.capture.iter().chain(&self.others);
        paths.map(|path| Ok((name(path), open(path)?))).collect()
    }

    /// The inputs after the capture.
    pub(crate) fn others(&self) -> Result<Vec<Sequence>> {
        self.others.iter().map(open).collect()
    }

    /// Whether the capture is the demo, whose numbers are known.
    pub(crate) fn is_demo(&self) -> bool {
        self.capture.is_none()
    }

    /// States a goal, and whether it is met: if not, the figure's exit code will be 1.
    pub(crate) fn goal(&mut self, statement: &str, met: bool) {
        println!("{} {statement}", if met { "met:   " } else { "MISSED:" });
        self.missed += usize::from(!met);
    }

    /// Writes a picture as PNG and SVG, named after the figure.
    pub(crate) fn picture(&self, scene: &Scene) -> Result<()> {
        for ending in ["png", "svg"] {
            let path = self.folder.join(self.name).with_extension(ending);
            pipeline::save_picture(&Disk, scene, &path.clone().into(), 2.0)?;
            println!("wrote {}", path.display());
        }
        PictureFormat::of(&self.folder.join("a.png")).map(|_| ())
    }
}

fn open(path: &PathBuf) -> Result<Sequence> {
    let opened = pipeline::open(&Disk, &InputSpec::new(path), &Task::default())?;
    opened.output.content.sequence(&Task::default())
}

/// Fits `sequence` with given k, l, m.
pub(crate) fn fit(sequence: &Sequence, [controls, sites, modes]: [usize; 3]) -> Result<Loom> {
    fit_with(sequence, [controls, sites, modes], FitOptions::ch12())
}

/// Fits with given k, l, m and other options.
pub(crate) fn fit_with(
    sequence: &Sequence,
    [controls, sites, modes]: [usize; 3],
    options: FitOptions,
) -> Result<Loom> {
    let options = FitOptions {
        controls: Some(controls),
        sites: Some(sites),
        modes: Some(modes),
        left_out: false,
        ..options
    };
    Ok(fit::fit(sequence, &options, &Task::default())?.output)
}

/// Every `step`-th frame, from the first on.
pub(crate) fn every(sequence: &Sequence, step: usize) -> Sequence {
    let kept = (0..sequence.frames()).step_by(step);
    let positions = kept.flat_map(|frame| sequence.frame(frame).to_vec());
    let fps = sequence.fps().map(|fps| fps / step as f64);
    Sequence::new(sequence.topology().clone(), positions.collect(), fps)
}

/// The first `count` frames, or all.
pub(crate) fn first(sequence: &Sequence, count: usize) -> Sequence {
    sequence.slice(0..count.min(sequence.frames()))
}

/// The last `count` frames, or all.
pub(crate) fn last(sequence: &Sequence, count: usize) -> Sequence {
    let n = sequence.frames();
    sequence.slice(n.saturating_sub(count)..n)
}

/// One direction and distance for all shapes of a figure.
#[derive(Clone)]
pub(crate) struct View {
    camera: Camera,
    topology: Arc<Topology>,
}

impl View {
    /// Such that all frames fill the picture.
    pub(crate) fn looking(sequence: &Sequence, [yaw, pitch]: [f64; 2]) -> Self {
        let mut camera = Camera {
            yaw,
            pitch,
            ..Camera::default()
        };
        if let Some(bounds) = Bounds::of(sequence.positions()) {
            camera.frame(&bounds, 1.0);
        }
        View {
            camera,
            topology: sequence.topology().clone(),
        }
    }

    /// From the same place on another mesh.
    pub(crate) fn on(&self, topology: Arc<Topology>) -> Self {
        View {
            topology,
            ..self.clone()
        }
    }

    /// Yaw and pitch.
    pub(crate) fn direction(&self) -> [f64; 2] {
        [self.camera.yaw, self.camera.pitch]
    }

    /// A shape (3V coordinates) on a clear background, `side` x `side` pixels of colour `front`.
    pub(crate) fn picture(&self, positions: &[f32], side: usize, front: [u8; 3]) -> Arc<Image> {
        self.drawn(positions, None, side, front)
    }

    /// The same in a colour a vertex.
    pub(crate) fn coloured(
        &self,
        positions: &[f32],
        colours: &[[u8; 3]],
        side: usize,
    ) -> Arc<Image> {
        self.drawn(positions, Some(colours), side, Style::LIGHT.front)
    }

    fn drawn(
        &self,
        positions: &[f32],
        colours: Option<&[[u8; 3]]>,
        side: usize,
        front: [u8; 3],
    ) -> Arc<Image> {
        let mut image = Image::new(2 * side, 2 * side);
        let surface = Surface {
            triangles: self.topology.triangles(),
            positions,
            colours,
        };
        let style = Style {
            background: [255, 255, 255, 0],
            front,
            ..Style::LIGHT
        };
        view::render(surface, &self.camera, &style, &mut image);
        Arc::new(image.halved())
    }
}

/// Prints columns under their heads, the first to the left, the others to the right.
pub(crate) fn table(heads: &[&str], rows: &[Vec<String>]) {
    let width = |column: usize| {
        let cells = rows
            .iter()
            .filter_map(|row| row.get(column))
            .map(|cell| cell.chars().count());
        cells
            .chain([heads[column].chars().count()])
            .max()
            .unwrap_or(0)
    };
    let print = |cells: &[String]| {
        for (column, cell) in cells.iter().enumerate() {
            let wide = width(column);
            match column {
                0 => print!("{cell:<wide$}"),
                _ => print!("  {cell:>wide$}"),
            }
        }
        println!();
    };
    print(&heads.iter().map(ToString::to_string).collect::<Vec<_>>());
    rows.iter().for_each(|row| print(row));
}

/// A share as percent with digits that say something.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.2} %", 100.0 * share)
}

/// Distance of two points of the map.
pub(crate) fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Largest distance of two of the points: the size of a map.
pub(crate) fn diameter(points: &[[f64; 2]]) -> f64 {
    let pairs = points
        .iter()
        .flat_map(|a| points.iter().map(move |b| distance(*a, *b)));
    pairs.fold(0.0, f64::max)
}

/// Pictures in a row, left to right from `at`, each `side` wide with a line of text below.
pub(crate) fn row(
    scene: &mut Scene,
    at: Point,
    side: f32,
    pictures: &[(String, Arc<Image>)],
    theme: &Theme,
) {
    for (i, (text, image)) in pictures.iter().enumerate() {
        let left = at[0] + i as f32 * side;
        scene.items.push(Item::Picture {
            rect: Rect::new(left, at[1], side, side),
            image: image.clone(),
        });
        let below = [left + 0.5 * side, at[1] + side + 0.9 * theme.text];
        scene.write(text, below, meshloom::plot::Anchor::Middle, theme);
    }
}

/// A frame around a part of the picture.
pub(crate) fn outline(scene: &mut Scene, rect: Rect, theme: &Theme) {
    scene.stroke(Path::rect(rect), Stroke::new(theme.muted, theme.unit()));
}
