//! Deformation gradients, R^(9F+6) (CH12 §5, Sumner & Popovic 2004): for each triangle its rotation,
//! relative to the mean rotation of the shape, as a rotation vector (3 numbers) and its scale/shear (6),
//! then the shape's placement (6 for a connected mesh, 3 more for each further part, vertices without a
//! triangle being parts of their own). Polygons count as the triangles they are cut into.
//!
//! Right for transfer and for far poses of the same orientation of parts; wrong where two neighbouring
//! triangles lie more than a half turn from the mean. Decoding is one Poisson solve ([`Poisson`]).
//!
//! Degenerate input: a triangle without a plane in the reference pose is given one
//! ([`ReferenceTriangle::new`]) and has no say in the mean rotation; one without a plane in a shape takes
//! the normal nearest the reference's. Duplicate triangles count twice, non-manifold edges and vertices
//! need no care. All of them are reproduced. A mesh without triangles keeps its orientation in the
//! positions of its vertices.

use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::orientation::polar_factors;
use super::placement::{Placement, blocks_from, follow_rotation, triple};
use super::registry::State;
use super::scales::{Scales, area_shares};
use super::{Block, Invariance, ShapeSpace};
use crate::math::columns::{BLOCK, Column, row, set_row, widely};
use crate::math::rotation::{exp, log};
use crate::mesh::{Poisson, Polar, ReferenceTriangle, stretch_in_space};

/// Triangles that one thread takes at a time: small meshes are shared evenly too. A multiple of [`BLOCK`].
const CHUNK: usize = 512;

/// The space of deformation gradients.
pub struct Gradients {
    poisson: Arc<Poisson>,
    reference: Arc<[f64]>,
    /// Root of each triangle's share in the area.
    shares: Vec<f64>,
    rotation: f64,
    stretch: f64,
    placement: Placement,
    pool: Mutex<Vec<Vec<Polar>>>,
}

impl Gradients {
    /// The space over a factored system; `reference` is the pose it was made for.
    pub(super) fn new(poisson: Arc<Poisson>, reference: Arc<[f64]>) -> Self {
        let scales = Scales::new(&reference);
        let components = poisson.analysis().components().clone();
        Gradients {
            shares: area_shares(poisson.reference()),
            rotation: scales.rotation(),
            stretch: scales.stretch(),
            placement: Placement::new(components, &[], &scales),
            poisson,
            reference,
            pool: Mutex::default(),
        }
    }

    fn faces(&self) -> usize {
        self.shares.len()
    }

    /// The coordinates' parts: rotations, scale/shear, placement.
    fn split<'a>(&self, coordinates: &'a mut [f64]) -> [&'a mut [f64]; 3] {
        let (rotations, rest) = coordinates.split_at_mut(3 * self.faces());
        let (stretches, placement) = rest.split_at_mut(6 * self.faces());
        [rotations, stretches, placement]
    }
}

impl ShapeSpace for Gradients {
    fn name(&self) -> &'static str {
        "gradients"
    }

    fn dimension(&self) -> usize {
        9 * self.faces() + self.placement.dimension()
    }

    fn invariance(&self) -> Invariance {
        match self.faces() {
            0 => Invariance::None,
            _ => Invariance::Rigid,
        }
    }

    fn blocks(&self) -> Vec<Block> {
        let faces = self.faces();
        let bare = [
            ("rotation", 3 * faces, self.rotation),
            ("scale/shear", 6 * faces, self.stretch),
        ];
        let mut blocks = blocks_from(0, &bare);
        blocks.extend(self.placement.blocks(9 * faces));
        blocks
    }

    fn state(&self) -> State {
        State::new(self, &self.reference)
    }

    fn encode(&self, positions: &[f64], coordinates: &mut [f64]) {
        let mut polars = self.lock().pop().unwrap_or_default();
        let triangles = self.poisson.analysis().triangles();
        let reference = self.poisson.reference();
        let mean = polar_factors(reference, triangles, positions, &mut polars);
        let [rotations, stretches, placement] = self.split(coordinates);
        let back = mean.inverse();
        let weights = (self.rotation, self.stretch);
        encode_faces(
            (reference, &self.shares, weights),
            &polars,
            |_| back,
            (rotations, stretches),
        );
        self.placement.encode(positions, &mean, &[], placement);
        self.lock().push(polars);
    }

    fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let faces = self.faces();
        let (rotations, placement) = coordinates.split_at_mut(9 * faces);
        let turns = rotations[..3 * faces]
            .par_chunks_mut(3)
            .zip(near.par_chunks(3))
            .zip(&self.shares)
            .with_min_len(CHUNK)
            .map(|((at, near), share)| follow_rotation(near, at, self.rotation * share))
            .filter(|large| *large)
            .count();
        turns + self.placement.follow(&near[9 * faces..], placement)
    }

    fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        let faces = self.faces();
        let reference = self.poisson.reference();
        self.poisson.solve(
            |face| {
                let w = triple(coordinates, face) / (self.rotation * self.shares[face]);
                let stretch = &coordinates[3 * faces + 6 * face..][..6];
                let scale = 1.0 / (self.stretch * self.shares[face]);
                let turn = exp(&w).to_rotation_matrix();
                decode_stretch(&reference[face], stretch, scale).map(|image| turn * image)
            },
            positions,
        );
        self.placement.decode(&coordinates[9 * faces..], positions);
    }
}

impl Gradients {
    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<Vec<Polar>>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Writes for each triangle its rotation, turned back by `back`, as a rotation vector, and xx, xy, xz,
/// yy, yz, zz of its S, where off-diagonal entries stand for two and are scaled by the root of 2; both
/// times their weight and the triangle's share.
pub(super) fn encode_faces(
    (reference, shares, weights): (&[ReferenceTriangle], &[f64], (f64, f64)),
    polars: &[Polar],
    back: impl Fn(usize) -> UnitQuaternion<f64> + Sync,
    (rotations, stretches): (&mut [f64], &mut [f64]),
) {
    rotations
        .par_chunks_mut(3 * CHUNK)
        .zip(stretches.par_chunks_mut(6 * CHUNK))
        .enumerate()
        .for_each(|(chunk, (rotations, stretches))| {
            let first = CHUNK * chunk;
            let faces = first..first + rotations.len() / 3;
            let (reference, polars) = (&reference[faces.clone()], &polars[faces.clone()]);
            let shares = &shares[faces];
            let faces = FaceRows {
                reference,
                polars,
                shares,
                weights,
            };
            widely(
                #[inline(always)]
                || faces.write(|i| back(first + i), rotations, stretches),
            );
        });
}

/// Triangles whose coordinates one thread writes.
struct FaceRows<'a> {
    reference: &'a [ReferenceTriangle],
    polars: &'a [Polar],
    shares: &'a [f64],
    weights: (f64, f64),
}

impl FaceRows<'_> {
    #[inline(always)]
    fn write(
        &self,
        back: impl Fn(usize) -> UnitQuaternion<f64>,
        rotations: &mut [f64],
        stretches: &mut [f64],
    ) {
        const NONE: Column = [0.0; BLOCK];
        let [mut turns, mut backs] = [[NONE; 4]; 2];
        let [mut along, mut normal, mut plane] = [[NONE; 3]; 3];
        let mut scales = [NONE; 2];
        let (mut w, mut s) = ([NONE; 3], [NONE; 6]);
        for first in (0..self.polars.len()).step_by(BLOCK) {
            let count = BLOCK.min(self.polars.len() - first);
            for i in 0..count {
                let (triangle, polar) = (&self.reference[first + i], &self.polars[first + i]);
                set_row(&mut turns, i, polar.rotation.coords.into());
                set_row(&mut backs, i, back(first + i).coords.into());
                set_row(&mut along, i, triangle.along.into());
                set_row(&mut normal, i, triangle.normal.into());
                set_row(&mut plane, i, polar.stretch);
                let share = self.shares[first + i];
                set_row(
                    &mut scales,
                    i,
                    [self.weights.0 * share, self.weights.1 * share],
                );
            }
            for i in 0..BLOCK {
                let turn =
                    |columns| UnitQuaternion::new_unchecked(Quaternion::from(row(columns, i)));
                let [rotation, stretch] = row(&scales, i);
                set_row(
                    &mut w,
                    i,
                    (log(&(turn(&backs) * turn(&turns))) * rotation).into(),
                );
                let (b1, n) = (row(&along, i).into(), row(&normal, i).into());
                let mut six = stretch_in_space(&b1, &n, row(&plane, i));
                for (entry, doubled) in six.iter_mut().zip(OFF_DIAGONAL) {
                    *entry *= stretch * doubled;
                }
                set_row(&mut s, i, six);
            }
            for i in 0..count {
                let face = first + i;
                rotations[3 * face..3 * face + 3].copy_from_slice(&row(&w, i));
                stretches[6 * face..6 * face + 6].copy_from_slice(&row(&s, i));
            }
        }
    }
}

/// S b1 and S b2 of one triangle from its six coordinates, which are multiplied by `scale`.
pub(super) fn decode_stretch(
    triangle: &ReferenceTriangle,
    stretch: &[f64],
    scale: f64,
) -> [Vector3<f64>; 2] {
    let mut s = [0.0; 6];
    for entry in 0..6 {
        s[entry] = stretch[entry] * scale / OFF_DIAGONAL[entry];
    }
    triangle.stretched(&s)
}

/// Root of how often each of xx, xy, xz, yy, yz, zz stands in the matrix.
const OFF_DIAGONAL: [f64; 6] = [
    1.0,
    std::f64::consts::SQRT_2,
    std::f64::consts::SQRT_2,
    1.0,
    std::f64::consts::SQRT_2,
    1.0,
];
