//! Cubic curves through rows of numbers at chosen times (X19 §3), with the controls of an animator.
//!
//! Each column has a curve of its own; all share the knots, so the tridiagonal system is the same for
//! all. The curve is C2 and least bent (X19 eq. 1) unless it is told otherwise:
//!
//! - a [`Handle`] turns the tangents at one key (Kochanek & Bartels 1984). The curve stays C2 at all keys
//!   without a handle and C1 at those without continuity;
//! - a bound on the overshoot keeps a coordinate between two keys in the range of the two, widened by a
//!   share of it. Share 0 keeps the shape: monotone between two keys. The curve is then C1 only.
//!
//! Curves are held in Hermite form: value, incoming and outgoing slope at each key. Beyond the ends they
//! go on straight; periodic ones go round again, shifted by what a period gains.

mod handle;
mod limit;
mod place;
mod slopes;
#[cfg(test)]
mod tests;

use rayon::prelude::*;

use super::cubic_spline::{CubicSpline, Ends, SplineError};
pub use handle::Handle;
use limit::steepest;
use place::Place;
use slopes::Keys;

/// Columns that are solved for and evaluated together.
const COLUMNS: usize = 4096;

/// Controls beyond the ends.
#[derive(Debug, Clone, Copy, Default)]
pub struct Controls<'a> {
    /// One a key, or none at all. The first and the last key of a periodic curve are one: the first's
    /// handle counts, or the last's where the first has none.
    pub handles: &'a [Handle],
    /// By what share of the range of two neighbouring keys a coordinate may leave that range between
    /// them; at least 0.
    pub overshoot: Option<f64>,
}

/// Curves through n keys of d columns.
#[derive(Debug, Clone, PartialEq)]
pub struct KeySpline {
    times: Vec<f64>,
    width: usize,
    blocks: Vec<Block>,
    periodic: bool,
    /// Whether the ends were given slopes or are no knots: nothing here tells them.
    told_ends: bool,
}

/// Some neighbouring columns; each array has n rows.
#[derive(Debug, Clone, PartialEq)]
struct Block {
    columns: usize,
    values: Vec<f64>,
    outgoing: Vec<f64>,
    /// Empty where it is the outgoing.
    incoming: Vec<f64>,
}

impl KeySpline {
    /// The curves through `rows` (n rows of `width`) at n rising `times`. With periodic ends the last
    /// row may differ from the first: slopes and second derivatives are periodic, and each round gains
    /// the difference. One key gives constants.
    ///
    /// # Errors
    /// See [`SplineError`]; another number of handles than keys is [`SplineError::Counts`].
    pub fn new(
        times: &[f64],
        rows: &[f64],
        width: usize,
        ends: Ends<'_>,
        controls: Controls<'_>,
    ) -> Result<Self, SplineError> {
        let n = times.len();
        let handles = controls.handles.len();
        if rows.len() != n * width || (handles != 0 && handles != n) {
            return Err(SplineError::Counts);
        }
        if let Ends::Clamped { first, last } = ends
            && (first.len() != width || last.len() != width)
        {
            return Err(SplineError::Counts);
        }
        // no columns, but still knots to be checked
        CubicSpline::new(times, &[], 0, Ends::Natural)?;
        let starts: Vec<usize> = (0..width).step_by(COLUMNS).collect();
        let blocks = starts
            .par_iter()
            .map(|&start| {
                let columns = start..width.min(start + COLUMNS);
                let values: Vec<f64> = rows
                    .chunks_exact(width)
                    .flat_map(|row| &row[columns.clone()])
                    .copied()
                    .collect();
                let ends = match ends {
                    Ends::Clamped { first, last } => Ends::Clamped {
                        first: &first[columns.clone()],
                        last: &last[columns.clone()],
                    },
                    other => other,
                };
                Block::new(times, values, columns.len(), ends, controls)
            })
            .collect::<Result<_, _>>()?;
        Ok(KeySpline {
            times: times.to_vec(),
            width,
            blocks,
            periodic: ends == Ends::Periodic,
            told_ends: !matches!(ends, Ends::Natural | Ends::Periodic),
        })
    }

    /// The curves through the same rows at other times and with other controls. None where ends that are
    /// neither natural nor periodic would have to be given again, and for times that do not suit.
    #[must_use]
    pub fn again(&self, times: &[f64], controls: Controls<'_>) -> Option<Self> {
        let handles = controls.handles.len();
        let counts = times.len() == self.times.len() && (handles == 0 || handles == times.len());
        if self.told_ends || !counts || CubicSpline::new(times, &[], 0, Ends::Natural).is_err() {
            return None;
        }
        let ends = match self.periodic {
            true => Ends::Periodic,
            false => Ends::Natural,
        };
        let anew =
            |block: &Block| Block::new(times, block.values.clone(), block.columns, ends, controls);
        let blocks = self.blocks.par_iter().map(anew).collect::<Result<_, _>>();
        Some(KeySpline {
            times: times.to_vec(),
            blocks: blocks.ok()?,
            ..*self
        })
    }

    /// The times of the keys.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// d, the number of columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Writes the values at `t`, d numbers.
    ///
    /// # Panics
    /// `values` is not d long.
    pub fn evaluate(&self, t: f64, values: &mut [f64]) {
        let (place, rounds) = self.place(t);
        self.fill(values, |block, out| block.evaluate(&place, rounds, out));
    }

    /// Writes the derivatives by time at `t`, d numbers; at a corner those after it.
    ///
    /// # Panics
    /// `slopes` is not d long.
    pub fn derivative(&self, t: f64, slopes: &mut [f64]) {
        let (place, _) = self.place(t);
        self.fill(slopes, |block, out| {
            block.blend(place.piece, &place.slopes(), out);
        });
    }

    /// Writes the second derivatives by time at `t`, d numbers; at a key those after it, beyond the ends
    /// 0.
    ///
    /// # Panics
    /// `seconds` is not d long.
    pub fn second(&self, t: f64, seconds: &mut [f64]) {
        let (place, _) = self.place(t);
        self.fill(seconds, |block, out| {
            block.blend(place.piece, &place.seconds(), out);
        });
    }

    fn fill(&self, out: &mut [f64], write: impl Fn(&Block, &mut [f64]) + Sync) {
        assert_eq!(out.len(), self.width, "room for d numbers is needed");
        out.par_chunks_mut(COLUMNS)
            .zip(&self.blocks)
            .for_each(|(out, block)| write(block, out));
    }

    /// Where `t` lies, and how many rounds were taken off it.
    fn place(&self, t: f64) -> (Place, f64) {
        let last = self.times.len() - 1;
        let (first, end) = (self.times[0], self.times[last]);
        let beyond = t < first || t > end;
        if self.periodic && beyond && last > 0 {
            let period = end - first;
            let rounds = libm::floor((t - first) / period);
            let within = (t - rounds * period).clamp(first, end);
            return (Place::new(&self.times, within), rounds);
        }
        (Place::new(&self.times, t), 0.0)
    }
}

impl Block {
    fn new(
        times: &[f64],
        values: Vec<f64>,
        columns: usize,
        ends: Ends<'_>,
        controls: Controls<'_>,
    ) -> Result<Self, SplineError> {
        let keys = Keys {
            times,
            values: &values,
            columns,
            periodic: ends == Ends::Periodic && times.len() > 1,
        };
        let mut outgoing = keys.smooth(ends)?;
        let mut incoming = Vec::new();
        if times.len() > 1 && controls.handles.iter().any(|handle| !handle.is_default()) {
            incoming = outgoing.clone();
            keys.turn(ends, controls.handles, &mut incoming, &mut outgoing);
        }
        if let Some(share) = controls.overshoot {
            keys.limit(steepest(share), &mut incoming, &mut outgoing);
        }
        Ok(Block {
            columns,
            values,
            outgoing,
            incoming,
        })
    }

    fn evaluate(&self, place: &Place, rounds: f64, out: &mut [f64]) {
        self.blend(place.piece, &place.values(), out);
        if rounds != 0.0 {
            let last = self.values.len() - self.columns;
            for (j, out) in out.iter_mut().enumerate() {
                *out += rounds * (self.values[last + j] - self.values[j]);
            }
        }
    }

    /// The weighted sum of value and outgoing slope at the start of a piece and of value and incoming
    /// slope at its end; the piece of a single key starts and ends there.
    fn blend(&self, piece: usize, weights: &[f64; 4], out: &mut [f64]) {
        let m = self.columns;
        let end = (piece + 1).min(self.values.len() / m - 1);
        let (start, end) = (piece * m..(piece + 1) * m, end * m..(end + 1) * m);
        let incoming = match self.incoming.is_empty() {
            true => &self.outgoing,
            false => &self.incoming,
        };
        let starts = self.values[start.clone()].iter().zip(&self.outgoing[start]);
        let ends = self.values[end.clone()].iter().zip(&incoming[end]);
        let [v0, s0, v1, s1] = *weights;
        for (out, ((a, p), (b, q))) in out.iter_mut().zip(starts.zip(ends)) {
            *out = v0 * a + s0 * p + (v1 * b + s1 * q);
        }
    }
}
