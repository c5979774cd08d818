//! A pin in motion: the curve keeps the shape that it has as far as its pins allow, curve and sites
//! follow in a few steps from where they were.

use faer::{Mat, MatRef};

use super::Quality;
use super::layout::held;
use super::refine::{Draft, QUICK};
use super::samples::{Curve, Samples, rows};
use crate::math::b_spline::Point;
use crate::math::layout::{Distances, Stop};
use crate::math::variable_projection::Plate;
use crate::task::{Cancelled, Task};

/// The layout is followed for so long at each place of the pin.
const FOLLOW: Stop = Stop {
    change: 1e-3,
    steps: 12,
};

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
    /// Between the frames' places on the curve when the drag began.
    distances: Distances,
    floor: f64,
}

impl Drag {
    /// For `frames` (n x m), of which the m coordinates leave out `floor`, and a fit of k control points
    /// (k x 2) to them.
    pub fn new(frames: MatRef<'_, f64>, floor: f64, controls: MatRef<'_, f64>) -> Self {
        let samples = Samples::new(frames);
        let curve = samples.curve(controls.nrows());
        let places = samples.frames_on(&curve, controls);
        Drag {
            distances: Distances::between(&rows(places.as_ref()), 2),
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
        let after = held(&self.distances, before.as_ref(), pins, &FOLLOW, task)?;
        let moved = samples.dense_of(&(&after - &before));
        let controls = curve.through_pins(controls + curve.fitted.fit(moved.as_ref()), pins);
        let sites = carried(&plate.sites, &before, &after);
        let draft = Draft::at(samples, curve, controls, &sites)
            .refined(samples, curve, pins, QUICK, task)?;
        Ok(Moving {
            quality: draft.quality(samples, curve, self.floor),
            controls: draft.controls,
            plate: draft.plate,
        })
    }
}

/// Sites moved by what the points near them moved (weights 1/distance^2).
fn carried(sites: &Mat<f64>, from: &Mat<f64>, to: &Mat<f64>) -> Mat<f64> {
    let mut carried = sites.clone();
    for j in 0..sites.nrows() {
        let (mut total, mut shift) = (0.0, [0.0; 2]);
        for i in 0..from.nrows() {
            let (dx, dy) = (from[(i, 0)] - sites[(j, 0)], from[(i, 1)] - sites[(j, 1)]);
            let weight = 1.0 / (dx * dx + dy * dy + 1e-6);
            total += weight;
            for a in 0..2 {
                shift[a] += weight * (to[(i, a)] - from[(i, a)]);
            }
        }
        for a in 0..2 {
            carried[(j, a)] += shift[a] / total;
        }
    }
    carried
}
