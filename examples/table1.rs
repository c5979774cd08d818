//! Table 1 of Cashman & Hormann 2012: the time to find the three signals, with the paper's d, k, l, m and n,
//! on smooth random trajectories. The paper's machine was an Intel Core i7 at 2.67 GHz.
//!
//! A path argument fits that capture with the shares k/n, l/n and m/n of each row instead.

mod support;

use std::ops::Range;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use meshloom::diag::Result;
use meshloom::loom::fit::FitOptions;
use meshloom::loom::fitted::fit_rows;
use meshloom::math::pca::Rows;
use meshloom::mesh::FrameSource;
use meshloom::plot::{Chart, Panel, Scale, Series, Style, Theme, Tick, Tint, chart};
use meshloom::task::{Observer, Task};

use support::{Figure, table};

/// A row of the table: figure, d, k, l, m, n, and the paper's milliseconds for f, g and h.
struct Row {
    figure: &'static str,
    dimension: usize,
    numbers: [usize; 4],
    paper: [f64; 3],
}

const fn row(figure: &'static str, dimension: usize, numbers: [usize; 4], paper: [f64; 3]) -> Row {
    Row {
        figure,
        dimension,
        numbers,
        paper,
    }
}

const ROWS: [Row; 5] = [
    row("1 horse", 25293, [16, 12, 7, 24], [1.0, 10.0, 166.0]),
    row("4 flag", 51987, [98, 100, 79, 100], [31.0, 1295.0, 7625.0]),
    row("5 bunny", 11505, [82, 46, 19, 99], [26.0, 234.0, 1326.0]),
    row("7c horse", 151_590, [16, 12, 7, 24], [1.0, 57.0, 135.0]),
    row("6 cow", 8712, [155, 144, 42, 204], [239.0, 5626.0, 5127.0]),
];

/// Each row is measured this often and the median taken.
const RUNS: usize = 5;

/// What is measured: the name of the phase, and which of the paper's columns it belongs to.
const PHASES: [&str; 4] = ["time", "pose", "shape", "layout"];

fn main() -> ExitCode {
    support::run("table1", draw)
}

fn draw(figure: &mut Figure) -> Result<()> {
    let mut lines = Vec::new();
    let (mut before, mut after) = (0.0, 0.0);
    let mut gain = 0.0; // of the last row, the cow
    let mut bars = [Vec::new(), Vec::new()];
    for (i, row) in ROWS.iter().enumerate() {
        let (values, dimension, numbers) = rows(figure, row)?;
        let here = median(&values, dimension, numbers)?;
        let (paper, sum): (f64, f64) = (row.paper.iter().sum(), here.iter().sum());
        (before, after, gain) = (before + paper, after + sum, paper / sum);
        bars[0].push([i as f64 + 1.0, paper]);
        bars[1].push([i as f64 + 1.0, sum]);
        lines.push(line(row.figure, dimension, numbers, row.paper, here));
    }
    let heads = [
        "figure",
        "d",
        "k",
        "l",
        "m",
        "n",
        "f paper",
        "g paper",
        "h paper",
        "f ms",
        "g ms",
        "h ms",
        "layout ms",
        "times faster",
        "floats / raw",
    ];
    table(&heads, &lines);
    println!("sum: {before:.0} ms in the paper, {after:.1} ms here");
    if figure.is_demo() {
        let faster = before / after;
        figure.goal(
            &format!("the sum at least 80 times faster: {faster:.0}"),
            faster >= 80.0,
        );
        figure.goal(
            &format!("the cow at least 150 times faster: {gain:.0}"),
            gain >= 150.0,
        );
    }
    let [paper, here] = bars;
    let panel = Panel {
        name: "time (ms)".into(),
        scale: Scale::Log,
        series: vec![
            Series::line("Cashman & Hormann 2012", Tint::Series(1), paper).styled(Style::Dots),
            Series::line("here", Tint::Series(0), here).styled(Style::Dots),
        ],
        ..Panel::default()
    };
    let named = |(i, row): (usize, &Row)| Tick {
        value: i as f64 + 1.0,
        text: row.figure.into(),
    };
    let bars = Chart {
        name: "figure".into(),
        names: Some(ROWS.iter().enumerate().map(named).collect()),
        range: Some([0.5, 5.5]),
        panels: vec![panel],
        ..Chart::default()
    };
    figure.picture(&chart(&bars, 640.0, 400.0, &Theme::light()).0)
}

/// Frames, their dimension, and k, l, m, n: random ones of the row's size, or the capture's.
fn rows(figure: &Figure, row: &Row) -> Result<(Vec<f32>, usize, [usize; 4])> {
    if figure.is_demo() {
        let [.., m, n] = row.numbers;
        return Ok((
            trajectory(n, row.dimension, m + 10),
            row.dimension,
            row.numbers,
        ));
    }
    let (sequence, _) = figure.capture("")?;
    let n = sequence.frames();
    let scaled = |number: usize| (number * n).div_ceil(row.numbers[3]);
    let [k, l, m, _] = row.numbers;
    let numbers = [
        scaled(k).clamp(4, n + 2),
        scaled(l).clamp(3, n.max(3)),
        scaled(m).min(n - 1),
        n,
    ];
    Ok((
        sequence.positions().to_vec(),
        3 * sequence.topology().vertices(),
        numbers,
    ))
}

/// n rows of d numbers: random directions, each on a smooth wave whose size falls with its frequency.
fn trajectory(n: usize, d: usize, waves: usize) -> Vec<f32> {
    let mut state = 1_u64;
    let mut random = move || {
        // Steele, Lea & Flood 2014 (SplitMix64)
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64 - 0.5
    };
    let mut values = vec![0.0_f32; n * d];
    for wave in 1..=waves {
        let (turns, phase) = (0.25 * wave as f64, std::f64::consts::TAU * random());
        let direction: Vec<f64> = (0..d).map(|_| random() / wave as f64).collect();
        for (i, row) in values.chunks_exact_mut(d).enumerate() {
            let height = (phase + std::f64::consts::TAU * turns * i as f64 / n as f64).sin();
            row.iter_mut()
                .zip(&direction)
                .for_each(|(x, v)| *x += (height * v) as f32);
        }
    }
    values
}

/// Median milliseconds of each phase.
fn median(values: &[f32], dimension: usize, [k, l, m, _]: [usize; 4]) -> Result<[f64; 4]> {
    let options = FitOptions {
        controls: Some(k),
        sites: Some(l),
        modes: Some(m),
        left_out: false,
        ..FitOptions::ch12()
    };
    let mut runs = Vec::new();
    for _ in 0..RUNS {
        let clock = Arc::new(Clock::default());
        fit_rows(
            &Frames { values, dimension },
            &options,
            &Task::observed(clock.clone()),
        )?;
        runs.push(clock.milliseconds());
    }
    Ok([0, 1, 2, 3].map(|phase| {
        let mut times: Vec<f64> = runs.iter().map(|run| run[phase]).collect();
        times.sort_by(f64::total_cmp);
        times[RUNS / 2]
    }))
}

/// Frames as captures hold them: single precision, one after another.
struct Frames<'a> {
    values: &'a [f32],
    dimension: usize,
}

impl Rows for Frames<'_> {
    fn rows(&self) -> usize {
        self.values.len() / self.dimension
    }

    fn columns(&self) -> usize {
        self.dimension
    }

    fn copy(&self, row: usize, range: Range<usize>, out: &mut [f64]) {
        let start = row * self.dimension;
        let values = &self.values[start + range.start..start + range.end];
        out.iter_mut()
            .zip(values)
            .for_each(|(out, &x)| *out = f64::from(x));
    }
}

fn line(
    figure: &str,
    d: usize,
    [k, l, m, n]: [usize; 4],
    paper: [f64; 3],
    here: [f64; 4],
) -> Vec<String> {
    // f: k points and knots, rho; g: sites and weights; h: mean and modes; against the frames
    let stored = 2 * k + (k + 2) + n + l * (m + 2) + 3 * m + d * (m + 1);
    let times = paper.iter().sum::<f64>() / here.iter().sum::<f64>();
    let mut cells = vec![figure.to_string()];
    cells.extend([d, k, l, m, n].map(|number| number.to_string()));
    cells.extend(paper.map(|ms| format!("{ms:.0}")));
    cells.extend(here.map(|ms| format!("{ms:.2}")));
    cells.push(format!("{times:.0}"));
    cells.push(format!("{:.2}", stored as f64 / (n * d) as f64));
    cells
}

/// Adds up how long each phase takes.
#[derive(Default)]
struct Clock {
    phases: Mutex<Vec<(&'static str, Instant)>>,
}

impl Observer for Clock {
    fn phase(&self, name: &'static str, _steps: usize) {
        if let Ok(mut phases) = self.phases.lock() {
            phases.push((name, Instant::now()));
        }
    }

    fn step(&self) {}
}

impl Clock {
    /// Of the phases in [`PHASES`], until now.
    fn milliseconds(&self) -> [f64; 4] {
        let now = Instant::now();
        let phases = self
            .phases
            .lock()
            .map(|phases| phases.clone())
            .unwrap_or_default();
        PHASES.map(|wanted| {
            let of = phases
                .iter()
                .enumerate()
                .filter(|(_, (name, _))| *name == wanted);
            let each = of.map(|(i, (_, start))| {
                let end = phases.get(i + 1).map_or(now, |(_, next)| *next);
                end.duration_since(*start).as_secs_f64() * 1e3
            });
            each.sum()
        })
    }
}
