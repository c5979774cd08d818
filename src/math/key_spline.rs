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

use rayon::prelude::*;

use super::cubic_spline::{CubicSpline, Ends, SplineError, Tridiagonal};

/// Columns that are solved for and evaluated together.
const COLUMNS: usize = 4096;

/// How the curve passes a key (Kochanek & Bartels 1984), each from -1 to 1 and 0 by default.
///
/// With m the slope that the key would have without a handle and d-, d+ the slopes of the straight lines
/// to its neighbours, the curve leaves with (1 - tension) ((1 + c b) m + (b + c) (d- - d+) / 2) and comes
/// in with (1 - tension) ((1 - c b) m + (b - c) (d- - d+) / 2): theirs, with m in the place of the mean
/// of d- and d+. At an end of the curve only the tension counts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Handle {
    /// 1: the curve comes to rest at the key; -1: it rushes through it.
    pub tension: f64,
    /// Not 0: a corner. -1 with tension 0 is nearly the straight lines.
    pub continuity: f64,
    /// Positive: the turn comes after the key; negative: before it.
    pub bias: f64,
}

impl Handle {
    fn is_default(&self) -> bool {
        *self == Handle::default()
    }

    /// The incoming and the outgoing slope, for the slopes of the lines before and after.
    fn slopes(&self, m: f64, before: f64, after: f64) -> [f64; 2] {
        let (c, b) = (self.continuity, self.bias);
        let half = 0.5 * (before - after);
        [
            (1.0 - self.tension) * ((1.0 - c * b) * m + (b - c) * half),
            (1.0 - self.tension) * ((1.0 + c * b) * m + (b + c) * half),
        ]
    }
}

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

/// A time within the knots: the piece, the share of it that has passed, its length. Shares outside of
/// \[0, 1\] lie on the tangent at that end.
struct Place {
    piece: usize,
    share: f64,
    length: f64,
}

impl Place {
    fn new(times: &[f64], t: f64) -> Self {
        let Some(last_piece) = times.len().checked_sub(2) else {
            return Place {
                piece: 0,
                share: 0.0,
                length: 0.0,
            };
        };
        let after = times.partition_point(|&time| time <= t);
        let piece = after.saturating_sub(1).min(last_piece);
        let length = times[piece + 1] - times[piece];
        Place {
            piece,
            share: (t - times[piece]) / length,
            length,
        }
    }

    /// Weights of value and slope at the start of the piece, then at its end.
    fn values(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if u < 0.0 {
            return [1.0, u * h, 0.0, 0.0];
        }
        if u > 1.0 {
            return [0.0, 0.0, 1.0, (u - 1.0) * h];
        }
        let v = 1.0 - u;
        [
            v * v * (1.0 + 2.0 * u),
            h * u * v * v,
            u * u * (3.0 - 2.0 * u),
            -h * u * u * v,
        ]
    }

    fn slopes(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if u < 0.0 || h == 0.0 {
            return [0.0, 1.0, 0.0, 0.0];
        }
        if u > 1.0 {
            return [0.0, 0.0, 0.0, 1.0];
        }
        let rise = 6.0 * u * (1.0 - u) / h;
        [
            -rise,
            (1.0 - u) * (1.0 - 3.0 * u),
            rise,
            u * (3.0 * u - 2.0),
        ]
    }

    fn seconds(&self) -> [f64; 4] {
        let (u, h) = (self.share, self.length);
        if !(0.0..=1.0).contains(&u) || h == 0.0 {
            return [0.0; 4];
        }
        let bend = 6.0 * (1.0 - 2.0 * u) / (h * h);
        [-bend, (6.0 * u - 4.0) / h, bend, (6.0 * u - 2.0) / h]
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

/// Values at the keys while slopes are sought: n rows.
struct Keys<'a> {
    times: &'a [f64],
    values: &'a [f64],
    columns: usize,
    periodic: bool,
}

impl Keys<'_> {
    fn count(&self) -> usize {
        self.times.len()
    }

    fn value(&self, key: usize, column: usize) -> f64 {
        self.values[key * self.columns + column]
    }

    /// The slope of the straight line behind key `i`.
    fn secant(&self, i: usize, column: usize) -> f64 {
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
    fn smooth(&self, ends: Ends<'_>) -> Result<Vec<f64>, SplineError> {
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
    fn turn(&self, ends: Ends<'_>, handles: &[Handle], incoming: &mut [f64], outgoing: &mut [f64]) {
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

    /// Cuts slopes so that each piece stays in its range, widened: times the length of the piece they are
    /// at most `3 + reach` times its rise, and `reach` times against it. Slopes of 0 always do.
    fn limit(&self, reach: f64, incoming: &mut [f64], outgoing: &mut [f64]) {
        let (n, m) = (self.count(), self.columns);
        let cut = |slope: f64, piece: usize, j: usize| {
            let along = self.secant(piece, j);
            let ends = [-reach * along, (3.0 + reach) * along];
            slope.clamp(ends[0].min(ends[1]), ends[0].max(ends[1]))
        };
        for i in 0..n {
            let before = i.checked_sub(1).or(self.periodic.then(|| n - 2));
            let after = match i + 1 < n {
                true => Some(i),
                false => self.periodic.then_some(0),
            };
            for j in 0..m {
                let at = i * m + j;
                let within = |slope: f64, pieces: [Option<usize>; 2]| {
                    let pieces = pieces.into_iter().flatten();
                    pieces.fold(slope, |slope, piece| cut(slope, piece, j))
                };
                if incoming.is_empty() || incoming[at] == outgoing[at] {
                    outgoing[at] = within(outgoing[at], [before, after]);
                    if let Some(slope) = incoming.get_mut(at) {
                        *slope = outgoing[at];
                    }
                } else {
                    outgoing[at] = within(outgoing[at], [after, None]);
                    incoming[at] = within(incoming[at], [before, None]);
                }
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

/// How steep pieces may start and end for their overshoot to be at most `share` of their rise: the
/// largest s with u^3 - s u (1 - u) >= -share on \[0, 1\]. That is the lowest course of a piece from 0 to
/// 1 whose slopes lie in \[-s, 3 + s\]; the highest is its mirror image. s = 0 for share 0 (Fritsch &
/// Carlson 1980).
fn steepest(share: f64) -> f64 {
    let lowest = |s: f64| {
        let u = (libm::sqrt(s * s + 3.0 * s) - s) / 3.0;
        u * u * u - s * u * (1.0 - u)
    };
    // at u = 1/2 the course is 1/8 - s/4
    let (mut low, mut high) = (0.0, 4.0 * share.max(0.0) + 0.5);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match lowest(middle) >= -share {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const TIMES: [f64; 6] = [0.0, 1.0, 1.5, 4.0, 5.0, 7.0];
    const ROWS: [f64; 6] = [0.3, -2.0, 1.0, 1.2, -0.5, 0.3];

    fn spline(ends: Ends<'_>, handles: &[Handle], overshoot: Option<f64>) -> KeySpline {
        let controls = Controls { handles, overshoot };
        KeySpline::new(&TIMES, &ROWS, 1, ends, controls).unwrap()
    }

    fn one(of: impl Fn(&mut [f64])) -> f64 {
        let mut out = [0.0];
        of(&mut out);
        out[0]
    }

    fn value(spline: &KeySpline, t: f64) -> f64 {
        one(|out| spline.evaluate(t, out))
    }

    fn slope(spline: &KeySpline, t: f64) -> f64 {
        one(|out| spline.derivative(t, out))
    }

    fn second(spline: &KeySpline, t: f64) -> f64 {
        one(|out| spline.second(t, out))
    }

    fn handle(tension: f64, continuity: f64, bias: f64) -> Handle {
        Handle {
            tension,
            continuity,
            bias,
        }
    }

    const CLAMPED: Ends<'static> = Ends::Clamped {
        first: &[0.7],
        last: &[-3.0],
    };

    #[test]
    fn without_handles_it_is_the_cubic_spline() {
        for ends in [Ends::Natural, Ends::NotAKnot, Ends::Periodic, CLAMPED] {
            let expected = CubicSpline::new(&TIMES, &ROWS, 1, ends).unwrap();
            let found = spline(ends, &[], None);
            for step in 0..=70 {
                let t = 0.1 * f64::from(step);
                let known = one(|out| expected.evaluate(t, out));
                // a few roundings of numbers up to 30
                assert!((value(&found, t) - known).abs() < 1e-13, "{ends:?} {t}");
                let known = one(|out| expected.derivative(t, out));
                assert!((slope(&found, t) - known).abs() < 1e-12, "{ends:?} {t}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_the_values() {
        let handles = [handle(0.0, 0.0, 0.0), handle(0.2, 0.0, -0.4)];
        let handles: Vec<Handle> = handles.iter().cycle().take(6).copied().collect();
        let spline = spline(Ends::Natural, &handles, None);
        let step = 1e-5;
        for t in [-1.0, 0.2, 1.2, 3.0, 4.5, 6.9, 8.0] {
            let rise = (value(&spline, t + step) - value(&spline, t - step)) / (2.0 * step);
            // the third derivative times step^2, and rounding over step
            assert!((rise - slope(&spline, t)).abs() < 1e-8, "{t}");
            let bend = (slope(&spline, t + step) - slope(&spline, t - step)) / (2.0 * step);
            assert!((bend - second(&spline, t)).abs() < 1e-8, "{t}");
        }
    }

    /// Jumps of slope and second derivative at a key.
    fn jumps(spline: &KeySpline, t: f64) -> [f64; 2] {
        let before = t - 1e-9;
        [
            (slope(spline, t) - slope(spline, before)).abs(),
            (second(spline, t) - second(spline, before)).abs(),
        ]
    }

    #[test]
    fn a_handle_leaves_the_curve_twice_smooth_at_the_other_keys() {
        for ends in [Ends::Natural, Ends::Periodic, CLAMPED] {
            for turned in [1, 2, 4] {
                let mut handles = [Handle::default(); 6];
                handles[turned] = handle(0.5, 0.0, 0.3);
                let spline = spline(ends, &handles, None);
                for i in 1..5 {
                    let [slope, second] = jumps(&spline, TIMES[i]);
                    // 1e-9 of derivatives up to 100
                    assert!(slope < 1e-6, "{ends:?} {turned} {i}");
                    assert!(second < 1e-6 || i == turned, "{ends:?} {turned} {i}");
                }
            }
        }
    }

    #[test]
    fn handles_are_those_of_kochanek_and_bartels_about_the_curve_s_own_slope() {
        let own = slope(&spline(Ends::Natural, &[], None), TIMES[2]);
        let secant = |i: usize| (ROWS[i + 1] - ROWS[i]) / (TIMES[i + 1] - TIMES[i]);
        let (before, after) = (secant(1), secant(2));
        let turned = |handle: Handle| {
            let mut handles = [Handle::default(); 6];
            handles[2] = handle;
            let spline = spline(Ends::Natural, &handles, None);
            [slope(&spline, TIMES[2] - 1e-12), slope(&spline, TIMES[2])]
        };
        let near = |found: [f64; 2], known: [f64; 2]| {
            assert!((found[0] - known[0]).abs() < 1e-9, "{found:?} {known:?}");
            assert!((found[1] - known[1]).abs() < 1e-9, "{found:?} {known:?}");
        };
        near(turned(handle(1.0, 0.0, 0.0)), [0.0, 0.0]);
        near(turned(handle(0.5, 0.0, 0.0)), [0.5 * own; 2]);
        let shift = 0.5 * (before - after);
        near(turned(handle(0.0, 0.0, 1.0)), [own + shift; 2]);
        near(turned(handle(0.0, -1.0, 0.0)), [own + shift, own - shift]);
    }

    #[test]
    fn full_tension_everywhere_stays_between_the_keys() {
        let handles = [handle(1.0, 0.0, 0.0); 6];
        for ends in [Ends::Natural, Ends::Periodic, CLAMPED] {
            let spline = spline(ends, &handles, None);
            for step in 0..=700 {
                let t = 0.01 * f64::from(step);
                let i = TIMES.partition_point(|&time| time <= t).clamp(1, 5) - 1;
                let (low, high) = (ROWS[i].min(ROWS[i + 1]), ROWS[i].max(ROWS[i + 1]));
                assert!((low - 1e-15..=high + 1e-15).contains(&value(&spline, t)));
            }
        }
    }

    #[test]
    fn periodic_curves_go_round_and_gain_what_a_period_gains() {
        let rows = [0.3, -2.0, 1.0, 1.2, -0.5, 2.3];
        let gaining =
            KeySpline::new(&TIMES, &rows, 1, Ends::Periodic, Controls::default()).unwrap();
        for t in [0.0, 0.4, 3.3, 6.99] {
            let (here, next) = (value(&gaining, t), value(&gaining, t + 7.0));
            assert!((next - here - 2.0).abs() < 1e-13);
            assert!((value(&gaining, t - 14.0) - here + 4.0).abs() < 1e-13);
            assert!((slope(&gaining, t + 7.0) - slope(&gaining, t)).abs() < 1e-12);
        }
        let [slope, second] =
            [slope, second].map(|of| of(&gaining, 7.0 - 1e-9) - of(&gaining, 0.0));
        assert!(slope.abs() < 1e-6 && second.abs() < 1e-6);
    }

    #[test]
    fn beyond_the_ends_it_goes_on_straight() {
        let spline = spline(CLAMPED, &[], None);
        assert!((value(&spline, -2.0) - (0.3 - 2.0 * 0.7)).abs() < 1e-14);
        assert!((value(&spline, 9.0) - (0.3 - 2.0 * 3.0)).abs() < 1e-13);
        assert_eq!(second(&spline, 9.0), 0.0);
    }

    #[test]
    fn one_key_is_a_constant_two_a_line_none_an_error() {
        let of = |n: usize, t: f64| {
            let rows = &ROWS[..n];
            KeySpline::new(&TIMES[..n], rows, 1, Ends::Natural, Controls::default())
                .map(|spline| value(&spline, t))
        };
        assert_eq!(of(1, 5.0), Ok(0.3));
        assert!((of(2, 0.25).unwrap() - (0.3 - 0.25 * 2.3)).abs() < 1e-15);
        assert_eq!(of(0, 0.0), Err(SplineError::Counts));
    }

    #[test]
    fn many_columns_are_many_curves() {
        let width = 2 * COLUMNS + 7;
        let rows: Vec<f64> = (0..6 * width)
            .map(|at| ROWS[at / width] * (1.0 + (at % width) as f64))
            .collect();
        let many = KeySpline::new(&TIMES, &rows, width, Ends::Natural, Controls::default());
        let mut found = vec![0.0; width];
        many.unwrap().evaluate(2.2, &mut found);
        let known = value(&spline(Ends::Natural, &[], None), 2.2);
        for (j, found) in found.iter().enumerate() {
            let known = known * (1.0 + j as f64);
            assert!((found - known).abs() <= 1e-12 * known.abs());
        }
    }

    proptest! {
        /// The bound holds for any keys, handles, ends and shares; 0 keeps the shape.
        #[test]
        fn no_coordinate_leaves_its_range_by_more_than_the_share(
            rows in prop::collection::vec(-1.0..1.0_f64, 7),
            gaps in prop::collection::vec(0.01..3.0_f64, 6),
            handles in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 7),
            share in prop::sample::select(vec![0.0, 0.01, 0.1, 0.5, 3.0]),
            kind in 0..3,
            turned in any::<bool>(),
        ) {
            let mut times = vec![0.0];
            gaps.iter().for_each(|gap| times.push(times[times.len() - 1] + gap));
            let ends = [Ends::Natural, Ends::Periodic, CLAMPED][kind as usize];
            let handles: Vec<Handle> =
                handles.iter().map(|&[t, c, b]| handle(t, c, b)).collect();
            let handles = if turned { &handles[..] } else { &[] };
            let controls = Controls { handles, overshoot: Some(share) };
            let spline = KeySpline::new(&times, &rows, 1, ends, controls).unwrap();
            for i in 0..6 {
                let (low, high) = (rows[i].min(rows[i + 1]), rows[i].max(rows[i + 1]));
                let room = share * (high - low) + 1e-14; // rounding of sums of numbers below 3
                let mut before = rows[i];
                for step in 0..=40 {
                    let t = times[i] + gaps[i] * f64::from(step) / 40.0;
                    let here = value(&spline, t);
                    prop_assert!((low - room..=high + room).contains(&here));
                    if share == 0.0 {
                        let rising = (here - before) * (rows[i + 1] - rows[i]).signum();
                        prop_assert!(rising >= -1e-14);
                    }
                    before = here;
                }
            }
        }
    }
}
