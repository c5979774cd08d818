//! Anderson's acceleration of a fixed-point map g: with f = g(p) - p and the last few differences of f
//! and g as columns of F and G, the next point is g - G c, c = argmin |f - F c|.

/// How many differences are kept: more gain nothing on layouts, and cost.
const DEPTH: usize = 8;

/// The last few points of an iteration.
pub(super) struct Anderson {
    /// Differences of g and of f, the newest last.
    differences: Vec<[Vec<f64>; 2]>,
    /// F^T F.
    gram: [[f64; DEPTH]; DEPTH],
    last: Option<[Vec<f64>; 2]>,
    size: usize,
}

impl Anderson {
    /// For vectors of `size` numbers.
    pub(super) fn new(size: usize) -> Self {
        Anderson {
            differences: Vec::with_capacity(DEPTH),
            gram: [[0.0; DEPTH]; DEPTH],
            last: None,
            size,
        }
    }

    /// Whether the last point was extrapolated.
    pub(super) fn is_used(&self) -> bool {
        !self.differences.is_empty()
    }

    /// Starts afresh.
    pub(super) fn forget(&mut self) {
        self.differences.clear();
        self.last = None;
    }

    /// The next point after `at`, whose image is `to`.
    pub(super) fn extrapolate(&mut self, at: &[f64], to: &[f64]) -> Vec<f64> {
        let residual: Vec<f64> = to.iter().zip(at).map(|(g, p)| g - p).collect();
        if let Some([g, f]) = self.last.take() {
            self.push([difference(to, &g), difference(&residual, &f)]);
        }
        let mut next = to.to_vec();
        let coefficients = self.coefficients(&residual);
        for ([g, _], c) in self.differences.iter().zip(coefficients) {
            next.iter_mut().zip(g).for_each(|(next, g)| *next -= c * g);
        }
        self.last = Some([to.to_vec(), residual]);
        debug_assert_eq!(next.len(), self.size);
        next
    }

    fn push(&mut self, difference: [Vec<f64>; 2]) {
        if self.differences.len() == DEPTH {
            self.differences.remove(0);
            for i in 1..DEPTH {
                for j in 1..DEPTH {
                    self.gram[i - 1][j - 1] = self.gram[i][j];
                }
            }
        }
        self.differences.push(difference);
        let newest = self.differences.len() - 1;
        for i in 0..=newest {
            let product = dot(&self.differences[i][1], &self.differences[newest][1]);
            self.gram[i][newest] = product;
            self.gram[newest][i] = product;
        }
    }

    /// (F^T F + ridge) c = F^T f by Cholesky, the columns of F scaled to length 1. The ridge keeps
    /// columns that are nearly dependent from cancelling.
    fn coefficients(&self, residual: &[f64]) -> [f64; DEPTH] {
        const RIDGE: f64 = 1e-10;
        let count = self.differences.len();
        let scale = |i: usize| self.gram[i][i].max(f64::MIN_POSITIVE).sqrt();
        let mut lower = [[0.0; DEPTH]; DEPTH];
        let mut c = [0.0; DEPTH];
        for i in 0..count {
            for j in 0..=i {
                let inner: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let entry = self.gram[i][j] / (scale(i) * scale(j)) - inner;
                lower[i][j] = if i == j {
                    (entry + RIDGE).max(RIDGE).sqrt()
                } else {
                    entry / lower[j][j]
                };
            }
            let inner: f64 = (0..i).map(|k| lower[i][k] * c[k]).sum();
            c[i] = (dot(&self.differences[i][1], residual) / scale(i) - inner) / lower[i][i];
        }
        for i in (0..count).rev() {
            let inner: f64 = (i + 1..count).map(|k| lower[k][i] * c[k]).sum();
            c[i] = (c[i] - inner) / lower[i][i];
        }
        (0..count).for_each(|i| c[i] /= scale(i));
        c
    }
}

fn difference(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

/// The sum of products, in eight interleaved partial sums.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 8];
    let (a, a_rest) = a.as_chunks::<8>();
    let (b, b_rest) = b.as_chunks::<8>();
    for (a, b) in a.iter().zip(b) {
        (0..8).for_each(|k| sums[k] += a[k] * b[k]);
    }
    let rest = a_rest.iter().zip(b_rest).map(|(a, b)| a * b);
    sums.iter().sum::<f64>() + rest.sum::<f64>()
}
