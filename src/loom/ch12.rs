//! CH12's own method: frames laid out by their distances, g fitted at the frames, f through them.

use rayon::prelude::*;

use super::report::Ordered;
use super::subspace::Subspace;
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::layout::{self, Distances, Layout, LayoutError, Stop};
use crate::math::thin_plate::{Rows, ThinPlate};
use crate::signal::pose::{PoseFit, PoseSignal};
use crate::signal::time::TimeSignal;
use crate::signal::{control_bounds, time};
use crate::task::{Cancelled, Task};

/// What a method finds for frames in the shape subspace.
#[derive(Debug, Clone, PartialEq)]
pub struct Signals {
    /// Where the frames lie in pose space (the time signal passes near), and the stress of that.
    pub layout: Layout,
    /// g.
    pub pose: PoseSignal,
    /// f.
    pub time: TimeSignal,
    /// How many positions differ by more than 1e-4 of the layout's diameter.
    pub distinct: usize,
    /// Largest distance of a frame from the mean of those merged with it, in the shape subspace.
    pub merged: f64,
    /// What the ordered method says of its fit.
    pub ordered: Option<Ordered>,
}

/// Lays the frames out, from their leading coordinates, with the `pins` (frames from 0) held.
///
/// # Errors
/// The task was cancelled.
pub fn place(subspace: &Subspace, pins: &[(usize, Point)], task: &Task) -> Result<Layout> {
    let distances = subspace.distances();
    place_from(&distances, &subspace.leading(), pins, task)
}

/// The same from given distances and positions.
///
/// # Errors
/// The task was cancelled.
pub fn place_from(
    distances: &Distances,
    start: &[Point],
    pins: &[(usize, Point)],
    task: &Task,
) -> Result<Layout> {
    layout::solve(distances, start, pins, &Stop::default(), task).map_err(|error| match error {
        LayoutError::Cancelled => Cancelled.into(),
        LayoutError::Loose => Box::new(Diagnostic::error(error.to_string())),
    })
}

/// Distinct consecutive positions, the n of the bounds 4 <= k <= n+2 and 3 <= l <= n.
pub fn distinct(positions: &[Point]) -> usize {
    match control_bounds(positions).1 {
        1 => 1,
        most => most - 2,
    }
}

/// The frames at their positions as rows to fit g to.
pub fn rows<'a>(subspace: &'a Subspace, positions: &'a [Point]) -> Rows<'a> {
    Rows {
        positions,
        targets: &subspace.x,
        width: subspace.modes,
        weights: None,
    }
}

/// g with up to `sites` sites in the greedy order; the only pose there is where none moves.
///
/// # Errors
/// A position is not finite: distances too large to be squared.
pub fn pose(subspace: &Subspace, positions: &[Point], sites: usize) -> Result<PoseFit> {
    if subspace.modes == 0 {
        let signal = PoseSignal::new(ThinPlate::constant(&[]), Vec::new());
        return Ok(PoseFit {
            signal: signal.map_err(unfit)?,
            distinct: 1,
            spread: 0.0,
            errors: vec![0.0],
        });
    }
    PoseSignal::fit(&rows(subspace, positions), sites).map_err(unfit)
}

/// f with `controls` control points.
///
/// # Errors
/// Out of bounds: 4 <= k <= n+2, n the number of distinct consecutive positions.
pub fn time(positions: &[Point], controls: usize, alpha: f64) -> Result<TimeSignal> {
    TimeSignal::fit(positions, controls, alpha).map_err(|error| match error {
        time::TimeError::Controls { given, least, most } => Box::new(
            Diagnostic::error(format!("{given} control points are out of bounds"))
                .hint(format!("this capture allows {least} to {most}")),
        ),
        time::TimeError::Exponent => Box::new(Diagnostic::error(format!(
            "alpha is {alpha}, outside 0 to 1"
        ))),
        other => unfit(other),
    })
}

/// f with as many of `controls` control points as the positions allow.
///
/// # Errors
/// A position is not finite.
pub fn time_within(positions: &[Point], controls: usize, alpha: f64) -> Result<TimeSignal> {
    let (least, most) = control_bounds(positions);
    time(positions, controls.clamp(least, most), alpha)
}

/// All of it with given k and l, clamped to what the positions allow, the `pins` held (frames from 0).
///
/// # Errors
/// The task was cancelled; numbers too large to be squared.
pub fn signals(
    subspace: &Subspace,
    (controls, sites): (usize, usize),
    (alpha, pins): (f64, &[(usize, Point)]),
    task: &Task,
) -> Result<Signals> {
    let layout = place(subspace, pins, task)?;
    let pose = pose(subspace, &layout.positions, sites.max(3))?;
    let time = time_within(&layout.positions, controls, alpha)?;
    Ok(Signals {
        layout,
        distinct: pose.distinct,
        merged: pose.spread,
        ordered: None,
        pose: pose.signal,
        time,
    })
}

/// sum ||x_i - g(p_i)||^2 over frames and positions, or something larger than `limit` once it is.
pub fn misfit(subspace: &Subspace, pose: &PoseSignal, positions: &[Point], limit: f64) -> f64 {
    let mut value = vec![0.0; subspace.modes];
    let mut sum = 0.0;
    for (frame, &position) in positions.iter().enumerate() {
        pose.evaluate(position, &mut value);
        let row = subspace.row(frame).iter().zip(&value);
        sum += row.map(|(x, g)| (x - g) * (x - g)).sum::<f64>();
        if sum > limit {
            break;
        }
    }
    sum
}

/// f(1) .. f(n).
pub fn passed(time: &TimeSignal) -> Vec<Point> {
    let at = |frame: usize| time.at(frame as f64).unwrap_or_default();
    (1..=time.frames()).map(at).collect()
}

/// Several problems at once, in order; each is its own.
pub fn each<T: Sync, U: Send>(
    all: &[T],
    solve: impl Fn(&T) -> Result<U> + Send + Sync,
) -> Result<Vec<U>> {
    all.par_iter().map(solve).collect()
}

/// Numbers that no fit is possible for, whatever the reason given below.
pub fn unfit(error: impl std::fmt::Debug) -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error(format!("the signals cannot be fitted: {error:?}"))
            .hint("coordinates above 1e150 overflow when they are squared"),
    )
}
