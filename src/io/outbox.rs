//! The folder that a watch writes to: each capture's results arrive by one rename, and a journal says what
//! was done, so that a run killed at any moment leaves nothing half-written and forgets nothing.

use std::collections::BTreeMap;
use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::alive::Alive;
use crate::diag::{Diagnostic, Result};
use crate::world::failure;

/// The journal's name in the folder.
const JOURNAL: &str = ".meshloom-journal.jsonl";
/// What a folder is called while it is filled, and while it makes way.
const PART: &str = ".meshloom-part";
const OLD: &str = ".old";

/// What a watch holds a lock on as long as it runs.
const LOCK: &str = ".meshloom-lock";

/// A folder of results, of one watch at a time.
#[derive(Debug)]
pub struct Outbox {
    folder: PathBuf,
    /// What goes with the process when it is told to end at once.
    staged: Mutex<BTreeMap<String, Alive>>,
    _lock: Option<File>,
}

impl Outbox {
    /// Opens the folder, makes it if it is missing, and clears up what a killed run has left.
    ///
    /// # Errors
    /// It cannot be made or read; another watch writes to it.
    pub fn open(folder: &Path) -> Result<Outbox> {
        let failed = |error: io::Error| failure(folder, "write", &error);
        fs::create_dir_all(folder).map_err(failed)?;
        let lock = locked(folder)?;
        for entry in fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = path
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
                .into_owned();
            if let Some(hidden) = name.strip_prefix('.') {
                recover(folder, &path, hidden).map_err(failed)?;
            }
        }
        Ok(Outbox {
            folder: folder.to_path_buf(),
            staged: Mutex::default(),
            _lock: lock,
        })
    }

    /// Where the results are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The lines of the journal; a last line that a killed run has torn is left out.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn journal(&self) -> Result<Vec<String>> {
        match fs::read_to_string(self.folder.join(JOURNAL)) {
            Ok(text) => Ok(text
                .split_inclusive('\n')
                .filter_map(|line| line.strip_suffix('\n'))
                .map(str::to_string)
                .collect()),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
            Err(error) => Err(failure(&self.folder.join(JOURNAL), "read", &error)),
        }
    }

    /// Appends a line to the journal; it is on the disk when this returns.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn append(&self, line: &str) -> Result<()> {
        let path = self.folder.join(JOURNAL);
        let write = || -> io::Result<()> {
            let mut file = OpenOptions::new()
                .create(true)
                .read(true)
                .append(true)
                .open(&path)?;
            let line = if torn(&mut file)? {
                format!("\n{line}\n")
            } else {
                format!("{line}\n")
            };
            file.write_all(line.as_bytes())?;
            file.sync_data()
        };
        write().map_err(|error| failure(&path, "write", &error))
    }

    /// An empty folder to fill with the results of `name`; nobody sees it yet.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn stage(&self, name: &str) -> Result<PathBuf> {
        let part = self.hidden(name, PART);
        let alive = Alive::new();
        // before it is made: told to end in between, nobody else would know of it
        alive.made(&part);
        let make = || -> io::Result<()> {
            remove(&part)?;
            fs::create_dir(&part)
        };
        make().map_err(|error| failure(&part, "write", &error))?;
        self.staged().insert(name.to_string(), alive);
        Ok(part)
    }

    fn staged(&self) -> MutexGuard<'_, BTreeMap<String, Alive>> {
        // Entries come and go whole; a panic elsewhere cannot tear them.
        self.staged.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Writes a file into the staged folder of `name`.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, name: &str, file: &str, bytes: &[u8]) -> Result<()> {
        let path = self.hidden(name, PART).join(file);
        fs::write(&path, bytes).map_err(|error| failure(&path, "write", &error))
    }

    /// Shows the staged folder of `name` in the place of its earlier results.
    ///
    /// # Errors
    /// It cannot be moved; the earlier results are where they were.
    pub fn publish(&self, name: &str) -> Result<()> {
        let (place, old) = (self.folder.join(name), self.hidden(name, OLD));
        let swap = || -> io::Result<()> {
            // First of all: killed after the move, nobody would know that it is out of date.
            remove(&self.error_file(name))?;
            remove(&old)?;
            if place.exists() {
                fs::rename(&place, &old)?;
            }
            if let Err(error) = fs::rename(self.hidden(name, PART), &place) {
                let _ = fs::rename(&old, &place);
                return Err(error);
            }
            remove(&old)
        };
        swap().map_err(|error| failure(&place, "write", &error))?;
        self.staged().remove(name);
        Ok(())
    }

    /// Drops the staged folder of `name`.
    pub fn discard(&self, name: &str) {
        let _ = remove(&self.hidden(name, PART));
        self.staged().remove(name);
    }

    /// Says beside the results of `name` why its last run failed; they stay.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn complain(&self, name: &str, text: &str) -> Result<()> {
        let (path, staged) = (self.error_file(name), self.hidden(name, ".error"));
        let write = || fs::write(&staged, text).and_then(|()| fs::rename(&staged, &path));
        write().map_err(|error| failure(&path, "write", &error))
    }

    /// A file among the published results of `name`, if it can be read as text.
    pub fn published(&self, name: &str, file: &str) -> Option<String> {
        fs::read_to_string(self.folder.join(name).join(file)).ok()
    }

    /// The names of all published results.
    pub fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let names = entries
            .filter(|entry| entry.path().is_dir())
            .map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
        names.sort();
        names
    }

    fn hidden(&self, name: &str, ending: &str) -> PathBuf {
        self.folder.join(format!(".{name}{ending}"))
    }

    fn error_file(&self, name: &str) -> PathBuf {
        self.folder.join(format!("{name}.error.txt"))
    }
}

/// The lock that says that a watch writes here; none where the file system has no locks. It goes with its
/// process, however that ends.
fn locked(folder: &Path) -> Result<Option<File>> {
    let Ok(file) = File::create(folder.join(LOCK)) else {
        return Ok(None);
    };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Diagnostic::error("another watch writes to this folder")
            .in_file(folder)
            .hint("end it first, or give this one another `-o`")
            .err(),
        Err(TryLockError::Error(_)) => Ok(None),
    }
}

/// Whether the last line of a journal was never finished.
fn torn(file: &mut File) -> io::Result<bool> {
    if file.metadata()?.len() == 0 {
        return Ok(false);
    }
    let mut last = [0];
    file.seek(SeekFrom::End(-1))?;
    file.read_exact(&mut last)?;
    Ok(last != *b"\n")
}

/// Undoes what a run killed in the middle has left of `hidden`.
fn recover(folder: &Path, path: &Path, hidden: &str) -> io::Result<()> {
    if let Some(name) = hidden.strip_suffix(OLD) {
        let place = folder.join(name);
        return if place.exists() {
            remove(path)
        } else {
            fs::rename(path, place)
        };
    }
    if hidden.ends_with(PART) || hidden.ends_with(".error") {
        return remove(path);
    }
    Ok(())
}

fn remove(path: &Path) -> io::Result<()> {
    let removed = match fs::symlink_metadata(path) {
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Every file below `folder` down to one subfolder, with length and time: what an inbox looks at. The
/// folder `except` and everything in it is left out. One look at each file: a hundred thousand take a
/// fraction of a second.
///
/// # Errors
/// The folder itself cannot be read; a subfolder that cannot is passed over.
pub fn listing(
    folder: &Path,
    except: &Path,
) -> Result<Vec<(PathBuf, u64, Option<std::time::Duration>)>> {
    let except = fs::canonicalize(except).ok();
    let mut found = Vec::new();
    let entries = fs::read_dir(folder).map_err(|error| failure(folder, "list", &error))?;
    for entry in entries.flatten() {
        let Some(found_here) = metadata(&entry) else {
            continue;
        };
        let name = PathBuf::from(entry.file_name());
        if !found_here.is_dir() {
            found.extend(file(name, &found_here));
            continue;
        }
        let path = entry.path();
        if except.is_some() && fs::canonicalize(&path).ok() == except {
            continue;
        }
        let inner = fs::read_dir(&path).into_iter().flatten().flatten();
        let inside = |entry: fs::DirEntry| file(name.join(entry.file_name()), &metadata(&entry)?);
        found.extend(inner.filter_map(inside));
    }
    Ok(found)
}

/// What an entry is, links followed.
fn metadata(entry: &fs::DirEntry) -> Option<Metadata> {
    let own = entry.metadata().ok()?;
    match own.is_symlink() {
        true => fs::metadata(entry.path()).ok(),
        false => Some(own),
    }
}

fn file(path: PathBuf, metadata: &Metadata) -> Option<(PathBuf, u64, Option<std::time::Duration>)> {
    let modified = metadata
        .modified()
        .ok()
        .and_then(|time| time.duration_since(std::time::UNIX_EPOCH).ok());
    metadata
        .is_file()
        .then_some((path, metadata.len(), modified))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outbox() -> (tempfile::TempDir, Outbox) {
        let folder = tempfile::tempdir().unwrap();
        let outbox = Outbox::open(&folder.path().join("out")).unwrap();
        (folder, outbox)
    }

    fn publish(outbox: &Outbox, text: &str) {
        outbox.stage("a").unwrap();
        outbox.write("a", "f", text.as_bytes()).unwrap();
        outbox.publish("a").unwrap();
    }

    #[test]
    fn results_replace_earlier_ones_whole() {
        let (_folder, outbox) = outbox();
        publish(&outbox, "1");
        publish(&outbox, "2");
        assert_eq!(outbox.published("a", "f").as_deref(), Some("2"));
        assert_eq!(outbox.names(), ["a"]);
    }

    #[test]
    fn two_watches_do_not_share_a_folder() {
        let (_folder, outbox) = outbox();
        let error = Outbox::open(outbox.folder()).unwrap_err();
        assert!(error.message.contains("another watch"), "{error}");
        let folder = outbox.folder().to_path_buf();
        drop(outbox);
        assert!(Outbox::open(&folder).is_ok());
    }

    #[test]
    fn a_run_killed_between_the_renames_is_undone() {
        let (_folder, outbox) = outbox();
        publish(&outbox, "1");
        outbox.stage("a").unwrap();
        fs::rename(outbox.folder().join("a"), outbox.folder().join(".a.old")).unwrap();
        let place = outbox.folder().to_path_buf();
        drop(outbox);
        let again = Outbox::open(&place).unwrap();
        assert_eq!(again.published("a", "f").as_deref(), Some("1"));
        assert!(!place.join(".a.meshloom-part").exists());
    }

    #[test]
    fn a_torn_line_is_left_out_and_closed() {
        let (_folder, outbox) = outbox();
        outbox.append("one").unwrap();
        let path = outbox.folder().join(JOURNAL);
        OpenOptions::new()
            .append(true)
            .open(path)
            .unwrap()
            .write_all(b"tw")
            .unwrap();
        assert_eq!(outbox.journal().unwrap(), ["one"]);
        outbox.append("three").unwrap();
        assert_eq!(outbox.journal().unwrap(), ["one", "tw", "three"]);
    }

    #[test]
    fn complaints_go_when_results_come() {
        let (_folder, outbox) = outbox();
        outbox.complain("a", "why").unwrap();
        assert!(outbox.folder().join("a.error.txt").exists());
        publish(&outbox, "1");
        assert!(!outbox.folder().join("a.error.txt").exists());
    }

    #[test]
    fn the_output_folder_is_not_listed() {
        let (folder, outbox) = outbox();
        fs::create_dir(folder.path().join("c")).unwrap();
        fs::write(folder.path().join("c/f.obj"), "v").unwrap();
        publish(&outbox, "1");
        let listed = listing(folder.path(), outbox.folder()).unwrap();
        assert_eq!(
            listed
                .iter()
                .map(|(path, length, _)| (path.clone(), *length))
                .collect::<Vec<_>>(),
            [(PathBuf::from("c/f.obj"), 1)]
        );
    }
}
