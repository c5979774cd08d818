//! g, the pose signal (CH12 §2.2, 3.2): pose space R^2 -> shape subspace R^m, a thin-plate spline.
//!
//! Fitted as in CH12, its sites are positions of frames, chosen in a nested greedy order; a fit with
//! free sites names no frames.

use crate::math::b_spline::Point;
use crate::math::thin_plate::{self, Rows, ThinPlate, ThinPlateError};

/// Positions closer than this part of the layout's diameter are one site with the mean target.
pub const COINCIDENT: f64 = 1e-4;

/// The pose signal: a thin-plate spline and, where its sites are frames, which.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseSignal {
    plate: ThinPlate,
    site_frames: Vec<usize>,
}

/// What is known after a fit of the pose signal.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseFit {
    /// The signal.
    pub signal: PoseSignal,
    /// How many distinct positions there are: the most sites that can be used.
    pub distinct: usize,
    /// Largest distance of a target from the mean of those merged with it: what exactness can reach.
    pub spread: f64,
    /// Sum of squared errors (4) over the merged rows for each number of sites from 1 on, never rising.
    pub errors: Vec<f64>,
}

impl PoseSignal {
    /// A pose signal of a thin plate; `site_frames` names the frame (from 0) at each site, or is empty
    /// where sites are free.
    ///
    /// # Errors
    /// There are frames for some sites only.
    pub fn new(plate: ThinPlate, site_frames: Vec<usize>) -> Result<Self, ThinPlateError> {
        if !site_frames.is_empty() && site_frames.len() != plate.sites().len() {
            return Err(ThinPlateError::Counts);
        }
        Ok(PoseSignal { plate, site_frames })
    }

    /// Fits `rows` with up to `sites` sites in the greedy order of CH12 §3.2.2, coincident positions
    /// merged; more than there are distinct positions are clamped to those.
    ///
    /// # Errors
    /// No rows; counts that do not match; numbers that are not finite.
    pub fn fit(rows: &Rows<'_>, sites: usize) -> Result<PoseFit, ThinPlateError> {
        let merged = thin_plate::merge(rows, COINCIDENT)?;
        let all = merged.rows();
        let greedy = thin_plate::greedy(&all, sites)?;
        let first = |&row: &usize| merged.of.iter().position(|&of| of == row).unwrap_or(row);
        let plate = greedy.fit(sites);
        let chosen = &greedy.order()[..plate.sites().len()];
        let site_frames = chosen.iter().map(first).collect();
        Ok(PoseFit {
            signal: PoseSignal { plate, site_frames },
            distinct: merged.positions.len(),
            spread: merged.spread,
            errors: greedy.errors().to_vec(),
        })
    }

    /// Fits `rows` again with the sites kept at the same frames, whose positions may have moved: what
    /// dragging a pin needs. A site whose position now coincides with another's adds nothing.
    ///
    /// # Errors
    /// As [`PoseSignal::fit`]; no site of this signal is a frame, or one is not among the rows.
    pub fn refit(&self, rows: &Rows<'_>) -> Result<Self, ThinPlateError> {
        let known = |&frame: &usize| rows.positions.get(frame).copied();
        let sites: Option<Vec<Point>> = self.site_frames.iter().map(known).collect();
        let sites = sites.ok_or(ThinPlateError::Counts)?;
        Ok(PoseSignal {
            plate: thin_plate::fit(rows, &sites)?,
            site_frames: self.site_frames.clone(),
        })
    }

    /// The thin plate.
    pub fn plate(&self) -> &ThinPlate {
        &self.plate
    }

    /// m, the dimension of the shape subspace.
    pub fn modes(&self) -> usize {
        self.plate.width()
    }

    /// The l sites.
    pub fn sites(&self) -> &[Point] {
        self.plate.sites()
    }

    /// The frame at each site, from 0; empty where sites are free.
    pub fn site_frames(&self) -> &[usize] {
        &self.site_frames
    }

    /// Writes g(`p`), m numbers.
    ///
    /// # Panics
    /// `x` is not m long.
    pub fn evaluate(&self, p: Point, x: &mut [f64]) {
        self.plate.evaluate(p, x);
    }

    /// Writes the derivatives of g at `p` along both axes, two rows of m.
    ///
    /// # Panics
    /// `rows` is not 2m long.
    pub fn jacobian(&self, p: Point, rows: &mut [f64]) {
        self.plate.jacobian(p, rows);
    }

    /// Writes g(`p`), m numbers, and its derivatives along both axes, two rows of m, at once.
    ///
    /// # Panics
    /// `x` is not m long, or `rows` not 2m.
    pub fn evaluate_with_jacobian(&self, p: Point, x: &mut [f64], rows: &mut [f64]) {
        self.plate.evaluate_with_jacobian(p, x, rows);
    }

    /// Writes the second derivatives of g at `p` (11, 12, 22), three rows of m; off the sites.
    ///
    /// # Panics
    /// `rows` is not 3m long.
    pub fn hessian(&self, p: Point, rows: &mut [f64]) {
        self.plate.hessian(p, rows);
    }

    /// Writes the derivative of g along `direction` at `p`, m numbers.
    ///
    /// # Panics
    /// `x` is not m long.
    pub fn along(&self, p: Point, direction: Point, x: &mut [f64]) {
        let mut rows = vec![0.0; 2 * self.modes()];
        self.plate.jacobian(p, &mut rows);
        let (first, second) = rows.split_at(self.modes());
        for ((x, a), b) in x.iter_mut().zip(first).zip(second) {
            *x = a * direction[0] + b * direction[1];
        }
    }

    /// The signal p -> A g(p) + b, for A given as m' rows of m and b of m' numbers: another basis of the
    /// shape subspace, or another subspace. Sites and side conditions stay.
    ///
    /// # Panics
    /// `a` is not m' rows of m.
    #[must_use]
    pub fn map_values(&self, a: &[f64], b: &[f64]) -> Self {
        PoseSignal {
            plate: self.plate.map_values(a, b),
            site_frames: self.site_frames.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(n: usize) -> (Vec<Point>, Vec<f64>) {
        let angle = |i: usize| i as f64 * 0.37;
        let positions = (0..n)
            .map(|i| [libm::cos(angle(i)), libm::sin(1.1 * angle(i))])
            .collect();
        let targets = (0..n)
            .flat_map(|i| [1.0, 2.0, 3.0].map(|j| libm::sin(j * angle(i)) / j))
            .collect();
        (positions, targets)
    }

    fn rows<'a>((positions, targets): &'a (Vec<Point>, Vec<f64>)) -> Rows<'a> {
        Rows {
            positions,
            targets,
            width: 3,
            weights: None,
        }
    }

    #[test]
    fn sites_are_the_frames_they_name_and_a_refit_in_place_changes_nothing() {
        let data = data(40);
        let fit = PoseSignal::fit(&rows(&data), 20).unwrap();
        for (site, &frame) in fit.signal.sites().iter().zip(fit.signal.site_frames()) {
            assert_eq!(*site, data.0[frame]);
        }
        let again = fit.signal.refit(&rows(&data)).unwrap();
        let (mut a, mut b) = ([0.0; 3], [0.0; 3]);
        fit.signal.evaluate([0.2, 0.3], &mut a);
        again.evaluate([0.2, 0.3], &mut b);
        assert!((0..3).all(|j| (a[j] - b[j]).abs() < 1e-9));
        assert_eq!(again.site_frames(), fit.signal.site_frames());
    }

    #[test]
    fn the_derivative_along_a_direction_is_the_jacobian_times_it() {
        let data = data(30);
        let signal = PoseSignal::fit(&rows(&data), 30).unwrap().signal;
        let (mut along, mut before, mut after) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        signal.along([0.1, 0.2], [3.0, -1.0], &mut along);
        let h = 1e-6;
        signal.evaluate([0.1 - 3.0 * h, 0.2 + h], &mut before);
        signal.evaluate([0.1 + 3.0 * h, 0.2 - h], &mut after);
        for j in 0..3 {
            let difference = (after[j] - before[j]) / (2.0 * h);
            assert!((difference - along[j]).abs() < 1e-6 * (1.0 + along[j].abs()));
        }
    }

    #[test]
    fn more_sites_than_positions_are_clamped_and_told() {
        let mut data = data(10);
        data.0.push([data.0[0][0] + 1e-6, data.0[0][1]]);
        data.1.extend([9.0, 9.0, 9.0]);
        let fit = PoseSignal::fit(&rows(&data), 50).unwrap();
        assert_eq!((fit.distinct, fit.signal.sites().len()), (10, 10));
        assert!(fit.spread > 1.0);
    }
}
