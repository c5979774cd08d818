//! As few numbers as a tolerance allows, in the ordered method.
//!
//! With T the tolerance on the relative error: m is the smallest with shape error <= T/sqrt 2 for which
//! leaving out modes costs at most 5 % of the error *between* frames (that of a cubic spline in every
//! coordinate, at left-out frames); l is 2m, grown where that is not enough; k is the smallest of a row of
//! tenths of n. Enough is: error at the frames and deviation from the cubic spline between them, both with
//! the shape error, within T, and no deviation between frames that is seen ([`VISIBLE`]).
//!
//! Few numbers can meet all samples and still say little about what lies between *other* frames: where the
//! left-out error is measured, k and l that are not given also grow until it is near the cubic spline's.

use super::advice::VISIBLE;
use super::{Laid, SITES_PER_MODE};
use crate::diag::Result;
use crate::loom::ch12::Signals;
use crate::loom::fidelity::{Chosen, Fidelity, total};
use crate::loom::left_out::{self, Trial};
use crate::loom::pins::Pin;
use crate::loom::subspace::{Subspace, explained};
use crate::math::pca::{Basis, Pca, Rows};
use crate::task::Task;

/// What leaving out modes may cost between frames.
const CUT: f64 = 1.05;

/// The left-out error may be so many times that of a cubic spline in every coordinate.
const LEFT_OUT: f64 = 1.08;

/// Control points that are tried, in tenths of the frames, most first; the first is the usual number. With
/// still fewer the motion may be met, but its curve leaves the layout: poses that return lie apart.
const TENTHS: [usize; 3] = [8, 6, 4];

/// Fits with what is given, and as few of the rest as the tolerance allows; full fidelity where nothing
/// keeps it. With `between`, as few as left-out frames allow, too.
///
/// # Errors
/// The task was cancelled; coordinates too large to be squared.
pub fn choose(
    rows: &dyn Rows,
    pca: &Pca,
    fidelity: &Fidelity,
    (pins, near): (&[Pin], Option<(f64, f64)>),
    between: bool,
    task: &Task,
) -> Result<(Basis, Chosen)> {
    let modes = match fidelity.modes {
        Some(modes) => modes,
        None => {
            let (least, _) = fidelity.modes_to_try(pca);
            left_out::modes_between(pca, least, CUT, task)?
        }
    };
    let basis = pca.basis(rows, modes, task).map_err(explained)?;
    let subspace = Subspace::new(pca, &basis);
    let laid = Laid::out(&subspace, near, task)?;
    let search = Search {
        laid: &laid,
        subspace: &subspace,
        tolerance: fidelity.tolerance,
        pins,
        task,
    };
    let (mut signals, met) = search.least(fidelity)?;
    if between && !fidelity.is_given() && signals.ordered.is_some() {
        let numbers = (signals.time.controls().len(), signals.pose.sites().len());
        if let Some((controls, sites)) = search.general(numbers, fidelity, pca)? {
            signals = search.fit(controls, sites)?;
        }
    }
    let chosen = Chosen {
        signals,
        met,
        subspace: subspace.clone(),
    };
    Ok((basis, chosen))
}

struct Search<'a> {
    laid: &'a Laid<'a>,
    subspace: &'a Subspace,
    tolerance: f64,
    pins: &'a [Pin],
    task: &'a Task,
}

impl Search<'_> {
    /// The signals with the fewest numbers, and whether they keep the tolerance.
    fn least(&self, fidelity: &Fidelity) -> Result<(Signals, bool)> {
        let n = self.subspace.frames;
        let usual = (n * TENTHS[0] / 10).max(4);
        let controls = fidelity.controls.unwrap_or(usual);
        let mut signals = self.with_sites(controls, fidelity)?;
        let sites = signals.pose.sites().len();
        if fidelity.controls.is_none() && !self.keeps(&signals) {
            signals = self.fit(n + 2, sites)?;
        } else if fidelity.controls.is_none() {
            for tenths in &TENTHS[1..] {
                let fewer = self.fit((n * tenths / 10).max(4), sites)?;
                if !self.is_fine(&fewer) {
                    break;
                }
                signals = fewer;
            }
        }
        let met = self.keeps(&signals);
        Ok((signals, met))
    }

    /// From `numbers` (k and l) on, the fewest whose fit to every second frame is near the cubic spline
    /// between them; the best where none is, and nothing where `numbers` will do.
    fn general(
        &self,
        numbers: (usize, usize),
        fidelity: &Fidelity,
        pca: &Pca,
    ) -> Result<Option<(usize, usize)>> {
        let Some(trial) = Trial::new(pca, self.subspace.modes, self.task)? else {
            return Ok(None);
        };
        let laid = Laid::out(trial.subspace(), None, self.task)?;
        let n = self.subspace.frames;
        let more = |count: usize, most: usize, given: Option<usize>| match given {
            Some(_) => count,
            None => (count + count.div_ceil(4)).min(most.max(count)),
        };
        let (mut now, mut best) = (numbers, (f64::INFINITY, numbers));
        loop {
            let (controls, sites) = trial.share(now);
            let half = laid.signals(controls, sites, &[], self.task)?;
            let found = trial.measure(&half);
            if found.psi < best.0 {
                best = (found.psi, now);
            }
            let (controls, sites) = now;
            now = (
                more(controls, n + 2, fidelity.controls),
                more(sites, n, fidelity.sites),
            );
            if found.psi <= LEFT_OUT * found.cubic || now == (controls, sites) {
                break;
            }
        }
        Ok(Some(best.1).filter(|&best| best != numbers))
    }

    /// The fewest sites with so many control points.
    fn with_sites(&self, controls: usize, fidelity: &Fidelity) -> Result<Signals> {
        let n = self.subspace.frames;
        if let Some(sites) = fidelity.sites {
            return self.fit(controls, sites);
        }
        let mut sites = (SITES_PER_MODE * self.subspace.modes).clamp(4.min(n), n.max(3));
        loop {
            let signals = self.fit(controls, sites)?;
            if self.is_fine(&signals) || sites >= n {
                return Ok(signals);
            }
            sites = (sites + sites.div_ceil(4)).min(n);
        }
    }

    fn fit(&self, controls: usize, sites: usize) -> Result<Signals> {
        self.laid.signals(controls, sites, self.pins, self.task)
    }

    /// Whether the tolerance is kept, and nothing between the frames is seen to pop.
    fn is_fine(&self, signals: &Signals) -> bool {
        let worst = signals.ordered.map_or(0.0, |ordered| ordered.worst);
        worst <= VISIBLE && self.keeps(signals)
    }

    /// Whether frames and what lies between them are within the tolerance.
    fn keeps(&self, signals: &Signals) -> bool {
        let limit = self.tolerance.max(1e-8);
        let shape = self.subspace.residual;
        let inside: f64 = self.subspace.x.iter().map(|x| x * x).sum();
        let between = signals.ordered.map_or(0.0, |ordered| ordered.between);
        let between = (shape * shape + between * between * inside).sqrt();
        let at = total(self.subspace, &signals.pose, &signals.time, f64::INFINITY).sqrt();
        self.subspace.relative(at.max(between)) <= limit
    }
}
