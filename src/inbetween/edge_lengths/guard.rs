//! The jump guard: where a sequence of embeddings leaves one branch for another (R14 §6: glitches, jitter
//! where creases appear or turn over), the jump is found and mended.
//!
//! Between neighbouring frames the dihedral angles are expected to change as the blend of the poses' angles
//! does. A frame is suspect where an angle does otherwise by more than [`JUMP`], where it changes from
//! convex to concave unexpectedly ([`FLIP`]), or where the residual of equation (3)
//! stands out from both sides. From the frame
//! before, the step is then taken again, bisected until no part of it is suspect. If that leads to another
//! shape than the one found, the frame was on another branch: the sequence goes on along the new one until
//! the two agree. If they still differ at a pose (a crease that must turn over somewhere), frames around
//! the jump are blended instead ([`Mending::Blended`]), in lengths and dihedral angles or between the shapes
//! of both branches, whichever misses the lengths less.

use nalgebra::Vector3;

use super::finishing::Wanted;
use super::sequence::{Follower, pose_of};
use super::{Embedded, Embedding, Target, wrapped};
use crate::mesh::rigid_align::mean;
use crate::space::SpaceError;

/// An unexpected change of a dihedral angle that makes a frame suspect, in radians.
const JUMP: f64 = 0.7;

/// The same for an angle that turns from convex to concave or back.
const FLIP: f64 = 0.35;

/// Of these only jumps that can be seen count: the angle times the height of the lower triangle at its
/// edge is more than this part of the shape's radius. Slivers turn over unseen.
const VISIBLE: f64 = 0.03;

/// A residual this many times those of both frames beside, and above [`LARGE`] a walk, makes a frame suspect.
const LEAP: f64 = 100.0;
const LARGE: f64 = 1e-6;

/// A suspect step is cut in two at most so often: into 8 parts.
const BISECTIONS: u32 = 3;

/// Frames on either side of a jump that are blended where it cannot be avoided.
const AROUND: usize = 3;

/// A vertex turns over with a jump where two branches have it farther apart than this part of the mean edge.
const APART: f64 = 0.1;

/// What was done about a jump.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mending {
    /// This many frames from it on were embedded again from the frame before, the step bisected.
    Followed {
        /// How many frames.
        frames: usize,
    },
    /// No path leads around it: this many frames around it are blended, in lengths and dihedral angles
    /// between the frames before and after, or between the shapes that both branches have there.
    Blended {
        /// How many frames.
        frames: usize,
    },
}

/// A jump that was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Repair {
    /// The first frame after the jump, from 0.
    pub frame: usize,
    /// The edge whose dihedral angle jumped most, an index into [`Embedding::edges`].
    pub edge: usize,
    /// By how much (radians) it changed otherwise than expected.
    pub change: f64,
    /// What was done.
    pub mending: Mending,
}

/// The target at a row of weights.
pub(super) type Aim<'a> = dyn Fn(&[f64]) -> Target + 'a;

/// Shapes evenly between two, in lengths and dihedral angles.
pub(super) type Fill<'a> =
    dyn Fn(&[f64], &[f64], usize) -> Result<Vec<Vec<f64>>, SpaceError> + Sync + 'a;

/// A hinge and its unexpected change.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Jump {
    hinge: usize,
    change: f64,
}

/// Finds and mends jumps in frames embedded at these weights.
pub(super) fn repair(
    embedding: &Embedding,
    blend: &Aim,
    weights: &[Vec<f64>],
    frames: &mut [Embedded],
    fill: &Fill,
) -> Result<Vec<Repair>, SpaceError> {
    let guard = Guard {
        embedding,
        blend,
        weights,
    };
    let mut repairs = Vec::new();
    let mut frame = 1;
    while frame < frames.len() {
        let (before, after) = (blend(&weights[frame - 1]), blend(&weights[frame]));
        let [old, new] = [&frames[frame - 1], &frames[frame]];
        let spike = || {
            let spikes = guard.spikes(frames, frame);
            spikes.then(|| difference(&old.dihedrals, &new.dihedrals))
        };
        let Some(jump) = suspect(embedding, (old, &before), (new, &after)).or_else(spike) else {
            frame += 1;
            continue;
        };
        let (mending, next) = match guard.follow(frame, frames) {
            Path::Same => (None, frame + 1),
            Path::Rejoined(found) => {
                let count = found.len();
                frames[frame..frame + count].clone_from_slice(&found);
                (Some(Mending::Followed { frames: count }), frame + count)
            }
            Path::Apart => guard.smooth(frame, frames, fill)?,
        };
        repairs.extend(mending.map(|mending| Repair {
            frame,
            edge: embedding.hinges().hinges()[jump.hinge].edge as usize,
            change: jump.change,
            mending,
        }));
        frame = next;
    }
    Ok(repairs)
}

/// Where the careful path from the frame before leads.
enum Path {
    /// To the frame itself: its angles change fast, but there is no jump.
    Same,
    /// To other frames, which come back to the sequence after the last of them.
    Rejoined(Vec<Embedded>),
    /// To a shape that still differs at the next pose or at the end.
    Apart,
}

struct Guard<'a> {
    embedding: &'a Embedding,
    blend: &'a Aim<'a>,
    weights: &'a [Vec<f64>],
}

impl Guard<'_> {
    /// Whether the residual of a frame is far above those of both neighbours; poses do not count.
    fn spikes(&self, frames: &[Embedded], at: usize) -> bool {
        let residual = |at: usize| frames[at].report.residual;
        let embedded = |at: &usize| *at < frames.len() && pose_of(&self.weights[*at]).is_none();
        let mut beside = [at - 1, at + 1].into_iter().filter(embedded).peekable();
        let large = residual(at) > LARGE * frames[at].report.walks.max(1) as f64;
        large
            && beside.peek().is_some()
            && beside.all(|at_side| residual(at) > LEAP * residual(at_side))
    }

    /// Embeds again from the frame before `frame` on, until the frames agree with those there are.
    fn follow(&self, frame: usize, frames: &[Embedded]) -> Path {
        let mut found: Vec<Embedded> = Vec::new();
        for at in frame..frames.len() {
            let from = found.last().unwrap_or(&frames[at - 1]);
            let Some(next) = self.careful(at, from, BISECTIONS) else {
                return Path::Apart;
            };
            let same = difference(&next.dihedrals, &frames[at].dihedrals)
                .change
                .abs()
                < FLIP;
            match (same, found.is_empty()) {
                (true, true) => return Path::Same,
                (true, false) => return Path::Rejoined(found),
                (false, _) if pose_of(&self.weights[at]).is_some() => return Path::Apart,
                (false, _) => found.push(next),
            }
        }
        Path::Rejoined(found)
    }

    /// The frame `at` reached from the one before in steps that are not suspect; none when steps remain
    /// suspect however small.
    fn careful(&self, at: usize, from: &Embedded, bisections: u32) -> Option<Embedded> {
        for level in 0..=bisections {
            let parts = 1_usize << level;
            if let Some(found) = self.in_steps(at, from, parts) {
                return Some(found);
            }
        }
        None
    }

    fn in_steps(&self, at: usize, from: &Embedded, parts: usize) -> Option<Embedded> {
        let [start, end] = [&self.weights[at - 1], &self.weights[at]];
        let row = |step: usize| -> Vec<f64> {
            let t = step as f64 / parts as f64;
            start
                .iter()
                .zip(end)
                .map(|(a, b)| a + t * (b - a))
                .collect()
        };
        let mut target = (self.blend)(start);
        let mut found = from.clone();
        let mut follower = Follower::from(self.embedding, from, &target);
        for step in 1..=parts {
            let next_target = (self.blend)(&row(step));
            let next = follower.next(&next_target).ok()?;
            if suspect(self.embedding, (&found, &target), (&next, &next_target)).is_some() {
                return None;
            }
            (found, target) = (next, next_target);
        }
        Some(found)
    }

    /// Blends the frames around a jump that no path avoids; poses stay. Of two ways that with the smaller
    /// edge errors is taken: lengths and dihedral angles blended between the frames before and after, or
    /// both branches followed to each frame and their shapes blended, which moves only what turns over. Where
    /// shapes with nearly the lengths lead across, the frames are evened out along those.
    fn smooth(
        &self,
        frame: usize,
        frames: &mut [Embedded],
        fill: &Fill,
    ) -> Result<(Option<Mending>, usize), SpaceError> {
        let stops = |at: &usize| pose_of(&self.weights[*at]).is_some();
        let before = (0..frame).rev().take(AROUND).find(stops);
        let first = before.unwrap_or((frame - 1).saturating_sub(AROUND - 1));
        let after = (frame..frames.len()).take(AROUND).find(stops);
        let last = after.unwrap_or((frame + AROUND - 1).min(frames.len() - 1));
        if last - first < 2 {
            return Ok((Some(Mending::Blended { frames: 0 }), frame + 1));
        }
        let count = last - first - 1;
        let [from, to] = [first, last].map(|at| &frames[at].positions[..]);
        let filled = fill(from, to, count)?;
        let ways = [Some(filled), self.branches(first, last, frames)];
        let measured = ways.into_iter().flatten().map(|made| {
            let each = (first + 1..last).zip(made);
            each.map(|(at, positions)| self.measured(at, positions, &frames[at]))
                .collect()
        });
        let worst = |way: &Vec<Embedded>| {
            let each = way.iter().map(|found| found.report.edges.rms_percent);
            each.fold(0.0, f64::max)
        };
        let best = measured.min_by(|a, b| worst(a).total_cmp(&worst(b)));
        if let Some(mut best) = best {
            if let Some(evened) = self.evened(first, last, frames, &best)
                && worst(&evened) < worst(&best)
            {
                best = evened;
            }
            frames[first + 1..last].clone_from_slice(&best);
        }
        Ok((Some(Mending::Blended { frames: count }), last + 1))
    }

    /// The frames between two, evened out from a blend of them.
    fn evened(
        &self,
        first: usize,
        last: usize,
        frames: &[Embedded],
        blend: &[Embedded],
    ) -> Option<Vec<Embedded>> {
        let ends = [&frames[first], &frames[last]];
        let path = ends[..1].iter().copied().chain(blend).chain([ends[1]]);
        let path: Vec<Vec<f64>> = path.map(|found| found.positions.clone()).collect();
        let lengths = (first + 1..last).map(|at| (self.blend)(&self.weights[at]).lengths);
        let lengths: Vec<Vec<f64>> = lengths.collect();
        let made = self.embedding.evened(path, &lengths)?;
        let each = (first + 1..last).zip(made);
        let measured = each.map(|(at, positions)| self.measured(at, positions, &frames[at]));
        Some(measured.collect())
    }

    /// The shapes between two frames, each from the branches of both, blended; none where one cannot be
    /// followed.
    fn branches(&self, first: usize, last: usize, frames: &[Embedded]) -> Option<Vec<Vec<f64>>> {
        let followed = |from: usize, way: &mut dyn Iterator<Item = usize>| {
            let start = (self.blend)(&self.weights[from]);
            let mut follower = Follower::from(self.embedding, &frames[from], &start);
            let each = way.map(|at| follower.next(&(self.blend)(&self.weights[at])));
            let found: Result<Vec<Embedded>, _> = each.collect();
            found.ok()
        };
        let ahead = followed(first, &mut (first + 1..last))?;
        let back = followed(last, &mut (first + 1..last).rev())?;
        let pairs = ahead.iter().zip(back.iter().rev()).enumerate();
        let blended = pairs.map(|(i, (one, two))| {
            let t = (i + 1) as f64 / (last - first) as f64;
            let pairs = one.positions.iter().zip(&two.positions);
            let mut positions: Vec<f64> = pairs.map(|(a, b)| a + t * (b - a)).collect();
            self.keep_lengths(first + 1 + i, [one, two], &mut positions);
            positions
        });
        Some(blended.collect())
    }

    /// Gives a blend of two branches the lengths of its frame, but for edges at vertices where the two
    /// differ: no shape on the way between has those.
    fn keep_lengths(&self, at: usize, [one, two]: [&Embedded; 2], positions: &mut [f64]) {
        let edges = self.embedding.edges();
        let mut lengths = (self.blend)(&self.weights[at]).lengths;
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        let places = one
            .positions
            .chunks_exact(3)
            .zip(two.positions.chunks_exact(3));
        let differ: Vec<bool> = places
            .map(|(a, b)| {
                let apart = Vector3::from_column_slice(a) - Vector3::from_column_slice(b);
                apart.norm() > APART * mean
            })
            .collect();
        let blended = self.embedding.lengths(positions);
        for ((length, own), ends) in lengths.iter_mut().zip(blended).zip(edges) {
            if ends.iter().any(|&vertex| differ[vertex as usize]) {
                *length = own;
            }
        }
        let wanted = Wanted {
            edges,
            lengths: &lengths,
            spring: None,
        };
        let finisher = &self.embedding.finisher;
        finisher.finish(&wanted, positions, &mut None);
    }

    /// A shape that was not embedded, measured against the lengths of its frame.
    fn measured(&self, at: usize, positions: Vec<f64>, was: &Embedded) -> Embedded {
        let target = (self.blend)(&self.weights[at]);
        let dihedrals = super::near_branch(self.embedding.dihedrals(&positions), &target.dihedrals);
        let lengths = self.embedding.lengths(&positions);
        let mut report = was.report.clone();
        report.edges = super::EdgeFit::new(&target.lengths, &lengths);
        report.residual = self.embedding.energy(&target.lengths, &dihedrals);
        Embedded {
            positions,
            dihedrals,
            report,
        }
    }
}

/// The largest difference of two rows of angles.
fn difference(a: &[f64], b: &[f64]) -> Jump {
    let mut largest = Jump {
        hinge: 0,
        change: 0.0,
    };
    for (hinge, (a, b)) in a.iter().zip(b).enumerate() {
        let change = wrapped(b - a);
        if change.abs() > largest.change.abs() {
            largest = Jump { hinge, change };
        }
    }
    largest
}

/// Whether two shapes with the same lengths are the same: no angle that can be seen differs.
pub(super) fn same(embedding: &Embedding, one: &Embedded, two: &Embedded) -> bool {
    let seen = VISIBLE * radius(&one.positions);
    let lengths = embedding.lengths(&two.positions);
    let mut pairs = one.dihedrals.iter().zip(&two.dihedrals).enumerate();
    pairs.all(|(hinge, (a, b))| {
        let change = wrapped(b - a).abs();
        change < FLIP || change * embedding.lever(hinge, &lengths) <= seen
    })
}

/// What makes the step between two frames suspect, each given with its target.
fn suspect(
    embedding: &Embedding,
    before: (&Embedded, &Target),
    after: (&Embedded, &Target),
) -> Option<Jump> {
    let mut worst: Option<Jump> = None;
    let seen = VISIBLE * radius(&before.0.positions);
    for hinge in 0..before.0.dihedrals.len() {
        let (old, new) = (before.0.dihedrals[hinge], after.0.dihedrals[hinge]);
        let expected = after.1.dihedrals[hinge] - before.1.dihedrals[hinge];
        let change = wrapped(new - old - expected);
        let (old, new) = (wrapped(old), wrapped(new));
        let flipped = old * new < 0.0 && old.abs().min(new.abs()) > 0.5 * FLIP;
        let limit = if flipped { FLIP } else { JUMP };
        let larger = |worst: Jump| change.abs() > worst.change.abs();
        if change.abs() > limit
            && worst.is_none_or(larger)
            && change.abs() * embedding.lever(hinge, &before.1.lengths) > seen
        {
            worst = Some(Jump { hinge, change });
        }
    }
    worst
}

/// The distance of the farthest vertex from the mean.
fn radius(positions: &[f64]) -> f64 {
    let centre = mean(positions);
    let far = positions
        .chunks_exact(3)
        .map(|p| (Vector3::from_column_slice(p) - centre).norm());
    far.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::super::tests::icosahedron;
    use super::*;
    use crate::inbetween::edge_lengths::{Blend, KeyShapes, Memory};

    /// The icosahedron with its first vertex pushed inside: the same lengths (R14, Fig. 1).
    fn dented(pose: &[f64]) -> Vec<f64> {
        let ring = [1, 5, 7, 10, 11];
        let centre = |axis: usize| ring.iter().map(|v| pose[3 * v + axis]).sum::<f64>() / 5.0;
        let mut dented = pose.to_vec();
        (0..3).for_each(|axis| dented[axis] = 2.0 * centre(axis) - pose[axis]);
        dented
    }

    struct Case {
        embedding: Embedding,
        keys: KeyShapes,
        weights: Vec<Vec<f64>>,
        frames: Vec<Embedded>,
        dent: Vec<f64>,
    }

    /// Eleven frames between the icosahedron and a stretched one, all on the convex branch.
    fn case() -> Case {
        let (topology, pose) = icosahedron();
        let other: Vec<f64> = pose
            .chunks_exact(3)
            .flat_map(|p| [1.2 * p[0], 0.9 * p[1] + 0.1 * p[0], p[2]])
            .collect();
        let embedding = Embedding::new(&topology).unwrap();
        let keys = KeyShapes::new(&embedding, &[&pose, &other]);
        let weights: Vec<Vec<f64>> = (0..=10)
            .map(|i| f64::from(i) / 10.0)
            .map(|t| vec![1.0 - t, t])
            .collect();
        let mut follower = Follower::new(&embedding);
        let frames = weights
            .iter()
            .map(|w| follower.next(&keys.blend(w, Blend::Lengths)).unwrap());
        Case {
            frames: frames.collect(),
            dent: embedding.dihedrals(&dented(&pose)),
            embedding,
            keys,
            weights,
        }
    }

    impl Case {
        /// The embedding at a frame's lengths that has the vertex inside.
        fn popped(&self, frame: usize) -> Embedded {
            let mut target = self.keys.blend(&self.weights[frame], Blend::Lengths);
            target.dihedrals = self.dent.clone();
            self.embedding
                .embed(&target, &mut Memory::default())
                .unwrap()
        }

        fn mend(&self, frames: &mut [Embedded]) -> Vec<Repair> {
            let blend = |weights: &[f64]| self.keys.blend(weights, Blend::Lengths);
            let fill = |from: &[f64], to: &[f64], count: usize| {
                let t = |i: usize| (i + 1) as f64 / (count + 1) as f64;
                let row = |i| {
                    from.iter()
                        .zip(to)
                        .map(|(a, b)| a + t(i) * (b - a))
                        .collect()
                };
                Ok((0..count).map(row).collect())
            };
            repair(&self.embedding, &blend, &self.weights, frames, &fill).unwrap()
        }
    }

    #[test]
    fn a_sequence_without_jumps_is_left_alone() {
        let case = case();
        let mut frames = case.frames.clone();
        assert!(case.mend(&mut frames).is_empty());
        assert_eq!(frames, case.frames);
    }

    #[test]
    fn a_planted_pop_is_found_and_taken_back() {
        let case = case();
        for popped in [vec![5], vec![4, 5, 6]] {
            let mut frames = case.frames.clone();
            for &frame in &popped {
                frames[frame] = case.popped(frame);
                // the same lengths, another shape
                assert!(frames[frame].report.edges.max_percent() < 0.01);
                let change = difference(&frames[frame].dihedrals, &case.frames[frame].dihedrals);
                assert!(change.change.abs() > 1.0);
            }
            let repairs = case.mend(&mut frames);
            assert_eq!(repairs.len(), 1, "{repairs:?}");
            let count = popped.len();
            assert_eq!(repairs[0].frame, popped[0]);
            assert_eq!(repairs[0].mending, Mending::Followed { frames: count });
            // the edge lies at the vertex or around it
            let ends = case.embedding.edges()[repairs[0].edge];
            assert!(
                ends.iter().all(|v| [0, 1, 5, 7, 10, 11].contains(v)),
                "{ends:?}"
            );
            for (found, wanted) in frames.iter().zip(&case.frames) {
                assert!(difference(&found.dihedrals, &wanted.dihedrals).change.abs() < 1e-2);
            }
        }
    }

    #[test]
    fn a_crease_that_must_turn_over_is_blended_across() {
        let case = case();
        let mut frames = case.frames.clone();
        // from frame 6 on inside, to a last pose that is inside as well
        (6..=10).for_each(|frame| frames[frame] = case.popped(frame));
        let repairs = case.mend(&mut frames);
        assert_eq!(repairs.len(), 1, "{repairs:?}");
        assert_eq!(
            (repairs[0].frame, repairs[0].mending),
            (6, Mending::Blended { frames: 4 })
        );
        // the first vertex now passes through the ring in even steps
        for frame in 4..8 {
            let step: f64 = (0..3)
                .map(|axis| frames[frame + 1].positions[axis] - frames[frame].positions[axis])
                .map(|d| d * d)
                .sum::<f64>()
                .sqrt();
            assert!(step < 0.5, "{step}");
        }
    }
}
