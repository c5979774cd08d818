//! Which collapse comes next: the cheapest, as last looked at.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use super::CHUNK;
use super::surface::Mesh;

/// The cheapest collapse of a vertex, when it was found.
#[derive(Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    pub(super) cost: f64,
    pub(super) vertex: u32,
    pub(super) onto: u32,
    stamp: u32,
}

impl Eq for Candidate {}

impl Ord for Candidate {
    /// The cheapest is the greatest.
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .cost
            .total_cmp(&self.cost)
            .then(other.vertex.cmp(&self.vertex))
            .then(other.onto.cmp(&self.onto))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Memory of one evaluation.
#[derive(Default)]
pub(super) struct Scratch {
    pub(super) neighbours: Vec<(u32, u32)>,
    sorted: Vec<(f64, u32)>,
    others: Vec<u32>,
}

impl Mesh {
    /// Collapses while there are candidates and more than `target` triangles. What has changed around a
    /// vertex is looked at when its turn comes, or at once where it had no collapse before.
    pub(super) fn run(&mut self, target: usize, limit: f64, curve: &mut Vec<(usize, f64)>) {
        let candidates: Vec<Option<Candidate>> = (0..self.around.len() as u32)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map_init(Scratch::default, |scratch, vertex| {
                self.candidate(vertex, limit, scratch)
            })
            .collect();
        let mut idle: Vec<bool> = candidates.iter().map(Option::is_none).collect();
        let mut heap: BinaryHeap<Candidate> = candidates.into_iter().flatten().collect();
        let (mut scratch, mut ring) = (Scratch::default(), Vec::new());
        while self.left > target {
            let Some(candidate) = heap.pop() else { return };
            let vertex = candidate.vertex;
            if self.stamp[vertex as usize] != candidate.stamp {
                let found = self.candidate(vertex, limit, &mut scratch);
                idle[vertex as usize] = found.is_none();
                heap.extend(found);
                continue;
            }
            self.apply(&candidate);
            curve.push((self.left, candidate.cost.max(0.0)));
            self.neighbours(candidate.onto, &mut ring);
            for near in ring.iter().map(|(near, _)| *near).chain([candidate.onto]) {
                self.stamp[near as usize] += 1;
                if idle[near as usize] {
                    let found = self.candidate(near, limit, &mut scratch);
                    idle[near as usize] = found.is_none();
                    heap.extend(found);
                }
            }
        }
    }

    /// The cheapest allowed collapse of a vertex.
    fn candidate(&self, vertex: u32, limit: f64, scratch: &mut Scratch) -> Option<Candidate> {
        if self.fixed[vertex as usize] {
            return None;
        }
        let Scratch {
            neighbours,
            sorted,
            others,
        } = scratch;
        self.neighbours(vertex, neighbours);
        sorted.clear();
        sorted.extend(
            neighbours
                .iter()
                .map(|&(onto, _)| (self.cost(vertex, onto), onto)),
        );
        sorted.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let allowed = |onto: u32, others: &mut Vec<u32>| {
            self.keeps_the_surface(vertex, onto, neighbours, others)
                && self.turns_little(vertex, onto, limit)
        };
        let found = sorted.iter().find(|(_, onto)| allowed(*onto, others));
        found.map(|&(cost, onto)| Candidate {
            cost,
            vertex,
            onto,
            stamp: self.stamp[vertex as usize],
        })
    }
}
