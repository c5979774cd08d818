//! Whether a fit is right between its samples, too.

use faer::Mat;

use super::samples::Samples;

/// Deviations of more than this part of a frame step are seen as pops.
const VISIBLE: f64 = 0.05;
/// A fit that is so many times worse between its samples than at them has a spike there.
const SPIKE: f64 = 1.6;
/// What is below these parts of what the modes leave out, or of linear interpolation's error, is lost
/// in them.
const OF_FLOOR: f64 = 0.4;
const OF_LINEAR: f64 = 0.2;
/// What is below this part of a frame step in root mean square is not seen.
const UNSEEN: f64 = 0.01;

/// What a trial may deviate by between its samples, for 1 of a good fit: refinement halves most errors.
const TRIAL: f64 = 3.0;
/// Errors at the frames of so little are none.
const EXACT: f64 = 5e-5;

/// Weights grow by this power of how many times what is not seen is missed, and by so much at most in one
/// round.
const SEEN: f64 = 0.6;
const GROWTH: f64 = std::f64::consts::SQRT_2;

/// Deviations of g(f(t)) from the motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Root mean square at the fitted samples, relative to the motion's spread.
    pub at_samples: f64,
    /// The same at the frames alone.
    pub at_frames: f64,
    /// The same at twice as many samples.
    pub between: f64,
    /// The largest of those, in root mean square steps between frames.
    pub worst: f64,
    /// Whether it is worse between the samples than at them: a saddle has survived.
    pub spiked: bool,
    /// Not spiked, nowhere visible, and lost in what the modes leave out or linear interpolation is off.
    pub good: bool,
    /// Good up to so much that further refinement mends: what a first trial must be.
    pub promising: bool,
    /// How many times what is wanted is missed, at the frames and between them; 1 where nothing is.
    pub excess: f64,
}

impl Quality {
    /// Of what a fit gives at the fitted and at the check samples.
    pub(super) fn of(samples: &Samples, at: &Mat<f64>, between: &Mat<f64>, floor: f64) -> Self {
        let largest = |missed: &Mat<f64>| {
            let rows = (0..missed.nrows()).map(|row| missed.row(row).norm_l2());
            rows.fold(0.0, f64::max) / samples.step
        };
        let missed = (&samples.dense - at, &samples.finer - between);
        let at_samples = missed.0.norm_l2() * 2f64.sqrt() / samples.spread;
        let frames = (0..samples.frames).map(|i| missed.0.row(i * samples.rate).squared_norm_l2());
        let at_frames = (frames.sum::<f64>() * (2 * samples.rate) as f64).sqrt() / samples.spread;
        let between = missed.1.norm_l2() / samples.spread;
        let (worst_at, worst) = (largest(&missed.0), largest(&missed.1));
        let linear = OF_LINEAR * samples.linear / samples.spread;
        let spiked = between > (SPIKE * at_samples).max(linear)
            || worst > VISIBLE && worst > 2.0 * SPIKE * worst_at;
        let steps = samples.step * (samples.finer.nrows() as f64).sqrt();
        let lost = linear
            .max(OF_FLOOR * floor)
            .max(UNSEEN * steps / samples.spread);
        Quality {
            at_samples,
            at_frames,
            between,
            worst,
            spiked,
            promising: !spiked && worst <= VISIBLE && between <= TRIAL * lost,
            good: !spiked && worst <= VISIBLE && between <= lost,
            excess: (at_frames / frames_allowed(floor)).max(1.0)
                * (worst / VISIBLE).max(1.0)
                * (between / lost).max(1.0),
        }
    }

    /// Whether there is a place where it is seen.
    pub(super) fn is_seen(&self) -> bool {
        self.worst > VISIBLE
    }

    /// How bad: the deviation between the samples, the more the more it is seen in one place.
    pub(super) fn cost(&self) -> f64 {
        self.between * (self.worst / VISIBLE).max(1.0).sqrt()
    }
}

/// What may be missed at the frames, relative to the motion's spread, where the modes leave out `floor`.
fn frames_allowed(floor: f64) -> f64 {
    (OF_FLOOR * floor).max(EXACT)
}

/// By what the weight of each fitted sample is to grow: more than 1 where what is missed next to it is
/// seen. Frames alone get no weight: what they gained, the way between them lost twice.
pub(super) fn growth(samples: &Samples, between: &Mat<f64>) -> Vec<f64> {
    let visible = VISIBLE * samples.step;
    let missed = &samples.finer - between;
    let seen = |row: usize| {
        let around = (2 * row).saturating_sub(1)..(2 * row + 2).min(missed.nrows());
        let largest = around.map(|row| missed.row(row).norm_l2());
        libm::pow(largest.fold(0.0, f64::max) / visible, SEEN)
    };
    (0..samples.dense.nrows())
        .map(|sample| seen(sample).clamp(1.0, GROWTH))
        .collect()
}
