//! Least squares over all rows with given sites: one QR decomposition.

use faer::Mat;

use super::basis::{Base, directions, spanning, unit_frame};
use super::{Rows, ThinPlate, ThinPlateError};
use crate::math::b_spline::Point;
use crate::math::growing_qr::GrowingQr;
use crate::math::least_squares::least_squares;

impl Rows<'_> {
    /// Checks counts and numbers.
    pub(super) fn check(&self) -> Result<(), ThinPlateError> {
        let n = self.positions.len();
        if n == 0 {
            return Err(ThinPlateError::Empty);
        }
        if self.targets.len() != n * self.width || self.weights.is_some_and(|w| w.len() != n) {
            return Err(ThinPlateError::Counts);
        }
        let sound = |row: usize| {
            let target = &self.targets[row * self.width..(row + 1) * self.width];
            let finite = self.positions[row]
                .iter()
                .chain(target)
                .all(|x| x.is_finite());
            finite && (0.0..f64::INFINITY).contains(&self.weight(row))
        };
        match (0..n).find(|&row| !sound(row)) {
            Some(row) => Err(ThinPlateError::NotFinite { row }),
            None => Ok(()),
        }
    }

    /// Weight of a row's squared error.
    pub(super) fn weight(&self, row: usize) -> f64 {
        self.weights.map_or(1.0, |w| w[row])
    }

    /// Square roots of the weights.
    pub(super) fn roots(&self) -> Vec<f64> {
        (0..self.positions.len())
            .map(|row| self.weight(row).sqrt())
            .collect()
    }
}

/// The system of one fit: base sites, affine directions and the further sites, in column order.
pub(super) struct System {
    pub(super) frame: (Point, f64),
    pub(super) base: Base,
    pub(super) directions: Vec<Point>,
}

impl System {
    /// Columns of the affine part: the constant and the directions.
    pub(super) fn affine_columns(&self) -> usize {
        1 + self.directions.len()
    }

    /// Affine column `index` at each of `positions`.
    pub(super) fn affine_column(&self, index: usize, positions: &[Point], column: &mut [f64]) {
        let (origin, scale) = self.frame;
        let Some(direction) = index.checked_sub(1).map(|i| self.directions[i]) else {
            return column.fill(1.0);
        };
        for (p, value) in positions.iter().zip(column) {
            let (x, y) = ((p[0] - origin[0]) / scale, (p[1] - origin[1]) / scale);
            *value = x * direction[0] + y * direction[1];
        }
    }

    /// The thin plate of coefficients, given as m columns (affine columns, then one a further site).
    pub(super) fn assemble(&self, further: &[Point], coefficients: &[Vec<f64>]) -> ThinPlate {
        let (base, m, a) = (
            self.base.sites.len(),
            coefficients.len(),
            self.affine_columns(),
        );
        let mut affine = vec![0.0; 3 * m];
        let mut weights = vec![0.0; (base + further.len()) * m];
        for (j, column) in coefficients.iter().enumerate() {
            affine[j] = column[0];
            for (direction, c) in self.directions.iter().zip(&column[1..]) {
                affine[m + j] += c * direction[0];
                affine[2 * m + j] += c * direction[1];
            }
            for (i, c) in column[a..].iter().enumerate() {
                weights[(base + i) * m + j] = *c;
            }
        }
        for (i, &site) in further.iter().enumerate() {
            for (b, factor) in self.base.factors(site).into_iter().enumerate() {
                for j in 0..m {
                    weights[b * m + j] -= factor * weights[(base + i) * m + j];
                }
            }
        }
        ThinPlate {
            origin: self.frame.0,
            scale: self.frame.1,
            width: m,
            sites: [&self.base.sites, further].concat(),
            weights,
            affine,
        }
    }
}

/// The thin plate with the given `sites` that minimises sum_i w_i |x_i - g(p_i)|^2. Sites may lie
/// anywhere and keep their order. Where the rows do not determine it (fewer rows than sites, sites
/// that coincide), the sites that add nothing have coefficients 0.
///
/// # Errors
/// No rows or sites; counts that do not match; numbers that are not finite.
pub fn fit(rows: &Rows<'_>, sites: &[Point]) -> Result<ThinPlate, ThinPlateError> {
    rows.check()?;
    if sites.is_empty() {
        return Err(ThinPlateError::Empty);
    }
    if let Some(index) = sites
        .iter()
        .position(|s| !s[0].is_finite() || !s[1].is_finite())
    {
        return Err(ThinPlateError::Site { index });
    }
    let frame = unit_frame(rows.positions);
    let base = spanning(sites);
    let system = System {
        frame,
        base: Base::new(base.iter().map(|&i| sites[i]).collect(), frame.1),
        directions: directions(rows.positions),
    };
    let further: Vec<usize> = (0..sites.len()).filter(|i| !base.contains(i)).collect();
    let points: Vec<Point> = further.iter().map(|&i| sites[i]).collect();
    let coefficients = solve(rows, &system, &points);
    let plate = system.assemble(&points, &coefficients);
    Ok(plate.reordered(&[base, further].concat()))
}

impl ThinPlate {
    /// Sites moved to the places that `order` names.
    fn reordered(self, order: &[usize]) -> Self {
        let m = self.width;
        let mut sites = self.sites.clone();
        let mut weights = self.weights.clone();
        for (from, &to) in order.iter().enumerate() {
            sites[to] = self.sites[from];
            weights[to * m..(to + 1) * m].copy_from_slice(&self.weights[from * m..(from + 1) * m]);
        }
        ThinPlate {
            sites,
            weights,
            ..self
        }
    }
}

/// Coefficients of the affine columns and of the `further` sites, one column a target coordinate.
fn solve(rows: &Rows<'_>, system: &System, further: &[Point]) -> Vec<Vec<f64>> {
    let n = rows.positions.len();
    let affine = system.affine_columns();
    let roots = rows.roots();
    let mut matrix = Mat::zeros(n, affine + further.len());
    let mut column = vec![0.0; n];
    for j in 0..matrix.ncols() {
        match j.checked_sub(affine) {
            None => system.affine_column(j, rows.positions, &mut column),
            Some(i) => system.base.column(further[i], rows.positions, &mut column),
        }
        for (i, value) in column.iter().enumerate() {
            matrix[(i, j)] = roots[i] * value;
        }
    }
    let right = Mat::from_fn(n, rows.width, |i, j| {
        roots[i] * rows.targets[i * rows.width + j]
    });
    match least_squares(matrix.clone(), right.clone()) {
        Some(found) => found
            .col_iter()
            .map(|c| c.iter().copied().collect())
            .collect(),
        None => solve_dependent(&matrix, &right),
    }
}

/// The same with the columns that depend on earlier ones left out.
fn solve_dependent(matrix: &Mat<f64>, right: &Mat<f64>) -> Vec<Vec<f64>> {
    let columns = |m: &Mat<f64>| -> Vec<f64> {
        m.col_iter()
            .flat_map(|c| c.iter().copied().collect::<Vec<_>>())
            .collect()
    };
    let mut qr = GrowingQr::new(matrix.nrows(), right.ncols(), columns(right));
    let kept: Vec<usize> = columns(matrix)
        .chunks_exact(matrix.nrows())
        .enumerate()
        .filter_map(|(j, column)| qr.append(column).then_some(j))
        .collect();
    let found = qr.solve(kept.len());
    found
        .chunks_exact(kept.len().max(1))
        .map(|found| {
            let mut all = vec![0.0; matrix.ncols()];
            kept.iter().zip(found).for_each(|(&j, x)| all[j] = *x);
            all
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::thin_plate::test_layouts::{evaluate, grid, spiral};

    fn rows<'a>(positions: &'a [Point], targets: &'a [f64]) -> Rows<'a> {
        Rows {
            positions,
            targets,
            width: targets.len() / positions.len(),
            weights: None,
        }
    }

    #[test]
    fn affine_targets_are_reproduced_everywhere_and_need_no_sites() {
        for (scale, shift) in [(1.0, 0.0), (1e8, 0.0), (1e-8, 0.0), (1.0, 1e6)] {
            let positions: Vec<Point> = grid(5)
                .iter()
                .map(|p| p.map(|x| scale * x + shift))
                .collect();
            let law = |p: Point| [3.0 - p[0] / scale, p[1] / scale, 2.0];
            let targets: Vec<f64> = positions.iter().flat_map(|&p| law(p)).collect();
            let plate = fit(&rows(&positions, &targets), &positions[3..17]).unwrap();
            let p = [0.3 * scale + shift, 2.7 * scale + shift];
            let (found, expected) = (evaluate(&plate, p), law(p));
            for j in 0..3 {
                // rounding of positions relative to their spread, and of sums over the sites
                let tolerance = 1e-12 * (1.0 + (shift / scale).abs());
                assert!((found[j] - expected[j]).abs() < tolerance);
            }
        }
    }

    #[test]
    fn with_a_site_at_every_row_it_interpolates() {
        for positions in [grid(6), spiral(60)] {
            let targets: Vec<f64> = positions
                .iter()
                .enumerate()
                .flat_map(|(i, p)| [libm::sin(i as f64), p[0] * p[1]])
                .collect();
            let plate = fit(&rows(&positions, &targets), &positions).unwrap();
            for (i, &p) in positions.iter().enumerate() {
                let found = evaluate(&plate, p);
                // rounding times the condition of these layouts, about 1e5
                assert!((found[0] - targets[2 * i]).abs() < 1e-10);
                assert!((found[1] - targets[2 * i + 1]).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn coefficients_meet_the_side_conditions() {
        let positions = spiral(50);
        let targets: Vec<f64> = (0..50).map(|i| libm::sin(f64::from(i) * 0.7)).collect();
        let plate = fit(&rows(&positions, &targets), &positions[..30]).unwrap();
        let size: f64 = plate.weights().iter().map(|w| w.abs()).sum();
        for moment in [|_: Point| 1.0, |s: Point| s[0], |s: Point| s[1]] {
            let sum: f64 = plate
                .sites()
                .iter()
                .zip(plate.weights())
                .map(|(&s, w)| w * moment(s))
                .sum();
            assert!(sum.abs() < 1e-12 * size);
        }
    }

    #[test]
    fn weights_count_as_repeated_rows() {
        let positions = grid(4);
        let targets: Vec<f64> = (0..16).map(|i| libm::sin(f64::from(i))).collect();
        let mut weights = vec![1.0; 16];
        weights[5] = 3.0;
        let weighted = Rows {
            weights: Some(&weights),
            ..rows(&positions, &targets)
        };
        let (mut more, mut most) = (positions.clone(), targets.clone());
        for _ in 0..2 {
            more.push(positions[5]);
            most.push(targets[5]);
        }
        let (a, b) = (
            fit(&weighted, &positions[..9]).unwrap(),
            fit(&rows(&more, &most), &positions[..9]).unwrap(),
        );
        assert!((evaluate(&a, [1.2, 0.4])[0] - evaluate(&b, [1.2, 0.4])[0]).abs() < 1e-12);
    }

    #[test]
    fn lines_points_and_repeated_sites_have_what_exists_there() {
        let line: Vec<Point> = (0..9).map(|i| [f64::from(i), 2.0 * f64::from(i)]).collect();
        let targets: Vec<f64> = (0..9).map(|i| libm::cos(f64::from(i))).collect();
        let plate = fit(&rows(&line, &targets), &line).unwrap();
        for (p, target) in line.iter().zip(&targets) {
            assert!((evaluate(&plate, *p)[0] - target).abs() < 1e-10);
        }
        let one = fit(&rows(&line[..1], &targets[..1]), &line[..1]).unwrap();
        assert_eq!(evaluate(&one, [77.0, 3.0]), [targets[0]]);
        let two = fit(&rows(&line[..2], &[0.0, 1.0]), &line[..2]).unwrap();
        assert!((evaluate(&two, [0.5, 1.0])[0] - 0.5).abs() < 1e-14);
        let twice = [line.clone(), line.clone()].concat();
        let again = fit(&rows(&line, &targets), &twice).unwrap();
        assert!((evaluate(&again, line[4])[0] - targets[4]).abs() < 1e-10);
    }

    #[test]
    fn bad_rows_and_sites_are_named() {
        let positions = grid(3);
        let mut targets = vec![0.0; 9];
        assert_eq!(
            fit(&rows(&positions, &targets), &[]),
            Err(ThinPlateError::Empty)
        );
        assert_eq!(
            fit(&rows(&positions, &targets), &[[0.0; 2], [f64::NAN, 0.0]]),
            Err(ThinPlateError::Site { index: 1 })
        );
        targets[7] = f64::INFINITY;
        assert_eq!(
            fit(&rows(&positions, &targets), &positions),
            Err(ThinPlateError::NotFinite { row: 7 })
        );
    }
}
