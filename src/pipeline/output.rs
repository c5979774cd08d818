//! What OUT stands for: one file, or one file a frame in a folder or by a pattern; and what would be
//! written, replaced and removed there.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::find::{format_of, parent};
use crate::diag::{Diagnostic, Result};
use crate::format::{Encoding, Format, Kind};
use crate::world::World;

/// OUT, and the files that must not be written over.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Output {
    /// As the user wrote it.
    pub path: PathBuf,
    /// The inputs: writing over one of them is refused.
    pub inputs: Vec<PathBuf>,
    /// How numbers are laid out, in formats that leave the choice (PLY).
    pub encoding: Encoding,
}

impl<P: Into<PathBuf>> From<P> for Output {
    fn from(path: P) -> Self {
        Output {
            path: path.into(),
            ..Output::default()
        }
    }
}

impl Output {
    /// Lays numbers out like this.
    #[must_use]
    pub fn encoded(mut self, encoding: Encoding) -> Self {
        self.encoding = encoding;
        self
    }

    /// Refuses to write over `inputs`.
    #[must_use]
    pub fn protecting(mut self, inputs: &[PathBuf]) -> Self {
        self.inputs.extend_from_slice(inputs);
        self
    }
}

/// What saving would do.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
pub struct Plan {
    /// The files written, in order; those that exist are replaced.
    pub writes: Vec<PathBuf>,
    /// Frames of the same pattern from an earlier, longer run, removed afterwards.
    pub removals: Vec<PathBuf>,
    #[serde(skip)]
    pub(super) format: FormatOf,
    #[serde(skip)]
    pub(super) stage: PathBuf,
}

/// A [`Format`], compared by name.
#[derive(Clone, Copy)]
pub(super) struct FormatOf(pub(super) &'static Format);

impl PartialEq for FormatOf {
    fn eq(&self, other: &Self) -> bool {
        self.0.name == other.0.name
    }
}

impl Eq for FormatOf {}

impl std::fmt::Debug for FormatOf {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.name)
    }
}

/// What [`super::save`] would do with `frames` frames.
///
/// # Errors
/// The ending names no format that can be written, several frames would go to a file that holds one, or
/// an input would be written over or removed.
pub fn plan(world: &dyn World, output: &Output, frames: usize) -> Result<Plan> {
    let plan = plan_writes(world, &output.path, frames)?;
    let touched = plan.writes.iter().chain(&plan.removals);
    refuse_inputs(world, touched, &output.inputs)?;
    Ok(plan)
}

/// Refuses to touch `paths` that are `inputs`, under whatever name.
///
/// # Errors
/// One of them is.
pub(super) fn refuse_inputs<'a>(
    world: &dyn World,
    paths: impl IntoIterator<Item = &'a PathBuf>,
    inputs: &[PathBuf],
) -> Result<()> {
    let mut nodes = HashSet::new();
    for input in inputs {
        nodes.extend(world.identity(input)?.and_then(|found| found.node));
    }
    let named: HashSet<&PathBuf> = inputs.iter().collect();
    for path in paths {
        let node = match inputs {
            [] => None,
            _ => world.identity(path)?.and_then(|found| found.node),
        };
        if named.contains(path) || node.is_some_and(|node| nodes.contains(&node)) {
            return Diagnostic::error("the output would replace an input")
                .in_file(path)
                .hint("choose another output")
                .err();
        }
    }
    Ok(())
}

fn plan_writes(world: &dyn World, out: &Path, frames: usize) -> Result<Plan> {
    let pattern = match Pattern::parse(out) {
        Some(pattern) => pattern,
        None if is_folder(world, out)? => Pattern::default_in(out),
        None => return one_file(out, frames),
    };
    let format = format_of(&pattern.path(1))?;
    if !matches!(format.kind, Kind::Mesh(_)) {
        let name = format.name;
        return Diagnostic::error(format!("one {name} file holds all frames"))
            .in_file(out)
            .hint("leave the number out of the name")
            .err();
    }
    let writes = (1..=frames as u64).map(|frame| pattern.path(frame));
    let mut removals: Vec<_> = pattern
        .files(world)
        .unwrap_or_default()
        .into_iter()
        .filter(|(number, _)| *number > frames as u64)
        .collect();
    removals.sort();
    Ok(Plan {
        writes: writes.collect(),
        removals: removals.into_iter().map(|(_, path)| path).collect(),
        format: FormatOf(format),
        stage: pattern.folder,
    })
}

fn one_file(out: &Path, frames: usize) -> Result<Plan> {
    let format = format_of(out)?;
    if matches!(format.kind, Kind::Scene(_) | Kind::Loom) {
        return not_written(format, out).err();
    }
    if frames != 1 && matches!(format.kind, Kind::Mesh(_)) {
        let folder = out.with_extension("");
        return Diagnostic::error(format!(
            "{frames} frames do not fit in one {} file",
            format.name
        ))
        .in_file(out)
        .hint(format!(
            "write a file a frame: {}",
            folder
                .join(format!("frame_####.{}", format.endings[0]))
                .display()
        ))
        .err();
    }
    Ok(Plan {
        writes: vec![out.to_path_buf()],
        removals: Vec::new(),
        format: FormatOf(format),
        stage: out.to_path_buf(),
    })
}

/// What is said of a format that frames are not written to.
pub(super) fn not_written(format: &Format, out: &Path) -> Diagnostic {
    let (message, hint) = match format.kind {
        Kind::Loom => (
            "frames are not a loom".to_string(),
            "fit them: `meshloom fit INPUT -o F.loom`",
        ),
        _ => (
            format!("{} files cannot be written yet", format.name),
            "write .pc2, .mdd, or a file a frame: frame_####.obj",
        ),
    };
    Diagnostic::error(message).in_file(out).hint(hint)
}

/// An existing folder, a name that ends in a separator, or one without an ending.
fn is_folder(world: &dyn World, out: &Path) -> Result<bool> {
    let exists = world.identity(out)?.is_some_and(|found| found.folder);
    let named = out
        .to_string_lossy()
        .ends_with(['/', std::path::MAIN_SEPARATOR]);
    Ok(exists || named || out.extension().is_none())
}

/// Numbered files: `frame_####.obj` or `frame_%04d.obj`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Pattern {
    pub(super) folder: PathBuf,
    before: String,
    digits: usize,
    after: String,
}

impl Pattern {
    /// The pattern that the file name of `path` holds, if it holds one.
    pub(super) fn parse(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let (start, end, digits) = hashes(name).or_else(|| percent(name))?;
        Some(Pattern {
            folder: path.parent()?.to_path_buf(),
            before: name[..start].to_string(),
            digits,
            after: name[end..].to_string(),
        })
    }

    /// `frame_####.obj` in a folder.
    fn default_in(folder: &Path) -> Self {
        Pattern {
            folder: folder.to_path_buf(),
            before: "frame_".to_string(),
            digits: 4,
            after: ".obj".to_string(),
        }
    }

    /// The file of this number.
    pub(super) fn path(&self, number: u64) -> PathBuf {
        let digits = self.digits;
        self.folder
            .join(format!("{}{number:0digits$}{}", self.before, self.after))
    }

    /// The files there that match, with their numbers.
    pub(super) fn files(&self, world: &dyn World) -> Result<Vec<(u64, PathBuf)>> {
        let entries = world.list(parent(&self.folder.join("x")))?;
        let matching = entries.into_iter().filter(|entry| !entry.folder);
        Ok(matching
            .filter_map(|entry| {
                let number = self.number(entry.name.to_str()?)?;
                Some((number, self.folder.join(entry.name)))
            })
            .collect())
    }

    fn number(&self, name: &str) -> Option<u64> {
        let digits = name
            .strip_prefix(self.before.as_str())?
            .strip_suffix(self.after.as_str())?;
        let whole = digits.bytes().all(|byte| byte.is_ascii_digit());
        let padded =
            digits.len() == self.digits || (digits.len() > self.digits && !digits.starts_with('0'));
        (whole && padded).then(|| digits.parse().ok()).flatten()
    }
}

/// The only run of `#` in a name: start, end, digits.
fn hashes(name: &str) -> Option<(usize, usize, usize)> {
    let start = name.find('#')?;
    let end = start
        + name[start..]
            .bytes()
            .take_while(|&byte| byte == b'#')
            .count();
    (!name[end..].contains('#')).then_some((start, end, end - start))
}

/// The first `%d` or `%04d` in a name: start, end, digits.
fn percent(name: &str) -> Option<(usize, usize, usize)> {
    let start = name.find('%')?;
    let width = name[start + 1..]
        .bytes()
        .take_while(u8::is_ascii_digit)
        .count();
    let end = start + 1 + width;
    let digits = match &name[start + 1..end] {
        "" => 1,
        width => width.parse().ok().filter(|digits| *digits <= 18)?,
    };
    (name.as_bytes().get(end) == Some(&b'd')).then_some((start, end + 1, digits))
}
