//! Positions whose edge lengths and dihedral angles come nearest given ones: Gauss-Newton on
//! sum w^2 (l - l*)^2 + sum w^2 (theta - theta*)^2 over 3V coordinates, damped (Levenberg-Marquardt) so
//! that what lengths and angles leave free stays. The normal equations are sparse; their pattern is
//! analysed once.

use std::f64::consts::TAU;
use std::sync::Arc;

use nalgebra::{Matrix3, Vector3};

use super::placement::triple;
use crate::math::sparse::{Analysis, Factor, Pattern, SparseError};
use crate::mesh::dihedral::{signed_angle, wing_gradient};

/// Steps at most; most blends need three or four.
const STEPS: usize = 12;

/// A step that gains less than this part of what is left ends the iteration.
const GAIN: f64 = 1e-3;

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
    analysis: Arc<Analysis>,
}

/// One row of the Jacobian: a residual and its gradient at up to four vertices.
struct Row {
    residual: f64,
    gradient: [(u32, Vector3<f64>); 4],
    vertices: usize,
}

impl Refine {
    /// Analyses the normal equations.
    pub(super) fn new(
        vertices: usize,
        spans: Vec<Span>,
        folds: Vec<Fold>,
    ) -> Result<Self, SparseError> {
        let mut pairs: Vec<[u32; 2]> = (0..vertices as u32).map(|v| [v, v]).collect();
        pairs.extend(spans.iter().map(|span| span.ends));
        for fold in &folds {
            let [c, d] = fold.wings;
            pairs.push([c, d]);
            pairs.extend(fold.ends.iter().flat_map(|&end| [[end, c], [end, d]]));
        }
        let entries = pairs
            .iter()
            .flat_map(|&[a, b]| (0..9).map(move |entry| [3 * a + entry / 3, 3 * b + entry % 3]));
        Ok(Refine {
            analysis: Analysis::new(Pattern::new(3 * vertices, entries))?,
            spans,
            folds,
        })
    }

    /// Moves `positions` until lengths and angles are met as well as can be; tells whether it moved
    /// them.
    pub(super) fn run(
        &self,
        length: &dyn Fn(usize) -> f64,
        angle: &dyn Fn(usize) -> f64,
        positions: &mut [f64],
    ) -> bool {
        let size: f64 = (0..self.spans.len())
            .map(|edge| (self.spans[edge].weight * length(edge)).powi(2))
            .sum();
        let mut cost = self.cost(length, angle, positions);
        // met to seven digits of the lengths: a shape's own coordinates
        if cost.is_nan() || cost <= 1e-14 * size {
            return false;
        }
        let mut damping = 1e-6;
        let mut factor: Option<Factor> = None;
        let mut moved = false;
        for _ in 0..STEPS {
            let (mut entries, mut step) = self.normal_equations(length, angle, positions);
            self.damp(&mut entries, damping);
            let factored = match factor.as_mut() {
                Some(factor) => factor.refactor(&entries),
                None => self
                    .analysis
                    .factor(&entries)
                    .map(|made| factor = Some(made)),
            };
            let Some(factor) = factor.as_ref().filter(|_| factored.is_ok()) else {
                damping *= 100.0;
                continue;
            };
            factor.solve(1, &mut step);
            let trial: Vec<f64> = positions.iter().zip(&step).map(|(x, d)| x + d).collect();
            let found = self.cost(length, angle, &trial);
            if found >= cost || found.is_nan() {
                damping *= 10.0;
                continue;
            }
            let gain = (cost - found) / cost;
            positions.copy_from_slice(&trial);
            (cost, moved) = (found, true);
            damping = (damping * 0.1).max(1e-9);
            if gain < GAIN {
                break;
            }
        }
        moved
    }

    fn cost(
        &self,
        length: &dyn Fn(usize) -> f64,
        angle: &dyn Fn(usize) -> f64,
        positions: &[f64],
    ) -> f64 {
        let spans = self.spans.iter().enumerate();
        let folds = self.folds.iter().enumerate();
        let spans = spans.filter_map(|(at, span)| span_row(span, length(at), positions));
        let folds = folds.filter_map(|(at, fold)| fold_row(fold, angle(at), positions));
        spans
            .chain(folds)
            .map(|row| row.residual * row.residual)
            .sum()
    }

    /// J^T J and -J^T r.
    fn normal_equations(
        &self,
        length: &dyn Fn(usize) -> f64,
        angle: &dyn Fn(usize) -> f64,
        positions: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let mut entries = vec![0.0; self.analysis.pattern().entries()];
        let mut side = vec![0.0; positions.len()];
        for (at, span) in self.spans.iter().enumerate() {
            if let Some(row) = span_row(span, length(at), positions) {
                self.add(&row, &mut entries, &mut side);
            }
        }
        for (at, fold) in self.folds.iter().enumerate() {
            if let Some(row) = fold_row(fold, angle(at), positions) {
                self.add(&row, &mut entries, &mut side);
            }
        }
        (entries, side)
    }

    fn add(&self, row: &Row, entries: &mut [f64], side: &mut [f64]) {
        let gradient = &row.gradient[..row.vertices];
        for (at, (i, a)) in gradient.iter().enumerate() {
            for axis in 0..3 {
                side[3 * *i as usize + axis] -= row.residual * a[axis];
            }
            for (j, b) in &gradient[at..] {
                let (high, low, block) = match i >= j {
                    true => (*i, *j, a * b.transpose()),
                    false => (*j, *i, b * a.transpose()),
                };
                self.add_block(high as usize, low as usize, &block, entries);
            }
        }
    }

    /// Adds the block of the vertices `high` >= `low`; the rows of a vertex stand together in a column.
    fn add_block(&self, high: usize, low: usize, block: &Matrix3<f64>, entries: &mut [f64]) {
        let pattern = self.analysis.pattern();
        for column in 0..3 {
            let first = if high == low { column } else { 0 };
            if let Some(start) = pattern.entry(3 * high + first, 3 * low + column) {
                for row in first..3 {
                    entries[start + row - first] += block[(row, column)];
                }
            }
        }
    }

    /// Adds a part of the mean diagonal to the diagonal.
    fn damp(&self, entries: &mut [f64], part: f64) {
        let pattern = self.analysis.pattern();
        let diagonal: Vec<usize> = (0..pattern.unknowns())
            .filter_map(|i| pattern.entry(i, i))
            .collect();
        let trace: f64 = diagonal.iter().map(|&at| entries[at]).sum();
        let mean = trace / diagonal.len().max(1) as f64;
        let spring = part * if mean > 0.0 { mean } else { 1.0 };
        diagonal.into_iter().for_each(|at| entries[at] += spring);
    }
}

fn span_row(span: &Span, target: f64, positions: &[f64]) -> Option<Row> {
    let [a, b] = span.ends;
    let e = triple(positions, b as usize) - triple(positions, a as usize);
    let length = e.norm();
    let along = e * (span.weight / length);
    (length > 0.0).then_some(Row {
        residual: span.weight * (length - target),
        gradient: [
            (a, -along),
            (b, along),
            (a, Vector3::zeros()),
            (a, Vector3::zeros()),
        ],
        vertices: 2,
    })
}

fn fold_row(fold: &Fold, target: f64, positions: &[f64]) -> Option<Row> {
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
    Some(Row {
        residual: w * (off - TAU * libm::round(off / TAU)),
        gradient: [
            (a, (second[0] - first[0]) * w),
            (b, (second[1] - first[1]) * w),
            (c, first[2] * -w),
            (d, second[2] * w),
        ],
        vertices: 4,
    })
}
