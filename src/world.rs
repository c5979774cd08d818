//! The one door to everything outside: files in, files out. No `std::fs` here; [`crate::io`] opens the
//! door, [`MemoryWorld`] is a door painted on a wall, for tests and for work that must not touch a disk.
//!
//! Reading is plain. Writing is staged: files are first written whole where nobody looks, then moved to
//! their places in order ([`Stage::commit`]); a [`Stage`] that is dropped instead leaves no trace.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::io::{self, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use crate::diag::{Diagnostic, Result};

/// The folder that a file is in, by its name: "." for a bare name.
pub fn folder_of(file: &Path) -> &Path {
    match file.parent() {
        Some(folder) if folder != Path::new("") => folder,
        _ => Path::new("."),
    }
}

/// Files as the library sees them. All errors name the path.
pub trait World: Send + Sync {
    /// Replaces `bytes` by the whole content of a file; its allocation is used again.
    ///
    /// # Errors
    /// The file is not there, is a folder, or cannot be read.
    fn read_into(&self, path: &Path, bytes: &mut Vec<u8>) -> Result<()>;

    /// Fills `bytes` from `offset` of a file on.
    ///
    /// # Errors
    /// As [`World::read_into`], or the file ends before `bytes` is full.
    fn read_range(&self, path: &Path, offset: u64, bytes: &mut [u8]) -> Result<()>;

    /// What a folder holds, hidden entries too, in the order of their bytes.
    ///
    /// # Errors
    /// It is not there, not a folder, or cannot be read.
    fn list(&self, folder: &Path) -> Result<Vec<Entry>>;

    /// What tells this file from every other and from its earlier states; `None` if nothing is there.
    ///
    /// # Errors
    /// A folder on the way cannot be searched.
    fn identity(&self, path: &Path) -> Result<Option<Identity>>;

    /// The absolute path of `path` with all links followed and no `..`, as far as it exists; what does
    /// not exist yet is appended as it is written.
    ///
    /// # Errors
    /// A folder on the way cannot be searched, or what does not exist climbs with `..`.
    fn resolve(&self, path: &Path) -> Result<PathBuf>;

    /// A place to write files that will become `out`, or files inside of it. Missing folders above are
    /// created, and removed again if the stage is dropped.
    ///
    /// # Errors
    /// No file can be created there.
    fn stage(&self, out: &Path) -> Result<Box<dyn Stage>>;

    /// The whole content of a file.
    ///
    /// # Errors
    /// As [`World::read_into`].
    fn read(&self, path: &Path) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        self.read_into(path, &mut bytes)?;
        Ok(bytes)
    }

    /// How many bytes of memory this process takes, where the system tells.
    fn memory_in_use(&self) -> Option<usize> {
        None
    }
}

/// Files on their way out. Dropping it without [`Stage::commit`] removes them.
pub trait Stage: Send + Sync {
    /// A new staged file, for writing piece by piece.
    ///
    /// # Errors
    /// It cannot be created.
    fn create(&self, name: &str) -> Result<Box<dyn Write + Send>>;

    /// What is said when writing to a file of [`Stage::create`] fails.
    fn failure(&self, error: &io::Error) -> Box<Diagnostic>;

    /// A new staged file with this content.
    ///
    /// # Errors
    /// It cannot be created, or the disk is full.
    fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        let written = self.create(name)?.write_all(bytes);
        written.map_err(|error| self.failure(&error))
    }

    /// Moves each staged file to its place, in this order, then removes files that are not wanted any
    /// more. Folders that are missing are created.
    ///
    /// # Errors
    /// A move or a removal fails; what was moved before stays.
    fn commit(self: Box<Self>, moves: &[(String, PathBuf)], removals: &[PathBuf]) -> Result<()>;
}

/// Bytes that outlive the process, found by name. Losing any of them only costs time, so nothing fails.
pub trait Store: Send + Sync {
    /// The bytes kept under `name`, whole or not at all.
    fn load(&self, name: &str) -> Option<Vec<u8>>;

    /// Keeps `bytes` under `name`, a plain file name.
    fn keep(&self, name: &str, bytes: &[u8]);
}

/// One entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The name within the folder.
    pub name: OsString,
    /// Whether it is a folder itself (links are followed).
    pub folder: bool,
}

/// What tells a file from every other and from its earlier states. Equal identities of one path mean
/// that the content is the same, as far as anyone can tell without reading it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Identity {
    /// Whether it is a folder.
    pub folder: bool,
    /// Length in bytes.
    pub length: u64,
    /// When it was last changed, since 1970.
    pub modified: Option<Duration>,
    /// Device and number of the file: two paths with the same are one file.
    pub node: Option<(u64, u64)>,
}

/// What is said when `verb` ("read", "write", ..) of `path` fails.
pub fn failure(path: &Path, verb: &str, error: &io::Error) -> Box<Diagnostic> {
    let reason = match error.kind() {
        ErrorKind::NotFound => "no such file or folder".to_string(),
        ErrorKind::PermissionDenied => "permission denied".to_string(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "the disk is full".to_string(),
        ErrorKind::FileTooLarge => "files may not become that large".to_string(),
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only".to_string(),
        ErrorKind::UnexpectedEof => "it ends too early".to_string(),
        ErrorKind::IsADirectory => "it is a folder".to_string(),
        ErrorKind::NotADirectory => "it is not a folder".to_string(),
        _ => lower_case(&error.to_string()),
    };
    let told = Diagnostic::error(format!("cannot {verb}: {reason}")).in_file(path);
    Box::new(match hint(error.kind(), verb) {
        Some(hint) => told.hint(hint),
        None => told,
    })
}

fn hint(kind: ErrorKind, verb: &str) -> Option<&'static str> {
    match (kind, verb) {
        (ErrorKind::NotFound, "read" | "list") => {
            Some("it was there when its folder was listed, or it is a link that leads nowhere")
        }
        (ErrorKind::PermissionDenied, "read" | "list") => {
            Some("check the permissions of the file and of the folders above it")
        }
        (ErrorKind::NotFound | ErrorKind::NotADirectory | ErrorKind::IsADirectory, _) => {
            Some("choose an output whose folders exist or can be created")
        }
        (ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem, _) => {
            Some("choose an output folder that can be written to")
        }
        (ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge, _) => {
            Some("free some space or choose another output; what was there before is unchanged")
        }
        _ => None,
    }
}

fn lower_case(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| {
        first.to_lowercase().chain(letters).collect()
    })
}

/// Files that exist in memory only. Clones share them.
#[derive(Debug, Clone, Default)]
pub struct MemoryWorld {
    files: Arc<Mutex<Files>>,
}

#[derive(Debug, Default)]
struct Files {
    content: BTreeMap<PathBuf, (Arc<Vec<u8>>, u64)>,
    changes: u64,
}

impl MemoryWorld {
    /// A world without files.
    pub fn new() -> Self {
        MemoryWorld::default()
    }

    /// Puts a file there, or replaces it.
    pub fn insert(&self, path: impl AsRef<Path>, bytes: impl Into<Vec<u8>>) {
        let mut files = lock(&self.files);
        files.changes += 1;
        let change = files.changes;
        files
            .content
            .insert(plain(path.as_ref()), (Arc::new(bytes.into()), change));
    }

    /// Takes a file away; whether it was there.
    pub fn remove(&self, path: impl AsRef<Path>) -> bool {
        lock(&self.files)
            .content
            .remove(&plain(path.as_ref()))
            .is_some()
    }

    /// All files, sorted.
    pub fn paths(&self) -> Vec<PathBuf> {
        lock(&self.files).content.keys().cloned().collect()
    }

    fn content(&self, path: &Path) -> Result<Arc<Vec<u8>>> {
        let files = lock(&self.files);
        let found = files.content.get(&plain(path));
        found
            .map(|(bytes, _)| Arc::clone(bytes))
            .ok_or_else(|| failure(path, "read", &ErrorKind::NotFound.into()))
    }
}

impl World for MemoryWorld {
    fn read_into(&self, path: &Path, bytes: &mut Vec<u8>) -> Result<()> {
        let content = self.content(path)?;
        bytes.clear();
        bytes.extend_from_slice(&content);
        Ok(())
    }

    fn read_range(&self, path: &Path, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let content = self.content(path)?;
        let part = usize::try_from(offset)
            .ok()
            .and_then(|start| content.get(start..start.checked_add(bytes.len())?))
            .ok_or_else(|| failure(path, "read", &ErrorKind::UnexpectedEof.into()))?;
        bytes.copy_from_slice(part);
        Ok(())
    }

    fn list(&self, folder: &Path) -> Result<Vec<Entry>> {
        let inside = plain(folder);
        let files = lock(&self.files);
        let names: BTreeSet<(OsString, bool)> = files
            .content
            .keys()
            .filter_map(|path| {
                let mut rest = path.strip_prefix(&inside).ok()?.components();
                let name = rest.next()?.as_os_str().to_os_string();
                Some((name, rest.next().is_some()))
            })
            .collect();
        if names.is_empty() {
            return Err(failure(folder, "list", &ErrorKind::NotFound.into()));
        }
        Ok(names
            .into_iter()
            .map(|(name, folder)| Entry { name, folder })
            .collect())
    }

    fn identity(&self, path: &Path) -> Result<Option<Identity>> {
        let path = plain(path);
        let files = lock(&self.files);
        if let Some((bytes, change)) = files.content.get(&path) {
            return Ok(Some(Identity {
                folder: false,
                length: bytes.len() as u64,
                modified: Some(Duration::from_secs(*change)),
                node: None,
            }));
        }
        let folder = files.content.keys().any(|file| file.starts_with(&path));
        Ok(folder.then_some(Identity {
            folder: true,
            length: 0,
            modified: None,
            node: None,
        }))
    }

    fn resolve(&self, path: &Path) -> Result<PathBuf> {
        Ok(Path::new("/").join(plain(path)))
    }

    fn stage(&self, _out: &Path) -> Result<Box<dyn Stage>> {
        Ok(Box::new(MemoryStage {
            world: self.clone(),
            staged: Arc::default(),
        }))
    }
}

type Staged = Arc<Mutex<BTreeMap<String, Vec<u8>>>>;

struct MemoryStage {
    world: MemoryWorld,
    staged: Staged,
}

struct MemoryFile {
    name: String,
    staged: Staged,
}

impl Write for MemoryFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut staged = lock(&self.staged);
        staged
            .entry(self.name.clone())
            .or_default()
            .extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Stage for MemoryStage {
    fn failure(&self, error: &io::Error) -> Box<Diagnostic> {
        failure(Path::new("memory"), "write", error)
    }

    fn create(&self, name: &str) -> Result<Box<dyn Write + Send>> {
        lock(&self.staged).insert(name.to_string(), Vec::new());
        Ok(Box::new(MemoryFile {
            name: name.to_string(),
            staged: Arc::clone(&self.staged),
        }))
    }

    fn commit(self: Box<Self>, moves: &[(String, PathBuf)], removals: &[PathBuf]) -> Result<()> {
        for (name, path) in moves {
            let bytes = lock(&self.staged)
                .remove(name)
                .ok_or_else(|| failure(path, "write", &ErrorKind::NotFound.into()))?;
            self.world.insert(path, bytes);
        }
        for path in removals {
            self.world.remove(path);
        }
        Ok(())
    }
}

/// `path` without `.` and with `..` taken back.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                plain.pop();
            }
            part => plain.push(part),
        }
    }
    plain
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn staged_files_appear_on_commit_only() {
        let world = MemoryWorld::new();
        world.insert("out/old.obj", *b"old");
        let stage = world.stage(Path::new("out")).unwrap();
        stage.write("a", b"new").unwrap();
        drop(stage);
        assert_eq!(world.paths(), [Path::new("out/old.obj")]);

        let stage = world.stage(Path::new("out")).unwrap();
        stage.write("a", b"new").unwrap();
        let moves = [("a".to_string(), PathBuf::from("./out/x/../new.obj"))];
        stage.commit(&moves, &["out/old.obj".into()]).unwrap();
        assert_eq!(world.paths(), [Path::new("out/new.obj")]);
        assert_eq!(world.read(Path::new("out/new.obj")).unwrap(), b"new");
    }

    #[test]
    fn lists_show_files_and_folders_once() {
        let world = MemoryWorld::new();
        for path in ["a/1", "a/b/2", "a/b/3", "c"] {
            world.insert(path, *b"");
        }
        let names = world.list(Path::new("a")).unwrap();
        let names: Vec<_> = names.iter().map(|e| (e.name.to_str(), e.folder)).collect();
        assert_eq!(names, [(Some("1"), false), (Some("b"), true)]);
        assert!(world.list(Path::new("d")).is_err());
    }

    #[test]
    fn a_range_past_the_end_is_refused() {
        let world = MemoryWorld::new();
        world.insert("f", *b"12345");
        let mut two = [0; 2];
        world.read_range(Path::new("f"), 3, &mut two).unwrap();
        assert_eq!(&two, b"45");
        for offset in [4, u64::MAX] {
            let error = world.read_range(Path::new("f"), offset, &mut two);
            let error = error.unwrap_err();
            assert_eq!(
                error.to_string(),
                "error: f: cannot read: it ends too early"
            );
        }
    }

    #[test]
    fn a_change_changes_the_identity() {
        let world = MemoryWorld::new();
        world.insert("f", *b"1");
        let before = world.identity(Path::new("f")).unwrap();
        world.insert("f", *b"2");
        assert_ne!(before, world.identity(Path::new("f")).unwrap());
        assert_eq!(world.identity(Path::new("g")).unwrap(), None);
    }
}
