//! Reading and writing about 26 MB of OBJ frames, beside what the same bytes cost when nothing is done
//! with them: `cargo bench --bench io`. Both sides run in turn, the median of each is shown.

use std::fs;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use meshloom::io::Disk;
use meshloom::mesh::{Sequence, Topology};
use meshloom::pipeline::{InputSpec, Output, open, save};
use meshloom::task::Task;
use rayon::prelude::*;

const RUNS: usize = 15;
const FRAMES: usize = 48;
const SIDE: usize = 92; // 8464 vertices, 16562 triangles: the size of a captured animal

/// A sheet that waves.
fn sheet() -> Sequence {
    let corner = |x: usize, y: usize| (y * SIDE + x) as u32;
    let mut triangles = Vec::new();
    for (x, y) in (0..SIDE - 1).flat_map(|y| (0..SIDE - 1).map(move |x| (x, y))) {
        let [a, b, c, d] =
            [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)].map(|(x, y)| corner(x, y));
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let topology = Topology::from_triangles(SIDE * SIDE, &triangles).expect("a sheet");
    let mut positions = Vec::new();
    for frame in 0..FRAMES {
        for (x, y) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y))) {
            let (u, v) = (x as f32 / SIDE as f32, y as f32 / SIDE as f32);
            let wave = (7.0 * u + 3.0 * v + 0.13 * frame as f32).sin();
            positions.extend([u + 0.01 * wave, v - 0.02 * wave, 0.1 * wave]);
        }
    }
    Sequence::new(Arc::new(topology), positions, None)
}

fn seconds(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Runs both in turn, each after its preparation, and prints their medians.
fn compare(
    name: &str,
    megabytes: f64,
    prepare: impl Fn(),
    work: impl Fn(),
    prepare_bytes: impl Fn(),
    bytes_alone: impl Fn(),
) {
    let (mut times, mut bases) = (Vec::new(), Vec::new());
    for _ in 0..RUNS {
        prepare();
        times.push(seconds(&work));
        prepare_bytes();
        bases.push(seconds(&bytes_alone));
    }
    let (time, base) = (median(times), median(bases));
    println!(
        "{name:<12} {megabytes:5.1} MB  {:7.2} ms  {:6.0} MB/s    the bytes alone {:7.2} ms    ratio {:5.2}",
        1e3 * time,
        megabytes / time,
        1e3 * base,
        time / base
    );
}

fn files_of(folder: &Path) -> Vec<PathBuf> {
    let listed = fs::read_dir(folder).expect("a folder");
    listed
        .map(|entry| entry.expect("an entry").path())
        .collect()
}

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sequence = sheet();
    let task = Task::default();
    for ending in ["obj"] {
        let out = folder.path().join(ending);
        let output = Output::from(out.join(format!("frame_####.{ending}")));
        save(&Disk, &sequence, &output, &task).expect("written");
        let files = files_of(&out);
        let contents: Vec<Vec<u8>> = files
            .iter()
            .map(|file| fs::read(file).expect("read"))
            .collect();
        let megabytes = contents.iter().map(Vec::len).sum::<usize>() as f64 / 1e6;
        compare(
            &format!("read {ending}"),
            megabytes,
            || {},
            || {
                let opened = open(&Disk, &InputSpec::new(&out), &task).expect("read");
                let read = opened.output.content.frames();
                assert_eq!(read.frames(), FRAMES);
            },
            || {},
            || {
                files.par_iter().for_each(|file| {
                    black_box(fs::read(file).expect("read"));
                });
            },
        );
        for (name, again) in [("write", false), ("rewrite", true)] {
            let (ours, theirs) = (folder.path().join("ours"), folder.path().join("theirs"));
            let clear = |folder: &Path| {
                if !again {
                    let _ = fs::remove_dir_all(folder);
                }
            };
            compare(
                &format!("{name} {ending}"),
                megabytes,
                || clear(&ours),
                || {
                    let output = Output::from(ours.join(format!("frame_####.{ending}")));
                    save(&Disk, &sequence, &output, &task).expect("written");
                },
                || {
                    clear(&theirs);
                    fs::create_dir_all(&theirs).expect("created");
                },
                || {
                    contents.par_iter().enumerate().for_each(|(i, bytes)| {
                        let staged = theirs.join(format!(".{i}"));
                        fs::write(&staged, bytes).expect("written");
                        fs::rename(staged, theirs.join(i.to_string())).expect("renamed");
                    });
                },
            );
        }
    }
}
