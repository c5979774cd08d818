//! Shape spaces at the sizes of X19's Table 1: `cargo bench --bench spaces [FACES..]`. Best of several runs.
//!
//! For each size what is done once per mesh (analysis and factorisation), one frame encoded and decoded on
//! all cores, one decoded on a single core, and frames of a batch decoded side by side with how many times
//! as fast as on one core that is; beside each its ratio to a plain copy of the frame's coordinates in the
//! same run. Then a capture of 85 K faces fitted, and three keys of 1.3 M faces
//! blended in a process of its own, with the most memory that it held. The mesh is a dented torus, its
//! vertices in rows, bent.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use meshloom::loom::fit::{FitOptions, fit};
use meshloom::math::cubic_spline::{CubicSpline, Ends};
use meshloom::mesh::{Sequence, Topology};
use meshloom::space::{ShapeSpace, Spaces};
use meshloom::task::Task;
use rayon::prelude::*;

/// Numbers of faces: X19's armadillo, its centaur and dragon sizes and the largest.
const SIZES: [usize; 4] = [10_000, 80_000, 233_000, 1_300_000];

/// What decoding a frame may take, milliseconds.
const GOALS: [f64; 4] = [5.0, 45.0, 160.0, 1000.0];

/// Frames of a batch.
const BATCH: usize = 8;

/// Marks the process that blends keys.
const KEYS: &str = "--three-keys";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == KEYS) {
        three_keys(SIZES[3]);
        return;
    }
    let chosen: Vec<usize> = arguments
        .iter()
        .filter_map(|text| text.parse().ok())
        .collect();
    println!("{} threads", rayon::current_num_threads());
    for (faces, goal) in SIZES.into_iter().zip(GOALS) {
        if chosen.is_empty() || chosen.contains(&faces) {
            per_size(faces, goal);
        }
    }
    if chosen.is_empty() {
        capture();
        keys_apart();
    }
}

/// A torus of about `faces` triangles; `bend` deforms it.
fn torus(faces: usize, bend: f64) -> (Arc<Topology>, Vec<f64>) {
    let rows = ((faces / 2) as f64).sqrt() as usize;
    let columns = faces / 2 / rows;
    let at = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
    let mut positions = Vec::with_capacity(3 * rows * columns);
    let mut triangles = Vec::with_capacity(2 * rows * columns);
    for i in 0..rows {
        for j in 0..columns {
            let (u, v) = (
                TAU * i as f64 / rows as f64,
                TAU * j as f64 / columns as f64,
            );
            let dent = 0.4 + 0.03 * (9.0 * u).sin() * (7.0 * v).cos();
            let r = 1.0 + dent * v.cos();
            let (x, y, z) = (r * u.cos(), r * u.sin(), dent * v.sin());
            positions.extend([x, y + bend * x * x, z + bend * (2.0 * x).sin()]);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let topology = Topology::from_triangles(rows * columns, &triangles);
    (Arc::new(topology.expect("a torus")), positions)
}

/// Set up, encode, decode and a batch in both spaces.
fn per_size(faces: usize, goal: f64) {
    let (topology, reference) = torus(faces, 0.0);
    let (_, pose) = torus(faces, 0.3);
    let runs = (4_000_000 / faces).clamp(5, 200);
    // dropped at once: a space that lives is found again
    let set_up = shortest(3, || {
        let spaces = Spaces::new(Arc::clone(&topology), &reference);
        black_box(spaces.open("gradients", &[]).expect("a space"));
    });
    println!(
        "{faces} faces: analysis and factor {:.3} s",
        set_up.as_secs_f64()
    );
    for name in ["gradients", "patch-lri"] {
        let spaces = Spaces::new(Arc::clone(&topology), &reference);
        let space = spaces.open(name, &[&reference, &pose]).expect("a space");
        let mut z = vec![0.0; space.dimension()];
        let mut shape = vec![0.0; pose.len()];
        let encode = shortest(runs, || space.encode(black_box(&pose), &mut z));
        let decode = shortest(runs, || space.decode(black_box(&z), &mut shape));
        let mut copy = vec![0.0; z.len()];
        let plain = shortest(runs, || {
            copy.copy_from_slice(black_box(&z));
            black_box(&mut copy);
        });
        let batch =
            shortest(2 + runs / 10, || decode_batch(&*space, &z, pose.len())) / BATCH as u32;
        let alone =
            on_one_core(|| shortest(2 + runs / 4, || space.decode(black_box(&z), &mut shape)));
        let ms = |time: Duration| 1e3 * time.as_secs_f64();
        let times = |time: Duration| ms(time) / ms(plain);
        println!(
            "  {name:<9} copy {:>8.3} ms; encode {:>8.3} ms {:>5.1} x; decode {:>8.3} ms {:>5.1} x (goal {goal} ms); encode/decode {:.2}; on one core {:>8.3} ms; batch {:>8.3} ms a frame {:>5.1} x, {:.2} times one core",
            ms(plain),
            ms(encode),
            times(encode),
            ms(decode),
            times(decode),
            ms(encode) / ms(decode),
            ms(alone),
            ms(batch),
            times(batch),
            ms(alone) / ms(batch),
        );
    }
}

/// What `work` gives when it has one thread.
fn on_one_core<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.expect("a thread").install(work)
}

fn decode_batch(space: &dyn ShapeSpace, z: &[f64], width: usize) {
    (0..BATCH).into_par_iter().for_each(|_| {
        let mut shape = vec![0.0; width];
        space.decode(z, &mut shape);
        black_box(shape);
    });
}

/// 48 frames of 85 K faces, fitted.
fn capture() {
    let frames = 48;
    let positions = (0..frames).flat_map(|frame| {
        let bend = 0.3 * (TAU * frame as f64 / frames as f64).sin();
        torus(85_000, bend).1.into_iter().map(|x| x as f32)
    });
    let sequence = Sequence::new(torus(85_000, 0.0).0, positions.collect(), Some(24.0));
    for space in ["vertices", "gradients", "patch-lri"] {
        let options = FitOptions {
            space: space.to_string(),
            ..FitOptions::default()
        };
        let begun = Instant::now();
        let fitted = fit(&sequence, &options, &Task::default()).expect("a fit");
        println!(
            "{frames} frames of 85000 faces fitted in {space}: {:.2} s, m = {}",
            begun.elapsed().as_secs_f64(),
            fitted.output.shape().modes()
        );
    }
}

/// [`three_keys`] in a process of its own.
fn keys_apart() {
    let this = std::env::current_exe().expect("a path to this program");
    let begun = Instant::now();
    let ended = Command::new(this).arg(KEYS).status();
    assert!(ended.expect("a second process").success());
    println!("    whole process {:.2} s", begun.elapsed().as_secs_f64());
}

/// Three keys encoded, five poses decoded from the cubic spline through them, and the memory of it all.
fn three_keys(faces: usize) {
    let (topology, reference) = torus(faces, 0.0);
    let spaces = Spaces::new(Arc::clone(&topology), &reference);
    let space = spaces.open("patch-lri", &[&reference]).expect("a space");
    let d = space.dimension();
    let mut rows = vec![0.0; 3 * d];
    for (row, bend) in rows.chunks_exact_mut(d).zip([0.0, 0.3, -0.2]) {
        space.encode(&torus(faces, bend).1, row);
    }
    let spline = CubicSpline::new(&[0.0, 1.0, 2.0], &rows, d, Ends::Natural).expect("a spline");
    let (mut z, mut shape) = (vec![0.0; d], vec![0.0; reference.len()]);
    for step in 0..5 {
        spline.evaluate(0.5 * f64::from(step), &mut z);
        space.decode(&z, &mut shape);
    }
    println!(
        "three keys of {faces} faces: {} MB at most",
        most_memory() / 1_000_000
    );
}

/// The most memory that this process has held, where the system tells.
fn most_memory() -> usize {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let number = line.map(|line| line.trim().trim_end_matches(" kB"));
    1024 * number
        .and_then(|number| number.parse::<usize>().ok())
        .unwrap_or(0)
}

fn shortest(runs: usize, mut run: impl FnMut()) -> Duration {
    let mut best = Duration::MAX;
    for _ in 0..runs {
        let begun = Instant::now();
        run();
        best = best.min(begun.elapsed());
    }
    best
}
