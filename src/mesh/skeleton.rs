//! Skeletons: joints joined by bones into a tree, and poses of them. No mesh: a pose is 3J coordinates of
//! joints, x y z interleaved, in double precision.

use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// A joint and the one that it hangs from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// The joint at the other end of its bone, from 0; none for the root.
    pub parent: Option<u32>,
}

/// Why joints do not make a skeleton. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SkeletonError {
    /// There are none.
    Empty,
    /// Two joints have no parent.
    TwoRoots {
        /// The first of them.
        first: usize,
        /// The second.
        second: usize,
    },
    /// The parent of a joint does not exist.
    NoSuchParent {
        /// The joint.
        joint: usize,
    },
    /// The joint is its own ancestor, or there is no root above it.
    Cycle {
        /// The first such joint.
        joint: usize,
    },
}

/// Joints joined into one tree.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skeleton {
    joints: Vec<Joint>,
    order: Vec<u32>,
}

/// How another skeleton differs.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Mismatch {
    /// It has another number of joints.
    Count {
        /// Joints of this one.
        first: usize,
        /// Joints of the other.
        second: usize,
    },
    /// It has no joint of this name.
    Missing(String),
    /// This joint hangs from another there.
    Parent(String),
}

impl Skeleton {
    /// Joins `joints`. They may be listed in any order. O(J).
    ///
    /// # Errors
    /// [`SkeletonError`].
    pub fn new(joints: Vec<Joint>) -> Result<Self, SkeletonError> {
        let mut roots = Vec::new();
        let mut children: Vec<Vec<u32>> = vec![Vec::new(); joints.len()];
        for (index, joint) in joints.iter().enumerate() {
            match joint.parent {
                None => roots.push(index),
                Some(parent) => children
                    .get_mut(parent as usize)
                    .ok_or(SkeletonError::NoSuchParent { joint: index })?
                    .push(index as u32),
            }
        }
        let root = match roots[..] {
            [root] => root,
            [first, second, ..] => return Err(SkeletonError::TwoRoots { first, second }),
            [] if joints.is_empty() => return Err(SkeletonError::Empty),
            [] => return Err(SkeletonError::Cycle { joint: 0 }),
        };
        let mut order = Vec::with_capacity(joints.len());
        let mut open = vec![root as u32];
        while let Some(joint) = open.pop() {
            order.push(joint);
            open.extend(children[joint as usize].iter().rev());
        }
        if order.len() < joints.len() {
            let mut reached = vec![false; joints.len()];
            order
                .iter()
                .for_each(|&joint| reached[joint as usize] = true);
            let joint = reached.iter().position(|reached| !reached).unwrap_or(0);
            return Err(SkeletonError::Cycle { joint });
        }
        Ok(Skeleton { joints, order })
    }

    /// The joints.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// All joints depth first, the root first, parents before children.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The joints that hang from each one.
    pub fn children(&self) -> Vec<Vec<u32>> {
        let mut children = vec![Vec::new(); self.joints.len()];
        for (index, joint) in self.joints.iter().enumerate() {
            if let Some(parent) = joint.parent {
                children[parent as usize].push(index as u32);
            }
        }
        children
    }

    /// The bones: parent and child of every joint but the root.
    pub fn bones(&self) -> Vec<[u32; 2]> {
        let joints = self.joints.iter().enumerate();
        joints
            .filter_map(|(index, joint)| Some([joint.parent?, index as u32]))
            .collect()
    }

    /// For each joint of this skeleton the joint of `other` with its name, where both are the same tree;
    /// skeletons whose names repeat must list them in the same order.
    ///
    /// # Errors
    /// The first difference.
    pub fn matching(&self, other: &Skeleton) -> Result<Vec<u32>, Mismatch> {
        if self.joints == other.joints {
            return Ok((0..self.joints.len() as u32).collect());
        }
        if self.joints.len() != other.joints.len() {
            return Err(Mismatch::Count {
                first: self.joints.len(),
                second: other.joints.len(),
            });
        }
        let theirs: HashMap<&str, u32> = (0..)
            .zip(&other.joints)
            .map(|(index, joint)| (joint.name.as_str(), index))
            .collect();
        let found = self.joints.iter().map(|joint| {
            let index = theirs.get(joint.name.as_str());
            index
                .copied()
                .ok_or_else(|| Mismatch::Missing(joint.name.clone()))
        });
        let found: Vec<u32> = found.collect::<Result<_, _>>()?;
        let parent = |skeleton: &Skeleton, index: u32| {
            let parent = skeleton.joints[index as usize].parent?;
            Some(skeleton.joints[parent as usize].name.clone())
        };
        match (0..)
            .zip(&found)
            .find(|&(mine, &theirs)| parent(self, mine) != parent(other, theirs))
        {
            Some((mine, _)) => Err(Mismatch::Parent(self.joints[mine as usize].name.clone())),
            None => Ok(found),
        }
    }
}

impl fmt::Display for Mismatch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Mismatch::Count { first, second } => {
                write!(
                    f,
                    "the first skeleton has {first} joints, this one {second}"
                )
            }
            Mismatch::Missing(name) => write!(f, "this skeleton has no joint `{name}`"),
            Mismatch::Parent(name) => {
                write!(
                    f,
                    "joint `{name}` hangs from another joint than in the first skeleton"
                )
            }
        }
    }
}

/// Poses of one skeleton: n frames of 3J coordinates in one row.
#[derive(Debug, Clone, PartialEq)]
pub struct SkeletonPoses {
    /// The tree.
    pub skeleton: Arc<Skeleton>,
    /// The coordinates, frame after frame.
    pub positions: Vec<f64>,
    /// Frames per second, where known.
    pub fps: Option<f64>,
}

impl SkeletonPoses {
    /// n.
    pub fn frames(&self) -> usize {
        self.positions.len() / (3 * self.skeleton.joints.len())
    }

    /// The 3J coordinates of `frame`, from 0.
    pub fn frame(&self, frame: usize) -> &[f64] {
        let width = 3 * self.skeleton.joints.len();
        &self.positions[frame * width..(frame + 1) * width]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn skeleton(parents: &[Option<u32>]) -> Result<Skeleton, SkeletonError> {
        let joints = parents.iter().enumerate().map(|(index, &parent)| Joint {
            name: format!("j{index}"),
            parent,
        });
        Skeleton::new(joints.collect())
    }

    #[test]
    fn joints_in_any_order_are_walked_parents_first() {
        let found = skeleton(&[Some(2), Some(0), None, Some(2)]).unwrap();
        assert_eq!(found.order(), [2, 0, 1, 3]);
        assert_eq!(found.bones(), [[2, 0], [0, 1], [2, 3]]);
        assert_eq!(found.children()[2], [0, 3]);
    }

    #[test]
    fn what_is_no_tree_is_told() {
        assert_eq!(skeleton(&[]), Err(SkeletonError::Empty));
        let two = SkeletonError::TwoRoots {
            first: 0,
            second: 2,
        };
        assert_eq!(skeleton(&[None, Some(0), None]), Err(two));
        let around = Err(SkeletonError::Cycle { joint: 1 });
        assert_eq!(skeleton(&[None, Some(2), Some(1)]), around);
        assert_eq!(skeleton(&[Some(0)]), Err(SkeletonError::Cycle { joint: 0 }));
        let lost = Err(SkeletonError::NoSuchParent { joint: 1 });
        assert_eq!(skeleton(&[None, Some(7)]), lost);
    }

    #[test]
    fn skeletons_match_by_name() {
        let one = skeleton(&[None, Some(0), Some(1)]).unwrap();
        let joint = |name: &str, parent| Joint {
            name: name.into(),
            parent,
        };
        let shuffled = vec![
            joint("j2", Some(2)),
            joint("j0", None),
            joint("j1", Some(1)),
        ];
        let shuffled = Skeleton::new(shuffled).unwrap();
        assert_eq!(one.matching(&shuffled), Ok(vec![1, 2, 0]));
        let other = skeleton(&[None, Some(0), Some(0)]).unwrap();
        assert_eq!(one.matching(&other), Err(Mismatch::Parent("j2".into())));
        let fewer = skeleton(&[None, Some(0)]).unwrap();
        assert!(matches!(one.matching(&fewer), Err(Mismatch::Count { .. })));
    }
}
