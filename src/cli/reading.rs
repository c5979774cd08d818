//! What a run has read, and whether it has changed since: what a live run and the studio wait for.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use crate::diag::{Result, Warned};
use crate::io::{Depth, Disk, Watch};
use crate::pipeline::Listing;
use crate::world::{Identity, World, folder_of};

/// A save is taken for finished when nothing has changed for this long: editors that truncate and write,
/// or save twice in a row, are one save.
const QUIET: Duration = Duration::from_millis(30);
/// A file that keeps changing is read all the same after this long.
const PATIENCE: Duration = Duration::from_millis(500);

/// The files of a run as they were when it read them, and what it took folders and patterns to stand for.
#[derive(Default)]
pub(super) struct Reading {
    files: BTreeMap<PathBuf, Option<Identity>>,
    listings: Vec<Listing>,
}

impl Reading {
    /// Files as they are now.
    pub(super) fn of(files: &[PathBuf]) -> Self {
        let files = files.iter().map(|file| (file.clone(), identity(file)));
        Reading {
            files: files.collect(),
            listings: Vec::new(),
        }
    }

    /// The same files as they are now.
    pub(super) fn again(&self) -> Self {
        let files: Vec<PathBuf> = self.files.keys().cloned().collect();
        Reading {
            listings: self.listings.clone(),
            ..Reading::of(&files)
        }
    }

    /// What a run has read that began at `begun`, when the files that it was known to read were as in
    /// `self`. A file that was written since counts as changed.
    pub(super) fn after(&self, files: &[PathBuf], listings: &[Listing], begun: SystemTime) -> Self {
        let begun = begun.duration_since(UNIX_EPOCH).unwrap_or_default();
        let was = |file: &PathBuf| {
            let unless_written = |now: &Identity| now.modified.is_none_or(|time| time < begun);
            match self.files.get(file) {
                Some(before) => *before,
                None => identity(file).filter(unless_written),
            }
        };
        Reading {
            files: files.iter().map(|file| (file.clone(), was(file))).collect(),
            listings: listings.to_vec(),
        }
    }

    /// Whether something but `own` has changed since it was read or last asked for.
    pub(super) fn changed(&mut self, own: Option<&Path>) -> bool {
        let mut changed = false;
        for (path, before) in &mut self.files {
            let now = identity(path);
            // A file that is being replaced is gone for a moment.
            if now != *before && now.is_some() && own != Some(path) {
                *before = now;
                changed = true;
            }
        }
        for listing in &mut self.listings {
            let now = Listing::of(&Disk, listing.spec()).0;
            changed |= now != *listing;
            *listing = now;
        }
        changed
    }

    /// The folders, of those that are there, in which changes are to be seen.
    pub(super) fn folders(&self) -> BTreeSet<PathBuf> {
        let beside = self.files.keys().map(|file| folder_of(file));
        let listed = self.listings.iter().flat_map(|listing| {
            let paths = listing.spec().paths.iter();
            paths.flat_map(|path| [path.as_path(), folder_of(path)])
        });
        let all: BTreeSet<&Path> = beside.chain(listed).collect();
        let there = all.into_iter().filter(|folder| folder.is_dir());
        there.map(Path::to_path_buf).collect()
    }
}

/// A watch on the entries of folders.
///
/// # Errors
/// As [`Watch::new`].
pub(super) fn entries(folders: &BTreeSet<PathBuf>) -> Result<Warned<Watch>> {
    let entries = folders
        .iter()
        .map(|folder| (folder.clone(), Depth::Entries));
    Watch::new(&entries.collect::<Vec<_>>(), false)
}

/// Waits until what has begun to change is saved to the end.
pub(super) fn saved(watch: &Watch) {
    watch.calm(QUIET, PATIENCE, &mut BTreeSet::new());
}

/// The file as it is, if it is there.
pub(super) fn identity(path: &Path) -> Option<Identity> {
    Disk.identity(path).ok().flatten()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::InputSpec;
    use std::fs;

    #[test]
    fn a_file_that_is_written_or_replaced_has_changed_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("r.rhai");
        fs::write(&path, "1").unwrap();
        let mut reading = Reading::of(std::slice::from_ref(&path));
        assert!(!reading.changed(None));
        fs::write(&path, "12").unwrap();
        assert!(reading.changed(None) && !reading.changed(None));
        fs::remove_file(&path).unwrap();
        assert!(!reading.changed(None));
        fs::write(&path, "123").unwrap();
        assert!(!reading.changed(Some(&path)) && reading.changed(None));
    }

    #[test]
    fn what_is_written_while_it_is_read_for_the_first_time_has_changed() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("m.rhai");
        let begun = SystemTime::now() - Duration::from_secs(1);
        fs::write(&path, "1").unwrap();
        let read = |begun| Reading::default().after(std::slice::from_ref(&path), &[], begun);
        assert!(read(begun).changed(None));
        let later = SystemTime::now() + Duration::from_secs(1);
        assert!(!read(later).changed(None));
    }

    #[test]
    fn a_frame_more_in_a_folder_is_a_change() {
        let folder = tempfile::tempdir().unwrap();
        let takes = folder.path().join("takes");
        let (listing, found) = Listing::of(&Disk, &InputSpec::new(&takes));
        assert!(found.is_err());
        let mut reading = Reading::default().after(&[], &[listing], SystemTime::now());
        assert!(!reading.changed(None));
        assert_eq!(reading.folders(), [folder.path().to_path_buf()].into());
        fs::create_dir(&takes).unwrap();
        fs::write(takes.join("f_1.obj"), "").unwrap();
        assert!(reading.changed(None) && reading.folders().contains(&takes));
        fs::write(takes.join("f_2.obj"), "").unwrap();
        fs::write(takes.join("notes.txt"), "").unwrap();
        assert!(reading.changed(None) && !reading.changed(None));
    }
}
