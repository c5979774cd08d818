//! What the real binary sends to a terminal: how much, and that pictures in it can be decoded.

use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use icy_sixel::SixelImage;
use meshloom::demo::Demo;
use meshloom::format::loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::FrameSource;
use meshloom::task::Task;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};
use tempfile::TempDir;

/// The longest that anything may take on a busy machine before the test gives up.
const PATIENCE: Duration = Duration::from_secs(60);
/// Nothing more comes when nothing came for this long.
const QUIET: Duration = Duration::from_millis(400);
/// Columns and rows, with cells of 10 x 20 pixels: 1200 x 720 in all.
const SIZE: PtySize = PtySize {
    rows: 36,
    cols: 120,
    pixel_width: 1200,
    pixel_height: 720,
};

/// The program in a terminal that keeps every byte.
struct Terminal {
    child: Box<dyn Child + Send + Sync>,
    keyboard: Box<dyn Write + Send>,
    _pair: Box<dyn MasterPty + Send>,
    bytes: Arc<Mutex<Vec<u8>>>,
}

impl Terminal {
    fn open(folder: &Path, arguments: &[&str], variables: &[(&str, &str)]) -> Self {
        let pair = native_pty_system().openpty(SIZE).unwrap();
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_meshloom"));
        command.args(arguments);
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        command.env("COLORTERM", "truecolor");
        command.env_remove("NO_COLOR");
        command.env_remove("TMUX");
        for (name, value) in variables {
            command.env(name, value);
        }
        let child = pair.slave.spawn_command(command).unwrap();
        drop(pair.slave);
        let bytes: Arc<Mutex<Vec<u8>>> = Arc::default();
        let (mut output, store) = (pair.master.try_clone_reader().unwrap(), Arc::clone(&bytes));
        thread::spawn(move || {
            let mut part = [0; 65536];
            while let Ok(length @ 1..) = output.read(&mut part) {
                store.lock().unwrap().extend_from_slice(&part[..length]);
            }
        });
        Terminal {
            child,
            keyboard: pair.master.take_writer().unwrap(),
            _pair: pair.master,
            bytes,
        }
    }

    fn press(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).unwrap();
        self.keyboard.flush().unwrap();
    }

    fn sent(&self) -> usize {
        self.bytes.lock().unwrap().len()
    }

    /// Waits until `wanted` was sent.
    fn wait(&self, wanted: &str) {
        let start = Instant::now();
        let there = || String::from_utf8_lossy(&self.bytes.lock().unwrap()).contains(wanted);
        while !there() {
            assert!(start.elapsed() < PATIENCE, "never sent: {wanted}");
            thread::sleep(Duration::from_millis(5));
        }
    }

    /// Waits until the screen shows `wanted`.
    fn see(&self, wanted: &str) {
        let start = Instant::now();
        let size = |count: u16| NonZero::new(count).expect("a screen has cells");
        loop {
            let mut screen = vt100::Parser::new(size(SIZE.rows), size(SIZE.cols), 0);
            screen.process(&self.bytes.lock().unwrap());
            let text = screen.screen().contents();
            if text.contains(wanted) {
                return;
            }
            assert!(start.elapsed() < PATIENCE, "never shown: {wanted}\n{text}");
            thread::sleep(Duration::from_millis(20));
        }
    }

    /// Waits until nothing more comes.
    fn settle(&self) {
        let (mut last, mut since) = (self.sent(), Instant::now());
        while since.elapsed() < QUIET {
            thread::sleep(Duration::from_millis(10));
            if self.sent() != last {
                (last, since) = (self.sent(), Instant::now());
            }
        }
    }

    /// The bytes that keys cause.
    fn after(&mut self, keys: &str) -> Vec<u8> {
        let before = self.sent();
        self.press(keys);
        self.settle();
        self.bytes.lock().unwrap()[before..].to_vec()
    }

    fn quit(mut self) {
        self.press("q");
        let start = Instant::now();
        while self.child.try_wait().unwrap().is_none() {
            assert!(start.elapsed() < PATIENCE, "does not end");
            thread::sleep(Duration::from_millis(5));
        }
    }
}

/// A folder with the first frames of the built-in horse as `horse.loom`.
fn folder() -> TempDir {
    let horse = Demo::find("gallop").expect("there is a horse");
    let whole = horse.generate();
    let frames = whole.frames().min(24);
    let options = FitOptions {
        left_out: false,
        ..FitOptions::default()
    };
    let fitted = fit(&whole.slice(0..frames), &options, &Task::default()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let bytes = loom::write(&fitted.output).unwrap();
    std::fs::write(folder.path().join("horse.loom"), bytes).unwrap();
    folder
}

/// A horse on a terminal that is shown pictures so, all of them sent.
fn horse(folder: &TempDir, graphics: &str) -> Terminal {
    let arguments = ["open", "horse.loom", "--graphics", graphics];
    let terminal = Terminal::open(folder.path(), &arguments, &[]);
    terminal.wait("f(t)");
    terminal.settle();
    terminal
}

/// What a step may send, in bytes: all that changes, and the cursor of time alone.
fn steps_cost_at_most(graphics: &str, all: usize) {
    let folder = folder();
    let mut terminal = horse(&folder, graphics);
    for _ in 0..3 {
        let step = terminal.after("\x1b[C").len();
        assert!(0 < step && step <= all, "{graphics}: {step} bytes a step");
    }
    // The time signals fill the screen: only the cursor moves.
    terminal.after("\tf");
    for _ in 0..3 {
        let cursor = terminal.after("\x1b[C").len();
        let most = if graphics == "sixel" { all } else { 2_000 };
        assert!(
            0 < cursor && cursor <= most,
            "{graphics}: {cursor} bytes for the cursor"
        );
    }
    terminal.quit();
}

#[test]
fn a_step_in_blocks_is_small() {
    steps_cost_at_most("blocks", 12_000);
}

#[test]
fn a_step_in_kitty_is_small() {
    steps_cost_at_most("kitty", 60_000);
}

#[test]
fn sixel_pictures_decode_and_lie_in_their_cells() {
    let folder = folder();
    let mut terminal = horse(&folder, "sixel");
    let bytes = terminal.after("\x1b[C");
    let text = String::from_utf8(bytes).unwrap();
    let starts: Vec<usize> = text.match_indices("\x1bP").map(|(at, _)| at).collect();
    assert!(!starts.is_empty());
    for start in starts {
        let end = start + text[start..].find("\x1b\\").unwrap() + 2;
        let picture = SixelImage::decode(&text.as_bytes()[start..end]).unwrap();
        assert!(picture.width > 0 && picture.width.is_multiple_of(10));
        // Bands of six rows may reach below the last cell.
        let rest = picture.height % 20;
        assert!(picture.height > 0 && rest < 6 + 20 * usize::from(rest == 0));
    }
    terminal.quit();
}

#[test]
fn through_tmux_kitty_pictures_are_wrapped() {
    let folder = folder();
    let arguments = ["open", "horse.loom", "--graphics", "kitty"];
    let tmux = [("TMUX", "/tmp/tmux-0/default,1,0")];
    let terminal = Terminal::open(folder.path(), &arguments, &tmux);
    terminal.wait("\x1bPtmux;\x1b\x1b_Ga=T");
    terminal.wait("\u{10EEEE}");
    terminal.quit();
}

#[test]
fn answers_that_make_no_sense_are_no_answers_and_no_keys() {
    let folder = folder();
    let mut terminal = Terminal::open(folder.path(), &["open", "horse.loom"], &[]);
    terminal.wait("\x1b[c");
    terminal.press("\x1b]11;rgb:zz//\x1b\\\x1bP>|\x1b\\\x1b[6;0;99999t\x1b[?1;0;xS");
    terminal.wait("▄");
    terminal.settle();
    // Nothing of it was taken for q.
    assert!(terminal.child.try_wait().unwrap().is_none());
    terminal.quit();
}

#[test]
fn the_first_picture_waits_for_no_answer_and_a_late_one_is_heard() {
    let folder = folder();
    let mut terminal = Terminal::open(folder.path(), &["open", "horse.loom"], &[]);
    terminal.wait("\x1b[c");
    terminal.wait("▄");
    terminal.press("\x1b_Gi=31;OK\x1b\\\x1b[6;20;10t\x1b[?62c");
    terminal.wait("\x1b_Ga=T");
    terminal.settle();
    assert!(terminal.child.try_wait().unwrap().is_none());
    terminal.quit();
}

/// The last frame is a pipe: it is there once somebody writes it.
#[cfg(unix)]
#[test]
fn a_captures_first_frame_is_shown_while_the_rest_still_loads() {
    let folder = tempfile::tempdir().unwrap();
    let capture = folder.path().join("bend");
    std::fs::create_dir(&capture).unwrap();
    let mesh = |height: f64| {
        format!("v 0 0 0\nv 1 0 {height}\nv 1 1 0\nv 0 1 {height}\nf 1 2 3\nf 1 3 4\n")
    };
    for frame in 0..5 {
        let file = capture.join(format!("f{frame}.obj"));
        std::fs::write(file, mesh(0.1 * f64::from(frame))).unwrap();
    }
    let pipe = capture.join("f5.obj");
    let made = std::process::Command::new("mkfifo").arg(&pipe).status();
    assert!(made.unwrap().success());
    let terminal = Terminal::open(folder.path(), &["open", "bend"], &[]);
    // Half blocks: the mesh of the first frame, for nothing else can be known yet.
    terminal.wait("▄");
    terminal.see("frame 1.00/1 ");
    // Who reads it again finds a file.
    let file = folder.path().join("last");
    std::fs::write(&file, mesh(0.5)).unwrap();
    let mut writer = std::fs::OpenOptions::new().write(true).open(&pipe).unwrap();
    std::fs::rename(&file, &pipe).unwrap();
    writer.write_all(mesh(0.5).as_bytes()).unwrap();
    drop(writer);
    terminal.see("frame 1.00/6 ");
    terminal.quit();
}

#[test]
fn without_colours_none_are_sent() {
    let folder = folder();
    let none = [("NO_COLOR", "1")];
    let terminal = Terminal::open(folder.path(), &["open", "horse.loom"], &none);
    terminal.wait("f(t)");
    terminal.settle();
    let text = String::from_utf8_lossy(&terminal.bytes.lock().unwrap()).into_owned();
    assert!(!text.contains("38;2;") && !text.contains("38;5;") && !text.contains("48;"));
    terminal.quit();
}

#[test]
fn letters_alone_serve_a_font_without_anything_else() {
    let folder = folder();
    let terminal = horse(&folder, "ascii");
    let bytes = terminal.bytes.lock().unwrap().clone();
    let foreign: Vec<char> = String::from_utf8_lossy(&bytes)
        .chars()
        .filter(|letter| !letter.is_ascii())
        .collect();
    assert!(foreign.is_empty(), "{foreign:?}");
    terminal.quit();
}

#[test]
fn what_lands_in_a_watched_folder_is_listed_and_opened() {
    let folder = tempfile::tempdir().unwrap();
    let captures = folder.path().join("captures");
    std::fs::create_dir(&captures).unwrap();
    let arguments = [
        "watch",
        "captures",
        "--recipe",
        "contact-sheet",
        "-o",
        "out",
        "--studio",
        "--settle",
        "0.1",
    ];
    let mut terminal = Terminal::open(folder.path(), &arguments, &[]);
    terminal.see("nothing has landed yet");
    let capture = captures.join("bend");
    std::fs::create_dir(&capture).unwrap();
    for frame in 0..6 {
        let height = f64::from(frame) * 0.1;
        let mesh = format!("v 0 0 0\nv 1 0 {height}\nv 1 1 0\nv 0 1 {height}\nf 1 2 3\nf 1 3 4\n");
        std::fs::write(capture.join(format!("f{frame}.obj")), mesh).unwrap();
    }
    terminal.see("done      bend");
    terminal.press("\r");
    terminal.see("frame 1.00/6");
    terminal.press("q");
    terminal.see("done      bend");
    terminal.quit();
}
