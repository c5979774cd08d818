//! Where recipes, command line and studio do their expensive work: open, fit, sample, each remembered by
//! content, each noted as a step.

mod captures;
mod looms;
mod shapes;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;

pub(super) use looms::Found;

use super::held::Held;
use super::key::Key;
use super::memory::{Made, Memory, Remembered};
use super::names::Names;
use super::value::{Frames, Keyed, LoomValue, Shape, ShapeValue};
use super::{Completion, Listing};
use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::mesh::Sequence;
use crate::task::Task;
use crate::world::World;

/// What a recipe holds may take this many bytes at one time, unless it is told otherwise.
const MOST_BYTES: usize = 8 << 30;

/// An expensive step of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// What was done: `open`, `fit`, ..
    pub name: &'static str,
    /// On what, in words.
    pub detail: String,
    /// Whether it was computed now or remembered.
    pub made: Made,
}

/// A world, a memory and a task, and the log of what was done with them.
pub struct Workbench {
    world: Arc<dyn World>,
    memory: Arc<Memory>,
    task: Task,
    /// How many bytes may be held.
    most: usize,
    /// How many the process took before.
    before: usize,
    log: Mutex<Log>,
}

#[derive(Default)]
struct Log {
    steps: Vec<Step>,
    reads: BTreeSet<PathBuf>,
    listings: Vec<Listing>,
    /// Frames that were completed, by their key, and what between.
    completed: Vec<(Key, Completion)>,
    names: Names,
    /// Frames that were sampled, by their key, and the loom they came from.
    sampled: Vec<(Key, LoomValue)>,
    held: Held,
}

/// Frames that took work: what files held when they had the identities that are part of its key, a
/// morph.
struct Opened {
    sequence: Sequence,
    key: Key,
    warnings: Vec<Diagnostic>,
}

impl Remembered for Opened {
    fn size(&self) -> usize {
        self.sequence.size()
    }
}

impl Workbench {
    /// Work over `world`, remembered in `memory`, cancelled and watched by `task`.
    pub fn new(world: Arc<dyn World>, memory: Arc<Memory>, task: Task) -> Self {
        let before = world.memory_in_use().unwrap_or(0);
        Workbench {
            world,
            memory,
            task,
            most: MOST_BYTES,
            before,
            log: Mutex::default(),
        }
    }

    /// With another limit on what is held, in bytes.
    #[must_use]
    pub fn holding_at_most(self, bytes: usize) -> Self {
        Workbench {
            most: bytes,
            ..self
        }
    }

    /// The files.
    pub fn world(&self) -> &dyn World {
        &*self.world
    }

    /// What was made before.
    pub(super) fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Cancellation and progress.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// The expensive steps so far.
    pub fn steps(&self) -> Vec<Step> {
        self.log().steps.clone()
    }

    /// The files read so far.
    pub fn reads(&self) -> Vec<PathBuf> {
        self.log().reads.iter().cloned().collect()
    }

    /// The names of the frames, or of the poses, that the value of a key holds; empty where they have none.
    pub fn names_of(&self, key: Key) -> Vec<String> {
        self.log().names.of(key)
    }

    /// The keys and the request that frames were completed from in this run.
    pub fn completed_from(&self, frames: &Frames) -> Option<Completion> {
        let log = self.log();
        let (_, completion) = log.completed.iter().find(|(key, _)| *key == frames.key)?;
        Some(completion.clone())
    }

    /// What inputs were found to stand for so far.
    pub fn listings(&self) -> Vec<Listing> {
        self.log().listings.clone()
    }

    /// Notes that `file` was read: a live run waits for it to change.
    pub fn note_read(&self, file: &Path) {
        self.log().reads.insert(file.to_path_buf());
    }

    fn held_shape(&self, shape: Shape, key: Key) -> Result<ShapeValue> {
        let bytes = 4 * shape.positions.len();
        self.has_room(bytes)?;
        let shape = Keyed::new(shape, key);
        self.log().held.add(&shape.value, bytes);
        Ok(shape)
    }

    /// Counts what a loom holds; an error where that is too much.
    pub(super) fn hold_loom(&self, loom: &Loom) -> Result<()> {
        // The vectors of h are nearly all of a loom, and what edited looms share.
        self.log().held.add(loom.shape(), loom.size());
        self.has_room(0)
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        // Entries are pushed whole; a panic elsewhere cannot tear them.
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn note(&self, name: &'static str, detail: impl Into<String>, made: Made) {
        self.log().steps.push(Step {
            name,
            detail: detail.into(),
            made,
        });
    }

    /// Whether so many bytes more may be held; scripts' own values have limits of their own.
    pub(super) fn has_room(&self, bytes: usize) -> Result<()> {
        if self.log().held.has_room(bytes, self.most) {
            return Ok(());
        }
        self.too_much("results")
            .hint("sample fewer frames, or save looms instead of frames")
            .err()
    }

    /// Whether the process, with whatever holds memory in it, has grown by no more than the limit: scripts
    /// can hold more than the limits on single values tell.
    ///
    /// # Errors
    /// It has.
    pub fn check_growth(&self) -> Result<()> {
        let now = self.world.memory_in_use().unwrap_or(0);
        if now.saturating_sub(self.before) <= self.most {
            return Ok(());
        }
        self.too_much("values")
            .hint("texts, arrays or functions that grow in a loop?")
            .err()
    }

    fn too_much(&self, what: &str) -> Diagnostic {
        let most = self.most as f64 / (1 << 30) as f64;
        Diagnostic::error(format!(
            "the {what} of this recipe take more than {most} GiB"
        ))
        .hint("`--memory-limit` sets the limit")
    }

    /// Counts frames; an error where they are too many.
    pub(super) fn hold_frames(&self, frames: &Frames) -> Result<()> {
        self.log().held.add(&frames.value, frames.value.size());
        self.has_room(0)
    }
}
