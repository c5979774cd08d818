//! The stages that are not finished yet, so that a process which is told to end at once can take their
//! files with it.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Tries to empty a folder that other threads still write into.
const ATTEMPTS: usize = 20;

static ALIVE: Mutex<Stages> = Mutex::new(Stages {
    next: 0,
    of: BTreeMap::new(),
});

struct Stages {
    next: usize,
    of: BTreeMap<usize, Vec<PathBuf>>,
}

/// An entry in the list of unfinished stages; gone when it is dropped.
#[derive(Debug)]
pub(super) struct Alive(usize);

impl Alive {
    /// A stage that has made nothing yet.
    pub(super) fn new() -> Self {
        let mut stages = stages();
        stages.next += 1;
        let number = stages.next;
        stages.of.insert(number, Vec::new());
        Alive(number)
    }

    /// The stage has made this folder.
    pub(super) fn made(&self, folder: &Path) {
        if let Some(folders) = stages().of.get_mut(&self.0) {
            folders.push(folder.to_path_buf());
        }
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        stages().of.remove(&self.0);
    }
}

/// Removes what unfinished stages have made: hidden folders with all they hold, others if they are
/// empty. For the last moment of a process: stages that go on writing will fail.
pub fn abandon_stages() {
    abandon_below(Path::new(""));
}

fn abandon_below(root: &Path) {
    let stages = stages();
    let made = stages.of.values().flat_map(|folders| folders.iter().rev());
    for folder in made.filter(|folder| folder.starts_with(root)) {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let hidden = name.starts_with('.') && name.contains(super::disk::MARK);
        // Whoever is still writing may add a file between the listing and the removal.
        for _ in 0..ATTEMPTS {
            let gone = match hidden {
                true => fs::remove_dir_all(folder),
                false => fs::remove_dir(folder),
            };
            if gone.is_ok() || !hidden || !folder.exists() {
                break;
            }
        }
    }
}

fn stages() -> MutexGuard<'static, Stages> {
    ALIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::Disk;
    use crate::world::World;

    #[test]
    fn unfinished_stages_are_swept_away_and_finished_ones_stay() {
        let folder = tempfile::tempdir().unwrap();
        let done = folder.path().join("done/out.obj");
        let stage = Disk.stage(&done).unwrap();
        stage.write("1", b"one").unwrap();
        stage.commit(&[("1".into(), done.clone())], &[]).unwrap();

        let stage = Disk.stage(&folder.path().join("new/folder/out")).unwrap();
        stage.write("1", b"one").unwrap();
        // Other tests of this process have stages elsewhere.
        abandon_below(folder.path());
        assert!(stage.write("2", b"two").is_err());
        assert!(!folder.path().join("new").exists());
        assert!(done.exists());
    }
}
