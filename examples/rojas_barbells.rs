//! Figures 7 and 8 of Rojas et al. 2014: shapes that differ in parts. Barbells with two kinds of ends on
//! two lengths of bar, and two bones whose shafts differ while their ends are the same, measured by
//! distances in edge lengths (size taken off, equation 12) and by aligned root mean square distances.

mod support;

use std::f64::consts::TAU;
use std::process::ExitCode;
use std::sync::Arc;

use meshloom::diag::Result;
use meshloom::image::Image;
use meshloom::mesh::rigid_align::rigid;
use meshloom::mesh::{Edges, FrameSource, Sequence, Topology};
use meshloom::plot::{Anchor, Scene, Theme};
use meshloom::statistics::{EDGE_LENGTHS, Ground, aligned, aligned_rms, scale_free};
use nalgebra::Point3;

use support::{Figure, View, table};

/// Rings along a shape and vertices around each; a third of the rings for each end.
const RINGS: usize = 61;
const AROUND: usize = 24;
const THIRD: usize = RINGS / 3;

/// Side of a small picture, in units of the scene.
const SIDE: f32 = 200.0;

fn main() -> ExitCode {
    support::run_with("rojas_barbells", &[], draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let bells = shapes(&[
        (5.0, End::Ball),
        (1.6, End::Ball),
        (5.0, End::Disc),
        (1.6, End::Disc),
    ]);
    let bones = shapes(&[(4.6, End::Condyles), (3.0, End::Condyles)]);
    let measures = Measures::new(&bells)?;
    barbells(figure, &measures);
    femurs(figure, &bones)?;
    let told = ["long, balls", "short, balls", "long, discs", "short, discs"];
    let theme = Theme::light();
    let mut scene = Scene::new(4.0 * SIDE, 2.0 * (SIDE + 40.0), theme.background);
    let rows = [
        ("Fig. 7: barbells", &bells, &told[..]),
        (
            "Fig. 8: bones with the same ends",
            &bones,
            &["long", "short"][..],
        ),
    ];
    for (line, (title, shapes, names)) in rows.into_iter().enumerate() {
        let top = line as f32 * (SIDE + 40.0);
        scene.write(title, [8.0, top + 14.0], Anchor::Start, &theme);
        let view = View::looking(shapes, [0.0, 0.2]);
        let pictures: Vec<(String, Arc<Image>)> = names
            .iter()
            .enumerate()
            .map(|(i, name)| {
                let picture = view.picture(shapes.frame(i), 2 * SIDE as usize, [196, 188, 150]);
                (name.to_string(), picture)
            })
            .collect();
        support::row(&mut scene, [0.0, top + 14.0], SIDE, &pictures, &theme);
    }
    figure.picture(&scene)
}

/// What a shape ends in.
#[derive(Clone, Copy, PartialEq)]
enum End {
    Ball,
    Disc,
    /// Two knobs side by side, like a femur's.
    Condyles,
}

/// Tubes that share their faces, with bars of these lengths.
fn shapes(kinds: &[(f64, End)]) -> Sequence {
    let at = |i: usize, j: usize| (i * AROUND + j % AROUND) as u32;
    let mut triangles = Vec::new();
    for i in 1..RINGS {
        for j in 0..AROUND {
            let [a, b, c, d] = [at(i - 1, j), at(i, j), at(i, j + 1), at(i - 1, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let topology = Topology::from_triangles(RINGS * AROUND, &triangles).expect("a tube");
    let positions = kinds.iter().flat_map(|&(bar, end)| shape(bar, end));
    Sequence::new(Arc::new(topology), positions.collect(), None)
}

fn shape(bar: f64, end: End) -> Vec<f32> {
    let (long, wide) = if end == End::Disc {
        (0.35, 1.3)
    } else {
        (1.0, 1.0)
    };
    let ring = |i: usize| {
        let from_end = i.min(RINGS - 1 - i);
        let side = if i < RINGS / 2 { -1.0 } else { 1.0 };
        if from_end < THIRD {
            // the ball from its tip to where the bar meets it
            let angle = 0.03 + 2.85 * from_end as f64 / (THIRD - 1) as f64;
            let x = side * (0.5 * bar + long + long * angle.cos());
            (x, (wide * angle.sin()).max(0.25), angle.sin())
        } else {
            let along = (i - THIRD + 1) as f64 / (RINGS - 2 * THIRD + 1) as f64;
            (bar * (along - 0.5), 0.25, 0.0)
        }
    };
    let point = |(x, radius, bulge): (f64, f64, f64), j: usize| {
        let angle = TAU * j as f64 / AROUND as f64;
        let knobs = match end {
            End::Condyles => 1.0 + 0.35 * bulge * (2.0 * angle).cos(),
            _ => 1.0,
        };
        let radius = radius * knobs;
        [x, radius * angle.cos(), radius * angle.sin()].map(|x| x as f32)
    };
    (0..RINGS)
        .flat_map(|i| (0..AROUND).flat_map(move |j| point(ring(i), j)))
        .collect()
}

/// Both distances between shapes, size taken off each as it is for that distance.
struct Measures {
    /// Of each shape its lengths, which sum to the mean of all sums (equation 12 up to that factor).
    lengths: Vec<Vec<f64>>,
    /// Of each shape positions of unit size, as Procrustes analysis has them.
    unit: Vec<Vec<f64>>,
}

impl Measures {
    fn new(shapes: &Sequence) -> Result<Self> {
        let poses: Vec<Vec<f64>> = (0..shapes.frames())
            .map(|i| shapes.frame(i).iter().map(|&x| f64::from(x)).collect())
            .collect();
        let edges = Edges::new(shapes.topology());
        let free = aligned(&scale_free(&poses, edges.ends()));
        let ground = Ground::open(EDGE_LENGTHS, shapes.topology(), &free)?;
        let unit = |pose: &Vec<f64>| -> Vec<f64> {
            let size = pose.iter().map(|x| x * x).sum::<f64>().sqrt();
            pose.iter().map(|x| x / size).collect()
        };
        Ok(Measures {
            lengths: free.iter().map(|pose| ground.encode(pose)).collect(),
            unit: poses.iter().map(unit).collect(),
        })
    }

    fn by_lengths(&self, a: usize, b: usize) -> f64 {
        let pairs = self.lengths[a].iter().zip(&self.lengths[b]);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
    }

    fn by_rms(&self, a: usize, b: usize) -> f64 {
        aligned_rms(&self.unit[a], &self.unit[b])
    }
}

/// Shapes 0 to 3: long and short with balls, long and short with discs. R14 finds by aligned distances that
/// "the two long barbells are clearly more similar than the two short ones", and by edge lengths that "the
/// distances become more comparable"; the caption has size dominate the former, the ends the latter.
fn barbells(figure: &mut Figure, measures: &Measures) {
    type Distance<'a> = &'a dyn Fn(usize, usize) -> f64;
    let rms: Distance = &|a, b| measures.by_rms(a, b);
    let lengths: Distance = &|a, b| measures.by_lengths(a, b);
    // relative to the mean of the six pairs, as the two have no common unit
    let row = |name: &str, distance: Distance| {
        let pairs = [(0, 2), (1, 3), (0, 1), (2, 3), (0, 3), (1, 2)];
        let each = pairs.map(|(a, b)| distance(a, b));
        let mean = each.iter().sum::<f64>() / 6.0;
        let cells = each.map(|d| format!("{:.2}", d / mean));
        [vec![name.to_string()], cells.to_vec()].concat()
    };
    println!("barbells, distances over the mean of the six pairs (R14, Fig. 7)");
    let heads = [
        "distance",
        "ends, long",
        "ends, short",
        "bar, balls",
        "bar, discs",
        "both",
        "both",
    ];
    table(
        &heads,
        &[row("aligned RMS", rms), row("edge lengths", lengths)],
    );
    let ratio = |distance: Distance| distance(1, 3) / distance(0, 2);
    println!(
        "the ends of short ones differ {:.2} times as much as those of long ones by aligned RMS, {:.2} times by edge lengths",
        ratio(rms),
        ratio(lengths)
    );
    figure.goal(
        "Fig. 7: by aligned RMS the long ones are the more similar pair",
        ratio(rms) > 1.0,
    );
    figure.goal(
        "Fig. 7: by edge lengths the two distances are more comparable",
        ratio(lengths).ln().abs() < ratio(rms).ln().abs(),
    );
    // how much a change of the bar counts beside a change of the ends: not a figure of the paper
    let size =
        |distance: Distance| (distance(0, 1) + distance(2, 3)) / (distance(0, 2) + distance(1, 3));
    println!(
        "a change of the bar over a change of the ends: {:.2} by aligned RMS, {:.2} by edge lengths",
        size(rms),
        size(lengths)
    );
}

/// Two bones with the same ends: what of the distance lies in the ends. Scaled to the same sum of lengths
/// the ends differ in size; per unit of the bone's own size they are the same, so here lengths are
/// compared as they are, and positions are aligned with and without scale.
fn femurs(figure: &mut Figure, bones: &Sequence) -> Result<()> {
    let poses: Vec<Vec<f64>> = (0..2)
        .map(|i| bones.frame(i).iter().map(|&x| f64::from(x)).collect())
        .collect();
    let ground = Ground::open(EDGE_LENGTHS, bones.topology(), &poses)?;
    let edges = Edges::new(bones.topology());
    let codes: Vec<Vec<f64>> = poses.iter().map(|pose| ground.encode(pose)).collect();
    // vertices of the ends alone
    let in_end = |vertex: usize| {
        let ring = vertex / AROUND;
        ring.min(RINGS - 1 - ring) < THIRD
    };
    let mut lengths = [0.0; 2];
    for (edge, ends) in edges.ends().iter().enumerate() {
        let difference = codes[0][edge] - codes[1][edge];
        let part = usize::from(!ends.iter().all(|&v| in_end(v as usize)));
        lengths[part] += difference * difference;
    }
    let motion = rigid(&poses[1], &poses[0]);
    let mut rms = [0.0; 2];
    let pairs = poses[0].chunks_exact(3).zip(poses[1].chunks_exact(3));
    for (vertex, (p, q)) in pairs.enumerate() {
        let apart = Point3::from_slice(p) - motion * Point3::from_slice(q);
        rms[usize::from(!in_end(vertex))] += apart.norm_squared();
    }
    let share = |[ends, shaft]: [f64; 2]| ends / (ends + shaft);
    println!(
        "bones with the same ends, the share of the ends in the squared distance (R14, Fig. 8)"
    );
    table(
        &["distance", "ends"],
        &[
            vec!["aligned RMS".into(), support::percent(share(rms))],
            vec!["edge lengths".into(), support::percent(share(lengths))],
        ],
    );
    figure.goal(
        "Fig. 8: aligned RMS sees most of the difference in ends that are the same",
        share(rms) > 0.5,
    );
    figure.goal("Fig. 8: edge lengths see none there", share(lengths) < 1e-6);
    Ok(())
}
