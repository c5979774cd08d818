//! Isometric morphs (Wuhrer et al., "Isometric morphing of triangular meshes"): theorem 1 on polygons and
//! theorem 2 on skeletons in numbers (lengths linear, isometric poses isometric between, time in
//! proportion to size), and the general method on meshes beside the spaces gradients and vertices. The
//! picture shows a polygon, a mesh and a skeleton on their way.

mod support;

use std::process::ExitCode;
use std::sync::Arc;
use std::time::Instant;

use meshloom::diag::Result;
use meshloom::inbetween::isometric::{Alignment, Connectivity, Isometric};
use meshloom::inbetween::skeleton::SkeletonMorph;
use meshloom::mesh::{Edges, FrameSource, Joint, Sequence, Skeleton, Topology, rigid_align};
use meshloom::plot::{Anchor, Path, Point, Scene, Stroke, Theme};
use meshloom::space::{SpaceError, Spaces};

use support::{Figure, View, table};

/// Steps of a morph in the picture.
const SHOWN: usize = 6;

/// Most pairs of poses that are measured.
const PAIRS: usize = 45;

fn main() -> ExitCode {
    support::run("isometric_morphs", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    polygons(figure)?;
    skeletons(figure);
    let (poses, view) = figure.capture("cactus")?;
    meshes(figure, &poses)?;
    figure.picture(&compose(&poses, &view)?)
}

// --- theorem 1: polygons

/// A ribbon of `n` triangles: its course bends by `bend` over all, its cross bars turn by `twist`.
fn ribbon(n: usize, bend: f64, twist: f64, size: f64) -> Vec<f64> {
    let mut positions = Vec::with_capacity(3 * (n + 2));
    let (mut x, mut y) = (0.0, 0.0);
    for i in 0..n + 2 {
        let along = (i / 2) as f64 / (n / 2) as f64;
        let (sine, cosine) = (bend * (along - 0.5)).sin_cos();
        let (lift, flat) = (twist * along).sin_cos();
        let side = if i % 2 == 0 { -0.5 } else { 0.5 } * size;
        positions.extend([
            x - side * sine * flat,
            y + side * cosine * flat,
            side * lift,
        ]);
        if i % 2 == 1 {
            (x, y) = (x + size * cosine, y + size * sine);
        }
    }
    positions
}

fn strip(n: usize) -> Topology {
    let triangles: Vec<[u32; 3]> = (0..n as u32)
        .map(|i| {
            if i % 2 == 0 {
                [i, i + 2, i + 1]
            } else {
                [i, i + 1, i + 2]
            }
        })
        .collect();
    Topology::from_triangles(n + 2, &triangles).expect("a strip")
}

fn lengths(edges: &[[u32; 2]], positions: &[f64]) -> Vec<f64> {
    let length = |&[a, b]: &[u32; 2]| {
        let (a, b) = (3 * a as usize, 3 * b as usize);
        let squares = (0..3).map(|k| (positions[a + k] - positions[b + k]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    edges.iter().map(length).collect()
}

/// The largest miss of a length half way, over the size of the whole: what doubles can hold.
fn miss(edges: &[[u32; 2]], poses: [&[f64]; 2], middle: &[f64], t: f64) -> f64 {
    let [from, to] = poses.map(|pose| lengths(edges, pose));
    let found = lengths(edges, middle);
    let ends = from.iter().zip(&to).map(|(a, b)| a * (1.0 - t) + b * t);
    let worst = ends
        .zip(found)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    let size = middle.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    worst / size.max(1.0)
}

fn polygons(figure: &mut Figure) -> Result<()> {
    let mut rows = Vec::new();
    let (mut worst, mut speeds) = (0.0_f64, Vec::new());
    for n in [1_000, 10_000, 100_000, 1_000_000] {
        let topology = strip(n);
        let from = ribbon(n, 3.0, 0.0, 1.0);
        let isometric = ribbon(n, 9.0, 0.0, 1.0);
        let other = ribbon(n, 6.0, 2.0, 1.3);
        let connectivity = Connectivity::new(&topology, &from).map_err(SpaceError::from)?;
        let edges = Edges::new(&topology);
        let mut cells = vec![n.to_string()];
        let mut middle = vec![0.0; from.len()];
        for to in [&isometric, &other] {
            let morph = Isometric::new(&connectivity, &from, to, Alignment::Rigid);
            let morph = morph.map_err(SpaceError::from)?;
            let begin = Instant::now();
            morph.at(0.3, &mut middle);
            let seconds = begin.elapsed().as_secs_f64();
            let found = miss(edges.ends(), [&from, to], &middle, 0.3);
            worst = worst.max(found);
            cells.push(format!("{found:.1e}"));
            if to == &other {
                cells.push(format!("{:.2} ms", 1e3 * seconds));
                cells.push(format!("{:.0} ns", 1e9 * seconds / n as f64));
                speeds.push(seconds / n as f64);
            }
        }
        rows.push(cells);
    }
    println!("theorem 1, polygons (lengths that are missed, over the size of the whole)");
    table(
        &[
            "triangles",
            "isometric poses",
            "other poses",
            "a frame",
            "a triangle",
        ],
        &rows,
    );
    figure.goal("lengths are linear to 1e-12", worst < 1e-12);
    let [first, last] = [speeds[0], speeds[speeds.len() - 1]];
    // from caches to memory a triangle may take a few times as long; n^2 would be a thousand times
    figure.goal(
        "a triangle takes as long among 10^6 as among 10^3, within 8 times",
        last < 8.0 * first,
    );
    Ok(())
}

// --- theorem 2: skeletons

/// Two poses of a tree of `n` joints.
fn tree(n: usize, stretch: f64) -> (Skeleton, [Vec<f64>; 2]) {
    let parent = |joint: usize| joint - 1 - joint * 7 % 5.min(joint);
    let joints = (0..n).map(|joint| Joint {
        name: String::new(),
        parent: (joint > 0).then(|| parent(joint) as u32),
    });
    let skeleton = Skeleton::new(joints.collect()).expect("a tree");
    let pose = |phase: f64, size: f64| {
        let mut positions = vec![0.0; 3 * n];
        for joint in 1..n {
            let x = joint as f64;
            let bone = [(0.3 * x + phase).sin(), (0.17 * x - 2.0 * phase).cos(), 0.4];
            let norm = bone.iter().map(|b| b * b).sum::<f64>().sqrt();
            let long = size * (1.0 + 0.5 * x.sin()) / norm;
            for axis in 0..3 {
                positions[3 * joint + axis] =
                    positions[3 * parent(joint) + axis] + long * bone[axis];
            }
        }
        positions
    };
    (skeleton, [pose(0.0, 1.0), pose(0.9, stretch)])
}

fn skeletons(figure: &mut Figure) {
    let (mut rows, mut worst) = (Vec::new(), 0.0_f64);
    for n in [1_000, 10_000, 100_000, 1_000_000] {
        let mut cells = vec![n.to_string()];
        for stretch in [1.0, 1.4] {
            let (skeleton, [from, to]) = tree(n, stretch);
            let morph = SkeletonMorph::new(&skeleton, &from, &to, Alignment::Rigid);
            let mut middle = vec![0.0; from.len()];
            let begin = Instant::now();
            morph.at(0.3, &mut middle);
            let seconds = begin.elapsed().as_secs_f64();
            let found = miss(&skeleton.bones(), [&from, &to], &middle, 0.3);
            worst = worst.max(found);
            cells.push(format!("{found:.1e}"));
            if stretch > 1.0 {
                cells.push(format!("{:.2} ms", 1e3 * seconds));
                cells.push(format!("{:.0} ns", 1e9 * seconds / n as f64));
            }
        }
        rows.push(cells);
    }
    println!("theorem 2, skeletons");
    table(
        &[
            "joints",
            "isometric poses",
            "other poses",
            "a frame",
            "a joint",
        ],
        &rows,
    );
    figure.goal("lengths of bones are linear to 1e-12", worst < 1e-12);
}

// --- meshes

/// Mean and largest error of an edge in percent of its own length.
fn errors(edges: &[[u32; 2]], poses: [&[f64]; 2], middle: &[f64], t: f64) -> [f64; 2] {
    let [from, to] = poses.map(|pose| lengths(edges, pose));
    let found = lengths(edges, middle);
    let wanted = from.iter().zip(&to).map(|(a, b)| a * (1.0 - t) + b * t);
    let ratios: Vec<f64> = wanted
        .zip(found)
        .filter(|(wanted, _)| *wanted > 0.0)
        .map(|(wanted, found)| 100.0 * (found / wanted - 1.0).abs())
        .collect();
    [
        ratios.iter().sum::<f64>() / ratios.len().max(1) as f64,
        ratios.iter().copied().fold(0.0, f64::max),
    ]
}

fn doubles(poses: &Sequence, pose: usize) -> Vec<f64> {
    poses.frame(pose).iter().map(|&x| f64::from(x)).collect()
}

/// The second pose moved rigidly nearest the first.
fn aligned(from: &[f64], to: &[f64]) -> Vec<f64> {
    let motion = rigid_align::rigid(to, from);
    let (points, _) = to.as_chunks::<3>();
    let moved = points.iter().map(|&p| motion * nalgebra::Point3::from(p));
    moved.flat_map(|p| [p.x, p.y, p.z]).collect()
}

fn meshes(figure: &mut Figure, poses: &Sequence) -> Result<()> {
    let topology = poses.topology();
    let edges = Edges::new(topology);
    let n = poses.frames();
    let pairs: Vec<[usize; 2]> = (0..n)
        .flat_map(|a| (a + 1..n).map(move |b| [a, b]))
        .take(PAIRS)
        .collect();
    let connectivity = Connectivity::new(topology, &doubles(poses, 0)).map_err(SpaceError::from)?;
    let spaces = Spaces::new(Arc::clone(topology), &doubles(poses, 0));
    let (mut rows, mut better, mut worst) = (Vec::new(), true, 0.0_f64);
    for [a, b] in pairs {
        let from = doubles(poses, a);
        let to = aligned(&from, &doubles(poses, b));
        let morph = Isometric::new(&connectivity, &from, &to, Alignment::Rigid);
        let morph = morph.map_err(SpaceError::from)?;
        let about = spaces.about(&from);
        let space = about.open("gradients", &[])?;
        let mut codes = [vec![0.0; space.dimension()], vec![0.0; space.dimension()]];
        space.encode(&from, &mut codes[0]);
        space.encode(&to, &mut codes[1]);
        let mut found = [[0.0_f64; 2]; 3];
        for t in [0.25, 0.5, 0.75] {
            let mut shape = vec![0.0; from.len()];
            morph.at(t, &mut shape);
            join(&mut found[0], errors(edges.ends(), [&from, &to], &shape, t));
            let blend = |a: &[f64], b: &[f64]| -> Vec<f64> {
                a.iter()
                    .zip(b)
                    .map(|(a, b)| a * (1.0 - t) + b * t)
                    .collect()
            };
            space.decode(&blend(&codes[0], &codes[1]), &mut shape);
            join(&mut found[1], errors(edges.ends(), [&from, &to], &shape, t));
            join(
                &mut found[2],
                errors(edges.ends(), [&from, &to], &blend(&from, &to), t),
            );
        }
        better &= found[0][0] <= found[1][0];
        worst = worst.max(found[0][1]);
        let mut cells = vec![format!("{} - {}", a + 1, b + 1)];
        for [mean, most] in found {
            cells.extend([format!("{mean:.3}"), format!("{most:.1}")]);
        }
        rows.push(cells);
    }
    println!(
        "meshes: edges at a quarter, half and three quarters of the way, mean and worst error in %"
    );
    table(
        &[
            "poses",
            "isometric",
            "worst",
            "gradients",
            "worst",
            "vertices",
            "worst",
        ],
        &rows,
    );
    figure.goal(
        "the mean error is below that of gradients for every pair",
        better,
    );
    figure.goal(
        &format!("the worst edge ({worst:.1} %) is below 50 %"),
        worst < 50.0,
    );
    Ok(())
}

/// Of both moments the mean's mean over three, and the larger worst.
fn join(all: &mut [f64; 2], one: [f64; 2]) {
    *all = [all[0] + one[0] / 3.0, all[1].max(one[1])];
}

// --- the picture

/// Side of a small picture in pixels of the file, twice that of the scene.
const SIDE: usize = 360;
const COLOURS: [[u8; 3]; 2] = [[150, 170, 200], [196, 188, 150]];

fn compose(poses: &Sequence, view: &View) -> Result<Scene> {
    let theme = Theme::light();
    let side = 0.5 * SIDE as f32;
    let mut scene = Scene::new(SHOWN as f32 * side, 3.0 * (side + 34.0), theme.background);
    let (topology, ends) = (
        strip(60),
        [ribbon(60, 0.6, 0.0, 1.0), ribbon(60, 5.5, 1.5, 1.0)],
    );
    let ribbon = morphed(&topology, &ends)?;
    let strip_view = View::looking(&ribbon, [0.2, 0.9]);
    let last = poses.frames() - 1;
    let ends = [doubles(poses, 0), doubles(poses, last)];
    let mesh = morphed(poses.topology(), &ends)?;
    for (row, (sequence, view, name)) in [
        (
            &ribbon,
            &strip_view,
            "a polygon of 60 triangles: every length exact",
        ),
        (&mesh, view, "a mesh: the first pose to the last"),
    ]
    .into_iter()
    .enumerate()
    {
        let top = row as f32 * (side + 34.0);
        scene.write(name, [8.0, top + 16.0], Anchor::Start, &theme);
        let shown = (0..SHOWN).map(|frame| {
            let t = format!("{:.1}", frame as f64 / (SHOWN - 1) as f64);
            (t, view.picture(sequence.frame(frame), SIDE, COLOURS[row]))
        });
        let shown: Vec<_> = shown.collect();
        support::row(&mut scene, [0.0, top + 8.0], side, &shown, &theme);
    }
    let top = 2.0 * (side + 34.0);
    scene.write(
        "a skeleton of 16 joints",
        [8.0, top + 16.0],
        Anchor::Start,
        &theme,
    );
    for frame in 0..SHOWN {
        let t = frame as f64 / (SHOWN - 1) as f64;
        figure_of_bones(
            &mut scene,
            [frame as f32 * side, top + 8.0],
            side,
            t,
            &theme,
        );
    }
    Ok(scene)
}

/// [`SHOWN`] steps between two poses.
fn morphed(topology: &Topology, [from, to]: &[Vec<f64>; 2]) -> Result<Sequence> {
    let connectivity = Connectivity::new(topology, from).map_err(SpaceError::from)?;
    let morph = Isometric::new(&connectivity, from, to, Alignment::Rigid);
    let morph = morph.map_err(SpaceError::from)?;
    let mut positions = Vec::new();
    let mut shape = vec![0.0; from.len()];
    for frame in 0..SHOWN {
        morph.at(frame as f64 / (SHOWN - 1) as f64, &mut shape);
        positions.extend(shape.iter().map(|&x| x as f32));
    }
    Ok(Sequence::new(Arc::new(topology.clone()), positions, None))
}

/// A person of bones, standing and then with arms up, one knee bent, looking down: joint, parent, and the
/// bone's direction in degrees from straight up in both poses.
const PERSON: [(usize, f64, f64, f64); 15] = [
    (0, 0.5, 0.0, 10.0),    // spine
    (1, 0.3, 0.0, 20.0),    // neck
    (2, 0.18, 0.0, 60.0),   // head
    (2, 0.2, 100.0, 70.0),  // right shoulder
    (4, 0.32, 170.0, 20.0), // right arm
    (5, 0.3, 175.0, -15.0), // right hand
    (2, 0.2, -100.0, -60.0),
    (7, 0.32, -170.0, -35.0),
    (8, 0.3, -175.0, 20.0),
    (0, 0.14, 110.0, 110.0), // right hip
    (10, 0.48, 175.0, 120.0),
    (11, 0.46, 180.0, 200.0),
    (0, 0.14, -110.0, -110.0), // left hip
    (13, 0.48, -175.0, -178.0),
    (14, 0.46, -180.0, -180.0),
];

fn figure_of_bones(scene: &mut Scene, at: Point, side: f32, t: f64, theme: &Theme) {
    let joints = std::iter::once(None).chain(PERSON.map(|bone| Some(bone.0 as u32)));
    let joints = joints.map(|parent| Joint {
        name: String::new(),
        parent,
    });
    let skeleton = Skeleton::new(joints.collect()).expect("a tree");
    let pose = |choose: fn(&(usize, f64, f64, f64)) -> f64| {
        let mut positions = vec![0.0; 3];
        for bone in &PERSON {
            let (sine, cosine) = choose(bone).to_radians().sin_cos();
            let [x, y] = [positions[3 * bone.0], positions[3 * bone.0 + 1]];
            positions.extend([x + bone.1 * sine, y + bone.1 * cosine, 0.0]);
        }
        positions
    };
    let (from, to) = (pose(|bone| bone.2), pose(|bone| bone.3));
    let mut shape = vec![0.0; from.len()];
    SkeletonMorph::new(&skeleton, &from, &to, Alignment::Rigid).at(t, &mut shape);
    let pixel = |joint: u32| -> Point {
        let (x, y) = (shape[3 * joint as usize], shape[3 * joint as usize + 1]);
        let scale = 0.36 * f64::from(side);
        [
            at[0] + 0.5 * side + (x * scale) as f32,
            at[1] + 0.56 * side - (y * scale) as f32,
        ]
    };
    for [parent, joint] in skeleton.bones() {
        let line = Path::polyline(&[pixel(parent), pixel(joint)]);
        scene.stroke(line, Stroke::new(theme.ink, 3.0));
    }
    for joint in 0..=PERSON.len() as u32 {
        scene.disc(
            pixel(joint),
            4.0,
            theme.tint(meshloom::plot::Tint::Series(0)),
        );
    }
    let below = [at[0] + 0.5 * side, at[1] + side + 0.9 * theme.text];
    scene.write(&format!("{t:.1}"), below, Anchor::Middle, theme);
}
