//! What can be done to a loom: one verb a file, each pure. A loom goes in, a new one that shares whatever
//! it did not change comes out, with what should be known about it.
//!
//! Times and frames count from 1, as people count them; so do control points.

mod add_loop;
mod add_pose;
mod exaggerate;
mod extend;
mod find_loop;
mod forward;
mod hold;
mod insert_control;
mod move_control;
mod path;
mod poses;
mod retime;
mod reverse;
mod seam;
mod smooth;
mod speed;
pub mod transfer;
mod trim;

use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::math::b_spline::Point;
use crate::signal::time::TimeError;
use crate::task::Task;

pub use add_loop::{Looped, add_loop};
pub use add_pose::add_pose;
pub use exaggerate::exaggerate;
pub use extend::extend;
pub use find_loop::find_loop;
pub use hold::hold;
pub use insert_control::insert_control;
pub use move_control::move_control;
pub use path::{Sketch, path};
pub use retime::retime;
pub use reverse::reverse;
pub use seam::Seam;
pub use smooth::smooth;
pub use speed::speed;
pub use trim::trim;

/// An edit as data: for undo, previews and remembered results.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// See [`move_control`].
    MoveControl {
        /// Which control point, from 1.
        control: usize,
        /// Where to.
        to: Point,
    },
    /// See [`insert_control`].
    InsertControl {
        /// When.
        time: f64,
    },
    /// See [`add_loop`].
    AddLoop {
        /// Start of the loop.
        from: f64,
        /// Its end.
        to: f64,
        /// How many passes more.
        times: usize,
        /// Frames between the passes; none: as many as it takes.
        bridge: Option<usize>,
    },
    /// See [`extend`].
    Extend {
        /// How many frames.
        frames: usize,
    },
    /// See [`trim`].
    Trim {
        /// First time kept.
        from: f64,
        /// Last time kept.
        to: f64,
    },
    /// See [`reverse`].
    Reverse,
    /// See [`hold`].
    Hold {
        /// When.
        time: f64,
        /// How many frames.
        frames: usize,
    },
    /// See [`speed`].
    Speed {
        /// Start of the stretch.
        from: f64,
        /// Its end.
        to: f64,
        /// How many times as fast.
        factor: f64,
    },
    /// See [`retime`].
    Retime {
        /// Output time and source time of each key.
        keys: Vec<[f64; 2]>,
    },
    /// See [`smooth`].
    Smooth {
        /// Start of the stretch.
        from: f64,
        /// Its end.
        to: f64,
        /// How far, 0 to 1.
        amount: f64,
    },
    /// See [`path`].
    Path {
        /// Points of the map, in order.
        points: Vec<Point>,
        /// What they are to the curve.
        sketch: Sketch,
        /// How many frames; none: as many as before.
        frames: Option<usize>,
    },
    /// See [`exaggerate`].
    Exaggerate {
        /// By what differences from the mean shape are multiplied.
        amount: f64,
    },
}

impl Edit {
    /// Does it.
    ///
    /// # Errors
    /// What the verb says: times outside \[1, n\], counts and amounts that make no sense; `task` was cancelled.
    pub fn apply(&self, loom: &Loom, task: &Task) -> Result<Warned<Loom>> {
        match self {
            Edit::MoveControl { control, to } => clean(move_control(loom, *control, *to)),
            Edit::InsertControl { time } => clean(insert_control(loom, *time)),
            Edit::AddLoop {
                from,
                to,
                times,
                bridge,
            } => Ok(add_loop(loom, *from, *to, *times, *bridge, task)?.into()),
            Edit::Extend { frames } => extend(loom, *frames, task),
            Edit::Trim { from, to } => trim(loom, *from, *to),
            Edit::Reverse => clean(reverse(loom)),
            Edit::Hold { time, frames } => clean(hold(loom, *time, *frames)),
            Edit::Speed { from, to, factor } => speed(loom, *from, *to, *factor),
            Edit::Retime { keys } => clean(retime(loom, keys)),
            Edit::Smooth { from, to, amount } => clean(smooth(loom, *from, *to, *amount)),
            Edit::Path {
                points,
                sketch,
                frames,
            } => path(loom, points, *sketch, *frames),
            Edit::Exaggerate { amount } => clean(exaggerate(loom, *amount)),
        }
    }
}

fn clean(loom: Result<Loom>) -> Result<Warned<Loom>> {
    loom.map(Warned::clean)
}

/// Refuses a time outside \[1, n\].
fn check_time(loom: &Loom, t: f64) -> Result<()> {
    loom.position_at(t).map(|_| ())
}

/// Refuses a stretch that leaves \[1, n\] or does not run forwards.
fn check_stretch(loom: &Loom, from: f64, to: f64) -> Result<()> {
    check_time(loom, from)?;
    check_time(loom, to)?;
    if from >= to {
        let message = format!("the stretch from {from} to {to} has no length");
        return Diagnostic::error(message)
            .hint("the first time must lie before the second")
            .err();
    }
    Ok(())
}

/// Frames that one edit may add: beyond this the request is a slip.
const MOST_FRAMES: usize = 1_000_000;

/// Refuses counts of frames that nobody means.
fn check_frames(frames: usize) -> Result<()> {
    if frames > MOST_FRAMES {
        return Diagnostic::error(format!("{frames} frames are too many"))
            .hint(format!("one edit adds at most {MOST_FRAMES}"))
            .err();
    }
    Ok(())
}

/// What an edit could not make a time signal of; the checks before should have told.
fn impossible(error: TimeError) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(format!(
        "the edit leaves no time signal: {error:?}"
    )))
}
