//! How far the frames of a loom can reach, without evaluating them: what a damaged file shows first.

use nalgebra::Vector3;

use super::Loom;
use crate::diag::Result;

/// Farther than this nothing is decoded: single precision ends at 3.4e38, and spaces multiply coordinates
/// with lengths.
pub(super) const FARTHEST: f64 = 1e30;

/// A bound on the coordinates in S of all frames, and on their root motion: |h_0| + sum_j |h_j| max_i |x_ij|.
/// Infinite or not a number where a frame is. Costs as much as one frame and n evaluations of g.
///
/// # Errors
/// The time signal has no place for a frame.
pub(super) fn bound(loom: &Loom) -> Result<f64> {
    let mut farthest = vec![0.0; loom.shape().modes()];
    for frame in 1..=loom.frames() {
        let x = loom.coordinates_at(frame as f64)?;
        for (most, x) in farthest.iter_mut().zip(x) {
            *most = larger(*most, x.abs());
        }
    }
    let mut reach: Vec<f64> = loom.shape().offset().iter().map(|z| z.abs()).collect();
    for (mode, most) in farthest.iter().enumerate() {
        for (reach, h) in reach.iter_mut().zip(loom.shape().vector(mode)) {
            *reach += h.abs() * most;
        }
    }
    let root = loom.root().map_or(0.0, |root| {
        let far = root.frames().iter().map(|frame| length(&frame.position));
        length(&root.pivot()) + far.fold(0.0, larger)
    });
    Ok(reach.into_iter().fold(0.0, larger) + root)
}

fn length(v: &Vector3<f64>) -> f64 {
    v.amax()
}

/// The larger of two; not a number where one is not.
fn larger(a: f64, b: f64) -> f64 {
    match a.is_nan() || b.is_nan() {
        true => f64::NAN,
        false => a.max(b),
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::super::test_looms::{ring, travelling};
    use super::super::{Loom, Parts};
    use super::*;
    use crate::signal::shape::ShapeSignal;

    #[test]
    fn no_frame_reaches_beyond_the_bound() {
        for loom in [ring(7, 9, false), travelling(9, 12)] {
            let bound = bound(&loom).unwrap();
            for frame in 1..=loom.frames() {
                let z = loom.shape_at(frame as f64).unwrap();
                assert!(z.iter().all(|z| z.abs() <= bound));
            }
            assert!(bound < 1e3, "{bound}");
        }
    }

    #[test]
    fn one_number_too_large_is_seen() {
        let loom = ring(7, 9, false);
        let shape = loom.shape();
        for large in [1e40, 1e300, f64::MAX] {
            let mut vectors = shape.vectors().to_vec();
            vectors[5] = large;
            let shape = ShapeSignal::new(shape.offset().to_vec(), vectors, shape.modes());
            let loom = Loom::new(Parts {
                shape: Arc::new(shape.unwrap()),
                ..loom.parts()
            });
            assert!(bound(&loom.unwrap()).unwrap() > FARTHEST);
        }
    }
}
