//! Distances along a motion: shortest paths in the graph that joins consecutive samples and samples
//! that come back near each other. Far apart in time and near in shape is near; a detour between two
//! poses is as long as the poses passed on the way.

use faer::{Mat, MatRef};

/// Euclidean distances between the rows of `points` (n x m), n x n.
pub fn distances(points: MatRef<'_, f64>) -> Mat<f64> {
    let count = points.nrows();
    let mut squares = Mat::<f64>::zeros(count, count);
    for c in 0..points.ncols() {
        for j in 0..count {
            let at = points[(j, c)];
            let column = squares.col_as_slice_mut(j);
            for (i, square) in column.iter_mut().enumerate() {
                let difference = points[(i, c)] - at;
                *square += difference * difference;
            }
        }
    }
    for j in 0..count {
        let column = squares.col_as_slice_mut(j);
        column.iter_mut().for_each(|square| *square = square.sqrt());
    }
    squares
}

/// Root mean square of all entries.
pub fn root_mean_square(matrix: MatRef<'_, f64>) -> f64 {
    let count = (matrix.nrows() * matrix.ncols()).max(1) as f64;
    (matrix.squared_norm_l2() / count).sqrt()
}

/// Lengths of the shortest paths, n x n, in the graph with an edge between i and j of length
/// `distances[(i, j)]` wherever |i - j| = 1 or the distance is below `reach`. With `reach` 0 that is
/// the arc length along the samples.
pub fn geodesics(distances: MatRef<'_, f64>, reach: f64) -> Mat<f64> {
    let count = distances.nrows();
    let mut paths = Mat::from_fn(count, count, |i, j| {
        if i == j || i.abs_diff(j) == 1 || distances[(i, j)] < reach {
            distances[(i, j)]
        } else {
            f64::INFINITY
        }
    });
    let simd = pulp::Arch::new();
    let mut through = vec![0.0; count];
    for k in 0..count {
        through.copy_from_slice(paths.col_as_slice(k));
        for j in 0..count {
            let first = through[j];
            if first.is_finite() {
                let column = paths.col_as_slice_mut(j);
                simd.dispatch(|| shorten(column, &through, first));
            }
        }
    }
    paths
}

/// Floyd & Warshall's step for one column: the way over `through` after a first leg.
#[inline(always)]
fn shorten(column: &mut [f64], through: &[f64], first: f64) {
    for (path, rest) in column.iter_mut().zip(through) {
        let over = first + rest;
        *path = if over < *path { over } else { *path };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples on the unit circle: the way along the order is the arc of chords, an edge across
    /// shortens it.
    fn circle(count: usize) -> Mat<f64> {
        Mat::from_fn(count, 2, |i, a| {
            let angle = i as f64 / count as f64 * std::f64::consts::TAU;
            [angle.cos(), angle.sin()][a]
        })
    }

    #[test]
    fn without_reach_the_geodesics_are_arc_lengths() {
        let distances = distances(circle(40).as_ref());
        let paths = geodesics(distances.as_ref(), 0.0);
        let chord = distances[(0, 1)];
        for i in 0..40_usize {
            for j in 0..40 {
                let along = i.abs_diff(j) as f64 * chord;
                assert!((paths[(i, j)] - along).abs() < 1e-13 * 40.0);
            }
        }
    }

    #[test]
    fn returning_poses_are_joined() {
        let distances = distances(circle(40).as_ref());
        let chord = distances[(0, 1)];
        let paths = geodesics(distances.as_ref(), 1.001 * chord);
        // The last sample is one chord from the first: a ring.
        assert!((paths[(0, 39)] - chord).abs() < 1e-13);
        assert!((paths[(0, 30)] - 10.0 * chord).abs() < 1e-12);
        assert!((paths[(30, 0)] - paths[(0, 30)]).abs() < 1e-12);
    }

    #[test]
    fn a_wide_reach_gives_the_distances_themselves() {
        let distances = distances(circle(15).as_ref());
        let paths = geodesics(distances.as_ref(), 10.0);
        assert!((paths - distances).norm_max() < 1e-15);
    }

    #[test]
    fn held_poses_stay_connected() {
        let points = Mat::from_fn(6, 1, |i, _| [0.0, 1.0, 1.0, 1.0, 2.0, 2.0][i]);
        let paths = geodesics(distances(points.as_ref()).as_ref(), 0.0);
        assert_eq!(paths[(0, 5)], 2.0);
        assert_eq!(paths[(1, 3)], 0.0);
    }
}
