//! Workers: one writes and runs the recipe, one shows what is in hand, one waits for other people's
//! changes. Of questions that wait only the newest counts, and a newer one ends the run under way.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::mpsc::Sender;
use std::sync::{Arc, Condvar, Mutex, PoisonError};

use super::desk::{Desk, Kept};
use super::trial::{Pinning, Trials, Try};
use super::{Errand, Reply};
use crate::diag::{Diagnostic, Result};
use crate::pipeline::{KeyMotion, LoomValue, Value};
use crate::recipe::{Outcome, Param, Recipe};
use crate::task::{Cancelled, Task};
use crate::tui::event::{Answer, Event};
use crate::tui::posed;
use crate::tui::stage;
use crate::tui::state::{Content, Same};
use crate::tui::work::start;

/// A run that is wanted.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) struct Run {
    pub(in crate::tui) number: u64,
    pub(in crate::tui) recipe: Recipe,
    /// Parameters set besides.
    pub(in crate::tui) settings: Vec<(String, String)>,
    /// Whether its text is written first.
    pub(in crate::tui) save: bool,
}

/// What a run gave.
#[derive(Debug)]
pub(in crate::tui) struct Ran {
    /// What can be shown of it.
    pub(super) content: Option<Content>,
    /// What pins change; none where the loom's frames are not known.
    pub(super) pinning: Option<Pinning>,
    pub(super) params: Vec<Param>,
    /// The result, prints and warnings in words.
    pub(super) told: Vec<String>,
}

/// The newest of the questions that nobody has begun to answer.
struct Newest<T> {
    waiting: Mutex<Option<T>>,
    more: Condvar,
}

impl<T> Newest<T> {
    fn new() -> Self {
        Newest {
            waiting: Mutex::new(None),
            more: Condvar::new(),
        }
    }

    fn ask(&self, question: T) {
        *self.waiting.lock().unwrap_or_else(PoisonError::into_inner) = Some(question);
        self.more.notify_one();
    }

    fn next(&self) -> T {
        let mut waiting = self.waiting.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            if let Some(question) = waiting.take() {
                return question;
            }
            waiting = self
                .more
                .wait(waiting)
                .unwrap_or_else(PoisonError::into_inner);
        }
    }
}

/// The workers of the hands.
pub(in crate::tui) struct Workers {
    desk: Arc<dyn Desk>,
    runs: Arc<Newest<Run>>,
    tries: Arc<Newest<Try>>,
    /// The run under way.
    present: Arc<Mutex<Task>>,
}

impl Workers {
    /// Starts them. `task` gives the runs their progress; `end` is cancelled when the studio ends.
    pub(in crate::tui) fn start(
        desk: Arc<dyn Desk>,
        events: &Sender<Event>,
        task: Task,
        end: &Task,
    ) -> Self {
        let workers = Workers {
            desk,
            runs: Arc::new(Newest::new()),
            tries: Arc::new(Newest::new()),
            present: Arc::default(),
        };
        workers.start_runs(events.clone(), task);
        workers.start_tries(events.clone());
        workers.start_watch(events.clone(), end.clone());
        workers
    }

    /// Does what was asked for; the editor is the studio's, for it takes the terminal.
    pub(in crate::tui) fn carry_out(&self, errand: Errand) {
        match errand {
            Errand::Run(run) => {
                // In this order: the new run is not to be ended.
                self.cancel();
                self.runs.ask(run);
            }
            Errand::Try(question) => self.tries.ask(question),
            // What cannot be kept is lost with the terminal that would say so.
            Errand::Keep(text) => drop(self.desk.keep(text.as_deref())),
            Errand::Edit => {}
        }
    }

    /// Ends the run under way.
    pub(in crate::tui) fn cancel(&self) {
        let present = self.present.lock().unwrap_or_else(PoisonError::into_inner);
        present.cancel();
    }

    /// The user's editor, on the recipe.
    pub(in crate::tui) fn edit(&self) -> Result<PathBuf> {
        self.desk.edit()
    }

    fn start_runs(&self, events: Sender<Event>, task: Task) {
        let (desk, runs) = (Arc::clone(&self.desk), Arc::clone(&self.runs));
        let present = Arc::clone(&self.present);
        start("recipe", move || {
            let mut last = None;
            loop {
                let mut run = runs.next();
                let say = |reply| events.send(Event::Answer(Answer::Hands(reply))).is_ok();
                if run.save {
                    let written = write(&*desk, &run);
                    if let Reply::Written(path) = &written {
                        run.recipe.path.clone_from(path);
                    }
                    if !say(written) {
                        return;
                    }
                }
                let task = task.sibling();
                *present.lock().unwrap_or_else(PoisonError::into_inner) = task.clone();
                let ran = catch_unwind(AssertUnwindSafe(|| ran(&*desk, &run, &mut last, &task)));
                let ran = ran.unwrap_or_else(|_| {
                    Diagnostic::error("the recipe made the program fail: this is a mistake of ours")
                        .err()
                });
                if !say(Reply::Ran(run.number, ran)) {
                    return;
                }
            }
        });
    }

    fn start_tries(&self, events: Sender<Event>) {
        let tries = Arc::clone(&self.tries);
        start("hand", move || {
            let mut trials = Trials::default();
            loop {
                let question = tries.next();
                let number = question.number;
                let tried = catch_unwind(AssertUnwindSafe(|| trials.show(question)));
                let Ok(tried) = tried else {
                    trials = Trials::default();
                    continue;
                };
                let reply = Reply::Tried(number, tried);
                if events.send(Event::Answer(Answer::Hands(reply))).is_err() {
                    return;
                }
            }
        });
    }

    fn start_watch(&self, events: Sender<Event>, end: Task) {
        let desk = Arc::clone(&self.desk);
        start("watch", move || {
            loop {
                let reply = match desk.change(&end) {
                    Ok(Some(change)) => Reply::Changed(change),
                    Ok(None) => return,
                    Err(error) => {
                        let _ = events.send(Event::Answer(Answer::Failed(error)));
                        return;
                    }
                };
                if events.send(Event::Answer(Answer::Hands(reply))).is_err() {
                    return;
                }
            }
        });
    }
}

fn write(desk: &dyn Desk, run: &Run) -> Reply {
    match desk.write(&run.recipe.text) {
        Ok(Kept::At(path)) => Reply::Written(path),
        Ok(Kept::Overtaken(text)) => Reply::Overtaken(text),
        Err(error) => Reply::NotWritten(error),
    }
}

fn ran(
    desk: &dyn Desk,
    run: &Run,
    last: &mut Option<Arc<KeyMotion>>,
    task: &Task,
) -> Result<Box<Ran>> {
    let outcome = desk
        .run(&run.recipe, &run.settings, task)
        .map_err(|failure| failure.diagnostic)?;
    task.check().map_err(|Cancelled| Cancelled)?;
    let (loom, names) = (loom_of(&outcome), outcome.names.clone());
    let content = match (&outcome.value, &loom) {
        (_, Some(loom)) => Some(stage::loom(Arc::clone(&loom.loom.value))?),
        (Value::Sequence(frames), None) => {
            let frames = (*frames.value).clone();
            match outcome.completed.clone() {
                Some(completion) => posed::keys(completion, names, frames, last, task)?,
                None => posed::frames(frames, names, task)?,
            }
        }
        (Value::Statistics(found), None) => posed::poses(Arc::clone(&found.value), names)?,
        (Value::Shape(shape), None) => stage::frames(shape.value.sequence())?,
        _ => None,
    };
    Ok(Box::new(Ran {
        content,
        pinning: loom.and_then(|loom| {
            let fitted = Same(Arc::clone(&loom.source?.fitted));
            let edits = loom.edits;
            Some(Pinning { fitted, edits })
        }),
        told: told(&outcome),
        params: outcome.params,
    }))
}

/// The loom that a recipe gives, or whose frames it gives.
fn loom_of(outcome: &Outcome) -> Option<LoomValue> {
    match &outcome.value {
        Value::Loom(loom) => Some(loom.clone()),
        _ => outcome.sampled.clone(),
    }
}

fn told(outcome: &Outcome) -> Vec<String> {
    let mut told = vec![outcome.value.to_string()];
    if let (Value::Sequence(_), Some(loom)) = (&outcome.value, &outcome.sampled) {
        told[0] = format!("{}, from a loom of {} frames", told[0], loom.frames());
    }
    told.extend(outcome.messages.iter().cloned());
    let warnings = outcome.warnings.iter();
    told.extend(warnings.map(|warning| format!("warning: {}", warning.message)));
    told
}
