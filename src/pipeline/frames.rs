//! Whatever was opened, as frames.

use std::sync::Arc;

use rayon::prelude::*;

use super::open::Content;
use crate::diag::{Diagnostic, Result};
use crate::mesh::{FrameSource, Sequence};
use crate::task::Task;

impl Content {
    /// The frames, to be read one at a time.
    pub fn frames(&self) -> Arc<dyn FrameSource> {
        match self {
            Content::Sequence(sequence) => Arc::new(sequence.clone()),
            Content::Loom(sampled) => Arc::clone(sampled) as Arc<dyn FrameSource>,
        }
    }

    /// The frames in memory; those of a loom are computed now.
    ///
    /// # Errors
    /// A frame cannot be computed; cancellation.
    pub fn sequence(&self, task: &Task) -> Result<Sequence> {
        match self {
            Content::Sequence(sequence) => Ok(sequence.clone()),
            Content::Loom(sampled) => in_memory(&**sampled, task),
        }
    }
}

/// All frames of `source`, fetched in parallel.
///
/// # Errors
/// A frame cannot be computed; cancellation.
pub(super) fn in_memory(source: &dyn FrameSource, task: &Task) -> Result<Sequence> {
    let width = 3 * source.topology().vertices();
    let mut positions = vec![0.0; source.frames() * width];
    let rows = positions.par_chunks_exact_mut(width.max(1));
    rows.enumerate()
        .try_for_each(|(frame, row)| -> Result<()> {
            task.check()?;
            let read = source.read_frame(frame, row);
            read.map_err(|error| {
                Diagnostic::error(format!("the frame cannot be computed: {error}"))
                    .at_frame(frame + 1)
            })?;
            Ok(())
        })?;
    let topology = Arc::clone(source.topology());
    Ok(Sequence::new(topology, positions, source.fps()))
}
