//! Where a shape is and how it is turned: what gradients, local frames and edge lengths do not tell.
//!
//! Coordinates, in this order: the logarithm of the mean rotation R against the reference pose; where
//! the mesh falls into groups whose rotations the space does not relate (G > 1), the logarithm of each
//! group's rotation relative to R; the mean vertex; and for each connected part but the largest the
//! mean of its vertices relative to the mean vertex, turned back by R. Only the first and the third
//! change in a rigid motion, and on the straight path between two placements of a shape it moves
//! rigidly.

use nalgebra::{UnitQuaternion, Vector3};

use super::scales::Scales;
use super::{Block, LARGE_TURN, MEAN_ROTATION, MEAN_VERTEX};
use crate::math::rotation::{exp, log, nearest_branch};
use crate::mesh::Components;

/// The block of [`Placement`] coordinates of one space.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Placement {
    components: Components,
    /// The part whose offset follows from the others'.
    largest: usize,
    /// Weight of each group's rotation; empty for a single group.
    groups: Vec<f64>,
    rotation: f64,
}

impl Placement {
    /// For parts of a mesh; `groups` are the shares (summing to 1) of the groups that have rotations of
    /// their own, ignored when there is one only.
    pub(super) fn new(components: Components, groups: &[f64], scales: &Scales) -> Self {
        let rotation = scales.rotation();
        Placement {
            largest: components.largest().unwrap_or(0),
            components,
            groups: match groups.len() {
                0 | 1 => Vec::new(),
                _ => groups.iter().map(|share| rotation * share.sqrt()).collect(),
            },
            rotation,
        }
    }

    /// How many coordinates there are.
    pub(super) fn dimension(&self) -> usize {
        6 + 3 * self.groups.len() + 3 * self.components.count().saturating_sub(1)
    }

    /// The blocks, the first at coordinate `start`.
    pub(super) fn blocks(&self, start: usize) -> Vec<Block> {
        let lengths = [
            (MEAN_ROTATION, 3, self.rotation),
            ("part rotations", 3 * self.groups.len(), self.rotation),
            (MEAN_VERTEX, 3, self.mean_weight()),
            (
                "part offsets",
                3 * self.components.count().saturating_sub(1),
                1.0,
            ),
        ];
        blocks_from(start, &lengths)
    }

    /// Coordinates of a shape whose mean rotation is `mean` and whose groups have the rotations
    /// `groups` (unused when the mesh has one group).
    pub(super) fn encode(
        &self,
        positions: &[f64],
        mean: &UnitQuaternion<f64>,
        groups: &[UnitQuaternion<f64>],
        coordinates: &mut [f64],
    ) {
        let mut out = coordinates.chunks_exact_mut(3);
        let mut put = |v: Vector3<f64>| {
            if let Some(place) = out.next() {
                place.copy_from_slice(v.as_slice());
            }
        };
        put(log(mean) * self.rotation);
        for (weight, group) in self.groups.iter().zip(groups) {
            put(log(&(mean.inverse() * group)) * *weight);
        }
        let means = part_means(&self.components, positions);
        let vertex = self.mean_of(&means);
        put(vertex * self.mean_weight());
        for (part, centre) in means.iter().enumerate() {
            if part != self.largest {
                put(mean.inverse() * (centre - vertex) * self.offset_weight(part));
            }
        }
    }

    /// Moves rotation vectors to the branches nearest those of `near`; counts large turns.
    pub(super) fn follow(&self, near: &[f64], coordinates: &mut [f64]) -> usize {
        let weights = std::iter::once(&self.rotation).chain(&self.groups);
        near.chunks_exact(3)
            .zip(coordinates.chunks_exact_mut(3))
            .zip(weights)
            .map(|((near, at), weight)| follow_rotation(near, at, *weight))
            .filter(|large| *large)
            .count()
    }

    /// R, the mean rotation.
    pub(super) fn mean_rotation(&self, coordinates: &[f64]) -> UnitQuaternion<f64> {
        exp(&(triple(coordinates, 0) / self.rotation))
    }

    /// The rotations of the groups relative to R; the identity for a single group.
    pub(super) fn group_rotation(&self, coordinates: &[f64], group: usize) -> UnitQuaternion<f64> {
        match self.groups.get(group) {
            Some(weight) => exp(&(triple(coordinates, 1 + group) / *weight)),
            None => UnitQuaternion::identity(),
        }
    }

    /// Puts a shape where the coordinates say: `positions` has each part where it happens to be, turned
    /// back by R.
    pub(super) fn decode(&self, coordinates: &[f64], positions: &mut [f64]) {
        let means = part_means(&self.components, positions);
        let first = 1 + self.groups.len();
        let vertex = triple(coordinates, first) / self.mean_weight();
        let mut offsets = vec![Vector3::zeros(); means.len()];
        let mut balance = Vector3::zeros();
        let others = (0..means.len()).filter(|part| *part != self.largest);
        for (at, part) in others.enumerate() {
            offsets[part] = triple(coordinates, first + 1 + at) / self.offset_weight(part);
            balance -= offsets[part] * self.size(part);
        }
        if !means.is_empty() {
            offsets[self.largest] = balance / self.size(self.largest);
        }
        let rotation = self.mean_rotation(coordinates).to_rotation_matrix();
        for (place, &part) in positions.chunks_exact_mut(3).zip(self.components.part()) {
            let part = part as usize;
            let local = Vector3::from_column_slice(place) - means[part] + offsets[part];
            place.copy_from_slice((rotation * local + vertex).as_slice());
        }
    }

    fn size(&self, part: usize) -> f64 {
        f64::from(self.components.sizes()[part])
    }

    fn offset_weight(&self, part: usize) -> f64 {
        self.size(part).sqrt()
    }

    fn mean_weight(&self) -> f64 {
        (self.components.part().len().max(1) as f64).sqrt()
    }

    fn mean_of(&self, means: &[Vector3<f64>]) -> Vector3<f64> {
        let sum: Vector3<f64> = (0..means.len())
            .map(|part| means[part] * self.size(part))
            .sum();
        sum / self.components.part().len().max(1) as f64
    }
}

/// Blocks given by name, length and weight, one after the other from coordinate `start`; empty ones are
/// left out.
pub(super) fn blocks_from(start: usize, lengths: &[(&'static str, usize, f64)]) -> Vec<Block> {
    let mut end = start;
    lengths
        .iter()
        .map(|&(name, length, weight)| {
            end += length;
            Block {
                name,
                range: end - length..end,
                weight,
            }
        })
        .filter(|block| !block.range.is_empty())
        .collect()
}

/// Moves one weighted rotation vector to the branch nearest `near`; tells whether it turns far.
pub(super) fn follow_rotation(near: &[f64], coordinates: &mut [f64], weight: f64) -> bool {
    let near = Vector3::from_column_slice(near) / weight;
    let old = Vector3::from_column_slice(coordinates) / weight;
    let new = nearest_branch(&old, &near);
    if new != old {
        coordinates.copy_from_slice((new * weight).as_slice());
    }
    (new - near).norm_squared() > LARGE_TURN * LARGE_TURN
}

/// The `index`-th three numbers of a row.
pub(super) fn triple(row: &[f64], index: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&row[3 * index..3 * index + 3])
}

/// The mean vertex of each part.
fn part_means(components: &Components, positions: &[f64]) -> Vec<Vector3<f64>> {
    let mut means = vec![Vector3::zeros(); components.count()];
    for (point, &part) in positions.chunks_exact(3).zip(components.part()) {
        means[part as usize] += Vector3::from_column_slice(point);
    }
    for (mean, &size) in means.iter_mut().zip(components.sizes()) {
        *mean /= f64::from(size);
    }
    means
}
