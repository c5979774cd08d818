//! Normal equations of the nonlinear half: Kaufman's Jacobian, summed without ever being formed.
//!
//! The residual r = M X, M = I - Q Q^T, changes by -M D v, where control points move the sample rows
//! along G_a = dg/dp_a (N x m) and a site s_j moves column j of Phi along b_a\[:, j\] with coefficients
//! w_j. Two rows i and i' meet only through M_ii' (G_a G_b^T)_ii', so the Nm x 2(k+l) Jacobian never
//! exists:
//!
//! ```text
//! H[Ca, Cb] = A^T (M o (G_a G_b^T)) A                 descent[Ca] = A^T rowsum(G_a o r)
//! H[sa, sb] = (b_a^T M b_b) o (w w^T)                 descent[sa] = colsum(b_a o (r w^T))
//! H[Ca, sb] = A^T ((G_a w^T) o (M b_b))
//! b_a = -(h o (p - s)_a) - (Phi T^+T e_(1+a)) 1^T,    h = 2 log r + 1
//! ```
//!
//! The second term of b_a is the derivative of the side conditions' null space (T = \[1 s\]). The
//! expressions are exact derivatives for ridge 0, rows of G_a and b_a being weighted as those of r are; Kaufman leaves out of H what vanishes with r.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

use super::design::{Design, weigh};
use super::plate::Plate;
use crate::math::uniform_spline::UniformDesign;

/// Columns of M taken at once: a panel stays in cache, and the panels' sums are added in their order
/// whatever the number of threads.
const PANEL: usize = 128;

/// H and the descent direction for the unknowns \[C_x, C_y, s_x, s_y\], and what they are made from.
pub(super) struct Normal {
    /// 2(k+l) square, both triangles.
    pub(super) hessian: Mat<f64>,
    /// -1/2 of the gradient of the squared residual.
    pub(super) descent: Vec<f64>,
    /// Q, (N+l) x l; the rows below N belong to the ridge.
    basis: Mat<f64>,
    /// r, (N+l) x m.
    residual: Mat<f64>,
    panels: Vec<Panel>,
    axes: [Axis; 2],
    /// M b_a for both a, N x l.
    free: [Mat<f64>; 2],
    /// w w^T, l x l.
    weight_products: Mat<f64>,
    /// r w^T, N x l.
    residual_weights: Mat<f64>,
}

/// What belongs to one coordinate of the plane.
struct Axis {
    /// G_a, N x m.
    slopes: Mat<f64>,
    /// b_a, N x l.
    moves: Mat<f64>,
    /// Q^T b_a, l x l.
    share: Mat<f64>,
    /// G_a w^T, N x l.
    along: Mat<f64>,
    /// H[Ca, sb] for both b, k x l.
    cross: [Mat<f64>; 2],
    /// b_a^T M b_b for both b, l x l.
    sites: [Mat<f64>; 2],
}

impl Normal {
    pub(super) fn new(spline: &UniformDesign, sites: usize, width: usize) -> Self {
        let (samples, controls) = (spline.rows(), spline.controls());
        let unknowns = 2 * (controls + sites);
        let axis = |_| Axis {
            slopes: Mat::zeros(samples, width),
            moves: Mat::zeros(samples, sites),
            share: Mat::zeros(sites, sites),
            along: Mat::zeros(samples, sites),
            cross: std::array::from_fn(|_| Mat::zeros(controls, sites)),
            sites: std::array::from_fn(|_| Mat::zeros(sites, sites)),
        };
        Normal {
            hessian: Mat::zeros(unknowns, unknowns),
            descent: vec![0.0; unknowns],
            basis: Mat::zeros(samples + sites, sites),
            residual: Mat::zeros(samples + sites, width),
            panels: (0..samples)
                .step_by(PANEL)
                .map(|start| Panel::new(spline, start, samples.min(start + PANEL)))
                .collect(),
            axes: std::array::from_fn(axis),
            free: std::array::from_fn(|_| Mat::zeros(samples, sites)),
            weight_products: Mat::zeros(sites, sites),
            residual_weights: Mat::zeros(samples, sites),
        }
    }

    /// Writes H and the descent direction of the problem that `design` has just solved at `points`
    /// (N x 2) with the coefficients `plate`.
    pub(super) fn assemble(
        &mut self,
        spline: &UniformDesign,
        points: MatRef<'_, f64>,
        design: &mut Design,
        plate: &Plate,
    ) {
        design.residual(&mut self.residual);
        design.orthonormal(&mut self.basis);
        let samples = points.nrows();
        let basis = self.basis.as_ref().subrows(0, samples);
        let residual = self.residual.as_ref().subrows(0, samples);
        let design = &*design;
        let [x, y] = &mut self.axes;
        rayon::join(
            || x.differentiate(0, points, design, plate),
            || y.differentiate(1, points, design, plate),
        );
        let weights = plate.weights.as_ref();
        product(&mut self.weight_products, weights, weights.transpose());
        product(&mut self.residual_weights, residual, weights.transpose());
        let slopes = [x.slopes.as_ref(), y.slopes.as_ref()];
        let panels = &mut self.panels;
        panels
            .par_iter_mut()
            .for_each(|panel| panel.fill(spline, basis, slopes));
        let [free_x, free_y] = &mut self.free;
        rayon::join(
            || x.project(basis, weights, free_x),
            || y.project(basis, weights, free_y),
        );
        let free = &self.free;
        rayon::join(|| x.meet(spline, free), || y.meet(spline, free));
        self.gather(spline.controls(), plate.sites.nrows());
        self.descend(spline, samples);
    }

    /// Adds all blocks up in the upper triangle of H, then mirrors it.
    fn gather(&mut self, controls: usize, sites: usize) {
        self.hessian.fill(0.0);
        for panel in &self.panels {
            panel.add_to(&mut self.hessian, controls);
        }
        for (a, axis) in self.axes.iter().enumerate() {
            for b in 0..2 {
                let start = 2 * controls + b * sites;
                for j in 0..sites {
                    let column = self.hessian.col_as_slice_mut(start + j);
                    column[a * controls..(a + 1) * controls]
                        .copy_from_slice(axis.cross[b].col_as_slice(j));
                    let from = 2 * controls + a * sites;
                    let products = self.weight_products.col_as_slice(j);
                    let blocks = axis.sites[b].col_as_slice(j).iter().zip(products);
                    for (entry, (block, product)) in column[from..].iter_mut().zip(blocks) {
                        *entry = block * product;
                    }
                }
            }
        }
        for j in 0..self.hessian.ncols() {
            for i in 0..j {
                self.hessian[(j, i)] = self.hessian[(i, j)];
            }
        }
    }

    fn descend(&mut self, spline: &UniformDesign, samples: usize) {
        let controls = spline.controls();
        let sites = self.weight_products.nrows();
        self.descent.fill(0.0);
        let (curve, free) = self.descent.split_at_mut(2 * controls);
        let mut sums = vec![0.0; samples];
        for (a, axis) in self.axes.iter().enumerate() {
            sums.fill(0.0);
            for c in 0..self.residual.ncols() {
                let residual = self.residual.col_as_slice(c);
                let slopes = axis.slopes.col_as_slice(c).iter().zip(residual);
                for (sum, (slope, residual)) in sums.iter_mut().zip(slopes) {
                    *sum += slope * residual;
                }
            }
            spline.add_transposed(0, &sums, &mut curve[a * controls..(a + 1) * controls]);
            for j in 0..sites {
                let pulls = self.residual_weights.col_as_slice(j);
                let moves = axis.moves.col_as_slice(j);
                free[a * sites + j] = pulls.iter().zip(moves).map(|(r, b)| r * b).sum();
            }
        }
    }
}

impl Axis {
    /// G_a and b_a.
    fn differentiate(&mut self, a: usize, points: MatRef<'_, f64>, design: &Design, plate: &Plate) {
        let (samples, sites) = (points.nrows(), plate.sites.nrows());
        for j in 0..sites {
            let logs = design.logs.col_as_slice(j).iter();
            let column = self.moves.col_as_slice_mut(j).iter_mut().zip(logs);
            for (i, (value, log)) in column.enumerate() {
                *value = (log + 1.0) * (points[(i, a)] - plate.sites[(j, a)]);
            }
        }
        product(
            &mut self.slopes,
            self.moves.as_ref(),
            plate.weights.as_ref(),
        );
        for c in 0..self.slopes.ncols() {
            let slope = plate.affine[(1 + a, c)];
            let column = self.slopes.col_as_slice_mut(c);
            column.iter_mut().for_each(|value| *value += slope);
            weigh(column, &design.weights);
        }
        let turn = side_condition_turn(plate.sites.as_ref(), a);
        let mut shared = vec![0.0; samples];
        for (j, turn) in turn.iter().enumerate() {
            let kernel = design.kernel.col_as_slice(j);
            shared
                .iter_mut()
                .zip(kernel)
                .for_each(|(sum, phi)| *sum += phi * turn);
        }
        for j in 0..sites {
            let column = self.moves.col_as_slice_mut(j).iter_mut();
            column
                .zip(shared.iter().zip(&design.weights))
                .for_each(|(value, (shared, weight))| *value = -weight * (*value + shared));
        }
    }

    /// M b_a = b_a - Q (Q^T b_a), and G_a w^T.
    fn project(&mut self, basis: MatRef<'_, f64>, weights: MatRef<'_, f64>, free: &mut Mat<f64>) {
        product(&mut self.share, basis.transpose(), self.moves.as_ref());
        free.copy_from(&self.moves);
        let share = self.share.as_ref();
        matmul(free.as_mut(), Accum::Add, basis, share, -1.0, Par::Seq);
        product(&mut self.along, self.slopes.as_ref(), weights.transpose());
    }

    /// H[Ca, sb] and b_a^T M b_b for both b.
    fn meet(&mut self, spline: &UniformDesign, free: &[Mat<f64>; 2]) {
        let mut column = vec![0.0; self.moves.nrows()];
        for b in 0..2 {
            let moves = self.moves.as_ref().transpose();
            product(&mut self.sites[b], moves, free[b].as_ref());
            for j in 0..self.along.ncols() {
                let along = self.along.col_as_slice(j).iter();
                let pairs = along.zip(free[b].col_as_slice(j));
                column
                    .iter_mut()
                    .zip(pairs)
                    .for_each(|(value, (along, free))| *value = along * free);
                let sums = self.cross[b].col_as_slice_mut(j);
                sums.fill(0.0);
                spline.add_transposed(0, &column, sums);
            }
        }
    }
}

/// T^+T e_(1+a): how the null space of the side conditions turns when site coordinates a move.
fn side_condition_turn(sites: MatRef<'_, f64>, a: usize) -> Vec<f64> {
    let count = sites.nrows() as f64;
    let mean: [f64; 2] =
        std::array::from_fn(|c| (0..sites.nrows()).map(|j| sites[(j, c)]).sum::<f64>() / count);
    let at = |j: usize, c: usize| sites[(j, c)] - mean[c];
    let moment = |c: usize, d: usize| (0..sites.nrows()).map(|j| at(j, c) * at(j, d)).sum::<f64>();
    let (xx, xy, yy) = (moment(0, 0), moment(0, 1), moment(1, 1));
    let determinant = xx * yy - xy * xy;
    let scale = if determinant > 0.0 {
        1.0 / determinant
    } else {
        0.0
    };
    let (own, other, mixed) = if a == 0 { (yy, 1, xy) } else { (xx, 0, xy) };
    (0..sites.nrows())
        .map(|j| scale * (own * at(j, a) - mixed * at(j, other)))
        .collect()
}

/// Columns `start..end` of the control blocks: S_ab = A^T L_ab A\[start..end\] for the lower half L_ab
/// of M o (G_a G_b^T), its diagonal halved, so that H[Ca, Cb] = S_ab + S_ba^T.
struct Panel {
    start: usize,
    end: usize,
    /// First control point and the number of them that the columns touch.
    support: std::ops::Range<usize>,
    /// M and the products, (N - start) x (end - start).
    projector: Mat<f64>,
    products: Mat<f64>,
    sums: [Mat<f64>; 4],
    column: Vec<f64>,
}

impl Panel {
    fn new(spline: &UniformDesign, start: usize, end: usize) -> Self {
        let rows = spline.rows() - start;
        let support = spline.support(start..end);
        let width = support.len();
        Panel {
            start,
            end,
            support,
            projector: Mat::zeros(rows, end - start),
            products: Mat::zeros(rows, end - start),
            sums: std::array::from_fn(|_| Mat::zeros(spline.controls(), width)),
            column: vec![0.0; spline.controls()],
        }
    }

    fn fill(
        &mut self,
        spline: &UniformDesign,
        basis: MatRef<'_, f64>,
        slopes: [MatRef<'_, f64>; 2],
    ) {
        let (rows, width) = (basis.nrows() - self.start, self.end - self.start);
        matmul(
            self.projector.as_mut(),
            Accum::Replace,
            basis.subrows(self.start, rows),
            basis.subrows(self.start, width).transpose(),
            -1.0,
            Par::Seq,
        );
        for j in 0..width {
            let column = self.projector.col_as_slice_mut(j);
            column[..j].fill(0.0);
            column[j] = 0.5 * (1.0 + column[j]);
        }
        for (pair, sums) in self.sums.iter_mut().enumerate() {
            let (a, b) = (slopes[pair / 2], slopes[pair % 2]);
            let a = a.subrows(self.start, rows);
            let b = b.subrows(self.start, width);
            product(&mut self.products, a, b.transpose());
            sums.fill(0.0);
            for j in 0..width {
                let column = self.products.col_as_slice_mut(j);
                let projector = self.projector.col_as_slice(j);
                column.iter_mut().zip(projector).for_each(|(x, m)| *x *= m);
                self.column.fill(0.0);
                spline.add_transposed(self.start + j, &column[j..], &mut self.column);
                let (first, weights) = spline.row(self.start + j);
                for (c, weight) in weights.iter().enumerate() {
                    let sums = sums.col_as_slice_mut(first + c - self.support.start);
                    sums.iter_mut()
                        .zip(&self.column)
                        .for_each(|(sum, value)| *sum += weight * value);
                }
            }
        }
    }

    /// Adds S_ab + S_ba^T to the blocks (0,0), (0,1), (1,1) of H.
    fn add_to(&self, hessian: &mut Mat<f64>, controls: usize) {
        for (pair, sums) in self.sums.iter().enumerate() {
            let (a, b) = (pair / 2, pair % 2);
            for (j, control) in self.support.clone().enumerate() {
                for (i, value) in sums.col_as_slice(j).iter().enumerate() {
                    if a <= b {
                        hessian[(a * controls + i, b * controls + control)] += value;
                    }
                    if b <= a {
                        hessian[(b * controls + control, a * controls + i)] += value;
                    }
                }
            }
        }
    }
}

fn product(to: &mut Mat<f64>, left: MatRef<'_, f64>, right: MatRef<'_, f64>) {
    matmul(to.as_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
}
