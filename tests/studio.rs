//! The real binary in a terminal of its own: what a person sees, and what is left behind.

mod support;

use std::io::{Read, Write};
use std::num::NonZero;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use meshloom::demo::Demo;
use meshloom::format::loom;
use meshloom::io::Disk;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::pipeline::{Output, save};
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
    fn open(folder: &Path, arguments: &[&str], size: (u16, u16)) -> Self {
        Self::open_with(folder, arguments, size, "true")
    }

    /// With that as the user's editor.
    fn open_with(
        folder: &Path,
        arguments: &[&str],
        (columns, rows): (u16, u16),
        editor: &str,
    ) -> Self {
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
        command.env("MESHLOOM_CACHE", folder.join(".cache"));
        command.env("VISUAL", editor);
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
    let whole = bar.generate();
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
            .is_some_and(|row| row.matches('│').count() >= 5)
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
    let there = std::fs::read_dir(folder.path()).unwrap();
    let names = there.map(|entry| entry.unwrap().file_name());
    assert_eq!(names.collect::<Vec<_>>(), [".cache"]);
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

#[cfg(unix)]
#[test]
fn ctrl_z_gives_the_terminal_to_the_shell_and_fg_takes_it_again() {
    let folder = folder();
    let mut screen = Screen::open(folder.path(), &["open", "bar.loom"], (120, 36));
    screen.wait("frame 1.00/12");
    screen.press("\x1b[C");
    screen.wait("frame 2.00/12");
    screen.press("\x1a");
    screen.wait_until("the shell's screen", |screen| {
        !screen.alternate_screen() && !screen.hide_cursor()
    });
    let start = Instant::now();
    // It may not have stopped yet: what is not stopped need not go on.
    while !screen.shown.lock().unwrap().screen().alternate_screen() {
        assert!(start.elapsed() < PATIENCE, "does not come back");
        screen.signal("-CONT");
        thread::sleep(Duration::from_millis(20));
    }
    screen.wait("frame 2.00/12");
    screen.press("\x1b[C");
    screen.wait("frame 3.00/12");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
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
    // A keyboard alone is not enough.
    let pipe = "meshloom open bar.loom | cat > said; echo over";
    let pair = native_pty_system().openpty(PtySize::default()).unwrap();
    let mut command = CommandBuilder::new("sh");
    command.args([
        "-c",
        &pipe.replace("meshloom", env!("CARGO_BIN_EXE_meshloom")),
    ]);
    command.cwd(folder.path());
    pair.slave.spawn_command(command).unwrap();
    drop(pair.slave);
    let mut said = String::new();
    let _ = pair
        .master
        .try_clone_reader()
        .unwrap()
        .read_to_string(&mut said);
    assert!(
        said.contains("stdout is none") && said.contains("over"),
        "{said}"
    );
}

/// Waits until the file holds what is wanted.
fn wait_for_text(path: &Path, holds: impl Fn(&str) -> bool) -> String {
    let start = Instant::now();
    loop {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        if holds(&text) {
            return text;
        }
        assert!(start.elapsed() < PATIENCE, "never written: {text}");
        thread::sleep(Duration::from_millis(5));
    }
}

impl Screen {
    /// Where a symbol stands: column and row from 1, as the mouse tells them.
    fn find(&self, symbol: &str) -> Option<(u16, u16)> {
        let parser = self.shown.lock().unwrap();
        let (rows, columns) = parser.screen().size();
        let (rows, columns) = (rows.get(), columns.get());
        let cells = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
        let shows = |&(row, column): &(u16, u16)| {
            let cell = parser.screen().cell(row, column);
            cell.is_some_and(|cell| cell.contents() == symbol)
        };
        let (row, column) = cells.into_iter().find(shows)?;
        Some((column + 1, row + 1))
    }

    /// Waits until nothing has changed for a while: small meshes and plots come in after the text.
    fn settle(&self) {
        let start = Instant::now();
        let contents = || self.shown.lock().unwrap().screen().contents();
        let mut last = (contents(), Instant::now());
        while last.1.elapsed() < Duration::from_millis(400) {
            thread::sleep(Duration::from_millis(20));
            let now = contents();
            if now != last.0 {
                last = (now, Instant::now());
            }
            assert!(start.elapsed() < PATIENCE, "never still");
        }
    }

    /// Drags the last control point by columns and rows.
    fn drag_last_control(&mut self, columns: i16, rows: i16) {
        let at = self.last_control();
        let to = (
            at.0.saturating_add_signed(columns),
            at.1.saturating_add_signed(rows),
        );
        self.drag(at, to);
    }

    /// The left button goes down at one place, moves to another, and goes up.
    fn drag(&mut self, from: (u16, u16), to: (u16, u16)) {
        let (a, b) = (from, to);
        self.press(&format!("\x1b[<0;{};{}M", a.0, a.1));
        self.press(&format!("\x1b[<32;{};{}M", b.0, b.1));
        self.press(&format!("\x1b[<0;{};{}m", b.0, b.1));
    }

    /// Where the control point nearest to the cursor stands: it is taken in hand and put back.
    fn last_control(&mut self) -> (u16, u16) {
        self.press("d");
        self.wait("◈");
        let at = self.find("◈").unwrap();
        self.press("\x1b");
        self.wait_until("nothing in hand", |screen| !screen.contents().contains('◈'));
        at
    }

    /// Where the lines of key poses stand on the axis of time, in its first row that shows any; the
    /// cursor hides one.
    fn line_of_keys(&self) -> Vec<(u16, u16)> {
        let parser = self.shown.lock().unwrap();
        let (rows, columns) = parser.screen().size();
        let row = |row: u16| -> Vec<(u16, u16)> {
            let line = |column: &u16| {
                let cell = parser.screen().cell(row, *column);
                cell.is_some_and(|cell| cell.contents() == "┊")
            };
            let columns = (0..columns.get()).filter(line);
            columns.map(|column| (column + 1, row + 1)).collect()
        };
        let mut rows = (0..rows.get()).map(row);
        let found = rows.find(|lines| !lines.is_empty());
        found.unwrap_or_default()
    }

    fn signal(&self, signal: &str) {
        let id = self.child.process_id().unwrap().to_string();
        let kill = std::process::Command::new("kill")
            .args([signal, &id])
            .status();
        assert!(kill.unwrap().success());
    }
}

const OURS: &str = "// ours\nload(\"bar.loom\")\n";

/// A folder with `bar.loom` and a recipe on it.
fn kitchen(recipe: &str) -> TempDir {
    let folder = folder();
    std::fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    folder
}

#[test]
fn a_control_point_dragged_is_a_line_and_dragged_again_the_same_line() {
    let folder = kitchen(OURS);
    let file = folder.path().join("r.rhai");
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a loom of 12 frames");
    screen.press("G");
    screen.wait("frame 12.00/12");
    screen.settle();
    screen.drag_last_control(-4, 2);
    let once = wait_for_text(&file, |text| text.contains(".move_control("));
    assert!(
        once.starts_with("// ours\nload(\"bar.loom\")\n    .move_control("),
        "{once}"
    );
    screen.wait(".move_control(");
    screen.wait_until("the run's end", |screen| {
        !screen.contents().contains("running")
    });
    // The map has been drawn anew around the motion.
    screen.settle();
    screen.drag_last_control(-3, 0);
    let twice = wait_for_text(&file, |text| text != once);
    assert_eq!(twice.matches(".move_control(").count(), 1, "{twice}");
    assert_eq!(twice.lines().count(), 3);
    screen.press("u");
    wait_for_text(&file, |text| text == once);
    screen.press("u");
    wait_for_text(&file, |text| text == OURS);
    screen.press("\x12");
    wait_for_text(&file, |text| text == once);
    screen.press("x");
    screen.wait("written: bar-frames-1");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn a_recipe_saved_elsewhere_runs_again_and_an_error_keeps_the_last_result() {
    let folder = kitchen(OURS);
    let file = folder.path().join("r.rhai");
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a loom of 12 frames");
    std::fs::write(&file, "load(\"bar.loom\").hold(3, 5)\n").unwrap();
    screen.wait("a loom of 17 frames");
    screen.wait("/17");
    std::fs::write(&file, "load(\"bar.loom\")\n    .revers()\n").unwrap();
    screen.wait("no function `revers`");
    screen.wait("did you mean `reverse`?");
    assert!(screen.text().contains("/17"), "{}", screen.text());
    // Editors that rename: a new file in the old one's place.
    let staged = folder.path().join("staged");
    std::fs::write(&staged, "load(\"bar.loom\").hold(3, 7)\n").unwrap();
    std::fs::rename(&staged, &file).unwrap();
    screen.wait("a loom of 19 frames");
    screen.wait_until("no error", |screen| {
        !screen.contents().contains("no function")
    });
    screen.press("u");
    wait_for_text(&file, |text| text.contains("revers()"));
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn a_module_that_is_saved_runs_the_recipe_again() {
    let folder = kitchen("import \"steps\" as steps;\nload(\"bar.loom\").hold(3, steps::many())\n");
    let module = folder.path().join("steps.rhai");
    std::fs::write(&module, "fn many() { 2 }\n").unwrap();
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a loom of 14 frames");
    std::fs::write(&module, "fn many() { 4 }\n").unwrap();
    screen.wait("a loom of 16 frames");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn a_capture_gets_its_recipe_beside_it_with_the_first_gesture() {
    let folder = tempfile::tempdir().unwrap();
    support::capture::sheet(5, 12).write_objs(&folder.path().join("sheet"));
    let file = folder.path().join("sheet.rhai");
    let mut screen = Screen::open(folder.path(), &["open", "sheet"], (120, 36));
    screen.wait("not saved yet");
    screen.wait("a loom of 12 frames");
    assert!(!file.exists());
    screen.press("i");
    screen.wait("pin of frame 1");
    screen.press("\x1b[1;2C\r");
    let pinned = wait_for_text(&file, |text| !text.is_empty());
    assert!(
        pinned.starts_with("fit(input())\n    .pin(1, ["),
        "{pinned}"
    );
    screen.wait("recipe: sheet.rhai");
    screen.wait_until("the run's end", |screen| {
        !screen.contents().contains("running")
    });
    screen.press("I");
    wait_for_text(&file, |text| text == "fit(input())\n");
    screen.press("\x1b[C\x1b[C[\x1b[C\x1b[C\x1b[C]T");
    wait_for_text(&file, |text| text == "fit(input())\n    .trim(3, 6)\n");
    screen.wait("a loom of 4 frames");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn a_recipe_that_does_not_parse_at_start_is_shown_and_mended() {
    let folder = kitchen("// one\nload(\"bar.loom\"\n");
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("load(\"bar.loom\"");
    screen.wait("^");
    screen.wait("frame 1.00/12");
    std::fs::write(folder.path().join("r.rhai"), OURS).unwrap();
    screen.wait("a loom of 12 frames");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn sliders_change_the_recipe() {
    let folder =
        kitchen("let still = param(\"still\", 2, 0, 8);\nload(\"bar.loom\").hold(3, still)\n");
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a loom of 14 frames");
    screen.press("\t\t\t\x1b[C");
    wait_for_text(&folder.path().join("r.rhai"), |text| {
        text.contains("\"still\", 3, 0, 8")
    });
    screen.wait("a loom of 15 frames");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[cfg(unix)]
#[test]
fn the_recipe_is_edited_in_the_users_editor() {
    let folder = kitchen(OURS);
    let editor = "printf 'load(\"bar.loom\").hold(3, 8)' >";
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open_with(folder.path(), &arguments, (120, 36), editor);
    screen.wait("a loom of 12 frames");
    screen.press("e");
    screen.wait("a loom of 20 frames");
    assert!(screen.shown.lock().unwrap().screen().alternate_screen());
    screen.press("G");
    screen.wait("frame 20.00/20");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[cfg(unix)]
#[test]
fn what_was_in_hand_when_the_connection_was_lost_is_offered_again() {
    let folder = kitchen(OURS);
    let arguments = ["open", "bar.loom", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a loom of 12 frames");
    screen.press("d\x1b[C");
    screen.wait("control point ");
    screen.signal("-HUP");
    assert_eq!(screen.ended(), 1);
    let file = folder.path().join("r.rhai");
    assert_eq!(std::fs::read_to_string(&file).unwrap(), OURS);
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("a lost session left gestures");
    screen.press("y");
    wait_for_text(&file, |text| text.contains(".move_control("));
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

/// A folder with three poses of a bar, far from each other, and a recipe.
fn poses(recipe: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let bar = Demo::find("bar").expect("there is a bar").generate();
    let some = [0, 30, 55].map(|frame| bar.frame(frame % bar.frames()).to_vec());
    let keys = Sequence::new(Arc::clone(bar.topology()), some.concat(), None);
    std::fs::create_dir(folder.path().join("keys")).unwrap();
    let output = Output::from(folder.path().join("keys/####.obj"));
    save(&Disk, &keys, &output, &Task::default()).unwrap();
    if !recipe.is_empty() {
        std::fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    }
    folder
}

const KEYED: &str = "complete(input(), #{ times: [1, 25, 49] }) // ours\n";

#[test]
fn a_key_pose_is_moved_in_time_by_the_mouse_and_undone() {
    let folder = poses(KEYED);
    let file = folder.path().join("r.rhai");
    let arguments = ["open", "keys", "--recipe", "r.rhai"];
    let mut screen = Screen::open(folder.path(), &arguments, (120, 36));
    screen.wait("3 keys in patch-lri");
    screen.wait("keys in time");
    screen.settle();
    // The second key is chosen, and its line is dragged.
    screen.press("nn");
    screen.wait("frame 25.00/49");
    screen.settle();
    let last = screen.line_of_keys().pop().expect("lines of keys");
    screen.drag(last, last);
    screen.wait("frame 49.00/49");
    screen.settle();
    let lines = screen.line_of_keys();
    assert_eq!(lines.len(), 2, "{}", screen.text());
    let second = lines[1];
    screen.drag(second, (second.0 + 6, second.1));
    let moved = wait_for_text(&file, |text| text != KEYED);
    let time = moved
        .strip_prefix("complete(input(), #{ times: [1, ")
        .unwrap();
    let time = time.strip_suffix(", 49] }) // ours\n").unwrap();
    let time: f64 = time.parse().unwrap();
    assert!(time > 25.0 && time < 49.0 && time.fract() == 0.0, "{moved}");
    screen.wait(&format!("[1, {time}, 49]"));
    screen.press("u");
    wait_for_text(&file, |text| text == KEYED);
    screen.wait("[1, 25, 49]");
    screen.wait_until("the run's end", |screen| {
        !screen.contents().contains("running")
    });
    // The same by keys, and a handle.
    screen.press("t\x1b[C\x1b[C\r");
    wait_for_text(&file, |text| text == KEYED.replace("25", "27"));
    screen.press("d\x1b[A\x1b[A\r");
    let turned = KEYED.replace("25, 49]", "27, 49], tension: [0, 0.1, 0]");
    wait_for_text(&file, |text| text == turned);
    // A loom of it, edited as any capture is.
    screen.press("F");
    wait_for_text(&file, |text| text.starts_with("fit(complete("));
    screen.wait("a loom of 49 frames");
    screen.press("H");
    wait_for_text(&file, |text| text.contains("\n    .hold("));
    screen.press("q");
    assert_eq!(screen.ended(), 0);
}

#[test]
fn poses_open_as_keys_and_turn_into_their_statistics() {
    let folder = poses("");
    let mut screen = Screen::open(folder.path(), &["open", "keys"], (120, 36));
    screen.wait("complete(input())");
    screen.wait("3 keys in patch-lri");
    screen.press("A");
    screen.wait("pca(input())");
    screen.wait("pose 1 of 3 0001 in gradients");
    screen.wait("poses by their first modes");
    screen.press("\x1b[C");
    screen.wait("pose 2 of 3");
    screen.press("q");
    assert_eq!(screen.ended(), 0);
    let text = std::fs::read_to_string(folder.path().join("keys.rhai")).unwrap();
    assert_eq!(text, "pca(input())\n");
}
