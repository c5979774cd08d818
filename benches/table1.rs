//! Table 1 of Cashman & Hormann 2012 on this machine: `cargo bench --bench table1`.
//!
//! The paper's captures are not public, so smooth random motions with its d, k, l, m, n stand in. Each
//! row is the best of several runs, in milliseconds, beside the paper's (a 2.67 GHz Core i7); below, how
//! long a pin takes to move with everything else warm.

use std::hint::black_box;
use std::sync::Arc;
use std::time::{Duration, Instant};

use meshloom::loom::ch12::{self, Signals};
use meshloom::loom::frames::Frames;
use meshloom::loom::session::Session;
use meshloom::loom::subspace::Subspace;
use meshloom::math::pca::{Pca, Rows, Table};
use meshloom::mesh::{Sequence, Topology};
use meshloom::task::Task;

const RUNS: usize = 7;

struct Row {
    name: &'static str,
    d: usize,
    k: usize,
    l: usize,
    m: usize,
    n: usize,
    /// f, g and h in the paper, milliseconds.
    paper: [f64; 3],
    /// Whether the paper's space is that of vertices, whose frames are single precision.
    vertices: bool,
}

#[rustfmt::skip]
const ROWS: [Row; 5] = [
    Row { name: "1 horse", d: 25293, k: 16, l: 12, m: 7, n: 24, paper: [1.0, 10.0, 166.0], vertices: true },
    Row { name: "4 flag", d: 51987, k: 98, l: 100, m: 79, n: 100, paper: [31.0, 1295.0, 7625.0], vertices: false },
    Row { name: "5 bunny", d: 11505, k: 82, l: 46, m: 19, n: 99, paper: [26.0, 234.0, 1326.0], vertices: true },
    Row { name: "7c horse", d: 151_590, k: 16, l: 12, m: 7, n: 24, paper: [1.0, 57.0, 135.0], vertices: false },
    Row { name: "6 cow", d: 8712, k: 155, l: 144, m: 42, n: 204, paper: [239.0, 5626.0, 5127.0], vertices: true },
];

/// n frames of d coordinates: cosines over time of all frequencies that n frames can hold, with random
/// directions and amplitudes that fall like a twice differentiable motion's.
fn motion(n: usize, d: usize) -> Vec<f64> {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    };
    let mut values = vec![0.0; n * d];
    for mode in 1..n {
        let size = (mode as f64).powf(-2.0);
        let direction: Vec<f64> = (0..d).map(|_| size * random()).collect();
        for (frame, row) in values.chunks_exact_mut(d).enumerate() {
            let angle = std::f64::consts::PI * mode as f64 * (frame as f64 + 0.5) / n as f64;
            let part = angle.cos();
            row.iter_mut()
                .zip(&direction)
                .for_each(|(z, h)| *z += part * h);
        }
    }
    values
}

/// Time of h, layout, g and f, and what came out.
fn run(rows: &dyn Rows, (k, l, m): (usize, usize, usize)) -> ([Duration; 4], Subspace, Signals) {
    let task = Task::default();
    let start = Instant::now();
    let pca = Pca::new(rows, &task).expect("finite");
    let basis = pca.basis(rows, m, &task).expect("finite");
    let h = start.elapsed();
    let subspace = Subspace::new(&pca, &basis);
    let start = Instant::now();
    let layout = ch12::place(&subspace, &[], &task).expect("not cancelled");
    let placed = start.elapsed();
    let start = Instant::now();
    let pose = ch12::pose(&subspace, &layout.positions, l).expect("finite");
    let g = start.elapsed();
    let start = Instant::now();
    let time = ch12::time(&layout.positions, k, 0.5).expect("in bounds");
    let f = start.elapsed();
    let signals = Signals {
        layout,
        distinct: pose.distinct,
        merged: pose.spread,
        ordered: None,
        pose: pose.signal,
        time,
    };
    ([h, placed, g, f], subspace, signals)
}

fn best(rows: &dyn Rows, sizes: (usize, usize, usize)) -> [f64; 4] {
    let mut best = [f64::INFINITY; 4];
    for _ in 0..RUNS {
        let (times, ..) = black_box(run(rows, sizes));
        for (best, time) in best.iter_mut().zip(times) {
            *best = best.min(1e3 * time.as_secs_f64());
        }
    }
    best
}

fn table() {
    println!("Table 1, milliseconds        h  layout      g      f   total   paper   ratio");
    let (mut ours, mut theirs) = (0.0, 0.0);
    for row in &ROWS {
        let values = motion(row.n, row.d);
        let sizes = (row.k, row.l, row.m);
        let times = if row.vertices {
            let topology = Topology::from_triangles(row.d / 3, &[]).expect("no faces");
            let positions = values.iter().map(|&x| x as f32).collect();
            let sequence = Sequence::new(Arc::new(topology), positions, None);
            best(&Frames::new(&sequence), sizes)
        } else {
            best(&Table::new(&values, row.d), sizes)
        };
        let [h, layout, g, f] = times;
        let (total, paper) = (times.iter().sum::<f64>(), row.paper.iter().sum::<f64>());
        println!(
            "{:<20}  {h:8.1} {layout:7.1} {g:6.1} {f:6.1} {total:7.1} {paper:7.0} {:6.0}x",
            row.name,
            paper / total
        );
        (ours, theirs) = (ours + total, theirs + paper);
    }
    println!("sum {ours:47.1} {theirs:7.0} {:6.0}x\n", theirs / ours);
}

/// A pin moved a little, several times, the layout warm and the sites kept.
fn drag(n: usize, (k, l, m): (usize, usize, usize)) {
    let values = motion(n, 3000);
    let task = Task::default();
    let (_, subspace, signals) = run(&Table::new(&values, 3000), (k, l, m));
    let [a, b] = [
        signals.layout.positions[n / 3],
        signals.layout.positions[2 * n / 3],
    ];
    let size = signals
        .layout
        .positions
        .iter()
        .map(|p| p[0].abs())
        .fold(0.0, f64::max);
    let mut session = Session::new(subspace, &signals, vec![(n / 3, a)], 0.5);
    session.drag(2 * n / 3, b, &task).expect("in range");
    let mut times: Vec<f64> = (1..=20)
        .map(|step| {
            let to = [b[0] + 0.01 * size * f64::from(step), b[1]];
            let start = Instant::now();
            black_box(session.drag(2 * n / 3, to, &task).expect("in range"));
            1e3 * start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    println!(
        "a pin moved, n {n} l {l} k {k} m {m}: median {:.1} ms, worst {:.1} ms, {} steps at the end",
        times[10],
        times[19],
        session.layout().steps
    );
}

fn main() {
    table();
    drag(204, (155, 144, 42));
    drag(1000, (600, 500, 60));
}
