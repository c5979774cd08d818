//! A file a frame: the first gives the connectivity, the others go straight into their place.

use super::{Origin, READ_AHEAD, Read, first_frame, in_file, no_mesh};
use crate::diag::{Result, Warned};
use crate::format::MeshFormat;
use crate::mesh::Sequence;
use crate::pipeline::find::Files;
use crate::pipeline::input::InputSpec;
use crate::pipeline::{lanes, numbering};
use crate::task::Task;
use crate::world::World;

/// Reads the files in parallel, each lane into its own buffer.
pub(super) fn read(
    world: &dyn World,
    spec: &InputSpec,
    files: &Files,
    format: &dyn MeshFormat,
    task: &Task,
) -> Result<Read> {
    no_mesh(spec)?;
    let range = spec.range.unwrap_or_default().within(files.paths.len())?;
    let paths = &files.paths[range];
    task.phase("load", paths.len());
    let (mut bytes, mut longest) = (0, 0);
    for path in paths {
        let length = world.identity(path)?.map_or(0, |found| found.length);
        bytes += length;
        longest = length.max(longest);
    }
    let first = first_frame(world, &paths[0], format)?;
    task.step();
    let width = first.positions.len();
    let mut positions = vec![0.0; width * paths.len()];
    positions[..width].copy_from_slice(&first.positions);
    let rest = positions[width..].chunks_exact_mut(width).zip(&paths[1..]);
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
        warnings: numbering::gaps(paths),
    })
}
