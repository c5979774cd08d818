//! Trunk and hooves to bones. Everything turns about axes along z, so joints are points of the plane
//! and turns are angles.
//!
//! A leg is a chain whose joints fold together: in the hind leg stifle and hock are tied (the
//! reciprocal apparatus), in the foreleg the elbow folds, while the carpus has its own course. So hip
//! and fetlock determine the leg: the fold makes the distance right, then the whole chain turns into
//! place. The shoulder blade slides over the ribs with half of the leg's turn.

use nalgebra::{Vector2, Vector3};

use crate::demo::skin::Motion;

use super::anatomy::*;

/// Where a foot is.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Foot {
    /// The toe, where it is at rest plus this.
    pub(super) toe: [f64; 2],
    /// Turn of the hoof about the toe; negative lifts the heel.
    pub(super) hoof: f64,
    /// Turn of the pastern; positive when the fetlock sinks, negative when it folds.
    pub(super) pastern: f64,
    /// Fold of the carpus (forelegs only).
    pub(super) carpus: f64,
}

/// One moment of the horse. Angles in radians, counter-clockwise for who sees it face right.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Stance {
    /// Shift of the trunk: forward, up, to the right.
    pub(super) shift: [f64; 3],
    /// Turn of the ribs; positive lifts the front.
    pub(super) pitch: f64,
    /// Turn of the pelvis against the ribs; positive tucks it under.
    pub(super) flex: f64,
    /// Turn of the neck against the ribs, spread over its length; positive raises the head.
    pub(super) neck: f64,
    /// Turn of the head against the neck; positive raises the nose.
    pub(super) head: f64,
    /// Turn of each part of the tail against the one before; negative raises it.
    pub(super) tail: [f64; 6],
    /// Turn of the ears; positive lays them back.
    pub(super) ears: f64,
    /// Left and right.
    pub(super) hind: [Foot; 2],
    /// Left and right.
    pub(super) fore: [Foot; 2],
}

/// The motions of all bones.
pub(super) fn bones(stance: &Stance) -> Vec<Motion> {
    let mut bones = vec![still(); BONES];
    trunk(stance, &mut bones);
    neck(stance, &mut bones);
    tail(stance, &mut bones);
    for side in 0..2 {
        hind_leg(stance, side, &mut bones);
        fore_leg(stance, side, &mut bones);
    }
    bones
}

/// Share of the leg's turn that the shoulder blade takes.
const BLADE_SHARE: f64 = 0.5;

fn still() -> Motion {
    Motion {
        rest: Vector3::zeros(),
        joint: Vector3::zeros(),
        turn: 0.0,
    }
}

/// A point of the plane where `bone` has taken it.
fn carried(bone: &Motion, [x, y]: [f64; 2]) -> Vector2<f64> {
    let offset = Vector2::new(x - bone.rest.x, y - bone.rest.y);
    bone.joint.xy() + turned(offset, bone.turn)
}

fn turned(v: Vector2<f64>, angle: f64) -> Vector2<f64> {
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
}

/// The turn from one direction to another, in (-pi, pi].
fn angle(from: Vector2<f64>, to: Vector2<f64>) -> f64 {
    libm::atan2(from.x * to.y - from.y * to.x, from.dot(&to))
}

fn motion(rest: [f64; 2], joint: Vector2<f64>, sway: f64, turn: f64) -> Motion {
    Motion {
        rest: Vector3::new(rest[0], rest[1], 0.0),
        joint: Vector3::new(joint.x, joint.y, sway),
        turn,
    }
}

fn trunk(stance: &Stance, bones: &mut [Motion]) {
    let [x, y, sway] = stance.shift;
    let centre = [0.0, 1.25];
    bones[THORAX] = motion(centre, Vector2::new(x, centre[1] + y), sway, stance.pitch);
    let turn = stance.pitch + 0.5 * stance.flex;
    bones[LOIN] = motion(LUMBAR, carried(&bones[THORAX], LUMBAR), sway, turn);
    let turn = stance.pitch + stance.flex;
    bones[PELVIS] = motion(LUMBOSACRAL, carried(&bones[LOIN], LUMBOSACRAL), sway, turn);
}

fn neck(stance: &Stance, bones: &mut [Motion]) {
    let sway = stance.shift[2];
    let mut before = THORAX;
    for (i, bone) in NECK.into_iter().enumerate() {
        let turn = stance.pitch + stance.neck * (i + 1) as f64 / NECK.len() as f64;
        let joint = carried(&bones[before], NECK_JOINTS[i]);
        bones[bone] = motion(NECK_JOINTS[i], joint, sway, turn);
        before = bone;
    }
    let poll = NECK_JOINTS[NECK.len()];
    let turn = stance.pitch + stance.neck + stance.head;
    bones[HEAD] = motion(poll, carried(&bones[before], poll), sway, turn);
    for ear in EARS {
        let root = [1.00, 1.89];
        bones[ear] = motion(root, carried(&bones[HEAD], root), sway, turn + stance.ears);
    }
}

fn tail(stance: &Stance, bones: &mut [Motion]) {
    let (mut before, mut turn) = (PELVIS, bones[PELVIS].turn);
    for (i, bone) in TAIL.into_iter().enumerate() {
        turn += stance.tail[i];
        let joint = carried(&bones[before], TAIL_JOINTS[i]);
        bones[bone] = motion(TAIL_JOINTS[i], joint, stance.shift[2], turn);
        before = bone;
    }
}

fn hind_leg(stance: &Stance, side: usize, bones: &mut [Motion]) {
    let hip = carried(&bones[PELVIS], HIND_JOINTS[0]);
    let foot = &stance.hind[side];
    let (coffin, fetlock) = lower_joints(foot, &HIND_JOINTS[3..]);
    let chain = Chain {
        joints: &HIND_JOINTS[..4],
        folds: &[-0.95, 1.0],
        set: &[0.0, 0.0],
    };
    let upper = chain.reach(hip, fetlock);
    place(
        &HIND[side],
        &HIND_JOINTS,
        &upper,
        [fetlock, coffin],
        foot,
        stance.shift[2],
        bones,
    );
}

fn fore_leg(stance: &Stance, side: usize, bones: &mut [Motion]) {
    let top = carried(&bones[THORAX], FORE_JOINTS[0]);
    let foot = &stance.fore[side];
    let (coffin, fetlock) = lower_joints(foot, &FORE_JOINTS[4..]);
    let [rest_top, rest_shoulder] = [0, 1].map(|i| Vector2::from(FORE_JOINTS[i]));
    let blade = BLADE_SHARE * angle(Vector2::from(FORE_JOINTS[4]) - rest_top, fetlock - top);
    let shoulder = top + turned(rest_shoulder - rest_top, blade);
    let set = [0.35 * foot.carpus, -foot.carpus];
    let chain = Chain {
        joints: &FORE_JOINTS[1..5],
        folds: &[1.0, 0.0],
        set: &set,
    };
    let mut upper = vec![(top, blade)];
    upper.extend(chain.reach(shoulder, fetlock));
    place(
        &FORE[side],
        &FORE_JOINTS,
        &upper,
        [fetlock, coffin],
        foot,
        stance.shift[2],
        bones,
    );
}

/// Coffin joint and fetlock over a toe; `joints` are fetlock, coffin joint and toe at rest.
fn lower_joints(foot: &Foot, joints: &[[f64; 2]]) -> (Vector2<f64>, Vector2<f64>) {
    let [fetlock, coffin, toe] = [0, 1, 2].map(|i| Vector2::from(joints[i]));
    let coffin_now = toe + Vector2::from(foot.toe) + turned(coffin - toe, foot.hoof);
    (
        coffin_now,
        coffin_now + turned(fetlock - coffin, foot.pastern),
    )
}

/// Bones whose joints fold together.
struct Chain<'a> {
    /// The joints at rest, one more than bones.
    joints: &'a [[f64; 2]],
    /// How each inner joint turns when the chain folds by 1.
    folds: &'a [f64],
    /// How each inner joint is turned besides.
    set: &'a [f64],
}

impl Chain<'_> {
    /// Joint and turn of each bone, so that the chain begins at `start` and ends at `end`. An end
    /// out of reach is pointed at.
    fn reach(&self, start: Vector2<f64>, end: Vector2<f64>) -> Vec<(Vector2<f64>, f64)> {
        let distance = (end - start).norm();
        let (mut straight, mut folded) = (-0.45, 1.5);
        for _ in 0..40 {
            let fold = 0.5 * (straight + folded);
            if self.bend(fold).1.norm() > distance {
                straight = fold;
            } else {
                folded = fold;
            }
        }
        let (bones, span) = self.bend(0.5 * (straight + folded));
        let aim = end - start;
        let turn = angle(span, aim);
        bones
            .iter()
            .map(|&(joint, angle)| (start + turned(joint, turn), angle + turn))
            .collect()
    }

    /// Joints and turns when folded, from the origin, and where the chain ends.
    fn bend(&self, fold: f64) -> (Vec<(Vector2<f64>, f64)>, Vector2<f64>) {
        let (mut joint, mut turn, mut bones) = (Vector2::zeros(), 0.0, Vec::new());
        for (i, pair) in self.joints.windows(2).enumerate() {
            if i > 0 {
                turn += self.folds[i - 1] * fold + self.set[i - 1];
            }
            bones.push((joint, turn));
            joint += turned(Vector2::from(pair[1]) - Vector2::from(pair[0]), turn);
        }
        (bones, joint)
    }
}

/// Writes the motions of one leg; it sways less and less towards the ground.
fn place(
    names: &[usize],
    joints: &[[f64; 2]],
    upper: &[(Vector2<f64>, f64)],
    lower: [Vector2<f64>; 2],
    foot: &Foot,
    sway: f64,
    bones: &mut [Motion],
) {
    let lower = [(lower[0], foot.pastern), (lower[1], foot.hoof)];
    for (i, &(joint, turn)) in upper.iter().chain(&lower).enumerate() {
        let share = 1.0 - (i as f64 / upper.len() as f64).min(1.0);
        bones[names[i]] = motion(joints[i], joint, share * sway, turn);
    }
}
