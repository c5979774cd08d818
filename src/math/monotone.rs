//! Slopes that make a piecewise cubic follow its data without overshooting (Fritsch & Carlson 1980),
//! and the cubic between two such points.
//!
//! On each piece the cubic with secant D and end slopes m0, m1 is monotone when (m0/D, m1/D) lies in
//! the disc of radius 3; larger pairs are scaled back to it. Each slope takes the smallest factor of
//! its two pieces, so it depends on its four nearest data only, whatever the order of work.

/// Slopes at the points of a piecewise cubic through data with `steps` (> 0) between abscissae and
/// `rises` between values (n-1 of each give n slopes). Where the data are monotone, so is the cubic;
/// at a local extremum and beside a flat piece the slope is 0. No pieces give the single slope 0.
pub fn slopes(steps: &[f64], rises: &[f64]) -> Vec<f64> {
    let secants: Vec<f64> = rises
        .iter()
        .zip(steps)
        .map(|(rise, step)| rise / step)
        .collect();
    let n = secants.len() + 1;
    let first: Vec<f64> = (0..n).map(|i| start_slope(steps, &secants, i)).collect();
    let limit = |piece: usize| limit(secants[piece], first[piece], first[piece + 1]);
    (0..n)
        .map(|i| {
            let before = if i > 0 { limit(i - 1) } else { 1.0 };
            let after = if i + 1 < n { limit(i) } else { 1.0 };
            first[i] * before.min(after)
        })
        .collect()
}

/// The given slopes, brought into the disc of radius 3 on every piece of length 1: each takes the
/// smallest factor of its two pieces, 0 beside a flat piece. Slopes that are in it stay, to the bit.
///
/// # Panics
/// There are not as many slopes as rises and one.
pub fn limited(rises: &[f64], slopes: &[f64]) -> Vec<f64> {
    assert_eq!(slopes.len(), rises.len() + 1, "a slope at every point");
    let limit = |piece: usize| limit(rises[piece], slopes[piece], slopes[piece + 1]);
    let before = |i: usize| if i > 0 { limit(i - 1) } else { 1.0 };
    let after = |i: usize| if i < rises.len() { limit(i) } else { 1.0 };
    let limited = slopes.iter().enumerate();
    limited
        .map(|(i, slope)| slope * before(i).min(after(i)))
        .collect()
}

/// The three-point slope, 0 where the secants disagree in sign.
fn start_slope(steps: &[f64], secants: &[f64], i: usize) -> f64 {
    let n = secants.len() + 1;
    match (n, i) {
        (1, _) => 0.0,
        (2, _) => secants[0],
        (_, 0) => end_slope([steps[0], steps[1]], [secants[0], secants[1]]),
        _ if i == n - 1 => end_slope(
            [steps[n - 2], steps[n - 3]],
            [secants[n - 2], secants[n - 3]],
        ),
        _ if secants[i - 1] * secants[i] <= 0.0 => 0.0,
        _ => {
            let (before, after) = (steps[i - 1], steps[i]);
            (after * secants[i - 1] + before * secants[i]) / (before + after)
        }
    }
}

/// One-sided three-point slope at an end, kept to the sign of the nearest secant.
fn end_slope(steps: [f64; 2], secants: [f64; 2]) -> f64 {
    let slope = secants[0] + (secants[0] - secants[1]) * steps[0] / (steps[0] + steps[1]);
    if slope * secants[0] <= 0.0 {
        0.0
    } else {
        slope
    }
}

/// The factor in \[0, 1\] that brings both slopes of a piece into the disc of radius 3.
fn limit(secant: f64, m0: f64, m1: f64) -> f64 {
    if secant == 0.0 {
        return 0.0;
    }
    let radius = (m0 * m0 + m1 * m1).sqrt() / secant.abs();
    if radius > 3.0 { 3.0 / radius } else { 1.0 }
}

/// The cubic over \[0, `step`\] that rises from 0 by `rise` with slopes `m0` and `m1` at its ends: value
/// and slope at `x`. Where the slopes are those of the straight line, the value is slope times `x`
/// without further rounding, so slopes of 1 give `x` itself.
pub fn piece(step: f64, rise: f64, [m0, m1]: [f64; 2], x: f64) -> (f64, f64) {
    let secant = rise / step;
    let square = ((3.0 * secant - 2.0 * m0) - m1) / step;
    let cube = ((m0 + m1) - 2.0 * secant) / (step * step);
    (
        x * (m0 + x * (square + x * cube)),
        m0 + x * (2.0 * square + x * (3.0 * cube)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_monotone(rises: &[f64]) {
        let steps: Vec<f64> = (0..rises.len())
            .map(|i| 1.0 + 0.5 * (i % 3) as f64)
            .collect();
        let slopes = slopes(&steps, rises);
        for (i, &rise) in rises.iter().enumerate() {
            let step = steps[i];
            for x in 0..=64 {
                let x = step * f64::from(x) / 64.0;
                let slope = piece(step, rise, [slopes[i], slopes[i + 1]], x).1;
                // the boundary of the disc touches slope 0: rounding of numbers of size 9 rise
                assert!(
                    slope * rise.signum() >= -1e-14 * rise.abs(),
                    "piece {i}: {slope}"
                );
            }
        }
    }

    #[test]
    fn monotone_data_give_a_monotone_cubic() {
        check_monotone(&[1.0, 1e-6, 5.0, 1e3, 1e-3, 0.0, 2.0, 2.0, 1e-9]);
        check_monotone(&[-1.0, -40.0, -0.01, -3.0]);
        check_monotone(&[0.0, 0.0, 1.0, 0.0]);
        check_monotone(&[1.0]);
    }

    #[test]
    fn straight_data_are_reproduced_whatever_the_steps() {
        let steps = [1.0, 0.25, 3.0, 0.5];
        let rises = steps.map(|step| 2.0 * step);
        assert_eq!(slopes(&steps, &rises), [2.0; 5]);
        assert_eq!(piece(29.0, 29.0, [1.0, 1.0], 0.3), (0.3, 1.0));
    }

    #[test]
    fn a_flat_piece_and_an_extremum_have_slope_zero() {
        let slopes = slopes(&[1.0; 4], &[1.0, 0.0, 1.0, -1.0]);
        assert_eq!(slopes[1..4], [0.0; 3]);
    }

    #[test]
    fn given_slopes_are_limited_only_where_they_must() {
        let rises = [1.0, 1.0, 1.0, 0.0];
        let given = [1.0, 1.5, 9.0, 1.0, 1.0];
        let slopes = limited(&rises, &given);
        assert_eq!((slopes[0], slopes[4]), (given[0], 0.0));
        assert!(slopes[2] < 3.0 && slopes[3] == 0.0);
    }

    #[test]
    fn a_far_change_leaves_a_slope_alone() {
        let rises = [1.0, 9.0, 0.1, 4.0, 0.2, 7.0, 1.0, 3.0];
        let mut changed = rises;
        changed[7] = 100.0;
        let (before, after) = (slopes(&[1.0; 8], &rises), slopes(&[1.0; 8], &changed));
        assert_eq!(before[..5], after[..5]);
    }

    #[test]
    fn the_slope_of_a_piece_is_its_derivative() {
        let h = 1e-6;
        for x in [0.1, 0.5, 0.8] {
            let at = |x| piece(1.5, 2.0, [0.3, 4.0], x).0;
            let slope = (at(x + h) - at(x - h)) / (2.0 * h);
            assert!((slope - piece(1.5, 2.0, [0.3, 4.0], x).1).abs() < 1e-8);
        }
    }

    #[test]
    fn no_piece_and_one_piece() {
        assert_eq!(slopes(&[], &[]), [0.0]);
        assert_eq!(slopes(&[2.0], &[3.0]), [1.5, 1.5]);
    }
}
