//! How the columns of long rows are cut, so that sums run in an order of their own and pieces stay in the
//! cache.

use std::ops::Range;

use faer::{Mat, MatMut};
use rayon::prelude::*;

use super::PcaError;
use crate::task::Task;

/// A panel holds about this many numbers: 2 MB stay in the second-level cache.
const PANEL: usize = 1 << 18;

/// Panels are a multiple of this many columns: whole vectors of three, whole cache lines.
const COLUMN_STEP: usize = 192;

/// The groups' partial sums together hold at most this many numbers (16 MB).
const PARTIAL_SUMS: usize = 1 << 21;

/// How d columns are cut into panels and the panels into groups; both depend on the sizes alone.
pub(super) struct Panels {
    columns: usize,
    /// Columns of a panel, but for the last.
    pub(super) width: usize,
}

impl Panels {
    /// For panels of `rows` columns beside others of `beside` columns.
    pub(super) fn of(rows: usize, columns: usize, beside: usize) -> Self {
        let width = PANEL / (rows + beside).max(1) / COLUMN_STEP * COLUMN_STEP;
        Panels {
            columns,
            width: width.clamp(COLUMN_STEP, 32 * COLUMN_STEP),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.columns.div_ceil(self.width)
    }

    pub(super) fn range(&self, panel: usize) -> Range<usize> {
        panel * self.width..((panel + 1) * self.width).min(self.columns)
    }

    /// The sum of what `add` adds to a matrix of zeros for each panel.
    pub(super) fn sum(
        &self,
        task: &Task,
        rows: usize,
        columns: usize,
        add: impl Fn(Range<usize>, MatMut<'_, f64>, &mut Vec<f64>) + Sync,
    ) -> Result<Mat<f64>, PcaError> {
        let groups = (PARTIAL_SUMS / (rows * columns).max(1)).clamp(2, 16);
        let group = |first: usize| {
            let mut sum = Mat::zeros(rows, columns);
            let mut buffer = Vec::new();
            for panel in (first..self.count()).step_by(groups) {
                task.check()?;
                add(self.range(panel), sum.as_mut(), &mut buffer);
            }
            Ok(sum)
        };
        let sums: Result<Vec<Mat<f64>>, PcaError> = (0..groups.min(self.count()))
            .into_par_iter()
            .map(group)
            .collect();
        let add = |mut total: Mat<f64>, part: Mat<f64>| {
            total += part;
            total
        };
        Ok(sums?
            .into_iter()
            .reduce(add)
            .unwrap_or_else(|| Mat::zeros(rows, columns)))
    }

    /// Lets `act` work on the rows of `target` that belong to each panel.
    pub(super) fn each(
        &self,
        target: MatMut<'_, f64>,
        task: &Task,
        act: impl Fn(Range<usize>, MatMut<'_, f64>, &mut Vec<f64>) + Sync,
    ) -> Result<(), PcaError> {
        target
            .par_row_chunks_mut(self.width)
            .enumerate()
            .try_for_each_init(Vec::new, |buffer, (panel, part)| {
                task.check()?;
                act(self.range(panel), part, buffer);
                Ok(())
            })
    }
}
