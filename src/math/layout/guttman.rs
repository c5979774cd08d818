//! The stress and the Guttman transform of one layout: a square root and a division for each pair.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use super::{Distances, LayoutError, free_inverse, row_start};
use crate::math::b_spline::Point;

/// From so many positions on, the pairs are shared out among threads, in so many parts of about equal
/// size (fixed, so that the sums are).
const PARALLEL_FROM: usize = 400;
const PARTS: usize = 8;

/// A layout, its stress, and its Guttman transform; coordinates are all x, then all y.
#[derive(Debug, Clone)]
pub(super) struct Step {
    pub(super) at: Vec<f64>,
    pub(super) to: Vec<f64>,
    pub(super) stress: f64,
}

impl Step {
    pub(super) fn positions(&self) -> Vec<Point> {
        let (x, y) = self.at.split_at(self.at.len() / 2);
        x.iter().zip(y).map(|(&x, &y)| [x, y]).collect()
    }
}

/// What does not change from step to step, and room for the sums.
pub(super) struct Guttman<'a> {
    distances: &'a Distances,
    weights: Option<&'a [f64]>,
    pins: &'a [(usize, Point)],
    free: Vec<usize>,
    /// V_ff^-1, for weights that are not all 1.
    inverse: Option<Mat<f64>>,
    parts: Vec<Part>,
    arch: Arch,
}

/// Rows of the upper half, and the sums over their pairs.
struct Part {
    rows: Range<usize>,
    /// (B q) of these pairs, all x, then all y.
    sums: Vec<f64>,
    stress: f64,
}

impl<'a> Guttman<'a> {
    pub(super) fn new(
        distances: &'a Distances,
        weights: Option<&'a [f64]>,
        pins: &'a [(usize, Point)],
    ) -> Result<Self, LayoutError> {
        let n = distances.count();
        let mut held = vec![false; n];
        pins.iter().for_each(|&(frame, _)| held[frame] = true);
        let free: Vec<usize> = (0..n).filter(|&i| !held[i]).collect();
        let inverse = match weights {
            Some(weights) => {
                Some(free_inverse(distances, weights, &free).ok_or(LayoutError::Loose)?)
            }
            None => None,
        };
        let parts = parts(n).into_iter().map(|rows| Part {
            rows,
            sums: vec![0.0; 2 * n],
            stress: 0.0,
        });
        Ok(Guttman {
            distances,
            weights,
            pins,
            free,
            inverse,
            parts: parts.collect(),
            arch: Arch::new(),
        })
    }

    /// The first step: `start` with the pins where they belong; with none, about the origin.
    pub(super) fn begin(&mut self, start: &[Point]) -> Step {
        let shift = if self.pins.is_empty() {
            super::centre(start.iter())
        } else {
            [0.0, 0.0]
        };
        let mut at: Vec<f64> = start.iter().map(|p| p[0] - shift[0]).collect();
        at.extend(start.iter().map(|p| p[1] - shift[1]));
        self.hold(&mut at);
        self.at(at)
    }

    /// The stress and the transform at these coordinates.
    pub(super) fn at(&mut self, at: Vec<f64>) -> Step {
        let (distances, weights, arch) = (self.distances, self.weights, self.arch);
        let add = |part: &mut Part| {
            part.sums.fill(0.0);
            part.stress = arch.dispatch(Pairs {
                at: &at,
                distances,
                weights,
                part,
            });
        };
        if self.parts.len() > 1 {
            self.parts.par_iter_mut().for_each(add);
        } else {
            self.parts.iter_mut().for_each(add);
        }
        let stress = self.parts.iter().map(|part| part.stress).sum();
        let mut to = vec![0.0; at.len()];
        for part in &self.parts {
            to.iter_mut()
                .zip(&part.sums)
                .for_each(|(total, sum)| *total += sum);
        }
        self.solve(&mut to);
        self.hold(&mut to);
        Step { at, to, stress }
    }

    /// The stress of all positions in one point: sum w delta^2.
    pub(super) fn whole(&self) -> f64 {
        let squares = self
            .distances
            .values()
            .iter()
            .map(|distance| distance * distance);
        match self.weights {
            Some(weights) => squares
                .zip(weights)
                .map(|(square, weight)| square * weight)
                .sum(),
            None => squares.sum(),
        }
    }

    fn hold(&self, coordinates: &mut [f64]) {
        let n = self.distances.count();
        for &(frame, [x, y]) in self.pins {
            (coordinates[frame], coordinates[n + frame]) = (x, y);
        }
    }

    /// V_ff p_f = u_f - V_fh p_h; what comes back for held positions is of no meaning.
    fn solve(&self, u: &mut [f64]) {
        let n = self.distances.count();
        for axis in 0..2 {
            let u = &mut u[axis * n..(axis + 1) * n];
            match (&self.inverse, self.weights) {
                (Some(inverse), Some(weights)) => self.solve_weighted(inverse, weights, u, axis),
                _ => self.solve_plain(u, axis),
            }
        }
    }

    fn solve_plain(&self, u: &mut [f64], axis: usize) {
        let count = u.len() as f64;
        let held: f64 = self.pins.iter().map(|(_, pin)| pin[axis]).sum();
        if self.pins.is_empty() {
            u.iter_mut().for_each(|u| *u /= count);
            return;
        }
        let sum: f64 = self.free.iter().map(|&i| u[i] + held).sum();
        let mean = sum / self.pins.len() as f64;
        self.free
            .iter()
            .for_each(|&i| u[i] = (u[i] + held + mean) / count);
    }

    fn solve_weighted(&self, inverse: &Mat<f64>, weights: &[f64], u: &mut [f64], axis: usize) {
        let n = u.len();
        let weight = |i: usize, j: usize| weights[row_start(n, i.min(j)) + i.abs_diff(j) - 1];
        let pull = |i: usize| {
            let pins = self.pins.iter();
            pins.map(|&(h, pin)| weight(i, h) * pin[axis]).sum::<f64>()
        };
        let right: Vec<f64> = self.free.iter().map(|&i| u[i] + pull(i)).collect();
        let mut left = vec![0.0; right.len()];
        matmul(
            MatMut::from_column_major_slice_mut(&mut left, right.len(), 1),
            Accum::Replace,
            inverse.as_ref(),
            MatRef::from_column_major_slice(&right, right.len(), 1),
            1.0,
            Par::Seq,
        );
        self.free
            .iter()
            .zip(left)
            .for_each(|(&i, left)| u[i] = left);
    }
}

/// The rows 0..n in parts with about the same number of pairs.
fn parts(n: usize) -> Vec<Range<usize>> {
    let count = if n < PARALLEL_FROM { 1 } else { PARTS };
    let pairs = n * n.saturating_sub(1) / 2;
    let mut ends = (1..=count).map(|part| part * pairs / count).peekable();
    let (mut found, mut start) = (Vec::new(), 0);
    for i in 0..n {
        if ends.next_if(|&end| row_start(n, i + 1) >= end).is_some() {
            found.push(start..i + 1);
            start = i + 1;
        }
    }
    found
}

/// Sums over the pairs of a part's rows, in vectors.
struct Pairs<'a> {
    at: &'a [f64],
    distances: &'a Distances,
    weights: Option<&'a [f64]>,
    part: &'a mut Part,
}

impl WithSimd for Pairs<'_> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let n = self.distances.count();
        let (x, y) = self.at.split_at(n);
        let (bx, by) = self.part.sums.split_at_mut(n);
        let mut stress = simd.splat_f64s(0.0);
        for i in self.part.rows.clone() {
            let start = row_start(n, i);
            let row = start..start + n - 1 - i;
            let (bx_i, bx) = bx[i..].split_at_mut(1);
            let (by_i, by) = by[i..].split_at_mut(1);
            let mut row = Row {
                at: [simd.splat_f64s(x[i]), simd.splat_f64s(y[i])],
                sums: [simd.splat_f64s(0.0); 2],
                stress,
                others: [&x[i + 1..], &y[i + 1..]],
                distances: &self.distances.values()[row.clone()],
                weights: self.weights.map(|weights| &weights[row]),
                bx,
                by,
            };
            row.add(simd);
            stress = row.stress;
            bx_i[0] += simd.reduce_sum_f64s(row.sums[0]);
            by_i[0] += simd.reduce_sum_f64s(row.sums[1]);
        }
        simd.reduce_sum_f64s(stress)
    }
}

/// One position against those after it.
struct Row<'a, S: Simd> {
    at: [S::f64s; 2],
    sums: [S::f64s; 2],
    stress: S::f64s,
    others: [&'a [f64]; 2],
    distances: &'a [f64],
    weights: Option<&'a [f64]>,
    bx: &'a mut [f64],
    by: &'a mut [f64],
}

impl<S: Simd> Row<'_, S> {
    #[inline(always)]
    fn add(&mut self, simd: S) {
        let (x, x_rest) = S::as_simd_f64s(self.others[0]);
        let (y, y_rest) = S::as_simd_f64s(self.others[1]);
        let (d, d_rest) = S::as_simd_f64s(self.distances);
        let one = simd.splat_f64s(1.0);
        let (w, w_rest) = self.weights.map_or((None, None), |weights| {
            let (w, rest) = S::as_simd_f64s(weights);
            (Some(w), Some(rest))
        });
        let whole = self.distances.len() - d_rest.len();
        for k in 0..x.len() {
            let weight = w.map_or(one, |w| w[k]);
            let [fx, fy] = self.pull(simd, [x[k], y[k]], d[k], weight);
            let bx = &mut S::as_mut_simd_f64s(self.bx).0[k];
            *bx = simd.sub_f64s(*bx, fx);
            let by = &mut S::as_mut_simd_f64s(self.by).0[k];
            *by = simd.sub_f64s(*by, fy);
        }
        if !x_rest.is_empty() {
            let ones = [1.0; 16];
            let weight = simd.partial_load_f64s(w_rest.unwrap_or(&ones[..x_rest.len()]));
            let at = [
                simd.partial_load_f64s(x_rest),
                simd.partial_load_f64s(y_rest),
            ];
            let [fx, fy] = self.pull(simd, at, simd.partial_load_f64s(d_rest), weight);
            for (b, f) in [(&mut *self.bx, fx), (&mut *self.by, fy)] {
                let rest = &mut b[whole..];
                let sum = simd.sub_f64s(simd.partial_load_f64s(rest), f);
                simd.partial_store_f64s(rest, sum);
            }
        }
    }

    /// w delta / |p_i - p_j| (p_i - p_j), added to the sums of i, and the stress of the pairs.
    #[inline(always)]
    fn pull(
        &mut self,
        simd: S,
        other: [S::f64s; 2],
        wanted: S::f64s,
        weight: S::f64s,
    ) -> [S::f64s; 2] {
        let dx = simd.sub_f64s(self.at[0], other[0]);
        let dy = simd.sub_f64s(self.at[1], other[1]);
        // positions that coincide pull nowhere: the smallest number keeps 0 / 0 away
        let least = simd.splat_f64s(f64::MIN_POSITIVE);
        let square = simd.mul_add_f64s(dx, dx, simd.mul_add_f64s(dy, dy, least));
        let distance = simd.sqrt_f64s(square);
        let miss = simd.sub_f64s(distance, wanted);
        let weighted = simd.mul_f64s(weight, miss);
        self.stress = simd.mul_add_f64s(weighted, miss, self.stress);
        let factor = simd.mul_f64s(weight, simd.div_f64s(wanted, distance));
        let pull = [simd.mul_f64s(factor, dx), simd.mul_f64s(factor, dy)];
        self.sums = [
            simd.add_f64s(self.sums[0], pull[0]),
            simd.add_f64s(self.sums[1], pull[1]),
        ];
        pull
    }
}
