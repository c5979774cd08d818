//! Differences from the mean shape made larger or smaller.

use std::sync::Arc;

use crate::diag::{Diagnostic, Result};
use crate::loom::{Layout, Loom, Parts};

/// The loom with every shape's difference from h_0, the mean of the frames, multiplied by `amount`: 1
/// leaves it, 0 stays at the mean, -1 turns differences round.
///
/// # Errors
/// The amount is not finite.
pub fn exaggerate(loom: &Loom, amount: f64) -> Result<Loom> {
    if !amount.is_finite() {
        return Diagnostic::error("the amount must be a number").err();
    }
    let m = loom.pose().modes();
    let mut scaling = vec![0.0; m * m];
    (0..m).for_each(|j| scaling[j * m + j] = amount);
    let layout = loom.layout();
    Loom::new(Parts {
        pose: Arc::new(loom.pose().map_values(&scaling, &vec![0.0; m])),
        layout: Arc::new(Layout {
            coordinates: layout.coordinates.iter().map(|x| amount * x).collect(),
            ..layout.as_ref().clone()
        }),
        ..loom.parts()
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn differences_from_the_mean_grow_by_the_amount() {
        let loom = ring(10, 12, true);
        let mean = loom.shape().offset().to_vec();
        for amount in [0.0, 1.0, 2.5, -1.0] {
            let more = exaggerate(&loom, amount).unwrap();
            let (a, b) = (loom.shape_at(4.4).unwrap(), more.shape_at(4.4).unwrap());
            for ((a, b), mean) in a.iter().zip(&b).zip(&mean) {
                assert!((mean + amount * (a - mean) - b).abs() < 1e-13);
            }
        }
        assert!(exaggerate(&loom, f64::NAN).is_err());
    }
}
