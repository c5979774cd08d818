//! Rounds of refinement, for as long as a fit misses more than it should and they help.

use super::refine::{Draft, after_exchange, firm};
use super::samples::{Curve, Samples};
use crate::math::b_spline::Point;
use crate::task::{Cancelled, Task};

/// Rounds that a fit which is not yet right is given, times its frames squared; at least and at most so
/// many.
const ROUNDS: usize = 120_000;
const FEW: usize = 4;
const MANY: usize = 48;
/// So many rounds one after the other that do not help are the last.
const IDLE: usize = 8;

/// The part of the sites that is exchanged in a round, ..
const SHARE: usize = 10;
/// .. fewer after a round that leaves more than this of what was missed.
const HARDLY: f64 = 0.99;

/// What is refined, and against what.
pub(super) struct Rounds<'a> {
    pub(super) samples: &'a Samples,
    pub(super) curve: &'a Curve,
    pub(super) pins: &'a [(usize, Point)],
    pub(super) floor: f64,
    pub(super) task: &'a Task,
}

/// The best so far, how many times it misses what is wanted, and how many rounds are left.
struct Best {
    draft: Draft,
    excess: f64,
    left: usize,
}

impl Rounds<'_> {
    /// Refined to the end: held less firmly; then, until nothing is missed that should not be, with more weight
    /// where deviations are seen, and with sites where they are wanted. Weights are not begun with where
    /// nothing is seen: sites help sooner.
    pub(super) fn run(&self, draft: Draft) -> Result<Draft, Cancelled> {
        let frames = self.samples.frames;
        let draft = draft.refined(self.samples, self.curve, self.pins, firm(frames), self.task)?;
        self.task.step();
        let quality = draft.quality(self.samples, self.curve, self.floor);
        let mut best = Best {
            excess: quality.excess,
            left: (ROUNDS / (frames * frames)).clamp(FEW, MANY),
            draft,
        };
        if !best.is_unfinished() {
            return Ok(best.draft);
        }
        let first = best.draft.clone();
        if quality.is_seen() {
            self.reweigh(first.clone(), &mut best)?;
        }
        let moved = self.exchange(first, &mut best)?;
        self.reweigh(moved, &mut best)?;
        Ok(best.draft)
    }

    /// From round to round samples count more where the way is seen to deviate. Where it is seen nowhere the
    /// rounds still help: each begins with steps and prices of its own.
    fn reweigh(&self, mut next: Draft, best: &mut Best) -> Result<(), Cancelled> {
        let (samples, curve) = (self.samples, self.curve);
        let mut idle = 0;
        while best.is_unfinished() && idle < IDLE {
            let round = firm(samples.frames);
            next = next
                .reweighted(samples, curve)
                .refined(samples, curve, self.pins, round, self.task)?;
            best.left -= 1;
            let helped = best.takes(&next, self.excess(&next));
            idle = if helped { 0 } else { idle + 1 };
            self.task.step();
        }
        Ok(())
    }

    /// Sites are exchanged from round to round, fewer and fewer; what that leads to, by the residual alone.
    fn exchange(&self, mut now: Draft, best: &mut Best) -> Result<Draft, Cancelled> {
        let (samples, curve) = (self.samples, self.curve);
        let mut missed = now.missed(samples, curve);
        let mut count = now.plate.sites.nrows().div_ceil(SHARE);
        while best.is_unfinished() && count > 0 {
            let round = after_exchange(samples.frames);
            let next = now
                .clone()
                .exchanged(samples, curve, count)
                .refined(samples, curve, self.pins, round, self.task)?;
            let after = next.missed(samples, curve);
            if after > HARDLY * missed {
                count = 2 * count / 3;
            }
            best.left -= 1;
            if after < missed {
                best.takes(&next, self.excess(&next));
                (now, missed) = (next, after);
            }
            self.task.step();
        }
        Ok(now)
    }

    /// How many times a draft misses what is wanted.
    fn excess(&self, draft: &Draft) -> f64 {
        draft.quality(self.samples, self.curve, self.floor).excess
    }
}

impl Best {
    fn is_unfinished(&self) -> bool {
        self.excess > 1.0 && self.left > 0
    }

    /// Whether a draft is better, and kept.
    fn takes(&mut self, draft: &Draft, excess: f64) -> bool {
        let better = excess < self.excess;
        if better {
            (self.draft, self.excess) = (draft.clone(), excess);
        }
        better
    }
}
