//! A point cache: many frames in one file, faces from a mesh.

use std::path::Path;

use super::{Origin, READ_AHEAD, Read, finite, first_frame, in_file};
use crate::diag::{Diagnostic, Result, Warned};
use crate::format::cache::CacheSource;
use crate::format::{CacheFormat, FirstFrame, Kind};
use crate::mesh::Sequence;
use crate::pipeline::find::{Files, format_of};
use crate::pipeline::input::InputSpec;
use crate::pipeline::lanes;
use crate::task::Task;
use crate::world::World;

/// Reads the frames in parallel, straight into their place.
pub(super) fn read(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn CacheFormat,
    task: &Task,
) -> Result<Read> {
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

/// The mesh of a cache.
fn base_mesh(world: &dyn World, path: &Path) -> Result<FirstFrame> {
    let format = format_of(path)?;
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
