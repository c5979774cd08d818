//! Another timing: output time to source time through keys.

use crate::diag::{Diagnostic, Result};
use crate::loom::Loom;
use crate::signal::warp::{Keys, Warp, WarpError};

/// The loom that at output time `keys[j][0]` shows what it showed at `keys[j][1]`, with a cubic between
/// keys that never overshoots (Fritsch-Carlson). Output times start at 1 and end at a whole number, the
/// new n. Source times may run backwards. Retimes compose without loss.
///
/// # Errors
/// No keys; output times that do not rise from 1 to a whole number; source times outside \[1, n\].
pub fn retime(loom: &Loom, keys: &[[f64; 2]]) -> Result<Loom> {
    for [_, source] in keys {
        super::check_time(loom, *source)?;
    }
    let (times, values) = (
        keys.iter().map(|k| k[0]).collect(),
        keys.iter().map(|k| k[1]).collect(),
    );
    let keys = Keys::monotone(times, values).map_err(explained)?;
    super::check_frames(Warp::Keys(keys.clone()).frames())?;
    with_keys(loom, keys)
}

/// The loom after one more change of time.
pub(super) fn with_keys(loom: &Loom, keys: Keys) -> Result<Loom> {
    let time = loom.time().with_warp(Warp::Keys(keys));
    loom.with_time(time.map_err(super::impossible)?)
}

fn explained(error: WarpError) -> Box<Diagnostic> {
    let message = match error {
        WarpError::Counts => "a retime needs at least one key".to_string(),
        WarpError::Ends => "output times must run from 1 to a whole number".to_string(),
        WarpError::Time { key } => format!("the output time of key {} does not rise", key + 1),
        WarpError::Value { key } => format!("the source time of key {} is not a time", key + 1),
    };
    Box::new(Diagnostic::error(message).hint("keys are pairs of output time and source time"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::travelling;

    #[test]
    fn the_identity_changes_no_bit_anywhere() {
        let loom = travelling(10, 15);
        let same = retime(&loom, &[[1.0, 1.0], [15.0, 15.0]]).unwrap();
        for t in [1.0, 3.7, 8.0, 14.99, 15.0] {
            assert_eq!(same.at(t).unwrap(), loom.at(t).unwrap());
        }
    }

    #[test]
    fn keys_are_met_and_retimes_compose() {
        let loom = travelling(10, 15);
        let (first, second) = (
            [[1.0, 2.0], [6.0, 9.0], [20.0, 15.0]],
            [[1.0, 3.0], [9.0, 17.5]],
        );
        let once = retime(&loom, &first).unwrap();
        assert_eq!(once.frames(), 20);
        assert_eq!(once.at(6.0).unwrap(), loom.at(9.0).unwrap());
        let twice = retime(&once, &second).unwrap();
        for t in [1.0, 2.3, 5.0, 8.9] {
            let (inner, _) =
                Warp::Keys(Keys::monotone(vec![1.0, 9.0], vec![3.0, 17.5]).unwrap()).at(t);
            assert_eq!(twice.at(t).unwrap(), once.at(inner).unwrap());
        }
    }

    #[test]
    fn velocity_follows_the_chain_rule() {
        let loom = travelling(10, 15);
        let slow = retime(&loom, &[[1.0, 1.0], [29.0, 15.0]]).unwrap();
        let (v, w) = (loom.velocity(8.0).unwrap(), slow.velocity(15.0).unwrap());
        let size = v.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
        assert!(
            v.iter()
                .zip(&w)
                .all(|(v, w)| (v / 2.0 - w).abs() < 1e-12 * size)
        );
    }

    #[test]
    fn keys_that_make_no_sense_are_explained() {
        let loom = travelling(5, 10);
        for keys in [
            &[][..],
            &[[2.0, 1.0], [3.0, 2.0]],
            &[[1.0, 1.0], [1.0, 2.0]],
            &[[1.0, 1.0], [3.5, 2.0]],
            &[[1.0, 1.0], [4.0, 11.0]],
            &[[1.0, f64::NAN]],
            &[[1.0, 1.0], [1e9, 2.0]],
        ] {
            assert!(retime(&loom, keys).is_err(), "{keys:?}");
        }
    }
}
