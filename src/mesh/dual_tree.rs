//! Spanning trees of a mesh's triangles, two triangles being neighbours where they share an edge: ways
//! to reach every triangle from the middle of its part without going around anything.

use std::cmp::Ordering;

use super::Hinge;

/// One triangle reached from its parent across an edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// The side of the parent that is crossed (see [`Hinge::sides`]).
    pub from: u32,
    /// The same edge as a side of the triangle that is reached.
    pub to: u32,
}

impl Step {
    /// The triangle that is left.
    pub fn parent(&self) -> usize {
        self.from as usize / 3
    }

    /// The triangle that is reached.
    pub fn child(&self) -> usize {
        self.to as usize / 3
    }
}

/// A spanning tree of one connected part of the triangles.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DualTree {
    /// The triangle that everything is reached from: a centre of the tree, from which the way to the
    /// farthest triangle is shortest.
    pub root: u32,
    /// One step for each other triangle, parents first.
    pub steps: Vec<Step>,
}

/// What decides between ways: a length that should be short and a place in space for ties. No two
/// places should be the same; where they are, the order of the input decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// What is to be small.
    pub weight: f64,
    /// Where it is; among equal weights the smaller x, then y, then z comes first.
    pub place: [f64; 3],
}

impl Cost {
    fn compare(&self, other: &Cost) -> Ordering {
        let places = self.place.iter().zip(&other.place);
        places.fold(self.weight.total_cmp(&other.weight), |order, (a, b)| {
            order.then(a.total_cmp(b))
        })
    }
}

/// The minimum spanning trees of `faces` triangles over `hinges` (Kruskal), one for each part, in the
/// order of their lowest triangle. `cost` tells what crossing a hinge costs, `place` where a triangle
/// is: of two centres of a tree the one with the smaller place is its root. The trees depend on the
/// numbering only where costs are the same. O(h log h) for h hinges.
pub fn dual_trees(
    faces: usize,
    hinges: &[Hinge],
    cost: impl Fn(usize) -> Cost,
    place: impl Fn(usize) -> [f64; 3],
) -> Vec<DualTree> {
    let links = spanning(faces, hinges, cost);
    let around = Neighbours::new(faces, hinges, &links);
    let mut degree: Vec<usize> = (0..faces).map(|face| around.at(face).len()).collect();
    let mut seen = vec![false; faces];
    let mut trees = Vec::new();
    for face in 0..faces {
        if seen[face] {
            continue;
        }
        let part = around.reach(face as u32);
        for step in &part {
            seen[step.child()] = true;
        }
        seen[face] = true;
        let members = part.iter().map(|step| step.child() as u32);
        let members: Vec<u32> = [face as u32].into_iter().chain(members).collect();
        let root = around.centre(&members, &mut degree, &place);
        trees.push(DualTree {
            root,
            steps: around.reach(root),
        });
    }
    trees
}

/// The hinges of the minimum spanning forest.
fn spanning(faces: usize, hinges: &[Hinge], cost: impl Fn(usize) -> Cost) -> Vec<u32> {
    let mut order: Vec<(Cost, u32)> = (0..hinges.len()).map(|h| (cost(h), h as u32)).collect();
    order.sort_by(|a, b| a.0.compare(&b.0).then(a.1.cmp(&b.1)));
    let mut parent: Vec<u32> = (0..faces as u32).collect();
    let mut links = Vec::with_capacity(faces.saturating_sub(1));
    for (_, hinge) in order {
        let [a, b] = hinges[hinge as usize].triangles();
        let (a, b) = (top(&mut parent, a), top(&mut parent, b));
        if a != b {
            parent[a.max(b) as usize] = a.min(b);
            links.push(hinge);
        }
    }
    links
}

/// The representative of a triangle's part; paths are halved on the way.
fn top(parent: &mut [u32], mut face: u32) -> u32 {
    while parent[face as usize] != face {
        parent[face as usize] = parent[parent[face as usize] as usize];
        face = parent[face as usize];
    }
    face
}

/// The triangles next to each one in a forest: the steps that leave it.
struct Neighbours {
    starts: Vec<u32>,
    steps: Vec<Step>,
}

impl Neighbours {
    fn new(faces: usize, hinges: &[Hinge], links: &[u32]) -> Self {
        let both = links.iter().flat_map(|&link| {
            let [a, b] = hinges[link as usize].sides;
            [Step { from: a, to: b }, Step { from: b, to: a }]
        });
        let mut steps: Vec<Step> = both.collect();
        steps.sort_unstable_by_key(|step| step.from);
        let mut starts = vec![0; faces + 1];
        for step in &steps {
            starts[step.parent() + 1] += 1;
        }
        for face in 0..faces {
            starts[face + 1] += starts[face];
        }
        Neighbours { starts, steps }
    }

    fn at(&self, face: usize) -> &[Step] {
        &self.steps[self.starts[face] as usize..self.starts[face + 1] as usize]
    }

    /// All triangles that can be reached, nearest first.
    fn reach(&self, root: u32) -> Vec<Step> {
        let mut found: Vec<Step> = self.at(root as usize).to_vec();
        let mut next = 0;
        while let Some(&step) = found.get(next) {
            let onward = self.at(step.child()).iter();
            found.extend(onward.filter(|onward| onward.child() != step.parent()));
            next += 1;
        }
        found
    }

    /// The triangle that is left when the leaves of the tree over `members` are taken off again and
    /// again; of two that are left, the one with the smaller place. `degree` is how many neighbours each
    /// triangle has; it is used up.
    fn centre(
        &self,
        members: &[u32],
        degree: &mut [usize],
        place: impl Fn(usize) -> [f64; 3],
    ) -> u32 {
        let outer = members.iter().copied();
        let mut leaves: Vec<u32> = outer.filter(|&face| degree[face as usize] <= 1).collect();
        let mut left = members.len();
        while left > 2 {
            left -= leaves.len();
            let mut inner = Vec::new();
            for &leaf in &leaves {
                degree[leaf as usize] = 0;
                for face in self.at(leaf as usize).iter().map(Step::child) {
                    degree[face] = degree[face].saturating_sub(1);
                    if degree[face] == 1 {
                        inner.push(face as u32);
                    }
                }
            }
            leaves = inner;
        }
        let cost = |face: u32| Cost {
            weight: 0.0,
            place: place(face as usize),
        };
        leaves
            .into_iter()
            .min_by(|&a, &b| cost(a).compare(&cost(b)).then(a.cmp(&b)))
            .unwrap_or(members[0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Hinges, VertexCorners};

    fn hinges(vertices: usize, triangles: &[[u32; 3]]) -> Vec<Hinge> {
        let corners = VertexCorners::new(vertices, triangles);
        Hinges::new(vertices, triangles, &corners).hinges().to_vec()
    }

    /// A strip of `n` triangles, each sharing an edge with the next.
    fn strip(n: u32) -> Vec<[u32; 3]> {
        (0..n).map(|i| [i, i + 1, i + 2]).collect()
    }

    fn plain(hinge: usize) -> Cost {
        Cost {
            weight: 1.0,
            place: [hinge as f64, 0.0, 0.0],
        }
    }

    #[test]
    fn a_strip_is_walked_from_its_middle_to_both_ends() {
        for n in [1, 2, 3, 8, 9] {
            let found = dual_trees(
                n as usize,
                &hinges(n as usize + 2, &strip(n)),
                plain,
                |face| [face as f64; 3],
            );
            assert_eq!(found.len(), 1);
            assert_eq!(found[0].root, (n - 1) / 2, "of two middles the smaller");
            let mut reached = vec![false; n as usize];
            reached[found[0].root as usize] = true;
            for step in &found[0].steps {
                assert!(reached[step.parent()] && !reached[step.child()]);
                reached[step.child()] = true;
            }
            assert!(reached.iter().all(|&face| face));
        }
    }

    #[test]
    fn the_dearest_hinge_of_a_ring_is_not_crossed() {
        // a fan of four triangles all around vertex 0
        let fan = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]];
        let all = hinges(5, &fan);
        for dear in 0..all.len() {
            let cost = |hinge: usize| Cost {
                weight: f64::from(u8::from(hinge == dear)),
                ..plain(hinge)
            };
            let trees = dual_trees(4, &all, cost, |face| [face as f64; 3]);
            let crossed = |step: &Step| {
                let mut sides = [step.from, step.to];
                sides.sort_unstable();
                sides == all[dear].sides
            };
            assert_eq!(trees[0].steps.len(), 3);
            assert!(!trees[0].steps.iter().any(crossed));
        }
    }

    #[test]
    fn parts_have_trees_of_their_own_and_nothing_has_none() {
        let two = [[0, 1, 2], [3, 4, 5], [4, 3, 6]];
        let trees = dual_trees(3, &hinges(7, &two), plain, |face| [face as f64; 3]);
        let shape: Vec<_> = trees
            .iter()
            .map(|tree| (tree.root, tree.steps.len()))
            .collect();
        assert_eq!(shape, [(0, 0), (1, 1)]);
        assert!(dual_trees(0, &[], plain, |_| [0.0; 3]).is_empty());
    }
}
