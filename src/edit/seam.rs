//! How much a seam shows: steps, changes of speed and accelerations there beside those of the whole motion.

use super::poses::Poses;
use crate::loom::Loom;

/// Ratios of the seam to the motion (PEERS.md E.6), in the shape subspace (rigid motion apart), at whole
/// frames. Below 1 it cannot be told from the motion.
///
/// Differences between frames of which some are new, or which did not follow each other before, count
/// whole. Those within the motion count by what the seam has changed in them: how it accelerates there by
/// itself is no seam.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Seam {
    /// Largest step at the seam over the mean step of the motion.
    pub step: f64,
    /// Largest change of velocity from frame to frame at the seam over the largest of the motion.
    pub velocity: f64,
    /// Largest second difference at the seam over the median of the motion.
    pub acceleration: f64,
}

/// Seams above this show.
pub(super) const SHOWS: f64 = 1.5;

/// A motion at its frames, and what its seams are measured with.
pub(super) struct Clip {
    states: States,
    /// Mean step, largest change of velocity and median second difference.
    sizes: [f64; 3],
    poses: Poses,
}

/// For each frame the coordinates in the shape subspace and their derivative.
struct States {
    x: Vec<Vec<f64>>,
    v: Vec<Vec<f64>>,
}

impl States {
    fn of(loom: &Loom) -> Self {
        let times = || (1..=loom.frames()).map(|frame| frame as f64);
        let at = |t: f64| loom.coordinates_at(t).unwrap_or_default();
        States {
            x: times().map(at).collect(),
            v: times().map(|t| velocity(loom, t)).collect(),
        }
    }

    /// Steps, changes of velocity and second differences, each from its first frame (from 0) on.
    fn differences(&self) -> [Vec<Vec<f64>>; 3] {
        let steps = differences(&self.x);
        let bends = differences(&steps);
        [steps, differences(&self.v), bends]
    }
}

impl Clip {
    pub(super) fn of(loom: &Loom) -> Self {
        let states = States::of(loom);
        let [steps, jumps, bends] = states.differences().map(|all| norms(&all));
        let sizes = [mean(&steps), most(&jumps), median(bends)];
        let poses = Poses::of(&states.x);
        Clip {
            states,
            sizes,
            poses,
        }
    }

    /// Where its shapes lie.
    pub(super) fn poses(&self) -> &Poses {
        &self.poses
    }

    /// How many frames before `from` and after `to`, at most `most`, the motion first moves and turns no more
    /// than it does on the whole; where it does nowhere, where it does least.
    pub(super) fn calm(&self, (from, to): (f64, f64), most: usize) -> (usize, usize) {
        let (a, b) = (from.floor() as usize - 1, to.ceil() as usize - 1);
        let [steps, _, bends] = self.states.differences();
        // What a frame and those beside it do.
        let stir = |i: usize| {
            let about = |all: &[Vec<f64>], from: usize, to: usize| {
                let all = &all[from.min(all.len())..to.min(all.len())];
                all.iter().map(|d| norm(d)).fold(0.0, f64::max)
            };
            let step = about(&steps, i.saturating_sub(1), i + 1);
            let bend = about(&bends, i.saturating_sub(2), i + 1);
            (step / self.sizes[0]).max(bend / self.sizes[2])
        };
        let first = |stirs: Vec<f64>| {
            let least = stirs.iter().copied().fold(f64::INFINITY, f64::min);
            stirs
                .iter()
                .position(|&stir| stir <= least.max(1.0))
                .unwrap_or(0)
        };
        let last = self.frames() - 1;
        (
            first((0..=most.min(a)).map(|d| stir(a - d)).collect()),
            first((0..=most.min(last - b)).map(|d| stir(b + d)).collect()),
        )
    }

    /// How many frames there are.
    pub(super) fn frames(&self) -> usize {
        self.states.x.len()
    }

    /// The mean step.
    pub(super) fn step(&self) -> f64 {
        self.sizes[0]
    }

    /// The median second difference.
    pub(super) fn bend(&self) -> f64 {
        self.sizes[2]
    }
}

impl Seam {
    /// Measures the seam of a loom with one pass more, all of whose frames up to `last` (from 1) are the
    /// clip's own, and those from `next` on the clip's from `first` on. Ratios are 0 where the seam does
    /// not move, infinite where only the seam does.
    pub(super) fn measure(
        clip: &Clip,
        looped: &Loom,
        last: usize,
        (next, first): (usize, usize),
    ) -> Self {
        let orders = [1, 1, 2];
        let (own, new) = (clip.states.differences(), States::of(looped).differences());
        let [step, velocity, acceleration] = [0, 1, 2].map(|kind| {
            let shown = new[kind].iter().enumerate().map(|(i, found)| {
                // Its first frame is i + 1, its last i + 1 + order.
                let before = (i + 1 + orders[kind] <= last).then_some(i);
                let after = (i + 1 >= next).then(|| i + first - next);
                match before.or(after).and_then(|i| own[kind].get(i)) {
                    Some(own) => norm(&minus(found, own)),
                    None => norm(found),
                }
            });
            ratio(shown.fold(0.0, f64::max), clip.sizes[kind])
        });
        Seam {
            step,
            velocity,
            acceleration,
        }
    }

    /// The largest of the ratios.
    pub fn worst(&self) -> f64 {
        self.step.max(self.velocity).max(self.acceleration)
    }
}

/// Derivative of the coordinates in the shape subspace.
pub(super) fn velocity(loom: &Loom, t: f64) -> Vec<f64> {
    let mut x = vec![0.0; loom.pose().modes()];
    if let (Some(p), Some(v)) = (loom.time().at(t), loom.time().velocity(t)) {
        loom.pose().along(p, v, &mut x);
    }
    x
}

fn minus(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

fn differences(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    rows.windows(2)
        .map(|pair| minus(&pair[1], &pair[0]))
        .collect()
}

fn norms(rows: &[Vec<f64>]) -> Vec<f64> {
    rows.iter().map(|row| norm(row)).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// 0 where the seam does not move, infinite where only the seam does.
fn ratio(seam: f64, motion: f64) -> f64 {
    if seam == 0.0 { 0.0 } else { seam / motion }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::retime;
    use crate::loom::test_looms::ring;

    #[test]
    fn a_motion_is_calm_before_and_after_it_rushes() {
        let keys = [[1.0, 1.0], [20.0, 10.0], [24.0, 40.0], [64.0, 60.0]];
        let clip = Clip::of(&retime(&ring(10, 60, true), &keys).unwrap());
        let (before, after) = clip.calm((22.0, 23.0), 12);
        assert!(
            (2..=12).contains(&before) && (1..=12).contains(&after),
            "{before} {after}"
        );
        // never beyond the motion, nor further than allowed
        assert_eq!(clip.calm((1.0, 64.0), 12), (0, 0));
        assert_eq!(clip.calm((1.75, 63.25), 12), (0, 0));
        let (before, after) = clip.calm((22.0, 23.0), 1);
        assert!(before <= 1 && after <= 1);
    }

    #[test]
    fn a_motion_against_itself_shows_nothing_within_it() {
        let loom = ring(10, 30, true);
        let clip = Clip::of(&loom);
        // as if frames 12 and 13 met for the first time: what they do counts whole
        let seam = Seam::measure(&clip, &loom, 12, (13, 13));
        let step = norm(&minus(&clip.states.x[12], &clip.states.x[11]));
        assert!((seam.step - step / clip.step()).abs() < 1e-12);
        assert!(seam.acceleration > 0.5 && seam.acceleration < 2.0);
        // all of it its own
        assert_eq!(Seam::measure(&clip, &loom, 30, (31, 31)), Seam::default());
    }
}
