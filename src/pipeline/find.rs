//! Which files INPUT stands for, and in which order.
//!
//! A folder, a glob, a pattern of numbered files, a list of files, or one file. What cannot be told
//! apart is refused with the choices, never guessed.

use std::path::{Path, PathBuf};

use globset::GlobBuilder;

use super::input::InputSpec;
use super::numbering;
use super::output::Pattern;
use crate::diag::{Diagnostic, Result};
use crate::format::{self, Format, Kind, NOT_YET};
use crate::world::World;

/// The files of a capture.
pub(super) struct Files {
    /// In the order of the frames.
    pub(super) paths: Vec<PathBuf>,
    pub(super) format: &'static Format,
    /// The mesh that stands beside a cache.
    pub(super) mesh: Option<PathBuf>,
    /// The animation of a scene: `FILE#NAME`.
    pub(super) animation: Option<String>,
}

impl Files {
    /// The file of a format that holds a whole capture in one.
    pub(super) fn only(&self) -> Result<&PathBuf> {
        match self.paths.as_slice() {
            [path] => Ok(path),
            paths => Diagnostic::error(format!(
                "one {} file is a capture, here are {}",
                self.format.name,
                paths.len()
            ))
            .in_file(&paths[1])
            .hint("choose one of them")
            .err(),
        }
    }
}

/// The files that `spec` stands for, in the order of the frames, and the mesh of a cache.
///
/// # Errors
/// As [`super::open`], as far as names tell.
pub fn files(world: &dyn World, spec: &InputSpec) -> Result<Vec<PathBuf>> {
    let found = find(world, spec)?;
    let mut paths = found.paths;
    paths.extend(spec.mesh.clone().or(found.mesh));
    Ok(paths)
}

/// What INPUT was found to stand for: a folder or a pattern may stand for other files later.
#[derive(Debug, Clone, PartialEq)]
pub struct Listing {
    spec: InputSpec,
    /// None where nothing was found.
    files: Option<Vec<PathBuf>>,
}

impl Listing {
    /// The files of `spec` as they are now, and the listing to compare with later.
    pub fn of(world: &dyn World, spec: &InputSpec) -> (Self, Result<Vec<PathBuf>>) {
        let found = files(world, spec);
        let listing = Listing {
            spec: spec.clone(),
            files: found.as_ref().ok().cloned(),
        };
        (listing, found)
    }

    /// What was asked for.
    pub fn spec(&self) -> &InputSpec {
        &self.spec
    }
}

/// Finds the files that `spec` stands for.
pub(super) fn find(world: &dyn World, spec: &InputSpec) -> Result<Files> {
    match spec.paths.as_slice() {
        [] => Diagnostic::error("no input")
            .hint("name a folder, a file, or a pattern such as 'frame_####.obj'")
            .err(),
        [one] => match world.identity(one)? {
            Some(found) if found.folder => in_folder(world, one),
            Some(_) => listed(vec![one.clone()]),
            None => match animation(world, one)? {
                Some((file, animation)) => Ok(Files {
                    animation: Some(animation),
                    ..listed(vec![file])?
                }),
                None => matching(world, one),
            },
        },
        many => {
            for path in many {
                match world.identity(path)? {
                    Some(found) if found.folder => {
                        return Diagnostic::error("a folder in a list of files")
                            .in_file(path)
                            .hint("one folder is one capture")
                            .err();
                    }
                    Some(_) => {}
                    None => return Err(not_there(world, path)),
                }
            }
            listed(many.to_vec())
        }
    }
}

/// `FILE#NAME` with a scene that exists.
fn animation(world: &dyn World, path: &Path) -> Result<Option<(PathBuf, String)>> {
    let text = path.to_string_lossy();
    let Some((file, animation)) = text.split_once('#') else {
        return Ok(None);
    };
    let file = PathBuf::from(file);
    let scene = format_of(&file).is_ok_and(|format| matches!(format.kind, Kind::Scene(_)));
    let there = scene && world.identity(&file)?.is_some();
    Ok(there.then(|| (file, animation.to_string())))
}

/// Files in the order given, all of one format; or one cache and the mesh it belongs to.
fn listed(mut paths: Vec<PathBuf>) -> Result<Files> {
    let mut formats = Vec::with_capacity(paths.len());
    for path in &paths {
        formats.push(format_of(path)?);
    }
    let mut mesh = None;
    if let Some(at) = mesh_beside_cache(&formats) {
        formats.remove(at);
        mesh = Some(paths.remove(at));
    }
    let format = formats[0];
    if let Some(at) = formats.iter().position(|one| one.name != format.name) {
        return Diagnostic::error(format!(
            "{} files among {} files",
            formats[at].name, format.name
        ))
        .in_file(&paths[at])
        .hint("a capture has files of one format")
        .err();
    }
    Ok(Files {
        paths,
        format,
        mesh,
        animation: None,
    })
}

/// Which of two files is the mesh, if the other is a cache.
fn mesh_beside_cache(formats: &[&Format]) -> Option<usize> {
    match formats.iter().map(|format| format.kind).collect::<Vec<_>>()[..] {
        [Kind::Mesh(_), Kind::Cache(_)] => Some(0),
        [Kind::Cache(_), Kind::Mesh(_)] => Some(1),
        _ => None,
    }
}

/// The format that the ending of `path` names.
pub(super) fn format_of(path: &Path) -> Result<&'static Format> {
    if let Some(format) = known_format(path) {
        return Ok(format);
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    let unknown = Diagnostic::error(
        match NOT_YET
            .iter()
            .find(|(known, _)| known.eq_ignore_ascii_case(&ending))
        {
            Some((_, name)) => format!("{name} files cannot be read or written yet"),
            None if ending.is_empty() => "a file without an ending".to_string(),
            None => format!("no format has the ending .{ending}"),
        },
    );
    unknown.in_file(path).hint(endings()).err()
}

fn known_format(path: &Path) -> Option<&'static Format> {
    format::by_ending(&path.extension()?.to_string_lossy())
}

fn endings() -> String {
    let all: Vec<String> = format::FORMATS
        .iter()
        .flat_map(|format| format.endings)
        .map(|ending| format!(".{ending}"))
        .collect();
    format!("known endings are {}", all.join(" "))
}

fn not_there(world: &dyn World, path: &Path) -> Box<Diagnostic> {
    let told = Diagnostic::error("no such file or folder").in_file(path);
    Box::new(match similar(world, path) {
        Some(name) => told.hint(format!("did you mean {}?", name.display())),
        None => told.hint("paths are taken from the folder the command runs in"),
    })
}

/// The entry of the same folder whose name is closest, if it is close.
fn similar(world: &dyn World, path: &Path) -> Option<PathBuf> {
    let name = path.file_name()?.to_string_lossy();
    let folder = parent(path);
    let entries = world.list(folder).ok()?;
    let distance = |entry: &str| strsim::damerau_levenshtein(entry, &name);
    entries
        .iter()
        .map(|entry| entry.name.to_string_lossy())
        .filter(|entry| distance(entry) <= 2)
        .min_by_key(|entry| distance(entry))
        .map(|entry| path.with_file_name(entry.as_ref()))
}

pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    }
}

/// The capture in a folder: what remains when hidden files and unknown endings are passed over must be
/// one sequence.
fn in_folder(world: &dyn World, folder: &Path) -> Result<Files> {
    let mut paths: Vec<PathBuf> = world
        .list(folder)?
        .into_iter()
        .filter(|entry| !entry.folder && !entry.name.to_string_lossy().starts_with('.'))
        .map(|entry| folder.join(entry.name))
        .filter(|path| known_format(path).is_some())
        .collect();
    if paths.is_empty() {
        return Diagnostic::error("no capture in this folder")
            .in_file(folder)
            .hint(endings())
            .err();
    }
    // a loom beside the capture that it was fitted to is not another one
    let is_loom =
        |path: &PathBuf| known_format(path).is_some_and(|one| matches!(one.kind, Kind::Loom));
    if !paths.iter().all(is_loom) {
        paths.retain(|path| !is_loom(path));
    }
    numbering::sort(&mut paths);
    let formats: Vec<&Format> = paths.iter().filter_map(|path| known_format(path)).collect();
    let groups = numbering::groups(&paths);
    let several = groups.len() > 1 && groups.values().any(|group| group.len() > 1);
    let mixed = formats.iter().any(|format| format.name != formats[0].name);
    let many_each = !matches!(formats[0].kind, Kind::Mesh(_)) && formats.len() > 1;
    if (several || mixed || many_each) && mesh_beside_cache(&formats).is_none() {
        return Diagnostic::error("more than one capture in this folder")
            .in_file(folder)
            .hint(numbering::choices(folder, &groups))
            .err();
    }
    listed(paths)
}

/// Files that a pattern (`####`, `%04d`) or a glob stands for, in natural order.
fn matching(world: &dyn World, path: &Path) -> Result<Files> {
    let text = path.to_string_lossy();
    let mut paths = if let Some(pattern) = Pattern::parse(path) {
        let mut numbered: Vec<(u64, PathBuf)> = pattern.files(world)?;
        numbered.sort();
        numbered.into_iter().map(|(_, path)| path).collect()
    } else if text.contains(['*', '?', '[', '{']) {
        glob(world, path)?
    } else {
        return Err(not_there(world, path));
    };
    if paths.is_empty() {
        return Diagnostic::error("nothing matches this pattern")
            .in_file(path)
            .hint("quote it, so that the shell leaves it alone")
            .err();
    }
    numbering::sort(&mut paths);
    listed(paths)
}

/// Files below the part of `pattern` that names no wildcard.
fn glob(world: &dyn World, pattern: &Path) -> Result<Vec<PathBuf>> {
    let text = pattern.to_string_lossy();
    let matcher = GlobBuilder::new(&text).literal_separator(true).build();
    let matcher = match matcher {
        Ok(glob) => glob.compile_matcher(),
        Err(error) => {
            let reason = error.kind().to_string();
            return Diagnostic::error(format!("not a pattern: {reason}"))
                .in_file(pattern)
                .err();
        }
    };
    let wild = |part: &Path| part.to_string_lossy().contains(['*', '?', '[', '{']);
    let base = pattern
        .ancestors()
        .find(|above| !wild(above))
        .unwrap_or(Path::new(""));
    let depth = if text.contains("**") {
        usize::MAX
    } else {
        pattern.components().count() - base.components().count()
    };
    let mut found = Vec::new();
    walk(world, base, depth, &mut found)?;
    found.retain(|path| matcher.is_match(path));
    Ok(found)
}

fn walk(world: &dyn World, folder: &Path, depth: usize, found: &mut Vec<PathBuf>) -> Result<()> {
    let here = if folder.as_os_str().is_empty() {
        Path::new(".")
    } else {
        folder
    };
    for entry in world.list(here)? {
        let path = folder.join(&entry.name);
        if !entry.folder {
            found.push(path);
        } else if depth > 1 && !entry.name.to_string_lossy().starts_with('.') {
            walk(world, &path, depth - 1, found)?;
        }
    }
    Ok(())
}
