//! [`World`] on std::fs. Output is staged in a hidden folder beside it and renamed, so that a file is
//! there whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::UNIX_EPOCH;

use super::alive::Alive;
use crate::diag::{Diagnostic, Result};
use crate::world::{Entry, Identity, Stage, World, failure};

/// What the name of every hidden folder of ours contains.
pub(super) const MARK: &str = ".meshloom-";

/// The same while it is made.
const NEW: &str = ".new.meshloom-";

/// The file in a hidden folder that its owner holds a lock on.
const LOCK: &str = ".lock";

/// The files of this machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct Disk;

impl World for Disk {
    /// What is in memory and what was swapped out, from /proc.
    fn memory_in_use(&self) -> Option<usize> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let kilobytes = |name: &str| -> Option<usize> {
            let line = status.lines().find_map(|line| line.strip_prefix(name))?;
            line.trim().trim_end_matches("kB").trim_end().parse().ok()
        };
        let kept = kilobytes("VmRSS:")?;
        Some(1024 * (kept + kilobytes("VmSwap:").unwrap_or(0)))
    }

    fn read_into(&self, path: &Path, bytes: &mut Vec<u8>) -> Result<()> {
        bytes.clear();
        let read = File::open(path).and_then(|mut file| {
            let length = usize::try_from(file.metadata()?.len()).unwrap_or(0);
            bytes.reserve_exact(length);
            file.read_to_end(bytes)
        });
        read.map(drop)
            .map_err(|error| failure(path, "read", &error))
    }

    fn read_range(&self, path: &Path, offset: u64, bytes: &mut [u8]) -> Result<()> {
        let read = File::open(path).and_then(|mut file| {
            file.seek(SeekFrom::Start(offset))?;
            file.read_exact(bytes)
        });
        read.map_err(|error| failure(path, "read", &error))
    }

    fn list(&self, folder: &Path) -> Result<Vec<Entry>> {
        let entries = fs::read_dir(folder).and_then(|entries| entries.map(entry).collect());
        let mut entries: Vec<Entry> = entries.map_err(|error| failure(folder, "list", &error))?;
        entries.sort_by(|a, b| a.name.cmp(&b.name));
        Ok(entries)
    }

    fn identity(&self, path: &Path) -> Result<Option<Identity>> {
        match fs::metadata(path) {
            Ok(metadata) => Ok(Some(identity(&metadata))),
            Err(error) if absent(&error) => Ok(None),
            Err(error) => Err(failure(path, "read", &error)),
        }
    }

    fn resolve(&self, path: &Path) -> Result<PathBuf> {
        let absolute = std::path::absolute(path).map_err(|error| failure(path, "read", &error))?;
        for above in absolute.ancestors() {
            match fs::canonicalize(above) {
                Ok(real) => return beyond(path, real, &absolute, above),
                Err(error) if absent(&error) => {}
                Err(error) => return Err(failure(path, "read", &error)),
            }
        }
        Ok(absolute)
    }

    fn stage(&self, out: &Path) -> Result<Box<dyn Stage>> {
        Ok(Box::new(DiskStage::new(out)?))
    }
}

/// `real`, which is `above` with its links followed, and the rest of `absolute`, which does not exist.
fn beyond(path: &Path, real: PathBuf, absolute: &Path, above: &Path) -> Result<PathBuf> {
    let rest = absolute.strip_prefix(above).unwrap_or(Path::new(""));
    let climbs = rest
        .components()
        .any(|part| !matches!(part, std::path::Component::Normal(_)));
    // A link whose target is missing would be followed once the target is there.
    let dangling = rest
        .components()
        .next()
        .is_some_and(|next| fs::symlink_metadata(above.join(next)).is_ok());
    if climbs || dangling {
        return Err(failure(path, "resolve", &io::ErrorKind::NotFound.into()));
    }
    Ok(if rest.as_os_str().is_empty() {
        real
    } else {
        real.join(rest)
    })
}

fn absent(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
    )
}

fn entry(entry: io::Result<fs::DirEntry>) -> io::Result<Entry> {
    let entry = entry?;
    let kind = entry.file_type()?;
    let folder = kind.is_dir() || (kind.is_symlink() && entry.path().is_dir());
    Ok(Entry {
        name: entry.file_name(),
        folder,
    })
}

fn identity(metadata: &fs::Metadata) -> Identity {
    let modified = metadata.modified().ok();
    Identity {
        folder: metadata.is_dir(),
        length: metadata.len(),
        modified: modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok()),
        node: node(metadata),
    }
}

#[cfg(unix)]
fn node(metadata: &fs::Metadata) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    Some((metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
fn node(_: &fs::Metadata) -> Option<(u64, u64)> {
    None
}

/// A hidden folder of staged files, and the folders that had to be created for it.
struct DiskStage {
    out: PathBuf,
    hidden: PathBuf,
    created: Vec<PathBuf>,
    keep: bool,
    alive: Alive,
    /// Held as long as this process lives.
    lock: Option<File>,
}

impl DiskStage {
    /// Beside `out`; inside of it where it is a folder whose own place cannot be written to, or that
    /// lies on another device (a rename would fail).
    fn new(out: &Path) -> Result<Self> {
        let parent = match out.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut stage = DiskStage {
            out: out.to_path_buf(),
            hidden: PathBuf::new(),
            created: Vec::new(),
            keep: false,
            alive: Alive::new(),
            lock: None,
        };
        stage.create_folders(parent)?;
        let name = out.file_name().unwrap_or_default().to_string_lossy();
        let beside = if same_device(parent, out) {
            stage.hide_in(parent, &name)
        } else {
            Err(io::ErrorKind::CrossesDevices.into())
        };
        let hidden = match beside {
            Err(_) if out.is_dir() => stage.hide_in(out, &name),
            beside => beside,
        };
        hidden.map_err(|error| failure(out, "write", &error))?;
        Ok(stage)
    }

    fn hide_in(&mut self, folder: &Path, name: &str) -> io::Result<()> {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let process = std::process::id();
        sweep(folder, name);
        // Nobody sees the folder under its name before it is locked.
        let unlocked = folder.join(format!(".{name}{NEW}{process}-{count}"));
        let hidden = folder.join(format!(".{name}{MARK}{process}-{count}"));
        fs::create_dir(&unlocked)?;
        self.alive.made(&unlocked);
        match locked(&unlocked, &hidden) {
            Ok(lock) => self.lock = Some(lock),
            Err(error) => {
                // The first failure is the one to tell.
                let _ = fs::remove_dir_all(&unlocked);
                return Err(error);
            }
        }
        self.alive.made(&hidden);
        self.hidden = hidden;
        Ok(())
    }

    /// Creates `folder` and what is missing above it, and remembers what was created.
    fn create_folders(&mut self, folder: &Path) -> Result<()> {
        let missing: Vec<&Path> = folder
            .ancestors()
            .take_while(|above| !above.as_os_str().is_empty() && !above.exists())
            .collect();
        for folder in missing.into_iter().rev() {
            fs::create_dir(folder).map_err(|error| failure(folder, "create the folder", &error))?;
            self.alive.made(folder);
            self.created.push(folder.to_path_buf());
        }
        Ok(())
    }

    fn place(&mut self, name: &str, path: &Path) -> Result<()> {
        let parent = path.parent().unwrap_or(Path::new(""));
        self.create_folders(parent)?;
        fs::rename(self.hidden.join(name), path).map_err(|error| failure(path, "write", &error))
    }
}

/// Locks a new folder and gives it its name. Without locks nobody can tell whether it is left over: it is
/// then let alone.
fn locked(new: &Path, hidden: &Path) -> io::Result<File> {
    let lock = File::create(new.join(LOCK))?;
    let _ = lock.try_lock();
    fs::rename(new, hidden)?;
    Ok(lock)
}

/// Removes the hidden folders beside an output called `name` whose owners were killed: those whose lock
/// nobody holds. Whatever cannot be locked or removed stays.
fn sweep(folder: &Path, name: &str) {
    let ours = format!(".{name}{MARK}");
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !entry.file_name().to_string_lossy().starts_with(&ours) {
            continue;
        }
        let stage = entry.path();
        let lock = OpenOptions::new().write(true).open(stage.join(LOCK));
        if lock.is_ok_and(|lock| lock.try_lock().is_ok()) {
            let _ = fs::remove_dir_all(stage);
        }
    }
}

#[cfg(unix)]
fn same_device(parent: &Path, out: &Path) -> bool {
    let device = |path: &Path| fs::metadata(path).ok().and_then(|found| node(&found));
    match (device(parent), device(out)) {
        (Some((parent, _)), Some((out, _))) => parent == out,
        _ => true,
    }
}

#[cfg(not(unix))]
fn same_device(_: &Path, _: &Path) -> bool {
    true
}

impl Stage for DiskStage {
    fn create(&self, name: &str) -> Result<Box<dyn Write + Send>> {
        let path = self.hidden.join(name);
        let file = OpenOptions::new().write(true).create_new(true).open(path);
        let file = file.map_err(|error| self.failure(&error))?;
        Ok(Box::new(file))
    }

    fn failure(&self, error: &io::Error) -> Box<Diagnostic> {
        failure(&self.out, "write", error)
    }

    fn commit(
        mut self: Box<Self>,
        moves: &[(String, PathBuf)],
        removals: &[PathBuf],
    ) -> Result<()> {
        for (name, path) in moves {
            self.place(name, path)?;
            self.keep = true;
        }
        for path in removals {
            match fs::remove_file(path) {
                Err(error) if !absent(&error) => return Err(failure(path, "remove", &error)),
                _ => {}
            }
        }
        Ok(())
    }
}

impl Drop for DiskStage {
    /// Nothing can be done here about a failure, and there is nobody to tell.
    fn drop(&mut self) {
        if !self.hidden.as_os_str().is_empty() {
            let _ = fs::remove_dir_all(&self.hidden);
        }
        if !self.keep {
            for folder in self.created.iter().rev() {
                let _ = fs::remove_dir(folder);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_resolved_through_links_and_dots() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        fs::create_dir(root.join("in")).unwrap();
        std::os::unix::fs::symlink(&root, root.join("in/out")).unwrap();
        std::os::unix::fs::symlink(root.join("nowhere"), root.join("in/dangling")).unwrap();
        let resolve = |path: &str| Disk.resolve(&root.join(path)).ok();
        assert_eq!(resolve("in/../new/file"), Some(root.join("new/file")));
        assert_eq!(resolve("in/out/new"), Some(root.join("new")));
        assert_eq!(resolve("new/../../etc"), None);
        assert_eq!(resolve("in/dangling"), None);
    }

    fn names(folder: &Path) -> Vec<String> {
        let listed = Disk.list(folder).unwrap().into_iter();
        listed
            .map(|entry| entry.name.to_string_lossy().into_owned())
            .collect()
    }

    #[test]
    fn a_dropped_stage_leaves_no_trace() {
        let folder = tempfile::tempdir().unwrap();
        let stage = Disk.stage(&folder.path().join("a/b/out")).unwrap();
        stage.write("1", b"one").unwrap();
        let hidden = names(&folder.path().join("a/b"));
        assert!(
            hidden[0].starts_with(".out.meshloom-"),
            "staged beside the output: {hidden:?}"
        );
        drop(stage);
        assert_eq!(names(folder.path()), [""; 0]);
    }

    #[test]
    fn a_stage_whose_owner_was_killed_is_swept_away_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let alive = Disk.stage(&out).unwrap();
        let left = |name: &str, lock: bool| {
            let left = folder.path().join(name);
            fs::create_dir(&left).unwrap();
            if lock {
                fs::write(left.join(LOCK), "").unwrap();
            }
            left
        };
        let dead = left(".out.meshloom-1-0", true);
        let others = [
            left(".other.meshloom-1-0", true),
            left(".out.meshloom-1-1", false),
            left("out.meshloom-1-0", true),
        ];
        let next = Disk.stage(&out).unwrap();
        assert!(!dead.exists() && others.iter().all(|left| left.exists()));
        for stage in [alive, next] {
            stage.write("1", b"one").unwrap();
        }
    }

    #[test]
    fn commit_moves_creates_and_removes() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("deep/out");
        let stage = Disk.stage(&out).unwrap();
        stage.write("1", b"one").unwrap();
        stage
            .commit(&[("1".into(), out.join("f1.obj"))], &[])
            .unwrap();
        assert_eq!(Disk.read(&out.join("f1.obj")).unwrap(), b"one");

        let stage = Disk.stage(&out).unwrap();
        stage.write("1", b"two").unwrap();
        let removals = [out.join("f1.obj"), out.join("f9.obj")];
        stage
            .commit(&[("1".into(), out.join("f2.obj"))], &removals)
            .unwrap();
        assert_eq!(names(&out), ["f2.obj"]);
        assert_eq!(names(&folder.path().join("deep")), ["out"]);
    }

    #[test]
    fn what_is_missing_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("no.obj");
        let error = Disk.read(&path).unwrap_err();
        assert_eq!(error.place.file.as_deref(), Some(path.as_path()));
        assert_eq!(error.message, "cannot read: no such file or folder");
        assert_eq!(Disk.identity(&path).unwrap(), None);
    }
}
