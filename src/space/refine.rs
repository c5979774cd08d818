//! Positions whose edge lengths and dihedral angles come nearest given ones: Gauss-Newton on
//! sum w^2 (l - l*)^2 + sum w^2 (theta - theta*)^2 over 3V coordinates, damped (Levenberg-Marquardt) so
//! that what lengths and angles leave free stays. The normal equations are sparse; their pattern is
//! analysed once.

use std::f64::consts::TAU;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::placement::triple;
use crate::math::block_sparse::BlockPattern;
use crate::math::sparse::{Factor, SparseError};
use crate::mesh::dihedral::{signed_angle, wing_gradient};

/// Steps at most; most blends need three or four.
const STEPS: usize = 12;

/// A step that gains less than this part of what is left ends the iteration.
const GAIN: f64 = 1e-3;

/// Damping, in parts of the mean diagonal: at the start and at least.
const DAMPING: [f64; 2] = [1e-6, 1e-9];

/// A refused step raises the damping by this.
const FIRMER: f64 = 1e3;

/// So many refused steps in a row end the iteration: residuals are not nearly linear (folded slivers), and
/// on horse-gallop the ten steps that follow move nothing that can be seen.
const REFUSED: usize = 2;

/// Rows that one thread takes at a time.
const CHUNK: usize = 1024;

/// An edge whose length is prescribed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub(super) ends: [u32; 2],
    pub(super) weight: f64,
}

/// A hinge whose angle is prescribed: from the first triangle's normal to the second's about the edge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fold {
    pub(super) ends: [u32; 2],
    /// The third corners of the two triangles.
    pub(super) wings: [u32; 2],
    /// Whether a triangle's own normal is opposite to that of (first end, second end, wing).
    pub(super) flips: [bool; 2],
    pub(super) weight: f64,
}

/// The least-squares problem of one connectivity.
pub(super) struct Refine {
    spans: Vec<Span>,
    folds: Vec<Fold>,
    pattern: BlockPattern,
    /// The link of each span, and those of each fold in the order of [`PAIRS`].
    links: (Vec<u32>, Vec<[u32; 6]>),
}

/// The pairs among four vertices.
const PAIRS: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// What is sought.
pub(super) struct Wanted<'a> {
    pub(super) length: &'a (dyn Fn(usize) -> f64 + Sync),
    pub(super) angle: &'a (dyn Fn(usize) -> f64 + Sync),
}

/// A residual and its gradient at N vertices.
type Row<const N: usize> = (f64, [Vector3<f64>; N]);

impl Fold {
    fn vertices(&self) -> [u32; 4] {
        let ([a, b], [c, d]) = (self.ends, self.wings);
        [a, b, c, d]
    }
}

impl Refine {
    /// Analyses the normal equations.
    pub(super) fn new(
        vertices: usize,
        spans: Vec<Span>,
        folds: Vec<Fold>,
    ) -> Result<Self, SparseError> {
        let ascending = |[a, b]: [u32; 2]| [a.min(b), a.max(b)];
        let pairs_of = |fold: &Fold| {
            let corners = fold.vertices();
            PAIRS.map(|pair| ascending(pair.map(|at| corners[at])))
        };
        let mut pairs: Vec<[u32; 2]> = spans.iter().map(|span| ascending(span.ends)).collect();
        pairs.extend(folds.iter().flat_map(pairs_of));
        pairs.par_sort_unstable();
        pairs.dedup();
        let find = |pair: [u32; 2]| pairs.partition_point(|other| *other < pair) as u32;
        let of_span = |span: &Span| find(ascending(span.ends));
        Ok(Refine {
            pattern: BlockPattern::new(vertices, &pairs)?,
            links: (
                spans.iter().map(of_span).collect(),
                folds.iter().map(|fold| pairs_of(fold).map(find)).collect(),
            ),
            spans,
            folds,
        })
    }

    /// Moves `positions` until lengths and angles are met as well as can be; tells whether it moved
    /// them.
    pub(super) fn run(&self, wanted: &Wanted, positions: &mut [f64]) -> bool {
        let size: f64 = (0..self.spans.len())
            .map(|edge| (self.spans[edge].weight * (wanted.length)(edge)).powi(2))
            .sum();
        let mut cost = self.cost(wanted, positions);
        // met to seven digits of the lengths: a shape's own coordinates
        if cost.is_nan() || cost <= 1e-14 * size {
            return false;
        }
        let [mut damping, least] = DAMPING;
        let mut factor: Option<Factor> = None;
        let (mut moved, mut refused) = (false, 0);
        for _ in 0..STEPS {
            let trial = self.step(wanted, positions, damping, &mut factor);
            let found = trial.as_ref().map(|trial| self.cost(wanted, trial));
            let (Some(trial), Some(found)) = (trial, found.filter(|&found| found < cost)) else {
                refused += 1;
                if refused == REFUSED {
                    break;
                }
                damping *= FIRMER;
                continue;
            };
            let gain = (cost - found) / cost;
            positions.copy_from_slice(&trial);
            (cost, moved, refused) = (found, true, 0);
            damping = (damping * 0.1).max(least);
            if gain < GAIN {
                break;
            }
        }
        moved
    }

    /// Positions after one damped step; none where the system has no factor.
    fn step(
        &self,
        wanted: &Wanted,
        positions: &[f64],
        damping: f64,
        factor: &mut Option<Factor>,
    ) -> Option<Vec<f64>> {
        let (mut entries, mut step) = self.normal_equations(wanted, positions);
        let spring = damping * self.pattern.mean_diagonal(&entries);
        self.pattern.shift(&mut entries, spring);
        match factor {
            Some(factor) => factor.refactor(&entries).ok()?,
            None => *factor = Some(self.pattern.analysis().factor(&entries).ok()?),
        }
        factor.as_ref()?.solve(1, &mut step);
        step.iter_mut().zip(positions).for_each(|(d, x)| *d += x);
        Some(step)
    }

    fn cost(&self, wanted: &Wanted, positions: &[f64]) -> f64 {
        let (spans, folds) = self.rows(wanted, positions);
        let spans = spans.iter().flatten().map(|row| row.0 * row.0);
        let folds = folds.iter().flatten().map(|row| row.0 * row.0);
        spans.chain(folds).sum()
    }

    /// All rows of the Jacobian; none where a length or an angle has no gradient.
    fn rows(
        &self,
        wanted: &Wanted,
        positions: &[f64],
    ) -> (Vec<Option<Row<2>>>, Vec<Option<Row<4>>>) {
        let spans = self.spans.par_iter().enumerate().with_min_len(CHUNK);
        let folds = self.folds.par_iter().enumerate().with_min_len(CHUNK);
        (
            spans
                .map(|(at, span)| span_row(span, (wanted.length)(at), positions))
                .collect(),
            folds
                .map(|(at, fold)| fold_row(fold, (wanted.angle)(at), positions))
                .collect(),
        )
    }

    /// J^T J and -J^T r.
    fn normal_equations(&self, wanted: &Wanted, positions: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut entries = vec![0.0; self.pattern.analysis().pattern().entries()];
        let mut side = vec![0.0; positions.len()];
        let (spans, folds) = self.rows(wanted, positions);
        let rows = self.spans.iter().zip(&spans).zip(&self.links.0);
        for ((span, row), &link) in rows {
            if let Some(row) = row {
                self.add(row, span.ends, [link], &mut entries, &mut side);
            }
        }
        let rows = self.folds.iter().zip(&folds).zip(&self.links.1);
        for ((fold, row), &links) in rows {
            if let Some(row) = row {
                self.add(row, fold.vertices(), links, &mut entries, &mut side);
            }
        }
        (entries, side)
    }

    fn add<const N: usize, const L: usize>(
        &self,
        (residual, gradient): &Row<N>,
        vertices: [u32; N],
        links: [u32; L],
        entries: &mut [f64],
        side: &mut [f64],
    ) {
        for (&vertex, a) in vertices.iter().zip(gradient) {
            let vertex = vertex as usize;
            for axis in 0..3 {
                side[3 * vertex + axis] -= residual * a[axis];
            }
            self.pattern.add_node(entries, vertex, &(a * a.transpose()));
        }
        for (link, [i, j]) in links.into_iter().zip(PAIRS) {
            let (first, second) = if vertices[i] <= vertices[j] {
                (i, j)
            } else {
                (j, i)
            };
            let block = gradient[first] * gradient[second].transpose();
            self.pattern.add_link(entries, link as usize, &block);
        }
    }
}

fn span_row(span: &Span, target: f64, positions: &[f64]) -> Option<Row<2>> {
    let [a, b] = span.ends;
    let e = triple(positions, b as usize) - triple(positions, a as usize);
    let length = e.norm();
    let along = e * (span.weight / length);
    (length > 0.0).then_some((span.weight * (length - target), [-along, along]))
}

fn fold_row(fold: &Fold, target: f64, positions: &[f64]) -> Option<Row<4>> {
    let point = |vertex: u32| triple(positions, vertex as usize);
    let ([a, b], [c, d]) = (fold.ends, fold.wings);
    let e = point(b) - point(a);
    let first = wing_gradient(&point(a), &point(b), &point(c))?;
    let second = wing_gradient(&point(a), &point(b), &point(d))?;
    let [n, m] = [(c, fold.flips[0]), (d, fold.flips[1])].map(|(wing, flip)| {
        let normal = e.cross(&(point(wing) - point(a))).normalize();
        if flip { -normal } else { normal }
    });
    let off = signed_angle(&e.normalize(), &n, &m) - target;
    let w = fold.weight;
    let gradient = [
        (second[0] - first[0]) * w,
        (second[1] - first[1]) * w,
        first[2] * -w,
        second[2] * w,
    ];
    Some((w * (off - TAU * libm::round(off / TAU)), gradient))
}
