//! Least squares whose rows touch four neighbouring unknowns each, as those of a cubic B-spline do:
//! Givens rotations into a band of R, O(1) a row. Nothing is squared, so half the digits are not lost
//! as in normal equations.

/// Rows are four wide.
const BAND: usize = 4;

/// Why a system has no unique solution: this unknown, from 0, is not determined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Undetermined {
    /// The unknown.
    pub unknown: usize,
}

/// The triangle R and the rotated right sides of a system that takes its rows one at a time.
#[derive(Debug, Clone)]
pub struct BandedQr<const M: usize> {
    triangle: Vec<[f64; BAND]>,
    right: Vec<[f64; M]>,
}

impl<const M: usize> BandedQr<M> {
    /// A system of `unknowns` >= 4 unknowns and M right sides, without rows.
    pub fn new(unknowns: usize) -> Self {
        BandedQr {
            triangle: vec![[0.0; BAND]; unknowns],
            right: vec![[0.0; M]; unknowns],
        }
    }

    /// Adds the row whose entries from column `first` on are `row`. Rows must come by rising `first`.
    ///
    /// # Panics
    /// The row leaves the matrix.
    pub fn add(&mut self, first: usize, mut row: [f64; BAND], mut right: [f64; M]) {
        assert!(
            first + BAND <= self.triangle.len(),
            "a row must lie in the matrix"
        );
        for column in first..first + BAND {
            let pivot = self.triangle[column][0];
            if row[0] != 0.0 {
                let length = libm::hypot(pivot, row[0]);
                let (c, s) = (pivot / length, row[0] / length);
                rotate(c, s, &mut self.triangle[column], &mut row);
                rotate(c, s, &mut self.right[column], &mut right);
            }
            row.rotate_left(1);
            row[BAND - 1] = 0.0;
        }
    }

    /// The solution, M numbers an unknown.
    ///
    /// # Errors
    /// The rows do not determine an unknown: its pivot is below 1e-14 of the largest.
    pub fn solve(self) -> Result<Vec<[f64; M]>, Undetermined> {
        let mut x = self.right;
        let n = x.len();
        let largest = self.triangle.iter().map(|r| r[0].abs()).fold(0.0, f64::max);
        for i in (0..n).rev() {
            let row = self.triangle[i];
            if row[0].abs() <= 1e-14 * largest {
                return Err(Undetermined { unknown: i });
            }
            for j in 0..M {
                for (step, entry) in row.iter().enumerate().skip(1).take(n - 1 - i) {
                    x[i][j] -= entry * x[i + step][j];
                }
                x[i][j] /= row[0];
            }
        }
        Ok(x)
    }
}

/// (a, b) <- (c a + s b, c b - s a).
fn rotate<const N: usize>(c: f64, s: f64, a: &mut [f64; N], b: &mut [f64; N]) {
    for (a, b) in a.iter_mut().zip(b) {
        (*a, *b) = (c * *a + s * *b, c * *b - s * *a);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a made-up banded matrix, more of them than unknowns.
    fn rows(unknowns: usize) -> Vec<(usize, [f64; 4])> {
        (0..3 * (unknowns - 3))
            .map(|i| {
                let first = i / 3;
                (
                    first,
                    [0, 1, 2, 3].map(|j| libm::sin((7 * i + 3 * j) as f64) + f64::from(j == i % 4)),
                )
            })
            .collect()
    }

    #[test]
    fn a_known_solution_is_found() {
        for unknowns in [4, 5, 40] {
            let known = |i: usize| [libm::cos(i as f64), i as f64 - 3.0];
            let mut qr = BandedQr::new(unknowns);
            for (first, row) in rows(unknowns) {
                let right = [0, 1].map(|m| (0..4).map(|j| row[j] * known(first + j)[m]).sum());
                qr.add(first, row, right);
            }
            if unknowns == 4 {
                qr.add(0, [0.3, 0.1, -0.2, 0.9], {
                    let row = [0.3, 0.1, -0.2, 0.9];
                    [0, 1].map(|m| (0..4).map(|j| row[j] * known(j)[m]).sum())
                });
            }
            for (i, x) in qr.solve().unwrap().iter().enumerate() {
                // rounding times a condition below 1e4
                assert!((0..2).all(|m| (x[m] - known(i)[m]).abs() < 1e-10));
            }
        }
    }

    #[test]
    fn the_residual_is_perpendicular_to_the_columns() {
        let unknowns = 12;
        let mut qr = BandedQr::new(unknowns);
        let right = |i: usize| libm::cos(5.0 * i as f64);
        for (i, (first, row)) in rows(unknowns).into_iter().enumerate() {
            qr.add(first, row, [right(i)]);
        }
        let x = qr.solve().unwrap();
        let mut dots = vec![0.0; unknowns];
        for (i, (first, row)) in rows(unknowns).into_iter().enumerate() {
            let residual = (0..4).map(|j| row[j] * x[first + j][0]).sum::<f64>() - right(i);
            (0..4).for_each(|j| dots[first + j] += residual * row[j]);
        }
        assert!(dots.iter().all(|d| d.abs() < 1e-11));
    }

    #[test]
    fn what_no_row_determines_is_named() {
        let mut qr = BandedQr::new(5);
        for i in 0..6 {
            qr.add(
                0,
                [1.0, f64::from(i), f64::from(i * i), f64::from(i * i * i)],
                [1.0],
            );
        }
        assert_eq!(qr.solve(), Err(Undetermined { unknown: 4 }));
    }
}
