//! What poses are called: by their files, where each has one, and by their demo.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use super::key::Key;

/// The names of so many poses in these files: the files' own, if there is one for each and more than one.
pub fn pose_names(files: &[PathBuf], poses: usize) -> Vec<String> {
    let stem = |file: &PathBuf| {
        let stem = file.file_stem().or(file.file_name());
        stem.unwrap_or(Path::new("").as_os_str())
            .to_string_lossy()
            .into_owned()
    };
    match files.len() == poses && poses > 1 {
        true => files.iter().map(stem).collect(),
        false => Vec::new(),
    }
}

/// The names of the frames that values hold, by the values' keys.
#[derive(Debug, Default)]
pub(super) struct Names {
    of: HashMap<Key, Vec<String>>,
}

impl Names {
    /// Remembers the names of what `key` holds; none at all are nothing to remember.
    pub(super) fn set(&mut self, key: Key, names: Vec<String>) {
        if !names.is_empty() {
            self.of.insert(key, names);
        }
    }

    /// The names, one a frame; empty where there are none.
    pub(super) fn of(&self, key: Key) -> Vec<String> {
        self.of.get(&key).cloned().unwrap_or_default()
    }

    /// Of shapes put together from shapes, each of one name.
    pub(super) fn joined(&self, keys: &[Key]) -> Vec<String> {
        let one = |key: &Key| match self.of.get(key).map(Vec::as_slice) {
            Some([name]) => Some(name.clone()),
            _ => None,
        };
        let names: Option<Vec<String>> = keys.iter().map(one).collect();
        names.unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_are_called_by_their_files_if_there_is_one_for_each() {
        let files = ["a/grin.obj", "b/sad.2.obj"].map(PathBuf::from);
        assert_eq!(pose_names(&files, 2), ["grin", "sad.2"]);
        assert!(pose_names(&files, 3).is_empty() && pose_names(&files[..1], 1).is_empty());
    }

    #[test]
    fn shapes_together_have_names_if_each_has() {
        let key = |name: &str| Key::of(name).finish();
        let mut names = Names::default();
        names.set(key("a"), vec!["grin".into()]);
        names.set(key("b"), vec!["sad".into()]);
        names.set(key("many"), vec!["x".into(), "y".into()]);
        assert_eq!(names.joined(&[key("b"), key("a")]), ["sad", "grin"]);
        assert!(names.joined(&[key("a"), key("many")]).is_empty());
        assert!(names.joined(&[key("a"), key("none")]).is_empty());
        assert!(names.of(key("none")).is_empty());
    }
}
