//! The order in which rows become sites (CH12 §3.2.2), without a refit from nothing.
//!
//! The first four are the rows whose targets lie farthest from the best-fit plane, then always the row
//! with the largest error. Because the basis functions of [`super::basis`] make nested spaces, one
//! appended column updates the error of every row: O(n l^2 + n l m) for the whole order.

use super::basis::{Base, cross, directions, spanning, unit_frame};
use super::fit::System;
use super::{Rows, ThinPlate, ThinPlateError};
use crate::math::b_spline::Point;
use crate::math::growing_qr::GrowingQr;

/// The part of the layout's largest triangle below which the first four rows do not make a base.
const SLIM: f64 = 1e-3;

/// A greedy order and the least-squares fit at each of its lengths.
pub struct Greedy<'a> {
    rows: Rows<'a>,
    roots: Vec<f64>,
    system: System,
    order: Vec<usize>,
    columns: Vec<usize>,
    errors: Vec<f64>,
    qr: GrowingQr,
}

/// Chooses up to `limit` sites among the rows. Targets are taken as principal coordinates: the best-fit
/// plane is that of the first two. Where the first four rows leave no triangle worth the name, the
/// layout's own largest triangle comes first.
///
/// The rows should be merged ([`super::merge`]); a row whose basis function adds nothing is passed over.
///
/// # Errors
/// No rows; counts that do not match; numbers that are not finite.
pub fn greedy<'a>(rows: &Rows<'a>, limit: usize) -> Result<Greedy<'a>, ThinPlateError> {
    rows.check()?;
    let mut greedy = Greedy::start(rows);
    let first = farthest_from_plane(rows, 4);
    let mut free = vec![true; rows.positions.len()];
    greedy.order.iter().for_each(|&row| free[row] = false);
    for row in first {
        if free[row] && greedy.sites() < limit {
            greedy.add(row);
            free[row] = false;
        }
    }
    while greedy.sites() < limit {
        let Some(row) = greedy.worst(&free) else {
            break;
        };
        greedy.add(row);
        free[row] = false;
    }
    Ok(greedy)
}

impl<'a> Greedy<'a> {
    /// The affine part over the base sites.
    fn start(rows: &Rows<'a>) -> Self {
        let frame = unit_frame(rows.positions);
        let order = base_rows(rows);
        let roots = rows.roots();
        let system = System {
            frame,
            base: Base::new(
                order.iter().map(|&row| rows.positions[row]).collect(),
                frame.1,
            ),
            directions: directions(rows.positions),
        };
        let n = rows.positions.len();
        let right = (0..rows.width)
            .flat_map(|j| (0..n).map(move |i| (i, j)))
            .map(|(i, j)| roots[i] * rows.targets[i * rows.width + j])
            .collect();
        let mut greedy = Greedy {
            rows: *rows,
            roots,
            system,
            order,
            columns: Vec::new(),
            errors: Vec::new(),
            qr: GrowingQr::new(n, rows.width, right),
        };
        let mut column = vec![0.0; n];
        for index in 0..greedy.system.affine_columns() {
            greedy
                .system
                .affine_column(index, rows.positions, &mut column);
            if greedy.append(&mut column) {
                greedy.columns.push(index);
            }
        }
        greedy.errors = vec![greedy.error(); greedy.order.len()];
        greedy
    }

    /// How many sites were chosen: `limit`, or fewer where no row was left that adds anything. The base
    /// (up to three) is always there.
    pub fn sites(&self) -> usize {
        self.order.len()
    }

    /// The rows that became sites, first chosen first.
    pub fn order(&self) -> &[usize] {
        &self.order
    }

    /// Weighted sum of squared errors (4) with the first l sites, at index l-1; never rising. Below the
    /// base's size it is the base's.
    pub fn errors(&self) -> &[f64] {
        &self.errors
    }

    /// The least-squares thin plate with the first `sites` sites, at least the base and at most all.
    pub fn fit(&self, sites: usize) -> ThinPlate {
        let base = self.system.base.sites.len();
        let sites = sites.clamp(base, self.sites());
        let affine = self.columns.len();
        let found = self.qr.solve(affine + sites - base);
        let width = affine + sites - base;
        let columns: Vec<Vec<f64>> = (0..self.rows.width)
            .map(|j| {
                let found = &found[j * width..(j + 1) * width];
                let mut all = vec![0.0; self.system.affine_columns()];
                self.columns
                    .iter()
                    .zip(found)
                    .for_each(|(&at, x)| all[at] = *x);
                all.extend(&found[affine..]);
                all
            })
            .collect();
        let further: Vec<Point> = self.order[base..sites]
            .iter()
            .map(|&row| self.rows.positions[row])
            .collect();
        self.system.assemble(&further, &columns)
    }

    /// Makes a row a site, unless its basis function adds nothing.
    fn add(&mut self, row: usize) {
        let mut column = vec![0.0; self.roots.len()];
        let positions = self.rows.positions;
        self.system
            .base
            .column(positions[row], positions, &mut column);
        if self.append(&mut column) {
            self.order.push(row);
            self.errors.push(self.error());
        }
    }

    /// Appends a column, weighted.
    fn append(&mut self, column: &mut [f64]) -> bool {
        column
            .iter_mut()
            .zip(&self.roots)
            .for_each(|(x, root)| *x *= root);
        self.qr.append(column)
    }

    /// Weighted sum of squared errors now.
    fn error(&self) -> f64 {
        self.qr.residual().iter().map(|x| x * x).sum()
    }

    /// The free row with the largest error.
    fn worst(&self, free: &[bool]) -> Option<usize> {
        let n = self.roots.len();
        let mut squares = vec![0.0; n];
        for column in self.qr.residual().chunks_exact(n) {
            squares
                .iter_mut()
                .zip(column)
                .for_each(|(sum, x)| *sum += x * x);
        }
        let candidates = (0..n).filter(|&row| free[row] && self.roots[row] > 0.0);
        first_largest(candidates.map(|row| (row, squares[row] / self.rows.weight(row))))
    }
}

/// The index with the largest value, the first of equals.
fn first_largest(values: impl Iterator<Item = (usize, f64)>) -> Option<usize> {
    values
        .fold(None, |best: Option<(usize, f64)>, new| match best {
            Some(best) if best.1 >= new.1 => Some(best),
            _ => Some(new),
        })
        .map(|(index, _)| index)
}

/// Up to `count` rows whose targets lie farthest from the plane of the first two principal coordinates;
/// where all lie in it, farthest from their mean.
fn farthest_from_plane(rows: &Rows<'_>, count: usize) -> Vec<usize> {
    let (n, m) = (rows.positions.len(), rows.width);
    let distances = |from: usize| -> Vec<f64> {
        let mut sums = vec![0.0; n];
        for j in from..m {
            let mean = (0..n).map(|i| rows.targets[i * m + j]).sum::<f64>() / n as f64;
            for (i, sum) in sums.iter_mut().enumerate() {
                let x = rows.targets[i * m + j] - mean;
                *sum += x * x;
            }
        }
        sums
    };
    let (all, mut off) = (distances(0), distances(2));
    let largest = |values: &[f64]| values.iter().copied().fold(0.0, f64::max);
    // In the plane up to rounding: squares of 1e-12.
    if largest(&off) <= 1e-24 * largest(&all) {
        off = all;
    }
    let mut chosen: Vec<usize> = Vec::new();
    while chosen.len() < count.min(n) {
        let left = (0..n).filter(|row| !chosen.contains(row) && rows.weight(*row) > 0.0);
        match first_largest(left.map(|row| (row, off[row]))) {
            Some(row) => chosen.push(row),
            None => break,
        }
    }
    chosen
}

/// Rows of the base sites: the largest triangle among the four farthest from the plane, or the layout's
/// own where that is slim; fewer where the layout is a line or a point.
fn base_rows(rows: &Rows<'_>) -> Vec<usize> {
    let own = spanning(rows.positions);
    let [a, b, c] = *own else {
        return own;
    };
    let area = |t: [usize; 3]| {
        let [a, b, c] = t.map(|row| rows.positions[row]);
        cross(a, b, c).abs()
    };
    let four = farthest_from_plane(rows, 4);
    let triangles = (0..four.len())
        .map(|out| {
            four.iter()
                .copied()
                .filter(|&row| row != four[out])
                .collect::<Vec<_>>()
        })
        .filter_map(|three| <[usize; 3]>::try_from(three).ok())
        .collect::<Vec<_>>();
    let largest = first_largest(triangles.iter().map(|&t| area(t)).enumerate());
    match largest.map(|i| triangles[i]) {
        Some(triangle) if area(triangle) >= SLIM * area([a, b, c]) => triangle.to_vec(),
        _ => own,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::thin_plate::test_layouts::{evaluate, spiral};
    use crate::math::thin_plate::{fit, merge};

    /// Positions on a spiral, targets of `width` smooth functions of falling size.
    fn curve(n: usize, width: usize) -> (Vec<Point>, Vec<f64>) {
        let targets = (0..n)
            .flat_map(|i| {
                (0..width).map(move |j| {
                    let t = i as f64 / n as f64;
                    libm::sin((j as f64 + 1.5) * 3.0 * t) / (j as f64 + 1.0)
                })
            })
            .collect();
        (spiral(n), targets)
    }

    fn rows<'a>((positions, targets): &'a (Vec<Point>, Vec<f64>)) -> Rows<'a> {
        Rows {
            positions,
            targets,
            width: targets.len() / positions.len(),
            weights: None,
        }
    }

    #[test]
    fn more_sites_never_raise_the_error_and_all_leave_none() {
        let data = curve(70, 6);
        let greedy = greedy(&rows(&data), 70).unwrap();
        assert_eq!(greedy.sites(), 70);
        assert!(greedy.errors().windows(2).all(|e| e[1] <= e[0]));
        // squares of rounding times the condition of the layout
        assert!(greedy.errors()[69] < 1e-22);
        let plate = greedy.fit(70);
        for (i, &p) in data.0.iter().enumerate() {
            let found = evaluate(&plate, p);
            assert!((0..6).all(|j| (found[j] - data.1[6 * i + j]).abs() < 1e-9));
        }
    }

    #[test]
    fn a_row_is_a_site_once() {
        let data = curve(40, 5);
        let mut order = greedy(&rows(&data), 40).unwrap().order().to_vec();
        order.sort_unstable();
        assert_eq!(order, (0..40).collect::<Vec<_>>());
    }

    #[test]
    fn each_length_is_the_least_squares_fit_with_those_sites() {
        let data = curve(60, 4);
        let greedy = greedy(&rows(&data), 30).unwrap();
        for sites in [3, 4, 11, 30] {
            let ours = greedy.fit(sites);
            let plain = fit(&rows(&data), ours.sites()).unwrap();
            let mut error = 0.0;
            for (i, &p) in data.0.iter().enumerate() {
                let (a, b) = (evaluate(&ours, p), evaluate(&plain, p));
                assert!((0..4).all(|j| (a[j] - b[j]).abs() < 1e-9));
                error += (0..4)
                    .map(|j| (a[j] - data.1[4 * i + j]).powi(2))
                    .sum::<f64>();
            }
            assert!((error - greedy.errors()[sites - 1]).abs() < 1e-10 * error);
        }
    }

    #[test]
    fn the_next_site_is_the_row_with_the_largest_error() {
        let data = curve(50, 4);
        let greedy = greedy(&rows(&data), 12).unwrap();
        let (plate, next) = (greedy.fit(11), greedy.order()[11]);
        let error = |i: usize| -> f64 {
            let found = evaluate(&plate, data.0[i]);
            (0..4).map(|j| (found[j] - data.1[4 * i + j]).powi(2)).sum()
        };
        let free = (0..50).filter(|i| !greedy.order()[..11].contains(i));
        assert!(free.into_iter().all(|i| error(i) <= error(next)));
    }

    #[test]
    fn the_same_order_at_any_scale() {
        let data = curve(50, 4);
        let order = greedy(&rows(&data), 25).unwrap().order().to_vec();
        for scale in [1e-8, 1e8] {
            let scaled = (
                data.0
                    .iter()
                    .map(|p| p.map(|x| x * scale))
                    .collect::<Vec<_>>(),
                data.1.iter().map(|x| x * scale).collect::<Vec<_>>(),
            );
            assert_eq!(greedy(&rows(&scaled), 25).unwrap().order(), order);
        }
    }

    #[test]
    fn strides_that_lie_on_each_other_are_merged_and_interpolated() {
        let (positions, targets) = curve(30, 3);
        let shifted = positions
            .iter()
            .map(|p| [p[0] + 1e-6, p[1]])
            .collect::<Vec<_>>();
        let data = (
            [positions.clone(), shifted].concat(),
            [targets.clone(), targets].concat(),
        );
        let merged = merge(&rows(&data), 1e-4).unwrap();
        let greedy = greedy(&merged.rows(), usize::MAX).unwrap();
        assert_eq!(greedy.sites(), 30);
        let plate = greedy.fit(30);
        for (i, &p) in merged.positions.iter().enumerate() {
            let found = evaluate(&plate, p);
            assert!((0..3).all(|j| (found[j] - merged.targets[3 * i + j]).abs() < 1e-10));
        }
    }

    #[test]
    fn lines_and_few_rows_have_the_sites_that_exist() {
        let line = (
            (0..9).map(|i| [f64::from(i), 0.5]).collect::<Vec<Point>>(),
            (0..9).map(|i| libm::sin(f64::from(i))).collect::<Vec<_>>(),
        );
        let greedy_line = greedy(&rows(&line), 9).unwrap();
        assert_eq!(greedy_line.sites(), 9);
        let plate = greedy_line.fit(9);
        assert!((evaluate(&plate, [4.0, 0.5])[0] - line.1[4]).abs() < 1e-11);
        for n in [1, 2, 3] {
            let few = (line.0[..n].to_vec(), line.1[..n].to_vec());
            let greedy = greedy(&rows(&few), 9).unwrap();
            assert_eq!(greedy.sites(), n);
            assert!((evaluate(&greedy.fit(n), few.0[n - 1])[0] - few.1[n - 1]).abs() < 1e-12);
        }
    }
}
