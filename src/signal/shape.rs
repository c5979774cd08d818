//! h, the shape signal (CH12 §2.1): h(x) = h_0 + H x from the shape subspace R^m to the shape space R^d.

use std::fmt;

/// So many coordinates at a time stay in the first-level cache while the vectors stream by.
const CHUNK: usize = 1024;

/// The offset h_0 and the vectors h_1 .. h_m. Orthonormal where fitted to frames; not after a transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeSignal {
    offset: Vec<f64>,
    vectors: Vec<f64>,
    modes: usize,
}

/// Why numbers are not a shape signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ShapeError {
    /// The vectors are not m times d numbers.
    Counts,
    /// This number is not finite; offset first, then the vectors one after another, from 0.
    NotFinite {
        /// Which one.
        index: usize,
    },
}

impl fmt::Display for ShapeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ShapeError::Counts => f.write_str("the shape vectors do not have the offset's length"),
            ShapeError::NotFinite { index } => {
                write!(f, "number {} of the shape signal is not finite", index + 1)
            }
        }
    }
}

impl std::error::Error for ShapeError {}

impl ShapeSignal {
    /// Of h_0 (d numbers) and `modes` vectors one after another (m times d numbers).
    ///
    /// # Errors
    /// See [`ShapeError`].
    pub fn new(offset: Vec<f64>, vectors: Vec<f64>, modes: usize) -> Result<Self, ShapeError> {
        if vectors.len() != offset.len() * modes {
            return Err(ShapeError::Counts);
        }
        match offset.iter().chain(&vectors).position(|x| !x.is_finite()) {
            Some(index) => Err(ShapeError::NotFinite { index }),
            None => Ok(ShapeSignal {
                offset,
                vectors,
                modes,
            }),
        }
    }

    /// d, the dimension of the shape space.
    pub fn dimension(&self) -> usize {
        self.offset.len()
    }

    /// m, the dimension of the shape subspace.
    pub fn modes(&self) -> usize {
        self.modes
    }

    /// h_0, d numbers.
    pub fn offset(&self) -> &[f64] {
        &self.offset
    }

    /// h_1 .. h_m one after another, d numbers each: the columns of H.
    pub fn vectors(&self) -> &[f64] {
        &self.vectors
    }

    /// Column `mode` of H, from 0: d numbers.
    ///
    /// # Panics
    /// There is no such mode.
    pub fn vector(&self, mode: usize) -> &[f64] {
        assert!(mode < self.modes, "mode {mode} of {}", self.modes);
        let d = self.dimension();
        &self.vectors[mode * d..(mode + 1) * d]
    }

    /// Writes h(`x`) to `z`. Each coordinate is a sum in the order of the modes of plain products: the
    /// same bits on every machine.
    ///
    /// # Panics
    /// `x` is not m long, or `z` not d.
    pub fn evaluate(&self, x: &[f64], z: &mut [f64]) {
        assert_eq!(z.len(), self.dimension(), "z has d numbers");
        self.evaluate_from(0, x, z);
    }

    /// Writes the coordinates of h(`x`) from number `start` on to `z`, as many as it holds.
    ///
    /// # Panics
    /// `x` is not m long, or `z` reaches beyond the last coordinate.
    pub fn evaluate_from(&self, start: usize, x: &[f64], z: &mut [f64]) {
        z.copy_from_slice(&self.offset[start..start + z.len()]);
        self.add(start, x, z);
    }

    /// Writes H `x` to `z`: h's change along a direction.
    ///
    /// # Panics
    /// `x` is not m long, or `z` not d.
    pub fn direction(&self, x: &[f64], z: &mut [f64]) {
        assert_eq!(z.len(), self.dimension(), "z has d numbers");
        z.fill(0.0);
        self.add(0, x, z);
    }

    /// Writes H^T (`z` - h_0) to `x`: the nearest point of the subspace, where the vectors are orthonormal.
    ///
    /// # Panics
    /// `x` is not m long, or `z` not d.
    pub fn project(&self, z: &[f64], x: &mut [f64]) {
        assert_eq!((z.len(), x.len()), (self.dimension(), self.modes));
        for (mode, x) in x.iter_mut().enumerate() {
            let vector = self.vector(mode);
            let from_offset = |c: usize| (z[c] - self.offset[c]) * vector[c];
            *x = (0..z.len()).map(from_offset).sum();
        }
    }

    fn add(&self, start: usize, x: &[f64], z: &mut [f64]) {
        assert_eq!(x.len(), self.modes, "x has m numbers");
        for (chunk, z) in z.chunks_mut(CHUNK).enumerate() {
            let from = start + chunk * CHUNK;
            let (d, length) = (self.offset.len(), z.len());
            let part = |mode: usize| &self.vectors[mode * d + from..][..length];
            let (fours, rest) = x.as_chunks::<4>();
            for (four, x) in fours.iter().enumerate() {
                let [a, b, c, d] = std::array::from_fn(|k| part(4 * four + k));
                for (i, z) in z.iter_mut().enumerate() {
                    *z = (((*z + x[0] * a[i]) + x[1] * b[i]) + x[2] * c[i]) + x[3] * d[i];
                }
            }
            for (k, x) in rest.iter().enumerate() {
                let vector = part(4 * fours.len() + k);
                z.iter_mut().zip(vector).for_each(|(z, h)| *z += x * h);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(d: usize, m: usize) -> ShapeSignal {
        let wave = |i: usize| ((i * 37 + 11) % 101) as f64 / 50.0 - 1.0;
        let vectors = (0..d * m).map(wave).collect();
        ShapeSignal::new((0..d).map(|i| i as f64).collect(), vectors, m).unwrap()
    }

    #[test]
    fn every_coordinate_is_the_sum_over_the_modes_in_order() {
        for (d, m) in [(5, 0), (7, 3), (1500, 9)] {
            let signal = signal(d, m);
            let x: Vec<f64> = (0..m).map(|j| 0.3 + j as f64).collect();
            let (mut z, mut change) = (vec![0.0; d], vec![0.0; d]);
            signal.evaluate(&x, &mut z);
            signal.direction(&x, &mut change);
            for c in 0..d {
                let sum = |from| {
                    x.iter()
                        .enumerate()
                        .fold(from, |z, (j, x)| z + x * signal.vector(j)[c])
                };
                assert_eq!((z[c], change[c]), (sum(signal.offset()[c]), sum(0.0)));
            }
            let mut part = vec![0.0; d / 2];
            signal.evaluate_from(d - d / 2, &x, &mut part);
            assert_eq!(part, z[d - d / 2..]);
        }
    }

    #[test]
    fn projection_undoes_evaluation_for_orthonormal_vectors() {
        let vectors = vec![0.6, 0.8, 0.0, -0.8, 0.6, 0.0];
        let signal = ShapeSignal::new(vec![1.0, 2.0, 3.0], vectors, 2).unwrap();
        let (mut z, mut x) = ([0.0; 3], [0.0; 2]);
        signal.evaluate(&[0.5, -2.0], &mut z);
        signal.project(&z, &mut x);
        // two roundings of numbers of size 2
        assert!((x[0] - 0.5).abs() < 1e-15 && (x[1] + 2.0).abs() < 1e-15);
    }

    #[test]
    fn wrong_counts_and_numbers_are_refused() {
        let error = ShapeSignal::new(vec![0.0; 3], vec![0.0; 5], 2).unwrap_err();
        assert_eq!(error, ShapeError::Counts);
        let error = ShapeSignal::new(vec![0.0; 2], vec![0.0, f64::NAN], 1).unwrap_err();
        assert_eq!(error, ShapeError::NotFinite { index: 3 });
    }
}
