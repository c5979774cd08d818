//! How much memory results hold, for as long as anybody holds them.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Weak};

/// Results that may be alive, and what they take. A result counts once, whoever shares it, until the last
/// holder lets it go.
#[derive(Default)]
pub(super) struct Held {
    /// By address: a later result at the address of one that is gone takes its place.
    results: HashMap<usize, (Weak<dyn Any + Send + Sync>, usize)>,
    /// At least what is alive: those that have gone since the last count are still in it.
    bytes: usize,
    /// How many results the last count left.
    counted: usize,
}

/// So many results more than at the last count, and they are counted again.
const MANY: usize = 1024;

impl Held {
    /// From now on `result` counts `bytes`.
    pub(super) fn add<T: Any + Send + Sync>(&mut self, result: &Arc<T>, bytes: usize) {
        let address = Arc::as_ptr(result).cast::<()>() as usize;
        let weak: Weak<dyn Any + Send + Sync> = Arc::downgrade(&(Arc::clone(result) as Arc<_>));
        let former = self.results.insert(address, (weak, bytes));
        self.bytes = self.bytes.saturating_add(bytes) - former.map_or(0, |(_, bytes)| bytes);
        if self.results.len() > 2 * self.counted + MANY {
            self.count();
        }
    }

    /// Whether `more` bytes fit into `limit` beside what is alive.
    pub(super) fn has_room(&mut self, more: usize, limit: usize) -> bool {
        if self.bytes.saturating_add(more) > limit {
            self.count();
        }
        self.bytes.saturating_add(more) <= limit
    }

    fn count(&mut self) {
        self.results
            .retain(|_, (result, _)| result.strong_count() > 0);
        self.bytes = self.results.values().map(|(_, bytes)| bytes).sum();
        self.counted = self.results.len();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_let_go_makes_room() {
        let mut held = Held::default();
        for round in 0..5000 {
            assert!(held.has_room(60, 100), "{round}");
            held.add(&Arc::new(round), 60);
        }
        assert!(held.results.len() <= 2 * MANY);
    }

    #[test]
    fn what_is_alive_counts_once() {
        let mut held = Held::default();
        let (first, second) = (Arc::new(1), Arc::new("2"));
        for _ in 0..3 {
            held.add(&first, 60);
        }
        assert!(held.has_room(40, 100) && !held.has_room(41, 100));
        held.add(&second, 40);
        assert!(!held.has_room(1, 100));
        drop(first);
        assert!(held.has_room(60, 100));
    }
}
