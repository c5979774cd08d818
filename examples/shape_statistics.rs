//! Statistics of shapes (Rojas et al. 2014, §4.3): barbells measured by their edge lengths and by aligned
//! distances (Fig. 7), expressions brought from one face to another (Fig. 10), and a map of expressions
//! by principal components (Fig. 9). With a capture, its frames are the expressions, the first the
//! neutral one.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::{Diagnostic, Result};
use meshloom::image::Image;
use meshloom::mesh::{Bounds, Edges, FrameSource, Sequence, Topology};
use meshloom::pipeline::{StatisticsRequest, add_difference, statistics};
use meshloom::plot::{Anchor, Scene, Theme};
use meshloom::statistics::{EDGE_LENGTHS, Ground, aligned, aligned_rms, scale_free};
use meshloom::task::Task;

use support::{Figure, View, table};

fn main() -> ExitCode {
    support::run("shape_statistics", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let bells = barbells();
    compare_barbells(figure, &bells)?;
    let (faces, view) = figure.capture("face")?;
    if faces.frames() < 3 {
        return Diagnostic::error("expressions are three frames or more").err();
    }
    let transferred = transfer(figure, &faces)?;
    let map = expressions(figure, &faces)?;
    figure.picture(&compose(&bells, &transferred, &view, map))
}

// --- barbells

/// Rings along a barbell and vertices around each.
const RINGS: usize = 61;
const AROUND: usize = 24;

/// Long and short barbells with round ends, then with flat ends. They share their faces.
fn barbells() -> Sequence {
    let shapes = [(5.0, false), (1.6, false), (5.0, true), (1.6, true)];
    let mut triangles = Vec::new();
    let at = |i: usize, j: usize| (i * AROUND + j % AROUND) as u32;
    for i in 1..RINGS {
        for j in 0..AROUND {
            let [a, b, c, d] = [at(i - 1, j), at(i, j), at(i, j + 1), at(i - 1, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let topology = Topology::from_triangles(RINGS * AROUND, &triangles).expect("a tube");
    let positions = shapes.iter().flat_map(|&(bar, flat)| barbell(bar, flat));
    Sequence::new(Arc::new(topology), positions.collect(), None)
}

/// A third of the rings for each end, the others for the bar. Round ends are balls, flat ones discs.
fn barbell(bar: f64, flat: bool) -> Vec<f32> {
    let third = RINGS / 3;
    let (long, wide) = if flat { (0.35, 1.3) } else { (1.0, 1.0) };
    let ring = |i: usize| {
        let end = i.min(RINGS - 1 - i);
        let side = if i < RINGS / 2 { -1.0 } else { 1.0 };
        if end < third {
            // the ball from its tip to where the bar meets it
            let angle = 0.03 + 2.85 * end as f64 / (third - 1) as f64;
            let x = side * (0.5 * bar + long + long * angle.cos());
            [x, (wide * angle.sin()).max(0.25)]
        } else {
            let along = (i - third + 1) as f64 / (RINGS - 2 * third + 1) as f64;
            [bar * (along - 0.5), 0.25]
        }
    };
    let rings = (0..RINGS).map(ring);
    rings
        .flat_map(|[x, radius]| {
            (0..AROUND).flat_map(move |j| {
                let (sine, cosine) = (std::f64::consts::TAU * j as f64 / AROUND as f64).sin_cos();
                [x, radius * cosine, radius * sine].map(|x| x as f32)
            })
        })
        .collect()
}

fn doubles(row: &[f32]) -> Vec<f64> {
    row.iter().map(|&x| f64::from(x)).collect()
}

/// The kinds of ends differ as much on a long bar as on a short one; R14 finds aligned distances to say
/// that the long ones "are clearly more similar", and edge lengths "more comparable" ones.
fn compare_barbells(figure: &mut Figure, bells: &Sequence) -> Result<()> {
    let poses: Vec<Vec<f64>> = (0..4).map(|i| doubles(bells.frame(i))).collect();
    let edges = Edges::new(bells.topology());
    let free = aligned(&scale_free(&poses, edges.ends()));
    let ground = Ground::open(EDGE_LENGTHS, bells.topology(), &free)?;
    let codes: Vec<Vec<f64>> = free.iter().map(|pose| ground.encode(pose)).collect();
    let in_lengths = |a: usize, b: usize| {
        let pairs = codes[a].iter().zip(&codes[b]);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    };
    // scaled to the same root mean square distance from the middle, as Procrustes analysis does
    let procrustes: Vec<Vec<f64>> = poses
        .iter()
        .map(|pose| {
            let size = pose.iter().map(|x| x * x).sum::<f64>().sqrt();
            pose.iter().map(|x| x / size).collect()
        })
        .collect();
    let by_rms = |a: usize, b: usize| aligned_rms(&procrustes[a], &procrustes[b]);
    let ratio = |distance: &dyn Fn(usize, usize) -> f64| distance(1, 3) / distance(0, 2);
    let (rms, lengths) = (ratio(&by_rms), ratio(&in_lengths));
    let row = |name: &str, distance: &dyn Fn(usize, usize) -> f64, ratio: f64| {
        vec![
            name.to_string(),
            format!("{:.4}", distance(0, 2)),
            format!("{:.4}", distance(1, 3)),
            format!("{ratio:.2}"),
        ]
    };
    println!("barbells with round and with flat ends, size taken off (R14, Fig. 7)");
    table(
        &[
            "distance",
            "long - long",
            "short - short",
            "short over long",
        ],
        &[
            row("aligned RMS", &by_rms, rms),
            row("edge lengths", &in_lengths, lengths),
        ],
    );
    figure.goal(
        "by aligned RMS the long ones are the more similar pair",
        rms > 1.0,
    );
    figure.goal(
        "by edge lengths the two distances are more comparable",
        lengths.ln().abs() < rms.ln().abs(),
    );
    Ok(())
}

// --- expression transfer

/// Another head: wider, lower, its chin forward.
fn other_head(positions: &[f32]) -> Vec<f32> {
    let bounds = Bounds::of(positions).expect("a face has vertices");
    let middle: [f32; 3] = std::array::from_fn(|k| 0.5 * (bounds.min[k] + bounds.max[k]));
    let (points, _) = positions.as_chunks::<3>();
    points
        .iter()
        .flat_map(|p| {
            let [x, y, z]: [f32; 3] = std::array::from_fn(|k| p[k] - middle[k]);
            [1.18 * x, 0.9 * y, 1.05 * z - 0.12 * y]
        })
        .collect()
}

/// What each way of transfer gives for the expression in the picture.
struct Transferred {
    source: [Vec<f32>; 2],
    neutral: Vec<f32>,
    found: Vec<(&'static str, Vec<f32>)>,
    truth: Vec<f32>,
}

/// Every expression is added to another head. What should come is known: that head with the expression.
/// Errors are relative to the size of the expression, root mean square over all of them.
fn transfer(figure: &mut Figure, faces: &Sequence) -> Result<Transferred> {
    let neutral = other_head(faces.frame(0));
    let spaces = ["vertices", "gradients", EDGE_LENGTHS];
    let most = faces.frames().min(9);
    let mut squares = vec![[0.0_f64; 2]; spaces.len()];
    let shown = most - 1;
    let mut found = Vec::new();
    for frame in 1..most {
        let truth = doubles(&other_head(faces.frame(frame)));
        let size = aligned_rms(&truth, &doubles(&neutral));
        let three = [&neutral[..], faces.frame(0), faces.frame(frame)].concat();
        let three = Sequence::new(Arc::clone(faces.topology()), three, None);
        for (sums, name) in squares.iter_mut().zip(spaces) {
            let shape = add_difference(&three, name)?.output.positions;
            let miss = aligned_rms(&truth, &doubles(&shape));
            sums[0] += miss * miss;
            sums[1] += size * size;
            if frame == shown {
                found.push((name, shape));
            }
        }
    }
    let errors: Vec<f64> = squares
        .iter()
        .map(|[miss, size]| (miss / size).sqrt())
        .collect();
    println!(
        "{} expressions on another head (R14, Fig. 10): error over the expression's size",
        most - 1
    );
    let rows: Vec<Vec<String>> = spaces
        .iter()
        .zip(&errors)
        .map(|(name, error)| vec![name.to_string(), support::percent(*error)])
        .collect();
    table(&["space", "error"], &rows);
    for (name, error) in spaces.iter().zip(&errors) {
        figure.goal(
            &format!("{name} bring more than half of an expression"),
            *error < 0.5,
        );
    }
    Ok(Transferred {
        source: [faces.frame(0).to_vec(), faces.frame(shown).to_vec()],
        neutral,
        found,
        truth: other_head(faces.frame(shown)),
    })
}

// --- principal components

/// Names of the built-in face's expressions, or numbers.
fn names(figure: &Figure, frames: usize) -> Vec<String> {
    match figure.is_demo() {
        true => meshloom::demo::FACE_POSES
            .iter()
            .map(ToString::to_string)
            .collect(),
        false => (1..=frames).map(|frame| frame.to_string()).collect(),
    }
}

fn expressions(figure: &mut Figure, faces: &Sequence) -> Result<Scene> {
    let mut rows = Vec::new();
    let mut map = None;
    for space in ["vertices", "gradients", EDGE_LENGTHS] {
        let request = StatisticsRequest {
            space: space.to_string(),
            scale_free: false,
        };
        let found = statistics(faces, &request, &Task::default())?;
        let report = found.report();
        let shares = report.explained.iter().take(5);
        let mut cells = vec![space.to_string(), report.dimension.to_string()];
        cells.extend(shares.map(|share| format!("{:.1} %", 100.0 * share)));
        rows.push(cells);
        let total: f64 = report.explained.iter().sum();
        figure.goal(
            &format!("{space}: the shares of all modes sum to 1"),
            (total - 1.0).abs() < 1e-6,
        );
        if space == EDGE_LENGTHS {
            map = Some(found.figure(&names(figure, faces.frames()), &Theme::light()));
        }
    }
    println!("variance by mode; R14's three leading modes of 600 faces hold 12 %");
    let heads = ["space", "dimension", "1", "2", "3", "4", "5"];
    let columns = rows.iter().map(Vec::len).max().unwrap_or(2);
    table(&heads[..columns.min(heads.len())], &rows);
    map.map_or_else(|| Diagnostic::error("no map").err(), Ok)
}

// --- the picture

/// Side of a small picture in pixels of the file, twice that of the scene.
const SIDE: usize = 400;
const COLOURS: [[u8; 3]; 3] = [[150, 170, 200], [196, 188, 150], [160, 190, 160]];

fn compose(bells: &Sequence, faces: &Transferred, view: &View, map: Scene) -> Scene {
    let theme = Theme::light();
    let side = 0.5 * SIDE as f32;
    let row = side + 34.0;
    let mut scene = Scene::new(map.width, 2.0 * row + 26.0 + map.height, theme.background);
    let bell_view = View::looking(bells, [0.0, 0.2]);
    let told = ["long, round", "short, round", "long, flat", "short, flat"];
    let picture = |i: usize| bell_view.picture(bells.frame(i), SIDE, COLOURS[1]);
    let barbells: Vec<(String, Arc<Image>)> =
        (0..4).map(|i| (told[i].to_string(), picture(i))).collect();
    scene.write("barbells", [8.0, 16.0], Anchor::Start, &theme);
    support::row(&mut scene, [0.0, 8.0], side, &barbells, &theme);
    let mut heads = vec![
        (
            "neutral".to_string(),
            view.picture(&faces.source[0], SIDE, COLOURS[0]),
        ),
        (
            "expression".to_string(),
            view.picture(&faces.source[1], SIDE, COLOURS[0]),
        ),
        (
            "another head".to_string(),
            view.picture(&faces.neutral, SIDE, COLOURS[2]),
        ),
    ];
    for (name, shape) in faces.found.iter().skip(1) {
        heads.push((name.to_string(), view.picture(shape, SIDE, COLOURS[2])));
    }
    heads.push((
        "as it should be".to_string(),
        view.picture(&faces.truth, SIDE, COLOURS[1]),
    ));
    scene.write(
        "expression transfer",
        [8.0, row + 16.0],
        Anchor::Start,
        &theme,
    );
    support::row(&mut scene, [0.0, row + 8.0], side, &heads, &theme);
    scene.write(
        "expressions in edge lengths",
        [8.0, 2.0 * row + 16.0],
        Anchor::Start,
        &theme,
    );
    scene.place(map, [0.0, 2.0 * row + 26.0]);
    scene
}
