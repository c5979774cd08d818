//! How much a seam shows: steps, changes of speed and accelerations there beside those of the whole motion.

use crate::loom::Loom;

/// Ratios of the seam to the motion, in the shape subspace (rigid motion apart), at whole frames. Below 1
/// it cannot be told from the motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Seam {
    /// Largest step at the seam over the mean step elsewhere.
    pub step: f64,
    /// Largest change of velocity from frame to frame at the seam over the largest elsewhere.
    pub velocity: f64,
    /// Largest second difference at the seam over the median elsewhere.
    pub acceleration: f64,
}

impl Seam {
    /// Measures frames `first`..=`last` (from 1) of a loom against all its other frames. Ratios are 0
    /// where the seam does not move, infinite where only the seam does.
    pub fn measure(loom: &Loom, first: usize, last: usize) -> Self {
        let n = loom.frames();
        let at = |frame: usize| loom.coordinates_at(frame as f64).unwrap_or_default();
        let x: Vec<Vec<f64>> = (1..=n).map(at).collect();
        let velocities: Vec<Vec<f64>> = (1..=n).map(|frame| velocity(loom, frame as f64)).collect();
        let steps = differences(&x);
        let bends = differences(&steps);
        let jumps = differences(&velocities);
        let norms = |all: &[Vec<f64>]| all.iter().map(|v| norm(v)).collect::<Vec<_>>();
        // A difference that starts at frame i (from 0) reaches over its order.
        let touches = |i: usize, order: usize| i < last && i + 1 + order >= first;
        let (steps, jumps, bends) = (norms(&steps), norms(&jumps), norms(&bends));
        let largest = |values: &[f64], order: usize| -> f64 {
            (0..values.len())
                .filter(|&i| touches(i, order))
                .map(|i| values[i])
                .fold(0.0, f64::max)
        };
        let elsewhere = |values: &[f64], order: usize| -> Vec<f64> {
            (0..values.len())
                .filter(|&i| !touches(i, order))
                .map(|i| values[i])
                .collect()
        };
        Seam {
            step: ratio(largest(&steps, 1), mean(&elsewhere(&steps, 1))),
            velocity: ratio(largest(&jumps, 1), most(&elsewhere(&jumps, 1))),
            acceleration: ratio(largest(&bends, 2), median(elsewhere(&bends, 2))),
        }
    }

    /// The largest of the ratios.
    pub fn worst(&self) -> f64 {
        self.step.max(self.velocity).max(self.acceleration)
    }
}

/// Derivative of the coordinates in the shape subspace.
fn velocity(loom: &Loom, t: f64) -> Vec<f64> {
    let mut x = vec![0.0; loom.pose().modes()];
    if let (Some(p), Some(v)) = (loom.time().at(t), loom.time().velocity(t)) {
        loom.pose().along(p, v, &mut x);
    }
    x
}

fn differences(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let difference = |pair: &[Vec<f64>]| pair[1].iter().zip(&pair[0]).map(|(b, a)| b - a).collect();
    rows.windows(2).map(difference).collect()
}

fn norm(v: &[f64]) -> f64 {
    v.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}

/// 0 where the seam does not move, infinite where only the seam does.
fn ratio(seam: f64, motion: f64) -> f64 {
    if seam == 0.0 { 0.0 } else { seam / motion }
}
