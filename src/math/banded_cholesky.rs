//! Symmetric positive definite systems in which unknowns more than a few apart do not meet: Cholesky's
//! factor keeps the band, O(n w^2) for n unknowns and w entries a row. No pivots are needed.

/// A symmetric matrix whose entries lie within a band about the diagonal.
#[derive(Debug, Clone)]
pub struct BandedSymmetric {
    width: usize,
    /// Row after row, the entries from the diagonal on.
    rows: Vec<f64>,
}

impl BandedSymmetric {
    /// The zero matrix of `unknowns` rows with `width` >= 1 entries each from the diagonal on.
    pub fn new(unknowns: usize, width: usize) -> Self {
        let width = width.max(1);
        BandedSymmetric {
            width,
            rows: vec![0.0; unknowns * width],
        }
    }

    /// Adds to entry (`row`, `column`), `row` <= `column`; the one across the diagonal is the same.
    ///
    /// # Panics
    /// The entry lies below the diagonal or outside of the band or the matrix.
    pub fn add(&mut self, row: usize, column: usize, value: f64) {
        let step = column - row;
        assert!(step < self.width, "an entry must lie in the band");
        self.rows[row * self.width + step] += value;
    }

    /// The diagonal entry of a row.
    ///
    /// # Panics
    /// There is no such row.
    pub fn diagonal(&self, row: usize) -> f64 {
        self.rows[row * self.width]
    }

    /// x of A x = `right`. None when A is not positive definite to rounding.
    ///
    /// # Panics
    /// `right` has fewer entries than the matrix rows.
    pub fn solve(mut self, right: &[f64]) -> Option<Vec<f64>> {
        let width = self.width;
        let n = self.rows.len() / width;
        for i in 0..n {
            let pivot = self.rows[i * width];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            // the rows below, less what this one carries into them
            let most = width.min(n - i);
            let (row, below) = self.rows[i * width..].split_at_mut(width);
            for j in 1..most {
                let factor = row[j] / pivot;
                if factor != 0.0 {
                    let target = &mut below[(j - 1) * width..][..most - j];
                    let carried = row[j..most].iter();
                    target
                        .iter_mut()
                        .zip(carried)
                        .for_each(|(t, r)| *t -= factor * r);
                }
            }
        }
        // Rows now hold D L^T.
        let mut x = right[..n].to_vec();
        for i in 0..n {
            let row = &self.rows[i * width..][..width.min(n - i)];
            let known = x[i] / row[0];
            for (j, entry) in row.iter().enumerate().skip(1) {
                x[i + j] -= entry * known;
            }
        }
        for i in (0..n).rev() {
            let row = &self.rows[i * width..][..width.min(n - i)];
            let later: f64 = (1..row.len()).map(|j| row[j] * x[i + j]).sum();
            x[i] = (x[i] - later) / row[0];
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_known_solution_is_found() {
        for (n, width) in [(1, 1), (5, 3), (40, 7), (3, 9)] {
            let mut matrix = BandedSymmetric::new(n, width);
            let known = |i: usize| libm::cos(3.0 * i as f64);
            let mut right = vec![0.0; n];
            for i in 0..n {
                for j in i..n.min(i + width) {
                    // diagonally dominant: condition below 4
                    let value = match j - i {
                        0 => 2.0 * width as f64,
                        step => libm::sin((i * 5 + step) as f64),
                    };
                    matrix.add(i, j, value);
                    right[i] += value * known(j);
                    if j > i {
                        right[j] += value * known(i);
                    }
                }
            }
            assert_eq!(matrix.diagonal(0), 2.0 * width as f64);
            let x = matrix.solve(&right).unwrap();
            assert!((0..n).all(|i| (x[i] - known(i)).abs() < 1e-13), "{n}");
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let mut matrix = BandedSymmetric::new(2, 2);
        assert!(matrix.clone().solve(&[1.0, 1.0]).is_none());
        for (row, column, value) in [(0, 0, 1.0), (0, 1, 2.0), (1, 1, 1.0)] {
            matrix.add(row, column, value);
        }
        assert!(matrix.solve(&[1.0, 1.0]).is_none());
    }
}
