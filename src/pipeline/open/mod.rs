//! INPUT to a capture in memory: one row of f32, frame after frame.

mod cache;
mod meshes;
mod scene;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::find;
use super::input::InputSpec;
use super::loom::open_as_frames;
use crate::diag::{Diagnostic, Result, Warned};
use crate::format::{self, FirstFrame, Kind, MeshFormat};
use crate::mesh::{FrameSource, Sequence};
use crate::sample::Sampled;
use crate::task::Task;
use crate::world::World;

/// What INPUT held.
#[derive(Debug, Clone)]
pub struct Capture {
    /// The frames.
    pub content: Content,
    /// Where they came from.
    pub origin: Origin,
}

/// Frames, in one form or another.
#[derive(Debug, Clone)]
pub enum Content {
    /// Frames in memory.
    Sequence(Sequence),
    /// A loom at whole times.
    Loom(Arc<Sampled>),
}

/// Where a capture came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Origin {
    /// The name of its format.
    pub format: &'static str,
    /// The files it was read from, in order.
    pub files: Vec<PathBuf>,
    /// Their length together, in bytes.
    pub bytes: u64,
}

/// Opens a capture.
///
/// # Errors
/// Nothing is there, what is there cannot be told apart, a file is damaged, or the frames do not share
/// one connectivity. Cancellation.
pub fn open(world: &dyn World, spec: &InputSpec, task: &Task) -> Result<Warned<Capture>> {
    let files = find::find(world, spec)?;
    let mut warnings = Vec::new();
    let read = match files.format.kind {
        Kind::Mesh(format) => meshes::read(world, spec, &files, format, task)?,
        Kind::Cache(format) => cache::read(world, spec, &files, format, task)?,
        Kind::Scene(format) => scene::read(world, spec, &files, format, task)?,
        Kind::Loom => return open_as_frames(world, spec, &files, task).map(Warned::clean),
    };
    let (sequence, origin) = read.unpack(&mut warnings);
    let fps = spec.fps.or(sequence.fps());
    Ok(Warned {
        output: Capture {
            content: Content::Sequence(sequence.with_fps(fps)),
            origin,
        },
        warnings,
    })
}

/// Refuses a mesh for files that have faces.
pub(super) fn no_mesh(spec: &InputSpec) -> Result<()> {
    match &spec.mesh {
        None => Ok(()),
        Some(mesh) => Diagnostic::error("a mesh is given for files that have faces of their own")
            .in_file(mesh)
            .hint("leave --mesh out: it is for point caches")
            .err(),
    }
}

/// Refuses coordinates of `frame` (from 0) that are not finite.
pub(super) fn finite(positions: &[f32], frame: usize) -> Result<()> {
    match positions.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => Diagnostic::error("a coordinate is not a finite number")
            .at_frame(frame + 1)
            .at_vertex(at / 3 + 1)
            .hint("leave the frame out (--range) or export it again")
            .err(),
    }
}

/// Frames in memory, where they came from, and what should be known about them.
type Read = Warned<(Sequence, Origin)>;

/// Files that are read at the same time hold at most this many bytes more than the frames themselves.
const READ_AHEAD: u64 = 24 << 20;

/// The frame that gives the connectivity.
fn first_frame(world: &dyn World, path: &Path, format: &dyn MeshFormat) -> Result<FirstFrame> {
    let bytes = world.read(path)?;
    let read = format.read_first(&bytes, &path.display().to_string());
    read.map_err(|error| in_file(error, path, &bytes))
}

/// Adds the file to what its format said, and what the file seems to be instead.
pub(super) fn in_file(mut error: Box<Diagnostic>, path: &Path, bytes: &[u8]) -> Box<Diagnostic> {
    error.place.file = Some(path.to_path_buf());
    let ending = path.extension().unwrap_or_default().to_string_lossy();
    match format::by_content(bytes) {
        Some(found) if !found.endings.contains(&&*ending.to_ascii_lowercase()) => {
            let told = Diagnostic::error(format!(
                "by its content this is a {} file, by its ending it is not",
                found.name
            ));
            Box::new(
                told.in_file(path)
                    .hint(format!("name it .{}", found.endings[0])),
            )
        }
        _ if error.hints.is_empty() => Box::new(error.hint(DAMAGED)),
        _ => error,
    }
}

/// What is said where a format had no better hint.
const DAMAGED: &str = "the file may be damaged: export it again";
