//! The left-out error: what a fit is worth between frames. Every second frame is fitted with the same
//! k/n, l/n and m, and measured at the frames between, beside linear blending and a cubic spline of every
//! coordinate (C2, not-a-knot).
//!
//! All of it happens in reduced coordinates: any combination of frames is a row of n numbers, isometric
//! to the frames themselves, so the frames are not read again.

use super::ch12::Signals;
use super::subspace::{Subspace, decomposed};
use crate::diag::Result;
use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::pca::{Basis, Pca, Table};
use crate::task::Task;

/// Relative errors at left-out frames, and where psi does worse than linear blending.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOutFit {
    /// Of the same kind of fit.
    pub psi: f64,
    /// Of linear blending between the two neighbours.
    pub linear: f64,
    /// Of a C2 cubic spline in every coordinate.
    pub cubic: f64,
    /// Left-out frames (from 1) whose error by psi exceeds that by linear blending.
    pub worse: Vec<usize>,
}

/// Every second frame in a shape subspace of its own, to be fitted, and the frames between to measure with.
pub struct Trial {
    halves: Halves,
    pca: Pca,
    basis: Basis,
    subspace: Subspace,
}

impl Trial {
    /// Of `pca`'s rows with `modes` modes, or as many as half of the frames have. None below 5 frames: too
    /// little is left to fit or to measure.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn new(pca: &Pca, modes: usize, task: &Task) -> Result<Option<Self>> {
        if pca.rows() < 5 {
            return Ok(None);
        }
        let halves = Halves::of(&pca.reduced(), pca.rows());
        let table = Table::new(&halves.kept, halves.width);
        let most = halves.kept.len() / halves.width - 1;
        let (pca, basis) = decomposed(&table, modes.min(most), task)?;
        Ok(Some(Trial {
            subspace: Subspace::new(&pca, &basis),
            halves,
            pca,
            basis,
        }))
    }

    /// The frames that are fitted.
    pub fn subspace(&self) -> &Subspace {
        &self.subspace
    }

    /// (k, l) of the fit to all frames as those of one to half of them: k/n and l/n stay.
    pub fn share(&self, (controls, sites): (usize, usize)) -> (usize, usize) {
        let (n, half) = (self.halves.width, self.subspace.frames);
        let share = |count: usize| (count * half + n / 2) / n;
        // an interpolating time signal has two control points more than frames
        match controls == n + 2 {
            true => (half + 2, share(sites)),
            false => (share(controls), share(sites)),
        }
    }

    /// What `signals` of [`Trial::subspace`] are worth at the frames between.
    pub fn measure(&self, signals: &Signals) -> LeftOutFit {
        let halves = &self.halves;
        let psi = halves.errors(&self.psi(signals));
        let linear = halves.errors(&halves.linear());
        let worse = (0..psi.len()).filter(|&i| psi[i] > linear[i]);
        LeftOutFit {
            psi: halves.relative(&psi),
            linear: halves.relative(&linear),
            cubic: halves.relative(&halves.errors(&halves.cubic())),
            worse: worse.map(|i| 2 * i + 2).collect(),
        }
    }

    fn psi(&self, signals: &Signals) -> Vec<f64> {
        let halves = &self.halves;
        let mut x = vec![0.0; self.basis.modes];
        let mut found = Vec::with_capacity(halves.out.len());
        for i in 0..halves.count() {
            let p = signals.time.at(Halves::time(i)).unwrap_or_default();
            signals.pose.evaluate(p, &mut x);
            let mut row = self.pca.mean().to_vec();
            for (x, vector) in x.iter().zip(self.basis.vectors.chunks_exact(halves.width)) {
                row.iter_mut().zip(vector).for_each(|(z, h)| *z += x * h);
            }
            found.extend(row);
        }
        found
    }
}

/// The fewest modes, from `least` on, for which a cubic spline in the shape subspace of the kept frames
/// is at most `cost` times as wrong at the left-out frames as one in every coordinate; `least` where there
/// are too few frames to tell.
///
/// # Errors
/// The task was cancelled.
pub fn modes_between(pca: &Pca, least: usize, cost: f64, task: &Task) -> Result<usize> {
    if pca.rows() < 5 {
        return Ok(least);
    }
    let halves = Halves::of(&pca.reduced(), pca.rows());
    let table = Table::new(&halves.kept, halves.width);
    let most = halves.kept.len() / halves.width - 1;
    let (kept, basis) = decomposed(&table, most, task)?;
    let cubic = halves.cubic();
    let whole: f64 = halves.errors(&cubic).iter().sum();
    // What mode j takes away from the squared error: e.e - (e + c).(e + c) with e the cubic's error and
    // c its coordinate there.
    let mut dropped = vec![0.0; basis.modes];
    for (row, out) in cubic
        .chunks_exact(halves.width)
        .zip(halves.out.chunks_exact(halves.width))
    {
        for (vector, dropped) in basis.vectors.chunks_exact(halves.width).zip(&mut dropped) {
            let (mut error, mut coordinate) = (0.0, 0.0);
            for (i, h) in vector.iter().enumerate() {
                error += h * (out[i] - row[i]);
                coordinate += h * (row[i] - kept.mean()[i]);
            }
            *dropped += coordinate * (2.0 * error + coordinate);
        }
    }
    let mut error = whole;
    let mut modes = basis.modes;
    while modes > least {
        error += dropped[modes - 1];
        if error > cost * cost * whole {
            break;
        }
        modes -= 1;
    }
    Ok(modes.max(least))
}

/// Frames 1, 3, 5, .. and, each between two of them, 2, 4, ..; rows of `width` numbers.
struct Halves {
    width: usize,
    kept: Vec<f64>,
    out: Vec<f64>,
}

impl Halves {
    fn of(rows: &[f64], width: usize) -> Self {
        let every_second = |first: usize| -> Vec<f64> {
            let rows = rows.chunks_exact(width).skip(first).step_by(2);
            rows.flatten().copied().collect()
        };
        let kept = every_second(0);
        let mut out = every_second(1);
        out.truncate(kept.len() - width);
        Halves { width, kept, out }
    }

    /// Time of left-out frame `i` among those kept, which count from 1.
    fn time(i: usize) -> f64 {
        i as f64 + 1.5
    }

    fn count(&self) -> usize {
        self.out.len() / self.width
    }

    /// Squared distances of the left-out frames from `rows`.
    fn errors(&self, rows: &[f64]) -> Vec<f64> {
        let pairs = self
            .out
            .chunks_exact(self.width)
            .zip(rows.chunks_exact(self.width));
        pairs
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum())
            .collect()
    }

    /// The root of the errors' sum over that of the left-out frames' squared distances from their mean;
    /// 0 where those do not move.
    fn relative(&self, errors: &[f64]) -> f64 {
        let count = self.count();
        let mut mean = vec![0.0; self.width];
        for row in self.out.chunks_exact(self.width) {
            mean.iter_mut()
                .zip(row)
                .for_each(|(mean, z)| *mean += z / count as f64);
        }
        let whole: f64 = self.errors(&mean.repeat(count)).iter().sum();
        if whole > 0.0 {
            (errors.iter().sum::<f64>() / whole).sqrt()
        } else {
            0.0
        }
    }

    fn linear(&self) -> Vec<f64> {
        let before = self.kept.iter();
        let after = self.kept[self.width..].iter();
        before.zip(after).map(|(a, b)| 0.5 * (a + b)).collect()
    }

    fn cubic(&self) -> Vec<f64> {
        let knots: Vec<f64> = (0..self.kept.len() / self.width)
            .map(|i| 1.0 + i as f64)
            .collect();
        let mut rows = vec![0.0; self.out.len()];
        // knots rise by one and the counts match, so there is a spline
        if let Ok(spline) = CubicSpline::new(&knots, &self.kept, self.width, Ends::NotAKnot) {
            for (i, row) in rows.chunks_exact_mut(self.width).enumerate() {
                spline.evaluate(Halves::time(i), row);
            }
        }
        rows
    }
}
