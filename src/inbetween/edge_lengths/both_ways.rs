//! Embeddings between poses, found from both: each frame is started from its neighbour on the side of the
//! nearer pose, and the two ways meet in the middle. Where lengths have one shape that both lead to, they
//! agree there. Where they do not (a crease turned over on the way), both go on, and the sequence changes
//! from one to the other where they lie nearest each other; the jump guard looks at that step.

use super::guard::same;
use super::sequence::{Follower, pose_of};
use super::{Blend, EmbedError, Embedded, Embedding, KeyShapes};
use crate::task::{Cancelled, Task};

/// Why there is no frame: its index, and the reason.
pub(super) enum Stopped {
    Embed(usize, EmbedError),
    Cancelled,
}

impl From<Cancelled> for Stopped {
    fn from(_: Cancelled) -> Self {
        Stopped::Cancelled
    }
}

/// An edge error (root mean square, percent) that counts as much as a jump by the mean edge length when
/// the place of a change is chosen.
const ERROR: f64 = 0.5;

/// Frames to be embedded: one row of weights each.
pub(super) struct Frames<'a> {
    pub(super) embedding: &'a Embedding,
    pub(super) keys: &'a KeyShapes,
    pub(super) blend: Blend,
    pub(super) rows: &'a [Vec<f64>],
    pub(super) task: &'a Task,
}

impl Frames<'_> {
    /// All frames; rows that are one pose alone are that pose. One step of the task a frame.
    pub(super) fn embedded(&self) -> Result<Vec<Embedded>, Stopped> {
        let anchors: Vec<usize> = (0..self.rows.len())
            .filter(|&at| pose_of(&self.rows[at]).is_some())
            .collect();
        let (Some(&first), Some(&last)) = (anchors.first(), anchors.last()) else {
            return self.walk(None, 0..self.rows.len(), true);
        };
        let mut all = self.walk(Some(first), (0..first).rev(), true)?;
        all.reverse();
        for (at, &anchor) in anchors.iter().enumerate() {
            all.push(self.pose(anchor));
            self.task.step();
            if let Some(&next) = anchors.get(at + 1) {
                all.extend(self.between(anchor, next)?);
            }
        }
        all.extend(self.walk(Some(last), last + 1..self.rows.len(), true)?);
        Ok(all)
    }

    fn pose(&self, at: usize) -> Embedded {
        let pose = pose_of(&self.rows[at]).unwrap_or(0);
        self.embedding.known(self.keys, pose)
    }

    /// Frames one after the other, beginning from a frame that is a pose, or from nothing.
    fn walk(
        &self,
        from: Option<usize>,
        frames: impl Iterator<Item = usize>,
        counted: bool,
    ) -> Result<Vec<Embedded>, Stopped> {
        let mut follower = Follower::new(self.embedding);
        if let Some(at) = from {
            follower = Follower::from(self.embedding, &self.pose(at), &self.target(at));
        }
        self.follow(&mut follower, frames, counted)
    }

    fn follow(
        &self,
        follower: &mut Follower,
        frames: impl Iterator<Item = usize>,
        counted: bool,
    ) -> Result<Vec<Embedded>, Stopped> {
        let mut all = Vec::new();
        for at in frames {
            self.task.check()?;
            let found = follower.next(&self.target(at));
            all.push(found.map_err(|error| Stopped::Embed(at, error))?);
            if counted {
                self.task.step();
            }
        }
        Ok(all)
    }

    fn target(&self, at: usize) -> super::Target {
        self.keys.blend(&self.rows[at], self.blend)
    }

    /// The frames between two that are poses.
    fn between(&self, from: usize, to: usize) -> Result<Vec<Embedded>, Stopped> {
        if to - from < 2 {
            return Ok(Vec::new());
        }
        // both ways find the middle
        let middle = from + (to - from) / 2;
        let [mut ahead, mut back] =
            [from, to].map(|at| Follower::from(self.embedding, &self.pose(at), &self.target(at)));
        let (one, two) = rayon::join(
            || self.follow(&mut ahead, from + 1..=middle, true),
            || self.follow(&mut back, (middle..to).rev(), true),
        );
        let (mut forward, mut backward) = (one?, two?);
        let meeting = [&forward, &backward].map(|way| way.last());
        let agree = match meeting {
            [Some(one), Some(two)] => same(self.embedding, one, two),
            _ => true,
        };
        if agree {
            backward.pop();
            backward.reverse();
            forward.extend(backward);
            return Ok(forward);
        }
        let (one, two) = rayon::join(
            || self.follow(&mut ahead, middle + 1..to, false),
            || self.follow(&mut back, (from + 1..middle).rev(), false),
        );
        forward.extend(one?);
        backward.extend(two?);
        backward.reverse();
        let change = self.change(&forward, &backward);
        forward.truncate(change);
        forward.extend(backward.drain(change..));
        Ok(forward)
    }

    /// How many frames are taken from `forward`, the others from `backward`.
    fn change(&self, forward: &[Embedded], backward: &[Embedded]) -> usize {
        let lengths = self.keys.lengths(0);
        let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
        let apart = |at: usize| {
            let pairs = forward[at].positions.iter().zip(&backward[at].positions);
            let square: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
            (square / self.embedding.vertices().max(1) as f64).sqrt() / mean
        };
        let error = |frames: &[Embedded]| {
            let each = frames.iter().map(|found| found.report.edges.rms_percent);
            each.fold(0.0, f64::max) / ERROR
        };
        let score = |taken: usize| {
            apart(taken - 1) + error(&forward[..taken]).max(error(&backward[taken..]))
        };
        let choices = 1..=forward.len();
        let best = choices.min_by(|&a, &b| score(a).total_cmp(&score(b)));
        best.unwrap_or(forward.len())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::tests::{ball, icosahedron};
    use super::super::{Mending, Morph, Options, morph};
    use super::*;
    use crate::mesh::Topology;

    fn line(steps: u32) -> Vec<Vec<f64>> {
        let each = (0..=steps).map(|i| f64::from(i) / f64::from(steps));
        each.map(|t| vec![1.0 - t, t]).collect()
    }

    fn morphed(topology: &Topology, poses: [&[f64]; 2], rows: &[Vec<f64>]) -> (Embedding, Morph) {
        let embedding = Embedding::new(topology).unwrap();
        let keys = KeyShapes::new(&embedding, &poses);
        let topology = Arc::new(topology.clone());
        let (options, task) = (Options::default(), Task::default());
        let found = morph(&embedding, &topology, &keys, rows, options, &task).unwrap();
        (embedding, found)
    }

    #[test]
    fn a_sequence_and_its_reverse_are_the_same() {
        let (topology, one) = ball(9, 8, 0.1);
        let stretched = |p: &[f64]| [p[0], p[1], 1.2 * p[2]];
        let two: Vec<f64> = one.chunks_exact(3).flat_map(stretched).collect();
        let (embedding, there) = morphed(&topology, [&one, &two], &line(8));
        let (_, back) = morphed(&topology, [&two, &one], &line(8));
        assert!(there.repairs.is_empty() && back.repairs.is_empty());
        for (a, b) in there.frames.iter().zip(back.frames.iter().rev()) {
            let pairs = [a, b].map(|pose| embedding.dihedrals(pose));
            let apart = pairs[0].iter().zip(&pairs[1]).map(|(a, b)| (a - b).abs());
            // both stop when they gain nothing more
            assert!(apart.fold(0.0, f64::max) < 0.05);
        }
    }

    #[test]
    fn frames_next_to_a_pose_have_its_branch_whatever_lies_before() {
        // the icosahedron and the same with a vertex pushed inside (R14, Fig. 1), a little narrower: no way
        // leads from one to the other, but near each pose its own shape has the lengths
        let (topology, pose) = icosahedron();
        let ring = [1, 5, 7, 10, 11];
        let centre = |axis: usize| ring.iter().map(|v| pose[3 * v + axis]).sum::<f64>() / 5.0;
        let mut dented = pose.clone();
        (0..3).for_each(|axis| dented[axis] = 2.0 * centre(axis) - pose[axis]);
        dented.iter_mut().for_each(|x| *x *= 0.98);
        let (embedding, found) = morphed(&topology, [&pose, &dented], &line(20));
        let repairs = &found.repairs;
        assert_eq!(repairs.len(), 1, "{repairs:?}");
        let Mending::Blended { frames } = repairs[0].mending else {
            panic!("{repairs:?}");
        };
        assert!((1..=5).contains(&frames));
        let turned = embedding.dihedrals(&dented);
        let mut met = 0;
        for (frame, report) in found.frames.iter().zip(&found.reports) {
            let angles = embedding.dihedrals(frame);
            let differs = |own: &[f64]| {
                let apart = angles.iter().zip(own).map(|(a, b)| (a - b).abs());
                apart.fold(0.0, f64::max)
            };
            let branch = [embedding.dihedrals(&pose), turned.clone()]
                .iter()
                .any(|own| differs(own) < 0.1);
            let percent = report
                .as_ref()
                .map_or(0.0, |report| report.edges.max_percent());
            met += usize::from(branch && percent < 0.01);
        }
        // all but those that are blended across
        assert_eq!(met, found.frames.len() - frames);
    }
}
