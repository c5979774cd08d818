//! How patches are joined.

use super::Patch;
use crate::math::rotation_graph::RotationGraph;
use crate::mesh::Hinges;

/// The least share of a pair: patches of no area to speak of have a say beyond rounding.
const LEAST_SHARE: f64 = 1e-12;

/// Pairs of adjacent patches, each once in ascending order, with the number of hinges between them.
pub(super) fn adjacent(hinges: &Hinges, patch: &[u32]) -> (Vec<[u32; 2]>, Vec<f64>) {
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

/// Root of the share of each pair of patches in the motion of the mesh: what turns when the pair alone
/// says so, as a share of the area, over the part of it that the pairs beside it let happen.
///
/// A unit turn of pair l makes the patches turn by x_l = L^-1 w_l (e_j - e_i), where L is the Laplacian
/// of the pairs, and the pair itself by its leverage t_l = x_l(j) - x_l(i), 1 where nothing else joins
/// its two sides. A joint that is cut by c equal pairs bends when all of them do, each with t = 1/c and
/// the area-weighted variance of x equal to s/c^2 for sides with shares that make s: so with squared
/// weights variance / t the pairs of a joint count together as the turn of what they move.
pub(super) fn pair_shares(
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
