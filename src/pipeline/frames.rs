//! Whatever was opened, as frames.

use super::open::Content;
use crate::mesh::FrameSource;

impl Content {
    /// The frames, to be read one at a time.
    pub fn frames(&self) -> Box<dyn FrameSource> {
        match self {
            Content::Sequence(sequence) => Box::new(sequence.clone()),
        }
    }
}
