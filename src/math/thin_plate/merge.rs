//! Positions that all but coincide are one site with the mean target.

use super::basis::{square, unit_frame};
use super::{Rows, ThinPlateError};
use crate::math::b_spline::Point;

/// Rows after merging.
#[derive(Debug, Clone, PartialEq)]
pub struct Merged {
    /// Mean positions, in the order of each one's first row.
    pub positions: Vec<Point>,
    /// Mean targets, row after row.
    pub targets: Vec<f64>,
    /// Sums of the weights.
    pub weights: Vec<f64>,
    /// m, the length of a target.
    pub width: usize,
    /// For each original row the merged row it went into.
    pub of: Vec<usize>,
    /// Largest distance of an original target from its merged one: what exactness can reach.
    pub spread: f64,
}

impl Merged {
    /// These as rows to fit.
    pub fn rows(&self) -> Rows<'_> {
        Rows {
            positions: &self.positions,
            targets: &self.targets,
            width: self.width,
            weights: Some(&self.weights),
        }
    }
}

/// Merges rows whose positions lie within `tolerance` (1e-4 for fits) times the layout's diameter of an
/// earlier row's that was not merged itself. Rows of weight 0 are kept with weight 0.
///
/// # Errors
/// No rows; counts that do not match; numbers that are not finite.
pub fn merge(rows: &Rows<'_>, tolerance: f64) -> Result<Merged, ThinPlateError> {
    rows.check()?;
    let (of, leaders) = clusters(rows.positions, tolerance);
    let (m, count) = (rows.width, leaders.len());
    let mut weights = vec![0.0; count];
    for (row, &to) in of.iter().enumerate() {
        weights[to] += rows.weight(row);
    }
    let mut merged = Merged {
        positions: leaders.iter().map(|&row| rows.positions[row]).collect(),
        targets: leaders
            .iter()
            .flat_map(|&row| rows.targets[row * m..(row + 1) * m].to_vec())
            .collect(),
        weights,
        width: m,
        spread: 0.0,
        of,
    };
    merged.average(rows, &leaders);
    Ok(merged)
}

impl Merged {
    /// Moves each merged row to the weighted mean of its members, as differences from the leader.
    fn average(&mut self, rows: &Rows<'_>, leaders: &[usize]) {
        let m = self.width;
        let target = |row: usize| &rows.targets[row * m..(row + 1) * m];
        for (row, &to) in self.of.iter().enumerate() {
            if leaders[to] == row || self.weights[to] == 0.0 {
                continue;
            }
            let part = rows.weight(row) / self.weights[to];
            for axis in 0..2 {
                let lead = rows.positions[leaders[to]][axis];
                self.positions[to][axis] += part * (rows.positions[row][axis] - lead);
            }
            let lead = target(leaders[to]);
            let means = self.targets[to * m..(to + 1) * m].iter_mut();
            for (mean, (x, lead)) in means.zip(target(row).iter().zip(lead)) {
                *mean += part * (x - lead);
            }
        }
        for (row, &to) in self.of.iter().enumerate() {
            let mean = &self.targets[to * m..(to + 1) * m];
            let far: f64 = mean
                .iter()
                .zip(target(row))
                .map(|(a, b)| (a - b) * (a - b))
                .sum();
            self.spread = self.spread.max(far.sqrt());
        }
    }
}

/// For each position its cluster, and each cluster's first position.
fn clusters(positions: &[Point], tolerance: f64) -> (Vec<usize>, Vec<usize>) {
    let near = tolerance * diameter(positions);
    let mut leaders: Vec<usize> = Vec::new();
    let of = positions
        .iter()
        .enumerate()
        .map(|(row, &p)| {
            let close = |&leader: &usize| square(positions[leader], p) <= near * near;
            leaders.iter().position(close).unwrap_or_else(|| {
                leaders.push(row);
                leaders.len() - 1
            })
        })
        .collect();
    (of, leaders)
}

/// Twice the largest distance from the middle of the bounding box: between the diameter and sqrt 2 of it.
fn diameter(positions: &[Point]) -> f64 {
    let (middle, _) = unit_frame(positions);
    2.0 * positions
        .iter()
        .map(|&p| square(p, middle))
        .fold(0.0, f64::max)
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows<'a>(positions: &'a [Point], targets: &'a [f64]) -> Rows<'a> {
        Rows {
            positions,
            targets,
            width: 1,
            weights: None,
        }
    }

    #[test]
    fn near_positions_become_their_mean() {
        let positions = [[0.0, 0.0], [1.0, 0.0], [0.0, 1e-5], [1.0, 1e-3]];
        let merged = merge(&rows(&positions, &[1.0, 5.0, 2.0, 6.0]), 1e-4).unwrap();
        assert_eq!(merged.of, [0, 1, 0, 2]);
        assert_eq!(merged.targets, [1.5, 5.0, 6.0]);
        assert_eq!(merged.weights, [2.0, 1.0, 1.0]);
        assert_eq!(merged.positions[0], [0.0, 5e-6]);
        assert_eq!(merged.spread, 0.5);
    }

    #[test]
    fn positions_that_all_coincide_are_one() {
        let merged = merge(&rows(&[[1e6, 3.0]; 4], &[1.0, 2.0, 3.0, 6.0]), 1e-4).unwrap();
        assert_eq!((merged.positions.len(), merged.targets[0]), (1, 3.0));
        assert_eq!(merged.spread, 3.0);
    }

    #[test]
    fn what_lies_apart_stays_as_it_is() {
        let positions = [[3.0, 0.0], [1.0, 7.0], [0.1, 0.2]];
        let merged = merge(&rows(&positions, &[1.0, 2.0, 3.0]), 1e-4).unwrap();
        assert_eq!(merged.positions, positions);
        assert_eq!((merged.spread, merged.of), (0.0, vec![0, 1, 2]));
    }
}
