//! Work over many files with bounded memory: a few lanes, each with its own buffers, take the next item
//! in order until none is left.

use std::sync::{Mutex, PoisonError};

use crate::diag::Result;
use crate::task::Task;

/// Runs `work` over the items on at most `lanes` threads; each lane keeps one `B` between its items.
/// Every item done is a step of the task.
///
/// # Errors
/// Of the items that failed the error of the first one, whatever the number of lanes; or cancellation.
pub(super) fn run<T: Send, B: Default>(
    items: impl Iterator<Item = T> + Send,
    lanes: usize,
    task: &Task,
    work: impl Fn(&mut B, T) -> Result<()> + Sync,
) -> Result<()> {
    let queue = Mutex::new(Some(items.enumerate()));
    let failed = Mutex::new(None::<(usize, _)>);
    let next = || {
        let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
        queue.as_mut().and_then(Iterator::next)
    };
    let fail = |at, error| {
        *queue.lock().unwrap_or_else(PoisonError::into_inner) = None;
        let mut failed = failed.lock().unwrap_or_else(PoisonError::into_inner);
        if failed.as_ref().is_none_or(|(earlier, _)| at < *earlier) {
            *failed = Some((at, error));
        }
    };
    let lane = || {
        let mut buffer = B::default();
        while let Some((at, item)) = next() {
            let done = match task.check() {
                Ok(()) => work(&mut buffer, item),
                Err(cancelled) => Err(cancelled.into()),
            };
            match done {
                Ok(()) => task.step(),
                Err(error) => fail(at, error),
            }
        }
    };
    rayon::scope(|scope| {
        for _ in 1..lanes {
            scope.spawn(|_| lane());
        }
        lane();
    });
    let failed = failed.into_inner().unwrap_or_else(PoisonError::into_inner);
    failed.map_or(Ok(()), |(_, error)| Err(error))
}

/// How many lanes may hold `bytes` each within `budget` bytes: at least one, at most the threads.
pub(super) fn within(budget: u64, bytes: u64) -> usize {
    let fit = usize::try_from(budget / bytes.max(1)).unwrap_or(usize::MAX);
    fit.clamp(1, rayon::current_num_threads())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Diagnostic;

    #[test]
    fn the_first_failure_is_told_whoever_meets_it() {
        for lanes in 1..4 {
            let error = run(0..100, lanes, &Task::default(), |_: &mut (), item| {
                if item % 7 == 3 {
                    return Diagnostic::error(item.to_string()).err();
                }
                Ok(())
            });
            assert_eq!(error.unwrap_err().message, "3");
        }
    }

    #[test]
    fn cancelled_work_stops() {
        let task = Task::default();
        let done = Mutex::new(0);
        let ended = run(0..100, 2, &task, |(): &mut (), item| {
            *done.lock().unwrap() += 1;
            if item == 5 {
                task.cancel();
            }
            Ok(())
        });
        assert_eq!(ended.unwrap_err().message, "interrupted");
        assert!(*done.lock().unwrap() < 100);
    }
}
