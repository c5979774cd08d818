//! Where hooves and trunk go in the course of a stride.
//!
//! Footfalls after Hildebrand 1977 and Muybridge's plates: a gallop puts down left hind, right hind,
//! left fore, right fore and then flies with the legs gathered; a walk puts down left hind, left
//! fore, right hind, right fore at even intervals, with two or three feet on the ground.

use std::f64::consts::PI;

use crate::demo::curve::Curve;

use super::pose::{Foot, Stance};

/// A cycle of footfalls and what the trunk does meanwhile.
#[derive(Debug)]
pub(super) struct Gait {
    /// Seconds a stride.
    period: f64,
    /// Metres a stride travels over the ground.
    travel: f64,
    /// Share of the stride that a foot stands.
    duty: f64,
    /// Left hind, right hind, left fore, right fore: the phase at which they are put down.
    touchdown: [f64; 4],
    hind: Steps,
    fore: Steps,
    trunk: fn(f64) -> Stance,
    /// How much every second stride differs from the others, as a share.
    uneven: f64,
}

/// What one foot does. Curves run over \[0, 2): standing from 0 to 1, swinging from 1 to 2.
#[derive(Debug)]
struct Steps {
    /// Where the toe is at the middle of its stand, from its place at rest.
    middle: f64,
    /// How far it stands before and behind that.
    reach: f64,
    /// Forward in swing, in units of `reach`.
    forward: Curve,
    /// Height of the toe in metres.
    height: Curve,
    hoof: Curve,
    pastern: Curve,
    carpus: Curve,
}

impl Gait {
    /// The horse at `seconds`.
    pub(super) fn at(&self, seconds: f64) -> Stance {
        let phase = seconds / self.period;
        let uneven = self.uneven * libm::cos(PI * phase);
        let mut stance = (self.trunk)(phase);
        stance.shift[0] += self.travel * phase;
        stance.shift[1] *= 1.0 + 2.0 * uneven;
        stance.neck *= 1.0 - 2.0 * uneven;
        let foot = |i: usize, steps: &Steps| {
            let mut foot = steps.foot(self.leg_time(phase - self.touchdown[i]), 1.0 + uneven);
            foot.toe[0] += self.travel * phase;
            foot
        };
        stance.hind = [foot(0, &self.hind), foot(1, &self.hind)];
        stance.fore = [foot(2, &self.fore), foot(3, &self.fore)];
        stance
    }

    /// A horse at rest but for one leg (left hind, right hind, left fore, right fore), which is where it
    /// comes at `time` of its step: standing from 0 to 1, swinging from 1 to 2.
    pub(super) fn one_leg(&self, leg: usize, time: f64) -> Stance {
        let mut stance = Stance::default();
        match leg {
            0 | 1 => stance.hind[leg] = self.hind.foot(time, 1.0),
            _ => stance.fore[leg - 2] = self.fore.foot(time, 1.0),
        }
        stance
    }

    /// A horse with the trunk, neck and tail of a phase, its feet at rest.
    pub(super) fn trunk_only(&self, phase: f64) -> Stance {
        (self.trunk)(phase)
    }

    /// Phase since touchdown to \[0, 2): stand, swing.
    fn leg_time(&self, phase: f64) -> f64 {
        let phase = phase - libm::floor(phase);
        if phase < self.duty {
            phase / self.duty
        } else {
            1.0 + (phase - self.duty) / (1.0 - self.duty)
        }
    }
}

impl Steps {
    fn foot(&self, time: f64, size: f64) -> Foot {
        let forward = if time < 1.0 {
            1.0 - 2.0 * time
        } else {
            self.forward.at(time)
        };
        let toe = [
            self.middle + size * self.reach * forward,
            size * self.height.at(time),
        ];
        Foot {
            toe,
            hoof: self.hoof.at(time),
            pastern: self.pastern.at(time),
            carpus: size * self.carpus.at(time),
        }
    }
}

/// A gallop in place: seen from a camera that keeps up.
pub(super) fn gallop() -> Gait {
    Gait {
        period: 0.5,
        travel: 0.0,
        duty: 0.26,
        touchdown: [0.0, 0.12, 0.27, 0.42],
        hind: Steps {
            middle: 0.03,
            reach: 0.50,
            forward: swing(&[
                (1.0, -1.0),
                (1.1, -1.28),
                (1.5, -0.15),
                (1.85, 1.18),
                (1.999, 1.0),
            ]),
            height: swing(&[
                (0.0, 0.0),
                (1.0, 0.0),
                (1.25, 0.27),
                (1.5, 0.36),
                (1.8, 0.20),
            ]),
            hoof: swing(&[
                (0.0, 0.0),
                (0.75, 0.0),
                (1.0, -0.7),
                (1.2, -1.7),
                (1.5, -1.3),
                (1.85, 0.1),
            ]),
            pastern: swing(&[
                (0.0, 0.0),
                (0.45, 0.35),
                (1.0, -0.5),
                (1.2, -1.2),
                (1.5, -0.9),
                (1.85, 0.0),
            ]),
            carpus: swing(&[(0.0, 0.0)]),
        },
        fore: Steps {
            middle: 0.06,
            reach: 0.52,
            forward: swing(&[
                (1.0, -1.0),
                (1.1, -1.25),
                (1.5, 0.1),
                (1.82, 1.25),
                (1.999, 1.0),
            ]),
            height: swing(&[
                (0.0, 0.0),
                (1.0, 0.0),
                (1.25, 0.32),
                (1.5, 0.50),
                (1.8, 0.26),
            ]),
            hoof: swing(&[
                (0.0, 0.0),
                (0.75, 0.0),
                (1.0, -0.8),
                (1.25, -2.3),
                (1.5, -1.7),
                (1.85, 0.2),
            ]),
            pastern: swing(&[
                (0.0, 0.0),
                (0.45, 0.4),
                (1.0, -0.5),
                (1.25, -1.8),
                (1.5, -1.3),
                (1.85, 0.1),
            ]),
            carpus: swing(&[
                (0.0, 0.0),
                (1.0, 0.05),
                (1.35, 1.25),
                (1.5, 1.2),
                (1.85, 0.0),
            ]),
        },
        trunk: gallop_trunk,
        uneven: 0.05,
    }
}

fn swing(keys: &[(f64, f64)]) -> Curve {
    Curve::periodic(2.0, keys)
}

/// A wave of one turn a stride with its crest at `crest`.
fn wave(phase: f64, crest: f64) -> f64 {
    libm::cos(2.0 * PI * (phase - crest))
}

fn gallop_trunk(phase: f64) -> Stance {
    let tail = |i: usize| {
        let base = [-0.20, -0.24, -0.20, -0.08, 0.05, 0.12][i];
        base + 0.10 * wave(phase, 0.75 + 0.12 * i as f64)
    };
    Stance {
        // highest in flight, lowest over the lead
        shift: [0.0, -0.02 + 0.055 * wave(phase, 0.92), 0.0],
        pitch: 0.02 + 0.075 * wave(phase, 0.15),
        flex: 0.08 + 0.17 * wave(phase, 0.93),
        neck: -0.32 + 0.09 * wave(phase, 0.10),
        head: 0.30 - 0.07 * wave(phase, 0.16),
        tail: std::array::from_fn(tail),
        ears: 0.25,
        ..Stance::default()
    }
}

/// A walk of 1.35 m a stride.
pub(super) fn walk() -> Gait {
    let (duty, travel) = (0.62, 1.35);
    let reach = 0.5 * duty * travel;
    Gait {
        period: 1.1,
        travel,
        duty,
        touchdown: [0.0, 0.5, 0.23, 0.73],
        hind: Steps {
            middle: 0.0,
            reach,
            forward: swing(&[
                (1.0, -1.0),
                (1.1, -1.08),
                (1.5, 0.0),
                (1.88, 1.07),
                (1.999, 1.0),
            ]),
            height: swing(&[(0.0, 0.0), (1.0, 0.0), (1.35, 0.13), (1.7, 0.07)]),
            hoof: swing(&[
                (0.0, 0.0),
                (0.82, 0.0),
                (1.0, -0.7),
                (1.25, -1.1),
                (1.5, -0.5),
                (1.85, 0.12),
            ]),
            pastern: swing(&[
                (0.0, 0.0),
                (0.5, 0.18),
                (1.0, -0.45),
                (1.25, -0.8),
                (1.5, -0.4),
                (1.85, 0.0),
            ]),
            carpus: swing(&[(0.0, 0.0)]),
        },
        fore: Steps {
            middle: 0.02,
            reach,
            forward: swing(&[
                (1.0, -1.0),
                (1.1, -1.08),
                (1.5, 0.1),
                (1.86, 1.08),
                (1.999, 1.0),
            ]),
            height: swing(&[(0.0, 0.0), (1.0, 0.0), (1.35, 0.17), (1.7, 0.08)]),
            hoof: swing(&[
                (0.0, 0.0),
                (0.82, 0.0),
                (1.0, -0.7),
                (1.3, -1.5),
                (1.55, -0.7),
                (1.85, 0.15),
            ]),
            pastern: swing(&[
                (0.0, 0.0),
                (0.5, 0.2),
                (1.0, -0.45),
                (1.3, -1.1),
                (1.55, -0.5),
                (1.85, 0.0),
            ]),
            carpus: swing(&[
                (0.0, 0.0),
                (1.0, 0.05),
                (1.35, 0.8),
                (1.55, 0.6),
                (1.85, 0.0),
            ]),
        },
        trunk: walk_trunk,
        uneven: 0.0,
    }
}

fn walk_trunk(phase: f64) -> Stance {
    let tail = |i: usize| {
        [0.10, 0.12, 0.10, 0.05, 0.02, 0.0][i] + 0.03 * wave(2.0 * phase, 0.1 * i as f64)
    };
    Stance {
        shift: [
            0.0,
            -0.03 + 0.012 * wave(2.0 * phase, 0.6),
            0.018 * wave(phase, 0.3),
        ],
        pitch: 0.012 * wave(2.0 * phase, 0.3),
        flex: 0.03 * wave(2.0 * phase, 0.0),
        neck: -0.22 + 0.06 * wave(2.0 * phase, 0.35),
        head: 0.06 - 0.03 * wave(2.0 * phase, 0.4),
        tail: std::array::from_fn(tail),
        ears: 0.0,
        ..Stance::default()
    }
}
