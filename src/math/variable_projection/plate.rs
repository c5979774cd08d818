//! Thin-plate splines of many coordinates as matrices, evaluated at many points at once.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

/// g(p) = sum_j phi(|p - s_j|) w_j + G \[1, p\], phi(r) = r^2 log r, from the plane to R^m.
#[derive(Debug, Clone)]
pub struct Plate {
    /// The sites s_j, l x 2.
    pub sites: Mat<f64>,
    /// The coefficients w_j, l x m, with sum w_j = 0 and sum w_j s_j^T = 0.
    pub weights: Mat<f64>,
    /// Constant, dg/dx and dg/dy of the affine part, 3 x m.
    pub affine: Mat<f64>,
}

impl Plate {
    /// The plate 0 over l sites at the origin, with m coordinates.
    pub fn zero(sites: usize, width: usize) -> Self {
        Plate {
            sites: Mat::zeros(sites, 2),
            weights: Mat::zeros(sites, width),
            affine: Mat::zeros(3, width),
        }
    }

    /// g at `points` (N x 2), N x m.
    pub fn at(&self, points: MatRef<'_, f64>) -> Mat<f64> {
        let (count, sites) = (points.nrows(), self.sites.nrows());
        let mut kernel = Mat::zeros(count, sites);
        for j in 0..sites {
            let (x, y) = (self.sites[(j, 0)], self.sites[(j, 1)]);
            for (i, value) in kernel.col_as_slice_mut(j).iter_mut().enumerate() {
                *value = phi(points[(i, 0)] - x, points[(i, 1)] - y);
            }
        }
        let mut values = Mat::from_fn(count, self.affine.ncols(), |i, c| {
            self.affine[(0, c)]
                + self.affine[(1, c)] * points[(i, 0)]
                + self.affine[(2, c)] * points[(i, 1)]
        });
        let weights = self.weights.as_ref();
        matmul(
            values.as_mut(),
            Accum::Add,
            kernel.as_ref(),
            weights,
            1.0,
            Par::Seq,
        );
        values
    }
}

/// r^2 log r of the offset (dx, dy); 0 at its limit r = 0.
fn phi(dx: f64, dy: f64) -> f64 {
    let squared = dx * dx + dy * dy;
    0.5 * squared * libm::log(squared.max(1e-300))
}
