//! Principal component analysis of few long rows (n << d), CH12 §2.1 and §3.1.
//!
//! Y = Z - 1 h0^T is n x d, h0 the mean row. The n x n Gram matrix Y Y^T = U D^2 U^T is summed over
//! panels of columns in f64, each half of the symmetric matrix once, whatever the rows are stored in.
//! The m leading right singular vectors follow from W = Y^T U, whose columns are orthogonal up to the
//! Gram matrix's resolution, by an orthogonal factorisation W = H R done twice (Cholesky factors of
//! W^T W, which are backward stable once the columns are this close to orthogonal): H keeps
//! ||H^T H - I|| at rounding, and X = Y H is computed from the rows again.
//!
//! A Gram matrix in f64 cannot tell modes below 1e-8 ||Y|| from rounding. Whoever asks for modes below
//! 1e-6 ||Y|| pays for one more pass, W^T W with column pivoting over all n columns, which tells them
//! apart down to 1e-13 ||Y||.
//!
//! Sums over panels run in a fixed number of groups and are added in order: the result does not depend
//! on the number of threads.

mod panels;

use std::fmt;
use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use rayon::prelude::*;

use self::panels::Panels;
use super::symmetric;
use crate::task::{Cancelled, Task};

/// Modes below this part of ||Y|| are nothing: rows that lie in a plane up to f64 rounding lie in it.
pub const RANK_CUT: f64 = 1e-13;

/// Modes above this part of ||Y|| are resolved by the Gram matrix: its eigenvalues err by 1e-16 n of the
/// largest, so these by less than a thousandth.
const RESOLVED: f64 = 1e-6;

/// Columns whose cosines are below this are orthonormal to rounding after one round.
const NEARLY: f64 = 1e-2;

/// A matrix that is read by pieces of its rows: frames in f32, coordinates in f64, anything between.
pub trait Rows: Sync {
    /// n, how many rows there are.
    fn rows(&self) -> usize;

    /// d, how many columns there are.
    fn columns(&self) -> usize;

    /// Writes the entries `range` of `row` to `out`, which is as long as the range. Ranges start at
    /// multiples of three.
    fn copy(&self, row: usize, range: Range<usize>, out: &mut [f64]);
}

/// Rows of f64 stored one after another.
#[derive(Debug, Clone, Copy)]
pub struct Table<'a> {
    values: &'a [f64],
    columns: usize,
}

impl<'a> Table<'a> {
    /// `values.len() / columns` rows.
    ///
    /// # Panics
    /// `values` is not a whole number of rows.
    pub fn new(values: &'a [f64], columns: usize) -> Self {
        assert_eq!(
            values.len() % columns.max(1),
            0,
            "a table is made of whole rows"
        );
        Table { values, columns }
    }
}

impl Rows for Table<'_> {
    fn rows(&self) -> usize {
        self.values.len().checked_div(self.columns).unwrap_or(0)
    }

    fn columns(&self) -> usize {
        self.columns
    }

    fn copy(&self, row: usize, range: Range<usize>, out: &mut [f64]) {
        let start = row * self.columns;
        out.copy_from_slice(&self.values[start + range.start..start + range.end]);
    }
}

/// Why there is no decomposition.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PcaError {
    /// The task was cancelled.
    Cancelled,
    /// A row holds a number that is not finite, or whose square is not.
    NotFinite,
}

impl fmt::Display for PcaError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            PcaError::Cancelled => "interrupted",
            PcaError::NotFinite => "a coordinate is not finite, or too large to be squared",
        })
    }
}

impl std::error::Error for PcaError {}

impl From<Cancelled> for PcaError {
    fn from(_: Cancelled) -> Self {
        PcaError::Cancelled
    }
}

/// The mean row and the principal directions on the side of the rows: Y Y^T = U D^2 U^T.
/// One row, or rows that do not differ, have spread 0, rank 0 and no modes.
#[derive(Debug, Clone)]
pub struct Pca {
    mean: Vec<f64>,
    /// U, n x n, a column for each singular value.
    left: Mat<f64>,
    singular: Vec<f64>,
    spread: f64,
    /// Below this a mode is nothing.
    cut: f64,
}

/// The shape signal's parts: H (d x m), X (n x m).
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// The columns of H one after another, d numbers each, orthonormal to 1e-13.
    pub vectors: Vec<f64>,
    /// m, at most what was asked for.
    pub modes: usize,
    /// X = Y H, row after row, m numbers each; the largest entry of each column is positive.
    pub coordinates: Vec<f64>,
    /// ||Y - X H^T||, the root of (3).
    pub residual: f64,
    /// ||y_i - H x_i|| of each row: their squares sum to that of `residual`, up to 1e-15 ||Y||^2.
    pub residuals: Vec<f64>,
    /// The number of modes above 1e-13 ||Y||. Where no mode below 1e-6 ||Y|| was asked for, those are
    /// not told from rounding and not counted.
    pub rank: usize,
}

impl Pca {
    /// Decomposes the rows: one pass over them, n^2 d multiplications.
    ///
    /// # Errors
    /// [`PcaError::NotFinite`], [`PcaError::Cancelled`].
    pub fn new(rows: &dyn Rows, task: &Task) -> Result<Self, PcaError> {
        let (n, d) = (rows.rows(), rows.columns());
        let mean = mean(rows, task)?;
        let mut gram = Panels::of(n, d, 0).sum(task, n, n, |columns, sum, buffer| {
            let panel = centred(rows, &mean, columns, buffer);
            add_gram(panel, sum);
        })?;
        let squares: f64 = (0..n).map(|i| gram[(i, i)]).sum();
        if !squares.is_finite() {
            return Err(PcaError::NotFinite);
        }
        // the mean is rounded: rows that differ by less than that do not differ
        let noise = 4.0 * f64::EPSILON * mean.iter().map(|z| z * z * n as f64).sum::<f64>().sqrt();
        let spread = if squares.sqrt() > noise {
            squares.sqrt()
        } else {
            0.0
        };
        if spread == 0.0 {
            gram.fill(0.0);
        }
        let (values, left) = symmetric::eigen(gram.as_ref()).ok_or(PcaError::NotFinite)?;
        Ok(Pca {
            mean,
            left,
            singular: values.iter().map(|value| value.max(0.0).sqrt()).collect(),
            spread,
            cut: noise.max(RANK_CUT * spread),
        })
    }

    /// n, the number of rows.
    pub fn rows(&self) -> usize {
        self.singular.len()
    }

    /// h0, the mean row: d numbers.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// ||Y||, the root of the sum of all squared distances from the mean.
    pub fn spread(&self) -> f64 {
        self.spread
    }

    /// The n singular values of Y in falling order; below 1e-8 ||Y|| they are rounding.
    pub fn singular_values(&self) -> &[f64] {
        &self.singular
    }

    /// ||Y - Y_m||, the distance to the closest rows of rank m: what m modes leave out.
    pub fn residual(&self, modes: usize) -> f64 {
        let left_out = self.singular.iter().skip(modes).rev();
        left_out.map(|value| value * value).sum::<f64>().sqrt()
    }

    /// How many modes the Gram matrix resolves.
    pub fn resolved(&self) -> usize {
        let cut = self.cut.max(RESOLVED * self.spread);
        self.singular
            .iter()
            .take_while(|&&value| value > cut)
            .count()
    }

    /// The rows of U D, n numbers each: isometric to the rows of Y up to 1e-8 ||Y||, so that whatever
    /// depends on distances and combinations of the rows can be done with n numbers instead of d.
    pub fn reduced(&self) -> Vec<f64> {
        let n = self.rows();
        (0..n * n)
            .map(|at| self.left[(at / n, at % n)] * self.singular[at % n])
            .collect()
    }

    /// The m leading modes, or as many as there are. `rows` are those that were decomposed.
    ///
    /// # Errors
    /// [`PcaError::Cancelled`].
    pub fn basis(&self, rows: &dyn Rows, modes: usize, task: &Task) -> Result<Basis, PcaError> {
        let (n, d) = (self.rows(), self.mean.len());
        let resolved = self.resolved();
        let (chosen, rank) = if modes <= resolved || self.spread == 0.0 {
            (
                self.left.get(.., ..modes.min(resolved)).to_owned(),
                resolved,
            )
        } else {
            self.pivoted(rows, modes, task)?
        };
        let m = chosen.ncols();
        let mut vectors = vec![0.0; d * m];
        let mut h = MatMut::from_column_major_slice_mut(&mut vectors, d, m);
        self.project(rows, chosen.as_ref(), h.as_mut(), task)?;
        // a second round where the first had more to do than rounding leaves
        for _ in 0..2 {
            if orthonormalise(h.as_mut(), task)? < NEARLY {
                break;
            }
        }
        let mut x = self.coordinates(rows, h.as_ref(), task)?;
        fix_signs(h.as_mut(), x.as_mut());
        let (residual, residuals) = self.distances(rows, h.as_ref(), x.as_ref(), task)?;
        let coordinates = (0..n * m).map(|at| x[(at / m, at % m)]).collect();
        Ok(Basis {
            vectors,
            modes: m,
            coordinates,
            residual,
            residuals,
            rank,
        })
    }

    /// The columns of U that W^T W with pivoting finds independent, at most `modes`, and how many there
    /// are in all.
    fn pivoted(
        &self,
        rows: &dyn Rows,
        modes: usize,
        task: &Task,
    ) -> Result<(Mat<f64>, usize), PcaError> {
        let (n, d) = (self.rows(), self.mean.len());
        let gram = Panels::of(n, d, n).sum(task, n, n, |columns, sum, buffer| {
            let (panel, rotated) = buffer_pair(buffer, n * columns.len());
            let panel = centred_into(rows, &self.mean, columns.clone(), panel);
            let mut rotated = MatMut::from_column_major_slice_mut(rotated, columns.len(), n);
            matmul(
                rotated.as_mut(),
                Accum::Replace,
                panel,
                self.left.as_ref(),
                1.0,
                Par::Seq,
            );
            add_gram(rotated.as_ref(), sum);
        })?;
        let order = symmetric::pivots(gram, self.cut * self.cut);
        let rank = order.len();
        let kept = &order[..rank.min(modes)];
        Ok((
            Mat::from_fn(n, kept.len(), |i, j| self.left[(i, kept[j])]),
            rank,
        ))
    }

    /// W = Y^T U.
    fn project(
        &self,
        rows: &dyn Rows,
        left: MatRef<'_, f64>,
        target: MatMut<'_, f64>,
        task: &Task,
    ) -> Result<(), PcaError> {
        let panels = Panels::of(self.rows(), self.mean.len(), left.ncols());
        panels.each(target, task, |columns, part, buffer| {
            let panel = centred(rows, &self.mean, columns, buffer);
            matmul(part, Accum::Replace, panel, left, 1.0, Par::Seq);
        })
    }

    /// X = Y H.
    fn coordinates(
        &self,
        rows: &dyn Rows,
        h: MatRef<'_, f64>,
        task: &Task,
    ) -> Result<Mat<f64>, PcaError> {
        let (n, m) = (self.rows(), h.ncols());
        Panels::of(n, self.mean.len(), m).sum(task, n, m, |columns, sum, buffer| {
            let part = h.get(columns.clone(), ..);
            let panel = centred(rows, &self.mean, columns, buffer);
            matmul(sum, Accum::Add, panel.transpose(), part, 1.0, Par::Seq);
        })
    }

    /// ||Y - X H^T|| and the same of each row: by Pythagoras, or, where little is left and that would be rounding, from the rows.
    fn distances(
        &self,
        rows: &dyn Rows,
        h: MatRef<'_, f64>,
        x: MatRef<'_, f64>,
        task: &Task,
    ) -> Result<(f64, Vec<f64>), PcaError> {
        let whole = self.spread * self.spread;
        let left_out = whole - x.squared_norm_l2();
        // the difference errs by some 1e-15 of the whole: below 1e-11 of it that would show
        if left_out > 1e-11 * whole || whole == 0.0 {
            let each = (0..self.rows()).map(|i| self.square(i) - x.row(i).squared_norm_l2());
            let each = each.map(|square| square.max(0.0).sqrt()).collect();
            return Ok((left_out.max(0.0).sqrt(), each));
        }
        let n = self.rows();
        let panels = Panels::of(n, self.mean.len(), h.ncols());
        let squares = panels.sum(task, n, 1, |columns, mut sum, buffer| {
            let part = h.get(columns.clone(), ..);
            let mut panel = centred(rows, &self.mean, columns, buffer).to_owned();
            matmul(
                panel.as_mut(),
                Accum::Add,
                part,
                x.transpose(),
                -1.0,
                Par::Seq,
            );
            for i in 0..n {
                sum[(i, 0)] += panel.col(i).squared_norm_l2();
            }
        })?;
        let each = (0..n).map(|i| squares[(i, 0)].sqrt()).collect();
        Ok(((0..n).map(|i| squares[(i, 0)]).sum::<f64>().sqrt(), each))
    }

    /// ||y_i||^2.
    fn square(&self, row: usize) -> f64 {
        let entries = self.singular.iter().enumerate();
        let entries = entries.map(|(j, size)| self.left[(row, j)] * size);
        entries.map(|entry| entry * entry).sum()
    }
}

/// The mean row.
fn mean(rows: &dyn Rows, task: &Task) -> Result<Vec<f64>, PcaError> {
    let (n, d) = (rows.rows(), rows.columns());
    let panels = Panels::of(n, d, 0);
    let mut mean = vec![0.0; d];
    mean.par_chunks_mut(panels.width)
        .enumerate()
        .try_for_each_init(Vec::new, |buffer: &mut Vec<f64>, (panel, part)| {
            task.check()?;
            buffer.resize(part.len(), 0.0);
            for row in 0..n {
                rows.copy(row, panels.range(panel), buffer);
                part.iter_mut().zip(&*buffer).for_each(|(sum, z)| *sum += z);
            }
            part.iter_mut().for_each(|sum| *sum /= n as f64);
            Ok::<_, PcaError>(())
        })?;
    Ok(mean)
}

/// Columns `columns` of Y as the rows of a panel: a column-major matrix with a column for each row.
fn centred<'a>(
    rows: &dyn Rows,
    mean: &[f64],
    columns: Range<usize>,
    buffer: &'a mut Vec<f64>,
) -> MatRef<'a, f64> {
    buffer.resize(rows.rows() * columns.len(), 0.0);
    centred_into(rows, mean, columns, buffer)
}

fn centred_into<'a>(
    rows: &dyn Rows,
    mean: &[f64],
    columns: Range<usize>,
    buffer: &'a mut [f64],
) -> MatRef<'a, f64> {
    let width = columns.len();
    for (row, part) in buffer.chunks_exact_mut(width).enumerate() {
        rows.copy(row, columns.clone(), part);
        part.iter_mut()
            .zip(&mean[columns.clone()])
            .for_each(|(z, mean)| *z -= mean);
    }
    MatRef::from_column_major_slice(buffer, width, rows.rows())
}

/// Two parts of `length` numbers each.
fn buffer_pair(buffer: &mut Vec<f64>, length: usize) -> (&mut [f64], &mut [f64]) {
    buffer.resize(2 * length, 0.0);
    buffer.split_at_mut(length)
}

/// Adds A^T A to the lower half of `sum`.
fn add_gram(panel: MatRef<'_, f64>, sum: MatMut<'_, f64>) {
    triangular::matmul(
        sum,
        BlockStructure::TriangularLower,
        Accum::Add,
        panel.transpose(),
        BlockStructure::Rectangular,
        panel,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// One round of W = H R: H replaces W. Gives the largest cosine between two columns of W.
fn orthonormalise(mut h: MatMut<'_, f64>, task: &Task) -> Result<f64, PcaError> {
    let (d, m) = (h.nrows(), h.ncols());
    let panels = Panels::of(m, d, 0);
    let gram = panels.sum(task, m, m, |columns, sum, _| {
        add_gram(h.as_ref().get(columns, ..), sum);
    })?;
    let cosine = |i: usize, j: usize| gram[(i, j)].abs() / (gram[(i, i)] * gram[(j, j)]).sqrt();
    let pairs = (0..m).flat_map(|i| (0..i).map(move |j| (i, j)));
    let largest = pairs.map(|(i, j)| cosine(i, j)).fold(0.0, f64::max);
    let lower = symmetric::cholesky(gram);
    panels.each(h.as_mut(), task, |_, part, _| {
        solve_lower_triangular_in_place(lower.as_ref(), part.transpose_mut(), Par::Seq);
    })?;
    Ok(largest)
}

/// The largest entry of each column of X becomes positive.
fn fix_signs(mut h: MatMut<'_, f64>, mut x: MatMut<'_, f64>) {
    for j in 0..x.ncols() {
        let column = (0..x.nrows()).map(|i| x[(i, j)]);
        let largest = column.fold(
            0.0_f64,
            |best, x| if x.abs() > best.abs() { x } else { best },
        );
        if largest < 0.0 {
            (0..x.nrows()).for_each(|i| x[(i, j)] = -x[(i, j)]);
            (0..h.nrows()).for_each(|i| h[(i, j)] = -h[(i, j)]);
        }
    }
}

#[cfg(test)]
mod tests;
