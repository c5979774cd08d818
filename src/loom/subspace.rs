//! The frames in the shape subspace: what layouts and signals are fitted to.

use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::layout::Distances;
use crate::math::pca::{Basis, Pca, PcaError, Rows};
use crate::task::{Cancelled, Task};

/// x_1 .. x_n, the frames' coordinates in the shape subspace R^m (principal ones, so that the first two
/// are the best-fit plane's), and what the subspace leaves out.
#[derive(Debug, Clone, PartialEq)]
pub struct Subspace {
    /// n, how many frames there are.
    pub frames: usize,
    /// m.
    pub modes: usize,
    /// n rows of m numbers.
    pub x: Vec<f64>,
    /// The root of sum ||z_i - h_0||^2: what errors are relative to.
    pub spread: f64,
    /// The root of (3), sum ||z_i - h(x_i)||^2.
    pub residual: f64,
    /// ||z_i - h(x_i)|| of each frame; nothing where that is not known.
    pub residuals: Vec<f64>,
}

impl Subspace {
    /// Of a decomposition and its basis.
    pub fn new(pca: &Pca, basis: &Basis) -> Self {
        Subspace {
            frames: pca.rows(),
            modes: basis.modes,
            x: basis.coordinates.clone(),
            spread: pca.spread(),
            residual: basis.residual,
            residuals: basis.residuals.clone(),
        }
    }

    /// x_i of a frame from 0, m numbers.
    pub fn row(&self, frame: usize) -> &[f64] {
        &self.x[frame * self.modes..(frame + 1) * self.modes]
    }

    /// The same frames with the leading `modes` coordinates (at most m); what is dropped joins the residual.
    #[must_use]
    pub fn truncated(&self, modes: usize) -> Self {
        let modes = modes.min(self.modes);
        let rows = || (0..self.frames).map(|frame| self.row(frame));
        let square = |row: &[f64]| row[modes..].iter().map(|x| x * x).sum::<f64>();
        let dropped: f64 = rows().map(square).sum();
        let joined = |(residual, row): (&f64, &[f64])| (residual * residual + square(row)).sqrt();
        Subspace {
            modes,
            x: rows().flat_map(|row| &row[..modes]).copied().collect(),
            residual: (self.residual * self.residual + dropped).sqrt(),
            residuals: self.residuals.iter().zip(rows()).map(joined).collect(),
            ..*self
        }
    }

    /// `error` relative to the spread; 0 where nothing moves.
    pub fn relative(&self, error: f64) -> f64 {
        if self.spread > 0.0 {
            error / self.spread
        } else {
            0.0
        }
    }

    /// All distances ||x_i - x_j||.
    pub fn distances(&self) -> Distances {
        match self.modes {
            0 => Distances::from_fn(self.frames, |_, _| 0.0),
            modes => Distances::between(&self.x, modes),
        }
    }

    /// The two leading coordinates: where layouts start.
    pub fn leading(&self) -> Vec<Point> {
        let entry = |frame: usize, axis: usize| self.row(frame).get(axis).copied().unwrap_or(0.0);
        (0..self.frames)
            .map(|i| [entry(i, 0), entry(i, 1)])
            .collect()
    }
}

/// Rows with their decomposition and `modes` of it.
///
/// # Errors
/// A coordinate is not finite; the task was cancelled.
pub fn decomposed(rows: &dyn Rows, modes: usize, task: &Task) -> Result<(Pca, Basis)> {
    let pca = Pca::new(rows, task).map_err(explained)?;
    let basis = pca.basis(rows, modes, task).map_err(explained)?;
    Ok((pca, basis))
}

/// The error of a decomposition in the user's words.
pub fn explained(error: PcaError) -> Box<Diagnostic> {
    match error {
        PcaError::Cancelled => Cancelled.into(),
        PcaError::NotFinite => Box::new(
            Diagnostic::error(error.to_string())
                .hint("scale the capture down, or look for broken frames"),
        ),
    }
}
