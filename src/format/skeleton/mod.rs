//! Skeletons in files: BVH, and a plain JSON list of joints. A skeleton is no mesh, so these stand beside
//! [`super::FORMATS`] and not in it.

mod bvh;
mod json;

use crate::diag::{Diagnostic, Result};
use crate::mesh::{Joint, Skeleton, SkeletonError, SkeletonPoses};

/// A file format of skeletons.
pub struct SkeletonFormat {
    /// The name for people.
    pub name: &'static str,
    /// The ending of its files, in lower case, without the dot.
    pub ending: &'static str,
    /// Bytes to poses.
    ///
    /// # Errors
    /// The file is damaged, its joints are no tree, or a number is not finite.
    pub read: fn(&[u8]) -> Result<SkeletonPoses>,
    /// Poses to bytes.
    pub write: fn(&SkeletonPoses) -> Vec<u8>,
}

/// All formats of skeletons.
pub const SKELETONS: &[SkeletonFormat] = &[
    SkeletonFormat {
        name: "BVH",
        ending: "bvh",
        read: bvh::read,
        write: bvh::write,
    },
    SkeletonFormat {
        name: "JSON joints",
        ending: "json",
        read: json::read,
        write: json::write,
    },
];

/// The format of an ending (without the dot, any case).
pub fn by_ending(ending: &str) -> Option<&'static SkeletonFormat> {
    SKELETONS
        .iter()
        .find(|format| format.ending.eq_ignore_ascii_case(ending))
}

/// Joins joints, told with their names where they make no tree.
fn joined(joints: Vec<Joint>) -> Result<Skeleton> {
    let names: Vec<String> = joints.iter().map(|joint| joint.name.clone()).collect();
    Skeleton::new(joints).or_else(|error| {
        let told = match error {
            SkeletonError::Empty => Diagnostic::error("there are no joints"),
            SkeletonError::TwoRoots { first, second } => Diagnostic::error(format!(
                "two joints have no parent: `{}` and `{}`",
                names[first], names[second]
            ))
            .hint("a skeleton is one tree: let one hang from the other"),
            SkeletonError::NoSuchParent { joint } => {
                Diagnostic::error(format!("joint `{}` hangs from nothing", names[joint]))
            }
            SkeletonError::Cycle { joint } => Diagnostic::error(format!(
                "joint `{}` hangs from itself, through its parents",
                names[joint]
            ))
            .hint("every joint but the root names its parent, and the root has none"),
        };
        told.err()
    })
}

/// Refuses coordinates that are not finite.
fn finite(poses: SkeletonPoses) -> Result<SkeletonPoses> {
    let width = 3 * poses.skeleton.joints().len();
    match poses.positions.iter().position(|x| !x.is_finite()) {
        None => Ok(poses),
        Some(at) => {
            let joint = &poses.skeleton.joints()[at % width / 3].name;
            Diagnostic::error(format!("joint `{joint}` is not at a finite place"))
                .at_frame(at / width + 1)
                .hint("export the file again")
                .err()
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::math::rotation::exp;
    use nalgebra::Vector3;

    /// A spine with two arms and a head, in three poses; `stretch` changes lengths from pose to pose.
    fn poses(stretch: f64) -> SkeletonPoses {
        let joint = |name: &str, parent| Joint {
            name: name.into(),
            parent,
        };
        let joints = vec![
            joint("hips", None),
            joint("spine", Some(0)),
            joint("head", Some(1)),
            joint("left_arm", Some(1)),
            joint("left_hand", Some(3)),
            joint("left_hand end", Some(4)),
        ];
        let rest = [
            [0.0, 0.0, 0.0],
            [0.1, 1.0, 0.0],
            [0.0, 0.5, 0.0],
            [0.4, 0.3, 0.1],
            [0.7, 0.0, 0.0],
            [0.2, 0.0, 0.1],
        ]
        .map(Vector3::from);
        let mut positions = Vec::new();
        for frame in 0..3 {
            let t = f64::from(frame);
            let mut placed = [Vector3::new(t, 2.0 * t, -t); 6];
            let mut turns = [exp(&Vector3::new(0.3 * t, 0.1, 0.2)); 6];
            for (index, parent) in [(1, 0), (2, 1), (3, 1), (4, 3), (5, 4)] {
                turns[index] = turns[parent] * exp(&Vector3::new(0.4, -0.3 * t, 0.2 * t));
                placed[index] = placed[parent] + turns[parent] * rest[index] * (1.0 + stretch * t);
            }
            positions.extend(placed.iter().flat_map(|at| at.data.0[0]));
        }
        SkeletonPoses {
            skeleton: Arc::new(Skeleton::new(joints).unwrap()),
            positions,
            fps: Some(25.0),
        }
    }

    #[test]
    fn poses_survive_every_format() {
        for format in SKELETONS {
            for stretch in [0.0, 0.3] {
                let poses = poses(stretch);
                let read = (format.read)(&(format.write)(&poses)).unwrap();
                // an end site cannot move away from its joint: where it does, it is a joint
                let named = stretch == 0.0 || format.name != "BVH";
                assert!(!named || read.skeleton == poses.skeleton, "{}", format.name);
                assert_eq!(read.fps, poses.fps);
                let apart = read.positions.iter().zip(&poses.positions);
                let apart = apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // angles in degrees with all their digits
                assert!(apart < 1e-9, "{} {stretch}: {apart}", format.name);
                // once more changes nothing
                let again = (format.read)(&(format.write)(&read)).unwrap();
                let apart = read.positions.iter().zip(&again.positions);
                assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-9);
            }
        }
    }

    #[test]
    fn formats_are_found_by_their_ending() {
        assert_eq!(by_ending("BVH").map(|format| format.name), Some("BVH"));
        assert!(by_ending("obj").is_none());
    }
}
