//! The watched folder as a pure state machine: listings and times go in, work to do comes out. It opens
//! no file, starts no thread and asks no clock; times are durations since any fixed moment.
//!
//! A capture settles (its files keep size and time for a while, or its `.done` file appears), is queued in
//! order of arrival, processed, and remembered in the journal under the hash of its inputs and of the
//! recipe. It is processed again when either changes, and only then.

mod captures;

use std::collections::{BTreeMap, VecDeque};
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use captures::{Capture, Listed, captures};

/// How the last run of a capture ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// Its outputs are in place.
    Done,
    /// It failed; an error file says why.
    Failed,
}

/// One line of the journal.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Entry {
    /// The capture.
    pub capture: String,
    /// The fingerprint of its inputs.
    pub inputs: String,
    /// The hash of the recipe with its parameters.
    pub recipe: String,
    /// How it ended.
    pub ending: Ending,
}

/// Where a capture stands, for people.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum State {
    /// Its files are still changing, or have only just stopped.
    Settling,
    /// It waits for a worker.
    Queued,
    /// It is being processed.
    Running,
    /// Its outputs are in place.
    Done,
    /// It failed and waits for its inputs or the recipe to change.
    Failed,
}

/// Something to do now.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// The capture's name.
    pub name: String,
    /// What it consists of.
    pub capture: Capture,
    /// The fingerprint it is processed under.
    pub inputs: String,
    /// The recipe's hash it is processed under.
    pub recipe: String,
}

/// How the inbox behaves.
#[derive(Debug, Clone)]
pub struct Rules {
    /// How long files must keep size and time.
    pub settle: Duration,
    /// How many captures are processed at once, at least 1.
    pub workers: usize,
}

#[derive(Debug)]
struct Seen {
    capture: Capture,
    fingerprint: String,
    since: Duration,
    /// Whether it waits in the queue.
    queued: bool,
}

impl Seen {
    fn is_settled(&self, now: Duration, settle: Duration) -> bool {
        self.capture.declared_done || now.saturating_sub(self.since) >= settle
    }
}

/// The state of a watched folder.
#[derive(Debug)]
pub struct Inbox {
    rules: Rules,
    recipe: String,
    seen: BTreeMap<String, Seen>,
    queue: VecDeque<String>,
    running: BTreeMap<String, (String, String)>,
    ended: BTreeMap<String, Entry>,
}

impl Inbox {
    /// An inbox that knows what the journal says was done before. Later lines of a journal win.
    pub fn new(
        rules: Rules,
        recipe: impl Into<String>,
        journal: impl IntoIterator<Item = Entry>,
    ) -> Self {
        let ended = journal
            .into_iter()
            .map(|entry| (entry.capture.clone(), entry))
            .collect();
        Inbox {
            rules,
            recipe: recipe.into(),
            seen: BTreeMap::new(),
            queue: VecDeque::new(),
            running: BTreeMap::new(),
            ended,
        }
    }

    /// The recipe or its parameters have changed: everything is due again.
    pub fn set_recipe(&mut self, recipe: impl Into<String>) {
        self.recipe = recipe.into();
        self.requeue();
    }

    /// Takes a complete listing of the folder at time `now`.
    pub fn observe(&mut self, files: &[Listed], now: Duration) {
        let mut before = std::mem::take(&mut self.seen);
        for (name, capture) in captures(files) {
            let fingerprint = capture.fingerprint();
            let former = before.remove(&name);
            let same = former
                .as_ref()
                .filter(|seen| seen.fingerprint == fingerprint);
            let seen = Seen {
                since: same.map_or(now, |seen| seen.since),
                queued: former.as_ref().is_some_and(|seen| seen.queued),
                capture,
                fingerprint,
            };
            self.seen.insert(name, seen);
        }
        self.settle(now);
    }

    /// Lets time pass without a new listing.
    pub fn settle(&mut self, now: Duration) {
        let settle = self.rules.settle;
        let mut due: Vec<(Duration, String)> = Vec::new();
        for (name, seen) in &self.seen {
            let waits = seen.queued || self.running.contains_key(name);
            if !waits && seen.is_settled(now, settle) && self.is_due(name, seen) {
                due.push((seen.since, name.clone()));
            }
        }
        due.sort();
        self.queue.extend(due.into_iter().map(|(_, name)| name));
        let seen = &self.seen;
        self.queue.retain(|name| {
            seen.get(name)
                .is_some_and(|seen| seen.is_settled(now, settle))
        });
        self.mark();
    }

    fn is_due(&self, name: &str, seen: &Seen) -> bool {
        self.ended
            .get(name)
            .is_none_or(|entry| entry.inputs != seen.fingerprint || entry.recipe != self.recipe)
    }

    fn requeue(&mut self) {
        let mut queue = std::mem::take(&mut self.queue);
        queue.retain(|name| {
            let seen = self.seen.get(name);
            seen.is_some_and(|seen| self.is_due(name, seen))
        });
        self.queue = queue;
        self.mark();
    }

    /// Notes on each capture whether it is in the queue.
    fn mark(&mut self) {
        self.seen.values_mut().for_each(|seen| seen.queued = false);
        for name in &self.queue {
            if let Some(seen) = self.seen.get_mut(name) {
                seen.queued = true;
            }
        }
    }

    /// The next capture to process, if a worker is free. It counts as running until [`Inbox::ended`].
    pub fn next_job(&mut self) -> Option<Job> {
        if self.running.len() >= self.rules.workers.max(1) {
            return None;
        }
        let name = self.queue.pop_front()?;
        let seen = self.seen.get_mut(&name)?;
        seen.queued = false;
        let (inputs, recipe) = (seen.fingerprint.clone(), self.recipe.clone());
        self.running
            .insert(name.clone(), (inputs.clone(), recipe.clone()));
        Some(Job {
            capture: seen.capture.clone(),
            name,
            inputs,
            recipe,
        })
    }

    /// A job has ended; the entry belongs into the journal. A capture that changed meanwhile settles and
    /// is queued again by itself.
    pub fn ended(&mut self, name: &str, ending: Ending) -> Option<Entry> {
        let (inputs, recipe) = self.running.remove(name)?;
        let entry = Entry {
            capture: name.to_string(),
            inputs,
            recipe,
            ending,
        };
        self.ended.insert(name.to_string(), entry.clone());
        Some(entry)
    }

    /// A job was given up (the program ends): it will be due again.
    pub fn abandoned(&mut self, name: &str) {
        self.running.remove(name);
    }

    /// When something may be due without anything new being seen: the end of the earliest settling.
    pub fn wakes(&self) -> Option<Duration> {
        let settling = self.seen.iter().filter(|(name, seen)| {
            !seen.queued && !self.running.contains_key(*name) && self.is_due(name, seen)
        });
        settling
            .map(|(_, seen)| seen.since + self.rules.settle)
            .min()
    }

    /// Whether nothing is settling, queued or running.
    pub fn is_drained(&self) -> bool {
        self.queue.is_empty()
            && self.running.is_empty()
            && self
                .seen
                .iter()
                .all(|(name, seen)| !self.is_due(name, seen))
    }

    /// What a capture consists of.
    pub fn capture(&self, name: &str) -> Option<&Capture> {
        self.seen.get(name).map(|seen| &seen.capture)
    }

    /// Every capture and where it stands.
    pub fn states(&self) -> impl Iterator<Item = (&str, State)> {
        self.seen.iter().map(|(name, seen)| {
            let state = if self.running.contains_key(name) {
                State::Running
            } else if seen.queued {
                State::Queued
            } else if self.is_due(name, seen) {
                State::Settling
            } else {
                match self.ended.get(name).map(|entry| entry.ending) {
                    Some(Ending::Failed) => State::Failed,
                    _ => State::Done,
                }
            };
            (name.as_str(), state)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: Duration = Duration::from_secs(1);

    fn file(path: &str, length: u64) -> Listed {
        Listed {
            path: path.into(),
            length,
            modified: None,
        }
    }

    fn inbox() -> Inbox {
        Inbox::new(
            Rules {
                settle: 2 * SECOND,
                workers: 1,
            },
            "recipe",
            [],
        )
    }

    fn names(inbox: &mut Inbox) -> Vec<String> {
        std::iter::from_fn(|| inbox.next_job())
            .map(|job| job.name)
            .collect()
    }

    #[test]
    fn a_capture_is_taken_once_it_has_kept_still() {
        let mut inbox = inbox();
        inbox.observe(&[file("a/f1.obj", 1)], SECOND);
        inbox.observe(&[file("a/f1.obj", 2)], 2 * SECOND);
        assert_eq!(inbox.wakes(), Some(4 * SECOND));
        inbox.settle(3 * SECOND);
        assert_eq!(names(&mut inbox), Vec::<String>::new());
        inbox.settle(4 * SECOND);
        assert_eq!(names(&mut inbox), ["a"]);
    }

    #[test]
    fn a_done_file_needs_no_settling() {
        let mut inbox = inbox();
        inbox.observe(&[file("a/f1.obj", 1), file("a/.done", 0)], SECOND);
        assert_eq!(names(&mut inbox), ["a"]);
    }

    #[test]
    fn arrivals_are_processed_in_order_by_a_bounded_pool() {
        let mut inbox = inbox();
        inbox.observe(&[file("b/f1.obj", 1)], SECOND);
        inbox.observe(&[file("a/f1.obj", 1), file("b/f1.obj", 1)], 2 * SECOND);
        inbox.settle(9 * SECOND);
        assert_eq!(names(&mut inbox), ["b"]);
        inbox.ended("b", Ending::Done);
        assert_eq!(names(&mut inbox), ["a"]);
        inbox.ended("a", Ending::Failed);
        assert!(inbox.is_drained());
        assert_eq!(
            inbox.states().collect::<Vec<_>>(),
            [("a", State::Failed), ("b", State::Done)]
        );
    }

    #[test]
    fn the_journal_spares_what_was_done_and_nothing_else() {
        let files = [file("a/f1.obj", 1), file("b/f1.obj", 1)];
        let mut first = inbox();
        first.observe(&files, SECOND);
        first.settle(9 * SECOND);
        assert_eq!(names(&mut first), ["a"]);
        let journal = first.ended("a", Ending::Done);
        let mut second = Inbox::new(
            Rules {
                settle: SECOND,
                workers: 4,
            },
            "recipe",
            journal.clone(),
        );
        second.observe(&files, SECOND);
        second.settle(9 * SECOND);
        assert_eq!(names(&mut second), ["b"]);
        let mut other = Inbox::new(
            Rules {
                settle: SECOND,
                workers: 4,
            },
            "another",
            journal,
        );
        other.observe(&files, SECOND);
        other.settle(9 * SECOND);
        assert_eq!(names(&mut other), ["a", "b"]);
    }

    #[test]
    fn a_change_while_running_brings_it_back() {
        let mut inbox = inbox();
        inbox.observe(&[file("a/f1.obj", 1)], SECOND);
        inbox.settle(9 * SECOND);
        assert_eq!(names(&mut inbox), ["a"]);
        inbox.observe(&[file("a/f1.obj", 2)], 10 * SECOND);
        inbox.ended("a", Ending::Done);
        assert!(!inbox.is_drained());
        inbox.settle(12 * SECOND);
        assert_eq!(names(&mut inbox), ["a"]);
    }

    #[test]
    fn what_vanishes_is_forgotten() {
        let mut inbox = inbox();
        inbox.observe(&[file("a/f1.obj", 1)], SECOND);
        inbox.settle(9 * SECOND);
        inbox.observe(&[], 10 * SECOND);
        assert_eq!(names(&mut inbox), Vec::<String>::new());
        assert!(inbox.is_drained());
    }
}
