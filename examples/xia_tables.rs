//! Tables 1 and 2 of Xia et al. 2019 on meshes of like sizes: the time of a shape with a ghost mesh of 2000
//! faces (t_ir: splines and decoding, t_ts: deformation transfer) and without (t_o), and of whole
//! sequences. Theirs ran on an i7-3770 with MKL; Table 2 has the numbers of Heeren et al. 2016 too.
//!
//! ```text
//! cargo run --release --example xia_tables
//! ```

#[path = "support/key_sets.rs"]
mod key_sets;
mod support;

use std::process::ExitCode;
use std::time::Instant;

use key_sets::{HORSE, demo_keys, faces};
use meshloom::diag::Result;
use meshloom::inbetween::{CompleteOptions, GhostOptions, GhostSize, Keys, Motion, complete};
use meshloom::task::Task;
use rayon::prelude::*;
use support::{Figure, table};

fn main() -> ExitCode {
    support::run("xia_tables", |figure| {
        table_1(figure)?;
        table_2(figure)
    })
}

/// A model of theirs and the keys that stand for it: demo, frames, subdivisions.
type Model = (&'static str, &'static str, &'static [usize], usize);

fn table_1(figure: &mut Figure) -> Result<()> {
    let models: [(Model, [f64; 3]); 6] = [
        (
            ("Cactus (10K)", "cactus", &[0, 1, 2], 0),
            [0.013, 0.014, 0.25],
        ),
        (
            ("Handstand (20K)", "gallop", &HORSE, 0),
            [0.016, 0.022, 0.60],
        ),
        (("Human (25K)", "face", &[0, 1, 4], 0), [0.021, 0.029, 0.65]),
        (
            ("Centaur (32K)", "cactus", &[0, 1, 2], 1),
            [0.025, 0.038, 0.75],
        ),
        (
            ("Elephant (80K)", "gallop", &HORSE, 1),
            [0.024, 0.053, 1.29],
        ),
        (
            ("Armadillo (233K)", "gallop", &HORSE, 2),
            [0.027, 0.46, 6.5],
        ),
    ];
    let (mut rows, mut faster) = (Vec::new(), true);
    for ((name, demo, chosen, times), paper) in models {
        let keys = demo_keys(demo, chosen, times);
        let here = shape_seconds(&keys)?;
        faster &= here.iter().zip(paper).all(|(here, paper)| *here < paper);
        let mut row = vec![
            name.to_string(),
            format!("{demo} ({}K)", faces(&keys) / 1000),
        ];
        row.extend(
            paper
                .iter()
                .zip(here)
                .map(|(paper, here)| format!("{paper} / {here:.4}")),
        );
        rows.push(row);
    }
    println!("Table 1: seconds a shape, paper / here");
    table(&["theirs", "ours", "t_ir", "t_ts", "t_o"], &rows);
    figure.goal("Table 1: every time is below the paper's", faster);
    Ok(())
}

/// t_ir, t_ts and t_o of one shape between the keys, the best of three.
fn shape_seconds(keys: &Keys) -> Result<[f64; 3]> {
    let behind = motion(keys, GhostSize::Faces(2000))?;
    let ghost = ghost_seconds(&behind, 1);
    let lifted = best(|| drop(behind.at(30.0)));
    let whole = motion(keys, GhostSize::Off)?;
    Ok([
        ghost,
        (lifted - ghost).max(0.0),
        best(|| drop(whole.at(30.0))),
    ])
}

/// Splines and decoding of the ghost alone, `shapes` times.
fn ghost_seconds(motion: &Motion, shapes: usize) -> f64 {
    let vertices = motion
        .report()
        .ghost
        .as_ref()
        .map_or(0, |ghost| ghost.vertices);
    let once = || {
        let mut coordinates = vec![0.0; motion.spline().width()];
        let mut positions = vec![0.0; 3 * vertices];
        motion.spline().evaluate(30.0, &mut coordinates);
        motion.space().decode(&coordinates, &mut positions);
    };
    best(|| (0..shapes).into_par_iter().for_each(|_| once()))
}

fn table_2(figure: &mut Figure) -> Result<()> {
    // model, K, faces kept; Heeren's t_ir, t_ts, t_o; theirs
    type Row = (Model, usize, usize, [&'static str; 3], [f64; 3]);
    let models: [Row; 4] = [
        (
            ("Cactus (20,.05)", "cactus", &[0, 1, 2], 0),
            20,
            490,
            ["1.7", "1.7", "83"],
            [0.16, 1.0, 4.35],
        ),
        (
            ("Cactus (170,.05)", "cactus", &[0, 1, 2], 0),
            170,
            490,
            ["22", "14", "762"],
            [0.31, 3.2, 23.9],
        ),
        (
            ("Horse (40,.10)", "gallop", &HORSE, 0),
            40,
            1856,
            ["22", "5", "238"],
            [0.35, 2.2, 11.4],
        ),
        (
            ("Armadillo (50,.006)", "gallop", &HORSE, 2),
            50,
            1780,
            ["80", "200", "/"],
            [1.34, 47.2, 258.6],
        ),
    ];
    let (mut rows, mut faster) = (Vec::new(), true);
    for ((name, demo, chosen, times), shapes, kept, heeren, paper) in models {
        let keys = demo_keys(demo, chosen, times);
        let behind = motion(&keys, GhostSize::Faces(kept))?;
        let ghost = ghost_seconds(&behind, shapes);
        let lifted = sequence_seconds(&behind, shapes);
        drop(behind);
        let whole = sequence_seconds(&motion(&keys, GhostSize::Off)?, shapes);
        let here = [ghost, (lifted - ghost).max(0.0), whole];
        faster &= here.iter().zip(paper).all(|(here, paper)| *here < paper);
        let mut row = vec![name.to_string()];
        let cells = heeren.iter().zip(paper).zip(here);
        row.extend(cells.map(|((heeren, paper), here)| format!("{heeren} / {paper} / {here:.3}")));
        rows.push(row);
    }
    println!(
        "\nTable 2: seconds a sequence of K shapes, share of vertices kept; Heeren 2016 / X19 / here"
    );
    table(&["(K, share)", "t_ir", "t_ts", "t_o"], &rows);
    figure.goal("Table 2: every time is below both", faster);
    Ok(())
}

/// All shapes of a sequence on all cores.
fn sequence_seconds(motion: &Motion, shapes: usize) -> f64 {
    let [start, end] = motion.ends();
    let clock = Instant::now();
    (0..shapes).into_par_iter().for_each(|i| {
        drop(motion.at(start + (end - start) * i as f64 / (shapes - 1) as f64));
    });
    clock.elapsed().as_secs_f64()
}

fn motion(keys: &Keys, size: GhostSize) -> Result<Motion> {
    let options = CompleteOptions {
        ghost: GhostOptions {
            size,
            ..GhostOptions::default()
        },
        ..CompleteOptions::default()
    };
    Ok(complete(keys, &options, &Task::default())?.output)
}

fn best(work: impl Fn()) -> f64 {
    let runs = (0..3).map(|_| {
        let clock = Instant::now();
        work();
        clock.elapsed().as_secs_f64()
    });
    runs.fold(f64::INFINITY, f64::min)
}
