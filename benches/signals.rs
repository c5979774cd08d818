//! The signals alone: the greedy order and fit of g, its refit while a pin moves, f, and psi beside a plain
//! copy of H. Sizes are those of CH12's Table 1 (its cow) and of the longest captures worth one map.

use divan::{Bencher, black_box};
use meshloom::math::b_spline::Point;
use meshloom::math::thin_plate::Rows;
use meshloom::signal::pose::PoseSignal;
use meshloom::signal::shape::ShapeSignal;
use meshloom::signal::time::TimeSignal;

fn main() {
    divan::main();
}

/// n, k, l, m.
const SIZES: [(usize, usize, usize, usize); 2] = [(204, 155, 144, 42), (1000, 600, 500, 60)];

/// A smooth trajectory without pattern: positions in the plane and n rows of m targets.
fn trajectory(n: usize, m: usize) -> (Vec<Point>, Vec<f64>) {
    let wave = |i: usize, j: usize| {
        let t = i as f64 / 9.0;
        let (a, b) = (1.0 + 0.37 * j as f64, 0.3 + 0.11 * (j * j % 17) as f64);
        ((a * t).sin() + (b * t + j as f64).cos()) / (1.0 + j as f64)
    };
    let targets: Vec<f64> = (0..n)
        .flat_map(|i| (0..m).map(move |j| wave(i, j)))
        .collect();
    let positions = (0..n)
        .map(|i| [targets[i * m], targets[i * m + 1]])
        .collect();
    (positions, targets)
}

fn rows<'a>((positions, targets): &'a (Vec<Point>, Vec<f64>), width: usize) -> Rows<'a> {
    Rows {
        positions,
        targets,
        width,
        weights: None,
    }
}

#[divan::bench(args = SIZES)]
fn pose_greedy(bencher: Bencher, (n, _, l, m): (usize, usize, usize, usize)) {
    let data = trajectory(n, m);
    bencher.bench(|| PoseSignal::fit(&rows(&data, m), l));
}

#[divan::bench(args = SIZES)]
fn pose_refit(bencher: Bencher, (n, _, l, m): (usize, usize, usize, usize)) {
    let data = trajectory(n, m);
    let signal = PoseSignal::fit(&rows(&data, m), l)
        .expect("rows are sound")
        .signal;
    bencher.bench(|| signal.refit(&rows(&data, m)));
}

#[divan::bench(args = SIZES)]
fn time_fit(bencher: Bencher, (n, k, _, m): (usize, usize, usize, usize)) {
    let data = trajectory(n, m);
    bencher.bench(|| TimeSignal::fit(&data.0, k, 0.5));
}

/// H of 30 000 vertices and 42 modes: 30 MB, beyond the caches.
fn shape() -> ShapeSignal {
    let (d, m) = (90_000, 42);
    let numbers = |count: usize| (0..count).map(|i| (i % 1013) as f64 / 1013.0).collect();
    ShapeSignal::new(numbers(d), numbers(d * m), m).expect("numbers are finite")
}

#[divan::bench]
fn psi(bencher: Bencher) {
    let shape = shape();
    let x = vec![0.5; shape.modes()];
    let mut z = vec![0.0; 3072];
    let mut frame = vec![0.0_f32; shape.dimension()];
    bencher.bench_local(|| {
        for (block, out) in frame.chunks_mut(3072).enumerate() {
            let z = &mut z[..out.len()];
            shape.evaluate_from(block * 3072, black_box(&x), z);
            out.iter_mut().zip(z).for_each(|(out, z)| *out = *z as f32);
        }
        black_box(&mut frame);
    });
}

#[divan::bench]
fn copy_of_h(bencher: Bencher) {
    let shape = shape();
    let mut copy = vec![0.0; shape.vectors().len()];
    bencher.bench_local(|| {
        copy.copy_from_slice(black_box(shape.vectors()));
        black_box(&mut copy);
    });
}
