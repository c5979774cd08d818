//! Fitting psi = h o g o f to a capture (CH12 §3): the shape signal from all frames, then layout, pose and
//! time signal in its subspace, then what the fit is worth.

use super::ch12::{self, Signals};
use super::fidelity::{self, Chosen, Fidelity};
use super::left_out::{self, LeftOutFit};
use super::pins::{self, Pin};
use super::report::Errors;
use super::subspace::{Subspace, explained};
use super::warnings;
use crate::diag::{Diagnostic, Result};
use crate::math::pca::{Basis, Pca, Rows};
use crate::signal::shape::ShapeSignal;
use crate::task::Task;

/// How psi is found between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// As CH12 prints it: frames laid out by their distances alone.
    #[default]
    Ch12,
}

impl Method {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Method::Ch12 => "ch12",
        }
    }
}

/// What to fit. The default leaves everything to the tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// How psi is found between frames.
    pub method: Method,
    /// k, control points of the time signal, 4 to n+2; none: as few as the tolerance allows.
    pub controls: Option<usize>,
    /// l, sites of the pose signal, 3 to n.
    pub sites: Option<usize>,
    /// m, modes of the shape signal, 0 to n-1.
    pub modes: Option<usize>,
    /// Relative total error for what is not given; default 0.01.
    pub tolerance: f64,
    /// Frames held in the layout.
    pub pins: Vec<Pin>,
    /// Exponent of the time signal's parametrisation, 0 (uniform) to 1 (by length); default 1/2.
    pub alpha: f64,
    /// Frames per second, where the capture does not say or says wrong.
    pub fps: Option<f64>,
    /// Whether to measure the error between frames too.
    pub left_out: bool,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            method: Method::default(),
            controls: None,
            sites: None,
            modes: None,
            tolerance: 0.01,
            pins: Vec::new(),
            alpha: 0.5,
            fps: None,
            left_out: true,
        }
    }
}

impl FitOptions {
    fn fidelity(&self) -> Fidelity {
        Fidelity {
            controls: self.controls,
            sites: self.sites,
            modes: self.modes,
            tolerance: self.tolerance,
        }
    }

    /// Whatever can be refused before the frames are looked at.
    fn check(&self, frames: usize) -> Result<()> {
        if frames == 0 {
            return Diagnostic::error("there are no frames to fit").err();
        }
        if !(0.0..=1.0).contains(&self.alpha) {
            return Diagnostic::error(format!("alpha is {}, outside 0 to 1", self.alpha)).err();
        }
        if self.fps.is_some_and(|fps| !(fps > 0.0 && fps.is_finite())) {
            return Diagnostic::error("the frame rate must be above 0").err();
        }
        if frames > 1 {
            self.fidelity().check(frames)?;
        }
        pins::check(&self.pins, frames)
    }
}

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
    let (basis, chosen) = choose(rows, &pca, options, task)?;
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
    let mut warnings = warnings::of_fidelity(&fidelity, &basis, &signals, &errors, met);
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

/// The error between frames, without pins: those belong to the frames, half of which are gone.
fn left_out(
    pca: &Pca,
    signals: &Signals,
    options: &FitOptions,
    task: &Task,
) -> Result<Option<LeftOutFit>> {
    task.phase("left_out", 0);
    let (controls, sites) = (signals.time.controls().len(), signals.pose.sites().len());
    let method = |subspace: &Subspace, controls: usize, sites: usize| {
        ch12::signals(subspace, controls, sites, options.alpha, task)
    };
    left_out::measure(pca, (controls, sites, signals.pose.modes()), &method, task)
}
