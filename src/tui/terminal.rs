//! The terminal: set up, and given back as it was, whatever ends the program.

use std::io::{self, Write};
use std::panic;
use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use ratatui::crossterm::cursor::{Hide, Show};
use ratatui::crossterm::event::{DisableMouseCapture, EnableMouseCapture};
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::crossterm::{execute, queue};

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
