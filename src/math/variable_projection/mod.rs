//! Thin-plate splines over a moving curve: the curve's control points and the plate's sites are found
//! by variable projection (Golub & Pereyra 1973), the plate's coefficients being eliminated.
//!
//! ```text
//! minimise over C (k x 2), s (l x 2):   min_c |W (X - B(AC, s) c)|^2 + |C - C0|^2_P + C^T E C
//! ```
//!
//! X is N x m, the samples to be met at N times, W = diag(w) what each of them counts; A is the N x k design of the curve
//! ([`UniformDesign`]); B the N x l design of the plate (`design`); P and E are quadratic forms of
//! the caller: how firmly the curve keeps its place, and what bending costs. Levenberg-Marquardt
//! steps with Kaufman's Jacobian (1975), which is never formed (`normal`).

mod design;
mod exchange;
mod normal;
mod plate;
mod step;

use faer::{Mat, MatRef};

use self::design::Design;
use self::normal::Normal;
use self::step::Steps;
use super::uniform_spline::UniformDesign;
use crate::task::{Cancelled, Task};

pub use exchange::exchange;
pub use plate::Plate;

/// What is to be met, and what holds the curve and the sites in place.
pub struct Problem<'a> {
    /// A, the curve's design at the N samples.
    pub spline: &'a UniformDesign,
    /// X, N x m.
    pub targets: MatRef<'a, f64>,
    /// w, N: what each sample's difference is multiplied by.
    pub weights: &'a [f64],
    /// C0, k x 2.
    pub anchor: MatRef<'a, f64>,
    /// P, k x k, positive semidefinite.
    pub hold: MatRef<'a, f64>,
    /// E, k x k, positive semidefinite.
    pub bending: MatRef<'a, f64>,
    /// Rows over the control points whose curve points may not move (q x k).
    pub fixed: MatRef<'a, f64>,
    /// Weight of |s - s0|^2, s0 the first sites.
    pub site_hold: f64,
}

/// How long to go on. See [`Options::default`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Residual evaluations at most, accepted or not.
    pub evaluations: usize,
    /// First damping, relative to the diagonal of H.
    pub damping: f64,
    /// Stop when four accepted steps together decrease the function by less than four times this.
    pub decrease: f64,
    /// Weight of the coefficients' own size in the linear problem, on columns of norm 1.
    pub ridge: f64,
}

impl Default for Options {
    /// 25 evaluations, damping 0.03, decrease 0.002 a step, ridge 1e-12.
    fn default() -> Self {
        Options {
            evaluations: 25,
            damping: 0.03,
            decrease: 0.002,
            ridge: 1e-12,
        }
    }
}

/// A curve and a plate over it.
#[derive(Debug, Clone)]
pub struct Refined {
    /// C, k x 2.
    pub controls: Mat<f64>,
    /// The plate, its sites among the unknowns.
    pub plate: Plate,
    /// The function minimised, at the start and after every accepted step.
    pub history: Vec<f64>,
    /// Residual evaluations used.
    pub evaluations: usize,
    /// Whether the steps had become small, rather than the evaluations used up.
    pub converged: bool,
}

/// Fits the plate alone: coefficients over given `sites` (l x 2, l >= 3) that meet `targets` (N x m)
/// at `points` (N x 2) in the least-squares sense, differences multiplied by `weights` (N).
pub fn fit_plate(
    points: MatRef<'_, f64>,
    targets: MatRef<'_, f64>,
    weights: &[f64],
    sites: MatRef<'_, f64>,
) -> Plate {
    let (count, width) = (sites.nrows(), targets.ncols());
    let ridge = Options::default().ridge;
    let mut design = Design::new(weights, count, width, ridge);
    let mut plate = Plate::zero(count, width);
    design.solve(points, sites, targets);
    design.plate(sites, &mut plate);
    plate
}

/// Refines `controls` (k x 2) and `sites` (l x 2, l >= 3) from where they are. The function never
/// grows; a start that cannot be improved comes back as it was, with its plate.
///
/// # Errors
/// The task was cancelled.
pub fn refine(
    problem: &Problem<'_>,
    controls: MatRef<'_, f64>,
    sites: MatRef<'_, f64>,
    options: &Options,
    task: &Task,
) -> Result<Refined, Cancelled> {
    let (count, width) = (sites.nrows(), problem.targets.ncols());
    let mut state = State::new(problem, controls, sites, options.ridge);
    let mut normal = Normal::new(problem.spline, count, width);
    let mut steps = Steps::new(problem, count);
    let mut history = vec![state.value];
    let (mut evaluations, mut damping) = (1, options.damping);
    let mut converged = false;
    while !converged && evaluations < options.evaluations {
        task.check()?;
        state.linearise(problem, &mut normal);
        let mut growth = 2.0;
        let accepted = loop {
            if evaluations >= options.evaluations || damping > 1e8 {
                break false;
            }
            task.check()?;
            let Some(predicted) = steps.solve(&normal, damping) else {
                damping = (damping * 10.0).max(1e-10);
                continue;
            };
            evaluations += 1;
            let gain = state.attempt(problem, &steps.step, predicted);
            if gain > 1e-4 {
                damping = (damping * (1.0 - (2.0 * gain - 1.0).powi(3)).max(0.2)).max(1e-12);
                break true;
            }
            damping *= growth;
            growth *= 2.0;
        };
        if !accepted {
            converged = damping > 1e8;
            break;
        }
        history.push(state.value);
        converged = has_settled(&history, options.decrease);
    }
    Ok(Refined {
        controls: state.controls,
        plate: state.plate,
        history,
        evaluations,
        converged,
    })
}

/// Whether the last four steps together gained less than `decrease` each.
fn has_settled(history: &[f64], decrease: f64) -> bool {
    let Some(&[before, .., now]) = history.last_chunk::<5>() else {
        return history.last() == Some(&0.0);
    };
    before - now < 4.0 * decrease * before
}

/// Where the iteration stands, and the workspaces of the linear problem.
struct State {
    design: Design,
    controls: Mat<f64>,
    first_sites: Mat<f64>,
    points: Mat<f64>,
    plate: Plate,
    value: f64,
    tried_controls: Mat<f64>,
    tried_sites: Mat<f64>,
}

impl State {
    fn new(
        problem: &Problem<'_>,
        controls: MatRef<'_, f64>,
        sites: MatRef<'_, f64>,
        ridge: f64,
    ) -> Self {
        let (samples, width) = (problem.weights.len(), problem.targets.ncols());
        let mut state = State {
            design: Design::new(problem.weights, sites.nrows(), width, ridge),
            controls: controls.to_owned(),
            first_sites: sites.to_owned(),
            points: Mat::zeros(samples, 2),
            plate: Plate::zero(sites.nrows(), width),
            value: 0.0,
            tried_controls: controls.to_owned(),
            tried_sites: sites.to_owned(),
        };
        state.value = state.evaluate(problem);
        state.design.plate(sites, &mut state.plate);
        state
    }

    /// The function at the tried control points and sites.
    fn evaluate(&mut self, problem: &Problem<'_>) -> f64 {
        problem
            .spline
            .apply_to(self.tried_controls.as_ref(), &mut self.points);
        let sites = self.tried_sites.as_ref();
        let residual = self
            .design
            .solve(self.points.as_ref(), sites, problem.targets);
        residual + self.penalty(problem)
    }

    fn penalty(&self, problem: &Problem<'_>) -> f64 {
        let controls = self.tried_controls.as_ref();
        let moved = controls - problem.anchor;
        let strayed = (&self.tried_sites - &self.first_sites).squared_norm_l2();
        form(problem.hold, moved.as_ref())
            + form(problem.bending, controls)
            + problem.site_hold * strayed
    }

    /// H and the descent direction at the present point, with the penalties' share.
    fn linearise(&mut self, problem: &Problem<'_>, normal: &mut Normal) {
        let (points, plate) = (self.points.as_ref(), &self.plate);
        normal.assemble(problem.spline, points, &mut self.design, plate);
        let count = self.controls.nrows();
        let pulled =
            problem.hold * (&self.controls - problem.anchor) + problem.bending * &self.controls;
        for a in 0..2 {
            for j in 0..count {
                normal.descent[a * count + j] -= pulled[(j, a)];
                for i in 0..count {
                    normal.hessian[(a * count + i, a * count + j)] +=
                        problem.hold[(i, j)] + problem.bending[(i, j)];
                }
            }
            for j in 0..plate.sites.nrows() {
                let at = 2 * count + a * plate.sites.nrows() + j;
                normal.hessian[(at, at)] += problem.site_hold;
                normal.descent[at] -=
                    problem.site_hold * (plate.sites[(j, a)] - self.first_sites[(j, a)]);
            }
        }
    }

    /// Tries a step; keeps it when the actual gain over the predicted one, which is returned, is
    /// above 1e-4.
    fn attempt(&mut self, problem: &Problem<'_>, step: &[f64], predicted: f64) -> f64 {
        let (controls, sites) = (self.controls.nrows(), self.plate.sites.nrows());
        for a in 0..2 {
            for i in 0..controls {
                self.tried_controls[(i, a)] = self.controls[(i, a)] + step[a * controls + i];
            }
            for j in 0..sites {
                self.tried_sites[(j, a)] =
                    self.plate.sites[(j, a)] + step[2 * controls + a * sites + j];
            }
        }
        let value = self.evaluate(problem);
        let gain = (self.value - value) / predicted;
        if !(value.is_finite() && predicted > 0.0 && gain > 1e-4) {
            return -1.0;
        }
        self.value = value;
        self.controls.copy_from(&self.tried_controls);
        self.design
            .plate(self.tried_sites.as_ref(), &mut self.plate);
        gain
    }
}

/// sum over both columns of v^T F v.
fn form(matrix: MatRef<'_, f64>, vectors: MatRef<'_, f64>) -> f64 {
    let image = matrix * vectors;
    (0..vectors.ncols())
        .map(|c| vectors.col(c).transpose() * image.col(c))
        .sum()
}

#[cfg(test)]
mod tests;
