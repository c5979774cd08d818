//! The slopes at the keys: those of the C2 curve, and those that handles turn.

use super::super::cubic_spline::{CubicSpline, Ends, SplineError, Tridiagonal};
use super::handle::Handle;

/// Values at the keys while slopes are sought: n rows.
pub(super) struct Keys<'a> {
    pub(super) times: &'a [f64],
    pub(super) values: &'a [f64],
    pub(super) columns: usize,
    pub(super) periodic: bool,
}

impl Keys<'_> {
    pub(super) fn count(&self) -> usize {
        self.times.len()
    }

    fn value(&self, key: usize, column: usize) -> f64 {
        self.values[key * self.columns + column]
    }

    /// The slope of the straight line behind key `i`.
    pub(super) fn secant(&self, i: usize, column: usize) -> f64 {
        let rise = self.value(i + 1, column) - self.value(i, column);
        rise / (self.times[i + 1] - self.times[i])
    }

    /// What a period gains, per unit of time; 0 for other ends.
    fn drift(&self, column: usize) -> f64 {
        let last = self.count() - 1;
        match self.periodic {
            true => {
                let gain = self.value(last, column) - self.value(0, column);
                gain / (self.times[last] - self.times[0])
            }
            false => 0.0,
        }
    }

    /// The slopes of the C2 curve at all keys.
    pub(super) fn smooth(&self, ends: Ends<'_>) -> Result<Vec<f64>, SplineError> {
        let m = self.columns;
        let drift: Vec<f64> = (0..m).map(|j| self.drift(j)).collect();
        let level = |(at, value): (usize, &f64)| {
            value - drift[at % m] * (self.times[at / m] - self.times[0])
        };
        let level: Vec<f64> = self.values.iter().enumerate().map(level).collect();
        let spline = CubicSpline::new(self.times, &level, m, ends)?;
        let mut slopes = Vec::with_capacity(level.len());
        for key in 0..self.count() {
            let slope = spline.slope_at_knot(key);
            slopes.extend(slope.iter().zip(&drift).map(|(slope, drift)| slope + drift));
        }
        Ok(slopes)
    }

    /// Turns the tangents at keys that have handles, and smooths the stretches between those anew.
    pub(super) fn turn(
        &self,
        ends: Ends<'_>,
        handles: &[Handle],
        incoming: &mut [f64],
        outgoing: &mut [f64],
    ) {
        let (n, m) = (self.count(), self.columns);
        let mut handles = handles.to_vec();
        if self.periodic {
            let one = if handles[0].is_default() { n - 1 } else { 0 };
            (handles[0], handles[n - 1]) = (handles[one], handles[one]);
        }
        let turned: Vec<usize> = (0..n).filter(|&i| !handles[i].is_default()).collect();
        for &i in &turned {
            for j in 0..m {
                let slope = outgoing[i * m + j];
                let around = self.secants_at(i, j).unwrap_or([slope; 2]);
                let [before, after] = handles[i].slopes(slope, around[0], around[1]);
                (incoming[i * m + j], outgoing[i * m + j]) = (before, after);
            }
        }
        let stretches = match self.periodic {
            true => around(&turned, n - 1),
            false => along(&turned, n - 1),
        };
        let natural = ends == Ends::Natural;
        for [from, to] in stretches {
            let free = |key: usize| natural && (key == 0 || key == n - 1) && !turned.contains(&key);
            self.smooth_between([from, to], [free(from), free(to)], incoming, outgoing);
        }
        if self.periodic {
            // one key, twice
            incoming.copy_within((n - 1) * m.., 0);
            outgoing.copy_within((n - 1) * m.., 0);
        }
    }

    /// The slopes of the lines before and after a key; none at an end.
    fn secants_at(&self, key: usize, column: usize) -> Option<[f64; 2]> {
        let last = self.count() - 1;
        let before = match key {
            0 if self.periodic => last - 1,
            0 => return None,
            key => key - 1,
        };
        let after = match key {
            key if key < last => key,
            _ if self.periodic => 0,
            _ => return None,
        };
        Some([self.secant(before, column), self.secant(after, column)])
    }

    /// The C2 slopes strictly between two keys, whose own slopes are given unless they are `free` (second
    /// derivative 0). A stretch that ends beyond the last key goes round.
    fn smooth_between(
        &self,
        [from, to]: [usize; 2],
        free: [bool; 2],
        incoming: &mut [f64],
        outgoing: &mut [f64],
    ) {
        let (m, pieces) = (self.columns, self.count() - 1);
        let rows = to - from + 1;
        // key `pieces` is key 0 of the next round where the stretch goes on beyond it
        let key = |row: usize| match from + row {
            key if key > pieces => key - pieces,
            key => key,
        };
        let piece = |row: usize| (from + row) % pieces;
        let h: Vec<f64> = (0..rows - 1)
            .map(|row| self.times[piece(row) + 1] - self.times[piece(row)])
            .collect();
        let mut matrix = Tridiagonal {
            below: vec![0.0; rows],
            diagonal: vec![1.0; rows],
            above: vec![0.0; rows],
        };
        let mut right = vec![0.0; rows * m];
        for row in 1..rows - 1 {
            matrix.below[row] = h[row];
            matrix.diagonal[row] = 2.0 * (h[row - 1] + h[row]);
            matrix.above[row] = h[row - 1];
            for j in 0..m {
                let [before, after] = [row - 1, row].map(|row| self.secant(piece(row), j));
                right[row * m + j] = 3.0 * (h[row] * before + h[row - 1] * after);
            }
        }
        for j in 0..m {
            right[j] = match free[0] {
                true => 1.5 * self.secant(piece(0), j),
                false => outgoing[key(0) * m + j],
            };
            right[(rows - 1) * m + j] = match free[1] {
                true => 1.5 * self.secant(piece(rows - 2), j),
                false => incoming[key(rows - 1) * m + j],
            };
        }
        matrix.above[0] = if free[0] { 0.5 } else { 0.0 };
        matrix.below[rows - 1] = if free[1] { 0.5 } else { 0.0 };
        matrix.solve(&mut right, m);
        for row in 0..rows {
            let (source, target) = (row * m, key(row) * m);
            let inner = row > 0 && row < rows - 1;
            if inner || (row == 0 && free[0]) || (row == rows - 1 && free[1]) {
                incoming[target..target + m].copy_from_slice(&right[source..source + m]);
                outgoing[target..target + m].copy_from_slice(&right[source..source + m]);
            }
        }
    }
}

/// The stretches between turned keys, and from the ends to them.
fn along(turned: &[usize], last: usize) -> Vec<[usize; 2]> {
    let mut marks = vec![0];
    marks.extend(turned.iter().filter(|&&key| key != 0 && key != last));
    marks.push(last);
    marks.windows(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// The stretches between turned keys once round; the last goes on beyond the end.
fn around(turned: &[usize], pieces: usize) -> Vec<[usize; 2]> {
    let keys: Vec<usize> = turned.iter().copied().filter(|&key| key < pieces).collect();
    let next = keys.iter().skip(1).copied();
    let round = keys.first().map(|first| first + pieces);
    keys.iter()
        .zip(next.chain(round))
        .map(|(&from, to)| [from, to])
        .collect()
}
