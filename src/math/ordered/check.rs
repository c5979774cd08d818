//! Whether a fit is right between its samples, too.

use super::samples::{Curve, Samples};
use crate::math::variable_projection::Refined;

/// Deviations of g(f(t)) from the motion, relative to the motion's spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Root mean square at the fitted samples.
    pub at_samples: f64,
    /// Root mean square at twice as many samples.
    pub between: f64,
    /// Whether it is worse between the samples than at them: a saddle has survived.
    pub spiked: bool,
    /// Neither spiked nor worse than what the number of modes leaves out, or than a fifth of what
    /// linear interpolation is off.
    pub good: bool,
}

impl Quality {
    pub(super) fn of(samples: &Samples, curve: &Curve, fit: &Refined, floor: f64) -> Self {
        let controls = fit.controls.as_ref();
        let at = fit.plate.at(curve.fitted.design().apply(controls).as_ref());
        let between = fit.plate.at(curve.finer.apply(controls).as_ref());
        let at_samples = (&samples.dense - at).norm_l2() * 2f64.sqrt() / samples.spread;
        let between = (&samples.finer - between).norm_l2() / samples.spread;
        let linear = samples.linear / samples.spread;
        let spiked = between > (1.6 * at_samples).max(0.2 * linear);
        Quality {
            at_samples,
            between,
            spiked,
            good: !spiked && between <= (0.4 * floor).max(0.2 * linear),
        }
    }
}
