//! The functions a thin plate is a sum of: the affine ones that the positions can tell apart, and for
//! each site phi about it minus the combination of the *base sites'* phi that meets the side conditions.
//! Spaces of growing lists of sites are nested.

use super::super::b_spline::Point;
use super::kernel;

/// Relative width below which positions count as lying on a line: beyond, the factors of [`Base`] would
/// cost more digits than the width is worth.
const STRAIGHT: f64 = 1e-6;

/// Origin (middle of the bounding box) and scale (its longer side) that bring positions to unit extent;
/// scale 1 where all coincide.
pub(super) fn unit_frame(positions: &[Point]) -> (Point, f64) {
    let (mut low, mut high) = (positions[0], positions[0]);
    for p in positions {
        for axis in 0..2 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    let extent = (high[0] - low[0]).max(high[1] - low[1]);
    let origin = [
        low[0] + 0.5 * (high[0] - low[0]),
        low[1] + 0.5 * (high[1] - low[1]),
    ];
    (origin, if extent > 0.0 { extent } else { 1.0 })
}

/// Up to three of `positions` that span them well: the one farthest from their middle, the one farthest
/// from it, the one farthest from the line through both. Fewer where they lie on a line or at a point.
pub(super) fn spanning(positions: &[Point]) -> Vec<usize> {
    let farthest = |distance: &dyn Fn(Point) -> f64| {
        let mut best = (0, -1.0);
        for (i, &p) in positions.iter().enumerate() {
            let here = distance(p);
            if here > best.1 {
                best = (i, here);
            }
        }
        best
    };
    if positions.is_empty() {
        return Vec::new();
    }
    let (middle, scale) = unit_frame(positions);
    let first = farthest(&|p| square(p, middle)).0;
    let (second, apart) = farthest(&|p| square(p, positions[first]));
    if apart <= (STRAIGHT * scale) * (STRAIGHT * scale) {
        return vec![first];
    }
    let (third, area) = farthest(&|p| cross(positions[first], positions[second], p).abs());
    if area <= STRAIGHT * scale * apart.sqrt() {
        return vec![first, second];
    }
    vec![first, second, third]
}

/// Squared distance.
pub(super) fn square(a: Point, b: Point) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    x * x + y * y
}

/// Twice the signed area of the triangle a b c.
pub(super) fn cross(a: Point, b: Point, c: Point) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

/// One to three base sites and what the side conditions ask of them.
#[derive(Debug, Clone)]
pub(super) struct Base {
    /// The base sites.
    pub(super) sites: Vec<Point>,
    scale: f64,
}

impl Base {
    /// Base of one to three sites in general position.
    pub(super) fn new(sites: Vec<Point>, scale: f64) -> Self {
        Base { sites, scale }
    }

    /// Factors of the base sites that sum to 1 and average to `site` (on the line through them, where
    /// there are only two).
    pub(super) fn factors(&self, site: Point) -> Vec<f64> {
        match *self.sites {
            [a, b, c] => {
                let area = cross(a, b, c);
                let (u, v) = (cross(a, site, c) / area, cross(a, b, site) / area);
                vec![1.0 - u - v, u, v]
            }
            [a, b] => {
                let along = [b[0] - a[0], b[1] - a[1]];
                let u = ((site[0] - a[0]) * along[0] + (site[1] - a[1]) * along[1]) / square(a, b);
                vec![1.0 - u, u]
            }
            _ => vec![1.0],
        }
    }

    /// The basis function of `site` at each of `positions`.
    pub(super) fn column(&self, site: Point, positions: &[Point], column: &mut [f64]) {
        let factors = self.factors(site);
        let inverse = 1.0 / (self.scale * self.scale);
        for (p, value) in positions.iter().zip(column) {
            let mut sum = kernel(square(*p, site) * inverse);
            for (base, factor) in self.sites.iter().zip(&factors) {
                sum -= factor * kernel(square(*p, *base) * inverse);
            }
            *value = sum;
        }
    }
}

/// The directions of the affine part that `positions` can tell apart: none, the line's, or both axes.
pub(super) fn directions(positions: &[Point]) -> Vec<Point> {
    match *spanning(positions) {
        [a, b] => {
            let (from, to) = (positions[a], positions[b]);
            let length = square(from, to).sqrt();
            vec![[(to[0] - from[0]) / length, (to[1] - from[1]) / length]]
        }
        [_, _, _] => vec![[1.0, 0.0], [0.0, 1.0]],
        _ => Vec::new(),
    }
}
