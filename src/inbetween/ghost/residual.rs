//! What a ghost does not carry at the keys, a few numbers for each thing that is carried.

use rayon::prelude::*;

/// Things that one thread takes at a time.
const CHUNK: usize = 1024;

/// N numbers for each thing and key, in single precision: they are corrections.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Residual<const N: usize> {
    keys: usize,
    /// Thing after thing, key after key.
    numbers: Vec<[f32; N]>,
}

impl<const N: usize> Residual<N> {
    /// The numbers of `things` things at `keys` keys; with no keys there is no residual.
    pub(super) fn new(
        things: usize,
        keys: usize,
        of: impl Fn(usize, usize) -> [f64; N] + Sync,
    ) -> Self {
        let numbers = (0..things * keys)
            .into_par_iter()
            .with_min_len(CHUNK)
            .map(|at| of(at / keys, at % keys).map(|number| number as f32))
            .collect();
        Residual { keys, numbers }
    }

    /// The numbers of a thing, blended by the weights of the keys.
    pub(super) fn blend(&self, thing: usize, weights: &[f64]) -> [f64; N] {
        let mut sum = [0.0; N];
        if self.keys > 0 {
            let numbers = &self.numbers[thing * self.keys..(thing + 1) * self.keys];
            for (numbers, weight) in numbers.iter().zip(weights) {
                for (sum, number) in sum.iter_mut().zip(numbers) {
                    *sum += weight * f64::from(*number);
                }
            }
        }
        sum
    }
}
