//! The studio as it is felt: the real binary in a pseudo-terminal of 120 x 36, from a key to the last byte
//! that it sends for it. Prints a table; `cargo bench --bench studio`.

use std::io::{Read, Write};
use std::path::Path;
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};

/// A repaint is over when nothing was sent for this long.
const SILENCE: Duration = Duration::from_millis(80);
/// Keys of a row.
const KEYS: usize = 40;
/// What is asked of a terminal, at the end of the studio's questions, and an answer: cells of 10 x 20 pixels.
const ASKED: &[u8] = b"\x1b[c";
const ANSWER: &[u8] = b"\x1b[6;20;10t\x1b[?62c";
/// Bytes a second of a slow line.
const SLOW: usize = 256 * 1024;

/// Openings of a row.
const OPENINGS: usize = 15;
/// What pictures in half blocks consist of.
const BLOCKS: [&str; 4] = ["▀", "▄", "▌", "▐"];
/// How a kitty picture begins.
const KITTY: &str = "\x1b_Ga=T";
/// What a terminal that shows kitty pictures answers.
const KITTY_ANSWER: &[u8] = b"\x1b_Gi=31;OK\x1b\\\x1b[6;20;10t\x1b[?62c";

struct Studio {
    child: Box<dyn Child + Send + Sync>,
    keyboard: Box<dyn Write + Send>,
    sent: Receiver<(Instant, Vec<u8>)>,
    _terminal: Box<dyn MasterPty + Send>,
}

impl Studio {
    /// The studio on a terminal that has answered its questions.
    fn open(folder: &Path, arguments: &[&str], rate: Option<usize>) -> Self {
        let mut studio = Self::start(folder, arguments, rate);
        let mut asked = Vec::new();
        while !contains(&asked, ASKED) {
            let wait = Duration::from_secs(10);
            let (_, part) = studio.sent.recv_timeout(wait).expect("questions");
            asked.extend(part);
        }
        studio.keyboard.write_all(ANSWER).expect("an answer");
        studio
    }

    /// The studio on a terminal that passes on so many bytes a second.
    fn start(folder: &Path, arguments: &[&str], rate: Option<usize>) -> Self {
        let size = PtySize {
            rows: 36,
            cols: 120,
            pixel_width: 1200,
            pixel_height: 720,
        };
        let pair = native_pty_system().openpty(size).expect("a terminal");
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_meshloom"));
        command.args(arguments);
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        command.env("COLORTERM", "truecolor");
        command.env("MESHLOOM_CACHE", folder.join(".cache"));
        command.env_remove("NO_COLOR");
        command.env_remove("TMUX");
        let child = pair.slave.spawn_command(command).expect("it starts");
        let mut output = pair.master.try_clone_reader().expect("its output");
        let keyboard = pair.master.take_writer().expect("its keyboard");
        let (send, sent) = mpsc::channel();
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(length @ 1..) = output.read(&mut bytes) {
                if let Some(rate) = rate {
                    thread::sleep(Duration::from_secs_f64(length as f64 / rate as f64));
                }
                if send
                    .send((Instant::now(), bytes[..length].to_vec()))
                    .is_err()
                {
                    return;
                }
            }
        });
        Studio {
            child,
            keyboard,
            sent,
            _terminal: pair.master,
        }
    }

    fn press(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).expect("a key");
        self.keyboard.flush().expect("a key");
    }

    /// Waits until `wanted` was sent and then nothing more.
    fn wait(&self, wanted: &str) {
        let mut all = Vec::new();
        while !contains(&all, wanted.as_bytes()) {
            let (_, part) = self
                .sent
                .recv_timeout(Duration::from_secs(60))
                .expect("what is waited for");
            all.extend(part);
        }
        self.silence(Duration::from_millis(400));
    }

    /// Reads until nothing comes for `time`: when the last bytes came, and how many there were.
    fn silence(&self, time: Duration) -> (Option<Instant>, usize) {
        let (mut last, mut bytes) = (None, 0);
        loop {
            match self.sent.recv_timeout(time) {
                Ok((at, part)) => {
                    last = Some(at);
                    bytes += part.len();
                }
                Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => {
                    return (last, bytes);
                }
            }
        }
    }

    /// Milliseconds from a key to the last byte for it, and bytes; of many keys.
    fn measure(&mut self, keys: &[&str]) -> Vec<(f64, usize)> {
        let mut found = Vec::new();
        for index in 0..KEYS {
            let start = Instant::now();
            self.press(keys[index % keys.len()]);
            let (last, bytes) = self.silence(SILENCE);
            let took = last.map_or(0.0, |last| (last - start).as_secs_f64() * 1e3);
            found.push((took, bytes));
        }
        found
    }

    /// Seconds of processor time so far.
    fn busy(&self) -> Option<f64> {
        let stat = format!("/proc/{}/stat", self.child.process_id()?);
        let text = std::fs::read_to_string(stat).ok()?;
        let fields: Vec<&str> = text.rsplit(')').next()?.split_whitespace().collect();
        let ticks: f64 =
            fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
        Some(ticks / 100.0)
    }

    fn quit(mut self) {
        self.press("\x1b");
        // Together they would be another key.
        self.silence(SILENCE);
        self.press("q");
        let _ = self.child.wait();
    }
}

/// Milliseconds from the start of the program until it has sent one of these texts, in a terminal that answers
/// its questions so, or not at all.
fn until(folder: &Path, arguments: &[&str], answer: &[u8], wanted: &[&str]) -> f64 {
    let start = Instant::now();
    let mut studio = Studio::start(folder, arguments, None);
    let (mut all, mut asked) = (Vec::new(), false);
    let there = |all: &[u8]| wanted.iter().any(|text| contains(all, text.as_bytes()));
    let mut last = start;
    while !there(&all) {
        let wait = Duration::from_secs(60);
        let (at, part) = studio.sent.recv_timeout(wait).expect("what is waited for");
        (last, asked) = (at, {
            all.extend(part);
            if !asked && contains(&all, ASKED) {
                studio.keyboard.write_all(answer).expect("an answer");
                true
            } else {
                asked
            }
        });
    }
    let took = (last - start).as_secs_f64() * 1e3;
    studio.quit();
    took
}

/// How long the first picture takes.
fn openings(folder: &Path, capture: &str) {
    let loom = "first.loom";
    let fitted = std::process::Command::new(env!("CARGO_BIN_EXE_meshloom"))
        .args(["fit", capture, "-o", loom, "--quiet"])
        .current_dir(folder)
        .status();
    assert!(fitted.is_ok_and(|status| status.success()), "a loom");
    let rows: [(&str, &str, &[u8], &[&str]); 6] = [
        (
            "a loom opened, kitty: the first picture",
            loom,
            KITTY_ANSWER,
            &BLOCKS,
        ),
        ("the same: in pixels", loom, KITTY_ANSWER, &[KITTY]),
        (
            "a loom opened, a terminal without pictures",
            loom,
            ANSWER,
            &BLOCKS,
        ),
        ("a loom opened, a silent terminal", loom, b"", &BLOCKS),
        (
            "a capture opened: its first frame",
            capture,
            ANSWER,
            &BLOCKS,
        ),
        ("the same: fitted", capture, ANSWER, &["k="]),
    ];
    println!(
        "{:<44} {:>10} {:>10}",
        "from the start of the program", "median", "9 of 10"
    );
    for (name, input, answer, wanted) in rows {
        // A terminal that shows pixels at once may show no blocks before.
        let wanted: Vec<&str> = if answer == KITTY_ANSWER {
            wanted.iter().copied().chain([KITTY]).collect()
        } else {
            wanted.to_vec()
        };
        let once = |_| until(folder, &["open", input], answer, &wanted);
        let mut times: Vec<f64> = (0..OPENINGS).map(once).collect();
        times.sort_by(f64::total_cmp);
        let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize];
        println!("{name:<44} {:>7.1} ms {:>7.1} ms", at(0.5), at(0.9));
    }
}

fn contains(bytes: &[u8], wanted: &[u8]) -> bool {
    bytes.windows(wanted.len()).any(|part| part == wanted)
}

fn report(name: &str, found: &[(f64, usize)]) {
    let mut times: Vec<f64> = found.iter().map(|(time, _)| *time).collect();
    let mut bytes: Vec<usize> = found.iter().map(|(_, bytes)| *bytes).collect();
    times.sort_by(f64::total_cmp);
    bytes.sort_unstable();
    let at = |share: f64| ((times.len() - 1) as f64 * share) as usize;
    println!(
        "{name:<44} {:>7.1} ms {:>7.1} ms {:>8} bytes",
        times[at(0.5)],
        times[at(0.9)],
        bytes[at(0.5)]
    );
}

/// A galloping horse of 204 frames, fitted.
const RECIPE: &str = "fit(fit(demo(\"gallop\"), #{ tolerance: 0.02 }).resample(frames(204)))\n";

fn main() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("r.rhai"), RECIPE).expect("a recipe");
    let real = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data/horse-gallop");
    let real = real.to_string_lossy().into_owned();
    let demo = ["demo", "gallop"];
    let open = |graphics| ["open", real.as_str(), "--graphics", graphics];
    println!(
        "{:<44} {:>10} {:>10}",
        "from a key to its last byte", "median", "9 of 10"
    );
    for graphics in ["blocks", "kitty"] {
        let arguments = open(graphics);
        let there = Path::new(&real).exists();
        let arguments: &[&str] = if there { &arguments } else { &demo };
        let mut studio = Studio::open(folder.path(), arguments, None);
        studio.wait("k=");
        report(&format!("scrub, {graphics}"), &studio.measure(&["\x1b[C"]));
        studio.press("d");
        studio.silence(SILENCE);
        let moves = studio.measure(&["\x1b[C", "\x1b[D"]);
        report(&format!("a control point dragged, {graphics}"), &moves);
        studio.quit();
    }
    if !Path::new(&real).exists() {
        println!("skipped: no real captures");
        return;
    }
    openings(folder.path(), &real);
    for graphics in ["blocks", "kitty"] {
        let arguments = ["open", &real, "--recipe", "r.rhai", "--graphics", graphics];
        let mut studio = Studio::open(folder.path(), &arguments, None);
        studio.wait("k=");
        studio.press("i");
        studio.silence(SILENCE);
        let moves = studio.measure(&["\x1b[C", "\x1b[D"]);
        report(&format!("a pin dragged, n = 204, {graphics}"), &moves);
        studio.press("\x1b");
        studio.silence(SILENCE);
        // Small meshes behind the map are drawn last.
        studio.silence(Duration::from_secs(1));
        let (busy, start) = (studio.busy(), Instant::now());
        let (_, bytes) = studio.silence(Duration::from_secs(4));
        let share = studio
            .busy()
            .zip(busy)
            .map(|(b, a)| (b - a) / start.elapsed().as_secs_f64());
        let share = 100.0 * share.unwrap_or(f64::NAN);
        println!(
            "{:<44} {share:>7.2} %  of a core {bytes:>8} bytes",
            format!("idle, {graphics}")
        );
        studio.quit();
    }
    slow_link(folder.path(), &open("blocks"));
}

/// Keys at 30 a second over a slow line: how long after the last of them the last byte comes.
fn slow_link(folder: &Path, arguments: &[&str]) {
    let mut studio = Studio::open(folder, arguments, Some(SLOW));
    studio.wait("k=");
    for _ in 0..60 {
        studio.press("\x1b[C");
        thread::sleep(Duration::from_millis(33));
    }
    let start = Instant::now();
    let (last, _) = studio.silence(Duration::from_millis(500));
    let late = last.map_or(0.0, |last| {
        last.saturating_duration_since(start).as_secs_f64() * 1e3
    });
    println!(
        "{:<44} {late:>7.1} ms behind the last key",
        "256 KB/s, 30 keys a second, blocks"
    );
    studio.quit();
}
