//! Weighted metric scaling in the plane: points p_i that minimise the stress
//!
//! ```text
//! sum_(i<j) w_ij (|p_i - p_j| - D_ij)^2
//! ```
//!
//! by SMACOF (de Leeuw 1977): p <- V^+ B(p) p, V the weights' Laplacian, inverted once. Points that
//! are pinned stay; the others follow from the block of V that is theirs.

use faer::linalg::solvers::DenseSolveCore;
use faer::{Mat, MatRef, Side};

/// D, the weights and the inverse of V.
pub struct WeightedStress {
    /// w, n x n.
    weights: Mat<f64>,
    /// w o D, n x n.
    pulls: Mat<f64>,
    /// Inverse of the free block of V (of V + 11^T/n when nothing is pinned).
    inverse: Mat<f64>,
    /// -V between free and pinned points, f x q.
    coupling: Mat<f64>,
    free: Vec<usize>,
    pinned: Vec<usize>,
    constant: f64,
}

impl WeightedStress {
    /// For `targets` D (n x n, symmetric, >= 0) with weights 1/(D + `softening` max D)^2, so that
    /// short distances count relatively; the points `pinned` (indices) will not move.
    pub fn relative(targets: MatRef<'_, f64>, softening: f64, pinned: &[usize]) -> Self {
        let count = targets.nrows();
        let soft = softening * targets.norm_max().max(f64::MIN_POSITIVE);
        let weights = Mat::from_fn(count, count, |i, j| {
            let near = targets[(i, j)] + soft;
            if i == j { 0.0 } else { 1.0 / (near * near) }
        });
        // Scaled to a mean of 1, which no minimiser notices.
        let mean = weights.sum() / ((count * count.max(2) - count).max(1) as f64);
        let weights = weights * faer::Scale(1.0 / mean);
        let pulls = Mat::from_fn(count, count, |i, j| weights[(i, j)] * targets[(i, j)]);
        let constant = (0..count)
            .flat_map(|j| (0..j).map(move |i| (i, j)))
            .map(|at| pulls[at] * targets[at])
            .sum();
        let free: Vec<usize> = (0..count).filter(|i| !pinned.contains(i)).collect();
        WeightedStress {
            inverse: inverse(weights.as_ref(), &free, pinned.is_empty()),
            coupling: Mat::from_fn(free.len(), pinned.len(), |i, q| {
                weights[(free[i], pinned[q])]
            }),
            weights,
            pulls,
            free,
            pinned: pinned.to_vec(),
            constant,
        }
    }

    /// At most `iterations` steps from `points` (n x 2), until the stress decreases by less than
    /// `decrease` relatively. Returns how many were taken.
    pub fn minimise(&self, points: &mut Mat<f64>, iterations: usize, decrease: f64) -> usize {
        let mut images = Mat::zeros(points.nrows(), 2);
        let mut last = f64::INFINITY;
        for step in 0..iterations {
            let stress = self.transform(points, &mut images);
            if last - stress < decrease * last && step > 5 {
                return step;
            }
            last = stress;
            self.follow(&images, points);
        }
        iterations
    }

    /// Writes B(p) p to `images`; returns the stress of p.
    fn transform(&self, points: &Mat<f64>, images: &mut Mat<f64>) -> f64 {
        let (x, y) = (points.col_as_slice(0), points.col_as_slice(1));
        let simd = pulp::Arch::new();
        let mut stress = 0.0;
        for i in 0..points.nrows() {
            let (weights, pulls) = (self.weights.col_as_slice(i), self.pulls.col_as_slice(i));
            let sums = simd.dispatch(|| row_sums(x, y, [x[i], y[i]], weights, pulls));
            images[(i, 0)] = sums[0];
            images[(i, 1)] = sums[1];
            stress += sums[2];
        }
        // Each pair was met twice; row sums hold w d^2 - 2 w D d.
        0.5 * stress + self.constant
    }

    /// p <- V^+ (B(p) p + what the pinned points hold).
    fn follow(&self, images: &Mat<f64>, points: &mut Mat<f64>) {
        let right = Mat::from_fn(self.free.len(), 2, |i, a| images[(self.free[i], a)]);
        let held = Mat::from_fn(self.pinned.len(), 2, |q, a| points[(self.pinned[q], a)]);
        let moved = &self.inverse * (right + &self.coupling * held);
        for (i, &point) in self.free.iter().enumerate() {
            points[(point, 0)] = moved[(i, 0)];
            points[(point, 1)] = moved[(i, 1)];
        }
    }
}

/// Sums over j of w D / d (p_i - p_j) (two numbers) and w d^2 - 2 w D d, in eight fixed lanes.
#[inline(always)]
fn row_sums(x: &[f64], y: &[f64], at: [f64; 2], weights: &[f64], pulls: &[f64]) -> [f64; 3] {
    const LANES: usize = 8;
    let mut sums = [[0.0; LANES]; 3];
    let mut add = |lane: usize, x: f64, y: f64, weight: f64, pull: f64| {
        let (dx, dy) = (at[0] - x, at[1] - y);
        let distance = (dx * dx + dy * dy).sqrt();
        let ratio = pull / distance.max(1e-150);
        sums[0][lane] += ratio * dx;
        sums[1][lane] += ratio * dy;
        sums[2][lane] += distance * (weight * distance - 2.0 * pull);
    };
    let whole = x.len() / LANES * LANES;
    for start in (0..whole).step_by(LANES) {
        let end = start + LANES;
        let (x, y) = (&x[start..end], &y[start..end]);
        let (weights, pulls) = (&weights[start..end], &pulls[start..end]);
        for lane in 0..LANES {
            add(lane, x[lane], y[lane], weights[lane], pulls[lane]);
        }
    }
    for j in whole..x.len() {
        add(j - whole, x[j], y[j], weights[j], pulls[j]);
    }
    sums.map(|lanes| lanes.iter().sum())
}

/// Inverse of the free block of V; of V + 11^T/n, minus 11^T/n, when all points are free.
fn inverse(weights: MatRef<'_, f64>, free: &[usize], all: bool) -> Mat<f64> {
    let (count, n) = (free.len(), weights.nrows() as f64);
    let lift = if all { 1.0 / n } else { 0.0 };
    let laplacian = Mat::from_fn(count, count, |i, j| {
        let (i, j) = (free[i], free[j]);
        let degree = if i == j { weights.col(i).sum() } else { 0.0 };
        degree - weights[(i, j)] + lift
    });
    match laplacian.llt(Side::Lower) {
        Ok(factor) => {
            let inverse = factor.inverse();
            Mat::from_fn(count, count, |i, j| inverse[(i, j)] - lift)
        }
        Err(_) => Mat::zeros(count, count),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::order_graph::distances;

    /// Twelve points spread over the plane, and the same ones disturbed.
    fn plane(scale: f64) -> (Mat<f64>, Mat<f64>) {
        let at = |i: usize, a: usize| scale * ((i * i) as f64 * [0.7, 1.1][a]).sin();
        let near = |i: usize, a: usize| at(i, a) + scale * 0.1 * ((i + 3 * a) as f64).cos();
        (Mat::from_fn(12, 2, at), Mat::from_fn(12, 2, near))
    }

    #[test]
    fn distances_of_the_plane_are_met_at_any_scale() {
        for scale in [1e-8, 1.0, 1e8] {
            let (known, mut points) = plane(scale);
            let targets = distances(known.as_ref());
            let stress = WeightedStress::relative(targets.as_ref(), 0.02, &[]);
            stress.minimise(&mut points, 2000, 0.0);
            let error = (distances(points.as_ref()) - &targets).norm_max();
            // Linear convergence; 2000 steps leave about 1e-8.
            assert!(error < 1e-5 * scale, "{error}");
        }
    }

    #[test]
    fn the_stress_never_grows() {
        let (known, mut points) = plane(1.0);
        let targets = distances(known.as_ref());
        let stretched = Mat::from_fn(12, 12, |i, j| targets[(i, j)].powf(0.7));
        let stress = WeightedStress::relative(stretched.as_ref(), 0.02, &[2]);
        let mut images = Mat::zeros(12, 2);
        let mut last = stress.transform(&points, &mut images);
        for _ in 0..50 {
            stress.minimise(&mut points, 1, 0.0);
            let now = stress.transform(&points, &mut images);
            assert!(now <= last * (1.0 + 1e-12), "{now} after {last}");
            last = now;
        }
    }

    #[test]
    fn pinned_points_stay_and_the_others_come_to_them() {
        let (known, mut points) = plane(1.0);
        let turned = Mat::from_fn(12, 2, |i, a| [-known[(i, 1)] + 5.0, known[(i, 0)]][a]);
        let targets = distances(known.as_ref());
        for pin in [0, 4, 7] {
            points[(pin, 0)] = turned[(pin, 0)];
            points[(pin, 1)] = turned[(pin, 1)];
        }
        let stress = WeightedStress::relative(targets.as_ref(), 0.02, &[0, 4, 7]);
        stress.minimise(&mut points, 3000, 0.0);
        for pin in [0, 4, 7] {
            assert_eq!(points[(pin, 0)], turned[(pin, 0)]);
        }
        assert!((points - turned).norm_max() < 1e-5);
    }
}
