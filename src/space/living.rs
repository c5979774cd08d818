//! What is alive is found again: the factors and spaces of one connectivity and one reference pose, for as
//! long as anyone holds them. Nothing lives longer for being listed here.

use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Things in use, each listed with what it was made for.
pub(super) struct Living<K, T: ?Sized> {
    listed: Mutex<Vec<(K, Weak<T>)>>,
}

impl<K, T: ?Sized> Living<K, T> {
    /// Nothing yet.
    pub(super) const fn new() -> Self {
        Living {
            listed: Mutex::new(Vec::new()),
        }
    }

    /// The first of those in use that `same` accepts, or else what `make` gives, listed under its key.
    /// Nothing is locked while it is made; of two made at once the first that is listed is kept.
    pub(super) fn find_or<E>(
        &self,
        same: impl Fn(&K, &T) -> bool,
        make: impl FnOnce() -> Result<(K, Arc<T>), E>,
    ) -> Result<Arc<T>, E> {
        if let Some(found) = self.find(&same) {
            return Ok(found);
        }
        let (key, made) = make()?;
        if let Some(found) = self.find(&same) {
            return Ok(found);
        }
        let mut listed = self.listed.lock().unwrap_or_else(PoisonError::into_inner);
        listed.push((key, Arc::downgrade(&made)));
        Ok(made)
    }

    fn find(&self, same: impl Fn(&K, &T) -> bool) -> Option<Arc<T>> {
        let mut listed = self.listed.lock().unwrap_or_else(PoisonError::into_inner);
        listed.retain(|(_, thing)| thing.strong_count() > 0);
        listed.iter().find_map(|(key, thing)| {
            let thing = thing.upgrade()?;
            same(key, &thing).then_some(thing)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_is_found_and_what_is_not_is_made_again() {
        let living: Living<u32, String> = Living::new();
        let made = std::cell::Cell::new(0);
        let open = |key: u32| {
            let make = || -> Result<_, ()> {
                made.set(made.get() + 1);
                Ok((key, Arc::new(key.to_string())))
            };
            living.find_or(|listed, _| *listed == key, make).unwrap()
        };
        let one = open(1);
        assert!(Arc::ptr_eq(&one, &open(1)));
        open(2);
        assert_eq!(made.get(), 2);
        drop(one);
        open(1);
        assert_eq!(made.get(), 3);
    }

    #[test]
    fn what_fails_is_not_listed() {
        let living: Living<(), u32> = Living::new();
        assert_eq!(living.find_or(|(), _| true, || Err("no")), Err("no"));
        let made = living.find_or(|(), _| true, || Ok::<_, ()>(((), Arc::new(7))));
        assert_eq!(made, Ok(Arc::new(7)));
    }
}
