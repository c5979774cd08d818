//! What a subcommand is given, and what becomes of its result.

use std::cell::RefCell;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::thread;

use serde_json::{Value, json};

use super::args::Global;
use super::interrupt::{self, LastWord};
use super::print::{self, FAILED, Style};
use super::progress::Progress;
use super::threads::Threads;
use crate::diag::{Diagnostic, Result, Warned};
use crate::io::{Disk, abandon_stages};
use crate::loom::Loom;
use crate::pipeline::{self, Capture, InputSpec};
use crate::task::{Observer, Task};
use crate::tui;
use crate::world::World;

/// One run of the command: its task, its threads, its way of speaking.
pub(super) struct Session {
    pub(super) task: Task,
    pub(super) progress: Arc<Progress>,
    pub(super) threads: Threads,
    pub(super) style: Style,
    pub(super) json: bool,
    quiet: bool,
    warnings: RefCell<Vec<Diagnostic>>,
    last_word: LastWord,
}

/// What a subcommand has done.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    /// The object for `--json`.
    pub(super) object: Value,
    /// The report for people.
    pub(super) report: String,
    /// Bytes that were asked for, such as a completion script: for stdout, unless `--json` is given.
    pub(super) product: Vec<u8>,
}

impl Session {
    /// Starts the workers and listens for signals.
    pub(super) fn begin(global: &Global) -> Self {
        let threads = Threads::choose(global.threads);
        threads.start();
        let progress = Arc::new(Progress::begin(global.quiet));
        let cancel = Arc::default();
        let last_word = LastWord::default();
        let bar = Arc::clone(&progress);
        let clean_up = move || {
            tui::restore();
            bar.end();
            abandon_stages();
        };
        interrupt::listen(
            Arc::clone(&cancel),
            last_word.clone(),
            global.json,
            clean_up,
        );
        Session {
            task: Task::observed(Arc::clone(&progress) as Arc<dyn Observer>).with_flag(cancel),
            progress,
            threads,
            style: Style::detect(),
            json: global.json,
            quiet: global.quiet,
            warnings: RefCell::default(),
            last_word,
        }
    }

    /// Keeps the warnings of a result for the end of the run, also if that is a failure.
    pub(super) fn keep<T>(&self, warned: Warned<T>) -> T {
        warned.unpack(&mut self.warnings.borrow_mut())
    }

    /// Keeps warnings for the end of the run.
    pub(super) fn warn(&self, warnings: &[Diagnostic]) {
        self.warnings.borrow_mut().extend_from_slice(warnings);
    }

    /// Prints one event as a line of JSON, where that was asked for.
    pub(super) fn event(&self, event: &Value) {
        if self.json {
            // Where stdout is closed, nobody reads events any more.
            let _ = print::object(event);
        }
    }

    /// The files of this machine.
    pub(super) fn world(&self) -> &dyn World {
        &Disk
    }

    /// Opens a capture and keeps its warnings.
    pub(super) fn open(&self, spec: &InputSpec) -> Result<Capture> {
        Ok(self.keep(pipeline::open(self.world(), spec, &self.task)?))
    }

    /// Opens a loom.
    pub(super) fn open_loom(&self, path: &Path) -> Result<Loom> {
        pipeline::open_loom(self.world(), path, &self.task)
    }

    /// Runs a subcommand and reports how it went.
    pub(super) fn run(self, command: impl FnOnce(&Session) -> Result<Outcome>) -> ExitCode {
        let result = command(&self);
        if !self.last_word.take() {
            // The process is being ended by a signal; its handler has the last word.
            loop {
                thread::park();
            }
        }
        self.progress.end();
        let result = result.and_then(|outcome| self.deliver(outcome));
        match result {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => self.fail(&error),
        }
    }

    fn deliver(&self, outcome: Outcome) -> Result<()> {
        let warnings = self.warnings.borrow();
        for warning in warnings.iter() {
            print::people(&self.style.diagnostic(warning));
        }
        if !self.quiet && !outcome.report.is_empty() {
            print::people(outcome.report.trim_end());
        }
        let written = if self.json {
            print::object(&with_warnings(outcome.object, &warnings))
        } else {
            print::product(&outcome.product)
        };
        written
            .map_err(|error| Diagnostic::error(format!("stdout cannot be written: {error}")).into())
    }

    fn fail(&self, error: &Diagnostic) -> ExitCode {
        let warnings = self.warnings.borrow();
        for warning in warnings.iter() {
            print::people(&self.style.diagnostic(warning));
        }
        print::people(&self.style.diagnostic(error));
        if self.json {
            // Where stdout is what failed, the message above has been given.
            let _ = print::object(&print::failure(error, &warnings));
        }
        ExitCode::from(FAILED)
    }
}

/// The object with its warnings, where it lists them anyway or there are some.
fn with_warnings(mut object: Value, warnings: &[Diagnostic]) -> Value {
    if let Value::Object(map) = &mut object
        && (map.contains_key("warnings") || !warnings.is_empty())
    {
        let warnings: Vec<Value> = warnings.iter().map(print::as_data).collect();
        map.insert("warnings".into(), json!(warnings));
    }
    object
}
