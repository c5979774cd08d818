//! The mesh at the cursor.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{MESH, Panel, posed, read_out};
use crate::mesh::{FrameSource, Sequence};
use crate::tui::state::{Aspect, Content, Scene, State};
use crate::tui::theme::Role;
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
            (Content::Keys(keys), at) => posed::motion(state, keys, at),
            (Content::Poses(poses), Some(at)) => Pose::Modes(poses.found.clone(), at),
            (Content::Poses(poses), None) => Pose::Frame(poses.poses.clone(), posed::pose(state)),
        };
        let (mut capture, mut before) = (None, None);
        match state.aspect {
            Aspect::Plain => {}
            Aspect::Errors => capture = comparable(state),
            Aspect::Before => before = self.before(state),
        }
        Some(Subject::Mesh {
            pose,
            view: state.mesh,
            capture,
            before,
        })
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let Some(picture) = &state.slots[MESH].shown else {
            return;
        };
        let muted = state.look.style(Role::Muted).patch(state.look.bar());
        read_out(state, Role::Muted, &picture.note, area, buffer);
        if state.aspect == Aspect::Before && self.before(state).is_some() && area.width >= 20 {
            let middle = area.x + area.width / 2;
            buffer.set_string(area.x, area.y, " before ", muted);
            buffer.set_string(middle, area.y, " now ", muted);
        }
    }
}

impl Mesh {
    /// The capture's frame at that time of it, or the loom as it was first there.
    fn before(&self, state: &State) -> Option<Pose> {
        if let (None, Some(capture), Some(loom)) = (state.roaming, &state.capture, state.loom()) {
            let (source, _) = loom.time().source_time(state.playback.t)?;
            let frame = (source.round().max(1.0) as usize - 1).min(capture.of.0.frames() - 1);
            return Some(Pose::Frame(capture.clone(), frame));
        }
        let scene = state.fitted.clone()?;
        let last = scene.of.0.frames() as f64;
        Some(match state.roaming {
            Some(at) => Pose::Place(scene, at),
            None => Pose::Time(scene, state.playback.t.min(last)),
        })
    }
}

/// The capture, where the loom's frames are still its frames.
pub(in crate::tui) fn comparable(state: &State) -> Option<Scene<Sequence>> {
    let (loom, capture) = (state.loom()?, state.capture.as_ref()?);
    let same = loom.frames() == capture.of.0.frames() && loom.time().warps().is_empty();
    same.then(|| capture.clone())
}
