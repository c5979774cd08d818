//! A pin in motion: the curve keeps the shape that it has as far as its pins allow, curve and sites
//! follow in a few steps from where they were.

use faer::{Mat, MatRef};

use super::Quality;
use super::layout::held;
use super::refine::{Draft, QUICK};
use super::samples::{Curve, Samples, rows};
use crate::math::b_spline::Point;
use crate::math::cubic_spline::{CubicSpline, Ends};
use crate::math::layout::{Distances, Stop};
use crate::math::variable_projection::Plate;
use crate::task::{Cancelled, Task};

/// The layout is followed for so long at each place of the pin.
const FOLLOW: Stop = Stop {
    change: 1e-3,
    steps: 12,
};

/// So many frames at most are laid out, evenly spread; the others follow them.
const LAID_OUT: usize = 150;

/// Motions of more frames keep the curve that the layout gives: a step of the refinement would last longer
/// than a picture.
const REFINED: usize = 400;

/// Curve and plate as they are while pins move, in radii of the layout.
#[derive(Debug, Clone)]
pub struct Moving {
    /// C, k x 2.
    pub controls: Mat<f64>,
    /// g.
    pub plate: Plate,
    /// How good they are.
    pub quality: Quality,
}

/// What does not change while pins move: tau, theta and the distances along the curve stay.
#[derive(Debug, Clone)]
pub struct Drag {
    samples: Samples,
    curve: Curve,
    /// The frames on the curve when the drag began, n x 2.
    places: Mat<f64>,
    floor: f64,
}

impl Drag {
    /// For `frames` (n x m), of which the m coordinates leave out `floor`, and a fit of k control points
    /// (k x 2) to them. What lies between frames is looked at half as often as by the fit.
    pub fn new(frames: MatRef<'_, f64>, floor: f64, controls: MatRef<'_, f64>) -> Self {
        let samples = Samples::coarse(frames);
        let curve = samples.curve(controls.nrows());
        Drag {
            places: samples.frames_on(&curve, controls),
            samples,
            curve,
            floor,
        }
    }

    /// A few steps from `last` with the frames of `pins` (from 0) where they are to be.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn to(
        &self,
        last: (MatRef<'_, f64>, &Plate),
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Moving, Cancelled> {
        let (samples, curve) = (&self.samples, &self.curve);
        let (controls, plate) = last;
        let before = samples.frames_on(curve, controls);
        let shift = self.shift(&before, pins, task)?;
        let moved = samples.dense_of(&shift);
        let controls = curve.through_pins(controls + curve.fitted.fit(moved.as_ref()), pins);
        let sites = carried(&plate.sites, &before, &shift);
        let draft = match samples.frames <= REFINED {
            true => {
                let plate = Plate {
                    sites,
                    ..plate.clone()
                };
                Draft::of(samples, controls, plate).refined(samples, curve, pins, QUICK, task)?
            }
            false => Draft::at(samples, curve, controls, &sites),
        };
        Ok(Moving {
            quality: draft.quality(samples, curve, self.floor),
            controls: draft.controls,
            plate: draft.plate,
        })
    }

    /// By how much each frame moves from `before` as the layout follows the pins, n x 2.
    fn shift(
        &self,
        before: &Mat<f64>,
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Mat<f64>, Cancelled> {
        let kept = self.laid_out(pins);
        let part = |of: &Mat<f64>| Mat::from_fn(kept.len(), 2, |i, a| of[(kept[i], a)]);
        let distances = Distances::between(&rows(part(&self.places).as_ref()), 2);
        let place = |frame: usize| kept.partition_point(|&other| other < frame);
        let held_at: Vec<(usize, Point)> =
            pins.iter().map(|&(frame, at)| (place(frame), at)).collect();
        let from = part(before);
        let to = held(&distances, from.as_ref(), &held_at, &FOLLOW, task)?;
        Ok(between(&kept, &(to - from), before.nrows()))
    }

    /// The frames that are laid out: every so many, the last one and those of the pins.
    fn laid_out(&self, pins: &[(usize, Point)]) -> Vec<usize> {
        let count = self.samples.frames;
        let every = (0..count).step_by(count.div_ceil(LAID_OUT));
        let pinned = pins.iter().map(|&(frame, _)| frame);
        let mut kept: Vec<usize> = every.chain([count - 1]).chain(pinned).collect();
        kept.sort_unstable();
        kept.dedup();
        kept
    }
}

/// Numbers at all of `count` frames from those at some, by a cubic spline through them.
fn between(kept: &[usize], known: &Mat<f64>, count: usize) -> Mat<f64> {
    let mut all = Mat::zeros(count, 2);
    let knots: Vec<f64> = kept.iter().map(|&frame| frame as f64).collect();
    let Ok(spline) = CubicSpline::new(&knots, &rows(known.as_ref()), 2, Ends::NotAKnot) else {
        return all;
    };
    let mut value = [0.0; 2];
    for frame in 0..count {
        spline.evaluate(frame as f64, &mut value);
        for a in 0..2 {
            all[(frame, a)] = value[a];
        }
    }
    all
}

/// Sites moved by what the points near them moved (weights 1/distance^2).
fn carried(sites: &Mat<f64>, from: &Mat<f64>, by: &Mat<f64>) -> Mat<f64> {
    let mut carried = sites.clone();
    for j in 0..sites.nrows() {
        let (mut total, mut shift) = (0.0, [0.0; 2]);
        for i in 0..from.nrows() {
            let (dx, dy) = (from[(i, 0)] - sites[(j, 0)], from[(i, 1)] - sites[(j, 1)]);
            let weight = 1.0 / (dx * dx + dy * dy + 1e-6);
            total += weight;
            for a in 0..2 {
                shift[a] += weight * by[(i, a)];
            }
        }
        for a in 0..2 {
            carried[(j, a)] += shift[a] / total;
        }
    }
    carried
}
