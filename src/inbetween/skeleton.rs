//! Isometric morphs of skeletons (Wuhrer et al., "Isometric morphing of triangular meshes", theorem 2): the
//! lengths of bones go linearly, their directions along great circles (slerp), and joints follow from the
//! root outwards. O(J) a frame; lengths are exact, and no joint is placed twice.
//!
//! The rigid motion between the poses is taken off first and put back as a steady turn about the means
//! of the joints, so that both poses are met as they are given.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use super::isometric::Alignment;
use super::polygon::{point, put};
use crate::math::direction::Arc;
use crate::math::rotation::{exp, log};
use crate::mesh::Skeleton;
use crate::mesh::rigid_align::{mean, rigid};

/// Two poses of a skeleton, ready to be morphed.
#[derive(Debug, Clone)]
pub struct SkeletonMorph {
    root: u32,
    /// The root's place in both poses, about the mean of all joints.
    roots: [Vector3<f64>; 2],
    /// Parents before children.
    bones: Vec<Bone>,
    means: [Vector3<f64>; 2],
    turn: Vector3<f64>,
    opposite: Vec<u32>,
}

#[derive(Debug, Clone)]
struct Bone {
    ends: [u32; 2],
    lengths: [f64; 2],
    direction: Arc,
}

impl SkeletonMorph {
    /// Two poses of 3J coordinates. A bone without length in one pose has its direction in the other; one
    /// whose directions are opposite turns about the axis across it and its parent's bone, and is listed
    /// in [`SkeletonMorph::opposite`].
    ///
    /// # Panics
    /// A pose is not 3J long.
    pub fn new(skeleton: &Skeleton, from: &[f64], to: &[f64], alignment: Alignment) -> Self {
        let turn = match alignment {
            Alignment::Rigid => rigid(from, to).rotation,
            Alignment::None => UnitQuaternion::identity(),
        };
        let (means, back) = ([mean(from), mean(to)], turn.inverse());
        let root = skeleton.order()[0];
        let mut morph = SkeletonMorph {
            root,
            roots: [
                point(from, root) - means[0],
                back * (point(to, root) - means[1]),
            ],
            bones: Vec::with_capacity(skeleton.order().len()),
            means,
            turn: log(&turn),
            opposite: Vec::new(),
        };
        let mut along = vec![Vector3::zeros(); skeleton.joints().len()];
        for &joint in &skeleton.order()[1..] {
            let parent = skeleton.joints()[joint as usize].parent.unwrap_or(root);
            let first = point(from, joint) - point(from, parent);
            let second = back * (point(to, joint) - point(to, parent));
            let lengths = [first.norm(), second.norm()];
            let one = first.try_normalize(0.0);
            let direction = match (one, second.try_normalize(0.0)) {
                (Some(a), Some(b)) => Arc::between(&a, &b).unwrap_or_else(|| {
                    morph.opposite.push(joint);
                    Arc::half_circle(&a, &a.cross(&along[parent as usize]))
                }),
                (one, other) => Arc::still(&one.or(other).unwrap_or_else(Vector3::x)),
            };
            along[joint as usize] = direction.at(0.0);
            morph.bones.push(Bone {
                ends: [parent, joint],
                lengths,
                direction,
            });
        }
        morph
    }

    /// The pose a fraction `t` of the way.
    ///
    /// # Panics
    /// `positions` is not 3J long.
    pub fn at(&self, t: f64, positions: &mut [f64]) {
        let centre = self.means[0] * (1.0 - t) + self.means[1] * t;
        let whole = Isometry3::from_parts(Translation3::from(centre), exp(&(self.turn * t)));
        let root = self.roots[0] * (1.0 - t) + self.roots[1] * t;
        put(
            positions,
            self.root,
            &(whole * nalgebra::Point3::from(root)).coords,
        );
        for bone in &self.bones {
            let [parent, joint] = bone.ends;
            let length = bone.lengths[0] * (1.0 - t) + bone.lengths[1] * t;
            let reach = whole.rotation * (bone.direction.at(t) * length);
            let place = point(positions, parent) + reach;
            put(positions, joint, &place);
        }
    }

    /// Joints whose bones have opposite directions in the two poses: which way they turn is a guess.
    /// They count from 0.
    pub fn opposite(&self) -> &[u32] {
        &self.opposite
    }

    /// The angle in radians by which the whole turns between the poses.
    pub fn turn(&self) -> f64 {
        self.turn.norm()
    }

    /// Mean and largest angle in radians by which the bones turn between the poses, the turn of the
    /// whole apart.
    pub fn bone_turns(&self) -> [f64; 2] {
        let angles = self.bones.iter().map(|bone| bone.direction.angle());
        let worst = angles.clone().fold(0.0, f64::max);
        [angles.sum::<f64>() / self.bones.len().max(1) as f64, worst]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Joint;

    /// A tree of `n` joints, each hanging from one of the few before it, and a pose of it.
    fn tree(n: usize, seed: f64, stretch: f64) -> (Skeleton, Vec<f64>) {
        let parent = |joint: usize| joint - 1 - (joint * 7 % 3).min(joint - 1);
        let joints = (0..n).map(|joint| Joint {
            name: joint.to_string(),
            parent: (joint > 0).then(|| parent(joint) as u32),
        });
        let mut pose = vec![0.0; 3 * n];
        for joint in 1..n {
            let x = joint as f64;
            let bone = Vector3::new(
                libm::sin(0.1 * x + seed),
                libm::cos(0.37 * x + 1.3 * seed),
                1.0 + libm::sin(0.05 * x * seed),
            );
            let long = stretch * (1.0 + 0.5 * libm::sin(x));
            let at = point(&pose, parent(joint) as u32) + bone.normalize() * long;
            put(&mut pose, joint as u32, &at);
        }
        (Skeleton::new(joints.collect()).unwrap(), pose)
    }

    fn length(pose: &[f64], [a, b]: [u32; 2]) -> f64 {
        (point(pose, a) - point(pose, b)).norm()
    }

    #[test]
    fn lengths_are_linear_and_both_poses_are_met() {
        for n in [1, 2, 30, 400] {
            let (skeleton, from) = tree(n, 0.2, 1.0);
            for (seed, stretch) in [(0.9, 1.0), (0.5, 1.4)] {
                let to = tree(n, seed, stretch).1;
                let morph = SkeletonMorph::new(&skeleton, &from, &to, Alignment::Rigid);
                let mut at = vec![0.0; from.len()];
                // rounding of coordinates up to the length of a path through all bones
                let bound = 1e-15 * (4.0 + n as f64);
                for t in [0.0, 0.3, 0.5, 1.0] {
                    morph.at(t, &mut at);
                    for bone in skeleton.bones() {
                        let wanted = (1.0 - t) * length(&from, bone) + t * length(&to, bone);
                        assert!((length(&at, bone) - wanted).abs() < bound);
                    }
                    for (end, pose) in [(0.0, &from), (1.0, &to)] {
                        let apart = at.iter().zip(pose).map(|(a, b)| (a - b).abs());
                        assert!(t != end || apart.fold(0.0, f64::max) < 100.0 * bound);
                    }
                }
            }
        }
    }

    #[test]
    fn a_turned_skeleton_is_reached_by_a_rigid_motion() {
        let (skeleton, from) = tree(40, 0.2, 1.0);
        let turn = exp(&Vector3::new(0.5, -2.0, 1.0));
        let to: Vec<f64> = from
            .chunks_exact(3)
            .flat_map(|p| (turn * Vector3::from_column_slice(p)).data.0[0])
            .collect();
        let morph = SkeletonMorph::new(&skeleton, &from, &to, Alignment::Rigid);
        assert!((morph.turn() - turn.angle()).abs() < 1e-9 && morph.bone_turns()[1] < 1e-9);
        let mut at = vec![0.0; from.len()];
        morph.at(0.5, &mut at);
        let distance = |pose: &[f64], a: u32, b: u32| (point(pose, a) - point(pose, b)).norm();
        for joint in 1..40 {
            let apart = distance(&at, 0, joint) - distance(&from, 0, joint);
            assert!(apart.abs() < 1e-9);
        }
    }

    #[test]
    fn opposite_and_vanishing_bones_have_an_outcome() {
        let joint = |parent| Joint {
            name: String::new(),
            parent,
        };
        let joints = vec![joint(None), joint(Some(0)), joint(Some(1)), joint(Some(1))];
        let skeleton = Skeleton::new(joints).unwrap();
        let from = [0., 0., 0., 0., 1., 0., 1., 1., 0., 0., 1., 0.];
        let to = [0., 0., 0., 0., 1., 0., -1., 1., 0., 0., 3., 0.];
        let morph = SkeletonMorph::new(&skeleton, &from, &to, Alignment::None);
        assert_eq!(morph.opposite(), [2]);
        let mut at = [0.0; 12];
        morph.at(0.5, &mut at);
        assert!((length(&at, [1, 2]) - 1.0).abs() < 1e-15);
        // in the plane of the bone and its parent's: the axis is z
        assert!(at[8].abs() < 1e-15);
        assert!((length(&at, [1, 3]) - 1.0).abs() < 1e-15);
    }
}
