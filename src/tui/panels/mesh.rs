//! The mesh at the cursor.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::Panel;
use crate::tui::state::{Content, State};
use crate::tui::work::{Pose, Subject};

/// The mesh at the cursor.
pub(super) struct Mesh;

impl Panel for Mesh {
    fn title(&self) -> &'static str {
        "mesh"
    }

    fn subject(&self, state: &State) -> Option<Subject> {
        let t = state.playback.t;
        let pose = match (&state.content, state.roaming) {
            (Content::Nothing, _) => return None,
            (Content::FirstFrame(scene), _) => Pose::Frame(scene.clone(), 0),
            (Content::Capture(scene), _) => {
                let last = state.frames() - 1;
                Pose::Frame(
                    scene.clone(),
                    (t.round() as usize).saturating_sub(1).min(last),
                )
            }
            (Content::Loom(scene, _), None) => Pose::Time(scene.clone(), t),
            (Content::Loom(scene, _), Some(at)) => Pose::Place(scene.clone(), at),
        };
        Some(Subject::Mesh(pose, state.mesh))
    }

    fn draw(&self, _: &State, _: Rect, _: &mut Buffer) {}
}
