//! What a fit in a shape space is worth in vertex positions: errors in different spaces' coordinates
//! cannot be compared, these can.

use rayon::prelude::*;

use super::Loom;
use crate::diag::Result;
use crate::math::pca::Rows;
use crate::task::Task;

/// sqrt(sum |v - w|^2) / sqrt(sum |v - mean|^2) over all frames and vertices, where v are the frames
/// without their root motion and w what the loom gives there; 0 where nothing moves.
///
/// # Errors
/// The task was cancelled.
pub fn relative(loom: &Loom, frames: &dyn Rows, task: &Task) -> Result<f64> {
    let (n, columns) = (frames.rows(), frames.columns());
    let read = |frame: usize| {
        let mut row = vec![0.0; columns];
        frames.copy(frame, 0..columns, &mut row);
        row
    };
    let mut mean = vec![0.0; columns];
    for frame in 0..n {
        task.check()?;
        let row = read(frame);
        mean.iter_mut()
            .zip(row)
            .for_each(|(mean, x)| *mean += x / n as f64);
    }
    let squares = (0..n)
        .into_par_iter()
        .map(|frame| {
            task.check()?;
            let row = read(frame);
            let found = loom.pose_at(loom.position_at((frame + 1) as f64)?)?;
            let error = row
                .iter()
                .zip(&found)
                .map(|(x, y)| (x - f64::from(*y)).powi(2));
            let spread = row.iter().zip(&mean).map(|(x, mean)| (x - mean).powi(2));
            Ok((error.sum::<f64>(), spread.sum::<f64>()))
        })
        .collect::<Result<Vec<(f64, f64)>>>()?;
    let error: f64 = squares.iter().map(|(error, _)| error).sum();
    let spread: f64 = squares.iter().map(|(_, spread)| spread).sum();
    Ok(if spread > 0.0 {
        (error / spread).sqrt()
    } else {
        0.0
    })
}
