//! Dense symmetric matrices, of which the lower half is read: eigenvectors and Cholesky factors, always
//! on one thread so that the bits do not depend on their number.

use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::evd::{ComputeEigenvectors, self_adjoint_evd, self_adjoint_evd_scratch};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par};

/// Eigenvalues in falling order and the matrix of their eigenvectors, or nothing where an entry is not
/// finite. An empty matrix has none of either.
pub fn eigen(matrix: MatRef<'_, f64>) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = matrix.nrows();
    let mut values = Diag::<f64>::zeros(n);
    let mut vectors = Mat::zeros(n, n);
    let scratch =
        self_adjoint_evd_scratch::<f64>(n, ComputeEigenvectors::Yes, Par::Seq, Default::default());
    self_adjoint_evd(
        matrix,
        values.as_mut(),
        Some(vectors.as_mut()),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .ok()?;
    let falling = (0..n).rev().map(|i| values[i]).collect();
    Some((falling, Mat::from_fn(n, n, |i, j| vectors[(i, n - 1 - j)])))
}

/// L with A = L L^T. A column that depends on those before it up to rounding gets a unit pivot and no
/// entries, so that solving with L leaves it alone.
pub fn cholesky(mut matrix: Mat<f64>) -> Mat<f64> {
    let n = matrix.nrows();
    let diagonal: Vec<f64> = (0..n).map(|i| matrix[(i, i)]).collect();
    for j in 0..n {
        let pivot = matrix[(j, j)];
        if pivot > 4.0 * f64::EPSILON * diagonal[j] {
            eliminate(&mut matrix, j);
        } else {
            (j + 1..n).for_each(|i| matrix[(i, j)] = 0.0);
            matrix[(j, j)] = 1.0;
        }
    }
    matrix
}

/// The order in which Cholesky with diagonal pivoting takes the columns, until the largest diagonal
/// entry that remains is at most `cut`; ties go to the first.
pub fn pivots(mut matrix: Mat<f64>, cut: f64) -> Vec<usize> {
    let n = matrix.nrows();
    let mut order: Vec<usize> = (0..n).collect();
    for j in 0..n {
        let largest = (j..n).fold(j, |best, i| {
            if matrix[(i, i)] > matrix[(best, best)] {
                i
            } else {
                best
            }
        });
        if matrix[(largest, largest)].is_nan() || matrix[(largest, largest)] <= cut {
            order.truncate(j);
            break;
        }
        swap(&mut matrix, j, largest);
        order.swap(j, largest);
        eliminate(&mut matrix, j);
    }
    order
}

/// Divides column j by the root of its pivot and takes its outer product from the columns after it.
fn eliminate(matrix: &mut Mat<f64>, j: usize) {
    let n = matrix.nrows();
    let root = matrix[(j, j)].sqrt();
    let column = matrix.col_as_slice_mut(j);
    column[j..].iter_mut().for_each(|entry| *entry /= root);
    let column = column.to_vec();
    for i in j + 1..n {
        let factor = column[i];
        let target = &mut matrix.col_as_slice_mut(i)[i..];
        let entries = target.iter_mut().zip(&column[i..]);
        entries.for_each(|(entry, l)| *entry -= factor * l);
    }
}

/// Exchanges rows and columns i <= j of the lower half.
fn swap(matrix: &mut Mat<f64>, i: usize, j: usize) {
    let n = matrix.nrows();
    let lower = |a: usize, b: usize| (a.max(b), a.min(b));
    for other in (0..n).filter(|&other| other != i && other != j) {
        let (a, b) = (matrix[lower(i, other)], matrix[lower(j, other)]);
        matrix[lower(i, other)] = b;
        matrix[lower(j, other)] = a;
    }
    let (a, b) = (matrix[(i, i)], matrix[(j, j)]);
    matrix[(i, i)] = b;
    matrix[(j, j)] = a;
}

/// A^-1 of a positive definite matrix, both halves; nothing where it is not.
pub fn inverse(matrix: Mat<f64>) -> Option<Mat<f64>> {
    let n = matrix.nrows();
    let mut factor = matrix;
    let scratch = cholesky_in_place_scratch::<f64>(n, Par::Seq, Default::default());
    let diagonal = factor.diagonal().column_vector().norm_max();
    cholesky_in_place(
        factor.as_mut(),
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    )
    .ok()?;
    let least = (0..n).map(|i| factor[(i, i)]).fold(f64::INFINITY, f64::min);
    // a pivot at rounding: singular
    if least * least <= 4.0 * f64::EPSILON * diagonal {
        return None;
    }
    let mut half = Mat::<f64>::identity(n, n);
    solve_lower_triangular_in_place(factor.as_ref(), half.as_mut(), Par::Seq);
    let mut inverse = Mat::zeros(n, n);
    matmul(
        inverse.as_mut(),
        Accum::Replace,
        half.transpose(),
        half.as_ref(),
        1.0,
        Par::Seq,
    );
    Some(inverse)
}
