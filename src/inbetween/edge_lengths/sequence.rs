//! A sequence of embeddings along a path of weights, each frame started from the one before.

use std::sync::Arc;

use rayon::prelude::*;

use super::both_ways::{Frames, Stopped};
use super::guard::{Fill, Repair, repair};
use super::{
    Blend, EmbedError, EmbedReport, Embedded, Embedding, KeyShapes, Memory, Target, wrapped,
};
use crate::mesh::Topology;
use crate::space::{SpaceError, Spaces, StraightPath};
use crate::task::{Cancelled, Task};

/// How a sequence is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// What is blended.
    pub blend: Blend,
    /// Every so many frames one is embedded (1: all), lengths and dihedral angles are blended between
    /// (R14 §3; Winkler et al. 2010). The last frame and those that are a pose are always embedded.
    pub every: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            blend: Blend::Lengths,
            every: 1,
        }
    }
}

/// Why there is no sequence. Frames count from 0.
#[derive(Debug, Clone, PartialEq)]
pub enum SequenceError {
    /// The lengths of a frame have no embedding.
    Embed {
        /// The frame.
        frame: usize,
        /// Why.
        error: EmbedError,
    },
    /// The space that fills frames between cannot be made.
    Space(SpaceError),
    /// The task was cancelled.
    Cancelled,
}

impl From<Cancelled> for SequenceError {
    fn from(_: Cancelled) -> Self {
        SequenceError::Cancelled
    }
}

impl From<SpaceError> for SequenceError {
    fn from(error: SpaceError) -> Self {
        SequenceError::Space(error)
    }
}

/// Frames between poses.
#[derive(Debug, Clone)]
pub struct Morph {
    /// 3V positions a frame.
    pub frames: Vec<Vec<f64>>,
    /// How each frame was embedded; none for frames that were filled in between.
    pub reports: Vec<Option<EmbedReport>>,
    /// Jumps that were found and what was done about them, in the order of the frames.
    pub repairs: Vec<Repair>,
}

/// Frames along a path of weights, one row a frame, one weight a pose. A row that is one pose alone gives
/// that pose. Jumps between embeddings are found and mended ([`Repair`]). One step of `task`
/// a frame.
///
/// # Errors
/// Lengths that make no triangle, a mesh too large for the space that fills frames, cancellation.
///
/// # Panics
/// A row has not one weight a pose.
pub fn morph(
    embedding: &Embedding,
    topology: &Arc<Topology>,
    keys: &KeyShapes,
    weights: &[Vec<f64>],
    options: Options,
    task: &Task,
) -> Result<Morph, SequenceError> {
    let chosen = chosen(weights, options.every);
    let rows: Vec<Vec<f64>> = chosen.iter().map(|&frame| weights[frame].clone()).collect();
    let frames = Frames {
        embedding,
        keys,
        blend: options.blend,
        rows: &rows,
        task,
    };
    let mut embedded = frames.embedded().map_err(|stopped| match stopped {
        Stopped::Cancelled => SequenceError::Cancelled,
        Stopped::Embed(at, error) => SequenceError::Embed {
            frame: chosen[at],
            error,
        },
    })?;
    let fill = |from: &[f64], to: &[f64], count: usize| between(topology, from, to, count);
    let blend = |weights: &[f64]| keys.blend(weights, options.blend);
    let mut repairs = repair(embedding, &blend, &rows, &mut embedded, &fill)?;
    repairs
        .iter_mut()
        .for_each(|repair| repair.frame = chosen[repair.frame]);
    Ok(Morph {
        repairs,
        ..filled(&chosen, embedded, weights.len(), &fill)?
    })
}

/// The frames that are embedded.
fn chosen(weights: &[Vec<f64>], every: usize) -> Vec<usize> {
    let last = weights.len().saturating_sub(1);
    let wanted = |&frame: &usize| {
        frame % every.max(1) == 0 || frame == last || pose_of(&weights[frame]).is_some()
    };
    (0..weights.len()).filter(wanted).collect()
}

/// The pose that a row is alone, if it is.
pub(super) fn pose_of(row: &[f64]) -> Option<usize> {
    let alone = row.iter().filter(|w| **w != 0.0).count() == 1;
    row.iter().position(|w| *w == 1.0).filter(|_| alone)
}

/// Puts embedded frames in their places and blends lengths and angles between them.
fn filled(
    chosen: &[usize],
    embedded: Vec<Embedded>,
    frames: usize,
    fill: &Fill,
) -> Result<Morph, SequenceError> {
    let mut morph = Morph {
        frames: vec![Vec::new(); frames],
        reports: vec![None; frames],
        repairs: Vec::new(),
    };
    for (at, pair) in chosen
        .windows(2)
        .enumerate()
        .filter(|(_, pair)| pair[1] > pair[0] + 1)
    {
        let (from, to) = (&embedded[at].positions, &embedded[at + 1].positions);
        let made = fill(from, to, pair[1] - pair[0] - 1)?;
        morph.frames[pair[0] + 1..pair[1]].clone_from_slice(&made);
    }
    for (&frame, found) in chosen.iter().zip(embedded) {
        morph.frames[frame] = found.positions;
        morph.reports[frame] = Some(found.report);
    }
    Ok(morph)
}

/// `count` shapes evenly between two, in lengths and dihedral angles.
fn between(
    topology: &Arc<Topology>,
    from: &[f64],
    to: &[f64],
    count: usize,
) -> Result<Vec<Vec<f64>>, SpaceError> {
    let space = Spaces::new(Arc::clone(topology), from).open("lengths-angles", &[])?;
    let path = StraightPath::new(space, from, to);
    let shape = |step: usize| {
        let mut positions = vec![0.0; from.len()];
        path.at((step + 1) as f64 / (count + 1) as f64, &mut positions);
        positions
    };
    Ok((0..count).into_par_iter().map(shape).collect())
}

/// Embeds one target after the other: what the solved dihedral angles differ from the blended ones by is
/// carried to the next guess.
pub(super) struct Follower<'a> {
    embedding: &'a Embedding,
    memory: Memory,
    carried: Option<Vec<f64>>,
}

impl<'a> Follower<'a> {
    pub(super) fn new(embedding: &'a Embedding) -> Self {
        Follower {
            embedding,
            memory: Memory::default(),
            carried: None,
        }
    }

    /// Goes on from a frame that is known.
    pub(super) fn from(embedding: &'a Embedding, found: &Embedded, target: &Target) -> Self {
        let mut follower = Follower::new(embedding);
        follower.carry(found, target);
        follower
    }

    /// The next frame.
    pub(super) fn next(&mut self, target: &Target) -> Result<Embedded, EmbedError> {
        let mut guessed = target.clone();
        if let Some(carried) = &self.carried {
            let angles = guessed.dihedrals.iter_mut().zip(carried);
            angles.for_each(|(angle, carried)| *angle += carried);
        }
        let found = self.embedding.embed(&guessed, &mut self.memory)?;
        self.carry(&found, target);
        Ok(found)
    }

    fn carry(&mut self, found: &Embedded, target: &Target) {
        let differences = found.dihedrals.iter().zip(&target.dihedrals);
        let carried = differences.map(|(found, blended)| wrapped(found - blended));
        self.carried = Some(carried.collect());
    }
}
