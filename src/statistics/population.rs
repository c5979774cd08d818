//! Shapes as points of a linear space: their mean, and the directions in which they differ most.

use super::Ground;
use crate::diag::{Diagnostic, Result};
use crate::math::pca::{Basis, Pca, PcaError, Table};
use crate::task::{Cancelled, Task};

/// The principal components of n shapes. Copies of one shape have no modes.
#[derive(Debug, Clone)]
pub struct Population {
    mean: Vec<f64>,
    basis: Basis,
    /// Singular values of the modes over the root of n - 1.
    sigmas: Vec<f64>,
    explained: Vec<f64>,
    /// n.
    shapes: usize,
}

impl Population {
    /// All modes that the shapes have, at most n - 1, largest first.
    ///
    /// # Errors
    /// A shape has numbers that are not finite; cancellation.
    pub fn new(ground: &Ground, shapes: &[Vec<f64>], task: &Task) -> Result<Self> {
        let mut rows = Vec::with_capacity(shapes.len() * ground.dimension());
        for shape in shapes {
            task.check()?;
            rows.extend(ground.encode(shape));
            task.step();
        }
        let table = Table::new(&rows, ground.dimension());
        let pca = Pca::new(&table, task).or_else(told)?;
        let modes = pca.resolved().min(shapes.len().saturating_sub(1));
        let basis = pca.basis(&table, modes, task).or_else(told)?;
        let free = (shapes.len().saturating_sub(1)).max(1) as f64;
        let singular = pca.singular_values().iter().take(basis.modes);
        let all = pca.spread() * pca.spread();
        Ok(Population {
            sigmas: singular.clone().map(|value| value / free.sqrt()).collect(),
            explained: singular.map(|value| value * value / all).collect(),
            mean: pca.mean().to_vec(),
            shapes: shapes.len(),
            basis,
        })
    }

    /// How many modes there are.
    pub fn modes(&self) -> usize {
        self.basis.modes
    }

    /// The coordinates of the mean, d numbers.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The standard deviation along each mode.
    pub fn sigmas(&self) -> &[f64] {
        &self.sigmas
    }

    /// The share of each mode in the variance; together 1.
    pub fn explained(&self) -> &[f64] {
        &self.explained
    }

    /// How far shape `index` (from 0) lies along each mode.
    pub fn coordinates(&self, index: usize) -> &[f64] {
        let modes = self.basis.modes;
        &self.basis.coordinates[index * modes..(index + 1) * modes]
    }

    /// The weights of the shapes in the point that lies `along` the first modes from the mean: it is the sum
    /// of their coordinates with these. They sum to 1.
    pub fn weights(&self, along: &[f64]) -> Vec<f64> {
        let modes = self.modes();
        let rows = self.basis.coordinates.chunks_exact(modes.max(1));
        let count = self.shapes as f64;
        let mut weights = vec![1.0 / count; self.shapes];
        for (weight, row) in weights.iter_mut().zip(rows) {
            // sigma^2 (n - 1) is the sum of the mode's squared coordinates
            let each = row.iter().zip(along).zip(&self.sigmas);
            *weight += each
                .map(|((x, amount), sigma)| x * amount / (sigma * sigma * (count - 1.0).max(1.0)))
                .sum::<f64>();
        }
        weights
    }

    /// The coordinates in the space of the point that lies `along` the first modes from the mean.
    pub fn at(&self, along: &[f64]) -> Vec<f64> {
        let mut code = self.mean.clone();
        let modes = self.basis.vectors.chunks_exact(self.mean.len().max(1));
        for (vector, amount) in modes.zip(along) {
            for (x, h) in code.iter_mut().zip(vector) {
                *x += amount * h;
            }
        }
        code
    }

    /// The point `sigmas` standard deviations along one mode, counted from 0, as [`Population::at`] takes
    /// it; the mean where there is no such mode.
    pub fn along(&self, mode: usize, sigmas: f64) -> Vec<f64> {
        let mut along = vec![0.0; self.modes()];
        if let Some(amount) = along.get_mut(mode) {
            *amount = sigmas * self.sigmas[mode];
        }
        along
    }
}

fn told<T>(error: PcaError) -> Result<T> {
    match error {
        PcaError::Cancelled => Err(Cancelled.into()),
        PcaError::NotFinite => Diagnostic::error("the shapes have numbers that are not finite")
            .hint("leave such a pose out")
            .err(),
    }
}
