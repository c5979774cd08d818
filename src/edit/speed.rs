//! A stretch faster or slower.

use super::retime::with_keys;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::signal::time::TimeError;
use crate::signal::warp::Keys;

/// The loom with \[`from`, `to`\] run `factor` times as fast, eased over a frame at each of its ends; n
/// changes, the frame rate does not. The stretch takes a number of frames that leaves n whole, so the
/// speed is rounded; a warning tells by how much where it shows. Frames outside keep their bits.
///
/// # Errors
/// The stretch leaves \[1, n\] or has no length; the factor is not above 0; the result is too long.
pub fn speed(loom: &Loom, from: f64, to: f64, factor: f64) -> Result<Warned<Loom>> {
    super::check_stretch(loom, from, to)?;
    if !(factor > 0.0 && factor.is_finite()) {
        return Diagnostic::error(format!("speed must be above 0, got {factor}"))
            .hint("2 is twice as fast, 0.5 half as fast; `reverse` runs backwards")
            .err();
    }
    let length = to - from;
    let wanted = length / factor;
    if wanted > super::MOST_FRAMES as f64 {
        return super::check_frames(usize::MAX).map(|()| Warned::clean(loom.clone()));
    }
    let takes = whole_shift(length, wanted);
    let keys = eased(loom.frames() as f64, from, to, takes);
    let column = |j: usize| keys.iter().map(|key| key[j]).collect();
    let keys = Keys::new(column(0), column(1), column(2));
    let loom = with_keys(
        loom,
        keys.map_err(|_| super::impossible(TimeError::Counts))?,
    )?;
    Ok(told(loom, wanted, takes))
}

/// The length nearest `wanted` that shifts what follows by whole frames, above 0.
fn whole_shift(length: f64, wanted: f64) -> f64 {
    let shift = (wanted - length + 0.5).floor();
    match length + shift {
        takes if takes > 1e-9 => takes,
        takes => takes + 1.0,
    }
}

/// (output time, source time, slope): the stretch takes `takes` frames, the speed changes evenly over a
/// frame (less in short stretches) at its ends.
fn eased(n: f64, from: f64, to: f64, takes: f64) -> Vec<[f64; 3]> {
    let length = to - from;
    let ease = 1.0_f64.min(takes / 3.0).min(length / 2.0);
    let rate = (length - ease) / (takes - ease);
    let eased = 0.5 * ease * (1.0 + rate);
    let mut keys = Vec::new();
    if from > 1.0 {
        keys.push([1.0, 1.0, 1.0]);
    }
    keys.push([from, from, 1.0]);
    keys.push([from + ease, from + eased, rate]);
    keys.push([from + takes - ease, to - eased, rate]);
    keys.push([from + takes, to, 1.0]);
    // Whole numbers, so that frames after the stretch are shifted without rounding.
    let shift = (takes - length).round();
    for end in [to.ceil(), n] {
        if end > keys[keys.len() - 1][1] {
            keys.push([end + shift, end, 1.0]);
        }
    }
    keys
}

fn told(loom: Loom, wanted: f64, takes: f64) -> Warned<Loom> {
    let mut all = Warned::clean(loom);
    // Beyond a twentieth the eye may notice.
    if (takes / wanted - 1.0).abs() > 0.05 {
        let message = format!("the stretch takes {takes:.3} frames instead of {wanted:.3}");
        all.warnings.push(
            Diagnostic::warning(message).hint("frames are whole; a longer stretch rounds less"),
        );
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn the_stretch_takes_its_frames_and_the_rest_keeps_its_bits() {
        let loom = ring(10, 40, false);
        for (factor, frames) in [(0.5, 50), (2.0, 35), (1.0, 40), (0.25, 70), (1e3, 31)] {
            let changed = speed(&loom, 20.0, 30.0, factor).unwrap().output;
            assert_eq!(changed.frames(), frames);
            for frame in (1..=20).map(f64::from) {
                assert_eq!(changed.at(frame).unwrap(), loom.at(frame).unwrap());
            }
            for frame in (30..=40).map(f64::from) {
                let there = frame + frames as f64 - 40.0;
                assert_eq!(changed.at(there).unwrap(), loom.at(frame).unwrap());
            }
        }
    }

    #[test]
    fn in_the_middle_the_speed_is_the_factor_but_for_the_easing() {
        let loom = ring(10, 60, true);
        let slow = speed(&loom, 10.0, 50.0, 0.5).unwrap().output;
        let (_, rate) = slow.time().source_time(50.0).unwrap();
        // 39 source frames in 79 output frames
        assert!((rate - 39.0 / 79.0).abs() < 1e-12);
        for t in (0..=800).map(|i| 5.0 + f64::from(i) / 10.0) {
            let (_, rate) = slow.time().source_time(t).unwrap();
            assert!((0.49..=1.0 + 1e-12).contains(&rate), "{t}: {rate}");
        }
    }

    #[test]
    fn odd_stretches_leave_n_whole_and_time_forwards() {
        let loom = ring(5, 20, true);
        for (from, to, factor) in [
            (1.0, 20.0, 0.3),
            (3.2, 4.9, 7.0),
            (1.0, 1.1, 0.01),
            (19.5, 20.0, 3.0),
        ] {
            let changed = speed(&loom, from, to, factor).unwrap().output;
            let mut before = 0.0;
            for i in 0..=10 * (changed.frames() - 1) {
                let (source, _) = changed.time().source_time(1.0 + i as f64 / 10.0).unwrap();
                assert!(source >= before, "{from} {to} {factor}");
                before = source;
            }
            assert_eq!(before, 20.0);
        }
    }

    #[test]
    fn speeds_that_are_none_are_refused() {
        let loom = ring(5, 20, true);
        for factor in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9] {
            assert!(speed(&loom, 2.0, 9.0, factor).is_err());
        }
        assert!(speed(&loom, 9.0, 2.0, 1.0).is_err() && speed(&loom, 2.0, 21.0, 1.0).is_err());
    }
}
