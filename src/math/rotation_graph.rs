//! Rotations from relative rotations: nodes joined by links, each link telling how one node is turned
//! against another.
//!
//! Minimises sum w |log(R_i C_ij R_j^-1)|^2 over rotations R, where C_ij is the given rotation of node j
//! relative to node i. A breadth-first tree gives a start, exact when the links agree around every
//! loop; then each step of a Gauss-Newton iteration spreads the disagreements: corrections q_i with
//! q_j - q_i = e_ij = log(R_i C_ij R_j^-1) in the least-squares sense, R_i <- exp(q_i) R_i. The matrix
//! is the weighted Laplacian of the graph (n unknowns, 3 right sides); it depends on the links only and
//! is factored once.

use std::collections::VecDeque;
use std::sync::Arc;

use nalgebra::{UnitQuaternion, Vector3};

use super::rotation::{exp, log};
use super::sparse::{Analysis, Factor, Pattern, SparseError};

/// Steps of the iteration; disagreements of a radian shrink by a factor of about ten in each.
const STEPS: usize = 20;

/// Disagreements and corrections below this (radians) are rounding.
const EXACT: f64 = 1e-11;

/// Nodes and links with their factored Laplacian.
#[derive(Debug)]
pub struct RotationGraph {
    links: Vec<[u32; 2]>,
    weights: Vec<f64>,
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    tree: Vec<(u32, u32)>,
    factor: Factor,
}

impl RotationGraph {
    /// A graph over nodes 0..`nodes`. Each link has a weight > 0; links from a node to itself have no
    /// effect.
    ///
    /// # Errors
    /// The system is too large or has weights that are not positive.
    pub fn new(nodes: usize, links: Vec<[u32; 2]>, weights: Vec<f64>) -> Result<Self, SparseError> {
        let analysis = Analysis::new(Pattern::new(nodes, links.iter().copied()))?;
        RotationGraph::on(&analysis, links, weights)
    }

    /// As [`RotationGraph::new`], on a pattern that has been analysed before and has an entry for each
    /// link.
    ///
    /// # Errors
    /// As [`RotationGraph::new`].
    pub fn on(
        analysis: &Arc<Analysis>,
        links: Vec<[u32; 2]>,
        weights: Vec<f64>,
    ) -> Result<Self, SparseError> {
        let nodes = analysis.pattern().unknowns();
        let (starts, neighbours) = incidence(nodes, &links);
        let tree = spanning_forest(&links, (&starts, &neighbours), &|_| true);
        let factor = laplacian(analysis, &links, &weights, &tree)?;
        Ok(RotationGraph {
            links,
            weights,
            starts,
            neighbours,
            tree,
            factor,
        })
    }

    /// The links.
    pub fn links(&self) -> &[[u32; 2]] {
        &self.links
    }

    /// The factored Laplacian of the links, the lowest node of each connected part held at zero: good for
    /// any least-squares system of weighted differences along the links whose right sides sum to zero
    /// over each part.
    pub fn factor(&self) -> &Factor {
        &self.factor
    }

    /// Finds the rotations of all nodes from the rotation of each link's second node relative to its
    /// first; the lowest node of each connected part gets the identity. Links that are not `trusted`
    /// are used only where nothing else joins two parts.
    ///
    /// # Panics
    /// `relative` or `rotations` has another length than links and nodes.
    pub fn solve(
        &self,
        relative: &[UnitQuaternion<f64>],
        trusted: &dyn Fn(usize) -> bool,
        rotations: &mut [UnitQuaternion<f64>],
    ) {
        assert_eq!(relative.len(), self.links.len(), "one rotation a link");
        self.start(relative, trusted, rotations);
        let n = rotations.len();
        let mut sides = vec![0.0; 3 * n];
        for _ in 0..STEPS {
            if self.disagreements(relative, trusted, rotations, &mut sides) < EXACT {
                return;
            }
            self.factor.solve(3, &mut sides);
            let mut largest = 0.0_f64;
            for (i, rotation) in rotations.iter_mut().enumerate() {
                let q = Vector3::new(sides[i], sides[n + i], sides[2 * n + i]);
                largest = largest.max(q.norm_squared());
                *rotation = UnitQuaternion::new_normalize((exp(&q) * *rotation).into_inner());
            }
            if largest < EXACT * EXACT {
                return;
            }
        }
    }

    /// Rotations along a spanning forest.
    fn start(
        &self,
        relative: &[UnitQuaternion<f64>],
        trusted: &dyn Fn(usize) -> bool,
        rotations: &mut [UnitQuaternion<f64>],
    ) {
        rotations.fill(UnitQuaternion::identity());
        let walk = |tree: &[(u32, u32)], rotations: &mut [UnitQuaternion<f64>]| {
            for &(link, to) in tree {
                let [i, j] = self.links[link as usize].map(|node| node as usize);
                let turn = relative[link as usize];
                rotations[to as usize] = match to as usize == j {
                    true => rotations[i] * turn,
                    false => rotations[j] * turn.inverse(),
                };
            }
        };
        match (0..self.links.len()).all(trusted) {
            true => walk(&self.tree, rotations),
            false => {
                let incidence = (&self.starts[..], &self.neighbours[..]);
                walk(&spanning_forest(&self.links, incidence, trusted), rotations);
            }
        }
    }

    /// Right sides of the corrections; gives the largest disagreement.
    fn disagreements(
        &self,
        relative: &[UnitQuaternion<f64>],
        trusted: &dyn Fn(usize) -> bool,
        rotations: &[UnitQuaternion<f64>],
        sides: &mut [f64],
    ) -> f64 {
        let n = rotations.len();
        sides.fill(0.0);
        let mut largest = 0.0_f64;
        for (link, &[i, j]) in self.links.iter().enumerate() {
            if !trusted(link) || i == j {
                continue;
            }
            let (i, j) = (i as usize, j as usize);
            let e = log(&(rotations[i] * relative[link] * rotations[j].inverse()));
            largest = largest.max(e.norm_squared());
            for axis in 0..3 {
                sides[axis * n + j] += self.weights[link] * e[axis];
                sides[axis * n + i] -= self.weights[link] * e[axis];
            }
        }
        largest.sqrt()
    }
}

/// (link, node it leads to) in an order that starts at the lowest node of each part; trusted links first.
fn spanning_forest(
    links: &[[u32; 2]],
    (starts, neighbours): (&[u32], &[u32]),
    trusted: &dyn Fn(usize) -> bool,
) -> Vec<(u32, u32)> {
    let nodes = starts.len() - 1;
    let mut seen = vec![false; nodes];
    let mut tree = Vec::with_capacity(nodes);
    let (mut sure, mut doubtful) = (VecDeque::new(), VecDeque::new());
    let spread = |node: u32, sure: &mut VecDeque<_>, doubtful: &mut VecDeque<_>| {
        let node = node as usize;
        for &link in &neighbours[starts[node] as usize..starts[node + 1] as usize] {
            let [i, j] = links[link as usize];
            let step = (link, if i as usize == node { j } else { i });
            match trusted(link as usize) {
                true => sure.push_back(step),
                false => doubtful.push_back(step),
            }
        }
    };
    for root in 0..nodes {
        if std::mem::replace(&mut seen[root], true) {
            continue;
        }
        spread(root as u32, &mut sure, &mut doubtful);
        while let Some((link, to)) = sure.pop_front().or_else(|| doubtful.pop_front()) {
            if !std::mem::replace(&mut seen[to as usize], true) {
                tree.push((link, to));
                spread(to, &mut sure, &mut doubtful);
            }
        }
    }
    tree
}

/// The weighted Laplacian, the lowest node of each part held by a spring that no solution stretches.
fn laplacian(
    analysis: &Arc<Analysis>,
    links: &[[u32; 2]],
    weights: &[f64],
    tree: &[(u32, u32)],
) -> Result<Factor, SparseError> {
    let pattern = analysis.pattern();
    let mut entries = vec![0.0; pattern.entries()];
    let mut add = |i: u32, j: u32, value: f64| {
        if let Some(at) = pattern.entry(i as usize, j as usize) {
            entries[at] += value;
        }
    };
    for (&[i, j], &weight) in links.iter().zip(weights) {
        if i != j {
            add(i, i, weight);
            add(j, j, weight);
            add(i, j, -weight);
        }
    }
    let mut root = vec![true; pattern.unknowns()];
    for &(_, to) in tree {
        root[to as usize] = false;
    }
    let mean = weights.iter().sum::<f64>() / weights.len().max(1) as f64;
    let spring = if mean > 0.0 { mean } else { 1.0 };
    for node in (0..root.len()).filter(|&node| root[node]) {
        add(node as u32, node as u32, spring);
    }
    analysis.factor(&entries)
}

/// For every node the links at it.
fn incidence(nodes: usize, links: &[[u32; 2]]) -> (Vec<u32>, Vec<u32>) {
    let mut starts = vec![0_u32; nodes + 1];
    for &node in links.as_flattened() {
        starts[node as usize + 1] += 1;
    }
    for node in 0..nodes {
        starts[node + 1] += starts[node];
    }
    let mut next = starts.clone();
    let mut neighbours = vec![0; 2 * links.len()];
    for (at, &node) in links.as_flattened().iter().enumerate() {
        neighbours[next[node as usize] as usize] = at as u32 / 2;
        next[node as usize] += 1;
    }
    (starts, neighbours)
}

#[cfg(test)]
mod tests {
    use super::*;

    type Turn = UnitQuaternion<f64>;

    /// A ring of nodes with chords, and rotations for them.
    fn ring(nodes: usize) -> (RotationGraph, Vec<Turn>) {
        let n = nodes as u32;
        let links: Vec<[u32; 2]> = (0..n)
            .flat_map(|i| [[i, (i + 1) % n], [i, (i + 3) % n]])
            .collect();
        let weights = (0..links.len()).map(|i| 1.0 + (i % 3) as f64).collect();
        let truth = (0..nodes)
            .map(|i| exp(&Vector3::new(i as f64, 0.3 * i as f64, -1.0)))
            .collect();
        (RotationGraph::new(nodes, links, weights).unwrap(), truth)
    }

    fn relative(graph: &RotationGraph, truth: &[Turn]) -> Vec<Turn> {
        let between = |&[i, j]: &[u32; 2]| truth[i as usize].inverse() * truth[j as usize];
        graph.links().iter().map(between).collect()
    }

    fn worst(found: &[Turn], truth: &[Turn]) -> f64 {
        let gauge = truth[0] * found[0].inverse();
        let pairs = found.iter().zip(truth);
        pairs
            .map(|(a, b)| log(&((gauge * a).inverse() * b)).norm())
            .fold(0.0, f64::max)
    }

    #[test]
    fn links_that_agree_are_met_exactly() {
        let (graph, truth) = ring(40);
        let mut found = vec![Turn::identity(); 40];
        graph.solve(&relative(&graph, &truth), &|_| true, &mut found);
        assert!(worst(&found, &truth) < 1e-13);
    }

    #[test]
    fn a_disagreement_around_a_loop_is_spread_evenly() {
        // ten nodes in a ring, every link asks for a tenth of a turn and a little more
        let n = 10;
        let links = (0..n as u32).map(|i| [i, (i + 1) % n as u32]).collect();
        let graph = RotationGraph::new(n, links, vec![1.0; n]).unwrap();
        let step = exp(&Vector3::new(0.0, 0.0, std::f64::consts::TAU / 10.0 + 0.02));
        let mut found = vec![Turn::identity(); n];
        graph.solve(&vec![step; n], &|_| true, &mut found);
        for i in 0..n {
            let angle = log(&(found[i].inverse() * found[(i + 1) % n])).norm();
            assert!((angle - std::f64::consts::TAU / 10.0).abs() < 1e-9);
        }
    }

    #[test]
    fn links_without_trust_do_no_harm() {
        let (graph, truth) = ring(40);
        let mut turns = relative(&graph, &truth);
        for link in (0..turns.len()).step_by(5) {
            turns[link] = exp(&Vector3::new(1.0, 2.0, 0.5));
        }
        let mut found = vec![Turn::identity(); 40];
        graph.solve(&turns, &|link| link % 5 != 0, &mut found);
        assert!(worst(&found, &truth) < 1e-13);
    }

    #[test]
    fn parts_and_lone_nodes_each_start_at_the_identity() {
        let links = vec![[1, 2], [3, 3]];
        let graph = RotationGraph::new(4, links, vec![1.0, 1.0]).unwrap();
        let turn = exp(&Vector3::new(0.4, 0.0, 0.0));
        let mut found = vec![turn; 4];
        graph.solve(&[turn, turn], &|_| true, &mut found);
        for (node, expected) in [(0, Turn::identity()), (1, Turn::identity()), (2, turn)] {
            assert!(log(&(found[node].inverse() * expected)).norm() < 1e-15);
        }
    }
}
