//! At which times an animation is sampled.

use super::animation::Track;
use crate::diag::{Diagnostic, Result};
use crate::format::rate;

/// Equally spaced times.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Times {
    start: f64,
    end: f64,
    pub(super) frames: usize,
    /// Frames per second; none for a single frame without animation.
    pub(super) fps: Option<f64>,
}

impl Times {
    /// The time of a frame, from 0, in seconds.
    pub(super) fn at(&self, frame: usize) -> f64 {
        let time = self.start + frame as f64 / self.fps.unwrap_or(1.0);
        time.min(self.end)
    }
}

/// Frames per second where the keys have no grid of their own.
const USUAL: f64 = 30.0;

/// More frames than any animation has; damaged key times would ask for more.
const MOST: f64 = 100_000.0;

/// The times of an animation: its keys' own grid, else [`USUAL`] a second from the first key on.
pub(super) fn times(tracks: &[Track]) -> Result<Times> {
    let mut keys: Vec<f32> = tracks
        .iter()
        .flat_map(|track| &track.times)
        .copied()
        .collect();
    keys.sort_by(f32::total_cmp);
    let (Some(first), Some(last)) = (keys.first(), keys.last()) else {
        return Ok(Times {
            start: 0.0,
            end: 0.0,
            frames: 1,
            fps: None,
        });
    };
    let (start, end) = (f64::from(*first), f64::from(*last));
    let fps = grid(&keys).unwrap_or(USUAL);
    // a frame that rounding alone would leave out is in
    let steps = ((end - start) * fps + 1e-3).floor();
    if steps >= MOST {
        return Diagnostic::error(format!("an animation of {} seconds", end - start))
            .hint("its key times are damaged")
            .err();
    }
    Ok(Times {
        start,
        end,
        frames: steps as usize + 1,
        fps: Some(fps),
    })
}

/// The rate of a grid that all keys (sorted) lie on, if it is between 10 and 240 a second.
fn grid(keys: &[f32]) -> Option<f64> {
    let (start, end) = (f64::from(*keys.first()?), f64::from(*keys.last()?));
    let close = 1e-4; // seconds; the finest grid has steps of 1/240
    let steps = keys
        .windows(2)
        .map(|pair| f64::from(pair[1]) - f64::from(pair[0]));
    let step = steps.filter(|step| *step > close).min_by(f64::total_cmp)?;
    let fps = rate::roundest(start, end, ((end - start) / step).round());
    let on_grid = |key: &f32| {
        let place = (f64::from(*key) - start) * fps;
        (place - place.round()).abs() <= 0.01
    };
    ((10.0..=240.0).contains(&fps) && keys.iter().all(on_grid)).then_some(fps)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_on_a_grid_give_their_rate() {
        let on = |fps: f64, frames: &[u32]| {
            let keys: Vec<f32> = frames
                .iter()
                .map(|&f| (0.5 + f64::from(f) / fps) as f32)
                .collect();
            grid(&keys)
        };
        for fps in [24.0, 25.0, 30.0, 60.0] {
            assert_eq!(on(fps, &[0, 1, 2, 7, 8, 40]), Some(fps));
        }
        assert_eq!(on(2.0, &[0, 1]), None, "two keys a second are not frames");
        assert_eq!(on(500.0, &[0, 1, 100]), None);
        assert_eq!(grid(&[0.0, 0.033, 0.05, 0.4]), None);
        assert_eq!(grid(&[1.0, 1.0]), None);
    }
}
