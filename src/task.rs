//! Cancellation and progress for long work, without a clock: whoever owns a terminal observes the
//! phases and stamps the times.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// What long work tells whoever watches it. Called from any thread.
pub trait Observer: Send + Sync {
    /// A phase begins (the one before it has ended); `steps` is how many [`Observer::step`]s will
    /// follow, 0 when that is not known.
    fn phase(&self, name: &'static str, steps: usize);
    /// One step of the present phase is done.
    fn step(&self);
}

/// The work was cancelled: its results so far are to be dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cancelled;

/// A handle that long work polls and reports to. Clones share the flag and the observer.
#[derive(Clone, Default)]
pub struct Task {
    cancel: Arc<AtomicBool>,
    observer: Option<Arc<dyn Observer>>,
}

impl Task {
    /// A task whose phases and steps go to `observer`.
    pub fn observed(observer: Arc<dyn Observer>) -> Self {
        Task {
            cancel: Arc::default(),
            observer: Some(observer),
        }
    }

    /// A task that shares `cancel`: setting the flag cancels it.
    #[must_use]
    pub fn with_flag(mut self, cancel: Arc<AtomicBool>) -> Self {
        self.cancel = cancel;
        self
    }

    /// The flag that cancels this task, for another task that is to share it.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.cancel)
    }

    /// A task of its own, to be cancelled by itself, that reports to the same observer.
    #[must_use]
    pub fn sibling(&self) -> Self {
        Task {
            cancel: Arc::default(),
            observer: self.observer.clone(),
        }
    }

    /// Asks the work to stop; it ends with [`Cancelled`] at its next check.
    pub fn cancel(&self) {
        self.cancel.store(true, Ordering::Relaxed);
    }

    /// Whether the work was asked to stop.
    pub fn cancelled(&self) -> bool {
        self.cancel.load(Ordering::Relaxed)
    }

    /// `Err(Cancelled)` once the work was asked to stop; for use with `?` inside loops.
    pub fn check(&self) -> Result<(), Cancelled> {
        if self.cancelled() {
            Err(Cancelled)
        } else {
            Ok(())
        }
    }

    /// Begins a phase of `steps` steps (0: unknown).
    pub fn phase(&self, name: &'static str, steps: usize) {
        if let Some(observer) = &self.observer {
            observer.phase(name, steps);
        }
    }

    /// One step of the phase is done.
    pub fn step(&self) {
        if let Some(observer) = &self.observer {
            observer.step();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clones_share_the_flag() {
        let task = Task::default();
        let copy = task.clone();
        assert_eq!(copy.check(), Ok(()));
        task.cancel();
        assert_eq!(copy.check(), Err(Cancelled));
    }
}
