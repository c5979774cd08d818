//! How firmly steps of a least-squares iteration are held back (Levenberg-Marquardt), by how well the last one
//! went: what it gained against what a linear problem would have given (Nielsen 1999).

/// The damping of the next step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Damping {
    value: f64,
    least: f64,
    most: f64,
    growth: f64,
}

/// A refused step is followed by one held back this many times more firmly, twice that at the next refusal.
const GROWTH: f64 = 4.0;

/// After a step that gained all that was promised the damping shrinks by this factor.
const SHRINK: f64 = 0.1;

/// After one that gained next to nothing it grows by this.
const TIGHTEN: f64 = 2.0;

impl Damping {
    pub(super) fn new([value, least, most]: [f64; 3]) -> Self {
        Damping {
            value,
            least,
            most,
            growth: GROWTH,
        }
    }

    pub(super) fn value(&self) -> f64 {
        self.value
    }

    /// Steps as firmly held as this gain nothing any more.
    pub(super) fn spent(&self) -> bool {
        self.value > self.most
    }

    /// A step was taken that gained this part of what a linear problem would have given.
    pub(super) fn taken(&mut self, ratio: f64) {
        let x = 2.0 * ratio - 1.0;
        let factor = (1.0 - x * x * x).clamp(SHRINK, TIGHTEN);
        self.value = (self.value * factor).max(self.least);
        self.growth = GROWTH;
    }

    /// A step would have gained nothing.
    pub(super) fn refused(&mut self) {
        self.value *= self.growth;
        self.growth *= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damping_falls_with_good_steps_and_grows_faster_the_more_are_refused() {
        let mut damping = Damping::new([1.0, 1e-3, 10.0]);
        // a step as good as promised, and one half as good
        damping.taken(1.0);
        assert_eq!(damping.value(), SHRINK);
        damping.taken(0.5);
        assert_eq!(damping.value(), SHRINK);
        damping.refused();
        damping.refused();
        assert_eq!(damping.value(), SHRINK * GROWTH * (2.0 * GROWTH));
        damping.taken(1.0);
        damping.refused();
        // a step taken in between starts the growth anew
        assert!((damping.value() - SHRINK * SHRINK * 2.0 * GROWTH.powi(3)).abs() < 1e-12);
        (0..9).for_each(|_| damping.taken(1.0));
        assert_eq!(damping.value(), 1e-3);
        (0..9).for_each(|_| damping.refused());
        assert!(damping.spent());
    }
}
