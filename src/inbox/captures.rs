//! Which captures a folder holds: every subfolder, every numbered group of files, every cache file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// A file below the watched folder, as a listing shows it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Listed {
    /// Its path, relative to the watched folder.
    pub path: PathBuf,
    /// Its length in bytes.
    pub length: u64,
    /// When it was last changed, since 1970.
    pub modified: Option<Duration>,
}

/// Files that belong together.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Capture {
    /// What to open, relative to the watched folder: a subfolder, the files of a group, or a cache with
    /// its mesh.
    pub inputs: Vec<PathBuf>,
    /// All files it consists of, with what tells their states apart.
    pub files: Vec<Listed>,
    /// Whether its `.done` file has appeared: it need not settle.
    pub declared_done: bool,
}

impl Capture {
    /// A hash of names, lengths and times: another one means that the capture has changed.
    pub fn fingerprint(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for file in &self.files {
            let name = file.path.to_string_lossy();
            hasher.update(&(name.len() as u64).to_le_bytes());
            hasher.update(name.as_bytes());
            hasher.update(&file.length.to_le_bytes());
            hasher.update(&file.modified.unwrap_or_default().as_nanos().to_le_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

/// The marker that a writer may leave: `.done` in a subfolder, `NAME.done` beside files.
const DONE: &str = "done";
/// Files with many frames in one.
const CACHES: &[&str] = &["pc2", "mdd", "glb", "gltf"];
/// Files with one frame each.
const FRAMES: &[&str] = &["obj", "ply"];

/// The captures in a listing, by name. Hidden files and files of other kinds are nobody's.
pub fn captures(files: &[Listed]) -> BTreeMap<String, Capture> {
    let mut found: BTreeMap<String, Capture> = BTreeMap::new();
    let mut done = Vec::new();
    let mut meshes = Vec::new();
    for file in files {
        let Some(role) = role(&file.path) else {
            continue;
        };
        match role {
            Role::Marker(name) => done.push(name),
            Role::Mesh(name) => meshes.push((name, file)),
            Role::Part { capture, input } => {
                let capture = found.entry(capture).or_default();
                // the files of a folder have one input between them
                if capture.inputs.last() != Some(&input) {
                    capture.inputs.push(input);
                }
                capture.files.push(file.clone());
            }
        }
    }
    for capture in found.values_mut() {
        capture.inputs.sort_by_cached_key(|input| place(input));
        capture.inputs.dedup();
    }
    for (name, file) in meshes {
        if let Some(capture) = found.get_mut(&name) {
            capture.inputs.push(file.path.clone());
            capture.files.push(file.clone());
        }
    }
    for capture in found.values_mut() {
        capture.files.sort_by(|a, b| a.path.cmp(&b.path));
    }
    for name in done {
        if let Some(capture) = found.get_mut(&name) {
            capture.declared_done = true;
        }
    }
    found
}

/// Where a file of a group comes in it: by its number (without leading zeros, the shorter first), then by
/// its name.
fn place(path: &Path) -> (usize, String, PathBuf) {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = stem[name.len()..].trim_start_matches('0').to_string();
    (number.len(), number, path.to_path_buf())
}

enum Role {
    /// A frame or a cache.
    Part { capture: String, input: PathBuf },
    /// A mesh that is no frame: the faces of the cache of the same name.
    Mesh(String),
    /// The marker of a capture.
    Marker(String),
}

fn role(path: &Path) -> Option<Role> {
    let name = path.file_name()?.to_str()?;
    let parent = path.parent().filter(|parent| *parent != Path::new(""));
    if let Some(parent) = parent {
        let folder = parent.iter().next()?.to_str()?;
        let direct = parent.components().count() == 1;
        return match name {
            _ if folder.starts_with('.') || !direct => None,
            ".done" => Some(Role::Marker(folder.to_string())),
            _ if name.starts_with('.') || !is_geometry(name) => None,
            _ => Some(Role::Part {
                capture: folder.to_string(),
                input: PathBuf::from(folder),
            }),
        };
    }
    let (stem, ending) = name.rsplit_once('.')?;
    let ending = ending.to_ascii_lowercase();
    if stem.is_empty() {
        return None;
    }
    if ending == DONE {
        return Some(Role::Marker(stem.to_string()));
    }
    if CACHES.contains(&ending.as_str()) {
        return Some(Role::Part {
            capture: stem.to_string(),
            input: path.to_path_buf(),
        });
    }
    if !FRAMES.contains(&ending.as_str()) {
        return None;
    }
    let prefix = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    if prefix.len() == stem.len() {
        return Some(Role::Mesh(stem.to_string()));
    }
    let capture = prefix.trim_end_matches(['_', '.', '-', ' ']);
    let capture = if capture.is_empty() {
        ending
    } else {
        capture.to_string()
    };
    Some(Role::Part {
        capture,
        input: path.to_path_buf(),
    })
}

fn is_geometry(name: &str) -> bool {
    let ending = name
        .rsplit_once('.')
        .map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase());
    CACHES.contains(&ending.as_str()) || FRAMES.contains(&ending.as_str()) || ending == "loom"
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(path: &str) -> Listed {
        Listed {
            path: path.into(),
            length: 1,
            modified: None,
        }
    }

    #[test]
    fn folders_groups_and_caches_are_captures() {
        let files = [
            "a/f1.obj",
            "a/f2.obj",
            "run_0001.obj",
            "run_0002.obj",
            "wave.pc2",
            "wave.obj",
            "notes.txt",
            ".hidden/x.obj",
        ];
        let found = captures(&files.map(listed));
        assert_eq!(found.keys().collect::<Vec<_>>(), ["a", "run", "wave"]);
        assert_eq!(found["a"].inputs, [PathBuf::from("a")]);
        assert_eq!(found["run"].inputs.len(), 2);
        assert_eq!(
            found["wave"].inputs,
            [PathBuf::from("wave.pc2"), PathBuf::from("wave.obj")]
        );
    }

    #[test]
    fn frames_of_a_group_are_in_the_order_of_their_numbers() {
        let files = [
            "run_10.obj",
            "run_9.obj",
            "run_011.obj",
            "run_100.obj",
            "run_1.obj",
        ];
        let found = captures(&files.map(listed));
        let wanted = [
            "run_1.obj",
            "run_9.obj",
            "run_10.obj",
            "run_011.obj",
            "run_100.obj",
        ];
        assert_eq!(found["run"].inputs, wanted.map(PathBuf::from));
    }

    #[test]
    fn a_hundred_thousand_files_are_one_capture() {
        let name = |i: usize| listed(&format!("run_{:06}.obj", (i * 7919) % 100_000));
        let files: Vec<Listed> = (0..100_000).map(name).collect();
        let found = captures(&files);
        assert_eq!(found["run"].inputs.len(), 100_000);
        assert_eq!(found["run"].inputs[4242], PathBuf::from("run_004242.obj"));
    }

    #[test]
    fn markers_belong_to_their_captures() {
        let found = captures(&["a/f1.obj", "a/.done", "run1.obj", "b/f1.obj"].map(listed));
        assert!(
            found["a"].declared_done && !found["b"].declared_done && !found["run"].declared_done
        );
    }

    #[test]
    fn a_changed_file_changes_the_fingerprint() {
        let mut capture = captures(&[listed("a/f1.obj")]).remove("a").unwrap();
        let before = capture.fingerprint();
        capture.files[0].length += 1;
        assert_ne!(before, capture.fingerprint());
    }
}
