//! INPUT to a capture in memory: the first file gives the connectivity, the others go straight into
//! their place in one row of f32.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::input::{self, Files, InputSpec};
use super::lanes;
use super::loom::open_as_frames;
use crate::diag::{Diagnostic, Result, Warned};
use crate::format::cache::CacheSource;
use crate::format::{self, CacheFormat, FirstFrame, Kind, MeshFormat, SceneFormat};
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
    let files = input::find(world, spec)?;
    let mut warnings = Vec::new();
    let read = match files.format.kind {
        Kind::Mesh(format) => read_meshes(world, spec, &files, format, task)?,
        Kind::Cache(format) => read_cache(world, spec, &files, format, task)?,
        Kind::Scene(format) => read_scene(world, spec, &files, format, task)?,
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

/// One file a frame.
fn read_meshes(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn MeshFormat,
    task: &Task,
) -> Result<Warned<(Sequence, Origin)>> {
    no_mesh(spec)?;
    let range = spec.range.unwrap_or_default().within(files.paths.len())?;
    let paths = &files.paths[range];
    task.phase("load", paths.len());
    let mut bytes = 0;
    for path in paths {
        bytes += world.identity(path)?.map_or(0, |found| found.length);
    }
    let first = first_frame(world, &paths[0], format)?;
    task.step();
    let width = first.positions.len();
    let mut positions = vec![0.0; width * paths.len()];
    positions[..width].copy_from_slice(&first.positions);
    let rest = positions[width..].chunks_exact_mut(width).zip(&paths[1..]);
    let longest = bytes / paths.len() as u64;
    let lanes = lanes::within(READ_AHEAD + 4 * (width * paths.len()) as u64, longest);
    lanes::run(rest, lanes, task, |buffer: &mut Vec<u8>, (target, path)| {
        world.read_into(path, buffer)?;
        let read = format.read_next(buffer, &first, target);
        read.map_err(|error| in_file(error, path, buffer))
    })?;
    let origin = Origin {
        format: files.format.name,
        files: paths.to_vec(),
        bytes,
    };
    let sequence = Sequence::new(first.topology, positions, first.fps);
    Ok(Warned {
        output: (sequence, origin),
        warnings: input::gaps(paths),
    })
}

/// One cache with the faces of a mesh.
fn read_cache(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn CacheFormat,
    task: &Task,
) -> Result<Warned<(Sequence, Origin)>> {
    let path = files.only()?;
    let Some(mesh) = spec.mesh.as_ref().or(files.mesh.as_ref()) else {
        return Diagnostic::error(format!("a {} cache has no faces", files.format.name))
            .in_file(path)
            .hint("name the mesh they come from: --mesh BASE.obj")
            .err();
    };
    let source = CacheFile::open(world, path)?;
    let header = format.header(&source);
    let header = header.map_err(|error| source.in_file(error))?;
    let base = base_mesh(world, mesh)?;
    if base.topology.vertices() != header.vertices {
        return Diagnostic::error(format!(
            "{} points a frame, but {} has {} vertices",
            header.vertices,
            mesh.display(),
            base.topology.vertices()
        ))
        .in_file(path)
        .hint("the mesh must be the one that the cache was made from")
        .err();
    }
    let range = spec.range.unwrap_or_default().within(header.frames)?;
    task.phase("load", range.len());
    let width = 3 * header.vertices;
    let mut positions = vec![0.0; width * range.len()];
    let frames = positions.chunks_exact_mut(width).zip(range);
    let lanes = lanes::within(READ_AHEAD, header.frame_bytes());
    lanes::run(
        frames,
        lanes,
        task,
        |buffer: &mut Vec<u8>, (target, frame)| {
            buffer.resize(4 * width, 0);
            let start = header.start + frame as u64 * header.frame_bytes();
            world.read_range(path, start, buffer)?;
            format.decode(buffer, target);
            finite(target, frame).map_err(|error| source.in_file(error))
        },
    )?;
    let origin = Origin {
        format: files.format.name,
        files: vec![path.clone(), mesh.clone()],
        bytes: source.length,
    };
    let sequence = Sequence::new(base.topology, positions, header.fps);
    Ok(Warned::clean((sequence, origin)))
}

/// One animation of a scene.
fn read_scene(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn SceneFormat,
    task: &Task,
) -> Result<Warned<(Sequence, Origin)>> {
    no_mesh(spec)?;
    let path = files.only()?;
    task.phase("load", 1);
    let bytes = world.read(path)?;
    let resource = |name: &str| world.read(&input::parent(path).join(name));
    let read = format.read(&bytes, files.animation.as_deref(), &resource);
    let read = read.map_err(|error| match error.place.file {
        Some(_) => error,
        None => in_file(error, path, &bytes),
    })?;
    let warnings = read.warnings.into_iter();
    let warnings = warnings.map(|warning| warning.in_file(path)).collect();
    let sequence = read.output;
    let range = spec.range.unwrap_or_default().within(sequence.frames())?;
    for frame in range.clone() {
        finite(sequence.frame(frame), frame).map_err(|error| Box::new(error.in_file(path)))?;
    }
    let origin = Origin {
        format: files.format.name,
        files: vec![path.clone()],
        bytes: bytes.len() as u64,
    };
    Ok(Warned {
        output: (sequence.slice(range), origin),
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

/// The mesh of a cache.
fn base_mesh(world: &dyn World, path: &Path) -> Result<FirstFrame> {
    let format = input::format_of(path)?;
    match format.kind {
        Kind::Mesh(format) => first_frame(world, path, format),
        _ => Diagnostic::error(format!("a {} file is not a mesh", format.name))
            .in_file(path)
            .hint("name an OBJ or PLY file")
            .err(),
    }
}

/// A cache in the world.
struct CacheFile<'a> {
    world: &'a dyn World,
    path: &'a Path,
    length: u64,
}

impl<'a> CacheFile<'a> {
    fn open(world: &'a dyn World, path: &'a Path) -> Result<Self> {
        let length = world.identity(path)?.map_or(0, |found| found.length);
        Ok(CacheFile {
            world,
            path,
            length,
        })
    }

    /// Adds the file to what its format said, and what the file seems to be instead.
    fn in_file(&self, error: Box<Diagnostic>) -> Box<Diagnostic> {
        let mut head = vec![0; usize::try_from(self.length.min(64)).unwrap_or(0)];
        let _ = self.world.read_range(self.path, 0, &mut head);
        in_file(error, self.path, &head)
    }
}

impl CacheSource for CacheFile<'_> {
    fn length(&self) -> u64 {
        self.length
    }

    fn read(&self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        self.world.read_range(self.path, offset, bytes)
    }
}

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
