//! `meshloom watch --studio`: what lands is listed in the terminal while the recipe runs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Sender};
use std::thread::{self, JoinHandle};

use serde_json::Value as Json;

use super::open;
use super::session::Session;
use super::watch::frames_of;
use crate::diag::{Diagnostic, Result, Severity};
use crate::inbox::Inbox;
use crate::pipeline::InputSpec;
use crate::tui::{self, Landing, News, Part, Shown};

/// The list on the screen, on a thread of its own.
pub(super) struct Studio {
    news: Sender<News>,
    /// What was shown last, and what became of captures.
    shown: Vec<Landing>,
    notes: BTreeMap<String, String>,
    screen: JoinHandle<Result<()>>,
}

impl Studio {
    /// Refuses what does not go together with a list on the screen.
    pub(super) fn check(session: &Session) -> Result<()> {
        if session.json {
            return Diagnostic::error("--studio takes the screen that --json writes to")
                .hint("leave one of them out")
                .err();
        }
        open::refuse_pipes()
    }

    /// Opens the list for captures in `folder` whose results go to `results`.
    pub(super) fn open(folder: &Path, results: &Path, session: &Session) -> Self {
        let (news, hear) = mpsc::channel();
        session.progress.end();
        let (folder, results) = (folder.to_path_buf(), results.to_path_buf());
        let title = format!("{} -> {}", folder.display(), results.display());
        let (options, task) = (open::options(title, None), session.task.clone());
        let screen = thread::spawn(move || {
            let files = |landing: &Landing, part: Part| files(&folder, &results, landing, part);
            tui::watch(&options, &hear, &files, &task)
        });
        Studio {
            news,
            shown: Vec::new(),
            notes: BTreeMap::new(),
            screen,
        }
    }

    /// Whether the user has left.
    pub(super) fn is_closed(&self) -> bool {
        self.screen.is_finished()
    }

    /// Remembers how a run ended.
    pub(super) fn note(&mut self, name: &str, result: &Result<Json>) {
        let note = match result {
            Ok(report) => described(&report["result"]),
            Err(error) if error.severity == Severity::Cancelled => return,
            Err(error) => error.to_string(),
        };
        self.notes.insert(name.to_string(), note);
    }

    /// Shows where the captures stand.
    pub(super) fn show(&mut self, inbox: &Inbox) {
        let landings: Vec<Landing> = inbox
            .states()
            .map(|(name, state)| Landing {
                name: name.to_string(),
                state,
                note: self.notes.get(name).cloned().unwrap_or_default(),
                inputs: inbox
                    .capture(name)
                    .map_or_else(Vec::new, |capture| capture.inputs.clone()),
            })
            .collect();
        if landings != self.shown {
            self.shown.clone_from(&landings);
            // A list that is closed needs no news.
            let _ = self.news.send(News::Landings(landings));
        }
    }

    /// Waits until the list is closed; says first why nothing more lands.
    pub(super) fn end(self, watched: &Result<()>) -> Result<()> {
        if let Err(error) = watched {
            let _ = self.news.send(News::Ended(error.to_string()));
        }
        let stopped = || Diagnostic::error("the list of captures stopped unexpectedly").err();
        self.screen.join().unwrap_or_else(|_| stopped())
    }
}

/// A run's result in words.
fn described(result: &Json) -> String {
    let frames = result["frames"]
        .as_u64()
        .map(|frames| format!("{frames} frames"));
    let outputs = result["outputs"]
        .as_array()
        .map(|outputs| match outputs.len() {
            1 => "1 file".to_string(),
            count => format!("{count} files"),
        });
    let words: Vec<String> = frames.into_iter().chain(outputs).collect();
    words.join(", ")
}

/// What the studio opens of a capture.
fn files(folder: &Path, results: &Path, landing: &Landing, part: Part) -> Shown {
    let spec = match part {
        Part::Capture => frames_of(folder, &landing.inputs),
        Part::Results => InputSpec {
            paths: vec![PathBuf::from(results).join(&landing.name)],
            ..InputSpec::default()
        },
    };
    open::files(spec, landing.name.clone())
}
