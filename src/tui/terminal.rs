//! The terminal: set up, and given back as it was, whatever ends the program.

use std::io::{self, Write};
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
#[cfg(unix)]
use std::time::{Duration, Instant};

use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::event::{self as keyboard, DisableMouseCapture, EnableMouseCapture};
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{execute, queue};

use super::graphics::{Answers, read_answers};
use super::typed::typed;

/// How long a terminal may take to answer; the last read can add a tenth of a second to half of it.
#[cfg(unix)]
const PATIENCE: Duration = Duration::from_millis(100);

/// Whether the terminal is ours.
static HELD: AtomicBool = AtomicBool::new(false);
static HOOK: Once = Once::new();

/// Takes the terminal: raw keys, mouse, a screen of its own, no cursor.
///
/// # Errors
/// There is no terminal.
pub(super) fn take() -> io::Result<()> {
    HOOK.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            // A worker's panic becomes an answer; the screen stays.
            let worker = thread::current()
                .name()
                .is_some_and(|name| name.starts_with("studio"));
            if !(worker && HELD.load(Ordering::SeqCst)) {
                restore();
                print(info);
            }
        }));
    });
    enable_raw_mode()?;
    HELD.store(true, Ordering::SeqCst);
    execute!(io::stdout(), EnterAlternateScreen, EnableMouseCapture, Hide)
}

/// Gives the terminal back, once; does nothing where it is not held. For any thread, at any time.
pub fn restore() {
    if HELD.swap(false, Ordering::SeqCst) {
        let mut out = io::stdout();
        // A terminal that is gone needs nothing back.
        let _ = queue!(out, DisableMouseCapture, LeaveAlternateScreen, Show);
        let _ = out.write_all(b"\x1b[0m");
        let _ = out.flush();
        let _ = disable_raw_mode();
    }
}

/// Stops the program as Ctrl-Z would, after giving the terminal back; takes it again when the program is
/// called back.
///
/// # Errors
/// The terminal is gone.
pub(super) fn suspend() -> io::Result<()> {
    restore();
    #[cfg(unix)]
    signal_hook::low_level::emulate_default_handler(signal_hook::consts::SIGTSTP)?;
    take()
}

/// Sends a frame's bytes, to be shown at once.
///
/// # Errors
/// The terminal is gone.
pub(super) fn send(bytes: &[u8]) -> io::Result<()> {
    let mut out = io::stdout().lock();
    out.write_all(b"\x1b[?2026h")?;
    out.write_all(bytes)?;
    out.write_all(b"\x1b[?2026l")?;
    out.flush()
}

/// Asks the terminal what it can show, if need be through tmux. One that says nothing, or not enough, is
/// waited for 200 ms.
pub fn ask(tmux: bool) -> Answers {
    ask_while_typed_at(tmux).0
}

/// The same, and what hands did meanwhile.
pub(super) fn ask_while_typed_at(tmux: bool) -> (Answers, Vec<keyboard::Event>) {
    // A terminal that cannot be asked has said nothing.
    let bytes = exchange(tmux).unwrap_or_default();
    let mut answers = read_answers(&bytes);
    if !tmux {
        answers.cell = answers.cell.or_else(window_cell);
    }
    (answers, typed(&bytes))
}

/// Columns and rows of a cell in pixels by the size of the window, where the system knows it: a little too
/// small rather than too large.
fn window_cell() -> Option<(u16, u16)> {
    let window = ratatui::crossterm::terminal::window_size().ok()?;
    let across = window.width.checked_div(window.columns)?;
    let down = window.height.checked_div(window.rows)?;
    (across > 0 && down > 0).then_some((across, down))
}

/// The bytes that came back.
#[cfg(unix)]
fn exchange(tmux: bool) -> io::Result<Vec<u8>> {
    use rustix::termios::{OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr};
    let (keyboard, held) = (io::stdin(), HELD.load(Ordering::SeqCst));
    let before = tcgetattr(&keyboard)?;
    let mut waiting = before.clone();
    waiting.make_raw();
    // A read ends after a tenth of a second with what there is.
    waiting.special_codes[SpecialCodeIndex::VMIN] = 0;
    waiting.special_codes[SpecialCodeIndex::VTIME] = 1;
    tcsetattr(&keyboard, OptionalActions::Now, &waiting)?;
    let bytes = collect(tmux);
    // Given back meanwhile, it is no longer ours to set.
    if HELD.load(Ordering::SeqCst) || !held {
        tcsetattr(&keyboard, OptionalActions::Now, &before)?;
    }
    bytes
}

#[cfg(unix)]
fn collect(tmux: bool) -> io::Result<Vec<u8>> {
    let mut out = io::stdout();
    out.write_all(super::graphics::query(tmux).as_bytes())?;
    out.flush()?;
    let (start, mut bytes) = (Instant::now(), Vec::new());
    let mut part = [0; 256];
    while start.elapsed() < PATIENCE && !super::graphics::complete(&bytes, tmux) {
        let length = rustix::io::read(io::stdin(), &mut part)?;
        bytes.extend_from_slice(&part[..length]);
    }
    Ok(bytes)
}

/// Other systems' terminals are not asked.
#[cfg(not(unix))]
fn exchange(_: bool) -> io::Result<Vec<u8>> {
    Ok(Vec::new())
}

#[cfg(test)]
mod tests {
    use std::io::Read;
    use std::num::NonZero;

    use portable_pty::{CommandBuilder, PtySize, native_pty_system};

    #[test]
    #[ignore = "run by the test below, in a terminal of its own"]
    fn a_program_that_panics() {
        super::take().expect("a terminal");
        panic!("as it was told to");
    }

    #[test]
    fn a_panic_gives_the_terminal_back_before_it_is_told() {
        let size = PtySize {
            rows: 30,
            cols: 100,
            ..PtySize::default()
        };
        let pair = native_pty_system().openpty(size).expect("a terminal");
        let itself = std::env::current_exe().expect("this program");
        let mut command = CommandBuilder::new(itself);
        let name = "tui::terminal::tests::a_program_that_panics";
        command.args(["--exact", name, "--ignored", "--nocapture"]);
        let mut child = pair.slave.spawn_command(command).expect("it starts");
        drop(pair.slave);
        let mut output = pair.master.try_clone_reader().expect("its output");
        let (mut bytes, mut part) = (Vec::new(), [0; 4096]);
        while let Ok(length @ 1..) = output.read(&mut part) {
            bytes.extend_from_slice(&part[..length]);
        }
        assert!(!child.wait().expect("its end").success());
        let cells = |count: u16| NonZero::new(count).expect("some");
        let mut parser = vt100::Parser::new(cells(size.rows), cells(size.cols), 0);
        let taken = bytes
            .windows(8)
            .position(|part| part == b"\x1b[?1049h")
            .expect("the terminal was taken");
        parser.process(&bytes[..taken + 8]);
        assert!(parser.screen().alternate_screen());
        parser.process(&bytes[taken + 8..]);
        let screen = parser.screen();
        assert!(!screen.alternate_screen() && !screen.hide_cursor());
        let mouse = screen.mouse_protocol_mode();
        assert_eq!(mouse, vt100::MouseProtocolMode::None);
        assert!(screen.contents().contains("as it was told to"));
    }
}
