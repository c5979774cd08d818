//! Waiting for files to change: by the system's notifications where they can be trusted, by polling on
//! network file systems and where the system's limits are reached.
//!
//! Folders are watched, never single files: a file that is saved by renaming is a new file, and a watch
//! on the old one goes deaf. A change is only a reason to look: whoever waits lists for itself.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::{Duration, Instant};

use notify::{Config, Event, EventKind, PollWatcher, RecommendedWatcher, RecursiveMode, Watcher};

use crate::diag::{Diagnostic, Result, Warned};
use crate::world::failure;

/// How often a polled folder is looked at: often enough for a person, rare enough for a file server.
const POLL: Duration = Duration::from_secs(2);

/// The magic numbers (statfs) of file systems whose changes on other machines nobody tells us.
const REMOTE: &[(u64, &str)] = &[
    (0x6969, "NFS"),
    (0xFE53_4D42, "SMB"),
    (0xFF53_4D42, "CIFS"),
    (0x6573_5546, "FUSE"),
    (0x0BD0_0BD0, "Lustre"),
];

/// How far below a watched folder changes count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// Its own entries.
    Entries,
    /// Everything below it.
    Tree,
}

/// What a wait ended with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Wake {
    /// These paths have changed; an empty set means that events were lost and anything may have.
    Changed(BTreeSet<PathBuf>),
    /// The time is up.
    Quiet,
}

/// Watched folders. Dropping it ends the watch.
pub struct Watch {
    events: Receiver<Vec<PathBuf>>,
    _watcher: Box<dyn Watcher + Send>,
}

impl Watch {
    /// Watches `folders`; `poll` asks for polling whatever the file system is. The warnings say when
    /// polling was chosen and why.
    ///
    /// # Errors
    /// A folder cannot be watched in either way: it is not there, or cannot be read.
    pub fn new(folders: &[(PathBuf, Depth)], poll: bool) -> Result<Warned<Watch>> {
        for (folder, _) in folders {
            std::fs::read_dir(folder).map_err(|error| failure(folder, "watch", &error))?;
        }
        let remote = folders
            .iter()
            .find_map(|(folder, _)| remote(folder).map(|kind| (folder, kind)));
        if poll {
            return polled(folders).map(Warned::clean);
        }
        if let Some((folder, kind)) = remote {
            let warning = Diagnostic::warning(format!(
                "on {kind}: looking every {} seconds",
                POLL.as_secs()
            ))
            .in_file(folder);
            return Ok(Warned {
                output: polled(folders)?,
                warnings: vec![warning],
            });
        }
        native(folders).or_else(|error| {
            let warning = Diagnostic::warning(format!(
                "no notifications ({error}): looking every {} seconds",
                POLL.as_secs()
            ))
            .hint("fs.inotify.max_user_watches and max_user_instances limit them");
            Ok(Warned {
                output: polled(folders)?,
                warnings: vec![warning],
            })
        })
    }

    /// Waits for a change, at most `time`.
    pub fn wait(&self, time: Duration) -> Wake {
        match self.events.recv_timeout(time) {
            Ok(paths) => Wake::Changed(self.drained(paths)),
            Err(RecvTimeoutError::Timeout) => Wake::Quiet,
            Err(RecvTimeoutError::Disconnected) => {
                // The watcher's thread is gone; the caller's own listing goes on at this pace.
                std::thread::sleep(time);
                Wake::Quiet
            }
        }
    }

    /// Waits until nothing has changed for `quiet`, at most `longest`, and adds what changed to `paths`.
    pub fn calm(&self, quiet: Duration, longest: Duration, paths: &mut BTreeSet<PathBuf>) {
        let begin = Instant::now();
        while begin.elapsed() < longest {
            match self.wait(quiet) {
                Wake::Changed(more) => paths.extend(more),
                Wake::Quiet => return,
            }
        }
    }

    fn drained(&self, first: Vec<PathBuf>) -> BTreeSet<PathBuf> {
        let mut paths: BTreeSet<PathBuf> = first.into_iter().collect();
        let mut lost = paths.is_empty();
        while let Ok(more) = self.events.try_recv() {
            lost |= more.is_empty();
            paths.extend(more);
        }
        if lost { BTreeSet::new() } else { paths }
    }
}

fn native(folders: &[(PathBuf, Depth)]) -> std::result::Result<Warned<Watch>, notify::Error> {
    let (sender, events) = mpsc::channel();
    let mut watcher = RecommendedWatcher::new(forward(sender), Config::default())?;
    add(&mut watcher, folders)?;
    Ok(Warned::clean(Watch {
        events,
        _watcher: Box::new(watcher),
    }))
}

fn polled(folders: &[(PathBuf, Depth)]) -> Result<Watch> {
    let (sender, events) = mpsc::channel();
    let config = Config::default()
        .with_poll_interval(POLL)
        .with_compare_contents(false);
    let failed = |error: notify::Error| {
        let place = error
            .paths
            .first()
            .or(folders.first().map(|(folder, _)| folder))
            .cloned()
            .unwrap_or_default();
        Box::new(Diagnostic::error(format!("cannot watch: {error}")).in_file(place))
    };
    let mut watcher = PollWatcher::new(forward(sender), config).map_err(failed)?;
    add(&mut watcher, folders).map_err(failed)?;
    Ok(Watch {
        events,
        _watcher: Box::new(watcher),
    })
}

fn add(watcher: &mut dyn Watcher, folders: &[(PathBuf, Depth)]) -> notify::Result<()> {
    for (folder, depth) in folders {
        let mode = match depth {
            Depth::Entries => RecursiveMode::NonRecursive,
            Depth::Tree => RecursiveMode::Recursive,
        };
        watcher.watch(folder, mode)?;
    }
    Ok(())
}

/// Passes on the paths of what changes; reading alone is no change. Errors and overflows become an empty
/// list: look everywhere.
fn forward(sender: Sender<Vec<PathBuf>>) -> impl FnMut(notify::Result<Event>) + Send + 'static {
    move |event| {
        let paths = match event {
            Ok(event) if event.need_rescan() => Vec::new(),
            Ok(event) if matches!(event.kind, EventKind::Access(_)) => return,
            Ok(event) => event.paths,
            Err(_) => Vec::new(),
        };
        // Nobody waits any more once the receiver is gone.
        let _ = sender.send(paths);
    }
}

/// The kind of network file system that holds `path`, if it is one.
fn remote(path: &Path) -> Option<&'static str> {
    let magic = rustix::fs::statfs(path).ok()?.f_type as u64 & 0xFFFF_FFFF;
    REMOTE
        .iter()
        .find(|(known, _)| *known == magic)
        .map(|(_, name)| *name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_save_in_place_wakes() {
        for poll in [false, true] {
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("a");
            fs::write(&file, "1").unwrap();
            let folders = [(folder.path().to_path_buf(), Depth::Tree)];
            let watch = Watch::new(&folders, poll).unwrap().output;
            fs::write(&file, "22").unwrap();
            // Polling sees whole seconds.
            let later = std::time::SystemTime::now() + Duration::from_secs(2);
            fs::File::options()
                .append(true)
                .open(&file)
                .unwrap()
                .set_modified(later)
                .unwrap();
            assert!(
                matches!(watch.wait(Duration::from_secs(20)), Wake::Changed(_)),
                "poll: {poll}"
            );
        }
    }

    #[test]
    fn a_save_by_rename_wakes_twice_in_a_row() {
        let folder = tempfile::tempdir().unwrap();
        let (file, beside) = (folder.path().join("a"), folder.path().join("a.tmp"));
        fs::write(&file, "1").unwrap();
        let watch = Watch::new(&[(folder.path().to_path_buf(), Depth::Entries)], false)
            .unwrap()
            .output;
        for text in ["2", "3"] {
            fs::write(&beside, text).unwrap();
            fs::rename(&beside, &file).unwrap();
            let mut paths = BTreeSet::new();
            watch.calm(
                Duration::from_millis(30),
                Duration::from_secs(5),
                &mut paths,
            );
            assert!(paths.contains(&file), "{paths:?}");
        }
    }

    #[test]
    fn reading_is_no_change() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("a"), "1").unwrap();
        let watch = Watch::new(&[(folder.path().to_path_buf(), Depth::Entries)], false)
            .unwrap()
            .output;
        fs::read(folder.path().join("a")).unwrap();
        assert_eq!(watch.wait(Duration::from_millis(50)), Wake::Quiet);
    }

    #[test]
    fn a_missing_folder_is_named() {
        let error = Watch::new(&[("/no/such/folder".into(), Depth::Tree)], false)
            .err()
            .unwrap();
        assert_eq!(
            error.place.file.as_deref(),
            Some(Path::new("/no/such/folder"))
        );
    }
}
