//! Fitting psi = h o g o f to a capture (CH12 §3): root motion split off, frames encoded in a shape space,
//! signals fitted to them ([`super::fitted`]), and a loom made of it all.

use std::sync::Arc;

use super::fidelity::Fidelity;
use super::fitted::{Fitted, fit_rows};
use super::frames::{Frames, travel_warning};
use super::pins::{self, Pin};
use super::report::FitReport;
use super::{Layout, Loom, Parts, position_error, warnings};
use crate::diag::{Diagnostic, Result, Warned};
use crate::math::pca::{Rows, Table};
use crate::mesh::{FrameSource, Sequence};
use crate::signal::root::RootKind;
use crate::space::{ShapeSpace, Spaces, encode_frames};
use crate::task::Task;

/// So many frames at most show a space that adapts to them what it will have to hold.
const SAMPLES: usize = 16;

/// How psi is found between frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Method {
    /// Frames laid out in their order, signals fitted to what lies between them too.
    #[default]
    Ordered,
    /// As CH12 prints it: frames laid out by their distances alone.
    Ch12,
}

impl Method {
    /// All there are.
    pub const ALL: &[Method] = &[Method::Ordered, Method::Ch12];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Method::Ordered => "ordered",
            Method::Ch12 => "ch12",
        }
    }
}

/// What to fit. The default leaves everything to the tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct FitOptions {
    /// The shape space's name, one of [`crate::space::SPACES`]; default "vertices".
    pub space: String,
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
    /// (tau, theta) of an earlier ordered fit of nearly these frames: its layout is kept unless the motion
    /// has a spike with it now, so that the map stays the one that is known.
    pub near: Option<(f64, f64)>,
    /// Root motion to split off and keep as a signal of its own; none: it stays in the shapes.
    pub root: Option<RootKind>,
    /// Frames per second, where the capture does not say or says wrong.
    pub fps: Option<f64>,
    /// Whether to measure the error between frames too.
    pub left_out: bool,
}

impl Default for FitOptions {
    fn default() -> Self {
        FitOptions {
            space: "vertices".to_string(),
            method: Method::default(),
            controls: None,
            sites: None,
            modes: None,
            tolerance: 0.01,
            pins: Vec::new(),
            alpha: 0.5,
            near: None,
            root: None,
            fps: None,
            left_out: true,
        }
    }
}

impl FitOptions {
    /// The paper's method, all else as by default.
    pub fn ch12() -> Self {
        FitOptions {
            method: Method::Ch12,
            ..FitOptions::default()
        }
    }

    pub(super) fn fidelity(&self) -> Fidelity {
        Fidelity {
            controls: self.controls,
            sites: self.sites,
            modes: self.modes,
            tolerance: self.tolerance,
        }
    }

    /// Whatever can be refused before the frames are looked at.
    pub(super) fn check(&self, frames: usize) -> Result<()> {
        if frames == 0 {
            return Diagnostic::error("there are no frames to fit").err();
        }
        if !(0.0..=1.0).contains(&self.alpha) {
            return Diagnostic::error(format!("alpha is {}, outside 0 to 1", self.alpha))
                .hint("0 gives every step the same time, 1 a time by its length; 0.5 is usual")
                .err();
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

/// Fits psi to a capture. Phases of `task`: "encode", "shape", "layout", "pose", "time", "left_out"
/// ("shape" to "time" come twice where a tolerance cannot be kept).
///
/// One frame gives one pose for all time, two the segment between them.
///
/// # Errors
/// No frames; options out of bounds, naming the bound; a pin on no frame; a space that does not suit the
/// mesh; coordinates too large to be squared; the task was cancelled.
pub fn fit(sequence: &Sequence, options: &FitOptions, task: &Task) -> Result<Warned<Loom>> {
    options.check(sequence.frames())?;
    task.phase("encode", sequence.frames());
    let (frames, root) = match options.root {
        None => (Frames::new(sequence), None),
        Some(kind) => {
            let (frames, root) = Frames::without_root(sequence, kind, task)?;
            (frames, Some(Arc::new(root)))
        }
    };
    let space = open_space(sequence, &frames, &options.space)?;
    let mut warnings = Vec::new();
    if root.is_none() {
        warnings.extend(travel_warning(sequence));
    }
    let fps = options.fps.or(sequence.fps());
    warnings.extend(warnings::of_length(sequence.frames(), fps));
    let fitted = if space.is_identity() {
        fit_rows(&frames, options, task)?
    } else {
        let (rows, turns) = encode(&frames, &*space, task)?;
        warnings.extend(warnings::of_turns(turns));
        fit_rows(&Table::new(&rows, space.dimension()), options, task)?
    };
    warnings.extend(fitted.warnings.iter().cloned());
    let report = report(sequence, options, &*space, &fitted, &warnings);
    let loom = Loom::new(Parts {
        topology: Arc::clone(sequence.topology()),
        fps,
        space,
        layout: Arc::new(layout(&fitted, &options.pins)),
        shape: Arc::new(fitted.shape),
        pose: Arc::new(fitted.signals.pose),
        time: Arc::new(fitted.signals.time),
        root,
        report: Arc::new(report),
    })?;
    Ok(Warned {
        output: measured(&loom, &frames, task)?,
        warnings,
    })
}

/// The loom with its error in vertex positions.
fn measured(loom: &Loom, frames: &Frames<'_>, task: &Task) -> Result<Loom> {
    let mut report = FitReport::clone(loom.report());
    report.error.positions = Some(match loom.space().is_identity() {
        true => report.error.total,
        false => {
            task.phase("positions", 0);
            position_error::relative(loom, frames, task)?
        }
    });
    Loom::new(Parts {
        report: Arc::new(report),
        ..loom.parts()
    })
}

/// The space called `name` about the first frame, without its root motion.
fn open_space(sequence: &Sequence, frames: &Frames<'_>, name: &str) -> Result<Arc<dyn ShapeSpace>> {
    let n = sequence.frames();
    let read = |frame: usize| {
        let mut positions = vec![0.0; frames.columns()];
        frames.copy(frame, 0..frames.columns(), &mut positions);
        positions
    };
    let count = if name == "vertices" {
        0
    } else {
        n.min(SAMPLES)
    };
    let samples: Vec<Vec<f64>> = (0..count)
        .map(|sample| read(sample * (n - 1) / (count - 1).max(1)))
        .collect();
    let samples: Vec<&[f64]> = samples.iter().map(Vec::as_slice).collect();
    let spaces = Spaces::new(Arc::clone(sequence.topology()), &read(0));
    Ok(spaces.open(name, &samples)?)
}

/// All frames in a space, row after row, and how many rotations turned too far in one step.
fn encode(frames: &Frames<'_>, space: &dyn ShapeSpace, task: &Task) -> Result<(Vec<f64>, usize)> {
    let mut rows = vec![0.0; frames.rows() * space.dimension()];
    let vertices = frames.columns() / 3;
    let read = |frame: usize, positions: &mut [f64]| -> Result<()> {
        frames.copy(frame, 0..positions.len(), positions);
        Ok(())
    };
    let turns = encode_frames(space, vertices, read, &mut rows, task)?;
    Ok((rows, turns))
}

/// What the signals were fitted to, the pins where they came to lie.
fn layout(fitted: &Fitted, pins: &[Pin]) -> Layout {
    let positions = &fitted.signals.layout.positions;
    let held = |pin: &Pin| (pin.frame - 1, positions[pin.frame - 1]);
    Layout {
        positions: positions.clone(),
        coordinates: fitted.subspace.x.clone(),
        residuals: fitted.subspace.residuals.clone(),
        pins: pins.iter().map(held).collect(),
    }
}

fn report(
    sequence: &Sequence,
    options: &FitOptions,
    space: &dyn ShapeSpace,
    fitted: &Fitted,
    warnings: &[Diagnostic],
) -> FitReport {
    FitReport {
        vertices: sequence.topology().vertices(),
        faces: sequence.topology().faces(),
        space: space.name().to_string(),
        dimension: space.dimension(),
        fps: options.fps.or(sequence.fps()),
        left_out: fitted.left_out.as_ref().map(Into::into),
        warnings: warnings
            .iter()
            .map(|warning| warning.message.clone())
            .collect(),
        spans: fitted.spans.clone(),
        method: options.method.name().to_string(),
        alpha: options.alpha,
        rank: fitted.rank,
        ..FitReport::of_signals(&fitted.subspace, &fitted.signals, options.pins.len())
    }
}
