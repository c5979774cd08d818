//! Which triangles make up each patch, and for how much of its area each stands.

use crate::mesh::{Hinges, ReferenceTriangle};

/// Where the members of each patch begin; the members patch by patch, triangles and how much of the
/// patch's area each stands for.
pub(super) type Members = (Vec<u32>, Vec<(u32, f64)>);

/// By what triangles count.
pub(super) fn areas(reference: &[ReferenceTriangle], weights: &[f64]) -> Vec<f64> {
    let mut areas: Vec<f64> = reference.iter().map(ReferenceTriangle::area).collect();
    for (area, weight) in areas.iter_mut().zip(weights) {
        *area *= weight;
    }
    areas
}

pub(super) fn count(patch: &[u32]) -> usize {
    patch.iter().max().map_or(0, |&last| last as usize + 1)
}

pub(super) fn of_patch(members: &Members, patch: usize) -> &[(u32, f64)] {
    &members.1[members.0[patch] as usize..members.0[patch + 1] as usize]
}

/// Where the members of each patch begin in a list of all, and that list, from (patch, triangle, area)
/// in the order of the patches.
pub(super) fn listed(count: usize, all: Vec<(u32, u32, f64)>) -> Members {
    let mut starts = vec![0_u32; count + 1];
    all.iter()
        .for_each(|&(p, _, _)| starts[p as usize + 1] += 1);
    for p in 0..count {
        starts[p + 1] += starts[p];
    }
    let members = all.into_iter().map(|(_, face, area)| (face, area));
    (starts, members.collect())
}

/// The triangles of each patch, each standing for itself.
pub(super) fn members(patch: &[u32], count: usize, areas: &[f64]) -> Members {
    let all = patch.iter().zip(0..).zip(areas);
    let mut all: Vec<_> = all
        .map(|((&patch, face), &area)| (patch, face, area))
        .collect();
    all.sort_by_key(|&(patch, face, _)| (patch, face));
    listed(count, all)
}

/// The triangles of a coarser mesh that stand for each patch.
pub(super) fn coarse_members(
    patch: &[u32],
    count: usize,
    areas: &[f64],
    carriers: &[u32],
) -> Members {
    assert_eq!(patch.len(), carriers.len(), "one carrier a triangle");
    let all = patch.iter().zip(carriers).zip(areas);
    let mut all: Vec<(u32, u32, f64)> = all
        .map(|((&patch, &face), &area)| (patch, face, area))
        .collect();
    all.sort_by_key(|&(patch, face, _)| (patch, face));
    let sums = all.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1));
    let sums = sums.map(|run| (run[0].0, run[0].1, run.iter().map(|part| part.2).sum()));
    listed(count, sums.collect())
}

/// For each of `triangles` the patch that it stands for most of.
pub(super) fn largest_shares(members: &Members, triangles: usize, hinges: &Hinges) -> Vec<u32> {
    let mut best = vec![(f64::NEG_INFINITY, None); triangles];
    for patch in 0..members.0.len() - 1 {
        for &(face, area) in of_patch(members, patch) {
            if area > best[face as usize].0 {
                best[face as usize] = (area, Some(patch as u32));
            }
        }
    }
    let mut found: Vec<Option<u32>> = best.into_iter().map(|(_, patch)| patch).collect();
    spread(&mut found, hinges);
    found.into_iter().map(Option::unwrap_or_default).collect()
}

/// Gives what is known of triangles to neighbours of which nothing is known, until all is said.
pub(super) fn spread(found: &mut [Option<u32>], hinges: &Hinges) {
    loop {
        let before = found.to_vec();
        for [a, b] in hinges.hinges().iter().map(|hinge| hinge.triangles()) {
            for [a, b] in [[a, b], [b, a]].map(|pair| pair.map(|face| face as usize)) {
                found[a] = found[a].or(before[b]);
            }
        }
        if found == before {
            return;
        }
    }
}
