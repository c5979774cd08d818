//! The real binary in a terminal of its own: what a person sees, and what is left behind.

use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use meshloom::demo::Demo;
use meshloom::format::loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::task::Task;
use portable_pty::{Child, CommandBuilder, MasterPty, PtySize, native_pty_system};
use tempfile::TempDir;

/// The longest that anything may take on a busy machine before the test gives up.
const PATIENCE: Duration = Duration::from_secs(60);

/// The program in a terminal.
struct Screen {
    child: Box<dyn Child + Send + Sync>,
    keyboard: Box<dyn Write + Send>,
    terminal: Box<dyn MasterPty + Send>,
    shown: Arc<Mutex<vt100::Parser>>,
}

impl Screen {
    fn open(folder: &Path, arguments: &[&str], (columns, rows): (u16, u16)) -> Self {
        let size = PtySize {
            rows,
            cols: columns,
            pixel_width: 0,
            pixel_height: 0,
        };
        let pair = native_pty_system().openpty(size).unwrap();
        let mut command = CommandBuilder::new(env!("CARGO_BIN_EXE_meshloom"));
        command.args(arguments);
        command.cwd(folder);
        command.env("TERM", "xterm-256color");
        command.env("COLORTERM", "truecolor");
        command.env_remove("NO_COLOR");
        command.env_remove("TMUX");
        let child = pair.slave.spawn_command(command).unwrap();
        drop(pair.slave);
        let shown = Arc::new(Mutex::new(vt100::Parser::new(
            cells(rows),
            cells(columns),
            0,
        )));
        let (mut output, parser) = (pair.master.try_clone_reader().unwrap(), Arc::clone(&shown));
        thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(length @ 1..) = output.read(&mut bytes) {
                parser.lock().unwrap().process(&bytes[..length]);
            }
        });
        let keyboard = pair.master.take_writer().unwrap();
        Screen {
            child,
            keyboard,
            terminal: pair.master,
            shown,
        }
    }

    fn press(&mut self, keys: &str) {
        self.keyboard.write_all(keys.as_bytes()).unwrap();
        self.keyboard.flush().unwrap();
    }

    fn text(&self) -> String {
        self.shown.lock().unwrap().screen().contents()
    }

    /// Waits until the screen shows `wanted`.
    fn wait(&mut self, wanted: &str) {
        self.wait_until(wanted, |screen| screen.contents().contains(wanted));
    }

    fn wait_until(&mut self, what: &str, holds: impl Fn(&vt100::Screen) -> bool) {
        let start = Instant::now();
        while !holds(self.shown.lock().unwrap().screen()) {
            let text = self.text();
            assert!(start.elapsed() < PATIENCE, "never shown: {what}\n{text}");
            thread::sleep(Duration::from_millis(5));
        }
    }

    fn resize(&mut self, columns: u16, rows: u16) {
        self.shown
            .lock()
            .unwrap()
            .screen_mut()
            .set_size(cells(rows), cells(columns));
        let size = PtySize {
            rows,
            cols: columns,
            pixel_width: 0,
            pixel_height: 0,
        };
        self.terminal.resize(size).unwrap();
    }

    /// Waits for the end; the terminal is as it was.
    fn ended(mut self) -> u32 {
        let start = Instant::now();
        let status = loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                break status;
            }
            assert!(start.elapsed() < PATIENCE, "does not end\n{}", self.text());
            thread::sleep(Duration::from_millis(5));
        };
        self.wait_until("the terminal as it was", |screen| {
            !screen.alternate_screen()
                && !screen.hide_cursor()
                && screen.mouse_protocol_mode() == vt100::MouseProtocolMode::None
        });
        status.exit_code()
    }
}

fn cells(count: u16) -> NonZero<u16> {
    NonZero::new(count).expect("a screen has cells")
}

fn capture() -> Sequence {
    let bar = Demo::find("bar").expect("there is a bar");
    let whole = (bar.generate)();
    let frames = whole.frames().min(12);
    whole.slice(0..frames)
}

/// A folder with `bar.loom`.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let options = FitOptions {
        left_out: false,
        ..FitOptions::default()
    };
    let fitted = fit(&capture(), &options, &Task::default()).unwrap().output;
    std::fs::write(
        folder.path().join("bar.loom"),
        loom::write(&fitted).unwrap(),
    )
    .unwrap();
    folder
}

#[test]
fn a_loom_is_opened_scrubbed_resized_and_left() {
    let folder = folder();
    let mut screen = Screen::open(folder.path(), &["open", "bar.loom"], (120, 36));
    screen.wait("frame 1.00/12");
    screen.wait("pose space");
    screen.press("\x1b[C");
    screen.wait("frame 2.00/12");
    screen.press("G");
    screen.wait("frame 12.00/12");
    screen.press("?");
    screen.wait("ten frames back");
    screen.press("\x1b");
    screen.wait_until("no help", |screen| {
        !screen.contents().contains("ten frames back")
    });
    screen.resize(80, 24);
    screen.wait_until("tabs", |screen| {
        screen.contents().starts_with(" pose space   time signals")
    });
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn the_mouse_scrubs_on_the_signals() {
    let folder = folder();
    let mut screen = Screen::open(folder.path(), &["open", "bar.loom"], (120, 36));
    screen.wait("frame 1.00/12");
    // The signals lie below; clicks count once their picture is there, which the cursor shows.
    screen.wait_until("the cursor of time", |screen| {
        screen
            .contents()
            .lines()
            .nth(28)
            .is_some_and(|row| row.matches('│').count() >= 3)
    });
    screen.press("\x1b[<0;60;30M\x1b[<0;60;30m");
    screen.wait_until("a later frame", |screen| {
        let text = screen.contents();
        text.contains("/12") && !text.contains("frame 1.00/12")
    });
    screen.press("\x03");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn frames_and_pictures_are_written_where_the_studio_was_opened() {
    let folder = folder();
    let mut screen = Screen::open(folder.path(), &["open", "bar.loom"], (120, 36));
    screen.wait("k=");
    screen.press("P");
    screen.wait("written: bar-pose-space-1");
    screen.press("x");
    screen.wait("written: bar-frames-1");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
    let frames = std::fs::read_dir(folder.path().join("bar-frames-1")).unwrap();
    assert_eq!(frames.count(), 12);
}

#[test]
fn a_demo_is_fitted_while_it_is_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::open(folder.path(), &["demo", "bar"], (100, 30));
    screen.wait("k=");
    screen.press(":");
    screen.wait("find an action");
    screen.press("last");
    screen.wait("to the last frame");
    screen.press("\r");
    screen.wait_until("the last frame", |screen| {
        !screen.contents().contains("frame 1.00/")
    });
    screen.press("q");
    assert_eq!(screen.ended(), 0);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn pictures_are_sent_to_a_terminal_that_is_said_to_show_them() {
    let folder = folder();
    let arguments = ["open", "bar.loom", "--graphics", "kitty"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    // What stands on the pictures is text; the pictures themselves this terminal passes over.
    screen.wait("f(t) =");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn doctor_says_what_was_asked_and_why_half_blocks_were_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::open(folder.path(), &["doctor"], (160, 60));
    screen.wait("nothing within 200 ms");
    screen.wait("\\u{1b}[c");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn a_missing_capture_is_said_and_nothing_else_happens() {
    let folder = tempfile::tempdir().unwrap();
    let mut screen = Screen::open(folder.path(), &["open", "gone.loom"], (80, 24));
    screen.wait("gone.loom");
    screen.wait("error");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[cfg(unix)]
#[test]
fn a_signal_ends_it_and_gives_the_terminal_back() {
    for signal in ["-TERM", "-HUP"] {
        let folder = folder();
        let mut screen = Screen::open(folder.path(), &["open", "bar.loom"], (80, 24));
        screen.wait("frame 1.00/12");
        let id = screen.child.process_id().unwrap().to_string();
        std::process::Command::new("kill")
            .args([signal, &id])
            .status()
            .unwrap();
        assert_eq!(screen.ended(), 1);
    }
}

#[test]
fn without_a_terminal_it_says_what_to_run_instead() {
    let folder = folder();
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_meshloom"))
        .args(["open", "bar.loom"])
        .current_dir(folder.path())
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("stdin is none") && said.contains("meshloom fit"),
        "{said}"
    );
}
