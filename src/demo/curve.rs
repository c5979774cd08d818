//! Periodic curves through keys, which do not overshoot.

use crate::math::monotone;

/// A piecewise cubic of period `period` through keys (place, value); monotone where the keys are.
#[derive(Debug, Clone)]
pub(super) struct Curve {
    period: f64,
    /// The keys of one period and two more on either side.
    places: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Curve {
    /// Keys with ascending places in \[0, period); at least one.
    pub(super) fn periodic(period: f64, keys: &[(f64, f64)]) -> Self {
        let copies = (-2..=2).flat_map(|turn| {
            let shift = f64::from(turn) * period;
            keys.iter()
                .map(move |&(place, value)| (place + shift, value))
        });
        let (places, values): (Vec<f64>, Vec<f64>) = copies.unzip();
        let differences = |list: &[f64]| list.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let (steps, rises): (Vec<f64>, Vec<f64>) = (differences(&places), differences(&values));
        let slopes = monotone::slopes(&steps, &rises);
        Curve {
            period,
            places,
            values,
            slopes,
        }
    }

    /// The value at any place.
    pub(super) fn at(&self, place: f64) -> f64 {
        let place = place - self.period * libm::floor(place / self.period);
        let next = self.places.partition_point(|&key| key <= place);
        let i = next.clamp(1, self.places.len() - 1) - 1;
        let step = self.places[i + 1] - self.places[i];
        let rise = self.values[i + 1] - self.values[i];
        let slopes = [self.slopes[i], self.slopes[i + 1]];
        self.values[i] + monotone::piece(step, rise, slopes, place - self.places[i]).0
    }
}
