//! Which bridge: the first that does not show, of those that take more and more time, change more of the
//! motion beside the seam, or begin and end where the motion is calmer.

use super::passage::Motion;
use super::plan::{Plan, room};
use super::{bridge_for, shown};
use crate::diag::Result;
use crate::edit::seam::{SHOWS, Seam};
use crate::loom::Loom;
use crate::math::b_spline::Point;

/// What leaves more than this of what showed before does not help; ..
const HELPS: f64 = 0.97;
/// .. and so many longer bridges one after the other that do not are the last.
const IDLE: usize = 3;

/// A motion, and how often the loop is passed through again.
pub(super) struct Search<'a> {
    pub(super) motion: Motion<'a>,
    pub(super) times: usize,
}

/// A pass more.
pub(super) struct Attempt {
    pub(super) plan: Plan,
    /// The control points over a seam.
    pub(super) eased: Vec<Point>,
    pub(super) looped: Loom,
    pub(super) seam: Seam,
    /// How far out the farthest shape of the bridge and of what turns into it is, for 1 of the motion's own.
    pub(super) strangeness: f64,
}

impl Search<'_> {
    /// The loop \[`from`, `to`\] with the bridge that shows least.
    pub(super) fn run(&self, (from, to): (f64, f64)) -> Result<Attempt> {
        let longest = most_bridged((to - from) as usize);
        let asked = self.between((from, to), longest)?;
        if !asked.shows() {
            return Ok(asked);
        }
        let (before, after) = self.motion.clip.calm((from, to), longest / 3);
        if before + after == 0 {
            return Ok(asked);
        }
        let ends = (from - before as f64, to + after as f64);
        let calmer = self.between(ends, longest)?;
        // The ends are not moved for little.
        let helps = !calmer.shows() || calmer.shown() < HELPS * asked.shown();
        Ok(if helps { calmer } else { asked })
    }

    /// The loop with so many frames over the seam, and no more than two spans on either side that turn.
    pub(super) fn bridged(&self, ends: (f64, f64), bridge: usize) -> Result<Attempt> {
        self.attempt(ends, (bridge, [0; 2]), None)
    }

    /// The best found between these ends: a seam that shows is given more time, at most `longest` frames, and
    /// then more of the motion beside it.
    fn between(&self, ends: (f64, f64), longest: usize) -> Result<Attempt> {
        let room = room(self.motion.loom.time(), ends, self.times);
        let wanted = bridge_for(self.motion.loom.time(), ends.0, ends.1).min(longest);
        let mut best = self.bridged(ends, wanted)?;
        let (mut last, mut wide) = (wanted, [0; 2]);
        for doubled in 1.. {
            best = self.lengthened(ends, best, (last, wide), longest)?;
            let wider = room.map(|room| room.min(1 << doubled));
            if !best.shows() || wider == wide {
                break;
            }
            (last, wide) = (best.plan.bridge, wider);
            let next = self.attempt(ends, (last, wide), Some(&best))?;
            let helps = next.shown() < HELPS * best.shown();
            if next.shown() < best.shown() {
                best = next;
            }
            if !helps {
                break;
            }
        }
        Ok(best)
    }

    /// The best after `best` with ever more frames over the seam, the last of which were `last`.
    fn lengthened(
        &self,
        ends: (f64, f64),
        mut best: Attempt,
        (mut last, wide): (usize, [usize; 2]),
        longest: usize,
    ) -> Result<Attempt> {
        let least = if best.shows() { self.least(ends)? } else { 0 };
        let (mut shown, mut idle) = (best.shown(), 0);
        // Where more time and more again show no less, what is left is not the bridge's.
        while best.shows() && idle < IDLE {
            let next = next_length(last, shown).max(least).min(longest);
            if next <= last {
                break;
            }
            let attempt = self.attempt(ends, (next, wide), Some(&best))?;
            (last, shown) = (next, attempt.shown());
            idle = if shown < HELPS * best.shown() {
                0
            } else {
                idle + 1
            };
            if shown < best.shown() {
                best = attempt;
            }
        }
        Ok(best)
    }

    /// Frames that the way over the map from end to end takes at least in steps that do not show.
    fn least(&self, (from, to): (f64, f64)) -> Result<usize> {
        let step = SHOWS * self.motion.clip.step();
        let length = self.motion.passage(to, from)?.length;
        Ok(if step > 0.0 {
            (length / step) as usize
        } else {
            0
        })
    }

    /// A pass with so many frames over the seam, and spans more on either side that may change.
    fn attempt(
        &self,
        (from, to): (f64, f64),
        (bridge, wide): (usize, [usize; 2]),
        known: Option<&Attempt>,
    ) -> Result<Attempt> {
        let known = known.map(|known| (&known.plan, known.eased.as_slice()));
        let plan = Plan::new(self.motion.loom, (from, to), bridge, wide)?;
        let eased = plan.eased(&self.motion, known)?;
        let looped = plan.repeat(self.motion.loom, 1, &eased)?;
        let last = to.floor() as usize;
        let again = (last + bridge + 1, from.floor() as usize + 1);
        // What turns into the bridge counts too.
        let kept = plan.kept(self.motion.loom.time());
        let turned = kept.0 + 1..again.0 + kept.1.saturating_sub(again.1);
        let mut strangeness = 0.0_f64;
        for frame in turned {
            let x = looped.coordinates_at(frame as f64)?;
            strangeness = strangeness.max(self.motion.clip.poses().strangeness(&x));
        }
        Ok(Attempt {
            seam: Seam::measure(self.motion.clip, &looped, last, again),
            strangeness,
            plan,
            eased,
            looped,
        })
    }
}

impl Attempt {
    fn shows(&self) -> bool {
        self.shown() > SHOWS
    }

    /// How much the seam shows, or how strange the shapes are that lead over it, on one scale.
    fn shown(&self) -> f64 {
        shown(&self.seam, self.strangeness)
    }
}

/// Frames of the bridge to try after one that shows so much: accelerations fall as the square of the time.
fn next_length(frames: usize, shown: f64) -> usize {
    let factor = (shown / SHOWS).sqrt().clamp(1.25, 1.5);
    ((factor * frames as f64).ceil() as usize).max(frames + 1)
}

/// The longest bridge of a loop of so many frames.
fn most_bridged(frames: usize) -> usize {
    5 * frames.max(50) / 2
}
