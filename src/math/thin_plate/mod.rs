//! Thin-plate splines from the plane to R^m (CH12 §2.2, 3.2):
//!
//! ```text
//! g(p) = g_0 + sum_j phi(|s_j - p|) g_j + G p,   phi(r) = r^2 log r,   sum_j g_j = 0,  sum_j g_j s_j^T = 0
//! ```
//!
//! The side conditions leave l unknowns a coordinate for l sites and make the bending energy finite.
//! Positions are shifted and scaled to unit extent before phi: with the side conditions that changes
//! the coefficients and not the function. Sites all on one line (or at one point) have only the side
//! conditions, and g only the affine part, that exist there.

mod basis;
mod fit;
mod greedy;
mod merge;

use super::b_spline::Point;

pub use fit::fit;
pub use greedy::{Greedy, greedy};
pub use merge::{Merged, merge};

/// What a thin plate is fitted to: n positions, their targets (n rows of `width` numbers, one after
/// another) and, where given, n weights >= 0 on the squared errors. Rows need not be frames.
#[derive(Debug, Clone, Copy)]
pub struct Rows<'a> {
    /// Positions in the plane.
    pub positions: &'a [Point],
    /// Targets, row after row.
    pub targets: &'a [f64],
    /// m, the length of a target.
    pub width: usize,
    /// Weights of the squared errors; none: all 1.
    pub weights: Option<&'a [f64]>,
}

/// Why rows do not make a thin plate, or parts are not one. Indices count from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThinPlateError {
    /// There are no rows, or no sites.
    Empty,
    /// Targets or weights are not as many as the positions ask for.
    Counts,
    /// A position, target or weight is not finite, or a weight is negative.
    NotFinite {
        /// The row.
        row: usize,
    },
    /// A site is not finite.
    Site {
        /// Which one.
        index: usize,
    },
}

/// A thin-plate spline from the plane to R^m.
#[derive(Debug, Clone, PartialEq)]
pub struct ThinPlate {
    origin: Point,
    scale: f64,
    width: usize,
    sites: Vec<Point>,
    weights: Vec<f64>,
    affine: Vec<f64>,
}

impl ThinPlate {
    /// A thin plate of its parts: l `sites`, their coefficients (`weights`, l rows of m) and the affine
    /// part (three rows of m: constant, along the first axis, along the second), all for positions
    /// taken as (p - `origin`) / `scale`. The side conditions are the caller's to meet.
    ///
    /// # Errors
    /// Counts do not match, or a number is not finite.
    pub fn new(
        (origin, scale): (Point, f64),
        sites: Vec<Point>,
        weights: Vec<f64>,
        affine: Vec<f64>,
    ) -> Result<Self, ThinPlateError> {
        let width = affine.len() / 3;
        if affine.len() != 3 * width || weights.len() != sites.len() * width {
            return Err(ThinPlateError::Counts);
        }
        let numbers = origin.iter().chain(&weights).chain(&affine);
        if !numbers.chain([&scale]).all(|x| x.is_finite()) || scale <= 0.0 {
            return Err(ThinPlateError::Counts);
        }
        if let Some(index) = sites
            .iter()
            .position(|s| !s[0].is_finite() || !s[1].is_finite())
        {
            return Err(ThinPlateError::Site { index });
        }
        Ok(ThinPlate {
            origin,
            scale,
            width,
            sites,
            weights,
            affine,
        })
    }

    /// The thin plate that is `value` everywhere, without sites.
    pub fn constant(value: &[f64]) -> Self {
        let mut affine = value.to_vec();
        affine.resize(3 * value.len(), 0.0);
        ThinPlate {
            origin: [0.0; 2],
            scale: 1.0,
            width: value.len(),
            sites: Vec::new(),
            weights: Vec::new(),
            affine,
        }
    }

    /// m, the dimension of the values.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The l sites.
    pub fn sites(&self) -> &[Point] {
        &self.sites
    }

    /// What positions are taken relative to, and in units of.
    pub fn frame(&self) -> (Point, f64) {
        (self.origin, self.scale)
    }

    /// Coefficients of the sites, l rows of m.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The affine part, three rows of m: constant, along the first axis, along the second.
    pub fn affine(&self) -> &[f64] {
        &self.affine
    }

    /// Writes g(`p`), m numbers, to `value`. The sum over the sites is taken in their order with plain
    /// multiplications and additions: the same bits on every machine.
    ///
    /// # Panics
    /// `value` is not m long.
    pub fn evaluate(&self, p: Point, value: &mut [f64]) {
        let (x, y) = (
            (p[0] - self.origin[0]) / self.scale,
            (p[1] - self.origin[1]) / self.scale,
        );
        let (constant, linear) = self.affine.split_at(self.width);
        let (along, across) = linear.split_at(self.width);
        for (j, value) in value.iter_mut().enumerate() {
            *value = constant[j] + x * along[j] + y * across[j];
        }
        self.add_sites(p, value, |[_, _, square]| kernel(square));
    }

    /// Writes the derivatives of g at `p` along the two axes, two rows of m, to `rows`.
    ///
    /// # Panics
    /// `rows` is not 2m long.
    pub fn jacobian(&self, p: Point, rows: &mut [f64]) {
        rows.copy_from_slice(&self.affine[self.width..]);
        let (first, second) = rows.split_at_mut(self.width);
        self.add_sites(p, first, |[x, _, square]| x * kernel_slope(square));
        self.add_sites(p, second, |[_, y, square]| y * kernel_slope(square));
        rows.iter_mut().for_each(|x| *x /= self.scale);
    }

    /// Writes g(`p`) and its derivatives along the two axes at once: the same numbers as
    /// [`ThinPlate::evaluate`] and [`ThinPlate::jacobian`] give, for a third of the logarithms.
    ///
    /// # Panics
    /// `value` is not m long, or `rows` not 2m.
    pub fn evaluate_with_jacobian(&self, p: Point, value: &mut [f64], rows: &mut [f64]) {
        let width = self.width;
        assert_eq!(
            (value.len(), rows.len()),
            (width, 2 * width),
            "m numbers each"
        );
        let at = [0, 1].map(|axis| (p[axis] - self.origin[axis]) / self.scale);
        let (constant, linear) = self.affine.split_at(width);
        rows.copy_from_slice(linear);
        let (first, second) = rows.split_at_mut(width);
        for (j, value) in value.iter_mut().enumerate() {
            *value = constant[j] + at[0] * first[j] + at[1] * second[j];
        }
        if width == 0 {
            return;
        }
        for (site, weights) in self.sites.iter().zip(self.weights.chunks_exact(width)) {
            let [x, y] = [0, 1].map(|axis| (p[axis] - site[axis]) / self.scale);
            let square = x * x + y * y;
            if square == 0.0 {
                continue;
            }
            let log = libm::log(square);
            let (phi, slope) = (0.5 * square * log, log + 1.0);
            let (along, across) = (x * slope, y * slope);
            for (j, weight) in weights.iter().enumerate() {
                value[j] += phi * weight;
                first[j] += along * weight;
                second[j] += across * weight;
            }
        }
        rows.iter_mut().for_each(|x| *x /= self.scale);
    }

    /// Writes the second derivatives of g at `p`, three rows of m (11, 12, 22), to `rows`. At a site
    /// they are infinite; there that site's share is left out.
    ///
    /// # Panics
    /// `rows` is not 3m long.
    pub fn hessian(&self, p: Point, rows: &mut [f64]) {
        rows.fill(0.0);
        let (first, rest) = rows.split_at_mut(self.width);
        let (mixed, second) = rest.split_at_mut(self.width);
        self.add_sites(p, first, |[x, _, square]| curvature(square, x * x, true));
        self.add_sites(p, mixed, |[x, y, square]| curvature(square, x * y, false));
        self.add_sites(p, second, |[_, y, square]| curvature(square, y * y, true));
        let square = self.scale * self.scale;
        rows.iter_mut().for_each(|x| *x /= square);
    }

    /// The thin plate p -> A g(p) + b in R^m', for A given as m' rows of m and b of m' numbers. Side
    /// conditions and sites stay.
    ///
    /// # Panics
    /// `a` is not m' rows of m.
    #[must_use]
    pub fn map_values(&self, a: &[f64], b: &[f64]) -> Self {
        assert_eq!(a.len(), b.len() * self.width, "A must be m' rows of m");
        let mapped = |rows: &[f64], count: usize| -> Vec<f64> {
            let rows = (0..count).map(|i| &rows[i * self.width..(i + 1) * self.width]);
            rows.flat_map(|row| {
                (0..b.len()).map(move |i| {
                    let line = &a[i * self.width..(i + 1) * self.width];
                    line.iter().zip(row).map(|(a, g)| a * g).sum()
                })
            })
            .collect()
        };
        let mut affine = mapped(&self.affine, 3);
        affine.iter_mut().zip(b).for_each(|(g, b)| *g += b);
        ThinPlate {
            width: b.len(),
            weights: mapped(&self.weights, self.sites.len()),
            affine,
            sites: self.sites.clone(),
            ..*self
        }
    }

    /// Adds `factor` of (dx, dy, dx^2 + dy^2) to each site, times its coefficients, to `value`.
    fn add_sites(&self, p: Point, value: &mut [f64], factor: impl Fn([f64; 3]) -> f64) {
        if self.width == 0 {
            return;
        }
        for (site, weights) in self.sites.iter().zip(self.weights.chunks_exact(self.width)) {
            let x = (p[0] - site[0]) / self.scale;
            let y = (p[1] - site[1]) / self.scale;
            let factor = factor([x, y, x * x + y * y]);
            for (value, weight) in value.iter_mut().zip(weights) {
                *value += factor * weight;
            }
        }
    }
}

/// phi(r) = r^2 log r, of r^2.
fn kernel(square: f64) -> f64 {
    if square == 0.0 {
        0.0
    } else {
        0.5 * square * libm::log(square)
    }
}

/// phi'(r) / r = 2 log r + 1, of r^2; 0 at 0, where it is only used times a vanishing difference.
fn kernel_slope(square: f64) -> f64 {
    if square == 0.0 {
        0.0
    } else {
        libm::log(square) + 1.0
    }
}

/// Second derivative of phi for differences whose product is `product`: along one axis (`same`) or
/// mixed; 0 at the site itself.
fn curvature(square: f64, product: f64, same: bool) -> f64 {
    if square == 0.0 {
        return 0.0;
    }
    let slope = if same { kernel_slope(square) } else { 0.0 };
    slope + 2.0 * product / square
}

#[cfg(test)]
mod test_layouts {
    use super::*;

    /// size x size points, one apart.
    pub(super) fn grid(size: u32) -> Vec<Point> {
        (0..size * size)
            .map(|i| [f64::from(i % size), f64::from(i / size)])
            .collect()
    }

    /// n points along a spiral of three turns, radius 1.
    pub(super) fn spiral(n: usize) -> Vec<Point> {
        (0..n)
            .map(|i| {
                let (t, turn) = (i as f64 / n as f64, 19.0 * i as f64 / n as f64);
                [(0.2 + t) * libm::cos(turn), (0.2 + t) * libm::sin(turn)]
            })
            .collect()
    }

    /// g(p) as a vector.
    pub(super) fn evaluate(plate: &ThinPlate, p: Point) -> Vec<f64> {
        let mut value = vec![0.0; plate.width()];
        plate.evaluate(p, &mut value);
        value
    }
}

#[cfg(test)]
mod tests {
    use super::test_layouts::{evaluate, spiral};
    use super::*;

    fn plate(scale: f64) -> ThinPlate {
        let positions: Vec<Point> = spiral(40).iter().map(|p| p.map(|x| x * scale)).collect();
        let targets: Vec<f64> = (0..40)
            .flat_map(|i| [libm::sin(f64::from(i) / 6.0), libm::cos(f64::from(i) / 3.0)])
            .collect();
        let rows = Rows {
            positions: &positions,
            targets: &targets,
            width: 2,
            weights: None,
        };
        fit(&rows, &positions[..25]).unwrap()
    }

    /// Central difference of `rows` numbers along an axis.
    fn difference(at: impl Fn(Point) -> Vec<f64>, p: Point, axis: usize, h: f64) -> Vec<f64> {
        let (mut before, mut after) = (p, p);
        before[axis] -= h;
        after[axis] += h;
        at(after)
            .iter()
            .zip(at(before))
            .map(|(b, a)| (b - a) / (2.0 * h))
            .collect()
    }

    #[test]
    fn derivatives_match_central_differences() {
        for scale in [1.0, 1e3, 1e-3] {
            let plate = plate(scale);
            let jacobian = |p: Point| {
                let mut rows = vec![0.0; 4];
                plate.jacobian(p, &mut rows);
                rows
            };
            let p = [0.31 * scale, -0.22 * scale];
            let h = 1e-5 * scale;
            let mut hessian = vec![0.0; 6];
            plate.hessian(p, &mut hessian);
            let rows = jacobian(p);
            for axis in 0..2 {
                let slope = difference(|p| evaluate(&plate, p), p, axis, h);
                let bend = difference(jacobian, p, axis, h);
                let size = rows.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                let bends = hessian.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                for j in 0..2 {
                    // truncation (h / distance to a site)^2, rounding 1e-16 / 1e-5
                    assert!((slope[j] - rows[2 * axis + j]).abs() < 1e-7 * size);
                    assert!((bend[j] - hessian[2 * axis + j]).abs() < 1e-6 * bends);
                    assert!((bend[2 + j] - hessian[2 * axis + 2 + j]).abs() < 1e-6 * bends);
                }
            }
        }
    }

    #[test]
    fn value_and_derivatives_at_once_are_the_same_bits() {
        let plate = plate(3.0);
        for p in [[0.31, -0.22], plate.sites()[4], [5.0, 7.0]] {
            let (mut value, mut rows, mut alone) = ([0.0; 2], [0.0; 4], [0.0; 4]);
            plate.evaluate_with_jacobian(p, &mut value, &mut rows);
            plate.jacobian(p, &mut alone);
            assert_eq!((value.to_vec(), rows), (evaluate(&plate, p), alone));
        }
    }

    #[test]
    fn the_slope_at_a_site_exists() {
        let plate = plate(1.0);
        let mut rows = [0.0; 4];
        plate.jacobian(plate.sites()[7], &mut rows);
        let near = difference(|p| evaluate(&plate, p), plate.sites()[7], 0, 1e-6);
        // there the second derivative grows as log r
        assert!((rows[0] - near[0]).abs() < 1e-3);
    }

    #[test]
    fn far_away_it_is_affine_to_first_order() {
        let plate = plate(1.0);
        let mut rows = [0.0; 6];
        plate.hessian([1e6, 2e6], &mut rows);
        // with the side conditions second derivatives fall as 1/r^2
        assert!(rows.iter().all(|x| x.abs() < 1e-7));
    }

    #[test]
    fn mapping_the_values_maps_every_value_and_keeps_the_sites() {
        let plate = plate(1.0);
        let (a, b) = ([1.0, 2.0, -3.0, 0.5, 0.0, 4.0], [7.0, 8.0, 9.0]);
        let mapped = plate.map_values(&a, &b);
        assert_eq!(mapped.sites(), plate.sites());
        for p in [[0.1, 0.9], [-3.0, 2.0]] {
            let (x, y) = (evaluate(&plate, p), evaluate(&mapped, p));
            for i in 0..3 {
                let expected = a[2 * i] * x[0] + a[2 * i + 1] * x[1] + b[i];
                assert!((y[i] - expected).abs() < 1e-11 * (1.0 + expected.abs()));
            }
        }
        assert_eq!(mapped.map_values(&[], &[]).width(), 0);
    }

    #[test]
    fn parts_that_do_not_fit_are_refused() {
        let parts = |weights: Vec<f64>, affine: Vec<f64>, scale: f64| {
            ThinPlate::new(([0.0; 2], scale), vec![[0.0; 2]], weights, affine).map(|_| ())
        };
        assert_eq!(parts(vec![1.0], vec![0.0; 3], 1.0), Ok(()));
        assert_eq!(
            parts(vec![1.0; 2], vec![0.0; 3], 1.0),
            Err(ThinPlateError::Counts)
        );
        assert_eq!(
            parts(vec![1.0], vec![0.0; 4], 1.0),
            Err(ThinPlateError::Counts)
        );
        assert_eq!(
            parts(vec![1.0], vec![0.0; 3], 0.0),
            Err(ThinPlateError::Counts)
        );
        assert_eq!(
            parts(vec![f64::NAN], vec![0.0; 3], 1.0),
            Err(ThinPlateError::Counts)
        );
    }
}
