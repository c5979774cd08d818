//! Least squares over a growing list of columns: minimises |B c - X|^2 for n x m right sides X, one
//! column of B appended at a time. Q is kept by classical Gram-Schmidt, done twice, which keeps it
//! orthogonal to rounding; each column updates the residual of all right sides at once. Appending
//! column l costs 4 n l + 2 n m multiplications.

use pulp::{Arch, Simd, WithSimd};

/// A column is dependent when less than this part of it is new.
const DEPENDENT: f64 = 1e-13;

/// B = Q R, Q^T X and X - Q Q^T X. Columns are contiguous everywhere.
#[derive(Debug, Clone)]
pub struct GrowingQr {
    rows: usize,
    rhs: usize,
    arch: Arch,
    q: Vec<f64>,
    r: Vec<Vec<f64>>,
    projected: Vec<f64>,
    residual: Vec<f64>,
}

impl GrowingQr {
    /// No columns yet; `residual` holds the right sides, `rhs` columns of `rows` numbers.
    ///
    /// # Panics
    /// `residual` has another length.
    pub fn new(rows: usize, rhs: usize, residual: Vec<f64>) -> Self {
        assert_eq!(residual.len(), rows * rhs, "right sides must be rows x rhs");
        GrowingQr {
            rows,
            rhs,
            arch: Arch::new(),
            q: Vec::new(),
            r: Vec::new(),
            projected: Vec::new(),
            residual,
        }
    }

    /// How many columns there are.
    pub fn columns(&self) -> usize {
        self.r.len()
    }

    /// The part of the right sides that the columns do not reach, `rhs` columns of `rows` numbers.
    pub fn residual(&self) -> &[f64] {
        &self.residual
    }

    /// Appends a column. False, and nothing changes, when it depends on those before it.
    ///
    /// # Panics
    /// `column` has another length than the right sides.
    pub fn append(&mut self, column: &[f64]) -> bool {
        assert_eq!(column.len(), self.rows, "a column must have n rows");
        let size = norm(self.arch, column);
        if size == 0.0 || !size.is_finite() {
            return false;
        }
        let mut v: Vec<f64> = column.iter().map(|x| x / size).collect();
        let mut r = vec![0.0; self.columns()];
        for _ in 0..2 {
            self.orthogonalise(&mut v, &mut r);
        }
        let new = norm(self.arch, &v);
        if new < DEPENDENT {
            return false;
        }
        v.iter_mut().for_each(|x| *x /= new);
        r.push(new);
        r.iter_mut().for_each(|x| *x *= size);
        self.reduce_residual(&v);
        self.q.extend_from_slice(&v);
        self.r.push(r);
        true
    }

    /// The coefficients that minimise |B c - X| with the first `columns` columns: `rhs` columns of
    /// `columns` numbers.
    ///
    /// # Panics
    /// There are not so many columns.
    pub fn solve(&self, columns: usize) -> Vec<f64> {
        let mut solution = Vec::with_capacity(columns * self.rhs);
        for j in 0..self.rhs {
            let mut c: Vec<f64> = (0..columns)
                .map(|i| self.projected[i * self.rhs + j])
                .collect();
            for i in (0..columns).rev() {
                let (column, above) = (&self.r[i], i);
                c[i] /= column[above];
                let x = c[i];
                for (c, r) in c[..above].iter_mut().zip(column) {
                    *c -= x * r;
                }
            }
            solution.extend(c);
        }
        solution
    }

    /// v <- v - Q Q^T v; the factors are added to `r`.
    fn orthogonalise(&self, v: &mut [f64], r: &mut [f64]) {
        let mut factors = vec![0.0; r.len()];
        self.arch.dispatch(Dots {
            columns: &self.q,
            v,
            factors: &mut factors,
        });
        self.arch.dispatch(Subtract {
            columns: &self.q,
            v,
            factors: &factors,
        });
        r.iter_mut().zip(&factors).for_each(|(r, f)| *r += f);
    }

    /// X <- X - q q^T X; q^T X is kept.
    fn reduce_residual(&mut self, q: &[f64]) {
        let mut factors = vec![0.0; self.rhs];
        self.arch.dispatch(Dots {
            columns: &self.residual,
            v: q,
            factors: &mut factors,
        });
        for (column, &factor) in self.residual.chunks_exact_mut(self.rows).zip(&factors) {
            self.arch.dispatch(Subtract {
                columns: q,
                v: column,
                factors: &[factor],
            });
        }
        self.projected.extend(factors);
    }
}

/// Euclidean length.
fn norm(arch: Arch, v: &[f64]) -> f64 {
    let mut square = [0.0];
    arch.dispatch(Dots {
        columns: v,
        v,
        factors: &mut square,
    });
    square[0].sqrt()
}

/// factors_j = column_j . v, two accumulators of vectors each, remainder last.
struct Dots<'a> {
    columns: &'a [f64],
    v: &'a [f64],
    factors: &'a mut [f64],
}

impl WithSimd for Dots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (v_head, v_tail) = S::as_simd_f64s(self.v);
        let columns = self.columns.chunks_exact(self.v.len().max(1));
        for (column, factor) in columns.zip(self.factors) {
            let (head, tail) = S::as_simd_f64s(column);
            let mut sums = [simd.splat_f64s(0.0); 4];
            let (blocks, rest) = head.as_chunks::<4>();
            let (v_blocks, v_rest) = v_head.as_chunks::<4>();
            for (a, b) in blocks.iter().zip(v_blocks) {
                for i in 0..4 {
                    sums[i] = simd.mul_add_f64s(a[i], b[i], sums[i]);
                }
            }
            for (a, b) in rest.iter().zip(v_rest) {
                sums[0] = simd.mul_add_f64s(*a, *b, sums[0]);
            }
            let pairs = [
                simd.add_f64s(sums[0], sums[1]),
                simd.add_f64s(sums[2], sums[3]),
            ];
            let mut sum = simd.reduce_sum_f64s(simd.add_f64s(pairs[0], pairs[1]));
            for (a, b) in tail.iter().zip(v_tail) {
                sum += a * b;
            }
            *factor = sum;
        }
    }
}

/// v <- v - sum_j factors_j column_j, four columns a pass.
struct Subtract<'a> {
    columns: &'a [f64],
    v: &'a mut [f64],
    factors: &'a [f64],
}

impl WithSimd for Subtract<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let rows = self.v.len();
        let (v_head, v_tail) = S::as_mut_simd_f64s(self.v);
        let (fours, rest) = self.factors.as_chunks::<4>();
        for (block, four) in fours.iter().enumerate() {
            let start = 4 * block * rows;
            let column =
                |i: usize| S::as_simd_f64s(&self.columns[start + i * rows..start + (i + 1) * rows]);
            let ((a, at), (b, bt), (c, ct), (d, dt)) = (column(0), column(1), column(2), column(3));
            let [fa, fb, fc, fd] = four.map(|f| simd.splat_f64s(-f));
            for ((((v, a), b), c), d) in v_head.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                let sum = simd.mul_add_f64s(fb, *b, simd.mul_add_f64s(fa, *a, *v));
                *v = simd.mul_add_f64s(fd, *d, simd.mul_add_f64s(fc, *c, sum));
            }
            for (i, v) in v_tail.iter_mut().enumerate() {
                *v -= four[0] * at[i] + four[1] * bt[i] + four[2] * ct[i] + four[3] * dt[i];
            }
        }
        for (i, factor) in rest.iter().enumerate() {
            let start = (4 * fours.len() + i) * rows;
            let (head, tail) = S::as_simd_f64s(&self.columns[start..start + rows]);
            let minus = simd.splat_f64s(-factor);
            for (v, a) in v_head.iter_mut().zip(head) {
                *v = simd.mul_add_f64s(minus, *a, *v);
            }
            for (v, a) in v_tail.iter_mut().zip(tail) {
                *v -= factor * a;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Fixed numbers in (-1, 1), without pattern.
    fn noise(count: usize, seed: u32) -> Vec<f64> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                f64::from(state >> 8) / f64::from(1 << 23) - 1.0
            })
            .collect()
    }

    #[test]
    fn a_combination_of_the_columns_is_found_and_leaves_nothing() {
        for (rows, columns) in [(37, 1), (37, 13), (37, 37), (8, 5), (3, 2)] {
            let matrix = noise(rows * columns, 7);
            let known = noise(columns * 2, 3);
            let rhs: Vec<f64> = (0..2 * rows)
                .map(|at| {
                    let (j, i) = (at / rows, at % rows);
                    (0..columns)
                        .map(|c| matrix[c * rows + i] * known[j * columns + c])
                        .sum()
                })
                .collect();
            let mut qr = GrowingQr::new(rows, 2, rhs);
            for column in matrix.chunks_exact(rows) {
                assert!(qr.append(column));
            }
            // rounding times the condition of these matrices, below 1e4
            assert!(qr.residual().iter().all(|x| x.abs() < 1e-12));
            let found = qr.solve(columns);
            assert!(found.iter().zip(&known).all(|(a, b)| (a - b).abs() < 1e-10));
        }
    }

    #[test]
    fn columns_stay_orthogonal_when_they_nearly_depend() {
        let rows = 30;
        let mut qr = GrowingQr::new(rows, 0, Vec::new());
        let first = noise(rows, 1);
        qr.append(&first);
        for seed in 2..12 {
            let near: Vec<f64> = first
                .iter()
                .zip(noise(rows, seed))
                .map(|(a, b)| a + 1e-9 * b)
                .collect();
            assert!(qr.append(&near));
        }
        for i in 0..11 {
            for j in 0..=i {
                let column = |j: usize| &qr.q[j * rows..(j + 1) * rows];
                let dot: f64 = column(i).iter().zip(column(j)).map(|(a, b)| a * b).sum();
                assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn a_dependent_column_is_refused_and_changes_nothing() {
        let mut qr = GrowingQr::new(5, 1, noise(5, 9));
        let column = noise(5, 4);
        assert!(qr.append(&column) && !qr.append(&[0.0; 5]));
        let before = qr.residual().to_vec();
        let twice: Vec<f64> = column.iter().map(|x| 2.0 * x).collect();
        assert!(!qr.append(&twice));
        assert_eq!((qr.columns(), qr.residual()), (1, &before[..]));
    }
}
