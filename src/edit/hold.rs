//! A freeze: the motion stays at one time for a while.

use super::retime::with_keys;
use crate::diag::Result;
use crate::loom::Loom;
use crate::signal::warp::Keys;

/// The loom that stays at psi(`t`) for `frames` frames and goes on. It comes to rest and moves off over
/// one frame on each side (up to two where `t` is not whole); all other frames keep their bits. n grows by `frames`.
///
/// # Errors
/// `t` lies outside \[1, n\], or there are too many frames.
pub fn hold(loom: &Loom, t: f64, frames: usize) -> Result<Loom> {
    super::check_time(loom, t)?;
    super::check_frames(frames)?;
    if frames == 0 {
        return Ok(loom.clone());
    }
    let (n, more) = (loom.frames() as f64, frames as f64);
    // (output time, source time, slope)
    let mut keys = Vec::new();
    if t >= 3.0 {
        keys.push([1.0, 1.0, 1.0]);
    }
    if t > 1.0 {
        // Whole numbers, so that frames beyond are shifted without rounding.
        let start = (t - 1.0).floor().max(1.0);
        keys.push([start, start, 1.0]);
    }
    keys.push([t, t, 0.0]);
    keys.push([t + more, t, 0.0]);
    if t < n {
        let end = (t + 1.0).ceil().min(n);
        keys.push([end + more, end, 1.0]);
    }
    if (t + 1.0).ceil() < n {
        keys.push([n + more, n, 1.0]);
    }
    let column = |j: usize| keys.iter().map(|key| key[j]).collect();
    let keys = Keys::new(column(0), column(1), column(2));
    with_keys(
        loom,
        keys.map_err(|_| super::impossible(crate::signal::time::TimeError::Counts))?,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn it_stays_and_everything_else_keeps_its_bits() {
        let loom = ring(10, 14, false);
        for t in [1.0, 1.5, 6.0, 6.3, 13.5, 14.0] {
            let held = hold(&loom, t, 5).unwrap();
            assert_eq!(held.frames(), 19);
            let still = loom.at(t).unwrap();
            for i in 0..=10 {
                assert_eq!(held.at(t + f64::from(i) / 2.0).unwrap(), still);
            }
            for frame in 1..=14 {
                let frame = f64::from(frame);
                if frame <= t - 1.0 {
                    assert_eq!(held.at(frame).unwrap(), loom.at(frame).unwrap());
                }
                if frame >= t + 1.0 {
                    assert_eq!(held.at(frame + 5.0).unwrap(), loom.at(frame).unwrap());
                }
            }
        }
    }

    #[test]
    fn no_frames_change_nothing_and_too_many_are_refused() {
        let loom = ring(5, 8, true);
        assert_eq!(hold(&loom, 3.0, 0).unwrap().time(), loom.time());
        assert!(hold(&loom, 3.0, usize::MAX).is_err() && hold(&loom, 9.0, 1).is_err());
    }
}
