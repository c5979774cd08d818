//! Sites that are hardly missed go where they are wanted: a descent ends in the nearest valley, and the
//! sites that it crowded or sent far out stay there.
//!
//! Points and coefficients of the plate being those of least squares, let w_j be the coefficients of site
//! j and V (l x l) their covariance up to a factor. Without site j the squared residual is larger by
//!
//! ```text
//! |w_j|^2 / V_jj,      and then   w <- w - V_:j w_j / V_jj,   V <- V - V_:j V_j: / V_jj,
//! ```
//!
//! so sites are taken away one after the other (backward elimination). A candidate s adds the column
//! b = phi(|p - s|) - Phi a, where a is any combination of the sites that meets the side conditions, and
//! takes from the squared residual
//!
//! ```text
//! |b~^T r|^2 / |b~|^2,     b~ = M b,
//! ```
//!
//! M projecting out what the sites do already. Candidates are added one after the other, too (orthogonal
//! least squares, Chen, Cowan & Grant 1991).

use faer::linalg::matmul::matmul;
use faer::prelude::Solve;
use faer::{Accum, Col, Mat, MatRef, Par};

use super::design::{Design, kernel_and_logs, weigh};
use super::{Options, Plate};

/// A candidate of whose column less than this part (of the squared norm) is new is a site that there is.
const NEW: f64 = 1e-12;

/// Takes away the `count` of the `sites` (l x 2; at least four stay) that are missed least and adds as many of
/// the `candidates` (c x 2), those that gain most. `points` (N x 2), `targets` (N x m) and `weights` (N)
/// are those of [`super::fit_plate`]. Where fewer candidates gain anything, the sites that were taken away
/// last stay.
pub fn exchange(
    points: MatRef<'_, f64>,
    targets: MatRef<'_, f64>,
    weights: &[f64],
    sites: MatRef<'_, f64>,
    count: usize,
    candidates: MatRef<'_, f64>,
) -> Mat<f64> {
    let fixed = Fixed {
        points,
        targets,
        weights,
    };
    let count = count.min(sites.nrows().saturating_sub(4));
    let (mut kept, mut removed) = fixed.parted(sites, count);
    let stay = rows(sites, &kept);
    let added = fixed.wanted(stay.as_ref(), candidates, count);
    let back = removed.split_off(added.len());
    kept.extend(back);
    let (stay, added) = (rows(sites, &kept), rows(candidates, &added));
    Mat::from_fn(sites.nrows(), 2, |j, a| match j.checked_sub(kept.len()) {
        None => stay[(j, a)],
        Some(new) => added[(new, a)],
    })
}

/// What does not change: where the curve is, what is to be met there, and what it counts.
struct Fixed<'a> {
    points: MatRef<'a, f64>,
    targets: MatRef<'a, f64>,
    weights: &'a [f64],
}

impl Fixed<'_> {
    /// Solved for `sites`.
    fn solved(&self, sites: MatRef<'_, f64>) -> Design {
        let ridge = Options::default().ridge;
        let mut design = Design::new(self.weights, sites.nrows(), self.targets.ncols(), ridge);
        design.solve(self.points, sites, self.targets);
        design
    }

    /// The sites that stay, and the `count` that are taken away, first to last.
    fn parted(&self, sites: MatRef<'_, f64>, count: usize) -> (Vec<usize>, Vec<usize>) {
        let mut design = self.solved(sites);
        let mut plate = Plate::zero(sites.nrows(), self.targets.ncols());
        design.plate(sites, &mut plate);
        let (mut weights, mut spread) = (plate.weights, design.covariance());
        let mut kept: Vec<usize> = (0..sites.nrows()).collect();
        let mut removed = Vec::new();
        for _ in 0..count {
            let missed = |&j: &usize| weights.row(j).squared_norm_l2() / spread[(j, j)];
            let least =
                (0..kept.len()).min_by(|&a, &b| missed(&kept[a]).total_cmp(&missed(&kept[b])));
            let Some(least) = least else { break };
            let j = kept.remove(least);
            removed.push(j);
            let share = spread.col(j) * faer::Scale(1.0 / spread[(j, j)]);
            let (own, across) = (weights.row(j).to_owned(), spread.row(j).to_owned());
            weights -= &share * own;
            spread -= &share * across;
        }
        (kept, removed)
    }

    /// The `candidates` that gain most beside `sites`, at most `count`.
    fn wanted(
        &self,
        sites: MatRef<'_, f64>,
        candidates: MatRef<'_, f64>,
        count: usize,
    ) -> Vec<usize> {
        let mut design = self.solved(sites);
        let (samples, held) = (self.points.nrows(), sites.nrows());
        let mut basis = Mat::zeros(samples + held, held);
        let mut residual = Mat::zeros(samples + held, self.targets.ncols());
        design.orthonormal(&mut basis);
        design.residual(&mut residual);
        let basis = basis.as_ref().subrows(0, samples);
        let residual = residual.as_ref().subrows(0, samples);
        let mut columns = self.columns(&design, sites, candidates);
        let whole = squared_norms(&columns);
        // Twice, as what is left may be a small part of the column.
        for _ in 0..2 {
            let share = product(basis.transpose(), columns.as_ref());
            let (share, to) = (share.as_ref(), columns.as_mut());
            matmul(to, Accum::Add, basis, share, -1.0, Par::Seq);
        }
        let mut pulls = product(residual.transpose(), columns.as_ref());
        let mut sizes = squared_norms(&columns);
        let mut added: Vec<usize> = Vec::new();
        let mut units: Vec<Col<f64>> = Vec::new();
        while added.len() < count {
            let gain = |c: usize| match sizes[c] > NEW * whole[c] {
                true => pulls.col(c).squared_norm_l2() / sizes[c],
                false => 0.0,
            };
            let most = (0..columns.ncols()).max_by(|&a, &b| gain(a).total_cmp(&gain(b)));
            let Some(most) = most.filter(|&c| gain(c) > 0.0) else {
                break;
            };
            let mut unit = columns.col(most).to_owned();
            for before in &units {
                let share = before.transpose() * &unit;
                unit -= before * faer::Scale(share);
            }
            unit *= faer::Scale(1.0 / unit.norm_l2());
            // What the new column does is no longer missed, and in other columns nothing new.
            let across = unit.transpose() * &columns;
            pulls -= (residual.transpose() * &unit) * &across;
            let sizes = sizes.iter_mut().zip(across.iter());
            sizes.for_each(|(size, share)| *size -= share * share);
            added.push(most);
            units.push(unit);
        }
        added
    }

    /// b of every candidate, N x c.
    fn columns(
        &self,
        design: &Design,
        sites: MatRef<'_, f64>,
        candidates: MatRef<'_, f64>,
    ) -> Mat<f64> {
        let ones = |of: MatRef<'_, f64>| {
            Mat::from_fn(
                of.nrows(),
                3,
                |j, c| if c == 0 { 1.0 } else { of[(j, c - 1)] },
            )
        };
        let conditions = ones(sites);
        let gram = conditions.transpose() * &conditions;
        let sides = ones(candidates).transpose().to_owned();
        let combined = product(
            conditions.as_ref(),
            gram.full_piv_lu().solve(sides).as_ref(),
        );
        let mut columns = Mat::zeros(self.points.nrows(), candidates.nrows());
        let mut logs = columns.clone();
        kernel_and_logs(self.points, candidates, &mut columns, &mut logs);
        let kernel = design.kernel.as_ref();
        matmul(
            columns.as_mut(),
            Accum::Add,
            kernel,
            combined.as_ref(),
            -1.0,
            Par::Seq,
        );
        for c in 0..columns.ncols() {
            weigh(columns.col_as_slice_mut(c), self.weights);
        }
        columns
    }
}

/// The same on any number of threads.
fn product(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Mat<f64> {
    let mut product = Mat::zeros(left.nrows(), right.ncols());
    matmul(product.as_mut(), Accum::Replace, left, right, 1.0, Par::Seq);
    product
}

/// The squared norm of each column.
fn squared_norms(matrix: &Mat<f64>) -> Vec<f64> {
    matrix
        .col_iter()
        .map(|column| column.squared_norm_l2())
        .collect()
}

/// Some rows of places.
fn rows(of: MatRef<'_, f64>, which: &[usize]) -> Mat<f64> {
    Mat::from_fn(which.len(), 2, |row, a| of[(which[row], a)])
}
