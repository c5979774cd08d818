//! Frames per second from times that a file holds as f32.

/// Frames per second of equally spaced times, `None` if they are not. The times are f32, so the rate is
/// known to about 2^-23; the roundest number within that is taken (24, 29.97, 24000/1001, ..).
pub(super) fn of_times(times: &[f32]) -> Option<f64> {
    let (first, last) = (f64::from(*times.first()?), f64::from(*times.last()?));
    let steps = (times.len() - 1) as f64;
    let span = last - first;
    if !(span > 0.0 && span.is_finite()) {
        return None;
    }
    let rounding = rounding(first, last);
    let step = span / steps;
    let even = times.iter().enumerate().all(|(at, &time)| {
        let expected = first + at as f64 * step;
        (f64::from(time) - expected).abs() <= (0.01 * step).max(3.0 * rounding)
    });
    even.then(|| roundest(first, last, steps))
}

/// The roundest rate that gives `steps` steps between two f32 times: whole, with two or three decimals,
/// a whole one times 1000/1001, else as it is.
pub(super) fn roundest(first: f64, last: f64, steps: f64) -> f64 {
    let fps = steps / (last - first);
    let error = (fps * 2.0 * rounding(first, last) / (last - first)).max(4.0 * f64::EPSILON * fps);
    let candidates = [
        fps.round(),
        (fps * 100.0).round() / 100.0,
        (fps * 1000.0).round() / 1000.0,
        (fps * 1.001).round() * 1000.0 / 1001.0,
    ];
    let near = candidates
        .into_iter()
        .find(|rate| *rate > 0.0 && (rate - fps).abs() <= error);
    near.unwrap_or(fps)
}

/// By how much an f32 time may be wrong.
fn rounding(first: f64, last: f64) -> f64 {
    f64::from(f32::EPSILON) / 2.0 * first.abs().max(last.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times(frames: u32, fps: f64) -> Vec<f32> {
        let times = (0..frames).map(|frame| (f64::from(frame) / fps) as f32);
        times.collect()
    }

    #[test]
    fn rates_come_back_from_times() {
        let rates = [
            12.5, 23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 59.94, 60.0, 120.0,
        ];
        for fps in rates {
            for frames in [2, 3, 48, 1000, 100_000] {
                let found = of_times(&times(frames, fps)).unwrap();
                // f32 times cannot tell 23.976 from 24000/1001 (1e-6 apart) if they are few
                assert!(
                    (found - fps).abs() <= 2e-6 * fps,
                    "{frames} frames: {found}, not {fps}"
                );
                if fps.fract() == 0.0 {
                    assert_eq!(found, fps);
                }
            }
        }
        let ntsc = 24_000.0 / 1001.0;
        assert_eq!(of_times(&times(500, ntsc)), Some(ntsc));
    }

    #[test]
    fn times_that_tell_no_rate_tell_none() {
        assert_eq!(of_times(&[0.0, 0.0, 0.0]), None);
        assert_eq!(of_times(&[0.0]), None);
        assert_eq!(of_times(&[]), None);
        assert_eq!(of_times(&[0.0, 1.0, 3.0]), None);
        assert_eq!(of_times(&[0.0, f32::NAN, 1.0]), None);
        assert_eq!(of_times(&[0.0, f32::INFINITY]), None);
        assert_eq!(of_times(&[1.0, 0.5, 0.0]), None);
    }
}
