//! Changes of time: each takes output time to source time. Frames are counted from 1; a signal of n
//! frames runs over [1, n].

use crate::math::monotone;

/// Output time to source time.
#[derive(Debug, Clone, PartialEq)]
pub enum Warp {
    /// t -> n + 1 - t, backwards over `frames` frames.
    Reverse {
        /// n.
        frames: usize,
    },
    /// A C1 piecewise cubic.
    Keys(Keys),
}

/// Why keys are not a warp. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WarpError {
    /// There are no keys, or lists differ in length.
    Counts,
    /// The first key's output time is not 1, or the last one's not a whole number.
    Ends,
    /// This key's output time does not lie after the one before it, or is not finite.
    Time {
        /// The key.
        key: usize,
    },
    /// This key's source time or slope is not finite, or the time lies before 1.
    Value {
        /// The key.
        key: usize,
    },
}

/// Output times, the source times there, and the slopes.
#[derive(Debug, Clone, PartialEq)]
pub struct Keys {
    times: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Keys {
    /// Keys with given slopes (source frames per output frame). Output times rise from 1 to a whole
    /// number; source times are at least 1. Between keys the source time is kept within its keys'.
    ///
    /// # Errors
    /// See [`WarpError`].
    pub fn new(times: Vec<f64>, values: Vec<f64>, slopes: Vec<f64>) -> Result<Self, WarpError> {
        let n = times.len();
        if n == 0 || values.len() != n || slopes.len() != n {
            return Err(WarpError::Counts);
        }
        for key in 0..n {
            if !times[key].is_finite() || (key > 0 && times[key] <= times[key - 1]) {
                return Err(WarpError::Time { key });
            }
            if !(values[key] >= 1.0 && values[key].is_finite() && slopes[key].is_finite()) {
                return Err(WarpError::Value { key });
            }
        }
        // Whole numbers beyond 2^32 would not be frame counts.
        let last = times[n - 1];
        if times[0] != 1.0 || last.fract() != 0.0 || last > 4_294_967_295.0 {
            return Err(WarpError::Ends);
        }
        Ok(Keys {
            times,
            values,
            slopes,
        })
    }

    /// The monotone cubic (Fritsch-Carlson) through the keys; straight through keys on a line.
    ///
    /// # Errors
    /// See [`WarpError`].
    pub fn monotone(times: Vec<f64>, values: Vec<f64>) -> Result<Self, WarpError> {
        if times.len() != values.len() {
            return Err(WarpError::Counts);
        }
        let zeros = vec![0.0; times.len()];
        let mut keys = Keys::new(times, values, zeros)?;
        let differences = |x: &[f64]| x.windows(2).map(|x| x[1] - x[0]).collect::<Vec<_>>();
        keys.slopes = monotone::slopes(&differences(&keys.times), &differences(&keys.values));
        Ok(keys)
    }

    /// Output times of the keys.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Source times at the keys.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Slopes at the keys.
    pub fn slopes(&self) -> &[f64] {
        &self.slopes
    }

    /// Source time and its derivative at output time `t` within the keys.
    fn at(&self, t: f64) -> (f64, f64) {
        let after = self.times.partition_point(|&time| time <= t);
        let i = after.saturating_sub(1);
        if i + 1 >= self.times.len() {
            return (self.values[i], self.slopes[i]);
        }
        let (step, rise) = (
            self.times[i + 1] - self.times[i],
            self.values[i + 1] - self.values[i],
        );
        let ends = [self.slopes[i], self.slopes[i + 1]];
        let (y, slope) = monotone::piece(step, rise, ends, t - self.times[i]);
        let value = self.values[i] + y.clamp(rise.min(0.0), rise.max(0.0));
        (value, slope)
    }
}

impl Warp {
    /// How many output frames there are.
    pub fn frames(&self) -> usize {
        match self {
            Warp::Reverse { frames } => *frames,
            Warp::Keys(keys) => keys.times[keys.times.len() - 1] as usize,
        }
    }

    /// The latest source time it asks for.
    pub fn latest(&self) -> f64 {
        match self {
            Warp::Reverse { frames } => *frames as f64,
            Warp::Keys(keys) => keys.values.iter().copied().fold(1.0, f64::max),
        }
    }

    /// Source time and its derivative at output time `t` in [1, frames].
    pub fn at(&self, t: f64) -> (f64, f64) {
        match self {
            Warp::Reverse { frames } => ((*frames as f64 + 1.0) - t, -1.0),
            Warp::Keys(keys) => keys.at(t),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_straight_stretch_is_taken_without_rounding() {
        let keys = Keys::monotone(vec![1.0, 40.0], vec![3.0, 42.0]).unwrap();
        for t in [1.0, 2.0, 17.25, 39.0, 40.0] {
            assert_eq!(keys.at(t), (t + 2.0, 1.0));
        }
    }

    #[test]
    fn keys_are_met_and_nothing_overshoots() {
        let (times, values) = (vec![1.0, 2.5, 6.0, 9.0], vec![1.0, 5.0, 5.0, 2.0]);
        let keys = Keys::monotone(times.clone(), values.clone()).unwrap();
        for (t, v) in times.iter().zip(&values) {
            assert_eq!(keys.at(*t).0, *v);
        }
        for i in 0..=80 {
            let value = keys.at(1.0 + f64::from(i) / 10.0).0;
            assert!((1.0..=5.0).contains(&value));
        }
    }

    #[test]
    fn what_is_not_a_warp_is_refused() {
        let new = |times: &[f64], values: &[f64]| {
            Keys::monotone(times.to_vec(), values.to_vec()).map(|_| ())
        };
        assert_eq!(new(&[], &[]), Err(WarpError::Counts));
        assert_eq!(
            new(&[1.0, 1.0], &[1.0, 2.0]),
            Err(WarpError::Time { key: 1 })
        );
        assert_eq!(new(&[1.0, 2.5], &[1.0, 2.0]), Err(WarpError::Ends));
        assert_eq!(new(&[2.0, 3.0], &[1.0, 2.0]), Err(WarpError::Ends));
        assert_eq!(
            new(&[1.0, 3.0], &[1.0, 0.5]),
            Err(WarpError::Value { key: 1 })
        );
        assert_eq!(
            new(&[1.0, 3.0], &[1.0, f64::NAN]),
            Err(WarpError::Value { key: 1 })
        );
    }
}
