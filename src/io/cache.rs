//! Results that outlive the process, in the user's cache folder: one file a result, the longest unused
//! removed when they hold more than a limit. Losing any of them only costs time, so nothing here fails.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use crate::world::Store;

/// A cache folder of bounded size.
#[derive(Debug, Clone)]
pub struct Cache {
    folder: PathBuf,
    limit: u64,
}

impl Cache {
    /// Results in `folder`, at most `limit` bytes of them.
    pub fn new(folder: impl Into<PathBuf>, limit: u64) -> Self {
        Cache {
            folder: folder.into(),
            limit,
        }
    }

    /// Where the results are.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Removes the longest unused results until the rest is within the limit.
    fn evict(&self) {
        let Ok(entries) = fs::read_dir(&self.folder) else {
            return;
        };
        let mut files: Vec<(SystemTime, u64, PathBuf)> = entries
            .filter_map(|entry| {
                let entry = entry.ok()?;
                let metadata = entry.metadata().ok().filter(std::fs::Metadata::is_file)?;
                Some((metadata.modified().ok()?, metadata.len(), entry.path()))
            })
            .collect();
        files.sort();
        let mut total: u64 = files.iter().map(|(_, length, _)| length).sum();
        for (_, length, path) in files {
            if total <= self.limit {
                return;
            }
            if fs::remove_file(path).is_ok() {
                total -= length;
            }
        }
    }

    fn write(&self, name: &str, bytes: &[u8]) -> std::io::Result<()> {
        fs::create_dir_all(&self.folder)?;
        let staged = self.folder.join(format!(".{name}.{}", std::process::id()));
        let written = File::create(&staged)
            .and_then(|mut file| file.write_all(bytes))
            .and_then(|()| fs::rename(&staged, self.file(name)));
        if written.is_err() {
            let _ = fs::remove_file(&staged);
        }
        written
    }
}

impl Store for Cache {
    fn load(&self, name: &str) -> Option<Vec<u8>> {
        let path = self.file(name);
        let bytes = fs::read(&path).ok()?;
        // The time of the file is the time of its last use.
        if let Ok(file) = File::options().append(true).open(&path) {
            let _ = file.set_modified(SystemTime::now());
        }
        Some(bytes)
    }

    fn keep(&self, name: &str, bytes: &[u8]) {
        if bytes.len() as u64 <= self.limit && self.write(name, bytes).is_ok() {
            self.evict();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn what_is_kept_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path().join("deep"), 100);
        cache.keep("a", b"bytes");
        assert_eq!(cache.load("a").as_deref(), Some(&b"bytes"[..]));
        assert_eq!(cache.load("b"), None);
    }

    #[test]
    fn the_longest_unused_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(folder.path(), 10);
        for (name, age) in [("a", 30), ("b", 20)] {
            cache.keep(name, &[0; 5]);
            let file = File::options()
                .append(true)
                .open(folder.path().join(name))
                .unwrap();
            file.set_modified(SystemTime::now() - Duration::from_secs(age))
                .unwrap();
        }
        cache.load("a");
        cache.keep("c", &[0; 5]);
        assert!(
            cache.load("b").is_none() && cache.load("a").is_some() && cache.load("c").is_some()
        );
    }

    #[test]
    fn a_folder_that_cannot_be_made_only_costs_time() {
        let cache = Cache::new("/dev/null/cache", 100);
        cache.keep("a", b"bytes");
        assert_eq!(cache.load("a"), None);
    }
}
