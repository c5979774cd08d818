//! The linear half of the problem: thin-plate coefficients for given positions and given sites, by
//! Householder QR of
//!
//! ```text
//! B = [Phi Q2, 1, p]      Phi_ij = phi(|p_i - s_j|),  phi(r) = r^2 log r
//! ```
//!
//! N x l, where the columns of Q2 (l x (l-3)) span the null space of T^T, T = \[1 s\]: whatever the
//! coefficients, the side conditions sum w_j = 0 and sum w_j s_j^T = 0 hold. Columns are scaled to
//! norm 1 and l rows of sqrt(ridge) I stand below, so that sites that meet cost nothing but accuracy.

use faer::dyn_stack::{MemBuffer, MemStack, StackReq};
use faer::linalg::householder;
use faer::linalg::matmul::matmul;
use faer::linalg::qr::no_pivoting::factor::{
    qr_in_place, qr_in_place_scratch, recommended_block_size,
};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Accum, Conj, Mat, MatMut, MatRef, Par};

use super::Plate;

/// A workspace for problems of one size; see [`Design::solve`].
pub(super) struct Design {
    samples: usize,
    sites: usize,
    ridge: f64,
    /// What each sample's row is multiplied by, N.
    pub(super) weights: Vec<f64>,
    /// phi(|p_i - s_j|), N x l.
    pub(super) kernel: Mat<f64>,
    /// log |p_i - s_j|^2, N x l.
    pub(super) logs: Mat<f64>,
    reflectors: Reflectors,
    scale: Vec<f64>,
    /// Householder vectors and R of the stacked matrix, (N+l) x l.
    factor: Mat<f64>,
    blocks: Mat<f64>,
    /// Q^T \[X; 0\], (N+l) x m.
    projected: Mat<f64>,
    scratch: MemBuffer,
}

impl Design {
    pub(super) fn new(weights: &[f64], sites: usize, width: usize, ridge: f64) -> Self {
        let samples = weights.len();
        let rows = samples + sites;
        let block = recommended_block_size::<f64>(rows, sites);
        let apply = |columns| {
            householder::apply_block_householder_sequence_transpose_on_the_left_in_place_scratch::<
                f64,
            >(rows, block, columns)
        };
        let factor = qr_in_place_scratch::<f64>(rows, sites, block, Par::Seq, Default::default());
        let request = StackReq::any_of(&[factor, apply(width), apply(sites)]);
        Design {
            samples,
            sites,
            ridge,
            weights: weights.to_vec(),
            kernel: Mat::zeros(samples, sites),
            logs: Mat::zeros(samples, sites),
            reflectors: Reflectors::new(sites),
            scale: vec![0.0; sites],
            factor: Mat::zeros(rows, sites),
            blocks: Mat::zeros(block, sites),
            projected: Mat::zeros(rows, width),
            scratch: MemBuffer::new(request),
        }
    }

    /// Solves for the coefficients; returns the weighted squared residual, the ridge's share included.
    pub(super) fn solve(
        &mut self,
        points: MatRef<'_, f64>,
        sites: MatRef<'_, f64>,
        targets: MatRef<'_, f64>,
    ) -> f64 {
        self.fill(points, sites);
        let (samples, count) = (self.samples, self.sites);
        self.projected.fill(0.0);
        for c in 0..targets.ncols() {
            let column = &mut self.projected.col_as_slice_mut(c)[..samples];
            for (i, (value, weight)) in column.iter_mut().zip(&self.weights).enumerate() {
                *value = weight * targets[(i, c)];
            }
        }
        let stack = MemStack::new(&mut self.scratch);
        qr_in_place(
            self.factor.as_mut(),
            self.blocks.as_mut(),
            Par::Seq,
            stack,
            Default::default(),
        );
        householder::apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj(
            self.factor.as_ref(),
            self.blocks.as_ref(),
            Conj::No,
            self.projected.as_mut(),
            Par::Seq,
            stack,
        );
        let tail = self.projected.as_ref().subrows(count, samples);
        tail.squared_norm_l2()
    }

    /// Coefficients of the last [`Design::solve`].
    pub(super) fn plate(&mut self, sites: MatRef<'_, f64>, plate: &mut Plate) {
        let count = self.sites;
        let mut solved = self.projected.as_ref().subrows(0, count).to_owned();
        let upper = self.factor.as_ref().subrows(0, count);
        solve_upper_triangular_in_place(upper, solved.as_mut(), Par::Seq);
        plate.sites.copy_from(sites);
        plate.weights.fill(0.0);
        for column in 0..solved.ncols() {
            for row in 0..count {
                let value = solved[(row, column)] / self.scale[row];
                match row.checked_sub(count - 3) {
                    Some(row) => plate.affine[(row, column)] = value,
                    None => plate.weights[(row + 3, column)] = value,
                }
            }
        }
        self.reflectors.apply_left(&mut plate.weights);
    }

    /// V, l x l: the covariance of the last solve's coefficients w, up to a factor.
    pub(super) fn covariance(&self) -> Mat<f64> {
        let count = self.sites;
        let mut inverse = Mat::identity(count, count);
        let upper = self.factor.as_ref().subrows(0, count);
        solve_upper_triangular_in_place(upper, inverse.as_mut(), Par::Seq);
        let mut root = Mat::from_fn(count, count, |j, c| match j.checked_sub(3) {
            Some(row) => inverse[(row, c)] / self.scale[row],
            None => 0.0,
        });
        self.reflectors.apply_left(&mut root);
        let (mut covariance, root) = (Mat::zeros(count, count), root.as_ref());
        let to = covariance.as_mut();
        matmul(to, Accum::Replace, root, root.transpose(), 1.0, Par::Seq);
        covariance
    }

    /// Weighted residual of the last solve, written to the first N rows of `residual`, (N+l) x m; the rows
    /// below hold the ridge's share.
    pub(super) fn residual(&mut self, residual: &mut Mat<f64>) {
        residual.copy_from(&self.projected);
        residual.as_mut().subrows_mut(0, self.sites).fill(0.0);
        self.rotate(residual.as_mut());
    }

    /// The orthonormal columns of the stacked matrix, written to `basis`, (N+l) x l.
    pub(super) fn orthonormal(&mut self, basis: &mut Mat<f64>) {
        basis.fill(0.0);
        for j in 0..self.sites {
            basis[(j, j)] = 1.0;
        }
        self.rotate(basis.as_mut());
    }

    fn rotate(&mut self, matrix: MatMut<'_, f64>) {
        householder::apply_block_householder_sequence_on_the_left_in_place_with_conj(
            self.factor.as_ref(),
            self.blocks.as_ref(),
            Conj::No,
            matrix,
            Par::Seq,
            MemStack::new(&mut self.scratch),
        );
    }

    /// Writes the scaled, stacked matrix to `factor`.
    fn fill(&mut self, points: MatRef<'_, f64>, sites: MatRef<'_, f64>) {
        let (samples, count) = (self.samples, self.sites);
        kernel_and_logs(points, sites, &mut self.kernel, &mut self.logs);
        self.reflectors.annihilate(sites);
        self.factor.fill(0.0);
        // Phi Q, whose first three columns make room: columns 3.. move to the front.
        let mut turned = self.factor.as_mut().subrows_mut(0, samples);
        turned.copy_from(&self.kernel);
        self.reflectors.apply_right(&mut self.factor, samples);
        for j in 3..count {
            let (before, column) = self.factor.as_mut().split_at_col_mut(j);
            before.col_mut(j - 3).copy_from(column.col(0));
        }
        self.factor.as_mut().subrows_mut(samples, count).fill(0.0);
        for i in 0..samples {
            self.factor[(i, count - 3)] = 1.0;
            self.factor[(i, count - 2)] = points[(i, 0)];
            self.factor[(i, count - 1)] = points[(i, 1)];
        }
        let ridge = self.ridge.sqrt();
        for j in 0..count {
            let column = &mut self.factor.col_as_slice_mut(j)[..samples];
            weigh(column, &self.weights);
            let norm = column.iter().map(|x| x * x).sum::<f64>().sqrt();
            let norm = if norm > 0.0 { norm } else { 1.0 };
            column.iter_mut().for_each(|x| *x /= norm);
            self.scale[j] = norm;
            self.factor[(samples + j, j)] = ridge;
        }
    }
}

/// Every row by its weight.
pub(super) fn weigh(column: &mut [f64], weights: &[f64]) {
    let rows = column.iter_mut().zip(weights);
    rows.for_each(|(value, weight)| *value *= weight);
}

/// phi and log r^2 between `points` (N x 2) and `sites` (l x 2).
pub(super) fn kernel_and_logs(
    points: MatRef<'_, f64>,
    sites: MatRef<'_, f64>,
    kernel: &mut Mat<f64>,
    logs: &mut Mat<f64>,
) {
    for j in 0..sites.nrows() {
        let (x, y) = (sites[(j, 0)], sites[(j, 1)]);
        let values = kernel.col_as_slice_mut(j).iter_mut();
        let columns = values.zip(logs.col_as_slice_mut(j));
        for (i, (value, log)) in columns.enumerate() {
            let (dx, dy) = (points[(i, 0)] - x, points[(i, 1)] - y);
            let squared = dx * dx + dy * dy;
            *log = libm::log(squared.max(1e-300));
            *value = 0.5 * squared * *log;
        }
    }
}

/// Three Householder reflections H1 H2 H3 = Q that turn T = \[1 s\] (l x 3) into a triangle, so that
/// the columns 3.. of Q are orthogonal to T. A column that is nothing new is left alone.
struct Reflectors {
    vectors: [Vec<f64>; 3],
}

impl Reflectors {
    fn new(sites: usize) -> Self {
        Reflectors {
            vectors: std::array::from_fn(|_| vec![0.0; sites]),
        }
    }

    fn annihilate(&mut self, sites: MatRef<'_, f64>) {
        for c in 0..3 {
            let (before, rest) = self.vectors.split_at_mut(c);
            let vector = &mut rest[0];
            for (j, value) in vector.iter_mut().enumerate() {
                *value = if c == 0 { 1.0 } else { sites[(j, c - 1)] };
            }
            for earlier in before {
                reflect(earlier, vector);
            }
            vector[..c].fill(0.0);
            let norm = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
            if norm > 0.0 && vector[c..].len() > 1 {
                vector[c] += norm.copysign(vector[c]);
                let length = vector.iter().map(|x| x * x).sum::<f64>().sqrt();
                vector.iter_mut().for_each(|x| *x *= 2f64.sqrt() / length);
            } else {
                vector.fill(0.0);
            }
        }
    }

    /// Phi <- Phi Q, for Phi the first `rows` rows of `matrix`.
    fn apply_right(&self, matrix: &mut Mat<f64>, rows: usize) {
        let mut sums = vec![0.0; rows];
        for vector in &self.vectors {
            sums.fill(0.0);
            for (j, v) in vector.iter().enumerate() {
                let column = &matrix.col_as_slice(j)[..rows];
                sums.iter_mut()
                    .zip(column)
                    .for_each(|(sum, x)| *sum += x * v);
            }
            for (j, v) in vector.iter().enumerate() {
                let column = &mut matrix.col_as_slice_mut(j)[..rows];
                column
                    .iter_mut()
                    .zip(&sums)
                    .for_each(|(x, sum)| *x -= sum * v);
            }
        }
    }

    /// W <- Q W.
    fn apply_left(&self, matrix: &mut Mat<f64>) {
        for column in 0..matrix.ncols() {
            for vector in self.vectors.iter().rev() {
                reflect(vector, matrix.col_as_slice_mut(column));
            }
        }
    }
}

/// `target` <- (I - v v^T) target for |v|^2 = 2 (or v = 0).
fn reflect(vector: &[f64], target: &mut [f64]) {
    let dot: f64 = vector.iter().zip(&*target).map(|(v, x)| v * x).sum();
    target
        .iter_mut()
        .zip(vector)
        .for_each(|(x, v)| *x -= dot * v);
}
