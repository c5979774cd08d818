//! The tangents of a curve at a key as arms that a hand can pull: the ends of the Bézier pieces beside the
//! key. Pulling an arm sets the key's handle (Kochanek & Bartels).

use crate::math::key_spline::Handle;

/// A side of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Where the curve comes from.
    Before,
    /// Where it goes.
    After,
}

/// What the arms at a key of a plane curve depend on besides its handle. Slopes are per frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tangents {
    /// Where the key lies.
    pub(super) at: [f64; 2],
    /// The slope without a handle.
    pub(super) own: [f64; 2],
    /// Slopes of the straight lines before and after; none at an end of the curve.
    pub(super) around: Option<[[f64; 2]; 2]>,
    /// Frames to the key before and to the key after, where there is one.
    pub(super) spans: [Option<f64>; 2],
}

/// Directions whose sine is below this are one.
const ALONG: f64 = 1e-6;

impl Tangents {
    /// Where the arm of that side ends, a third of the way to the next key along the slope there; none
    /// where the curve ends. With full tension both arms end at the key.
    #[must_use]
    pub fn arm(&self, handle: Handle, side: Side) -> Option<[f64; 2]> {
        let span = self.spans[side as usize]?;
        let reach = side.sign() * span / 3.0;
        let slope = |axis: usize| match self.around {
            None => (1.0 - handle.tension) * self.own[axis],
            Some([before, after]) => {
                handle.slopes(self.own[axis], before[axis], after[axis])[side as usize]
            }
        };
        Some([0, 1].map(|axis| self.at[axis] + reach * slope(axis)))
    }

    /// The handle whose arm of that side ends nearest `to`: tension and bias change, the angle between
    /// the arms by continuity stays; a `corner` changes tension and continuity, and bias stays. At an end of
    /// the curve only the tension changes.
    #[must_use]
    pub fn pulled(&self, handle: Handle, side: Side, to: [f64; 2], corner: bool) -> Handle {
        let Some(span) = self.spans[side as usize] else {
            return handle;
        };
        let reach = side.sign() * span / 3.0;
        let wanted = [0, 1].map(|axis| (to[axis] - self.at[axis]) / reach);
        let Some([before, after]) = self.around else {
            let tension = tension(wanted, self.own).unwrap_or(handle.tension);
            return Handle { tension, ..handle };
        };
        // The slope is s ((1 + sign c b) own + (b + sign c) half), s = 1 - tension: linear in s and s b, as
        // in s and s c.
        let half = [0, 1].map(|axis| 0.5 * (before[axis] - after[axis]));
        let (sign, b, c) = (side.sign(), handle.bias, handle.continuity);
        let (one, other, now) = match corner {
            false => (
                sum(self.own, sign * c, half),
                sum(half, sign * c, self.own),
                b,
            ),
            true => (
                sum(self.own, b, half),
                scaled(sign, sum(half, b, self.own)),
                c,
            ),
        };
        let share = share(wanted, one, other).unwrap_or(now).clamp(-1.0, 1.0);
        let along = sum(one, share, other);
        let tension = tension(wanted, along).unwrap_or(handle.tension);
        match corner {
            false => Handle {
                tension,
                bias: share,
                ..handle
            },
            true => Handle {
                tension,
                continuity: share,
                ..handle
            },
        }
    }
}

impl Side {
    fn sign(self) -> f64 {
        match self {
            Side::Before => -1.0,
            Side::After => 1.0,
        }
    }
}

/// The tension with which a slope `along` comes nearest `wanted`; none for a slope of 0.
fn tension(wanted: [f64; 2], along: [f64; 2]) -> Option<f64> {
    let square = dot(along, along);
    (square > 0.0).then(|| (1.0 - dot(wanted, along) / square).clamp(-1.0, 1.0))
}

/// w / s of s one + w other = wanted; none where the two have one direction, or for s <= 0.
fn share(wanted: [f64; 2], one: [f64; 2], other: [f64; 2]) -> Option<f64> {
    let area = cross(one, other);
    let sizes = libm::sqrt(dot(one, one) * dot(other, other));
    let [s, w] = [cross(wanted, other) / area, cross(one, wanted) / area];
    (area.abs() > ALONG * sizes && s > 0.0).then(|| w / s)
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn scaled(factor: f64, a: [f64; 2]) -> [f64; 2] {
    a.map(|x| factor * x)
}

/// a + factor b.
fn sum(a: [f64; 2], factor: f64, b: [f64; 2]) -> [f64; 2] {
    [a[0] + factor * b[0], a[1] + factor * b[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    const INNER: Tangents = Tangents {
        at: [1.0, 2.0],
        own: [0.3, 0.1],
        around: Some([[0.4, -0.2], [0.1, 0.5]]),
        spans: [Some(6.0), Some(9.0)],
    };

    fn handle([tension, continuity, bias]: [f64; 3]) -> Handle {
        Handle {
            tension,
            continuity,
            bias,
        }
    }

    fn near(found: Handle, known: Handle) {
        let apart = [
            found.tension - known.tension,
            found.continuity - known.continuity,
            found.bias - known.bias,
        ];
        // a few roundings of numbers below 10
        assert!(apart.iter().all(|x| x.abs() < 1e-12), "{found:?} {known:?}");
    }

    #[test]
    fn an_arm_pulled_to_where_a_handle_puts_it_gives_that_handle() {
        for continuity in [0.0, 0.4, -0.7] {
            for bias in [-0.8, 0.0, 0.5] {
                for side in [Side::Before, Side::After] {
                    let wanted = handle([0.25, continuity, bias]);
                    let to = INNER.arm(wanted, side).unwrap();
                    let turned = handle([-0.5, continuity, 0.1]);
                    near(INNER.pulled(turned, side, to, false), wanted);
                    let bent = handle([-0.5, 0.2, bias]);
                    near(INNER.pulled(bent, side, to, true), wanted);
                }
            }
        }
    }

    #[test]
    fn arms_are_the_bezier_points_and_vanish_with_full_tension() {
        let smooth = Handle::default();
        let [before, after] = [Side::Before, Side::After].map(|side| INNER.arm(smooth, side));
        for (found, known) in [(before, [0.4, 1.8]), (after, [1.9, 2.3])] {
            let found = found.unwrap();
            assert!((found[0] - known[0]).abs() + (found[1] - known[1]).abs() < 1e-12);
        }
        assert_eq!(
            INNER.arm(handle([1.0, 0.0, 0.0]), Side::After),
            Some(INNER.at)
        );
    }

    #[test]
    fn handles_stay_within_their_range_and_ends_know_tension_only() {
        for to in [[90.0, -70.0], [-5.0, 3.0], INNER.at] {
            for (side, corner) in [(Side::Before, false), (Side::After, true)] {
                let found = INNER.pulled(handle([0.1, 0.2, 0.3]), side, to, corner);
                let numbers = [found.tension, found.continuity, found.bias];
                assert!(
                    numbers.iter().all(|x| (-1.0..=1.0).contains(x)),
                    "{found:?}"
                );
            }
        }
        let end = Tangents {
            around: None,
            spans: [None, Some(9.0)],
            ..INNER
        };
        let wanted = handle([0.5, 0.0, 0.0]);
        let to = end.arm(wanted, Side::After).unwrap();
        near(end.pulled(Handle::default(), Side::After, to, true), wanted);
        assert_eq!(end.arm(wanted, Side::Before), None);
        // Slopes of 0 have no direction to pull in.
        let still = Tangents {
            own: [0.0; 2],
            ..end
        };
        near(still.pulled(wanted, Side::After, [3.0, 3.0], false), wanted);
    }

    #[test]
    fn arms_on_one_line_change_tension_only() {
        let line = Tangents {
            own: [0.2, 0.0],
            around: Some([[0.4, 0.0], [0.1, 0.0]]),
            ..INNER
        };
        let start = handle([0.0, 0.0, 0.5]);
        let to = line.arm(handle([0.5, 0.0, 0.5]), Side::After).unwrap();
        near(
            line.pulled(start, Side::After, to, false),
            handle([0.5, 0.0, 0.5]),
        );
    }
}
