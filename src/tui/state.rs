//! What the studio knows.

use std::sync::Arc;

use ratatui::layout::Rect;

use super::graphics::CellSize;
use super::hands::Hands;
use super::layout;
use super::panels::PANELS;
use super::posed::{KeyScene, PoseScene};
use super::theme::Look;
use super::thumbs::{Thumb, ThumbWish};
use super::work::{Picture, Wish};
use crate::loom::Loom;
use crate::mesh::{Bounds, FrameSource, Sequence};
use crate::plot::{PoseSpace, TimeSignals};

/// A cell needs this many pixels in height for letters in pictures to be read.
const LEGIBLE: u16 = 10;
/// Playback at this rate where the capture has none.
const DEFAULT_FPS: f64 = 25.0;

/// Everything that is drawn or decided upon.
#[derive(Debug)]
pub(super) struct State {
    /// What is open, as the user named it.
    pub(super) name: String,
    /// What has been read of it so far.
    pub(super) content: Content,
    /// When in it we are.
    pub(super) playback: Playback,
    /// A place off the curve, whose pose is shown instead.
    pub(super) roaming: Option<[f64; 2]>,
    /// The part of the map that is shown; none: all.
    pub(super) window: Option<[[f64; 2]; 2]>,
    /// The small meshes behind the map.
    pub(super) thumbs: Thumbs,
    /// How the mesh is looked at.
    pub(super) mesh: MeshView,
    /// The capture, for the errors of its vertices; none where a loom was opened.
    pub(super) capture: Option<Scene<Sequence>>,
    /// The loom as it was first there.
    pub(super) fitted: Option<Scene<Loom>>,
    /// What else the mesh panel shows.
    pub(super) aspect: Aspect,
    /// Where the mouse was last seen.
    pub(super) hover: Option<(u16, u16)>,
    /// Columns and rows.
    pub(super) size: (u16, u16),
    /// Pixels of a cell in pictures.
    pub(super) cell: CellSize,
    /// Colours.
    pub(super) look: Look,
    /// Whether the font may lack everything but ASCII.
    pub(super) plain_letters: bool,
    /// Index of the panel that keys speak to.
    pub(super) focus: usize,
    /// Whether it fills the screen.
    pub(super) enlarged: bool,
    /// What stands in front of the panels.
    pub(super) front: Option<Front>,
    /// A word to the user.
    pub(super) notice: Option<Notice>,
    /// The work in the background: phase, steps done, and of how many.
    pub(super) work: Option<(&'static str, usize, usize)>,
    /// Pictures of the panels.
    pub(super) slots: Vec<Slot>,
    /// Whether pictures may be coarse, for what they show is being moved.
    pub(super) rough: bool,
    /// What the mouse holds.
    pub(super) drag: Option<Drag>,
    /// Numbers given to questions so far.
    pub(super) asked: u64,
    /// The recipe, and what is done to it by hand.
    pub(super) hands: Hands,
}

/// What has been read.
#[derive(Debug, Clone, Default)]
pub(super) enum Content {
    /// Nothing yet.
    #[default]
    Nothing,
    /// The first frame, while the others are read.
    FirstFrame(Scene<Sequence>),
    /// The frames, while a loom is fitted.
    Capture(Scene<Sequence>),
    /// The loom, and what its plots show.
    Loom(Scene<Loom>, Same<Signals>),
    /// Key poses and the motion through them.
    Keys(KeyScene),
    /// Poses and their principal components.
    Poses(PoseScene),
}

/// A loom's series for plots.
#[derive(Debug, Clone, Default)]
pub(super) struct Signals {
    /// The map.
    pub(super) map: PoseSpace,
    /// Over time.
    pub(super) times: TimeSignals,
}

/// Something to look at and the box around all of it.
pub(super) struct Scene<T> {
    /// What is looked at.
    pub(super) of: Same<T>,
    /// The box.
    pub(super) bounds: Bounds,
}

/// A shared value; two are equal when they are the same one.
pub(super) struct Same<T>(pub(super) Arc<T>);

impl<T> Same<T> {
    pub(super) fn new(value: T) -> Self {
        Same(Arc::new(value))
    }
}

impl<T> Clone for Same<T> {
    fn clone(&self) -> Self {
        Same(Arc::clone(&self.0))
    }
}

impl<T> PartialEq for Same<T> {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}

impl<T> Clone for Scene<T> {
    fn clone(&self) -> Self {
        Scene {
            of: self.of.clone(),
            bounds: self.bounds,
        }
    }
}

impl<T> PartialEq for Scene<T> {
    fn eq(&self, other: &Self) -> bool {
        self.of == other.of
    }
}

impl<T> std::fmt::Debug for Scene<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.of.fmt(f)
    }
}

impl<T> std::fmt::Debug for Same<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Same({:p})", Arc::as_ptr(&self.0))
    }
}

/// When in the capture we are; times in frames, from 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Playback {
    /// Now.
    pub(super) t: f64,
    /// Whether time passes.
    pub(super) playing: bool,
    /// How fast: 1 is the capture's own rate.
    pub(super) speed: f64,
    /// Where the loop begins and ends.
    pub(super) marks: [Option<f64>; 2],
}

/// A range of times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) from: f64,
    pub(super) to: f64,
}

/// How the mesh is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeshView {
    pub(super) yaw: f64,
    pub(super) pitch: f64,
    /// Of what would show everything.
    pub(super) zoom: f64,
    pub(super) wires: bool,
    pub(super) onion: bool,
}

/// What else the mesh panel shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) enum Aspect {
    /// Nothing.
    #[default]
    Plain,
    /// How far each vertex is from the capture's, as colour.
    Errors,
    /// The capture, or the loom as it was first there, beside what became of it.
    Before,
}

/// The small meshes behind the map.
#[derive(Debug, Default)]
pub(super) struct Thumbs {
    /// Whether they are not wanted.
    pub(super) off: bool,
    pub(super) shown: Option<Same<Vec<Thumb>>>,
    /// Number of the question that `shown` answers.
    pub(super) number: u64,
    pub(super) asked: Option<ThumbWish>,
}

/// What stands in front of the panels.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Front {
    /// The keys, from this line on.
    Help(u16),
    /// A search over actions: what was typed, and which of those found is chosen.
    Palette(String, usize),
}

/// A word to the user.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Notice {
    pub(super) text: String,
    pub(super) bad: bool,
}

/// The picture of a panel: what is shown, and what was asked for.
#[derive(Debug, Default)]
pub(super) struct Slot {
    pub(super) shown: Option<Arc<Picture>>,
    /// What was shown a moment ago, with its data elsewhere: who presses now may have aimed at it.
    pub(super) before: Option<Arc<Picture>>,
    /// Number of the question that `shown` answers.
    pub(super) number: u64,
    pub(super) asked: Option<Wish>,
}

impl Slot {
    /// Another picture takes the place of the one that is shown.
    pub(super) fn show(&mut self, picture: Arc<Picture>) {
        let last = self.shown.replace(picture);
        let moved = |last: &Arc<Picture>| {
            let of = self.shown.as_ref().map(|now| (&now.planes, &now.of));
            of != Some((&last.planes, &last.of))
        };
        if let Some(last) = last.filter(moved) {
            self.before = Some(last);
        }
    }
}

/// What the mouse holds, and where it was last.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drag {
    /// Index of the panel in which it was pressed.
    pub(super) panel: usize,
    pub(super) column: u16,
    pub(super) row: u16,
    /// Whether the view is dragged, not the cursor.
    pub(super) view: bool,
}

impl State {
    /// Before anything is read.
    pub(super) fn new(name: String, size: (u16, u16), cell: CellSize, look: Look) -> Self {
        State {
            name,
            content: Content::Nothing,
            playback: Playback {
                t: 1.0,
                playing: false,
                speed: 1.0,
                marks: [None; 2],
            },
            roaming: None,
            window: None,
            thumbs: Thumbs::default(),
            mesh: MeshView::default(),
            capture: None,
            fitted: None,
            aspect: Aspect::default(),
            hover: None,
            size,
            cell,
            look,
            plain_letters: false,
            focus: 0,
            enlarged: false,
            front: None,
            notice: None,
            work: None,
            slots: PANELS.iter().map(|_| Slot::default()).collect(),
            rough: false,
            drag: None,
            asked: 0,
            hands: Hands::default(),
        }
    }

    /// n, or 1 before anything is known.
    pub(super) fn frames(&self) -> usize {
        match &self.content {
            Content::Nothing | Content::FirstFrame(_) => 1,
            Content::Capture(scene) => scene.of.0.frames().max(1),
            Content::Loom(scene, _) => scene.of.0.frames().max(1),
            Content::Keys(keys) => keys.motion().frames().len().max(1),
            Content::Poses(poses) => poses.poses.of.0.frames().max(1),
        }
    }

    /// Key poses and the motion through them, where that is what is open.
    pub(super) fn keys(&self) -> Option<&KeyScene> {
        match &self.content {
            Content::Keys(keys) => Some(keys),
            _ => None,
        }
    }

    /// Poses and their principal components, where those are open.
    pub(super) fn poses(&self) -> Option<&PoseScene> {
        match &self.content {
            Content::Poses(poses) => Some(poses),
            _ => None,
        }
    }

    /// Where a frame lies on the axis of time: the time of a motion through keys, else the frame itself.
    pub(super) fn on_axis(&self, t: f64) -> f64 {
        self.keys().map_or(t, |keys| keys.motion().time_at(t))
    }

    /// The frame at a place of the axis of time.
    pub(super) fn off_axis(&self, time: f64) -> f64 {
        self.keys()
            .map_or(time, |keys| keys.motion().frame_at(time))
    }

    /// Whether places of the map off its curve have shapes.
    pub(super) fn roams(&self) -> bool {
        match &self.content {
            Content::Loom(..) | Content::Poses(_) => true,
            Content::Keys(keys) => keys.motion().motion().report().ghost.is_none(),
            _ => false,
        }
    }

    /// Frames per second for playback.
    pub(super) fn fps(&self) -> f64 {
        let known = match &self.content {
            Content::Nothing => None,
            Content::FirstFrame(scene) | Content::Capture(scene) => scene.of.0.fps(),
            Content::Loom(scene, _) => scene.of.0.fps(),
            Content::Keys(keys) => keys.fps(),
            Content::Poses(poses) => poses.poses.of.0.fps(),
        };
        known.unwrap_or(DEFAULT_FPS)
    }

    /// The loom, once there is one.
    pub(super) fn loom(&self) -> Option<&Arc<Loom>> {
        match &self.content {
            Content::Loom(scene, _) => Some(&scene.of.0),
            _ => None,
        }
    }

    /// What the plots show, once there is something.
    pub(super) fn signals(&self) -> Option<&Same<Signals>> {
        match &self.content {
            Content::Loom(_, signals) => Some(signals),
            Content::Keys(keys) => Some(&keys.signals),
            Content::Poses(poses) => Some(&poses.signals),
            _ => None,
        }
    }

    /// Where the cursor stands on the map: off the curve, or at f(t).
    pub(super) fn cursor(&self) -> Option<[f64; 2]> {
        let t = self.playback.t;
        let on_curve = || match &self.content {
            Content::Loom(scene, _) => scene.of.0.position_at(t).ok(),
            Content::Keys(keys) => Some(keys.motion().place(keys.motion().time_at(t))),
            Content::Poses(poses) => {
                let last = poses.poses.of.0.frames().saturating_sub(1);
                let pose = (t.round().max(1.0) as usize - 1).min(last);
                Some(poses.found.of.0.place(pose))
            }
            _ => None,
        };
        self.roaming.or_else(on_curve)
    }

    /// Between the marks, or everything.
    pub(super) fn span(&self) -> Span {
        let [from, to] = self.playback.marks;
        let (from, to) = (from.unwrap_or(1.0), to.unwrap_or(self.frames() as f64));
        Span {
            from: from.min(to),
            to: from.max(to),
        }
    }

    /// The panels on the screen and where, borders included.
    pub(super) fn places(&self) -> Vec<(usize, Rect)> {
        layout::places(self.size, self.focus, self.enlarged)
    }

    /// Where the picture of a panel lies whose borders are `area`.
    pub(super) fn canvas(&self, panel: usize, area: Rect) -> Rect {
        PANELS[panel].canvas(self, layout::inner(area))
    }

    /// Whether something is to be done once nothing happens any more.
    pub(super) fn is_unsettled(&self) -> bool {
        self.rough || self.slots.iter().any(|slot| slot.before.is_some())
    }

    /// Pictures are drawn with so many times fewer pixels each way.
    pub(super) fn coarseness(&self) -> u16 {
        if self.rough && self.cell.scales { 2 } else { 1 }
    }

    /// Whether pictures have pixels enough for letters.
    pub(super) fn lettered(&self) -> bool {
        self.cell.height >= LEGIBLE
    }

    /// Text in letters that the font has.
    pub(super) fn written(&self, text: String) -> String {
        if !self.plain_letters {
            return text;
        }
        text.replace('−', "-").replace('₁', "1").replace('₂', "2")
    }

    /// What fits into `area` as a picture, in pixels.
    pub(super) fn pixels(&self, area: Rect) -> (usize, usize) {
        let across = usize::from(area.width) * usize::from(self.cell.width);
        let down = usize::from(area.height) * usize::from(self.cell.height);
        let coarse = usize::from(self.coarseness());
        ((across / coarse).max(1), (down / coarse).max(1))
    }
}

impl Default for MeshView {
    fn default() -> Self {
        MeshView {
            yaw: 0.6,
            pitch: 0.25,
            zoom: 1.0,
            wires: false,
            onion: false,
        }
    }
}
