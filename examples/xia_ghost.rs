//! Figures 7 and 8 of Xia et al. 2019: how many faces a ghost needs. Three keys, 13 shapes with ghosts of
//! 0.5 to 24 thousand faces against the sequence without: the KG error (eq. 7), with and without the
//! residual that keeps the keys, by the screened solve and by the direct lift, by deformation transfer to
//! the letter (gradients only), and the time of a frame.
//! The picture shows the ghosts of the 11th shape, the shape behind each, coloured by its distance from the
//! one without a ghost, and the curves.
//!
//! ```text
//! cargo run --release --example xia_ghost [CAPTURE] [--out FOLDER]
//! ```

#[path = "support/key_sets.rs"]
mod key_sets;
mod support;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use key_sets::{HORSE, demo_keys, faces};
use meshloom::diag::Result;
use meshloom::image::Image;
use meshloom::inbetween::{
    CompleteOptions, GhostOptions, GhostSize, Keys, Lift, Motion, MotionFrames, complete,
};
use meshloom::mesh::{FrameSource, Sequence, Topology};
use meshloom::metric;
use meshloom::plot::{Chart, Panel, Scale, Scene, Series, Style, Theme, Tint, chart};
use meshloom::task::Task;
use meshloom::view::heat_colours;
use support::{Figure, View, every, first, row, table};

/// The sizes of X19's Figure 7.
const SIZES: [usize; 9] = [500, 1000, 2000, 3000, 5000, 10_000, 12_000, 15_000, 24_000];

/// How the mesh follows, and whether the residual is kept. The last is X19's own.
const WAYS: [(Lift, bool); 5] = [
    (Lift::Solve, true),
    (Lift::Solve, false),
    (Lift::Direct, true),
    (Lift::Direct, false),
    (Lift::Transfer, false),
];

/// How many of the ways the bound is for.
const HELD: usize = 4;

/// Shapes of a sequence, and which of them is shown (from 0).
const SHAPES: usize = 13;
const SHOWN: usize = 10;

/// Side of a small picture.
const SIDE: f32 = 150.0;

fn main() -> ExitCode {
    support::run("xia_ghost", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let sets = if figure.is_demo() {
        vec![
            ("cactus x 4", demo_keys("cactus", &[0, 1, 2], 1)),
            ("horse", demo_keys("gallop", &HORSE, 0)),
            ("horse x 4", demo_keys("gallop", &HORSE, 1)),
        ]
    } else {
        let all = figure.capture("")?.0;
        let step = (all.frames() / 3).max(1);
        vec![("capture", Keys::new(first(&every(&all, step), 3), None)?)]
    };
    let theme = Theme::light();
    let height = SIDE + 2.0 * theme.text;
    let mut picture = Scene::new(
        SIDE * (SIZES.len() + 1) as f32,
        2.0 * height * sets.len() as f32 + 420.0,
        theme.background,
    );
    let mut curves = Vec::new();
    for (at, (name, keys)) in sets.iter().enumerate() {
        let study = Study::of(keys)?;
        study.print(name);
        let top = 2.0 * at as f32 * height;
        let ghosts: Vec<_> = study.sizes.iter().map(|size| size.drawn(keys)).collect();
        row(&mut picture, [SIDE, top], SIDE, &ghosts, &theme);
        let mut pictures = vec![("whole".to_string(), study.view(keys, None))];
        pictures.extend(study.sizes.iter().map(|size| {
            (
                format!("KG {:.1} %", size.kg[0]),
                study.view(keys, Some(size)),
            )
        }));
        row(&mut picture, [0.0, top + height], SIDE, &pictures, &theme);
        study.hold_to(figure, name);
        curves.push((*name, study));
    }
    let below = 2.0 * height * sets.len() as f32;
    let scene = figure_8(&curves, SIDE * (SIZES.len() + 1) as f32, &theme);
    picture.place(scene, [0.0, below]);
    figure.picture(&picture)
}

/// Ghosts of many sizes for some keys.
struct Study {
    whole: MotionFrames,
    whole_seconds: f64,
    sizes: Vec<Size>,
}

struct Size {
    faces: usize,
    /// KG errors in percent, in the order of [`WAYS`].
    kg: [f64; 5],
    seconds: f64,
    /// The shape that is shown, and its ghost.
    shape: Vec<f32>,
    ghost: Option<(Arc<Topology>, Vec<f64>)>,
}

impl Size {
    /// The ghost and its name.
    fn drawn(&self, keys: &Keys) -> (String, Arc<Image>) {
        let view = looking(keys);
        let picture = self.ghost.as_ref().map(|(topology, positions)| {
            let positions: Vec<f32> = positions.iter().map(|&x| x as f32).collect();
            let view = view.on(Arc::clone(topology));
            view.picture(&positions, 2 * SIDE as usize, [110, 140, 200])
        });
        let side = 2 * SIDE as usize;
        let picture = picture.unwrap_or_else(|| Arc::new(Image::new(side, side)));
        (format!("{} faces", self.faces), picture)
    }
}

fn looking(keys: &Keys) -> View {
    View::looking(keys.poses(), [0.35, 0.15])
}

impl Study {
    fn of(keys: &Keys) -> Result<Self> {
        let whole = frames(keys, GhostSize::Off, Lift::Solve, true)?;
        let whole_seconds = seconds(whole.motion());
        let mut sizes = Vec::new();
        for faces in SIZES.into_iter().filter(|size| 2 * size < faces(keys)) {
            let size = GhostSize::Faces(faces);
            let found: Vec<MotionFrames> = WAYS
                .iter()
                .map(|&(lift, residual)| frames(keys, size, lift, residual))
                .collect::<Result<_>>()?;
            let kg = |at: usize| {
                let compared = metric::compare(&whole, &found[at], &Task::default());
                compared.map_or(f64::NAN, |compared| compared.vertices.kg_percent)
            };
            let mut shape = vec![0.0; 3 * keys.poses().topology().vertices()];
            // frames of a motion are always there
            let _ = found[0].read_frame(SHOWN, &mut shape);
            sizes.push(Size {
                faces,
                kg: std::array::from_fn(kg),
                seconds: seconds(found[0].motion()),
                ghost: found[0].motion().ghost_at(found[0].times()[SHOWN]),
                shape,
            });
        }
        Ok(Study {
            whole,
            whole_seconds,
            sizes,
        })
    }

    fn print(&self, name: &str) {
        let faces = self.whole.topology().triangles().len();
        println!(
            "\n{name}: {faces} faces, {:.1} ms a frame without a ghost (X19: centaur, 32 K faces, 750 ms)",
            1e3 * self.whole_seconds
        );
        let rows: Vec<Vec<String>> = self
            .sizes
            .iter()
            .map(|size| {
                let mut cells = vec![size.faces.to_string()];
                cells.extend(size.kg.map(|kg| format!("{kg:.2} %")));
                cells.push(format!("{:.1}", 1e3 * size.seconds));
                cells
            })
            .collect();
        table(
            &[
                "ghost",
                "KG solve",
                "without residual",
                "direct",
                "without",
                "gradients only",
                "ms a frame",
            ],
            &rows,
        );
        println!("X19 Fig. 8a: above 20 % at 500 faces, below 5 % from 2000 on");
    }

    fn hold_to(&self, figure: &mut Figure, name: &str) {
        let at = |faces: usize| self.sizes.iter().find(|size| size.faces == faces);
        if let Some(size) = at(2000) {
            let worst = size.kg[..HELD].iter().copied().fold(0.0, f64::max);
            figure.goal(
                &format!("{name}: KG below 5 % with 2000 faces, each way"),
                worst < 5.0,
            );
        }
        // from size to size, up to a tenth of a percent
        let falls = |way: usize| {
            let mut pairs = self.sizes.windows(2);
            pairs.all(|pair| pair[1].kg[way] < pair[0].kg[way] + 0.1)
        };
        figure.goal(
            &format!("{name}: the error falls as the ghost grows, each way"),
            (0..HELD).all(falls),
        );
    }

    /// The shown shape, coloured by its distance from the one without a ghost; that itself in grey.
    fn view(&self, keys: &Keys, size: Option<&Size>) -> Arc<Image> {
        let mut whole = vec![0.0; 3 * keys.poses().topology().vertices()];
        let _ = self.whole.read_frame(SHOWN, &mut whole);
        let view = looking(keys);
        let Some(size) = size else {
            return view.picture(&whole, 2 * SIDE as usize, [170, 170, 170]);
        };
        let far: Vec<f32> = whole
            .chunks_exact(3)
            .zip(size.shape.chunks_exact(3))
            .map(|(a, b)| {
                let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
                squares.sum::<f32>().sqrt()
            })
            .collect();
        let mut colours = Vec::new();
        heat_colours(&far, 0.01 * extent(keys.poses()), &mut colours);
        view.coloured(&size.shape, &colours, 2 * SIDE as usize)
    }
}

/// The largest side of the box around the first key.
fn extent(poses: &Sequence) -> f32 {
    meshloom::mesh::Bounds::of(poses.frame(0)).map_or(1.0, |bounds| {
        let sides = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]);
        sides.fold(0.0, f32::max)
    })
}

fn frames(keys: &Keys, size: GhostSize, lift: Lift, residual: bool) -> Result<MotionFrames> {
    let options = CompleteOptions {
        ghost: GhostOptions {
            size,
            lift,
            residual,
        },
        ..CompleteOptions::default()
    };
    let motion = complete(keys, &options, &Task::default())?.output;
    let [start, end] = keys.ends();
    let time = |i: usize| start + (end - start) * i as f64 / (SHAPES - 1) as f64;
    let times = (0..SHAPES).map(time).collect();
    Ok(MotionFrames::new(Arc::new(motion), times, None))
}

/// Of one frame, the best of three.
fn seconds(motion: &Motion) -> f64 {
    let [start, end] = motion.ends();
    let mut positions = motion.at(start);
    let runs = (0..3).map(|_| {
        let clock = Instant::now();
        motion.evaluate(0.4 * start + 0.6 * end, &mut positions);
        clock.elapsed().as_secs_f64()
    });
    runs.fold(f64::INFINITY, f64::min)
}

/// KG errors (a) and seconds of a frame (b) by the faces of the ghost.
fn figure_8(curves: &[(&str, Study)], width: f32, theme: &Theme) -> Scene {
    let series = |of: &dyn Fn(&Size) -> f64, name: String, tint: usize, style: Style| {
        let study = &curves[tint].1;
        let points = study.sizes.iter().map(|size| [size.faces as f64, of(size)]);
        Series::line(name, Tint::Series(tint), points.collect()).styled(style)
    };
    let all = 0..curves.len();
    let name = |at: usize| curves[at].0.to_string();
    let errors = all.clone().flat_map(|at| {
        [
            series(&|size| size.kg[0], name(at), at, Style::Both),
            series(&|size| size.kg[1], String::new(), at, Style::Dashed),
        ]
    });
    let times = all.map(|at| series(&|size| 1e3 * size.seconds, String::new(), at, Style::Both));
    let panel = |name: &str, series: Vec<Series>| Panel {
        name: name.to_string(),
        from_zero: true,
        series,
        ..Panel::default()
    };
    let both = Chart {
        name: "faces of the ghost (dashed: without the residual)".into(),
        scale: Scale::Log,
        panels: vec![
            panel("KG error (%)", errors.collect()),
            panel("ms a frame", times.collect()),
        ],
        ..Chart::default()
    };
    chart(&both, width, 420.0, theme).0
}
