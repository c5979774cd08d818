//! Expensive results remembered by their key: in memory up to a size, and in a store that outlives the
//! process where one is given.

use std::any::Any;
use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard};

use super::key::Key;
use crate::diag::Result;
use crate::world::Store;

/// What can be remembered.
pub trait Remembered: Any + Send + Sync + Sized {
    /// About how many bytes it holds.
    fn size(&self) -> usize;

    /// Itself as bytes for the store; `None` when it is cheaper to make again.
    fn to_bytes(&self) -> Option<Vec<u8>> {
        None
    }

    /// Back from the store; `None` when the bytes are not of this kind.
    fn from_bytes(_bytes: &[u8]) -> Option<Self> {
        None
    }
}

/// How a result came to be.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Made {
    /// It was made now.
    Computed,
    /// It was in memory or in the store.
    Remembered,
}

impl std::fmt::Display for Made {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Made::Computed => "computed",
            Made::Remembered => "remembered",
        })
    }
}

struct Entry {
    value: Arc<dyn Any + Send + Sync>,
    size: usize,
    used: u64,
}

#[derive(Default)]
struct Entries {
    by_key: HashMap<Key, Entry>,
    bytes: usize,
    clock: u64,
}

/// The remembered results; when they hold more than the limit, the longest unused go first.
pub struct Memory {
    entries: Mutex<Entries>,
    limit: usize,
    store: Option<Arc<dyn Store>>,
}

impl Memory {
    /// A memory of at most `limit` bytes, backed by `store`.
    pub fn new(limit: usize, store: Option<Arc<dyn Store>>) -> Self {
        Memory {
            entries: Mutex::default(),
            limit,
            store,
        }
    }

    /// The result under `key`: remembered, or made by `compute` and remembered from then on. A failure
    /// is not remembered.
    ///
    /// # Errors
    /// Those of `compute`.
    pub fn remember<T: Remembered>(
        &self,
        key: Key,
        compute: impl FnOnce() -> Result<T>,
    ) -> Result<(Arc<T>, Made)> {
        if let Some(value) = self.recall::<T>(key) {
            return Ok((value, Made::Remembered));
        }
        let stored = self
            .store
            .as_ref()
            .and_then(|store| store.load(&key.to_string()))
            .and_then(|bytes| T::from_bytes(&bytes));
        let origin = if stored.is_some() {
            Made::Remembered
        } else {
            Made::Computed
        };
        let value = Arc::new(match stored {
            Some(value) => value,
            None => compute()?,
        });
        if let (Made::Computed, Some(store)) = (origin, &self.store)
            && let Some(bytes) = value.to_bytes()
        {
            store.keep(&key.to_string(), &bytes);
        }
        self.insert(key, Arc::clone(&value));
        Ok((value, origin))
    }

    /// How many bytes are held.
    pub fn bytes(&self) -> usize {
        self.lock().bytes
    }

    fn lock(&self) -> MutexGuard<'_, Entries> {
        // A panic elsewhere leaves whole entries behind: they are inserted in one step.
        self.entries
            .lock()
            .unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn recall<T: Remembered>(&self, key: Key) -> Option<Arc<T>> {
        let mut entries = self.lock();
        entries.clock += 1;
        let now = entries.clock;
        let entry = entries.by_key.get_mut(&key)?;
        entry.used = now;
        Arc::clone(&entry.value).downcast().ok()
    }

    fn insert<T: Remembered>(&self, key: Key, value: Arc<T>) {
        let size = value.size();
        if size > self.limit {
            return;
        }
        let mut entries = self.lock();
        entries.clock += 1;
        let entry = Entry {
            value,
            size,
            used: entries.clock,
        };
        entries.bytes += size;
        if let Some(old) = entries.by_key.insert(key, entry) {
            entries.bytes -= old.size;
        }
        while entries.bytes > self.limit {
            let Some(oldest) = entries
                .by_key
                .iter()
                .min_by_key(|(_, entry)| entry.used)
                .map(|(key, _)| *key)
            else {
                return;
            };
            if let Some(entry) = entries.by_key.remove(&oldest) {
                entries.bytes -= entry.size;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::Diagnostic;

    #[derive(Debug, PartialEq)]
    struct Text(String);

    impl Remembered for Text {
        fn size(&self) -> usize {
            self.0.len()
        }
        fn to_bytes(&self) -> Option<Vec<u8>> {
            Some(self.0.clone().into_bytes())
        }
        fn from_bytes(bytes: &[u8]) -> Option<Self> {
            String::from_utf8(bytes.to_vec()).ok().map(Text)
        }
    }

    #[derive(Default)]
    struct Shelf(Mutex<HashMap<String, Vec<u8>>>);

    impl Store for Shelf {
        fn load(&self, name: &str) -> Option<Vec<u8>> {
            self.0.lock().unwrap().get(name).cloned()
        }
        fn keep(&self, name: &str, bytes: &[u8]) {
            self.0
                .lock()
                .unwrap()
                .insert(name.to_string(), bytes.to_vec());
        }
    }

    fn key(name: &str) -> Key {
        Key::of(name).finish()
    }

    fn text(memory: &Memory, name: &str) -> Made {
        let (value, origin) = memory
            .remember(key(name), || Ok(Text(name.to_string())))
            .unwrap();
        assert_eq!(value.0, name);
        origin
    }

    #[test]
    fn a_result_is_made_once() {
        let memory = Memory::new(100, None);
        assert_eq!(
            [text(&memory, "a"), text(&memory, "a"), text(&memory, "b")],
            [Made::Computed, Made::Remembered, Made::Computed]
        );
    }

    #[test]
    fn the_longest_unused_goes_first() {
        let memory = Memory::new(4, None);
        for name in ["aa", "bb", "aa", "cc"] {
            text(&memory, name);
        }
        assert_eq!(memory.bytes(), 4);
        assert_eq!(text(&memory, "aa"), Made::Remembered);
        assert_eq!(text(&memory, "bb"), Made::Computed);
    }

    #[test]
    fn failures_are_tried_again() {
        let memory = Memory::new(100, None);
        assert!(
            memory
                .remember::<Text>(key("a"), || Diagnostic::error("no").err())
                .is_err()
        );
        assert_eq!(text(&memory, "a"), Made::Computed);
    }

    #[test]
    fn the_store_outlives_the_memory() {
        let store: Arc<dyn Store> = Arc::new(Shelf::default());
        assert_eq!(
            text(&Memory::new(100, Some(Arc::clone(&store))), "a"),
            Made::Computed
        );
        assert_eq!(text(&Memory::new(100, Some(store)), "a"), Made::Remembered);
    }
}
