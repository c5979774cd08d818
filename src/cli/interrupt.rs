//! Ctrl-C, SIGTERM and a lost connection: the work is asked to stop, and if it has not stopped shortly
//! after, the process ends all the same, with nothing half-written left behind.

use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use super::print;
use crate::diag::Diagnostic;
use crate::task::Cancelled;

/// How long the work may take to notice: with what remains to be cleaned up, below 100 ms.
const GRACE: Duration = Duration::from_millis(40);

/// Whoever takes this first prints the end of the run; the other stays silent.
#[derive(Debug, Clone, Default)]
pub(super) struct LastWord(Arc<AtomicBool>);

impl LastWord {
    /// True once.
    pub(super) fn take(&self) -> bool {
        !self.0.swap(true, Ordering::SeqCst)
    }
}

/// From now on a signal sets `cancel`, and after [`GRACE`] runs `clean_up` and exits with 1.
pub(super) fn listen(
    cancel: Arc<AtomicBool>,
    last_word: LastWord,
    as_json: bool,
    clean_up: impl Fn() + Send + 'static,
) {
    // Fails only where a handler is set already; then whoever set it decides.
    let _ = ctrlc::set_handler(move || {
        cancel.store(true, Ordering::Relaxed);
        thread::sleep(GRACE);
        if last_word.take() {
            clean_up();
            let error: Box<Diagnostic> = Cancelled.into();
            if as_json {
                let _ = print::object(&print::failure(&error, &[]));
            }
            print::people(&error.to_string());
            process::exit(i32::from(print::FAILED));
        }
    });
}
