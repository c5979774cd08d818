//! Which bridge: the first that does not show, of those that take more and more time, change more of the
//! motion beside the seam, or begin and end where the motion is calmer.

use super::plan::{Plan, room};
use super::{SHOWS, bridge_for};
use crate::diag::Result;
use crate::edit::seam::{Clip, Seam};
use crate::loom::Loom;
use crate::math::b_spline::Point;
use crate::task::Task;

/// More spans that change are tried while they take off this part of what shows at least.
const HELPS: f64 = 0.05;

/// A loom without changes of time, and how often the loop is passed through again.
pub(super) struct Search<'a> {
    pub(super) loom: &'a Loom,
    pub(super) clip: &'a Clip,
    pub(super) task: &'a Task,
    pub(super) times: usize,
}

/// A pass more.
pub(super) struct Attempt {
    pub(super) plan: Plan,
    /// The control points over a seam.
    pub(super) eased: Vec<Point>,
    pub(super) looped: Loom,
    pub(super) seam: Seam,
}

impl Search<'_> {
    /// The loop \[`from`, `to`\] with the bridge that shows least.
    pub(super) fn run(&self, (from, to): (f64, f64)) -> Result<Attempt> {
        let longest = most_bridged((to - from) as usize);
        let asked = self.between((from, to), longest)?;
        if !asked.shows() {
            return Ok(asked);
        }
        let (before, after) = self.clip.calm((from, to), longest / 3);
        if before + after == 0 {
            return Ok(asked);
        }
        let ends = (from - before as f64, to + after as f64);
        let calmer = self.between(ends, longest - before - after)?;
        let better = calmer.seam.worst() < asked.seam.worst();
        Ok(if better { calmer } else { asked })
    }

    /// The same with so many frames over the seam, of which nothing more than two spans on either side
    /// change.
    pub(super) fn bridged(&self, ends: (f64, f64), bridge: usize) -> Result<Attempt> {
        self.attempt(ends, (bridge, [0; 2]), None)
    }

    /// The best found between these ends: a seam that shows is given more time, at most `longest` frames, and
    /// then more of the motion beside it.
    fn between(&self, ends: (f64, f64), longest: usize) -> Result<Attempt> {
        let room = room(self.loom.time(), ends, self.times);
        let wanted = bridge_for(self.loom.time(), ends.0, ends.1).min(longest);
        let mut best = self.bridged(ends, wanted)?;
        let (mut last, mut wide) = (wanted, [0; 2]);
        for doubled in 1.. {
            best = self.longer(ends, best, (last, wide), longest)?;
            let wider = room.map(|room| room.min(1 << doubled));
            if !best.shows() || wider == wide {
                break;
            }
            (last, wide) = (best.plan.bridge, wider);
            let next = self.attempt(ends, (last, wide), Some(&best))?;
            let helps = next.seam.worst() < (1.0 - HELPS) * best.seam.worst();
            if next.seam.worst() < best.seam.worst() {
                best = next;
            }
            if !helps {
                break;
            }
        }
        Ok(best)
    }

    /// The best after `best` with ever more frames over the seam, the last of which were `last`.
    fn longer(
        &self,
        ends: (f64, f64),
        mut best: Attempt,
        (mut last, wide): (usize, [usize; 2]),
        longest: usize,
    ) -> Result<Attempt> {
        let mut shown = best.seam.worst();
        while best.shows() {
            let next = longer(last, shown).min(longest);
            // Where so much more time shows no less, what is left is not the bridge's.
            let most = (3 * best.plan.bridge).max(best.plan.bridge + 36);
            if next <= last || next > most {
                break;
            }
            let longer = self.attempt(ends, (next, wide), Some(&best))?;
            (last, shown) = (next, longer.seam.worst());
            if shown < best.seam.worst() {
                best = longer;
            }
        }
        Ok(best)
    }

    /// A pass with so many frames over the seam, and spans more on either side that may change.
    fn attempt(
        &self,
        (from, to): (f64, f64),
        (bridge, wide): (usize, [usize; 2]),
        known: Option<&Attempt>,
    ) -> Result<Attempt> {
        let known = known.map(|known| (&known.plan, known.eased.as_slice()));
        let plan = Plan::new(self.loom, (from, to), bridge, wide)?;
        let eased = plan.eased((self.loom, self.clip, self.task), known)?;
        let looped = plan.repeat(self.loom, 1, &eased)?;
        let last = to.floor() as usize;
        let again = (last + bridge + 1, from.floor() as usize + 1);
        Ok(Attempt {
            seam: Seam::measure(self.clip, &looped, last, again),
            plan,
            eased,
            looped,
        })
    }
}

impl Attempt {
    fn shows(&self) -> bool {
        self.seam.worst() > SHOWS
    }
}

/// Frames of the bridge to try after one that shows so much: accelerations fall as the square of the time.
fn longer(frames: usize, shown: f64) -> usize {
    let factor = (shown / SHOWS).sqrt().clamp(1.25, 1.5);
    ((factor * frames as f64).ceil() as usize).max(frames + 1)
}

/// The longest bridge of a loop of so many frames.
fn most_bridged(frames: usize) -> usize {
    5 * frames.max(40) / 2
}
