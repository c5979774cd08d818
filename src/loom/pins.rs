//! Frames that are held where someone put them (CH12 §3.2.1).

use super::ch12;
use super::subspace::Subspace;
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::task::Task;

/// A frame held at a place in pose space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pin {
    /// The frame, from 1.
    pub frame: usize,
    /// Where.
    pub at: PinPlace,
}

impl Pin {
    /// A frame (from 0) at a place in the layout's own units.
    pub fn at(frame: usize, place: Point) -> Self {
        Pin {
            frame: frame + 1,
            at: PinPlace::Layout(place),
        }
    }
}

/// Where a pin holds its frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PinPlace {
    /// In the layout's own units, those of the shape space.
    Layout(Point),
    /// In parts of the box of the layout without pins: (0, 0) its lower left, (1, 1) its upper right.
    Box(Point),
}

/// Pins name frames that exist, each once, at finite places.
///
/// # Errors
/// The first pin that does not.
pub fn check(pins: &[Pin], frames: usize) -> Result<()> {
    for (index, pin) in pins.iter().enumerate() {
        let frame = pin.frame;
        if !(1..=frames).contains(&frame) {
            return Diagnostic::error(format!("there is no frame {frame} to pin"))
                .hint(format!("frames count from 1 to {frames}"))
                .err();
        }
        if pins[..index].iter().any(|other| other.frame == frame) {
            return Diagnostic::error(format!("frame {frame} is pinned twice"))
                .hint("leave one of its pins out")
                .err();
        }
        let (PinPlace::Layout(place) | PinPlace::Box(place)) = pin.at;
        if !place.iter().all(|x| x.is_finite()) {
            return Diagnostic::error(format!("the pin of frame {frame} is not finite")).err();
        }
    }
    Ok(())
}

/// Pins as frames from 0 and points of the layout of `subspace`.
///
/// # Errors
/// The task was cancelled.
pub fn placed(pins: &[Pin], subspace: &Subspace, task: &Task) -> Result<Vec<(usize, Point)>> {
    let relative = pins.iter().any(|pin| matches!(pin.at, PinPlace::Box(_)));
    let unpinned = if relative {
        ch12::place(subspace, &[], task)?.positions
    } else {
        Vec::new()
    };
    Ok(within(pins, &unpinned))
}

/// Pins as frames from 0 and points of a layout that lies at `unpinned` without them.
pub fn within(pins: &[Pin], unpinned: &[Point]) -> Vec<(usize, Point)> {
    let (low, size) = bounds(unpinned);
    let place = |pin: &Pin| match pin.at {
        PinPlace::Layout(point) => (pin.frame - 1, point),
        PinPlace::Box(part) => (
            pin.frame - 1,
            [0, 1].map(|axis| low[axis] + part[axis] * size[axis]),
        ),
    };
    pins.iter().map(place).collect()
}

/// Lower left corner and size of the box around points.
fn bounds(points: &[Point]) -> (Point, Point) {
    let least = |axis: usize| points.iter().map(|p| p[axis]).fold(f64::INFINITY, f64::min);
    let most = |axis: usize| {
        points
            .iter()
            .map(|p| p[axis])
            .fold(f64::NEG_INFINITY, f64::max)
    };
    let low = [least(0), least(1)];
    (low, [most(0) - low[0], most(1) - low[1]])
}
