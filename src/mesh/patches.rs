//! Patches: connected regions of triangles that turn alike (X19 §4.2; the segmentation plays the part
//! of Wang, Pulli & Popovic 2007).

use std::cmp::Reverse;
use std::collections::{BinaryHeap, HashMap};

use nalgebra::UnitQuaternion;

use super::{Components, Hinges};

/// The fewest triangles of a patch whose part of the mesh has that many.
const SMALLEST: usize = 10;

/// How often regions are grown: the second time from the middles of the first; more often while too
/// many patches are lost for being small.
const ROUNDS: usize = 5;

/// Triangles among which seeds are sought; of a larger mesh every so-manieth.
const CANDIDATES: usize = 20_000;

/// How much place counts beside rotation: the length of the mesh like a turn by 40 degrees (|R - 1| = 1).
/// Patches stay compact, and grow like cells where nothing turns.
const COMPACTNESS: f64 = 1.0;

/// The number of patches sought for this many triangles: 8 to 200, with the root of the number of
/// triangles between.
pub fn usual_patches(triangles: usize) -> usize {
    let root = (triangles as f64).sqrt() / 2.0;
    (root as usize).clamp(8, 200)
}

/// Splits triangles into connected patches (triangles being neighbours across edges) by growing regions
/// from seeds, always taking the triangle that differs least from the region's seed. Triangles differ
/// by their rotations in the given poses (`rotations`: pose after pose, one a triangle; may be empty)
/// and, less, by their `centres` (in units of the mesh's size). Gives the patch of each triangle, numbered from 0. Each part of the mesh has
/// at least one patch; smaller ones than ten triangles are joined to a neighbour where they have one.
pub fn grow_patches(
    hinges: &Hinges,
    rotations: &[&[UnitQuaternion<f64>]],
    centres: &[[f64; 3]],
    sought: usize,
) -> Vec<u32> {
    let features = features(rotations, centres);
    let neighbours = Neighbours::new(centres.len(), hinges);
    let sought = sought.min(centres.len() / SMALLEST).max(1);
    let mut patches = Vec::new();
    let mut seeds = first_seeds(&neighbours, &features, sought);
    for round in 0..ROUNDS {
        patches = join_small(&neighbours, &features, grow(&neighbours, &features, &seeds));
        seeds = central(&patches, &features);
        if round > 0 && 2 * seeds.len() >= sought {
            break;
        }
        split_large(&patches, &features, &mut seeds, sought);
    }
    patches
}

/// One row of numbers a triangle, such that squared distances of rows measure how differently they
/// turn: the entries of their rotation matrices (single precision does), averaged over the poses, then
/// the centre.
struct Features {
    width: usize,
    rows: Vec<f32>,
}

impl Features {
    fn row(&self, triangle: usize) -> &[f32] {
        &self.rows[triangle * self.width..(triangle + 1) * self.width]
    }

    fn distance(&self, triangle: usize, row: &[f32]) -> f32 {
        let pairs = self.row(triangle).iter().zip(row);
        pairs.map(|(a, b)| (a - b) * (a - b)).sum()
    }

    fn between_centres(&self, a: usize, b: usize) -> f32 {
        let centre = |triangle: usize| &self.row(triangle)[self.width - 3..];
        let pairs = centre(a).iter().zip(centre(b));
        pairs.map(|(a, b)| (a - b) * (a - b)).sum()
    }
}

fn features(rotations: &[&[UnitQuaternion<f64>]], centres: &[[f64; 3]]) -> Features {
    let width = 9 * rotations.len() + 3;
    let share = 1.0 / (rotations.len().max(1) as f64).sqrt();
    let mut rows = Vec::with_capacity(width * centres.len());
    for (triangle, centre) in centres.iter().enumerate() {
        for pose in rotations {
            let matrix = pose[triangle].to_rotation_matrix();
            rows.extend(matrix.matrix().iter().map(|&entry| (share * entry) as f32));
        }
        rows.extend(centre.map(|x| (COMPACTNESS * x) as f32));
    }
    Features { width, rows }
}

/// Which triangles share an edge.
struct Neighbours {
    starts: Vec<u32>,
    triangles: Vec<u32>,
    parts: Components,
}

impl Neighbours {
    fn new(triangles: usize, hinges: &Hinges) -> Self {
        let pairs = || hinges.hinges().iter().map(|hinge| hinge.triangles());
        let mut starts = vec![0_u32; triangles + 1];
        for [a, b] in pairs() {
            starts[a as usize + 1] += 1;
            starts[b as usize + 1] += 1;
        }
        for triangle in 0..triangles {
            starts[triangle + 1] += starts[triangle];
        }
        let mut next = starts.clone();
        let mut found = vec![0; starts[triangles] as usize];
        for [a, b] in pairs() {
            for (from, to) in [(a, b), (b, a)] {
                found[next[from as usize] as usize] = to;
                next[from as usize] += 1;
            }
        }
        Neighbours {
            starts,
            triangles: found,
            parts: Components::joined(triangles, pairs()),
        }
    }

    fn of(&self, triangle: usize) -> &[u32] {
        &self.triangles[self.starts[triangle] as usize..self.starts[triangle + 1] as usize]
    }
}

/// One triangle of each part, then always the candidate farthest from all seeds so far.
fn first_seeds(neighbours: &Neighbours, features: &Features, sought: usize) -> Vec<usize> {
    let count = neighbours.parts.part().len();
    let candidates: Vec<usize> = (0..count)
        .step_by(count.div_ceil(CANDIDATES).max(1))
        .collect();
    let mut distances = vec![f32::INFINITY; candidates.len()];
    let mut seeds: Vec<usize> = Vec::new();
    let add = |seed: usize, distances: &mut [f32]| {
        let row = features.row(seed);
        for (distance, &candidate) in distances.iter_mut().zip(&candidates) {
            *distance = distance.min(features.distance(candidate, row));
        }
    };
    for &first in neighbours.parts.first() {
        add(first as usize, &mut distances);
        seeds.push(first as usize);
    }
    while seeds.len() < sought {
        let farthest = (0..candidates.len())
            .rev()
            .max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        match farthest {
            Some(at) if distances[at] > 0.0 => {
                seeds.push(candidates[at]);
                add(candidates[at], &mut distances);
            }
            _ => break,
        }
    }
    seeds
}

/// Regions around seeds; ties go to the lower triangle.
fn grow(neighbours: &Neighbours, features: &Features, seeds: &[usize]) -> Vec<u32> {
    const FREE: u32 = u32::MAX;
    let mut patches = vec![FREE; neighbours.parts.part().len()];
    // distances are never negative: their bits are in their order
    let mut front: BinaryHeap<Reverse<(u32, u32, u32)>> = seeds
        .iter()
        .enumerate()
        .map(|(patch, &seed)| Reverse((0, seed as u32, patch as u32)))
        .collect();
    while let Some(Reverse((_, triangle, patch))) = front.pop() {
        let triangle = triangle as usize;
        if patches[triangle] != FREE {
            continue;
        }
        patches[triangle] = patch;
        let seed = features.row(seeds[patch as usize]);
        for &next in neighbours.of(triangle) {
            if patches[next as usize] == FREE {
                let distance = features.distance(next as usize, seed);
                front.push(Reverse((distance.to_bits(), next, patch)));
            }
        }
    }
    patches
}

/// Mean row of each patch.
fn means(patches: &[u32], features: &Features, count: usize) -> Vec<Vec<f32>> {
    let mut sums = vec![vec![0.0_f64; features.width]; count];
    let mut sizes = vec![0.0_f64; count];
    for (triangle, &patch) in patches.iter().enumerate() {
        sizes[patch as usize] += 1.0;
        for (sum, &value) in sums[patch as usize].iter_mut().zip(features.row(triangle)) {
            *sum += f64::from(value);
        }
    }
    let mean = |(sum, size): (Vec<f64>, f64)| sum.iter().map(|x| (x / size) as f32).collect();
    sums.into_iter().zip(sizes).map(mean).collect()
}

/// The triangle of each patch nearest its mean.
fn central(patches: &[u32], features: &Features) -> Vec<usize> {
    let count = patches.iter().max().map_or(0, |&last| last as usize + 1);
    let means = means(patches, features, count);
    let mut best = vec![(f32::INFINITY, 0); count];
    for (triangle, &patch) in patches.iter().enumerate() {
        let patch = patch as usize;
        let distance = features.distance(triangle, &means[patch]);
        if distance < best[patch].0 {
            best[patch] = (distance, triangle);
        }
    }
    best.into_iter().map(|(_, triangle)| triangle).collect()
}

/// Adds a second seed to the largest patches until there are enough: the triangle whose place is
/// farthest from the first's.
fn split_large(patches: &[u32], features: &Features, seeds: &mut Vec<usize>, sought: usize) {
    let count = seeds.len();
    let mut farthest = vec![(-1.0_f32, 0_usize); count];
    let mut sizes = vec![0_usize; count];
    for (triangle, &patch) in patches.iter().enumerate() {
        let patch = patch as usize;
        sizes[patch] += 1;
        let distance = features.between_centres(triangle, seeds[patch]);
        if distance > farthest[patch].0 {
            farthest[patch] = (distance, triangle);
        }
    }
    let mut largest: Vec<usize> = (0..count).filter(|&p| sizes[p] >= 4 * SMALLEST).collect();
    largest.sort_by_key(|&patch| Reverse(sizes[patch]));
    largest.truncate(sought.saturating_sub(count));
    seeds.extend(largest.into_iter().map(|patch| farthest[patch].1));
}

/// Joins patches below [`SMALLEST`], smallest first, each to the neighbour most like it; numbers what is
/// left in the order of first triangles.
fn join_small(neighbours: &Neighbours, features: &Features, mut patches: Vec<u32>) -> Vec<u32> {
    let count = patches.iter().max().map_or(0, |&last| last as usize + 1);
    let means = means(&patches, features, count);
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (triangle, &patch) in patches.iter().enumerate() {
        members[patch as usize].push(triangle as u32);
    }
    let mut stuck = vec![false; count];
    loop {
        let small = (0..count)
            .filter(|&patch| !stuck[patch])
            .filter(|&patch| (1..SMALLEST).contains(&members[patch].len()))
            .min_by_key(|&patch| members[patch].len());
        let Some(small) = small else { break };
        let unlike = |patch: u32| -> f32 {
            let pairs = means[small].iter().zip(&means[patch as usize]);
            pairs.map(|(a, b)| (a - b) * (a - b)).sum()
        };
        let nearest = members[small]
            .iter()
            .flat_map(|&triangle| neighbours.of(triangle as usize))
            .map(|&next| patches[next as usize])
            .filter(|&patch| patch as usize != small)
            .min_by(|&a, &b| unlike(a).total_cmp(&unlike(b)).then(a.cmp(&b)));
        let Some(nearest) = nearest else {
            stuck[small] = true;
            continue;
        };
        let moved = std::mem::take(&mut members[small]);
        for &triangle in &moved {
            patches[triangle as usize] = nearest;
        }
        members[nearest as usize].extend(moved);
    }
    renumber(&mut patches);
    patches
}

fn renumber(patches: &mut [u32]) {
    let mut numbers = HashMap::new();
    for patch in patches {
        let next = numbers.len() as u32;
        *patch = *numbers.entry(*patch).or_insert(next);
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::math::rotation::exp;
    use crate::mesh::VertexCorners;

    /// A strip of `length` x 2 triangles with their centres.
    fn strip(length: usize) -> (Hinges, Vec<[f64; 3]>) {
        let mut triangles = Vec::new();
        for i in 0..length as u32 {
            let (a, b) = (2 * i, 2 * i + 1);
            triangles.extend([[a, b, a + 2], [b, b + 2, a + 2]]);
        }
        let vertices = 2 * length + 2;
        let corners = VertexCorners::new(vertices, &triangles);
        let centres = (0..2 * length)
            .map(|i| [i as f64 / length as f64, 0.0, 0.0])
            .collect();
        (Hinges::new(vertices, &triangles, &corners), centres)
    }

    fn sizes(patches: &[u32]) -> Vec<usize> {
        let count = *patches.iter().max().unwrap() as usize + 1;
        (0..count)
            .map(|patch| patches.iter().filter(|&&p| p as usize == patch).count())
            .collect()
    }

    #[test]
    fn without_poses_patches_are_cells_of_ten_triangles_or_more() {
        let (hinges, centres) = strip(200);
        let patches = grow_patches(&hinges, &[], &centres, usual_patches(centres.len()));
        let sizes = sizes(&patches);
        assert!((8..=200).contains(&sizes.len()));
        assert!(sizes.iter().all(|&size| size >= SMALLEST));
        // a strip's cells are intervals: each patch is left once at most
        let changes = patches.windows(2).filter(|pair| pair[0] != pair[1]).count();
        assert_eq!(changes, sizes.len() - 1);
    }

    #[test]
    fn a_joint_in_the_poses_is_a_border_of_patches() {
        let (hinges, centres) = strip(100);
        let turns: Vec<_> = (0..200)
            .map(|i| exp(&Vector3::new(0.0, 0.0, if i < 77 { 0.0 } else { 1.5 })))
            .collect();
        let patches = grow_patches(&hinges, &[&turns], &centres, usual_patches(centres.len()));
        assert_ne!(patches[76], patches[77]);
        assert!(
            patches[..77]
                .iter()
                .all(|patch| !patches[77..].contains(patch))
        );
    }

    #[test]
    fn tiny_meshes_and_no_mesh_have_patches_too() {
        let (hinges, centres) = strip(1);
        assert_eq!(
            grow_patches(&hinges, &[], &centres, usual_patches(centres.len())),
            [0, 0]
        );
        let none = Hinges::new(0, &[], &VertexCorners::new(0, &[]));
        assert!(grow_patches(&none, &[], &[], 8).is_empty());
    }
}
