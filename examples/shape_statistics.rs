//! Statistics of shapes (Rojas et al. 2014, §4): expressions brought from one face to another, and a map
//! of expressions by principal components, in edge lengths and in shape spaces. With a capture, its
//! frames are the expressions, the first the neutral one. The paper's own figures are `rojas_barbells`
//! (7, 8) and `rojas_faces` (9, 10).

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::{Diagnostic, Result};
use meshloom::mesh::{Bounds, FrameSource, Sequence};
use meshloom::pipeline::{StatisticsRequest, add_difference, statistics};
use meshloom::plot::{Anchor, Scene, Theme};
use meshloom::statistics::{EDGE_LENGTHS, aligned_rms};
use meshloom::task::Task;

use support::{Figure, View, table};

fn main() -> ExitCode {
    support::run("shape_statistics", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let (faces, view) = figure.capture("face")?;
    if faces.frames() < 3 {
        return Diagnostic::error("expressions are three frames or more").err();
    }
    let transferred = transfer(figure, &faces)?;
    let map = expressions(figure, &faces)?;
    figure.picture(&compose(&transferred, &view, map))
}

// --- expression transfer

fn doubles(row: &[f32]) -> Vec<f64> {
    row.iter().map(|&x| f64::from(x)).collect()
}

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

fn compose(faces: &Transferred, view: &View, map: Scene) -> Scene {
    let theme = Theme::light();
    let side = 0.5 * SIDE as f32;
    let row = side + 34.0;
    let mut scene = Scene::new(map.width, row + 26.0 + map.height, theme.background);
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
    scene.write("expression transfer", [8.0, 16.0], Anchor::Start, &theme);
    support::row(&mut scene, [0.0, 8.0], side, &heads, &theme);
    scene.write(
        "expressions in edge lengths",
        [8.0, row + 16.0],
        Anchor::Start,
        &theme,
    );
    scene.place(map, [0.0, row + 26.0]);
    scene
}
