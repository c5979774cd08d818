//! The patches of [`super::PatchLri`]: which triangles turn together, how patches are joined, and what
//! their rotations are.
//!
//! A coarse mesh may stand for a finer one and have its patches ([`FinePatches`]): patches, their
//! rotations and how they are joined are then those of the finer mesh, so a path between shapes turns
//! the limbs of both alike, however few triangles the coarse mesh has.

mod fine;
mod growing;
mod members;
mod pairs;
#[cfg(test)]
mod tests;

use nalgebra::{Matrix3, UnitQuaternion};
use rayon::prelude::*;

use super::SpaceError;
use crate::math::rotation::nearest;
use crate::math::rotation_graph::RotationGraph;
use crate::mesh::{Components, Hinges, Polar, ReferenceTriangle};
pub use fine::Fine;
pub(super) use fine::FinePatches;
pub(super) use growing::grow;
use members::{Members, areas, coarse_members, count, largest_shares, members, of_patch};
use pairs::{adjacent, pair_shares};

/// The patches of a mesh.
pub(super) struct Patching {
    patches: Vec<Patch>,
    /// The patch of each triangle.
    patch: Vec<u32>,
    members: Members,
    /// The pairs of adjacent patches and how many hinges join each.
    joints: (Vec<[u32; 2]>, Vec<f64>),
    graph: RotationGraph,
    /// Root of each pair's share ([`pair_shares`]).
    pair_shares: Vec<f64>,
    groups: usize,
}

#[derive(Debug, Clone, Copy)]
struct Patch {
    area: f64,
    /// Which of the parts joined across edges it lies in.
    group: usize,
}

impl Patching {
    /// Given patches, one number a triangle; triangles count by area, and by `weights` unless there are
    /// none.
    ///
    /// # Errors
    /// Another number of triangles, or more patches than there are.
    pub(super) fn new(
        reference: &[ReferenceTriangle],
        weights: &[f64],
        hinges: &Hinges,
        patch: Vec<u32>,
    ) -> Result<Self, SpaceError> {
        let (faces, count) = (reference.len(), count(&patch));
        if patch.len() != faces || count > faces {
            return Err(SpaceError::Unsuitable {
                reason: format!("{} patch numbers for {faces} triangles", patch.len()),
            });
        }
        let members = members(&patch, count, &areas(reference, weights));
        Patching::joined(adjacent(hinges, &patch), patch, members)
    }

    /// The patches of a `fine` mesh for a coarser one with these `hinges`, whose triangles have the patch of
    /// most of what they stand for; those that stand for nothing have a neighbour's.
    ///
    /// # Errors
    /// The system of the patches is too large.
    ///
    /// # Panics
    /// There is another number of `carriers` than triangles of the fine mesh, or they name a triangle
    /// beyond `triangles`.
    fn of_coarse(
        fine: &Patching,
        areas: &[f64],
        carriers: &[u32],
        (triangles, hinges): (usize, &Hinges),
    ) -> Result<Self, SpaceError> {
        let members = coarse_members(&fine.patch, fine.patches.len(), areas, carriers);
        let patch = largest_shares(&members, triangles, hinges);
        Patching::joined(fine.joints.clone(), patch, members)
    }

    fn joined(
        joints: (Vec<[u32; 2]>, Vec<f64>),
        patch: Vec<u32>,
        members: Members,
    ) -> Result<Self, SpaceError> {
        let count = members.0.len() - 1;
        let (links, weights) = &joints;
        let groups = Components::joined(count, links.iter().copied());
        let patches: Vec<Patch> = (0..count)
            .map(|patch| Patch {
                area: of_patch(&members, patch)
                    .iter()
                    .map(|member| member.1)
                    .sum(),
                group: groups.part()[patch] as usize,
            })
            .collect();
        let graph = RotationGraph::new(count, links.clone(), weights.clone())
            .map_err(|error| SpaceError::of_rotations(error, "patch"))?;
        Ok(Patching {
            pair_shares: pair_shares(&graph, weights, &patches, groups.count()),
            joints,
            groups: groups.count(),
            patches,
            patch,
            members,
            graph,
        })
    }

    /// The patch of each triangle.
    pub(super) fn of_triangles(&self) -> &[u32] {
        &self.patch
    }

    /// The pairs of adjacent patches.
    pub(super) fn links(&self) -> &[[u32; 2]] {
        self.graph.links()
    }

    /// Root of each pair's share in the motion of the mesh.
    pub(super) fn pair_shares(&self) -> &[f64] {
        &self.pair_shares
    }

    /// The share of each group in the area.
    pub(super) fn group_shares(&self) -> Vec<f64> {
        let total: f64 = self.patches.iter().map(|patch| patch.area).sum();
        let mut shares = vec![0.0; self.groups];
        for patch in &self.patches {
            shares[patch.group] += patch.area / total;
        }
        shares
    }

    /// The rotation of each patch: the one nearest the sum of its members'.
    pub(super) fn rotations(&self, polars: &[Polar]) -> Vec<UnitQuaternion<f64>> {
        (0..self.patches.len())
            .into_par_iter()
            .map(|patch| {
                let turns = of_patch(&self.members, patch).iter().map(|&(face, area)| {
                    let turn = polars[face as usize].rotation.to_rotation_matrix();
                    turn.matrix() * area
                });
                nearest(&turns.sum()).rotation
            })
            .collect()
    }

    /// The mean rotation of each group and of the whole, from those of the patches.
    pub(super) fn means(
        &self,
        turns: &[UnitQuaternion<f64>],
    ) -> (Vec<UnitQuaternion<f64>>, UnitQuaternion<f64>) {
        let mut sums = vec![Matrix3::zeros(); self.groups];
        for (patch, turn) in self.patches.iter().zip(turns) {
            sums[patch.group] += turn.to_rotation_matrix().matrix() * patch.area;
        }
        let whole = nearest(&sums.iter().sum()).rotation;
        (
            sums.iter().map(|sum| nearest(sum).rotation).collect(),
            whole,
        )
    }

    /// The rotations of the patches from those of the pairs, each group turned as `group` says.
    pub(super) fn solve(
        &self,
        relative: &[UnitQuaternion<f64>],
        group: impl Fn(usize) -> UnitQuaternion<f64>,
    ) -> Vec<UnitQuaternion<f64>> {
        let mut turns = vec![UnitQuaternion::identity(); self.patches.len()];
        self.graph.solve(relative, &|_| true, &mut turns);
        let (means, _) = self.means(&turns);
        let back: Vec<_> = means
            .iter()
            .enumerate()
            .map(|(at, mean)| group(at) * mean.inverse())
            .collect();
        for (turn, patch) in turns.iter_mut().zip(&self.patches) {
            *turn = back[patch.group] * *turn;
        }
        turns
    }
}
