//! The ordered method: frames laid out by the distances along the motion, g and f fitted to what happens
//! between them too ([`crate::math::ordered`]). The same signals as CH12's, with uniform knots, rho the
//! identity, and sites that are free points; the frames lie where f passes them.

pub mod advice;
pub mod drag;
pub mod tolerance;

use faer::{Mat, MatRef};

use super::ch12::{self, Signals};
use super::pins::{self, Pin};
use super::report::Ordered;
use super::subspace::Subspace;
use crate::diag::Result;
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::layout::Layout;
use crate::math::ordered::{self, Choice, Fit, Motion, Options};
use crate::math::thin_plate::ThinPlate;
use crate::math::variable_projection::Plate;
use crate::signal::pose::PoseSignal;
use crate::signal::time::TimeSignal;
use crate::task::Task;

/// Below this ratio of sites to modes no layout can carry all modes: the measured rule l >= 2m.
pub const SITES_PER_MODE: usize = 2;

/// Frames in the shape subspace, laid out, to be fitted with any k and l.
pub enum Laid<'a> {
    /// By the ordered method.
    Motion {
        /// The frames.
        subspace: &'a Subspace,
        /// Their layouts.
        motion: Box<Motion>,
    },
    /// Two modes or fewer: pose space is the shape subspace itself, g the identity, and nothing between
    /// frames can go wrong.
    Flat(&'a Subspace),
    /// One or two frames, or nothing that moves: CH12's point and segment.
    Still(&'a Subspace),
}

impl<'a> Laid<'a> {
    /// Lays out the frames of a subspace; `near`, where given, is the (tau, theta) of an earlier fit, kept
    /// unless the motion has a spike with it now.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn out(subspace: &'a Subspace, near: Option<(f64, f64)>, task: &Task) -> Result<Self> {
        task.phase("layout", 0);
        if subspace.frames < 3 || subspace.x.iter().all(|&x| x == 0.0) {
            return Ok(Laid::Still(subspace));
        }
        if subspace.modes <= 2 {
            return Ok(Laid::Flat(subspace));
        }
        let floor = subspace.relative(subspace.residual);
        let frames = matrix(subspace);
        let motion = Box::new(match near {
            Some((tau, theta)) => {
                Motion::near(frames.as_ref(), floor, Choice { tau, theta }, task)?
            }
            None => Motion::new(frames.as_ref(), floor, task)?,
        });
        Ok(Laid::Motion { subspace, motion })
    }

    /// Fits with `controls` k and `sites` l, clamped to what there is, and `pins` where they are put.
    ///
    /// # Errors
    /// The task was cancelled.
    pub fn signals(
        &self,
        controls: usize,
        sites: usize,
        pins: &[Pin],
        task: &Task,
    ) -> Result<Signals> {
        let subspace = match self {
            Laid::Still(subspace) => {
                let pins = pins::placed(pins, subspace, task)?;
                return ch12::signals(subspace, (controls, sites), (1.0, &pins), task);
            }
            Laid::Motion { subspace, .. } | Laid::Flat(subspace) => subspace,
        };
        let bent = matches!(self, Laid::Motion { .. }) && sites > 3;
        if !bent && pins.len() > 1 {
            // A plane can only be moved as a whole: pins need a surface.
            let pins = pins::placed(pins, subspace, task)?;
            return ch12::signals(subspace, (controls, sites), (0.5, &pins), task);
        }
        let controls = controls.clamp(4, subspace.frames + 2);
        let sites = sites.min(subspace.frames);
        match self {
            Laid::Motion { motion, .. } if bent => {
                task.phase("pose", 0);
                let unpinned = positions(motion.layout().as_ref(), motion.radius());
                let placed = pins::within(pins, &unpinned);
                let radius = motion.radius();
                let pins = placed
                    .iter()
                    .map(|&(frame, at)| (frame, at.map(|x| x / radius)));
                let options = Options {
                    controls,
                    sites,
                    pins: pins.collect(),
                };
                let fit = motion.fit(&options, task)?;
                signals(subspace, &fit)
            }
            _ => flat(subspace, controls, pins),
        }
    }
}

/// The frames' coordinates, n x m.
pub(super) fn matrix(subspace: &Subspace) -> Mat<f64> {
    MatRef::from_row_major_slice(&subspace.x, subspace.frames, subspace.modes).to_owned()
}

fn positions(layout: MatRef<'_, f64>, scale: f64) -> Vec<Point> {
    (0..layout.nrows())
        .map(|i| [scale * layout[(i, 0)], scale * layout[(i, 1)]])
        .collect()
}

/// A fit as signals, in units of the shape space.
pub(super) fn signals(subspace: &Subspace, fit: &Fit) -> Result<Signals> {
    let controls = positions(fit.controls.as_ref(), fit.radius);
    let ordered = Ordered {
        tau: fit.choice.tau,
        theta: fit.choice.theta,
        radius: fit.radius,
        at_samples: fit.quality.at_samples,
        between: fit.quality.between,
        worst: fit.quality.worst,
        evaluations: fit.evaluations,
        converged: fit.converged,
    };
    assembled(subspace, controls, &fit.plate, fit.radius, Some(ordered))
}

/// g = the identity of the two leading coordinates. A pin can only move the whole plane.
fn flat(subspace: &Subspace, controls: usize, pins: &[Pin]) -> Result<Signals> {
    let frames = matrix(subspace);
    let floor = subspace.relative(subspace.residual);
    let mut fit = ordered::flat(frames.as_ref(), floor, controls);
    let unpinned = positions(fit.layout.as_ref(), 1.0);
    if let [(frame, to)] = pins::within(pins, &unpinned)[..] {
        let from = unpinned[frame];
        fit.shift([to[0] - from[0], to[1] - from[1]]);
    }
    signals(subspace, &fit)
}

/// Signals of control points in units of the shape space and a plate over the plane in `unit`s.
fn assembled(
    subspace: &Subspace,
    controls: Vec<Point>,
    plate: &Plate,
    unit: f64,
    ordered: Option<Ordered>,
) -> Result<Signals> {
    let rows = |matrix: MatRef<'_, f64>| -> Vec<f64> {
        let width = matrix.ncols();
        (0..matrix.nrows() * width)
            .map(|at| matrix[(at / width, at % width)])
            .collect()
    };
    let sites = positions(plate.sites.as_ref(), unit);
    let (weights, affine) = (rows(plate.weights.as_ref()), rows(plate.affine.as_ref()));
    let plate = ThinPlate::new(([0.0; 2], unit), sites, weights, affine).map_err(ch12::unfit)?;
    let time = time(subspace.frames, controls)?;
    let positions = ch12::passed(&time);
    Ok(Signals {
        layout: stress(subspace, positions, ordered.as_ref()),
        pose: PoseSignal::new(plate, Vec::new()).map_err(ch12::unfit)?,
        time,
        distinct: subspace.frames,
        merged: 0.0,
        ordered,
    })
}

/// f of uniform knots, one frame a unit of its parameter, rho the identity.
fn time(frames: usize, controls: Vec<Point>) -> Result<TimeSignal> {
    let spans = controls.len() - 3;
    let step = (frames - 1) as f64 / spans as f64;
    let mut intervals = vec![step; spans + 4];
    for end in [0, 1, spans + 2, spans + 3] {
        intervals[end] = 0.0;
    }
    let place = |frame: usize| {
        let span = ((frame as f64 / step) as usize).min(spans - 1);
        let offset = (frame as f64 - span as f64 * step).clamp(0.0, step);
        Place { span, offset }
    };
    let places = (0..frames).map(place).collect();
    let curve = Curve::new(intervals, controls).map_err(ch12::unfit)?;
    TimeSignal::new(curve, places, vec![1.0; frames], Vec::new()).map_err(ch12::unfit)
}

/// The stress of positions against the frames' own distances, as CH12's layouts report it.
fn stress(subspace: &Subspace, positions: Vec<Point>, ordered: Option<&Ordered>) -> Layout {
    let distances = subspace.distances();
    let (mut stress, mut whole) = (0.0, 0.0);
    for j in 0..positions.len() {
        for i in 0..j {
            let (p, q, wanted) = (positions[i], positions[j], distances.get(i, j));
            let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
            let miss = (dx * dx + dy * dy).sqrt() - wanted;
            stress += miss * miss;
            whole += wanted * wanted;
        }
    }
    Layout {
        positions,
        stress,
        relative_stress: if whole > 0.0 {
            (stress / whole).sqrt()
        } else {
            0.0
        },
        steps: ordered.map_or(0, |ordered| ordered.evaluations),
        converged: true,
    }
}
