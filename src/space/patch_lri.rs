//! Patch-based linear rotation-invariant coordinates (Baran et al. 2009; X19 §4.2, eq. 5): for each
//! triangle its rotation relative to its patch (3 numbers) and its scale/shear (6), for each pair of
//! adjacent patches their relative rotation (3), then the shape's placement (6 for a connected mesh; 6
//! more for each further part, but 3 for a vertex without a triangle; see below).
//!
//! Right for the largest motions: a rotation is only ever relative to what lies beside it, so limbs may
//! turn by more than a half turn against each other. Decoding is a small system for the rotations of
//! the patches ([`RotationGraph`]), then one Poisson solve; both are factored once.
//!
//! The rotation of a patch is the one nearest the area-weighted sum of its triangles' rotations; the
//! mean rotation is nearest the sum of the patches'. Parts are joined across edges: where two meet in
//! a vertex only, each has a rotation of its own, as connected parts have.
//!
//! Degenerate input is treated as in [`super::Gradients`].

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Matrix3, UnitQuaternion};
use rayon::prelude::*;

use super::gradients::{decode_stretch, encode_faces};
use super::orientation::polar_factors;
use super::placement::{Placement, blocks_from, follow_rotation, triple};
use super::registry::State;
use super::scales::{Scales, area_shares};
use super::{Block, Invariance, ShapeSpace, SpaceError};
use crate::math::rotation::{exp, log, nearest};
use crate::math::rotation_graph::RotationGraph;
use crate::mesh::{Components, Hinges, Poisson, Polar, grow_patches};

/// Triangles whose branches one thread draws at a time.
const CHUNK: usize = 2048;

/// The least share of a pair: patches of no area to speak of have a say beyond rounding.
const LEAST_SHARE: f64 = 1e-12;

/// Poses that patches are grown on; of more, these many spread evenly.
const POSES: usize = 8;

/// The space of patch-based coordinates.
pub struct PatchLri {
    poisson: Arc<Poisson>,
    reference: Arc<[f64]>,
    patches: Vec<Patch>,
    /// The patch of each triangle.
    patch: Vec<u32>,
    /// Where each patch's triangles begin, and the triangles patch by patch.
    members: (Vec<u32>, Vec<u32>),
    graph: RotationGraph,
    /// Root of each triangle's share in the area.
    shares: Vec<f64>,
    /// Root of each pair's share ([`pair_shares`]).
    pair_shares: Vec<f64>,
    rotation: f64,
    stretch: f64,
    placement: Placement,
    groups: usize,
    pool: Mutex<Vec<Vec<Polar>>>,
}

#[derive(Debug, Clone, Copy)]
struct Patch {
    area: f64,
    /// Which of the parts joined across edges it lies in.
    group: usize,
}

impl PatchLri {
    /// The space over a factored system with about `sought` patches grown on `poses`; `reference` is the
    /// pose that the system was made for.
    pub(super) fn grown(
        poisson: Arc<Poisson>,
        reference: Arc<[f64]>,
        hinges: &Hinges,
        poses: &[&[f64]],
        sought: usize,
    ) -> Result<Self, SpaceError> {
        let step = poses.len().div_ceil(POSES).max(1);
        let rotations: Vec<Vec<UnitQuaternion<f64>>> = poses
            .iter()
            .step_by(step)
            .map(|pose| {
                let mut polars = Vec::new();
                let triangles = poisson.analysis().triangles();
                polar_factors(poisson.reference(), triangles, pose, &mut polars);
                polars.iter().map(|polar| polar.rotation).collect()
            })
            .collect();
        let rows: Vec<&[UnitQuaternion<f64>]> = rotations.iter().map(Vec::as_slice).collect();
        let centres = centres(poisson.analysis().triangles(), &reference);
        let patch = grow_patches(hinges, &rows, &centres, sought);
        PatchLri::new(poisson, reference, hinges, patch)
    }

    /// The space with given patches, one number a triangle.
    pub(super) fn new(
        poisson: Arc<Poisson>,
        reference: Arc<[f64]>,
        hinges: &Hinges,
        patch: Vec<u32>,
    ) -> Result<Self, SpaceError> {
        let faces = poisson.reference().len();
        let count = patch.iter().max().map_or(0, |&last| last as usize + 1);
        if patch.len() != faces || count > faces {
            return Err(SpaceError::Unsuitable {
                reason: format!("{} patch numbers for {faces} triangles", patch.len()),
            });
        }
        let (links, weights) = adjacent(hinges, &patch);
        let groups = Components::joined(count, links.iter().copied());
        let mut patches: Vec<Patch> = (0..count)
            .map(|patch| Patch {
                area: 0.0,
                group: groups.part()[patch] as usize,
            })
            .collect();
        for (triangle, &patch) in poisson.reference().iter().zip(&patch) {
            patches[patch as usize].area += triangle.area();
        }
        let scales = Scales::new(&reference);
        let components = poisson.analysis().components().clone();
        let total: f64 = patches.iter().map(|patch| patch.area).sum();
        let mut group_shares = vec![0.0; groups.count()];
        for patch in &patches {
            group_shares[patch.group] += patch.area / total;
        }
        let graph = RotationGraph::new(count, links, weights.clone())?;
        Ok(PatchLri {
            shares: area_shares(poisson.reference()),
            pair_shares: pair_shares(&graph, &weights, &patches, groups.count()),
            rotation: scales.rotation(),
            stretch: scales.stretch(),
            placement: Placement::new(components, &group_shares, &scales),
            graph,
            groups: groups.count(),
            members: members(&patch, count),
            patches,
            patch,
            poisson,
            reference,
            pool: Mutex::default(),
        })
    }

    fn faces(&self) -> usize {
        self.shares.len()
    }

    /// Where the parts of the coordinates start: face rotations at 0, scale/shear, pairs, placement.
    fn starts(&self) -> [usize; 3] {
        let faces = self.faces();
        let pairs = 9 * faces + 3 * self.graph.links().len();
        [3 * faces, 9 * faces, pairs]
    }

    /// The rotation of each patch.
    fn patch_rotations(&self, polars: &[Polar]) -> Vec<UnitQuaternion<f64>> {
        let reference = self.poisson.reference();
        (0..self.patches.len())
            .into_par_iter()
            .map(|patch| {
                let range = self.members.0[patch] as usize..self.members.0[patch + 1] as usize;
                let turns = self.members.1[range].iter().map(|&face| {
                    let turn = polars[face as usize].rotation.to_rotation_matrix();
                    turn.matrix() * reference[face as usize].area()
                });
                nearest(&turns.sum()).rotation
            })
            .collect()
    }

    /// The mean rotation of each group and of the whole, from those of the patches.
    fn means(
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

    /// The rotations of the patches, turned back by the mean rotation, from the pairs' and groups'.
    fn solve_patches(&self, pairs: &[f64], placement: &[f64]) -> Vec<UnitQuaternion<f64>> {
        let shares = self.pair_shares.iter().enumerate();
        let relative: Vec<_> = shares
            .map(|(pair, share)| exp(&(triple(pairs, pair) / (self.rotation * share))))
            .collect();
        let mut turns = vec![UnitQuaternion::identity(); self.patches.len()];
        self.graph.solve(&relative, &|_| true, &mut turns);
        let (means, _) = self.means(&turns);
        let back: Vec<_> = means
            .iter()
            .enumerate()
            .map(|(group, mean)| self.placement.group_rotation(placement, group) * mean.inverse())
            .collect();
        for (turn, patch) in turns.iter_mut().zip(&self.patches) {
            *turn = back[patch.group] * *turn;
        }
        turns
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Vec<Polar>>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ShapeSpace for PatchLri {
    fn name(&self) -> &'static str {
        "patch-lri"
    }

    fn dimension(&self) -> usize {
        self.starts()[2] + self.placement.dimension()
    }

    fn invariance(&self) -> Invariance {
        match self.faces() {
            0 => Invariance::None,
            _ => Invariance::Rigid,
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let [stretches, pairs, placement] = self.starts();
        let bare = [
            ("rotation in patch", stretches, self.rotation),
            ("scale/shear", pairs - stretches, self.stretch),
            ("patch rotation", placement - pairs, self.rotation),
        ];
        let mut blocks = blocks_from(0, &bare);
        blocks.extend(self.placement.blocks(placement));
        blocks
    }

    fn state(&self) -> State {
        State {
            patches: self.patch.clone(),
            ..State::new(self, &self.reference)
        }
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        let mut polars = self.lock().pop().unwrap_or_default();
        let triangles = self.poisson.analysis().triangles();
        polar_factors(self.poisson.reference(), triangles, positions, &mut polars);
        let turns = self.patch_rotations(&polars);
        let [stretches, pairs, placement] = self.starts();
        let (coordinates, rest) = coordinates.split_at_mut(pairs);
        let (pairs, rest) = rest.split_at_mut(placement - pairs);
        let (rotations, stretches) = coordinates.split_at_mut(stretches);
        let back: Vec<_> = turns.iter().map(UnitQuaternion::inverse).collect();
        let weights = (self.rotation, self.stretch);
        encode_faces(
            (self.poisson.reference(), &self.shares, weights),
            &polars,
            |face| back[self.patch[face] as usize],
            (rotations, stretches),
        );
        let links = self.graph.links().iter().zip(&self.pair_shares);
        for (out, (&[i, j], share)) in pairs.chunks_exact_mut(3).zip(links) {
            let w = log(&(back[i as usize] * turns[j as usize])) * (self.rotation * share);
            out.copy_from_slice(w.as_slice());
        }
        let (groups, mean) = self.means(&turns);
        self.placement.encode(positions, &mean, &groups, rest);
        self.lock().push(polars);
    }

    fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let [stretches, pairs, placement] = self.starts();
        let faces = coordinates[..stretches]
            .par_chunks_mut(3)
            .zip(near.par_chunks(3))
            .zip(&self.shares)
            .with_min_len(CHUNK)
            .map(|((at, near), share)| follow_rotation(near, at, self.rotation * share))
            .filter(|large| *large)
            .count();
        let patches = coordinates[pairs..placement]
            .chunks_exact_mut(3)
            .zip(near[pairs..placement].chunks_exact(3))
            .zip(&self.pair_shares)
            .map(|((at, near), share)| follow_rotation(near, at, self.rotation * share))
            .filter(|large| *large)
            .count();
        let rest = &mut coordinates[placement..];
        faces + patches + self.placement.follow(&near[placement..], rest)
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        let [stretches, pairs, placement] = self.starts();
        let rest = &coordinates[placement..];
        let turns = self.solve_patches(&coordinates[pairs..placement], rest);
        let reference = self.poisson.reference();
        self.poisson.solve(
            |face| {
                let w = triple(coordinates, face) / (self.rotation * self.shares[face]);
                let stretch = &coordinates[stretches + 6 * face..][..6];
                let scale = 1.0 / (self.stretch * self.shares[face]);
                let turn = (turns[self.patch[face] as usize] * exp(&w)).to_rotation_matrix();
                decode_stretch(&reference[face], stretch, scale).map(|image| turn * image)
            },
            positions,
        );
        self.placement.decode(rest, positions);
    }
}

/// Pairs of adjacent patches, each once in ascending order, with the number of hinges between them.
fn adjacent(hinges: &Hinges, patch: &[u32]) -> (Vec<[u32; 2]>, Vec<f64>) {
    let mut borders: Vec<[u32; 2]> = hinges
        .hinges()
        .iter()
        .map(|hinge| hinge.triangles().map(|triangle| patch[triangle as usize]))
        .map(|[a, b]| [a.min(b), a.max(b)])
        .filter(|[a, b]| a != b)
        .collect();
    borders.sort_unstable();
    borders
        .chunk_by(|a, b| a == b)
        .map(|run| (run[0], run.len() as f64))
        .unzip()
}

/// Where the triangles of each patch begin in a list of all, and that list, patch by patch.
fn members(patch: &[u32], count: usize) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; count + 1];
    patch.iter().for_each(|&p| starts[p as usize + 1] += 1);
    for p in 0..count {
        starts[p + 1] += starts[p];
    }
    let mut next = starts.clone();
    let mut triangles = vec![0; patch.len()];
    for (triangle, &p) in patch.iter().enumerate() {
        triangles[next[p as usize] as usize] = triangle as u32;
        next[p as usize] += 1;
    }
    (starts, triangles)
}

/// Root of the share of each pair of patches in the motion of the mesh: what turns when the pair alone
/// says so, as a share of the area, over the part of it that the pairs beside it let happen.
///
/// A unit turn of pair l makes the patches turn by x_l = L^-1 w_l (e_j - e_i), where L is the Laplacian
/// of the pairs, and the pair itself by its leverage t_l = x_l(j) - x_l(i), 1 where nothing else joins
/// its two sides. A joint that is cut by c equal pairs bends when all of them do, each with t = 1/c and
/// the area-weighted variance of x equal to s/c^2 for sides with shares that make s: so with squared
/// weights variance / t the pairs of a joint count together as the turn of what they move.
fn pair_shares(
    graph: &RotationGraph,
    weights: &[f64],
    patches: &[Patch],
    groups: usize,
) -> Vec<f64> {
    let total: f64 = patches.iter().map(|patch| patch.area).sum();
    let share = |&[i, j]: &[u32; 2], weight: f64| -> f64 {
        let (i, j) = (i as usize, j as usize);
        let mut x = vec![0.0; patches.len()];
        (x[i], x[j]) = (-weight, weight);
        graph.factor().solve(1, &mut x);
        let mut sums = vec![[0.0; 3]; groups];
        for (patch, x) in patches.iter().zip(&x) {
            let [area, first, second] = &mut sums[patch.group];
            *area += patch.area;
            *first += patch.area * x;
            *second += patch.area * x * x;
        }
        // a pair moves its own group only; elsewhere x is zero
        let [area, first, second] = sums[patches[i].group];
        let variance = (second - first * first / area) / total;
        (variance / (x[j] - x[i])).max(LEAST_SHARE).sqrt()
    };
    let links = graph.links().iter().zip(weights);
    links.map(|(link, &weight)| share(link, weight)).collect()
}

/// The middle of each triangle, in units of the largest extent of the mesh.
fn centres(triangles: &[[u32; 3]], pose: &[f64]) -> Vec<[f64; 3]> {
    let extent = (0..3)
        .map(|axis| {
            let values = || pose.iter().skip(axis).step_by(3);
            let high = values().fold(f64::MIN, |high, &x| high.max(x));
            let low = values().fold(f64::MAX, |low, &x| low.min(x));
            high - low
        })
        .fold(0.0, f64::max);
    let scale = if extent > 0.0 {
        1.0 / (3.0 * extent)
    } else {
        1.0
    };
    triangles
        .iter()
        .map(|points| {
            let sum = |axis| {
                points
                    .iter()
                    .map(|&v| pose[3 * v as usize + axis])
                    .sum::<f64>()
            };
            std::array::from_fn(|axis| sum(axis) * scale)
        })
        .collect()
}
