//! What is right between frames: the ordered method beside CH12's own, a cubic spline and linear blending.
//!
//! Every second frame of each capture is fitted with k = .8n, l = .6n, m = l/2, and the frames between are
//! compared with psi there. The demos, or the captures of the command line. The picture shows each layout
//! by CH12's distances and by the ordered method.
//!
//! ```text
//! cargo run --release --example transitions [CAPTURE..] [--out FOLDER]
//! ```

mod support;

use std::process::ExitCode;
use std::time::Instant;

use meshloom::demo::{DEMOS, Kind};
use meshloom::diag::Result;
use meshloom::loom::fit::{FitOptions, Method};
use meshloom::loom::fitted::{Fitted, fit_rows};
use meshloom::loom::frames::Frames;
use meshloom::loom::ordered::advice;
use meshloom::math::cubic_spline::{CubicSpline, Ends};
use meshloom::math::pca::Rows;
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::plot::{PoseSpace, Scene, Theme, pose_space};
use meshloom::signal::root::RootKind;
use meshloom::task::Task;
use support::{Figure, every};

/// A map's side, in the picture's units.
const SIDE: f32 = 420.0;

fn main() -> ExitCode {
    support::run_with("transitions", &["CAPTURE.."], |figure| {
        let captures: Vec<(String, Sequence, bool)> = if figure.is_demo() {
            let motions = DEMOS.iter().filter(|demo| demo.kind == Kind::Motion);
            let made = motions.map(|demo| (demo.name.to_string(), demo.generate(), demo.travels));
            made.collect()
        } else {
            let given = figure.captures()?.into_iter();
            given.map(|(name, given)| (name, given, false)).collect()
        };
        header();
        let theme = Theme::light();
        let height = SIDE * captures.len() as f32;
        let mut picture = Scene::new(2.0 * SIDE, height, theme.background);
        for (row, (name, sequence, travels)) in captures.iter().enumerate() {
            let sequence = &in_place(sequence, *travels)?;
            let half = every(sequence, 2);
            let reference = Reference::of(sequence, &half);
            for (column, method) in [Method::Ch12, Method::Ordered].into_iter().enumerate() {
                let measured = Measured::of(sequence, &half, method)?;
                measured.print(name, &reference);
                if method == Method::Ordered {
                    measured.hold_to(figure, name);
                }
                let at = [column as f32 * SIDE, row as f32 * SIDE];
                picture.place(pose_space(&measured.map, SIDE, SIDE, &theme).0, at);
            }
        }
        figure.picture(&picture)
    })
}

/// A capture that travels without its way over the ground, which has its own signal.
fn in_place(sequence: &Sequence, travels: bool) -> Result<Sequence> {
    if !travels {
        return Ok(sequence.clone());
    }
    let (frames, _) = Frames::without_root(sequence, RootKind::Ground, &Task::default())?;
    let mut positions = vec![0.0; frames.columns()];
    let mut all = Vec::with_capacity(frames.rows() * frames.columns());
    for frame in 0..frames.rows() {
        frames.copy(frame, 0..frames.columns(), &mut positions);
        all.extend(positions.iter().map(|&x| x as f32));
    }
    Ok(Sequence::new(
        sequence.topology().clone(),
        all,
        sequence.fps(),
    ))
}

fn header() {
    println!(
        "{:<9} {:<8} {:>3} {:>3} {:>3} {:>3}  {:>8} {:>8} {:>8} {:>6}  {:>8} {:>8}  {:>6} {:>5} {:>5} {:>5} {:>5} {:>6}",
        "capture",
        "method",
        "n",
        "k",
        "l",
        "m",
        "left out",
        "linear",
        "cubic",
        "ratio",
        "frames",
        "floor",
        "worst",
        "cross",
        "near",
        "turns",
        "grad",
        "s"
    );
}

/// Errors at the left-out frames that need no fit.
struct Reference {
    linear: f64,
}

impl Reference {
    fn of(sequence: &Sequence, half: &Sequence) -> Self {
        let blend = |i: usize| -> Vec<f64> {
            let pairs = half.frame(i).iter().zip(half.frame(i + 1));
            pairs
                .map(|(&a, &b)| 0.5 * (f64::from(a) + f64::from(b)))
                .collect()
        };
        Reference {
            linear: left_out(sequence, half, blend),
        }
    }
}

/// Relative error of `psi(i)`, halfway between kept frames i and i+1, at the left-out frames.
fn left_out(sequence: &Sequence, half: &Sequence, psi: impl Fn(usize) -> Vec<f64>) -> f64 {
    let count = half.frames() - 1;
    let out = |i: usize| sequence.frame(2 * i + 1);
    let mut mean = vec![0.0; out(0).len()];
    for i in 0..count {
        let frame = mean.iter_mut().zip(out(i));
        frame.for_each(|(mean, &z)| *mean += f64::from(z) / count as f64);
    }
    let square = |frame: &[f32], other: &[f64]| -> f64 {
        let pairs = frame.iter().zip(other);
        pairs
            .map(|(&z, other)| (f64::from(z) - other).powi(2))
            .sum()
    };
    let error: f64 = (0..count).map(|i| square(out(i), &psi(i))).sum();
    let spread: f64 = (0..count).map(|i| square(out(i), &mean)).sum();
    (error / spread).sqrt()
}

/// One method on one capture.
struct Measured {
    method: Method,
    numbers: [usize; 4],
    left_out: f64,
    cubic: f64,
    frames: f64,
    floor: f64,
    worst: f64,
    crossings: usize,
    strange: usize,
    near: f64,
    turns: f64,
    gradient: f64,
    seconds: f64,
    map: PoseSpace,
}

impl Measured {
    fn of(sequence: &Sequence, half: &Sequence, method: Method) -> Result<Self> {
        let n = half.frames();
        let (controls, sites) = ((4 * n / 5).max(4), (3 * n / 5).max(4));
        let modes = (sites / 2).min(n - 1);
        let options = FitOptions {
            method,
            controls: Some(controls),
            sites: Some(sites),
            modes: Some(modes),
            left_out: false,
            ..FitOptions::default()
        };
        let begin = Instant::now();
        let fitted = fit_rows(&Frames::new(half), &options, &Task::default())?;
        let seconds = begin.elapsed().as_secs_f64();
        let at = |x: &[f64]| {
            let mut z = vec![0.0; fitted.shape.dimension()];
            fitted.shape.evaluate(x, &mut z);
            z
        };
        let spline = cubic(&fitted);
        let curve = curve(&fitted);
        let intervals = advice::intervals(&fitted.subspace, &fitted.signals);
        Ok(Measured {
            method,
            numbers: [n, controls, sites, modes],
            left_out: left_out(sequence, half, |i| {
                at(&coordinates(&fitted, i as f64 + 1.5))
            }),
            cubic: left_out(sequence, half, |i| at(&spline(i as f64 + 1.5))),
            frames: fitted.errors.total,
            floor: fitted.errors.shape,
            worst: intervals
                .iter()
                .map(|one| one.deviation)
                .fold(0.0, f64::max),
            crossings: crossings(&curve).len(),
            strange: crossings(&curve)
                .into_iter()
                .filter(|&times| !recurs(&fitted, &spline, times))
                .count(),
            near: nearness(&fitted),
            turns: turns(&curve),
            gradient: gradient(&fitted),
            seconds,
            map: map(&fitted, curve),
        })
    }

    fn print(&self, name: &str, reference: &Reference) {
        let [n, k, l, m] = self.numbers;
        println!(
            "{name:<9} {:<8} {n:>3} {k:>3} {l:>3} {m:>3}  {:>8.4} {:>8.4} {:>8.4} {:>6.3}  {:>8.4} {:>8.4}  {:>6.3} {:>5} {:>5.3} {:>5.1} {:>5.1} {:>6.2}",
            self.method.name(),
            self.left_out,
            reference.linear,
            self.cubic,
            self.left_out / self.cubic,
            self.frames,
            self.floor,
            self.worst,
            self.crossings,
            self.near,
            self.turns,
            self.gradient,
            self.seconds,
        );
    }

    fn hold_to(&self, figure: &mut Figure, name: &str) {
        figure.goal(
            &format!("{name}: left out at most 1.05 times the cubic in the same subspace"),
            self.left_out <= 1.05 * self.cubic,
        );
        figure.goal(
            &format!("{name}: at frames at most 1.1 times the floor, or + 1e-4"),
            self.frames <= (1.1 * self.floor).max(self.floor + 1e-4),
        );
        figure.goal(
            &format!("{name}: no deviation above 0.06 of a frame step"),
            self.worst <= 0.06,
        );
        figure.goal(
            &format!("{name}: no crossing that is not a recurrence"),
            self.strange == 0,
        );
    }
}

/// g(f(t)).
fn coordinates(fitted: &Fitted, t: f64) -> Vec<f64> {
    let mut x = vec![0.0; fitted.subspace.modes];
    let p = fitted.signals.time.at(t).unwrap_or_default();
    fitted.signals.pose.evaluate(p, &mut x);
    x
}

/// The cubic spline through the frames in the shape subspace.
fn cubic(fitted: &Fitted) -> impl Fn(f64) -> Vec<f64> {
    let subspace = &fitted.subspace;
    let modes = subspace.modes;
    let knots: Vec<f64> = (1..=subspace.frames).map(|i| i as f64).collect();
    let spline = CubicSpline::new(&knots, &subspace.x, modes, Ends::NotAKnot);
    move |t| {
        let mut x = vec![0.0; modes];
        if let Ok(spline) = &spline {
            spline.evaluate(t, &mut x);
        }
        x
    }
}

/// f at eight times an interval.
fn curve(fitted: &Fitted) -> Vec<[f64; 2]> {
    let last = 8 * (fitted.subspace.frames - 1);
    let at = |i: usize| fitted.signals.time.at(1.0 + i as f64 / 8.0);
    (0..=last).filter_map(at).collect()
}

fn cross([a, b]: [f64; 2], [c, d]: [f64; 2]) -> f64 {
    a * d - b * c
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

/// Whether the motion passes nearly the same shape at two times: nearer than a frame step, or than a
/// fifth of what frames are apart in root mean square.
fn recurs(fitted: &Fitted, spline: &dyn Fn(f64) -> Vec<f64>, [t, u]: [f64; 2]) -> bool {
    let distances = fitted.subspace.distances();
    let squares: f64 = distances.values().iter().map(|d| d * d).sum();
    let usual = (squares / distances.values().len() as f64).sqrt();
    let steps = (1..fitted.subspace.frames).map(|i| distances.get(i - 1, i));
    let step = steps.fold(0.0, f64::max);
    let pairs = spline(t).into_iter().zip(spline(u));
    let apart = pairs.map(|(x, y)| (x - y) * (x - y)).sum::<f64>().sqrt();
    apart < step.max(0.2 * usual)
}

/// The times at which the curve crosses itself.
fn crossings(curve: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let meet = |i: usize, j: usize| {
        let (a, b, c, d) = (curve[i], curve[i + 1], curve[j], curve[j + 1]);
        let apart = |p, q, r, s| cross(minus(q, p), minus(r, p)) * cross(minus(q, p), minus(s, p));
        apart(a, b, c, d) < 0.0 && apart(c, d, a, b) < 0.0
    };
    let last = curve.len() - 1;
    let time = |i: usize| 1.0 + (i as f64 + 0.5) / 8.0;
    let pairs = (0..last).flat_map(|i| (i + 2..last).map(move |j| (i, j)));
    let pairs = pairs.filter(|&(i, j)| meet(i, j));
    pairs.map(|(i, j)| [time(i), time(j)]).collect()
}

/// Full turns of the curve's direction, to either side.
fn turns(curve: &[[f64; 2]]) -> f64 {
    let steps: Vec<[f64; 2]> = curve
        .windows(2)
        .map(|pair| minus(pair[1], pair[0]))
        .filter(|[x, y]| x.hypot(*y) > 0.0)
        .collect();
    let turn = |pair: &[[f64; 2]]| {
        let along = pair[0][0] * pair[1][0] + pair[0][1] * pair[1][1];
        cross(pair[0], pair[1]).atan2(along).abs()
    };
    steps.windows(2).map(turn).sum::<f64>() / std::f64::consts::TAU
}

/// Mean distance in the map of the 5 % of frames nearest in shape, over the root mean square distance.
fn nearness(fitted: &Fitted) -> f64 {
    let positions = &fitted.signals.layout.positions;
    let distances = fitted.subspace.distances();
    let mut pairs = Vec::new();
    for i in 0..positions.len() {
        for j in i + 3..positions.len() {
            let [x, y] = minus(positions[i], positions[j]);
            pairs.push((distances.get(i, j), x.hypot(y)));
        }
    }
    if pairs.is_empty() {
        return 0.0;
    }
    let squares: f64 = pairs.iter().map(|(_, p)| p * p).sum();
    let size = (squares / pairs.len() as f64).sqrt();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let nearest = &pairs[..(pairs.len() / 20).max(3).min(pairs.len())];
    nearest.iter().map(|(_, p)| p).sum::<f64>() / nearest.len() as f64 / size
}

/// The largest |dg| along f over its median.
fn gradient(fitted: &Fitted) -> f64 {
    let modes = fitted.subspace.modes;
    let mut rows = vec![0.0; 2 * modes];
    let mut sizes: Vec<f64> = curve(fitted)
        .into_iter()
        .map(|p| {
            fitted.signals.pose.jacobian(p, &mut rows);
            rows.iter().map(|x| x * x).sum::<f64>().sqrt()
        })
        .collect();
    sizes.sort_by(f64::total_cmp);
    sizes[sizes.len() - 1] / sizes[sizes.len() / 2]
}

fn map(fitted: &Fitted, curve: Vec<[f64; 2]>) -> PoseSpace {
    let times = (0..curve.len()).map(|i| 1.0 + i as f64 / 8.0).collect();
    PoseSpace {
        curve,
        times,
        frames: fitted.signals.layout.positions.clone(),
        ..PoseSpace::default()
    }
}
