//! Time backwards.

use crate::diag::Result;
use crate::loom::Loom;
use crate::signal::warp::Warp;

/// The loom run backwards: time t shows what n + 1 - t showed. Twice is the identity, to the bit.
///
/// # Errors
/// Never for a loom that stands.
pub fn reverse(loom: &Loom) -> Result<Loom> {
    let frames = loom.frames();
    let time = loom.time().with_warp(Warp::Reverse { frames });
    loom.with_time(time.map_err(super::impossible)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::travelling;

    #[test]
    fn frames_come_in_the_other_order_and_twice_is_the_identity() {
        let loom = travelling(10, 12);
        let back = reverse(&loom).unwrap();
        for frame in 1..=12 {
            assert_eq!(
                back.at(13.0 - frame as f64).unwrap(),
                loom.at(frame as f64).unwrap()
            );
        }
        let forth = reverse(&back).unwrap();
        assert_eq!(forth.time(), loom.time());
        let (v, w) = (loom.velocity(4.0).unwrap(), back.velocity(9.0).unwrap());
        assert!(v.iter().zip(&w).all(|(v, w)| *v == -w));
    }
}
