//! How many control points, sites and modes: as asked for, or as few as a tolerance allows (CH12 §3.4).
//!
//! With T the tolerance on the relative total error: for each m in \[m0, m0+6\], m0 the smallest with shape
//! error <= T/sqrt 2, l is the smallest with shape and pose error together <= 0.85 T, and k the smallest
//! whose measured total is <= T (searched upwards: the total is not monotone). Of these the one with the
//! fewest stored numbers 2k + lm is taken. Taking the smallest m without that budget drives k and l to n.

use super::ch12::{self, Signals, passed};
use super::pins::{Pin, placed};
use super::subspace::Subspace;
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::layout::Layout;
use crate::math::pca::Pca;
use crate::signal::pose::{PoseFit, PoseSignal};
use crate::signal::time::TimeSignal;
use crate::task::Task;

/// So many numbers of modes above the smallest possible one are tried.
const MORE_MODES: usize = 6;

/// The part of the tolerance that shape and pose may use up.
const BEFORE_TIME: f64 = 0.85;

/// Below this relative error a fit is exact, whatever smaller tolerance was asked for.
const EXACT: f64 = 1e-8;

/// What is asked for: k, l, m where given, and the tolerance that decides what is not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fidelity {
    /// k, control points of the time signal.
    pub controls: Option<usize>,
    /// l, sites of the pose signal.
    pub sites: Option<usize>,
    /// m, modes of the shape signal.
    pub modes: Option<usize>,
    /// Relative total error.
    pub tolerance: f64,
}

impl Fidelity {
    /// Whether nothing is left to the tolerance.
    pub fn is_given(&self) -> bool {
        self.controls.is_some() && self.sites.is_some() && self.modes.is_some()
    }

    /// Bounds for n positions: 4 <= k <= n+2, 3 <= l <= n, 0 <= m <= n-1.
    ///
    /// # Errors
    /// The number that is out of bounds, and the bound.
    pub fn check(&self, n: usize) -> Result<()> {
        if !(0.0..f64::INFINITY).contains(&self.tolerance) {
            return Diagnostic::error(format!("the tolerance is {}", self.tolerance))
                .hint("it is a relative error, 0.01 for one percent")
                .err();
        }
        let bounds = [
            ("k", "controls", self.controls, 4, n + 2, "n+2"),
            ("l", "sites", self.sites, 3, n.max(3), "n"),
            ("m", "modes", self.modes, 0, n - 1, "n-1"),
        ];
        for (letter, name, given, least, most, formula) in bounds {
            let Some(given) = given.filter(|given| !(least..=most).contains(given)) else {
                continue;
            };
            return Diagnostic::error(format!(
                "{letter} = {given} ({name}) is out of bounds: {least} <= {letter} <= {formula}, \
                 which is {most} here"
            ))
            .hint(format!(
                "n = {n} counts positions that differ from the one before"
            ))
            .err();
        }
        Ok(())
    }

    /// How many modes are needed at least and at most, before anything is laid out.
    pub fn modes_to_try(&self, pca: &Pca) -> (usize, usize) {
        let most = pca.rows() - 1;
        let limit = self.tolerance * std::f64::consts::FRAC_1_SQRT_2 * pca.spread();
        let least = (0..most).find(|&modes| pca.residual(modes) <= limit);
        match self.modes {
            Some(modes) => (modes, modes),
            None => {
                let least = least.unwrap_or(most);
                // modes beyond those resolved leave out less than 1e-6 already
                let useful = pca.resolved().clamp(least, most);
                (least, (least + MORE_MODES).min(useful))
            }
        }
    }
}

/// Signals, the part of the subspace they are for, and whether they keep the tolerance.
pub struct Chosen {
    /// The frames in the modes that were chosen.
    pub subspace: Subspace,
    /// The signals.
    pub signals: Signals,
    /// Whether the measured total is within the tolerance.
    pub met: bool,
}

/// A number of modes being tried.
struct Candidate {
    subspace: Subspace,
    layout: Layout,
    pose: PoseFit,
}

/// Fits CH12's signals with as few numbers as keep the tolerance. `subspace` has the modes of
/// [`Fidelity::modes_to_try`]; `alpha` is the time signal's exponent. None where no choice
/// keeps the tolerance (and something was left to it).
///
/// # Errors
/// k or l out of bounds for the distinct positions; the task was cancelled.
pub fn choose(
    fidelity: &Fidelity,
    subspace: &Subspace,
    least_modes: usize,
    (alpha, pins): (f64, &[Pin]),
    task: &Task,
) -> Result<Option<Chosen>> {
    task.phase("layout", 0);
    let least = least_modes.min(subspace.modes);
    let subspaces: Vec<Subspace> = (least..=subspace.modes)
        .map(|modes| subspace.truncated(modes))
        .collect();
    let layouts = ch12::each(&subspaces, |part| {
        ch12::place(part, &placed(pins, part, task)?, task)
    })?;
    let placed: Vec<(Subspace, Layout)> = subspaces.into_iter().zip(layouts).collect();
    for (_, layout) in &placed {
        fidelity.check_distinct(ch12::distinct(&layout.positions))?;
    }
    task.phase("pose", 0);
    let poses = ch12::each(&placed, |(subspace, layout)| {
        task.check()?;
        fidelity.pose(subspace, &layout.positions)
    })?;
    let candidates: Vec<Candidate> = placed
        .into_iter()
        .zip(poses)
        .filter_map(|((subspace, layout), pose)| {
            pose.map(|pose| Candidate {
                subspace,
                layout,
                pose,
            })
        })
        .collect();
    task.phase("time", 0);
    let times = ch12::each(&candidates, |candidate| {
        fidelity.time(candidate, alpha, task)
    })?;
    let numbers = |(candidate, time): &(Candidate, TimeSignal)| {
        2 * time.controls().len() + candidate.pose.signal.sites().len() * candidate.subspace.modes
    };
    let best = candidates
        .into_iter()
        .zip(times)
        .filter_map(|(candidate, time)| time.map(|time| (candidate, time)))
        .min_by_key(numbers);
    Ok(best.map(|(candidate, time)| candidate.chosen(time, fidelity.tolerance)))
}

impl Candidate {
    fn chosen(self, time: TimeSignal, tolerance: f64) -> Chosen {
        let total = total(&self.subspace, &self.pose.signal, &time, f64::INFINITY);
        let met = self.subspace.relative(total.sqrt()) <= tolerance.max(EXACT);
        Chosen {
            signals: Signals {
                layout: self.layout,
                distinct: self.pose.distinct,
                merged: self.pose.spread,
                ordered: None,
                pose: self.pose.signal,
                time,
            },
            subspace: self.subspace,
            met,
        }
    }
}

impl Fidelity {
    /// The bounds of k and l for what the layout can tell apart. One position allows anything: there is
    /// nothing to choose.
    fn check_distinct(&self, n: usize) -> Result<()> {
        match n {
            1 => Ok(()),
            _ => Fidelity {
                modes: None,
                ..*self
            }
            .check(n),
        }
    }

    /// Squared error that everything together may have.
    fn limit(&self, subspace: &Subspace) -> f64 {
        let limit = self.tolerance * subspace.spread;
        limit * limit
    }

    /// g with the sites asked for, or the fewest that leave enough of the tolerance to the time signal;
    /// None where no number does.
    fn pose(&self, subspace: &Subspace, positions: &[Point]) -> Result<Option<PoseFit>> {
        if let Some(sites) = self.sites {
            return ch12::pose(subspace, positions, sites).map(Some);
        }
        let residual = subspace.residual * subspace.residual;
        let limit = BEFORE_TIME * BEFORE_TIME * self.limit(subspace) - residual;
        let n = positions.len();
        // the order costs n l^2: try short ones first
        for most in [n / 4, n / 2, n] {
            let fit = ch12::pose(subspace, positions, most.max(3))?;
            if let Some(enough) = fit.errors.iter().position(|&error| error <= limit) {
                return ch12::pose(subspace, positions, (enough + 1).max(3)).map(Some);
            }
        }
        Ok(None)
    }

    /// f with the control points asked for, or the fewest within the tolerance; None where no number is.
    fn time(&self, candidate: &Candidate, alpha: f64, task: &Task) -> Result<Option<TimeSignal>> {
        let positions = &candidate.layout.positions;
        let n = ch12::distinct(positions);
        if n == 1 {
            return ch12::time(positions, 1, alpha).map(Some);
        }
        if let Some(controls) = self.controls {
            let time = ch12::time(positions, controls, alpha)?;
            let fits = self.is_given() || self.keeps(candidate, &time);
            return Ok(fits.then_some(time));
        }
        for controls in 4..=n + 2 {
            task.check()?;
            let time = ch12::time(positions, controls, alpha)?;
            if self.keeps(candidate, &time) {
                return Ok(Some(time));
            }
        }
        Ok(None)
    }

    fn keeps(&self, candidate: &Candidate, time: &TimeSignal) -> bool {
        let limit = self.limit(&candidate.subspace);
        total(&candidate.subspace, &candidate.pose.signal, time, limit) <= limit
    }
}

/// sum ||z_i - psi(i)||^2, (3) + (4) at the time signal's points; or something larger than `limit`.
pub fn total(subspace: &Subspace, pose: &PoseSignal, time: &TimeSignal, limit: f64) -> f64 {
    let residual = subspace.residual * subspace.residual;
    residual + ch12::misfit(subspace, pose, &passed(time), limit - residual)
}

/// Everything that `subspace` (all modes, or those asked for) holds: l = n and k = n+2 where not given.
///
/// # Errors
/// As [`choose`].
pub fn full(
    fidelity: &Fidelity,
    subspace: Subspace,
    (alpha, pins): (f64, &[Pin]),
    task: &Task,
) -> Result<Chosen> {
    task.phase("layout", 0);
    let layout = ch12::place(&subspace, &placed(pins, &subspace, task)?, task)?;
    let n = ch12::distinct(&layout.positions);
    fidelity.check_distinct(n)?;
    task.phase("pose", 0);
    let sites = fidelity.sites.unwrap_or(subspace.frames);
    let pose = ch12::pose(&subspace, &layout.positions, sites)?;
    task.phase("time", 0);
    let time = ch12::time(&layout.positions, fidelity.controls.unwrap_or(n + 2), alpha)?;
    Ok(Candidate {
        subspace,
        layout,
        pose,
    }
    .chosen(time, fidelity.tolerance))
}
