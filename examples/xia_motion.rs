//! Figures 1 to 5 of Xia et al. 2019: three poses of a cactus completed by piecewise-linear paths in the
//! shape space, by splines of the vertices and by splines in the shape space, with extrapolation (1) and
//! in the plane of the keys (2b); natural and Hermite ends (3); two poses, where the spline is the
//! straight path (4); five poses that turn by 180 degrees (5).
//!
//! ```text
//! cargo run --release --example xia_motion [--out FOLDER]
//! ```

#[path = "support/key_sets.rs"]
mod key_sets;
mod support;

use std::process::ExitCode;
use std::sync::Arc;

use key_sets::{HORSE, demo_keys};
use meshloom::diag::Result;
use meshloom::inbetween::{
    Boundary, CompleteOptions, Keys, Motion, MotionFrames, Velocity, complete,
};
use meshloom::math::rotation::exp;
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::metric;
use meshloom::pipeline::{key_map, key_path};
use meshloom::plot::{Scene, Theme, pose_space};
use meshloom::task::Task;
use nalgebra::Vector3;
use support::{Figure, View, percent, row, table};

/// Side of a small picture.
const SIDE: f32 = 130.0;
const KEY: [u8; 3] = [86, 130, 190];
const BETWEEN: [u8; 3] = [110, 170, 110];
const BEYOND: [u8; 3] = [215, 185, 80];

fn main() -> ExitCode {
    support::run("xia_motion", |figure| {
        let theme = Theme::light();
        let mut picture = Scene::new(11.0 * SIDE, 7.0 * (SIDE + 24.0) + 420.0, theme.background);
        let mut pen = Pen {
            picture: &mut picture,
            theme: &theme,
            top: 0.0,
        };
        figure_1(figure, &mut pen)?;
        figure_3(figure, &mut pen)?;
        figure_4(figure, &mut pen)?;
        figure_5(figure, &mut pen)?;
        figure.picture(&picture)
    })
}

/// The shape at a time.
type Shapes<'a> = &'a dyn Fn(f64) -> Vec<f64>;

/// Where the next row of shapes goes.
struct Pen<'a> {
    picture: &'a mut Scene,
    theme: &'a Theme,
    top: f32,
}

impl Pen<'_> {
    /// Shapes at `times`, by what they are to the keys.
    fn row(&mut self, keys: &Keys, at: Shapes<'_>, times: &[f64]) {
        let view = View::looking(keys.poses(), [0.5, 0.25]);
        let [first, last] = keys.ends();
        let pictures: Vec<_> = times
            .iter()
            .map(|&time| {
                let colour = match time {
                    time if keys.times().contains(&time) => KEY,
                    time if time < first || time > last => BEYOND,
                    _ => BETWEEN,
                };
                let shape: Vec<f32> = at(time).iter().map(|&x| x as f32).collect();
                (
                    format!("{time:.0}"),
                    view.picture(&shape, 2 * SIDE as usize, colour),
                )
            })
            .collect();
        row(self.picture, [0.0, self.top], SIDE, &pictures, self.theme);
        self.top += SIDE + 24.0;
    }
}

fn motion(keys: &Keys, space: &str, boundary: Boundary) -> Result<Motion> {
    let options = CompleteOptions {
        space: space.to_string(),
        boundary,
        ..CompleteOptions::default()
    };
    Ok(complete(keys, &options, &Task::default())?.output)
}

/// The piecewise-linear path through the keys' coordinates: geodesics from key to key.
fn straight(motion: &Motion, time: f64) -> Vec<f64> {
    let times = motion.spline().times();
    let after = times
        .partition_point(|key| *key <= time)
        .clamp(1, times.len() - 1);
    let (from, to) = (times[after - 1], times[after]);
    let at = |time: f64| {
        let mut coordinates = vec![0.0; motion.spline().width()];
        motion.spline().evaluate(time, &mut coordinates);
        coordinates
    };
    let share = (time - from) / (to - from);
    let blend = at(from)
        .iter()
        .zip(at(to))
        .map(|(a, b)| a + share * (b - a))
        .collect::<Vec<f64>>();
    let mut positions = vec![0.0; 3 * motion.topology().vertices()];
    motion.space().decode(&blend, &mut positions);
    positions
}

/// How far edges are from the lengths that they have in the keys before and after, blended: root mean
/// square and worst.
fn stretch(keys: &Keys, time: f64, shape: &[f64]) -> [f64; 2] {
    let after = keys
        .times()
        .partition_point(|key| *key <= time)
        .clamp(1, keys.count() - 1);
    let (from, to) = (keys.pose(after - 1), keys.pose(after));
    let (start, end) = (keys.times()[after - 1], keys.times()[after]);
    let share = ((time - start) / (end - start)).clamp(0.0, 1.0);
    let length = |shape: &[f64], [a, b]: [u32; 2]| {
        let point = |v: u32| Vector3::from_column_slice(&shape[3 * v as usize..][..3]);
        (point(a) - point(b)).norm()
    };
    let edges = keys
        .poses()
        .topology()
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    let (mut squares, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
    for edge in edges {
        let expected = (1.0 - share) * length(&from, edge) + share * length(&to, edge);
        let off = (length(shape, edge) / expected - 1.0).abs();
        (squares, worst, count) = (squares + off * off, worst.max(off), count + 1.0);
    }
    [(squares / f64::max(count, 1.0)).sqrt(), worst]
}

/// The largest root mean square and the worst of a path over its in-between times.
fn stretches(keys: &Keys, at: Shapes<'_>) -> [f64; 2] {
    let [first, last] = keys.ends();
    let all = (1..20).map(|i| {
        let time = first + (last - first) * f64::from(i) / 20.0;
        stretch(keys, time, &at(time))
    });
    all.fold([0.0, 0.0], |a, b| {
        [f64::max(a[0], b[0]), f64::max(a[1], b[1])]
    })
}

/// How sharply positions turn at the middle key: the acceleration there over the mean elsewhere.
fn corner(keys: &Keys, at: Shapes<'_>) -> f64 {
    let bend = |time: f64| {
        let [a, b, c] = [time - 1.0, time, time + 1.0].map(at);
        let bends = a.iter().zip(&b).zip(&c).map(|((a, b), c)| a - 2.0 * b + c);
        bends.map(|x| x * x).sum::<f64>().sqrt()
    };
    let middle = keys.times()[1];
    let elsewhere: Vec<f64> = [-16.0, -12.0, -8.0, 8.0, 12.0, 16.0]
        .map(|off| bend(middle + off))
        .into();
    bend(middle) * elsewhere.len() as f64 / elsewhere.iter().sum::<f64>()
}

fn figure_1(figure: &mut Figure, pen: &mut Pen<'_>) -> Result<()> {
    let keys = demo_keys("cactus", &[0, 1, 2], 0);
    let ours = motion(&keys, "patch-lri", Boundary::Natural)?;
    let vertices = motion(&keys, "vertices", Boundary::Natural)?;
    let paths: [(&str, Shapes<'_>); 3] = [
        ("geodesics, piecewise linear", &|time| straight(&ours, time)),
        ("splines of the vertices", &|time| vertices.at(time)),
        ("splines in patch-lri", &|time| ours.at(time)),
    ];
    println!("Figure 1: a cactus of three poses, bent in orthogonal directions");
    let times = [
        -7.0, 1.0, 7.0, 13.0, 19.0, 25.0, 31.0, 37.0, 43.0, 49.0, 57.0,
    ];
    let mut rows = Vec::new();
    let mut measured = Vec::new();
    for (name, at) in paths {
        let [typical, worst] = stretches(&keys, at);
        let corner = corner(&keys, at);
        rows.push(vec![
            name.to_string(),
            percent(typical),
            percent(worst),
            format!("{corner:.1}"),
        ]);
        measured.push((typical, corner));
        pen.row(&keys, at, &times);
    }
    table(
        &["path", "edges rms", "edges worst", "corner at the key"],
        &rows,
    );
    println!("X19: geodesics have an obvious sharp corner at the key, splines in their space none");
    figure.goal(
        "edges keep their lengths better than between vertices, and the key is no corner",
        measured[2].0 < 0.5 * measured[1].0 && measured[2].1 < 0.25 * measured[0].1,
    );
    let path = key_path(&ours, &Task::default())?;
    println!(
        "Figure 2b: the plane shows {} of the keys' spread",
        percent(path.share)
    );
    let (map, _) = pose_space(&key_map(&path), 560.0, 400.0, pen.theme);
    pen.picture.place(map, [0.0, 7.0 * (SIDE + 24.0)]);
    Ok(())
}

/// KG error in percent between motions at the same times.
fn kg(first: &Arc<Motion>, second: &Arc<Motion>, ends: [f64; 2]) -> f64 {
    let times: Vec<f64> = (0..25)
        .map(|i| ends[0] + (ends[1] - ends[0]) * f64::from(i) / 24.0)
        .collect();
    let frames = |motion: &Arc<Motion>| MotionFrames::new(Arc::clone(motion), times.clone(), None);
    let found = metric::compare(&frames(first), &frames(second), &Task::default());
    found.map_or(f64::NAN, |found| found.vertices.kg_percent)
}

fn figure_3(figure: &mut Figure, pen: &mut Pen<'_>) -> Result<()> {
    let three = demo_keys("cactus", &[0, 1, 2], 0);
    let whole = Arc::new(motion(&three, "patch-lri", Boundary::Natural)?);
    let two = demo_keys("cactus", &[0, 2], 0);
    let two = Keys::new(two.poses().clone(), Some(vec![1.0, 49.0]))?;
    let natural = Arc::new(motion(&two, "patch-lri", Boundary::Natural)?);
    // the first two and the last two shapes of the sequence of Figure 1 (X26)
    let shape = |time: f64| {
        whole
            .at(time)
            .iter()
            .map(|&x| x as f32)
            .collect::<Vec<f32>>()
    };
    let between = |from: f64, to: f64| {
        Some(Velocity {
            from: Some(shape(from)),
            to: shape(to),
            time: to - from,
        })
    };
    let boundary = Boundary::Hermite {
        start: between(1.0, 2.0),
        end: between(48.0, 49.0),
    };
    let hermite = Arc::new(motion(&two, "patch-lri", boundary)?);
    let errors = [&natural, &hermite].map(|motion| kg(&whole, motion, [1.0, 49.0]));
    println!("\nFigure 3: the first and the last cactus, against the sequence of Figure 1");
    let rows = [
        ("natural", errors[0]),
        ("Hermite, its velocities", errors[1]),
    ];
    let rows: Vec<_> = rows
        .map(|(name, kg)| vec![name.to_string(), format!("{kg:.1} %")])
        .into();
    table(&["ends", "KG error"], &rows);
    println!("X19: with Hermite ends \"almost the same\"");
    figure.goal(
        "Hermite ends come within half of the natural ones' distance",
        errors[1] < 0.5 * errors[0],
    );
    let times: Vec<f64> = (0..9).map(|i| 1.0 + 6.0 * f64::from(i)).collect();
    pen.row(&two, &|time| natural.at(time), &times);
    pen.row(&two, &|time| hermite.at(time), &times);
    Ok(())
}

fn figure_4(figure: &mut Figure, pen: &mut Pen<'_>) -> Result<()> {
    let keys = demo_keys("gallop", &HORSE[..2], 0);
    let ours = motion(&keys, "patch-lri", Boundary::Natural)?;
    let times: Vec<f64> = (0..11).map(|i| -11.0 + 6.0 * f64::from(i)).collect();
    let off = times
        .iter()
        .map(|&time| {
            let pairs = ours.at(time).into_iter().zip(straight(&ours, time));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        })
        .fold(0.0, f64::max);
    println!("\nFigure 4: two poses; natural splines are geodesics, largest distance {off:.1e}");
    figure.goal(
        "the spline through two keys is the straight path",
        off < 1e-9,
    );
    let beyond = stretch(&keys, 49.0, &ours.at(49.0));
    println!(
        "edges a whole step beyond the last key: rms {}",
        percent(beyond[0])
    );
    pen.row(&keys, &|time| ours.at(time), &times);
    Ok(())
}

fn figure_5(figure: &mut Figure, pen: &mut Pen<'_>) -> Result<()> {
    let poses = demo_keys("gallop", &[0, 4, 8, 12, 16], 0);
    let turned: Vec<f32> = (0..5)
        .flat_map(|key| {
            // fallen over by 180 degrees from the first pose to the last
            let turn = exp(&Vector3::new(
                0.0,
                0.0,
                std::f64::consts::PI * key as f64 / 4.0,
            ));
            let pose = poses.pose(key);
            let place = move |p: &[f64]| {
                (turn * Vector3::from_column_slice(p))
                    .map(|x| x as f32)
                    .data
                    .0[0]
            };
            pose.chunks_exact(3).flat_map(place).collect::<Vec<f32>>()
        })
        .collect();
    let keys = Keys::new(
        Sequence::new(poses.poses().topology().clone(), turned, None),
        None,
    )?;
    println!("\nFigure 5: five poses of a horse that turns by 180 degrees");
    let mut rows = Vec::new();
    let mut measured = Vec::new();
    for space in ["vertices", "gradients", "patch-lri"] {
        let found = motion(&keys, space, Boundary::Natural)?;
        let [typical, worst] = stretches(&keys, &|time| found.at(time));
        rows.push(vec![space.to_string(), percent(typical), percent(worst)]);
        measured.push(typical);
        if space == "patch-lri" {
            let times: Vec<f64> = (0..11).map(|i| 1.0 + 9.6 * f64::from(i)).collect();
            pen.row(&keys, &|time| found.at(time), &times);
        }
    }
    table(&["space", "edges rms", "edges worst"], &rows);
    figure.goal(
        "in patch-lri edges keep their lengths to 5 %",
        measured[2] < 0.05,
    );
    Ok(())
}
