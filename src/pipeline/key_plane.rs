//! The plane in which a motion's keys lie farthest apart: the two leading principal components of their
//! coordinates (X19 Fig. 2b).

use crate::diag::{Diagnostic, Result};
use crate::inbetween::Motion;
use crate::math::pca::{Pca, PcaError, Table};
use crate::task::Task;

/// Where keys lie, and how to get from the space to the plane and back.
#[derive(Debug, Clone)]
pub(super) struct KeyPlane {
    /// The mean of the keys' coordinates, d numbers.
    mean: Vec<f64>,
    /// The directions of the plane, d numbers each; none where keys do not differ.
    axes: Vec<Vec<f64>>,
    /// Where each key lies along all components, from the mean: rows of `width`.
    rows: Vec<f64>,
    /// How many components there are, at least two.
    width: usize,
    /// The share of the keys' spread that the plane shows, in \[0, 1\]; 1 for keys that are one shape.
    pub(super) share: f64,
}

impl KeyPlane {
    /// The plane of the keys of `motion`. Two keys lie on a line; keys that are one shape at the origin.
    ///
    /// # Errors
    /// Coordinates that are not finite; cancellation.
    pub(super) fn of(motion: &Motion, task: &Task) -> Result<Self> {
        let spline = motion.spline();
        let (times, d) = (spline.times(), spline.width());
        let mut codes = vec![0.0; times.len() * d];
        for (time, code) in times.iter().zip(codes.chunks_exact_mut(d.max(1))) {
            spline.evaluate(*time, code);
        }
        let table = Table::new(&codes, d);
        let pca = Pca::new(&table, task).map_err(told)?;
        let modes = pca.resolved().min(times.len().saturating_sub(1));
        let basis = pca.basis(&table, modes, task).map_err(told)?;
        let width = basis.modes.max(2);
        let mut rows = vec![0.0; times.len() * width];
        let known = basis.coordinates.chunks_exact(basis.modes.max(1));
        for (row, known) in rows.chunks_exact_mut(width).zip(known) {
            row[..known.len()].copy_from_slice(known);
        }
        let all: f64 = rows.iter().map(|x| x * x).sum();
        let plane = rows.chunks_exact(width).flat_map(|row| &row[..2]);
        let shown: f64 = plane.map(|x| x * x).sum();
        let axes = basis.vectors.chunks_exact(d.max(1)).take(2);
        Ok(KeyPlane {
            mean: pca.mean().to_vec(),
            axes: axes.map(<[f64]>::to_vec).collect(),
            rows,
            width,
            share: if all > 0.0 { shown / all } else { 1.0 },
        })
    }

    /// Where each key lies along all components: n rows of [`KeyPlane::width`] numbers.
    pub(super) fn rows(&self) -> &[f64] {
        &self.rows
    }

    /// How many components the rows have, at least two.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Where key `index` (from 0) lies.
    pub(super) fn key(&self, index: usize) -> [f64; 2] {
        [0, 1].map(|axis| self.rows[index * self.width + axis])
    }

    /// Where all keys lie.
    pub(super) fn keys(&self) -> Vec<[f64; 2]> {
        (0..self.rows.len() / self.width)
            .map(|key| self.key(key))
            .collect()
    }

    /// Where coordinates of the space lie.
    pub(super) fn place(&self, code: &[f64]) -> [f64; 2] {
        let centred = || code.iter().zip(&self.mean).map(|(z, mean)| z - mean);
        [0, 1].map(|axis| {
            let along = self.axes.get(axis).map_or(&[][..], Vec::as_slice);
            centred().zip(along).map(|(z, h)| z * h).sum()
        })
    }

    /// The plane's part of a direction of the space.
    pub(super) fn direction(&self, along: &[f64]) -> [f64; 2] {
        [0, 1].map(|axis| {
            let own = self.axes.get(axis).map_or(&[][..], Vec::as_slice);
            along.iter().zip(own).map(|(z, h)| z * h).sum()
        })
    }

    /// The coordinates of a point of the plane.
    pub(super) fn code(&self, place: [f64; 2]) -> Vec<f64> {
        let mut code = self.mean.clone();
        for (along, amount) in self.axes.iter().zip(place) {
            for (x, h) in code.iter_mut().zip(along) {
                *x += amount * h;
            }
        }
        code
    }
}

fn told(error: PcaError) -> Box<Diagnostic> {
    match error {
        PcaError::Cancelled => crate::task::Cancelled.into(),
        _ => Box::new(Diagnostic::error("the keys' coordinates are not finite")),
    }
}
