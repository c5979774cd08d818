//! A capture's frames as rows of vertex coordinates, with their root motion split off where that is asked for.

use std::ops::Range;

use nalgebra::{Isometry3, Matrix3, Vector3};
use rayon::prelude::*;

use crate::diag::{Diagnostic, Result};
use crate::math::pca::Rows;
use crate::mesh::rigid_align::{self, Axis};
use crate::mesh::{FrameSource, Sequence};
use crate::signal::root::{RootKind, RootSignal};
use crate::task::Task;

/// Captures whose middle ends up farther from where it began than this many sizes of the body travel.
const TRAVELS: f64 = 0.5;

/// The axis that the ground is across of: that of OBJ and glTF.
pub const UP: Axis = Axis::Y;

/// The frames of a sequence, each turned and moved back by its root motion; nothing is copied.
pub struct Frames<'a> {
    sequence: &'a Sequence,
    /// What takes each frame back, as turn and shift; none: frames as they are.
    back: Vec<(Matrix3<f64>, Vector3<f64>)>,
}

impl<'a> Frames<'a> {
    /// The frames as they are.
    pub fn new(sequence: &'a Sequence) -> Self {
        Frames {
            sequence,
            back: Vec::new(),
        }
    }

    /// The frames without the rigid motion that takes the first frame nearest to each, and that motion.
    /// The pivot is the mean of the first frame's vertices.
    ///
    /// # Errors
    /// The task was cancelled; coordinates are not finite.
    pub fn without_root(
        sequence: &'a Sequence,
        kind: RootKind,
        task: &Task,
    ) -> Result<(Self, RootSignal)> {
        let reference = doubles(sequence.frame(0));
        let motion = |frame: usize| -> Result<Isometry3<f64>> {
            task.check()?;
            let positions = doubles(sequence.frame(frame));
            Ok(match kind {
                RootKind::Rigid => rigid_align::rigid(&reference, &positions),
                RootKind::Ground => rigid_align::ground(&reference, &positions, UP),
            })
        };
        let motions: Vec<Isometry3<f64>> = (0..sequence.frames())
            .into_par_iter()
            .map(motion)
            .collect::<Result<_>>()?;
        let pivot = rigid_align::mean(&reference);
        let root = RootSignal::through(kind, pivot, &motions).map_err(|error| {
            Box::new(Diagnostic::error("the root motion is not finite").at_frame(error.frame + 1))
        })?;
        let parts = |motion: &Isometry3<f64>| {
            let back = motion.inverse();
            (
                *back.rotation.to_rotation_matrix().matrix(),
                back.translation.vector,
            )
        };
        let back = motions.iter().map(parts).collect();
        Ok((Frames { sequence, back }, root))
    }
}

impl Rows for Frames<'_> {
    fn rows(&self) -> usize {
        self.sequence.frames()
    }

    fn columns(&self) -> usize {
        3 * self.sequence.topology().vertices()
    }

    fn copy(&self, row: usize, range: Range<usize>, out: &mut [f64]) {
        let frame = &self.sequence.frame(row)[range];
        out.iter_mut()
            .zip(frame)
            .for_each(|(out, z)| *out = f64::from(*z));
        if let Some((turn, shift)) = self.back.get(row) {
            for point in out.as_chunks_mut::<3>().0 {
                *point = (turn * Vector3::from(*point) + shift).into();
            }
        }
    }
}

/// A warning where the capture travels and its root motion stays in.
pub fn travel_warning(sequence: &Sequence) -> Option<Diagnostic> {
    let last = sequence.frames().checked_sub(1)?;
    let (first, last) = (doubles(sequence.frame(0)), doubles(sequence.frame(last)));
    let middle = rigid_align::mean(&first);
    let far = |p: &[f64; 3]| (Vector3::from(*p) - middle).norm_squared();
    let size = 2.0
        * first
            .as_chunks::<3>()
            .0
            .iter()
            .map(far)
            .fold(0.0, f64::max)
            .sqrt();
    let way = (rigid_align::mean(&last) - middle).norm();
    (size > 0.0 && way > TRAVELS * size).then(|| {
        Diagnostic::warning(format!(
            "the capture travels {:.1} times its size: loops will jump back",
            way / size
        ))
        .hint("`--root ground` keeps the way apart, so that loops carry it on")
    })
}

fn doubles(positions: &[f32]) -> Vec<f64> {
    positions.iter().map(|&x| f64::from(x)).collect()
}
