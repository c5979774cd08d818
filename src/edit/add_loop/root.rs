//! Root motion of a loop: every pass begins where the one before has arrived.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::plan::{Frame, Source};
use crate::diag::{Diagnostic, Result};
use crate::math::rotation;
use crate::signal::root::{RootFrame, RootSignal};

/// The root motion of all frames; each pass adds the loop's increment and the bridge's.
pub(super) fn repeated(
    root: &RootSignal,
    (from, to): (f64, f64),
    bridge: usize,
    frames: &[Frame],
) -> Result<RootSignal> {
    let (a, b) = (root.frame_at(from), root.frame_at(to));
    let drift = Drift::new(&a, &b);
    let after = drift.after(&b, bridge as f64);
    let increment = motion(&after) * motion(&a).inverse();
    let mut carried = vec![Isometry3::identity()];
    let passes = frames.last().map_or(0, |frame| frame.pass);
    for pass in 0..passes {
        carried.push(increment * carried[pass]);
    }
    let begin = to.fract();
    let frame = |frame: &Frame| match frame.source {
        Source::Frame(i) if frame.pass == 0 => root.frames()[i],
        Source::Frame(i) => root.carried(&root.frames()[i], &carried[frame.pass]),
        Source::Bridge(i) => {
            root.carried(&drift.after(&b, i as f64 - begin), &carried[frame.pass - 1])
        }
    };
    root.with_frames(frames.iter().map(frame).collect())
        .map_err(|e| {
            Box::new(Diagnostic::error("the root motion is not finite").at_frame(e.frame + 1))
        })
}

/// How the body travels on while it is led from the end of the loop to its start: with the mean of the
/// velocities there, in its own axes.
struct Drift {
    spin: Vector3<f64>,
    slope: Vector3<f64>,
}

impl Drift {
    fn new(a: &RootFrame, b: &RootFrame) -> Self {
        let own = |frame: &RootFrame| frame.rotation.inverse() * frame.slope;
        Drift {
            spin: (a.spin + b.spin) * 0.5,
            slope: (own(a) + own(b)) * 0.5,
        }
    }

    /// The state `frames` frames after `b`.
    fn after(&self, b: &RootFrame, frames: f64) -> RootFrame {
        let rotation = b.rotation * rotation::exp(&(self.spin * frames));
        let halfway = b.rotation * rotation::exp(&(self.spin * (0.5 * frames)));
        RootFrame {
            rotation,
            position: b.position + halfway * self.slope * frames,
            spin: self.spin,
            slope: rotation * self.slope,
        }
    }
}

/// A state as a motion of space that takes the body at the origin there.
fn motion(frame: &RootFrame) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(frame.position), frame.rotation)
}
