//! Quantities of a block of things, one column of numbers for each quantity. A plain loop over the columns'
//! rows, with no branches in it, is what compilers make vector instructions of; the results are those of
//! the plain operations, bit by bit.

use pulp::Arch;

/// How many things are in a block.
pub const BLOCK: usize = 32;

/// One quantity of each of them.
pub type Column = [f64; BLOCK];

/// x, y and z of a vector of each of them.
pub type Vectors = [Column; 3];

/// Does `work` with the widest vector instructions that this machine has. Only what is inlined into it gains
/// by them; nothing is fused or reordered.
#[inline(always)]
pub fn widely<R>(work: impl FnOnce() -> R) -> R {
    Arch::new().dispatch(work)
}

/// The numbers in row `i`.
#[inline(always)]
pub fn row<const N: usize>(columns: &[Column; N], i: usize) -> [f64; N] {
    let mut row = [0.0; N];
    for (out, column) in row.iter_mut().zip(columns) {
        *out = column[i];
    }
    row
}

/// Puts `numbers` into row `i`.
#[inline(always)]
pub fn set_row<const N: usize>(columns: &mut [Column; N], i: usize, numbers: [f64; N]) {
    for (column, number) in columns.iter_mut().zip(numbers) {
        column[i] = number;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_wide_work_is_plain_work() {
        let mut columns = [[0.0; BLOCK]; 3];
        for i in 0..BLOCK {
            set_row(&mut columns, i, [i as f64, 0.1 * i as f64, -1.0]);
        }
        assert_eq!(row(&columns, 7), [7.0, 0.1 * 7.0, -1.0]);
        let root = |columns: &Vectors| {
            let mut out = [0.0; BLOCK];
            for i in 0..BLOCK {
                let [x, y, z] = row(columns, i);
                out[i] = (x * x + y * y + z * z).sqrt() / (1.0 + x);
            }
            out
        };
        assert_eq!(widely(|| root(&columns)), root(&columns));
    }
}
