//! How smoothly a motion passes its keys (X19 Fig. 9): the size of the second derivative along the
//! sequence, the integrand of its energy (3), by differences of even steps.

/// Sizes of the second differences of `rows` (coordinates of a space or positions, `width` numbers each)
/// over `step` squared: one for every row but the first and the last. Fewer than three rows give none.
///
/// # Panics
/// `rows` is not whole rows.
pub fn second_differences(rows: &[f64], width: usize, step: f64) -> Vec<f64> {
    assert_eq!(rows.len() % width.max(1), 0, "whole rows are needed");
    let rows: Vec<&[f64]> = rows.chunks_exact(width.max(1)).collect();
    rows.windows(3)
        .map(|three| {
            let bends = (0..width).map(|j| three[0][j] - 2.0 * three[1][j] + three[2][j]);
            bends.map(|bend| bend * bend).sum::<f64>().sqrt() / (step * step)
        })
        .collect()
}

/// The mean size of the steps from one of `rows` to the next: what second derivatives of motions through
/// the same keys in different spaces are divided by to be compared. 0 for fewer than two rows.
pub fn mean_step(rows: &[f64], width: usize) -> f64 {
    let rows: Vec<&[f64]> = rows.chunks_exact(width.max(1)).collect();
    let steps = rows.windows(2).map(|pair| {
        let squares = pair[0].iter().zip(pair[1]).map(|(a, b)| (b - a) * (b - a));
        squares.sum::<f64>().sqrt()
    });
    steps.sum::<f64>() / rows.len().saturating_sub(1).max(1) as f64
}

/// How far the second derivative rises at the keys.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// The largest within a step of a key that is not an end.
    pub highest: f64,
    /// The median over all of them of the largest within a step of a key.
    pub typical: f64,
    /// The median over the whole motion.
    pub median: f64,
}

impl Peaks {
    /// Of sizes of second derivatives at the rising `times`, for keys at `keys`; without sizes or inner
    /// keys all are 0.
    pub fn at_keys(times: &[f64], sizes: &[f64], keys: &[f64]) -> Self {
        let inner = keys
            .get(1..keys.len().saturating_sub(1))
            .unwrap_or_default();
        let step = times
            .windows(2)
            .map(|pair| pair[1] - pair[0])
            .fold(0.0, f64::max);
        let peak = |key: &f64| {
            let near = times.iter().zip(sizes);
            near.filter(|(time, _)| (*time - key).abs() <= step * (1.0 + 1e-9))
                .fold(0.0, |peak: f64, (_, size)| peak.max(*size))
        };
        let peaks: Vec<f64> = inner.iter().map(peak).collect();
        Peaks {
            highest: peaks.iter().copied().fold(0.0, f64::max),
            typical: median(&peaks),
            median: median(sizes),
        }
    }
}

/// The middle one; 0 of none.
fn median(numbers: &[f64]) -> f64 {
    let mut sorted = numbers.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    match sorted.len() {
        0 => 0.0,
        n => 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_has_one_second_derivative_and_a_line_none() {
        let row = |i: i32| {
            let t = 0.5 * f64::from(i);
            [3.0 * t * t, 4.0 * t * t, 2.0 - t]
        };
        let rows: Vec<f64> = (0..8).flat_map(row).collect();
        let sizes = second_differences(&rows, 3, 0.5);
        assert_eq!(sizes.len(), 6);
        // twice (3, 4)
        assert!(sizes.iter().all(|size| (size - 10.0).abs() < 1e-12));
        assert!(second_differences(&rows[..6], 3, 0.5).is_empty());
    }

    #[test]
    fn a_corner_is_a_peak_at_its_key() {
        let times: Vec<f64> = (1..20).map(f64::from).collect();
        let positions: Vec<f64> = (0..21).map(|i| (f64::from(i) - 10.0).abs()).collect();
        let sizes = second_differences(&positions, 1, 1.0);
        let peaks = Peaks::at_keys(&times, &sizes, &[0.0, 10.0, 20.0]);
        assert_eq!(
            (peaks.highest, peaks.typical, peaks.median),
            (2.0, 2.0, 0.0)
        );
        let none = Peaks::at_keys(&[], &[], &[0.0, 1.0]);
        assert_eq!((none.highest, none.median), (0.0, 0.0));
        assert_eq!(mean_step(&[0.0, 3.0, 4.0], 1), 2.0);
    }
}
