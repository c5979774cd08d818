//! Dense least squares by Householder QR with equilibrated columns: minimises |B c - X|^2 for n x l
//! matrices B with n >= l and n x m right sides X. Sequential, so the bits do not depend on threads.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::{factor, solve};
use faer::prelude::Reborrow;
use faer::{Mat, Par};

/// Below this part of the largest, a diagonal entry of R counts as 0.
const DEPENDENT: f64 = 1e-13;

/// The l x m minimiser. None when there are fewer rows than columns, or the columns depend on each
/// other: what to do then is the caller's to say.
pub fn least_squares(mut matrix: Mat<f64>, mut right: Mat<f64>) -> Option<Mat<f64>> {
    let (n, l, m) = (matrix.nrows(), matrix.ncols(), right.ncols());
    if n < l || n != right.nrows() {
        return None;
    }
    let sizes = equilibrate(&mut matrix)?;
    let block = factor::recommended_block_size::<f64>(n, l);
    let mut coefficients = Mat::zeros(block, l);
    let scratch = factor::qr_in_place_scratch::<f64>(n, l, block, Par::Seq, Default::default());
    factor::qr_in_place(
        matrix.as_mut(),
        coefficients.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        Default::default(),
    );
    let diagonal = || (0..l).map(|j| matrix[(j, j)].abs());
    let largest = diagonal().fold(0.0, f64::max);
    if !diagonal().all(|d| d > DEPENDENT * largest) {
        return None;
    }
    let scratch = solve::solve_lstsq_in_place_scratch::<f64>(n, l, block, m, Par::Seq);
    solve::solve_lstsq_in_place(
        matrix.as_ref(),
        coefficients.as_ref(),
        matrix.as_ref(),
        right.as_mut(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
    );
    let mut solution = right.subrows(0, l).to_owned();
    for (i, size) in sizes.iter().enumerate() {
        solution.row_mut(i).iter_mut().for_each(|x| *x /= size);
    }
    Some(solution)
}

/// Divides each column by its length; None if one is 0 or not finite.
fn equilibrate(matrix: &mut Mat<f64>) -> Option<Vec<f64>> {
    let mut sizes = Vec::with_capacity(matrix.ncols());
    for column in matrix.col_iter_mut() {
        let size = column.rb().iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return None;
        }
        column.iter_mut().for_each(|x| *x /= size);
        sizes.push(size);
    }
    Some(sizes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_residual_is_perpendicular_to_the_columns() {
        let matrix = Mat::from_fn(40, 6, |i, j| libm::pow(i as f64 / 40.0, j as f64));
        let right = Mat::from_fn(40, 3, |i, j| libm::sin(i as f64 + j as f64));
        let solution = least_squares(matrix.clone(), right.clone()).unwrap();
        let residual = &matrix * &solution - &right;
        let dots = matrix.transpose() * &residual;
        // 40 roundings of products of size 1 and coefficients below 1e3
        assert!(dots.norm_max() < 1e-11);
    }

    #[test]
    fn columns_of_very_different_size_do_not_matter() {
        let matrix = Mat::from_fn(9, 3, |i, j| {
            [1.0, 1e-8, 1e8][j] * libm::sin((i * (j + 1)) as f64 + 1.0)
        });
        let known = Mat::from_fn(3, 1, |j, _| [1.0, 2e8, 3e-8][j]);
        let solution = least_squares(matrix.clone(), &matrix * &known).unwrap();
        for j in 0..3 {
            assert!((solution[(j, 0)] / known[(j, 0)] - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn dependence_and_too_few_rows_are_told() {
        let twins = Mat::from_fn(5, 2, |i, _| i as f64 + 1.0);
        assert!(least_squares(twins, Mat::zeros(5, 1)).is_none());
        assert!(least_squares(Mat::zeros(5, 1), Mat::zeros(5, 1)).is_none());
        assert!(least_squares(Mat::identity(2, 3), Mat::zeros(2, 1)).is_none());
    }
}
