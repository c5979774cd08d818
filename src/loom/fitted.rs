//! Rows in any Euclidean space, fitted: the shape signal from all of them, then layout, pose and time signal
//! in its subspace, then what the fit is worth.

use super::ch12::{self, Signals};
use super::fidelity::{self, Chosen};
use super::fit::{FitOptions, Method};
use super::left_out::{LeftOutFit, Trial};
use super::ordered::{self, Laid, advice};
use super::pins::{self, Pin};
use super::report::{Change, Errors, Span};
use super::subspace::{Subspace, explained};
use super::warnings;
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::pca::{Basis, Pca, Rows};
use crate::signal::shape::ShapeSignal;
use crate::task::Task;

/// The three signals of some rows, and what is known about them.
pub struct Fitted {
    /// h.
    pub shape: ShapeSignal,
    /// The rows in h's subspace.
    pub subspace: Subspace,
    /// g and f.
    pub signals: Signals,
    /// Errors at the rows.
    pub errors: Errors,
    /// Errors between them.
    pub left_out: Option<LeftOutFit>,
    /// Where the motion between them goes astray, and what would mend it.
    pub spans: Vec<Span>,
    /// Modes that are not rounding.
    pub rank: usize,
    /// What should be known.
    pub warnings: Vec<Diagnostic>,
}

/// Fits rows: frames in any Euclidean space.
///
/// # Errors
/// Options out of bounds, naming the bound; rows that are not finite; the task was cancelled.
pub fn fit_rows(rows: &dyn Rows, options: &FitOptions, task: &Task) -> Result<Fitted> {
    options.check(rows.rows())?;
    task.phase("shape", 0);
    let pca = Pca::new(rows, task).map_err(explained)?;
    let (basis, chosen) = match options.method {
        Method::Ch12 => choose(rows, &pca, options, task)?,
        Method::Ordered => ordered::tolerance::choose(
            rows,
            &pca,
            &options.fidelity(),
            (&options.pins, options.near),
            options.left_out,
            task,
        )?,
    };
    let Chosen {
        subspace,
        signals,
        met,
    } = chosen;
    let errors = Errors::measure(&subspace, &signals);
    let left_out = if options.left_out {
        left_out(&pca, &signals, options, task)?
    } else {
        None
    };
    let fidelity = options.fidelity();
    let spans = spans(&subspace, &signals, options, task)?;
    let mut warnings = warnings::of_fidelity(&fidelity, &basis, &signals, &errors, met);
    warnings.extend(warnings::of_ordered(&subspace, &signals));
    warnings.extend(warnings::of_spans(&spans));
    warnings.extend(left_out.as_ref().and_then(warnings::between_frames));
    let mut vectors = basis.vectors;
    vectors.truncate(subspace.modes * rows.columns());
    vectors.shrink_to_fit();
    let shape = ShapeSignal::new(pca.mean().to_vec(), vectors, subspace.modes)
        .map_err(|error| Box::new(Diagnostic::error(error.to_string())))?;
    Ok(Fitted {
        shape,
        subspace,
        signals,
        errors,
        left_out,
        spans,
        rank: basis.rank,
        warnings,
    })
}

/// The signals that keep the tolerance with the fewest numbers; full fidelity where none do.
fn choose(
    rows: &dyn Rows,
    pca: &Pca,
    options: &FitOptions,
    task: &Task,
) -> Result<(Basis, Chosen)> {
    let fidelity = options.fidelity();
    let (least, most) = fidelity.modes_to_try(pca);
    let mut basis = pca.basis(rows, most, task).map_err(explained)?;
    let subspace = Subspace::new(pca, &basis);
    let setting = (options.alpha, &options.pins[..]);
    let found = fidelity::choose(&fidelity, &subspace, least, setting, task)?;
    if let Some(chosen) = found {
        return Ok((basis, chosen));
    }
    let all = fidelity.modes.unwrap_or(pca.rows() - 1);
    if basis.modes < all {
        basis.vectors = Vec::new();
        task.phase("shape", 0);
        basis = pca.basis(rows, all, task).map_err(explained)?;
    }
    let chosen = fidelity::full(&fidelity, Subspace::new(pca, &basis), setting, task)?;
    Ok((basis, chosen))
}

/// (tau, theta) of an ordered fit.
fn choice_of(signals: &Signals) -> Option<(f64, f64)> {
    signals.ordered.map(|ordered| (ordered.tau, ordered.theta))
}

/// Where the motion between frames goes astray, and what would mend it.
fn spans(
    subspace: &Subspace,
    signals: &Signals,
    options: &FitOptions,
    task: &Task,
) -> Result<Vec<Span>> {
    let mut spans = advice::spans(subspace, signals);
    if spans.is_empty() {
        return Ok(spans);
    }
    let laid = match options.method {
        Method::Ch12 => None,
        Method::Ordered => Some(Laid::out(subspace, choice_of(signals), task)?),
    };
    let fit = |change: &Change| -> Result<Signals> {
        let (mut pins, mut sites) = (options.pins.clone(), signals.pose.sites().len());
        match change {
            Change::Pins(held) => {
                for held in held {
                    pins.retain(|pin| pin.frame != held.frame);
                    pins.push(Pin::at(held.frame - 1, held.at));
                }
            }
            Change::Sites(more) => sites = *more,
        }
        let controls = signals.time.controls().len();
        match &laid {
            Some(laid) => laid.signals(controls, sites, &pins, task),
            None => {
                let pins = pins::placed(&pins, subspace, task)?;
                ch12::signals(subspace, (controls, sites), (options.alpha, &pins), task)
            }
        }
    };
    let pinned: Vec<usize> = options.pins.iter().map(|pin| pin.frame).collect();
    advice::advise(subspace, signals, &pinned, &mut spans, &fit)?;
    Ok(spans)
}

/// The error between frames. Pins of frames that are kept hold there too.
fn left_out(
    pca: &Pca,
    signals: &Signals,
    options: &FitOptions,
    task: &Task,
) -> Result<Option<LeftOutFit>> {
    task.phase("left_out", 0);
    let (controls, sites) = (signals.time.controls().len(), signals.pose.sites().len());
    let Some(trial) = Trial::new(pca, signals.pose.modes(), task)? else {
        return Ok(None);
    };
    let (controls, sites) = trial.share((controls, sites));
    let frames = options.pins.iter().map(|pin| pin.frame - 1);
    let pins = frames
        .filter(|frame| frame % 2 == 0)
        .map(|frame| (frame / 2, signals.layout.positions[frame]));
    let subspace = trial.subspace();
    let half = match options.method {
        Method::Ch12 => {
            let pins: Vec<(usize, Point)> = pins.collect();
            ch12::signals(subspace, (controls, sites), (options.alpha, &pins), task)?
        }
        Method::Ordered => {
            let pins: Vec<Pin> = pins.map(|(frame, at)| Pin::at(frame, at)).collect();
            Laid::out(subspace, None, task)?.signals(controls, sites, &pins, task)?
        }
    };
    Ok(Some(trial.measure(&half)))
}
