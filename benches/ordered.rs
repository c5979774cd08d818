//! The ordered method on this machine: `cargo bench --bench ordered`. Best of several runs.
//!
//! A full fit (layouts, choice, refinement) of smooth random motions in their shape subspace, and a pin
//! that is dragged: n = 204, k = 163, l = 122, m = 42 (goals: 0.8 s on one core, 0.5 s on two; a drag
//! 33 ms), and n = 1000, k = 800, l = 300, m = 60 (goal: 30 s).

use std::hint::black_box;
use std::time::{Duration, Instant};

use faer::Mat;
use meshloom::math::ordered::{Drag, Motion, Options};
use meshloom::task::Task;

fn main() {
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        let Ok(pool) = pool else { continue };
        pool.install(|| {
            println!("{threads} thread(s)");
            fit(204, [163, 122, 42], 5);
            if threads == 2 {
                fit(1000, [800, 300, 60], 1);
            }
        });
    }
}

fn fit(n: usize, [controls, sites, modes]: [usize; 3], runs: usize) {
    let frames = motion(n, modes);
    let task = Task::default();
    let options = Options {
        controls,
        sites,
        pins: Vec::new(),
    };
    let fit = || Motion::new(frames.as_ref(), 0.005, &task)?.fit(&options, &task);
    let Ok(found) = fit() else { return };
    let best = shortest(runs, || {
        let _ = black_box(fit());
    });
    println!(
        "  n = {n}, k = {controls}, l = {sites}, m = {modes}: full fit {:.3} s ({:?}, worst {:.4})",
        best.as_secs_f64(),
        found.choice,
        found.quality.worst
    );
    let drag = Drag::new(frames.as_ref(), 0.005, found.controls.as_ref());
    let to = |shift: f64| {
        let place = |frame: usize| [found.layout[(frame, 0)] + shift, found.layout[(frame, 1)]];
        [
            (10, place(10)),
            (n / 2, place(n / 2)),
            (n - 20, place(n - 20)),
        ]
    };
    let last = (found.controls.as_ref(), &found.plate);
    let best = shortest(runs.max(3), || {
        let _ = black_box(drag.to(last, &to(0.05), &task));
    });
    println!("    a pin dragged: {:.1} ms", 1e3 * best.as_secs_f64());
}

fn shortest(runs: usize, mut run: impl FnMut()) -> Duration {
    let mut best = Duration::MAX;
    for _ in 0..runs {
        let begin = Instant::now();
        run();
        best = best.min(begin.elapsed());
    }
    best
}

/// Sums of slow waves whose sizes fall like 1/mode: of full rank, never twice the same.
fn motion(n: usize, modes: usize) -> Mat<f64> {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    };
    let waves: Vec<[f64; 3]> = (0..6 * modes)
        .map(|_| [random(), 2.0 + 9.0 * random().abs(), 3.0 * random()])
        .collect();
    Mat::from_fn(n, modes, |i, mode| {
        let time = i as f64 / 100.0;
        let sum: f64 = waves[6 * mode..6 * mode + 6]
            .iter()
            .map(|[size, speed, phase]| size * (speed * time + phase).sin())
            .sum();
        sum / (1.0 + mode as f64)
    })
}
