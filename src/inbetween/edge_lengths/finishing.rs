//! The finishing solve: positions whose edge lengths come nearest given ones, from a close start.
//!
//! Minimises sum ((l - l*) / l*)^2 by damped Newton steps on 3V coordinates. Of each edge's second
//! derivative the part that pulls it together is kept, (1 - l*/l)(I - e e^T) where l > l*, and the part
//! that would let it buckle is left out: the matrix stays positive definite. The damping is a soft spring
//! along each edge in all directions: it holds back what makes a linear step wrong, edges that turn (an
//! error of half the squared turn), and lets large parts move freely, which a damping of positions does not
//! (it took three times the steps and left crumpled regions).

use nalgebra::Matrix3;

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

/// Below this relative error (root mean square) a step that gains less than this part ends it: lengths that
/// a shape has are by then met ten times better a step, and others cannot be met much better.
const NEAR: f64 = 2e-6;
const SLOW: f64 = 0.75;

/// Holds what edges leave free altogether (motions of a whole part), in parts of the mean diagonal.
const GAUGE: f64 = 1e-12;

/// Damping, in parts of each edge's stiffness: at the start, least and most.
const DAMPING: [f64; 3] = [1e-6, 1e-9, 1e4];

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
        edges: &[[u32; 2]],
        lengths: &[f64],
        positions: &mut [f64],
        kept: &mut Option<Factor>,
    ) -> usize {
        let weights = weights(lengths);
        let mut cost = cost(edges, lengths, &weights, positions);
        let enough = MET * MET * edges.len() as f64;
        let mut damping = DAMPING[0];
        let (mut steps, mut idle, mut refused) = (0, 0, false);
        while cost > enough && steps < STEPS && damping <= DAMPING[2] {
            steps += 1;
            let step = self.step(edges, lengths, &weights, positions, damping, kept);
            let trial = step.map(|step| -> Vec<f64> {
                positions.iter().zip(&step).map(|(x, d)| x - d).collect()
            });
            let found = trial
                .as_ref()
                .map(|x| self::cost(edges, lengths, &weights, x));
            let (Some(trial), Some(found)) = (trial, found.filter(|&found| found < cost)) else {
                damping *= 10.0;
                refused = true;
                continue;
            };
            let gain = (cost - found) / cost;
            positions.copy_from_slice(&trial);
            cost = found;
            // a step that was refused before is not tried again at once
            damping = (damping * if refused { 1.0 } else { 0.1 }).max(DAMPING[1]);
            refused = false;
            idle = if gain < GAIN { idle + 1 } else { 0 };
            let near = NEAR * NEAR * edges.len() as f64;
            if idle == IDLE || (cost < near && gain < SLOW) {
                break;
            }
        }
        steps
    }

    fn step(
        &self,
        edges: &[[u32; 2]],
        lengths: &[f64],
        weights: &[f64],
        positions: &[f64],
        damping: f64,
        kept: &mut Option<Factor>,
    ) -> Option<Vec<f64>> {
        let mut entries = vec![0.0; self.pattern.analysis().pattern().entries()];
        let mut side = vec![0.0; positions.len()];
        for (edge, &[a, b]) in edges.iter().enumerate() {
            let e = point(positions, b) - point(positions, a);
            let length = e.norm();
            if length == 0.0 {
                continue;
            }
            let (e, weight) = (e / length, weights[edge]);
            let off = length - lengths[edge];
            let pull = e * (weight * off);
            for axis in 0..3 {
                side[3 * a as usize + axis] -= pull[axis];
                side[3 * b as usize + axis] += pull[axis];
            }
            let along = e * e.transpose();
            let across = (Matrix3::identity() - along) * (off / length).max(0.0);
            let block = (along + across + Matrix3::from_diagonal_element(damping)) * weight;
            self.pattern.add_node(&mut entries, a as usize, &block);
            self.pattern.add_node(&mut entries, b as usize, &block);
            self.pattern.add_link(&mut entries, edge, &-block);
        }
        let shift = GAUGE * self.pattern.mean_diagonal(&entries);
        self.pattern.shift(&mut entries, shift);
        match kept {
            Some(factor) => factor.refactor(&entries).ok()?,
            None => *kept = Some(self.pattern.analysis().factor(&entries).ok()?),
        }
        kept.as_ref()?.solve(1, &mut side);
        Some(side)
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

fn cost(edges: &[[u32; 2]], lengths: &[f64], weights: &[f64], positions: &[f64]) -> f64 {
    let each = edges.iter().zip(lengths).zip(weights);
    each.map(|((&[a, b], length), weight)| {
        let off = (point(positions, b) - point(positions, a)).norm() - length;
        weight * off * off
    })
    .sum()
}
