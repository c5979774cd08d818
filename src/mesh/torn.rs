//! Triangles that are torn between some shapes of a mesh: captures whose vertices do not correspond
//! everywhere have triangles that are small in one shape and reach across the mesh in another. How they
//! turn says nothing about the mesh.

use nalgebra::Vector3;
use rayon::prelude::*;

/// Triangles whose longest side changes by more than this factor from one shape to another, beside the
/// others' sides, are torn. Joints and faces that are drawn stay below four to eight.
const TORN: f64 = 10.0;

/// Triangles that one thread takes at a time.
const CHUNK: usize = 2048;

/// How much each triangle is to count, in (0, 1], for shapes of 3V positions: 1 for one that is not torn;
/// the sixth power of `TORN` over the change of its longest side for one that is. Sides are
/// measured by the median of all longest sides in the same shape, so shapes may have any size. Empty where no
/// triangle is torn. A triangle without a side in some shape is as torn as one that changes a thousandfold.
pub fn torn(triangles: &[[u32; 3]], shapes: &[&[f64]]) -> Vec<f64> {
    let mut ranges = vec![[f64::INFINITY, 0.0]; triangles.len()];
    for shape in shapes {
        let sides = longest_sides(triangles, shape);
        let median = median(&sides);
        if median > 0.0 {
            for ([least, most], side) in ranges.iter_mut().zip(sides) {
                *least = least.min(side / median);
                *most = most.max(side / median);
            }
        }
    }
    let weight = |&[least, most]: &[f64; 2]| {
        let kept = TORN * (least / most).max(1e-3);
        match most > 0.0 && kept < 1.0 {
            true => kept.powi(6),
            false => 1.0,
        }
    };
    let weights: Vec<f64> = ranges.iter().map(weight).collect();
    match weights.iter().all(|weight| *weight == 1.0) {
        true => Vec::new(),
        false => weights,
    }
}

fn longest_sides(triangles: &[[u32; 3]], shape: &[f64]) -> Vec<f64> {
    let place = |vertex: u32| Vector3::from_column_slice(&shape[3 * vertex as usize..][..3]);
    let longest = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(place);
        let squares = [b - a, c - b, a - c].map(|side| side.norm_squared());
        squares.into_iter().fold(0.0, f64::max).sqrt()
    };
    let sides = triangles.par_iter().with_min_len(CHUNK).map(longest);
    sides.collect()
}

fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    let middle = sorted.len() / 2;
    match sorted.is_empty() {
        true => 0.0,
        false => *sorted.select_nth_unstable_by(middle, f64::total_cmp).1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip of unit squares cut in two, `length` long.
    fn strip(length: u32) -> (Vec<[u32; 3]>, Vec<f64>) {
        let square = |i: u32| {
            [
                [2 * i, 2 * i + 2, 2 * i + 1],
                [2 * i + 1, 2 * i + 2, 2 * i + 3],
            ]
        };
        let place = |i: u32| [f64::from(i / 2), f64::from(i % 2), 0.0];
        (
            (0..length).flat_map(square).collect(),
            (0..2 * length + 2).flat_map(place).collect(),
        )
    }

    #[test]
    fn what_bends_stretches_or_grows_is_whole() {
        let (triangles, flat) = strip(10);
        let stretched: Vec<f64> = flat
            .chunks_exact(3)
            .flat_map(|p| [4.0 * p[0], p[1], 0.3 * p[0]])
            .collect();
        let grown: Vec<f64> = flat.iter().map(|x| 1e4 * x).collect();
        assert!(torn(&triangles, &[&flat, &stretched, &grown]).is_empty());
        assert!(torn(&triangles, &[]).is_empty());
        assert!(torn(&[], &[&flat]).is_empty());
    }

    #[test]
    fn triangles_that_reach_across_the_mesh_are_torn_whichever_shape_is_first() {
        let (triangles, flat) = strip(40);
        let mut across = flat.clone();
        across[3 * 81] = -1.0; // the last corner lies beyond the first
        for shapes in [[&flat[..], &across[..]], [&across, &flat]] {
            let weights = torn(&triangles, &shapes);
            let last = triangles.len() - 1;
            assert!(weights[..last].iter().all(|weight| *weight == 1.0));
            // from root 2 to about 41
            assert!(weights[last] < 2e-3 && weights[last] > 0.0);
        }
    }
}
