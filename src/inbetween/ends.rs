//! What happens at the ends of a motion: free, going round, or with given velocities (X19 §3.2, X26).

use super::drift::Drift;
use super::keys::{Keys, same_faces};
use crate::diag::{Diagnostic, Result};
use crate::mesh::rigid_align::rigid;
use crate::mesh::{Bounds, FrameSource, Topology};

/// What happens at the ends. Beyond the first and the last key natural and Hermite motions go on
/// straight (X19 §3.2), periodic ones go round again.
#[derive(Debug, Clone, Default)]
pub enum Boundary {
    /// Second derivatives 0: least bending.
    #[default]
    Natural,
    /// The last key is the first again; both are passed smoothly.
    Periodic {
        /// The last key may be the first moved rigidly: that motion is split off and put back.
        drift: bool,
    },
    /// Given velocities.
    Hermite {
        /// At the first key.
        start: Option<Velocity>,
        /// At the last key.
        end: Option<Velocity>,
    },
}

/// A velocity in the shape space: the difference of two shapes' coordinates over a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Velocity {
    /// The shape that is left, 3V positions; none: the key itself.
    pub from: Option<Vec<f32>>,
    /// The shape that is reached.
    pub to: Vec<f32>,
    /// The time between, in frames; not 0. Negative where `to` lies before `from`.
    pub time: f64,
}

impl Velocity {
    /// The velocity at an end of a motion, from its frames (X26): of the first two, or of the last two,
    /// for frames spread evenly over `time`.
    ///
    /// # Errors
    /// Fewer than two frames, or another mesh than `topology`.
    pub fn at_end(
        frames: &crate::mesh::Sequence,
        topology: &Topology,
        last: bool,
        time: f64,
    ) -> Result<Self> {
        same_faces(topology, frames.topology(), 1)?;
        let n = frames.frames();
        if n < 2 {
            return Diagnostic::error("one frame has no velocity")
                .hint("name a sequence of two or more frames")
                .err();
        }
        let from = if last { n - 2 } else { 0 };
        Ok(Velocity {
            from: Some(frames.frame(from).to_vec()),
            to: frames.frame(from + 1).to_vec(),
            time: time / (n - 1) as f64,
        })
    }

    /// The velocity that one pose (from the key towards it) or two (from the first to the second) give,
    /// in a time of [`super::SPACING`] frames.
    ///
    /// # Errors
    /// No pose or more than two, or another mesh than `topology`.
    pub fn of_poses(poses: &crate::mesh::Sequence, topology: &Topology) -> Result<Self> {
        same_faces(topology, poses.topology(), 1)?;
        let (from, to) = match poses.frames() {
            1 => (None, 0),
            2 => (Some(poses.frame(0).to_vec()), 1),
            n => {
                return Diagnostic::error(format!("{n} poses give no velocity"))
                    .hint("one is what the key moves towards, two are left and reached")
                    .err();
            }
        };
        Ok(Velocity {
            from,
            to: poses.frame(to).to_vec(),
            time: super::SPACING,
        })
    }
}

/// How far, in sizes of the mesh, two shapes may differ that are one: files keep six digits.
const SAME: f64 = 1e-5;

/// The rigid motion to be split off, if any; the first and the last key of a period agree.
pub(super) fn drift(keys: &Keys, boundary: &Boundary) -> Result<Option<Drift>> {
    let Boundary::Periodic { drift } = boundary else {
        return Ok(None);
    };
    let last = keys.count() - 1;
    let (first, end) = (keys.pose(0), keys.pose(last));
    let size = Bounds::of(keys.poses().frame(0)).map_or(0.0, |bounds| {
        let along = |axis: usize| f64::from(bounds.max[axis] - bounds.min[axis]);
        (0..3).map(along).fold(0.0, f64::max)
    });
    let near = |shape: &[f64], share: f64| {
        let pairs = shape.iter().zip(&end);
        pairs
            .into_iter()
            .all(|(a, b)| (a - b).abs() <= share * size)
    };
    let motion = rigid(&first, &end);
    let moved: Vec<f64> = first
        .chunks_exact(3)
        .flat_map(|point| {
            let point = nalgebra::Point3::from_slice(point);
            (motion * point).coords.data.0[0]
        })
        .collect();
    // a rigid fit to rounded files is a little less exact
    let rigidly = near(&moved, 10.0 * SAME);
    if *drift && rigidly {
        return Ok(Some(Drift::between(&first, &end, keys.ends())));
    }
    if near(&first, SAME) {
        return Ok(None);
    }
    let told = Diagnostic::error(format!(
        "the last key ({}) differs from the first: a period ends where it began",
        last + 1
    ));
    match rigidly {
        true => told.hint(
            "it is the first key, moved: `--drift rigid` (drift: \"rigid\") splits the motion off",
        ),
        false => told.hint("repeat the first key as the last"),
    }
    .err()
}

/// Hermite ends have velocities, of shapes of the keys' mesh.
pub(super) fn check_velocities(keys: &Keys, boundary: &Boundary) -> Result<()> {
    let Boundary::Hermite { start, end } = boundary else {
        return Ok(());
    };
    let vertices = keys.poses().topology().vertices();
    for (velocity, name, key) in [(start, "start", "first"), (end, "end", "last")] {
        let Some(velocity) = velocity else {
            return Diagnostic::error(format!("Hermite ends without a velocity at the {key} key"))
                .hint(format!(
                    "`--{name}-velocity POSE` or `--velocities-from SEQUENCE` gives it ({name}_velocity, \
                     velocities_from in recipes)"
                ))
                .err();
        };
        for shape in velocity.from.iter().chain([&velocity.to]) {
            if shape.len() != 3 * vertices {
                return Diagnostic::error(format!(
                    "a shape of {} vertices gives no velocity to keys of {vertices}",
                    shape.len() / 3
                ))
                .hint("velocities are differences of shapes of the keys' mesh")
                .err();
            }
        }
    }
    Ok(())
}
