//! A part of the time kept.

use super::forward::baked;
use super::retime::with_keys;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::signal::time::TimeError;
use crate::signal::warp::Keys;

/// The loom from time `from` to time `to`, which become 1 and n. Whole frames are kept from `from` on;
/// what is left over at the end is told. Frames between frames of the loom keep their bits; between
/// other times it is the same motion.
///
/// # Errors
/// A time outside \[1, n\], or `to` before `from`.
pub fn trim(loom: &Loom, from: f64, to: f64) -> Result<Warned<Loom>> {
    super::check_time(loom, from)?;
    super::check_time(loom, to)?;
    if to < from {
        let message = format!("nothing lies between {from} and {to}");
        return Diagnostic::error(message)
            .hint("the first time must not lie after the second")
            .err();
    }
    // Times that people compute miss whole numbers by rounding.
    let steps = (to - from + 1e-9).floor();
    let (times, values) = match steps {
        0.0 => (vec![1.0], vec![from]),
        _ => (vec![1.0, 1.0 + steps], vec![from, from + steps]),
    };
    let slopes = vec![1.0; times.len()];
    let keys = Keys::new(times, values, slopes);
    let whole = loom.time().warps().is_empty() && from.fract() == 0.0;
    let trimmed = with_keys(
        loom,
        keys.map_err(|_| super::impossible(TimeError::Counts))?,
    )?;
    let mut all = Warned::clean(if whole { baked(&trimmed)? } else { trimmed });
    let end = from + steps;
    if to - end > 1e-9 {
        all.warnings.push(Diagnostic::warning(format!(
            "the last frame is at {end}, not {to}: frames are whole"
        )));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::retime;
    use crate::loom::test_looms::travelling;

    #[test]
    fn what_is_kept_keeps_its_bits_and_the_rest_is_gone() {
        let loom = travelling(10, 30);
        let part = trim(&loom, 8.0, 20.0).unwrap().output;
        assert_eq!(part.frames(), 13);
        assert!(part.time().controls().len() < loom.time().controls().len());
        assert!(part.time().warps().is_empty());
        for i in 0..=120 {
            let t = 1.0 + f64::from(i) / 10.0;
            let (a, b) = (part.at(t).unwrap(), loom.at(t + 7.0).unwrap());
            if t.fract() == 0.0 {
                assert_eq!(a, b);
            }
            // single precision; t + 7 rounds where t is not whole
            assert!(
                a.iter()
                    .zip(&b)
                    .all(|(a, b)| (a - b).abs() <= 1e-5 * (1.0 + b.abs()))
            );
        }
    }

    #[test]
    fn odd_times_and_trims_of_trims_are_the_same_motion() {
        let loom = travelling(10, 30);
        let part = trim(&loom, 4.5, 20.2).unwrap();
        assert_eq!((part.output.frames(), part.warnings.len()), (16, 1));
        assert_eq!(part.output.at(3.0).unwrap(), loom.at(6.5).unwrap());
        let slow = retime(&loom, &[[1.0, 1.0], [59.0, 30.0]]).unwrap();
        let part = trim(&slow, 11.0, 31.0).unwrap().output;
        assert_eq!(part.at(2.0).unwrap(), slow.at(12.0).unwrap());
        let one = trim(&loom, 7.0, 7.0).unwrap().output;
        assert_eq!(
            (one.frames(), one.at(1.0).unwrap()),
            (1, loom.at(7.0).unwrap())
        );
    }

    #[test]
    fn backwards_and_outside_are_refused() {
        let loom = travelling(5, 10);
        assert!(trim(&loom, 5.0, 4.0).is_err() && trim(&loom, 0.0, 4.0).is_err());
        assert!(trim(&loom, 5.0, 10.5).is_err());
    }
}
