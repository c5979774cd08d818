//! Patch-based linear rotation-invariant coordinates (Baran et al. 2009; X19 §4.2, eq. 5): for each
//! triangle its rotation relative to its patch (3 numbers) and its scale/shear (6), for each pair of
//! adjacent patches their relative rotation (3), then the shape's placement (6 for a connected mesh; 6
//! more for each further part, but 3 for a vertex without a triangle; see below).
//!
//! Right for the largest motions: a rotation is only ever relative to what lies beside it, so limbs may
//! turn by more than a half turn against each other. Decoding is a small system for the rotations of
//! the patches ([`Patching`]), then one Poisson solve; both are factored once.
//!
//! The rotation of a patch is the one nearest the area-weighted sum of its triangles' rotations; the
//! mean rotation is nearest the sum of the patches'. Parts are joined across edges: where two meet in
//! a vertex only, each has a rotation of its own, as connected parts have.
//!
//! Degenerate input is treated as in [`super::Gradients`]. Triangles that are torn between poses may be
//! told ([`super::Spaces::open_weighted`]): they have the images of their plane instead.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::gradients::{decode_stretch, encode_faces};
use super::orientation::{polar_factors, sides};
use super::patching::{FinePatches, Patching};
use super::placement::{Placement, blocks_from, follow_rotation, triple};
use super::registry::State;
use super::scales::{Scales, area_shares};
use super::{Block, Invariance, ShapeSpace};
use crate::math::rotation::{exp, log};
use crate::mesh::{Poisson, Polar};

/// Triangles whose branches one thread draws at a time.
const CHUNK: usize = 2048;

/// The space of patch-based coordinates.
pub struct PatchLri {
    poisson: Arc<Poisson>,
    reference: Arc<[f64]>,
    patching: Patching,
    /// Root of each triangle's share in the area.
    shares: Vec<f64>,
    rotation: f64,
    stretch: f64,
    placement: Placement,
    /// Triangles that are torn between shapes, rising; see [`PatchLri::tearing`].
    torn: Vec<u32>,
    pool: Mutex<Vec<Vec<Polar>>>,
}

impl PatchLri {
    /// The space over a factored system with given patches; `reference` is the pose that the system was
    /// made for.
    pub(super) fn new(poisson: Arc<Poisson>, reference: Arc<[f64]>, patching: Patching) -> Self {
        let scales = Scales::new(&reference);
        let components = poisson.analysis().components().clone();
        PatchLri {
            shares: area_shares(poisson.reference()),
            rotation: scales.rotation(),
            stretch: scales.stretch(),
            placement: Placement::new(components, &patching.group_shares(), &scales),
            patching,
            poisson,
            reference,
            torn: Vec::new(),
            pool: Mutex::default(),
        }
    }

    /// The space in which the triangles that count less than 1 by `weights`, one a triangle, are torn: how
    /// they turn says nothing, but they hold together what they lie between. They have no rotation of their
    /// own; in place of the scale/shear stand the images of both directions of their plane beside the
    /// patch's rotation, so between shapes their sides change along straight lines.
    pub(super) fn tearing(mut self, weights: &[f64]) -> Self {
        let torn = (0u32..).zip(weights).filter(|(_, weight)| **weight < 1.0);
        self.torn = torn.map(|(face, _)| face).collect();
        self
    }

    /// Where the sides of a triangle lead in a shape, beside the sides in the reference.
    fn images(&self, face: usize, positions: &[f64]) -> [Vector3<f64>; 2] {
        let [e1, e2] = sides(&self.poisson.analysis().triangles()[face], positions);
        self.poisson.reference()[face].images(&e1, &e2)
    }

    fn faces(&self) -> usize {
        self.shares.len()
    }

    /// Where the parts of the coordinates start: face rotations at 0, scale/shear, pairs, placement.
    fn starts(&self) -> [usize; 3] {
        let faces = self.faces();
        let pairs = 9 * faces + 3 * self.patching.links().len();
        [3 * faces, 9 * faces, pairs]
    }

    /// The rotations of the patches, turned back by the mean rotation, from the pairs' and groups'.
    fn solve_patches(&self, pairs: &[f64], placement: &[f64]) -> Vec<UnitQuaternion<f64>> {
        let shares = self.patching.pair_shares().iter().enumerate();
        let relative: Vec<_> = shares
            .map(|(pair, share)| exp(&(triple(pairs, pair) / (self.rotation * share))))
            .collect();
        let group = |group| self.placement.group_rotation(placement, group);
        self.patching.solve(&relative, group)
    }

    /// Coordinates of a shape whose patches have the rotations `turns`, by default those of its triangles.
    fn encode_about(
        &self,
        turns: Option<Vec<UnitQuaternion<f64>>>,
        positions: &[f64],
        coordinates: &mut [f64],
    ) {
        let mut polars = self.lock().pop().unwrap_or_default();
        let triangles = self.poisson.analysis().triangles();
        polar_factors(self.poisson.reference(), triangles, positions, &mut polars);
        let turns = turns.unwrap_or_else(|| self.patching.rotations(&polars));
        let [stretches, pairs, placement] = self.starts();
        let (coordinates, rest) = coordinates.split_at_mut(pairs);
        let (pairs, rest) = rest.split_at_mut(placement - pairs);
        let (rotations, stretches) = coordinates.split_at_mut(stretches);
        let back: Vec<_> = turns.iter().map(UnitQuaternion::inverse).collect();
        let weights = (self.rotation, self.stretch);
        let patch = self.patching.of_triangles();
        encode_faces(
            (self.poisson.reference(), &self.shares, weights),
            &polars,
            |face| back[patch[face] as usize],
            (rotations, stretches),
        );
        for face in self.torn.iter().map(|&face| face as usize) {
            rotations[3 * face..3 * face + 3].fill(0.0);
            let scale = self.stretch * self.shares[face];
            let images = self.images(face, positions);
            for (out, image) in stretches[6 * face..6 * face + 6]
                .chunks_exact_mut(3)
                .zip(images)
            {
                let image = back[patch[face] as usize] * image * scale;
                out.copy_from_slice(image.as_slice());
            }
        }
        let patching = &self.patching;
        let links = patching.links().iter().zip(patching.pair_shares());
        for (out, (&[i, j], share)) in pairs.chunks_exact_mut(3).zip(links) {
            let w = log(&(back[i as usize] * turns[j as usize])) * (self.rotation * share);
            out.copy_from_slice(w.as_slice());
        }
        let (groups, mean) = patching.means(&turns);
        self.placement.encode(positions, &mean, &groups, rest);
        self.lock().push(polars);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Vec<Polar>>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// [`PatchLri`] of a coarse mesh that stands for a fine one: coordinates of a shape of the fine mesh,
/// whose patches turn as in the fine mesh's own space, and which decode to the coarse shape.
pub struct CoarsePatchLri {
    space: Arc<PatchLri>,
    fine: FinePatches,
}

impl CoarsePatchLri {
    pub(super) fn new(space: PatchLri, fine: FinePatches) -> Self {
        CoarsePatchLri {
            space: Arc::new(space),
            fine,
        }
    }

    /// The space of the coarse mesh, which decodes the coordinates.
    pub fn space(&self) -> Arc<dyn ShapeSpace> {
        Arc::clone(&self.space) as Arc<dyn ShapeSpace>
    }

    /// Coordinates of the shape that is `fine` on the one mesh and `coarse` on the other.
    ///
    /// # Panics
    /// Positions or coordinates have another length than those of the meshes and the space.
    pub fn encode(&self, fine: &[f64], coarse: &[f64], coordinates: &mut [f64]) {
        let turns = self.fine.rotations(fine);
        self.space.encode_about(Some(turns), coarse, coordinates);
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
            patches: self.patching.of_triangles().to_vec(),
            ..State::new(self, &self.reference)
        }
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        self.encode_about(None, positions, coordinates);
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
            .zip(self.patching.pair_shares())
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
        let (reference, patch) = (self.poisson.reference(), self.patching.of_triangles());
        self.poisson.solve(
            |face| {
                let stretch = &coordinates[stretches + 6 * face..][..6];
                let scale = 1.0 / (self.stretch * self.shares[face]);
                let turn = turns[patch[face] as usize];
                if self.torn.binary_search(&(face as u32)).is_ok() {
                    return [0, 1].map(|side| turn * (triple(stretch, side) * scale));
                }
                let w = triple(coordinates, face) / (self.rotation * self.shares[face]);
                let turn = (turn * exp(&w)).to_rotation_matrix();
                decode_stretch(&reference[face], stretch, scale).map(|image| turn * image)
            },
            positions,
        );
        self.placement.decode(rest, positions);
    }
}
