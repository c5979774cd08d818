//! The finishing solve: positions whose edge lengths come nearest given ones, from a close start.
//!
//! Minimises sum ((l - l*) / l*)^2 by damped Gauss-Newton steps on 3V coordinates. Second derivatives of the
//! edges are left out: the part that pulls an edge together where l > l* keeps the matrix positive definite
//! and helps where lengths are far off, but near the end it holds soft bends back much more firmly than their
//! own stiffness (an arm of 10,000 vertices took twice the steps). The damping is a soft spring
//! along each edge in all directions: it holds back what makes a linear step wrong, edges that turn (an
//! error of half the squared turn), and lets large parts move freely, which a damping of positions does not
//! (it took three times the steps and left crumpled regions).

use nalgebra::Matrix3;

use super::damping::Damping;
use super::shape::point;
use crate::math::block_sparse::BlockPattern;
use crate::math::sparse::Factor;

/// Steps at most; lengths of a real shape need three or four.
const STEPS: usize = 20;

/// Edges shorter than this part of the mean count as this long where errors are divided by lengths.
const SHORT: f64 = 1e-3;

/// Met to this relative error (root mean square), a hundredth of what is asked of the worst edge.
const MET: f64 = 1e-6;

/// This many steps in a row that each gain less than this part of what is left end the iteration.
const IDLE: usize = 3;
const GAIN: f64 = 0.05;

/// Where the worst edge is within this relative error, what is asked of it, a step that gains less than this
/// part ends the iteration: lengths that a shape has are by then met ten times better a step. What is left
/// of others cannot be seen, and following it down took most of the steps of a frame beside a known one.
const UNSEEN: f64 = 1e-4;
const SLOW: f64 = 0.75;

/// Holds what edges leave free altogether (motions of a whole part), in parts of the mean diagonal.
const GAUGE: f64 = 1e-12;

/// Damping, in parts of each edge's stiffness: at the start, least and most.
const DAMPING: [f64; 3] = [1e-6, 1e-9, 1e4];

/// What positions should have.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wanted<'a> {
    /// The two vertices of each edge.
    pub(super) edges: &'a [[u32; 2]],
    /// Its length.
    pub(super) lengths: &'a [f64],
    /// A place to stay near.
    pub(super) spring: Option<Spring<'a>>,
}

/// Adds `stiffness` |x - anchor|^2 to what is minimised.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring<'a> {
    pub(super) anchor: &'a [f64],
    pub(super) stiffness: f64,
}

/// The least-squares problem of one connectivity.
#[derive(Debug)]
pub(super) struct Finisher {
    /// The vertices as nodes, the edges as links.
    pattern: BlockPattern,
}

impl Finisher {
    /// `pattern` has the vertices as nodes and the edges as links.
    pub(super) fn new(pattern: BlockPattern) -> Self {
        Finisher { pattern }
    }

    /// Moves `positions` until the lengths are met as well as can be; gives the number of
    /// factorisations.
    pub(super) fn finish(
        &self,
        wanted: &Wanted,
        positions: &mut [f64],
        kept: &mut Option<Factor>,
    ) -> usize {
        let weights = weights(wanted.lengths);
        let misfit = |positions: &[f64]| Misfit::new(wanted, &weights, positions);
        let mut left = misfit(positions);
        let enough = MET * MET * wanted.edges.len() as f64;
        let met = |left: &Misfit| left.cost <= enough && left.worst <= UNSEEN;
        let mut damping = Damping::new(DAMPING);
        let (mut steps, mut idle) = (0, 0);
        while !met(&left) && steps < STEPS && !damping.spent() && idle < IDLE {
            steps += 1;
            let step = self.step(wanted, &weights, positions, damping.value(), kept);
            let better = step
                .map(|(step, promised)| {
                    let moved = positions.iter().zip(&step).map(|(x, d)| x - d);
                    let moved: Vec<f64> = moved.collect();
                    (misfit(&moved), moved, promised)
                })
                .filter(|(found, ..)| found.cost < left.cost);
            let mut gain = 0.0;
            match better {
                Some((found, moved, promised)) => {
                    positions.copy_from_slice(&moved);
                    gain = (left.cost - found.cost) / left.cost;
                    damping.taken((left.cost - found.cost) / promised);
                    left = found;
                    idle = if gain < GAIN { idle + 1 } else { 0 };
                }
                None => damping.refused(),
            }
            if left.worst <= UNSEEN && gain < SLOW {
                break;
            }
        }
        steps
    }

    fn step(
        &self,
        wanted: &Wanted,
        weights: &[f64],
        positions: &[f64],
        damping: f64,
        kept: &mut Option<Factor>,
    ) -> Option<(Vec<f64>, f64)> {
        let mut entries = vec![0.0; self.pattern.analysis().pattern().entries()];
        let mut side = vec![0.0; positions.len()];
        for (edge, &[a, b]) in wanted.edges.iter().enumerate() {
            let e = point(positions, b) - point(positions, a);
            let length = e.norm();
            if length == 0.0 {
                continue;
            }
            let (e, weight) = (e / length, weights[edge]);
            let off = length - wanted.lengths[edge];
            let pull = e * (weight * off);
            for axis in 0..3 {
                side[3 * a as usize + axis] -= pull[axis];
                side[3 * b as usize + axis] += pull[axis];
            }
            let along = e * e.transpose();
            let block = (along + Matrix3::from_diagonal_element(damping)) * weight;
            self.pattern.add_node(&mut entries, a as usize, &block);
            self.pattern.add_node(&mut entries, b as usize, &block);
            self.pattern.add_link(&mut entries, edge, &-block);
        }
        let shift = GAUGE * self.pattern.mean_diagonal(&entries);
        self.pattern.shift(&mut entries, shift);
        if let Some(Spring { anchor, stiffness }) = wanted.spring {
            self.pattern.shift(&mut entries, stiffness);
            for ((side, x), anchor) in side.iter_mut().zip(positions).zip(anchor) {
                *side += stiffness * (x - anchor);
            }
        }
        match kept {
            Some(factor) => factor.refactor(&entries).ok()?,
            None => *kept = Some(self.pattern.analysis().factor(&entries).ok()?),
        }
        let pull = side.clone();
        kept.as_ref()?.solve(1, &mut side);
        // of a linear problem the step along d would take away d . pull and more
        let promised = side.iter().zip(&pull).map(|(d, p)| d * p).sum();
        Some((side, promised))
    }
}

/// 1 / l*^2, short edges counted longer.
fn weights(lengths: &[f64]) -> Vec<f64> {
    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
    let least = SHORT * mean;
    let weight = |&length: &f64| {
        let length = length.max(least);
        if length > 0.0 {
            1.0 / (length * length)
        } else {
            1.0
        }
    };
    lengths.iter().map(weight).collect()
}

/// How far lengths are from those asked for, short edges counted longer.
struct Misfit {
    /// The sum of the squared relative errors, and what the spring adds.
    cost: f64,
    /// The largest relative error.
    worst: f64,
}

impl Misfit {
    fn new(wanted: &Wanted, weights: &[f64], positions: &[f64]) -> Self {
        let each = wanted.edges.iter().zip(wanted.lengths).zip(weights);
        let squares = each.map(|((&[a, b], length), weight)| {
            let off = (point(positions, b) - point(positions, a)).norm() - length;
            weight * off * off
        });
        let (mut cost, mut largest) = (0.0, 0.0_f64);
        for square in squares {
            cost += square;
            largest = largest.max(square);
        }
        if let Some(Spring { anchor, stiffness }) = wanted.spring {
            let pairs = positions.iter().zip(anchor);
            cost += stiffness * pairs.map(|(x, a)| (x - a) * (x - a)).sum::<f64>();
        }
        Misfit {
            cost,
            worst: largest.sqrt(),
        }
    }
}
