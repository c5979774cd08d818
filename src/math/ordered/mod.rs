//! Curves and plates for ordered data: a layout that respects the order, refined until the motion is
//! right between its frames too.
//!
//! Input are n points x_i of R^m in their order; what lies between them is taken from the cubic
//! spline S through them. Found are control points C of a uniform clamped cubic B-spline f over
//! \[0, n-1\] and a thin-plate spline g from the plane to R^m with free sites, so that g(f(t)) is near
//! S(t) for *all* t, not for the frames alone:
//!
//! - [`layout`]: the frames are laid out by distances along the motion (geodesics of the order graph),
//!   then walked towards plain distances as long as no saddle between the frames results;
//! - [`refine`](super::variable_projection::refine): curve and sites together, by variable projection;
//! - [`check`]: a spike between the samples sends the fit back to the next layout in reserve.

mod check;
mod layout;
mod samples;

use faer::{Mat, MatRef};

use self::layout::{Candidate, Layouts};
use self::samples::Samples;
use super::uniform_spline::UniformFitter;
use super::variable_projection::{self, Options as Steps, Plate, Problem};
use crate::task::{Cancelled, Task};

pub use check::Quality;
pub use layout::Choice;

/// Fidelity of an ordered fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// k, at least 4.
    pub controls: usize,
    /// l, at least 3.
    pub sites: usize,
    /// What m leaves out: the residual of the subspace over the whole spread, >= 0.
    pub floor: f64,
}

/// The fit: f, g and how they were found. The layout is centred with a root mean square radius of 1.
#[derive(Debug, Clone)]
pub struct Fit {
    /// C, k x 2.
    pub controls: Mat<f64>,
    /// g.
    pub plate: Plate,
    /// The layout that was refined, n x 2.
    pub layout: Mat<f64>,
    /// Which layout it was.
    pub choice: Choice,
    /// How good it is at the samples and between them.
    pub quality: Quality,
    /// How many layouts were refined.
    pub tried: usize,
    /// Residual evaluations of the refinement kept.
    pub evaluations: usize,
    /// Whether that refinement had settled.
    pub converged: bool,
}

/// How far a curve may stray from its layout before it costs as much as 5 % of the first residual,
/// in radii of the layout.
const STRAY: f64 = 0.1;

/// Fits `frames` (n x m, n >= 2, not all equal).
///
/// # Errors
/// The task was cancelled.
pub fn fit(frames: MatRef<'_, f64>, options: &Options, task: &Task) -> Result<Fit, Cancelled> {
    let samples = Samples::new(frames);
    let layouts = Layouts::find(frames, &samples, options.floor, task)?;
    let curve = samples.curve(options.controls);
    let mut best: Option<Fit> = None;
    let candidates = layouts.candidates();
    for (tried, candidate) in candidates.iter().enumerate() {
        let mut fit = refine(&samples, &curve, candidate, options, task)?;
        fit.tried = tried + 1;
        let better = match &best {
            None => true,
            Some(best) => fit.quality.good || fit.quality.between < 0.7 * best.quality.between,
        };
        if better {
            best = Some(fit);
        }
        let Some(best) = &mut best else { continue };
        best.tried = tried + 1;
        if best.quality.good || (tried >= 2 && !best.quality.spiked) {
            break;
        }
    }
    best.ok_or(Cancelled)
}

/// Refines one layout at the wanted fidelity.
fn refine(
    samples: &Samples,
    curve: &samples::Curve,
    candidate: &Candidate,
    options: &Options,
    task: &Task,
) -> Result<Fit, Cancelled> {
    let points = samples.dense_layout(candidate.layout.as_ref());
    let controls = curve.fitted.fit(points.as_ref());
    let sites = curve.even_points(controls.as_ref(), options.sites);
    let spline = curve.fitted.design();
    let positions = spline.apply(controls.as_ref());
    let targets = samples.dense.as_ref();
    let first = variable_projection::fit_plate(positions.as_ref(), targets, sites.as_ref());
    let residual = (targets - first.at(positions.as_ref())).squared_norm_l2();
    let rows = samples.dense.nrows() as f64;
    let hold = spline.gram() * faer::Scale(0.05 * residual / (rows * STRAY * STRAY));
    let bending = Mat::zeros(options.controls, options.controls);
    let fixed = Mat::zeros(0, options.controls);
    let problem = Problem {
        spline,
        targets,
        anchor: controls.as_ref(),
        hold: hold.as_ref(),
        bending: bending.as_ref(),
        fixed: fixed.as_ref(),
        site_hold: 0.0,
    };
    let steps = Steps::default();
    let refined =
        variable_projection::refine(&problem, controls.as_ref(), sites.as_ref(), &steps, task)?;
    Ok(Fit {
        quality: Quality::of(samples, curve, &refined, options.floor),
        controls: refined.controls,
        plate: refined.plate,
        layout: samples.frames_of(candidate.layout.as_ref()),
        choice: candidate.choice,
        tried: 0,
        evaluations: refined.evaluations,
        converged: refined.converged,
    })
}

/// The least-squares curve and plate over one layout, without refinement.
fn unrefined(
    samples: &Samples,
    curve: &samples::Curve,
    points: MatRef<'_, f64>,
    sites: usize,
) -> (Mat<f64>, Plate) {
    let fitter: &UniformFitter = &curve.fitted;
    let controls = fitter.fit(points);
    let sites = curve.even_points(controls.as_ref(), sites);
    let positions = fitter.design().apply(controls.as_ref());
    let targets = samples.dense.as_ref();
    let plate = variable_projection::fit_plate(positions.as_ref(), targets, sites.as_ref());
    (controls, plate)
}

#[cfg(test)]
mod tests;
