//! Figures 1, 3, 4 and 5 of Rojas et al. 2014: two embeddings with the same lengths; an arm that straightens
//! in four steps and keeps its flexed muscle on the way; four poses blended bilinearly around a circle;
//! three poses blended along a spline. And what happens to a torus that becomes a barrel (§6): squares of
//! lengths do better there.

mod support;

use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::{Diagnostic, Result};
use meshloom::inbetween::edge_lengths::{
    Blend, EdgeFit, Embedding, KeyShapes, Memory, Morph, Options, morph,
};
use meshloom::mesh::{Sequence, Topology};
use meshloom::pipeline::{self, MorphMethod, MorphPath, MorphRequest};
use meshloom::plot::{Anchor, Scene, Theme};
use meshloom::space::SpaceError;
use meshloom::task::Task;

use support::{Figure, View, rojas, row, table};

/// Width of one shape, in pixels.
const SIDE: f32 = 150.0;

/// Colours of given and of found shapes.
const GIVEN: [u8; 3] = [120, 150, 210];
const FOUND: [u8; 3] = [190, 190, 190];

fn main() -> ExitCode {
    support::run("rojas_poses", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let theme = Theme::light();
    let mut scene = Scene::new(6.0 * SIDE, 7.0 * (SIDE + 34.0), theme.background);
    let mut lines = Vec::new();
    one(figure, &mut scene, &theme)?;
    three(figure, &mut scene, &theme, &mut lines)?;
    paths(figure, &mut scene, &theme, &mut lines)?;
    barrel(figure, &mut scene, &theme, &mut lines)?;
    table(
        &["", "frames", "RMS ratio", "worst edge", "within 1 %"],
        &lines,
    );
    figure.picture(&scene)
}

fn title(scene: &mut Scene, line: usize, text: &str, theme: &Theme) -> [f32; 2] {
    let top = line as f32 * (SIDE + 34.0);
    scene.write(text, [4.0, top + 12.0], Anchor::Start, theme);
    [0.0, top + 14.0]
}

fn view(topology: &Arc<Topology>, poses: &[&[f64]], direction: [f64; 2]) -> View {
    let positions = poses.concat().iter().map(|&x| x as f32).collect();
    View::looking(
        &Sequence::new(Arc::clone(topology), positions, None),
        direction,
    )
}

fn shown(
    view: &View,
    name: &str,
    pose: &[f64],
    colour: [u8; 3],
) -> (String, Arc<meshloom::image::Image>) {
    let positions: Vec<f32> = pose.iter().map(|&x| x as f32).collect();
    (
        name.to_string(),
        view.picture(&positions, 2 * SIDE as usize, colour),
    )
}

/// Figure 1: the icosahedron and its dented twin.
fn one(figure: &mut Figure, scene: &mut Scene, theme: &Theme) -> Result<()> {
    let (topology, poses) = rojas::icosahedra();
    let embedding = Embedding::new(&topology).map_err(SpaceError::from)?;
    let lengths = poses.each_ref().map(|pose| embedding.lengths(pose));
    let off = lengths[0]
        .iter()
        .zip(&lengths[1])
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    let mut found = Vec::new();
    for pose in &poses {
        let keys = KeyShapes::new(&embedding, &[pose]);
        let target = keys.blend(&[1.0], Blend::Lengths);
        let embedded = embedding.embed(&target, &mut Memory::default());
        found.push(embedded.map_err(|error| Box::new(Diagnostic::error(error.to_string())))?);
    }
    let apart = found[0].positions[0..3]
        .iter()
        .zip(&found[1].positions[0..3])
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt();
    figure.goal(
        "Fig. 1: two shapes with the same 30 lengths to 1e-12",
        off < 1e-12,
    );
    figure.goal(
        "Fig. 1: each is embedded from its own dihedral angles",
        apart > 1.0,
    );
    let at = title(scene, 0, "Fig. 1: the same edge lengths twice", theme);
    let view = view(&topology, &[&poses[0], &poses[1]], [0.3, 0.7]);
    let pictures = [
        shown(&view, "convex", &found[0].positions, FOUND),
        shown(&view, "dented", &found[1].positions, FOUND),
    ];
    row(scene, at, SIDE, &pictures, theme);
    Ok(())
}

/// What a sequence of embeddings measured.
fn line(name: &str, found: &Morph) -> Vec<String> {
    let fits = || found.reports.iter().flatten().map(|report| &report.edges);
    let most = |value: &dyn Fn(&EdgeFit) -> f64| fits().map(value).fold(0.0, f64::max);
    let within = fits().map(|fit| fit.within).fold(1.0, f64::min);
    vec![
        name.to_string(),
        found.frames.len().to_string(),
        format!("{:.4} %", most(&|fit| fit.rms_percent)),
        format!("{:.3} %", most(&EdgeFit::max_percent)),
        format!("{:.2} %", 100.0 * within),
    ]
}

fn embedded(
    topology: &Arc<Topology>,
    poses: &[&[f64]],
    weights: &[Vec<f64>],
    blend: Blend,
) -> Result<Morph> {
    let embedding = Embedding::new(topology).map_err(SpaceError::from)?;
    let keys = KeyShapes::new(&embedding, poses);
    let options = Options { blend, every: 1 };
    morph(
        &embedding,
        topology,
        &keys,
        weights,
        options,
        &Task::default(),
    )
    .map_err(|error| Box::new(Diagnostic::error(format!("{error:?}"))))
}

/// Figure 3: the arm between two edited poses, four steps.
fn three(
    figure: &mut Figure,
    scene: &mut Scene,
    theme: &Theme,
    lines: &mut Vec<Vec<String>>,
) -> Result<()> {
    let (topology, straight) = rojas::arm(0.0, 0.0, 0.0);
    let (_, bent) = rojas::arm(1.7, 0.6, 0.4);
    let weights: Vec<Vec<f64>> = (0..6)
        .map(|i| f64::from(i) / 5.0)
        .map(|t| vec![1.0 - t, t])
        .collect();
    let found = embedded(&topology, &[&straight, &bent], &weights, Blend::Lengths)?;
    lines.push(line("Fig. 3: arm", &found));
    let met = found
        .reports
        .iter()
        .flatten()
        .all(|r| r.edges.max_percent() < 1.0);
    figure.goal(
        "Fig. 3: every edge of the arm within 1 % in every step",
        met,
    );
    let at = title(
        scene,
        1,
        "Fig. 3: between two edited poses of an arm",
        theme,
    );
    let view = view(&topology, &[&straight, &bent], [0.0, 0.15]);
    let colour = |i| if i == 0 || i == 5 { GIVEN } else { FOUND };
    let pictures: Vec<_> = found
        .frames
        .iter()
        .enumerate()
        .map(|(i, frame)| shown(&view, &format!("{:.1}", i as f64 / 5.0), frame, colour(i)))
        .collect();
    row(scene, at, SIDE, &pictures, theme);
    Ok(())
}

/// Figures 4 and 5 through the command's own paths.
fn paths(
    figure: &mut Figure,
    scene: &mut Scene,
    theme: &Theme,
    lines: &mut Vec<Vec<String>>,
) -> Result<()> {
    let (topology, _) = rojas::arm(0.0, 0.0, 0.0);
    let poses = [
        rojas::arm(0.0, 0.0, 0.0).1,
        rojas::arm(1.7, 0.0, 0.0).1,
        rojas::arm(0.2, 0.6, 0.4).1,
        rojas::arm(1.7, 0.6, 0.4).1,
    ];
    let view = view(&topology, &poses.each_ref().map(Vec::as_slice), [0.0, 0.15]);
    let given: Vec<_> = poses
        .iter()
        .map(|pose| shown(&view, "pose", pose, GIVEN))
        .collect();
    for (at, name, count, path) in [
        (
            2,
            "Fig. 4: four poses, bilinear around a circle",
            4,
            "circle",
        ),
        (
            4,
            "Fig. 5: three poses, barycentric along a spline",
            3,
            "1,0,0 0.2,0.6,0.2 0,1,0 0.2,0.2,0.6 0,0,1",
        ),
    ] {
        let positions = poses[..count].concat().iter().map(|&x| x as f32).collect();
        let sequence = Sequence::new(Arc::clone(&topology), positions, None);
        let told = |error: String| Box::new(Diagnostic::error(error));
        let request = MorphRequest {
            method: MorphMethod::EdgeLengths,
            frames: Some(13),
            path: Some(path.parse::<MorphPath>().map_err(told)?),
            ..MorphRequest::default()
        };
        let found = pipeline::morph(&sequence, &request, &Task::default())?.output;
        let edges = found.report.edges;
        lines.push(vec![
            name[..6].to_string(),
            "13".into(),
            format!("{:.4} %", edges.rms_percent),
            format!("{:.3} %", edges.worst_percent),
            found
                .report
                .embedding
                .map_or(String::new(), |e| format!("{:.2} %", e.within_percent)),
        ]);
        figure.goal(
            &format!("{}: every edge within 1 % of its weighted mean", &name[..6]),
            edges.worst_percent < 1.0,
        );
        let place = title(scene, at, name, theme);
        row(scene, place, SIDE, &given[..count], theme);
        let place = title(scene, at + 1, "", theme);
        let pictures: Vec<_> = (0..6)
            .map(|i| {
                let frame: Vec<f64> = found
                    .frames
                    .frame(2 * i)
                    .iter()
                    .map(|&x| f64::from(x))
                    .collect();
                shown(&view, &format!("frame {}", 2 * i + 1), &frame, FOUND)
            })
            .collect();
        row(scene, place, SIDE, &pictures, theme);
    }
    Ok(())
}

/// Section 6: a torus stretched to a barrel. Diagonals do not scale with the sides of a quad.
fn barrel(
    figure: &mut Figure,
    scene: &mut Scene,
    theme: &Theme,
    lines: &mut Vec<Vec<String>>,
) -> Result<()> {
    let (topology, ring) = rojas::barrel(1.0);
    let (_, tall) = rojas::barrel(5.0);
    let weights: Vec<Vec<f64>> = (0..5)
        .map(|i| f64::from(i) / 4.0)
        .map(|t| vec![1.0 - t, t])
        .collect();
    let mut unevenness = Vec::new();
    let view = view(&topology, &[&ring, &tall], [0.4, 0.35]);
    let mut pictures = vec![shown(&view, "torus", &ring, GIVEN)];
    for (name, blend) in [("lengths", Blend::Lengths), ("squares", Blend::Squares)] {
        let found = embedded(&topology, &[&ring, &tall], &weights, blend)?;
        lines.push(line(&format!("torus to barrel, {name}"), &found));
        let worst = found.frames[1..4]
            .iter()
            .map(|frame| uneven(frame))
            .fold(0.0, f64::max);
        println!(
            "torus to barrel by {name}: the section differs by {:.2} % around the ring",
            100.0 * worst
        );
        unevenness.push(worst);
        pictures.push(shown(&view, name, &found.frames[2], FOUND));
    }
    pictures.push(shown(&view, "barrel", &tall, GIVEN));
    figure.goal(
        "barrel: by squares the surface is even, by lengths it is not (R14 section 6)",
        unevenness[1] < 1e-3 && unevenness[0] > 5.0 * unevenness[1],
    );
    let at = title(
        scene,
        6,
        "Section 6: half way from a torus to a barrel",
        theme,
    );
    row(scene, at, SIDE, &pictures, theme);
    Ok(())
}

/// How much vertices with the same place in the section differ in height around the ring: the standard
/// deviation over the mean height, both poses being surfaces of revolution about y.
fn uneven(frame: &[f64]) -> f64 {
    let (n, m) = (60, 24);
    let axis = axis_heights(frame);
    let mut worst: f64 = 0.0;
    let size = axis.iter().map(|h| h.abs()).fold(0.0, f64::max);
    for j in 0..m {
        let heights: Vec<f64> = (0..n).map(|i| axis[i * m + j]).collect();
        let mean = heights.iter().sum::<f64>() / n as f64;
        let square = heights.iter().map(|h| (h - mean) * (h - mean)).sum::<f64>() / n as f64;
        worst = worst.max(square.sqrt() / size);
    }
    worst
}

/// Heights over the middle: frames are laid on the poses, whose axis is y.
fn axis_heights(frame: &[f64]) -> Vec<f64> {
    let mean = frame.iter().skip(1).step_by(3).sum::<f64>() / (frame.len() / 3) as f64;
    frame.iter().skip(1).step_by(3).map(|y| y - mean).collect()
}
