//! Positions in the plane whose distances are those given (CH12 §3.2.1): metric multidimensional
//! scaling by majorisation, with any of the positions held.
//!
//! Minimises the stress (6), sum_{i<j} w_ij (|p_i - p_j| - delta_ij)^2. With V = diag(sum_j w_ij) - W and
//! B(q)_ij = -w_ij delta_ij / |q_i - q_j|, the stress is at most a quadratic form in p that touches it at q;
//! its minimum is the Guttman transform
//!
//! ```text
//! V_ff p_f = (B(q) q)_f - V_fh p_h        f free, h held
//! ```
//!
//! For unit weights V = n I - 1 1^T, and the inverse of its free block is (I + 1 1^T / #held) / n: nothing
//! to factor. With no position held, V's own null space is left out: the centre stays at the origin.
//!
//! The transform never raises the stress, and its fixed points are the stress's stationary points. Steps
//! between them are extrapolated from the last few (Anderson 1965); an extrapolation that raises
//! the stress is dropped and the transform taken, so that the stress never rises and fixed points stay.

mod anderson;
mod guttman;
mod one;

use std::fmt;

use faer::Mat;
use pulp::Arch;

use self::anderson::Anderson;
use self::guttman::Guttman;
use super::b_spline::Point;
use super::symmetric;
use crate::task::{Cancelled, Task};

pub use one::place_one;

/// All distances between n things: the upper half of a symmetric matrix with zero diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Distances {
    count: usize,
    /// Row after row, j > i.
    values: Vec<f64>,
}

impl Distances {
    /// Euclidean distances of points given one after another, `dimension` numbers each. For dimension 0
    /// there are no points to tell apart: give their number by [`Distances::from_fn`].
    pub fn between(points: &[f64], dimension: usize) -> Self {
        let count = points.len().checked_div(dimension).unwrap_or(0);
        let axes: Vec<Vec<f64>> = (0..dimension)
            .map(|axis| {
                points
                    .iter()
                    .skip(axis)
                    .step_by(dimension)
                    .copied()
                    .collect()
            })
            .collect();
        let mut values = vec![0.0; count * count.saturating_sub(1) / 2];
        Arch::new().dispatch(
            #[inline(always)]
            || {
                let mut rest = &mut values[..];
                for i in 0..count {
                    let (row, after) = rest.split_at_mut(count - 1 - i);
                    rest = after;
                    for axis in &axes {
                        let at = axis[i];
                        let others = row.iter_mut().zip(&axis[i + 1..]);
                        others.for_each(|(sum, other)| *sum += (at - other) * (at - other));
                    }
                    row.iter_mut().for_each(|square| *square = square.sqrt());
                }
            },
        );
        Distances { count, values }
    }

    /// Whatever `distance(i, j)` says for i < j.
    pub fn from_fn(count: usize, mut distance: impl FnMut(usize, usize) -> f64) -> Self {
        let pairs = (0..count).flat_map(|i| (i + 1..count).map(move |j| (i, j)));
        let values = pairs.map(|(i, j)| distance(i, j)).collect();
        Distances { count, values }
    }

    /// n.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The distance between i and j.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        match i.cmp(&j) {
            std::cmp::Ordering::Less => self.values[row_start(self.count, i) + j - i - 1],
            std::cmp::Ordering::Equal => 0.0,
            std::cmp::Ordering::Greater => self.get(j, i),
        }
    }

    /// The upper half row after row, j > i.
    pub fn values(&self) -> &[f64] {
        &self.values
    }
}

/// Where row i of an upper half starts.
fn row_start(count: usize, i: usize) -> usize {
    i * (2 * count - i - 1) / 2
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Twice in a row the stress falls by less than this part of itself.
    pub change: f64,
    /// So many transforms.
    pub steps: usize,
}

impl Default for Stop {
    fn default() -> Self {
        Stop {
            change: 1e-9,
            steps: 2000,
        }
    }
}

/// Positions, and how well they do.
#[derive(Debug, Clone, PartialEq)]
pub struct Layout {
    /// One for each thing.
    pub positions: Vec<Point>,
    /// sum w_ij (|p_i - p_j| - delta_ij)^2 over i < j.
    pub stress: f64,
    /// The root of the stress over that of all positions in one point: 0 for perfect distances, 1 at
    /// worst for a stationary layout; 0 where all distances are 0.
    pub relative_stress: f64,
    /// How many Guttman transforms were computed.
    pub steps: usize,
    /// Whether the stress stood still, rather than the steps run out.
    pub converged: bool,
}

/// Why there is no layout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LayoutError {
    /// The task was cancelled.
    Cancelled,
    /// The weights leave part of the positions undetermined.
    Loose,
}

impl fmt::Display for LayoutError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LayoutError::Cancelled => "interrupted",
            LayoutError::Loose => "the weights do not tie all positions together",
        })
    }
}

impl std::error::Error for LayoutError {}

impl From<Cancelled> for LayoutError {
    fn from(_: Cancelled) -> Self {
        LayoutError::Cancelled
    }
}

/// The layout reached from `start` with the frames of `pins` held exactly. No pin: along its principal
/// axes about the origin, the largest coordinate on each axis positive. One pin: that, translated. Two
/// or more: as it lies; `start` is first turned (with three or more also mirrored, where that fits
/// better) towards the pins.
///
/// # Errors
/// [`LayoutError::Cancelled`].
///
/// # Panics
/// A pin's index or the length of `start` does not fit the distances.
pub fn solve(
    distances: &Distances,
    start: &[Point],
    pins: &[(usize, Point)],
    stop: &Stop,
    task: &Task,
) -> Result<Layout, LayoutError> {
    if let [] | [_] = pins {
        let mut layout = majorise(distances, None, start, &[], stop, task)?;
        to_principal_axes(&mut layout.positions);
        for &(frame, [x, y]) in pins {
            let [from_x, from_y] = layout.positions[frame];
            for position in &mut layout.positions {
                *position = [position[0] - from_x + x, position[1] - from_y + y];
            }
        }
        return Ok(layout);
    }
    majorise(distances, None, &turned_to(pins, start), pins, stop, task)
}

/// The layout reached from `start` with weights (those of the upper half, as [`Distances::values`]; none:
/// all 1) and held positions, in the gauge it is reached in.
///
/// # Errors
/// [`LayoutError::Loose`] for weights that fall into parts, [`LayoutError::Cancelled`].
///
/// # Panics
/// A pin's index or a length does not fit the distances.
pub fn majorise(
    distances: &Distances,
    weights: Option<&[f64]>,
    start: &[Point],
    pins: &[(usize, Point)],
    stop: &Stop,
    task: &Task,
) -> Result<Layout, LayoutError> {
    assert_eq!(start.len(), distances.count, "a start for each position");
    let mut transform = Guttman::new(distances, weights, pins)?;
    let mut now = transform.begin(start);
    let mut history = Anderson::new(2 * start.len());
    let (mut steps, mut still) = (1, 0);
    while still < 2 && steps < stop.steps {
        task.check()?;
        let mut next = transform.at(history.extrapolate(&now.at, &now.to));
        steps += 1;
        if history.is_used() && next.stress > now.stress {
            history.forget();
            next = transform.at(now.to.clone());
            steps += 1;
        }
        if next.stress >= now.stress {
            still = 2;
            break;
        }
        still = if now.stress - next.stress < stop.change * now.stress {
            still + 1
        } else {
            0
        };
        now = next;
    }
    let whole = transform.whole();
    Ok(Layout {
        positions: now.positions(),
        stress: now.stress,
        relative_stress: if whole > 0.0 {
            (now.stress / whole).sqrt()
        } else {
            0.0
        },
        steps,
        converged: still == 2,
    })
}

/// V^-1 of the free block, or of V + 1 1^T / n where all are free; nothing where it is singular.
fn free_inverse(distances: &Distances, weights: &[f64], free: &[usize]) -> Option<Mat<f64>> {
    let n = distances.count;
    let weight = |i: usize, j: usize| {
        let (i, j) = (i.min(j), i.max(j));
        weights[row_start(n, i) + j - i - 1]
    };
    let shift = if free.len() == n { 1.0 / n as f64 } else { 0.0 };
    let matrix = Mat::from_fn(free.len(), free.len(), |a, b| {
        let (i, j) = (free[a], free[b]);
        if i == j {
            shift
                + (0..n)
                    .filter(|&other| other != i)
                    .map(|other| weight(i, other))
                    .sum::<f64>()
        } else {
            shift - weight(i, j)
        }
    });
    symmetric::inverse(matrix)
}

/// Moves the centre to the origin and the direction of largest spread to the first axis, and mirrors so
/// that the largest coordinate on each axis is positive.
pub fn to_principal_axes(positions: &mut [Point]) {
    let centre = centre(positions.iter());
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for position in positions.iter_mut() {
        *position = [position[0] - centre[0], position[1] - centre[1]];
        let [x, y] = *position;
        (xx, xy, yy) = (xx + x * x, xy + x * y, yy + y * y);
    }
    let (sin, cos) = libm::sincos(0.5 * libm::atan2(2.0 * xy, xx - yy));
    for position in positions.iter_mut() {
        let [x, y] = *position;
        *position = [cos * x + sin * y, cos * y - sin * x];
    }
    for axis in 0..2 {
        let all = positions.iter().map(|position| position[axis]);
        if all.fold(
            0.0_f64,
            |best, x| if x.abs() > best.abs() { x } else { best },
        ) < 0.0
        {
            positions
                .iter_mut()
                .for_each(|position| position[axis] = -position[axis]);
        }
    }
}

fn centre<'a>(points: impl ExactSizeIterator<Item = &'a Point>) -> Point {
    let count = points.len().max(1) as f64;
    let sum = points.fold([0.0, 0.0], |sum, point| {
        [sum[0] + point[0], sum[1] + point[1]]
    });
    [sum[0] / count, sum[1] / count]
}

/// `start` moved rigidly so that its pinned positions lie nearest to the pins.
pub fn turned_to(pins: &[(usize, Point)], start: &[Point]) -> Vec<Point> {
    let from: Vec<Point> = pins.iter().map(|&(frame, _)| start[frame]).collect();
    let to: Vec<Point> = pins.iter().map(|&(_, pin)| pin).collect();
    let (a, b) = (centre(from.iter()), centre(to.iter()));
    // sums of conj(from) to and of from to, as complex numbers: the rotation and the mirrored one
    let (mut plain, mut mirrored) = ([0.0, 0.0], [0.0, 0.0]);
    for (p, q) in from.iter().zip(&to) {
        let ([x, y], [u, v]) = ([p[0] - a[0], p[1] - a[1]], [q[0] - b[0], q[1] - b[1]]);
        plain = [plain[0] + x * u + y * v, plain[1] + x * v - y * u];
        mirrored = [mirrored[0] + x * u - y * v, mirrored[1] + x * v + y * u];
    }
    let length = |[x, y]: Point| (x * x + y * y).sqrt();
    let mirror = pins.len() > 2 && length(mirrored) > length(plain) * (1.0 + 1e-9);
    let turn = if mirror { mirrored } else { plain };
    let size = length(turn);
    let [cos, sin] = if size > 0.0 {
        [turn[0] / size, turn[1] / size]
    } else {
        [1.0, 0.0]
    };
    let moved = |p: &Point| {
        let (x, y) = (p[0] - a[0], if mirror { a[1] - p[1] } else { p[1] - a[1] });
        [b[0] + cos * x - sin * y, b[1] + sin * x + cos * y]
    };
    start.iter().map(moved).collect()
}

#[cfg(test)]
mod tests;
