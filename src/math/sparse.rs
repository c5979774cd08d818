//! Sparse symmetric positive definite systems A X = B: one door to faer's Cholesky factorisation.
//!
//! The work falls into three parts, each done as rarely as it can be: a [`Pattern`] (where the nonzero
//! entries of the lower triangle are) is analysed once ([`Analysis`]: fill-reducing ordering and
//! symbolic factor), each set of values on it is factored once ([`Factor`]), and a factor solves for
//! many right sides at a time. Solves are sequential (a parallel triangular solve is several times
//! slower); whoever has many of them runs them side by side.

use std::fmt;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// Why a system has no factor. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SparseError {
    /// The matrix is not positive definite: elimination breaks down at this unknown.
    NotPositiveDefinite {
        /// The unknown.
        unknown: usize,
    },
    /// The factor does not fit in memory, or its size not in 31 bits.
    TooLarge,
}

impl fmt::Display for SparseError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SparseError::NotPositiveDefinite { unknown } => {
                write!(f, "the system is singular at unknown {}", unknown + 1)
            }
            SparseError::TooLarge => f.write_str("the system is too large for this machine"),
        }
    }
}

impl std::error::Error for SparseError {}

/// Where a symmetric n x n matrix has entries: its lower triangle by columns, rows ascending, every
/// diagonal entry present.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    starts: Vec<u32>,
    rows: Vec<u32>,
}

impl Pattern {
    /// The pattern with the diagonal and an entry for each pair of unknowns; pairs may repeat, come in
    /// either order and name one unknown twice.
    ///
    /// # Panics
    /// A pair names an unknown that is not in 0..n.
    pub fn new(n: usize, pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Self {
        let lower = pairs
            .map(|[a, b]| (a.min(b), a.max(b)))
            .filter(|(a, b)| a != b);
        let mut starts = vec![0_u32; n + 1];
        for (column, _) in lower.clone() {
            starts[column as usize + 1] += 1;
        }
        for column in 0..n {
            starts[column + 1] += starts[column] + 1;
        }
        let mut next: Vec<u32> = starts[..n].to_vec();
        let mut rows = vec![0; starts[n] as usize];
        let diagonal = (0..n as u32).map(|i| (i, i));
        for (column, row) in diagonal.chain(lower) {
            assert!((row as usize) < n, "pair outside of the matrix");
            let place = &mut next[column as usize];
            rows[*place as usize] = row;
            *place += 1;
        }
        compact(starts, rows)
    }

    /// n, the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.starts.len() - 1
    }

    /// The number of entries of the lower triangle, which is how many values the pattern takes.
    pub fn entries(&self) -> usize {
        self.rows.len()
    }

    /// The rows of the entries of a column, ascending from the diagonal on; the columns' values follow one
    /// another.
    pub fn rows(&self, column: usize) -> &[u32] {
        &self.rows[self.starts[column] as usize..self.starts[column + 1] as usize]
    }

    /// Which of the values is the entry of this row and column, in either order; none when the pattern
    /// has no such entry.
    pub fn entry(&self, row: usize, column: usize) -> Option<usize> {
        let (column, row) = (row.min(column), row.max(column) as u32);
        let range = self.starts[column] as usize..self.starts[column + 1] as usize;
        let start = range.start;
        self.rows[range]
            .binary_search(&row)
            .ok()
            .map(|at| start + at)
    }

    fn symbolic(&self) -> SymbolicSparseColMatRef<'_, u32> {
        let n = self.unknowns();
        SymbolicSparseColMatRef::new_checked(n, n, &self.starts, None, &self.rows)
    }
}

/// Sorts each column and drops what repeats.
fn compact(mut starts: Vec<u32>, mut rows: Vec<u32>) -> Pattern {
    let mut kept = 0;
    let mut begin = 0;
    for column in 0..starts.len() - 1 {
        let end = starts[column + 1] as usize;
        rows[begin..end].sort_unstable();
        let first = kept;
        for at in begin..end {
            if kept == first || rows[kept - 1] != rows[at] {
                rows[kept] = rows[at];
                kept += 1;
            }
        }
        begin = end;
        starts[column + 1] = kept as u32;
    }
    rows.truncate(kept);
    rows.shrink_to_fit();
    Pattern { starts, rows }
}

/// How many numeric factorisations this process has made; with it a test holds that nothing is
/// factored twice.
pub fn factorisations() -> usize {
    FACTORISATIONS.load(Ordering::Relaxed)
}

static FACTORISATIONS: AtomicUsize = AtomicUsize::new(0);

/// A pattern with its fill-reducing ordering (approximate minimum degree) and symbolic factor. Shared
/// by all matrices of the pattern.
#[derive(Debug)]
pub struct Analysis {
    pattern: Pattern,
    symbolic: SymbolicCholesky<u32>,
}

impl Analysis {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`SparseError::TooLarge`].
    pub fn new(pattern: Pattern) -> Result<Arc<Self>, SparseError> {
        let symbolic = factorize_symbolic_cholesky(
            pattern.symbolic(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(|_| SparseError::TooLarge)?;
        Ok(Arc::new(Analysis { pattern, symbolic }))
    }

    /// The pattern.
    pub fn pattern(&self) -> &Pattern {
        &self.pattern
    }

    /// Factors the matrix whose entries stand in the order of the pattern.
    ///
    /// # Errors
    /// [`SparseError`]; the matrix is named by the unknown where elimination broke down.
    ///
    /// # Panics
    /// `entries` has not the length of the pattern.
    pub fn factor(self: &Arc<Self>, entries: &[f64]) -> Result<Factor, SparseError> {
        let mut factor = Factor {
            analysis: Arc::clone(self),
            values: Vec::new(),
            pool: Mutex::default(),
        };
        factor.refactor(entries)?;
        Ok(factor)
    }

    /// The unknown whose pivot faer reports: a position of the elimination order, counted from 0 by
    /// the supernodal and from 1 by the simplicial factorisation.
    fn eliminated(&self, reported: usize) -> usize {
        let position = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Simplicial(_) => reported - 1,
            SymbolicCholeskyRaw::Supernodal(_) => reported,
        };
        let order = self.symbolic.perm().map(|perm| perm.arrays().0[position]);
        order.map_or(position, |unknown| unknown as usize)
    }
}

/// A factored matrix. Solving takes `&self` and may be done from many threads at once.
pub struct Factor {
    analysis: Arc<Analysis>,
    values: Vec<f64>,
    pool: Mutex<Vec<(usize, MemBuffer)>>,
}

impl Factor {
    /// Replaces the matrix by another of the same pattern, in the same memory.
    ///
    /// # Errors
    /// As [`Analysis::factor`]; the factor is then unusable until the next success.
    pub fn refactor(&mut self, entries: &[f64]) -> Result<(), SparseError> {
        FACTORISATIONS.fetch_add(1, Ordering::Relaxed);
        let symbolic = &self.analysis.symbolic;
        let matrix = SparseColMatRef::new(self.analysis.pattern.symbolic(), entries);
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let mut memory = MemBuffer::try_new(need).map_err(|_| SparseError::TooLarge)?;
        self.values.resize(symbolic.len_val(), 0.0);
        let failure = symbolic
            .factorize_numeric_llt(
                &mut self.values,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                Default::default(),
            )
            .err();
        match failure {
            None => Ok(()),
            Some(LltError::NonPositivePivot { index }) => Err(SparseError::NotPositiveDefinite {
                unknown: self.analysis.eliminated(index),
            }),
        }
    }

    /// n, the number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.analysis.pattern.unknowns()
    }

    /// What the factor was made from, to make others.
    pub fn analysis(&self) -> &Arc<Analysis> {
        &self.analysis
    }

    /// Replaces right sides by solutions: `columns` vectors of n numbers, one after the other.
    /// Working memory is kept for the next call.
    ///
    /// # Panics
    /// `sides` is not `columns` times n long.
    pub fn solve(&self, columns: usize, sides: &mut [f64]) {
        let n = self.unknowns();
        assert_eq!(sides.len(), n * columns, "right sides of another size");
        let symbolic = &self.analysis.symbolic;
        let mut memory = self.take(columns);
        LltRef::new(symbolic, &self.values).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(sides, n, columns),
            Par::Seq,
            MemStack::new(&mut memory),
        );
        self.lock().push((columns, memory));
    }

    fn take(&self, columns: usize) -> MemBuffer {
        let mut pool = self.lock();
        match pool.iter().position(|(held, _)| *held == columns) {
            Some(at) => pool.swap_remove(at).1,
            None => {
                let symbolic = &self.analysis.symbolic;
                MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq))
            }
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<(usize, MemBuffer)>> {
        self.pool.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl fmt::Debug for Factor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Factor")
            .field("unknowns", &self.unknowns())
            .field("values", &self.values.len())
            .finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The Laplacian of a path of n vertices, its first vertex held: exact solutions are known.
    fn path(n: usize) -> (Arc<Analysis>, Vec<f64>) {
        let pairs = (1..n as u32).map(|i| [i, i - 1]);
        let analysis = Analysis::new(Pattern::new(n, pairs)).unwrap();
        let mut entries = vec![0.0; analysis.pattern().entries()];
        let mut add = |i, j, value: f64| entries[analysis.pattern().entry(i, j).unwrap()] += value;
        add(0, 0, 1.0);
        for i in 1..n {
            add(i, i, 1.0);
            add(i - 1, i - 1, 1.0);
            add(i, i - 1, -1.0);
        }
        (analysis, entries)
    }

    #[test]
    fn patterns_are_sorted_and_without_repeats() {
        let pairs = [[2, 0], [0, 2], [1, 1], [0, 1]];
        let pattern = Pattern::new(3, pairs.into_iter());
        assert_eq!(pattern.entries(), 5);
        assert_eq!(pattern.entry(0, 2), Some(2));
        assert_eq!(pattern.entry(2, 0), Some(2));
        assert_eq!(pattern.entry(1, 2), None);
    }

    #[test]
    fn all_right_sides_are_solved_together() {
        let n = 300;
        let (analysis, entries) = path(n);
        let factor = analysis.factor(&entries).unwrap();
        // A x with x_i = i and x_i = 1: the ends alone have a right side
        let mut sides = vec![0.0; 2 * n];
        (sides[0], sides[n - 1], sides[n]) = (-1.0, 1.0, 1.0);
        factor.solve(2, &mut sides);
        for i in 0..n {
            assert!((sides[i] - i as f64).abs() < 1e-9);
            assert!((sides[n + i] - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn another_matrix_of_the_pattern_takes_the_same_memory() {
        let (analysis, entries) = path(40);
        let mut factor = analysis.factor(&entries).unwrap();
        let double: Vec<f64> = entries.iter().map(|value| 2.0 * value).collect();
        factor.refactor(&double).unwrap();
        let mut side = vec![0.0; 40];
        side[0] = 2.0;
        factor.solve(1, &mut side);
        assert!(side.iter().all(|x| (x - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_singular_system_names_an_unknown_of_the_part_that_nothing_holds() {
        // two paths; only the first is held. Whole numbers: elimination gives an exact zero
        let pairs = (1..6_u32).filter(|&i| i != 3).map(|i| [i, i - 1]);
        let analysis = Analysis::new(Pattern::new(6, pairs)).unwrap();
        let mut entries = vec![0.0; analysis.pattern().entries()];
        let mut add = |i, j, value: f64| entries[analysis.pattern().entry(i, j).unwrap()] += value;
        add(0, 0, 1.0);
        for i in [1, 2, 4, 5] {
            add(i, i, 1.0);
            add(i - 1, i - 1, 1.0);
            add(i, i - 1, -1.0);
        }
        match analysis.factor(&entries) {
            Err(SparseError::NotPositiveDefinite { unknown }) => assert!(unknown >= 3),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn the_empty_system_has_a_solution() {
        let analysis = Analysis::new(Pattern::new(0, std::iter::empty())).unwrap();
        analysis.factor(&[]).unwrap().solve(3, &mut []);
    }
}
