//! The whole command, as a user waits for it: `cargo bench --bench command`.
//!
//! The built-in gallop as one OBJ file a frame (about 30 MB) is fitted, sampled and compared by the real
//! binary. Beside each time stands its ratio to reading the same bytes and doing nothing with them.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use meshloom::demo::Demo;
use meshloom::io::Disk;
use meshloom::mesh::FrameSource;
use meshloom::pipeline::{Output, save};
use meshloom::task::Task;

const RUNS: usize = 5;

fn main() {
    let folder = tempfile::tempdir().expect("a folder for the frames");
    let demo = Demo::find("gallop").expect("a built-in capture");
    let capture = demo.generate();
    let frames = folder.path().join("frames");
    let written = save(
        &Disk,
        &capture,
        &Output::from(frames.join("frame_####.obj")),
        &Task::default(),
    );
    let files = written.expect("the frames are written").outputs;
    let read = || {
        files
            .iter()
            .map(|file| std::fs::read(file).map_or(0, |bytes| bytes.len()))
            .sum::<usize>()
    };
    let bytes = read();
    let raw = median(|| {
        let begun = Instant::now();
        assert_eq!(read(), bytes);
        begun.elapsed()
    });
    let megabytes = |bytes: usize| bytes as f64 / 1e6;
    let held = 12 * capture.topology().vertices() * capture.frames();
    println!(
        "{} frames, {:.1} MB of OBJ, {:.1} MB as 32-bit floats",
        capture.frames(),
        megabytes(bytes),
        megabytes(held)
    );
    println!("reading the bytes alone: {:.1} ms", 1e3 * raw.as_secs_f64());
    for arguments in [
        "info frames",
        "fit frames -o ch12.loom --method ch12 -k 48 -l 36 -m 16",
        "fit frames -o tolerance.loom --method ch12 --tolerance 0.02",
        "fit frames -o ordered.loom",
        "sample ch12.loom -o back/frame_####.obj",
        "compare frames back",
    ] {
        let mut peak = 0;
        let time = median(|| {
            let (time, bytes) = run(folder.path(), arguments);
            peak = peak.max(bytes);
            time
        });
        let ratio = time.as_secs_f64() / raw.as_secs_f64();
        println!(
            "{:>7.1} ms {ratio:>6.1} x {:>7.1} MB at most   meshloom {arguments}",
            1e3 * time.as_secs_f64(),
            megabytes(peak)
        );
    }
}

fn median(mut time: impl FnMut() -> Duration) -> Duration {
    let mut times: Vec<Duration> = (0..RUNS).map(|_| time()).collect();
    times.sort();
    times[RUNS / 2]
}

/// Runs the binary to its end: how long it took and the most memory it held.
fn run(folder: &Path, arguments: &str) -> (Duration, usize) {
    let begun = Instant::now();
    let mut command = Command::new(env!("CARGO_BIN_EXE_meshloom"));
    command
        .current_dir(folder)
        .args(arguments.split(' '))
        .arg("--quiet")
        .stdout(Stdio::null());
    let mut child = command.spawn().expect("the binary starts");
    let status = format!("/proc/{}/status", child.id());
    let mut peak = 0;
    loop {
        let held = std::fs::read_to_string(&status).ok().and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
            line.trim().trim_end_matches(" kB").parse::<usize>().ok()
        });
        peak = peak.max(1024 * held.unwrap_or(0));
        if let Some(status) = child.try_wait().expect("the child is ours") {
            assert!(status.success(), "meshloom {arguments}");
            return (begun.elapsed(), peak);
        }
        std::thread::sleep(Duration::from_micros(500));
    }
}
