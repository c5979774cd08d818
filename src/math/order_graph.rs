//! Distances along a motion: shortest paths in the graph that joins consecutive samples and samples
//! that come back near each other. Far apart in time and near in shape is near; a detour between two
//! poses is as long as the poses passed on the way.

use faer::Mat;

use super::layout::Distances;

/// Lengths of the shortest paths in the graph with an edge between i and j, as long as their distance,
/// wherever |i - j| = 1 or that distance is below `reach`. With `reach` 0 these are arc lengths along
/// the samples.
pub fn geodesics(distances: &Distances, reach: f64) -> Distances {
    let count = distances.count();
    let mut paths = Mat::from_fn(count, count, |i, j| {
        let distance = distances.get(i, j);
        let joined = i.abs_diff(j) <= 1 || distance < reach;
        if joined { distance } else { f64::INFINITY }
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
    Distances::from_fn(count, |i, j| paths[(i, j)])
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
    fn circle(count: usize) -> Distances {
        let at = |i: usize| i as f64 / count as f64 * std::f64::consts::TAU;
        let points: Vec<f64> = (0..count)
            .flat_map(|i| [at(i).cos(), at(i).sin()])
            .collect();
        Distances::between(&points, 2)
    }

    #[test]
    fn without_reach_the_geodesics_are_arc_lengths() {
        let distances = circle(40);
        let paths = geodesics(&distances, 0.0);
        let chord = distances.get(0, 1);
        for i in 0..40_usize {
            for j in 0..40 {
                let along = i.abs_diff(j) as f64 * chord;
                assert!((paths.get(i, j) - along).abs() < 1e-13 * 40.0);
            }
        }
    }

    #[test]
    fn returning_poses_are_joined() {
        let distances = circle(40);
        let chord = distances.get(0, 1);
        let paths = geodesics(&distances, 1.001 * chord);
        // The last sample is one chord from the first: a ring.
        assert!((paths.get(0, 39) - chord).abs() < 1e-13);
        assert!((paths.get(0, 30) - 10.0 * chord).abs() < 1e-12);
    }

    #[test]
    fn a_wide_reach_gives_the_distances_themselves() {
        let distances = circle(15);
        let paths = geodesics(&distances, 10.0);
        let pairs = paths.values().iter().zip(distances.values());
        assert!(
            pairs
                .into_iter()
                .all(|(path, direct)| (path - direct).abs() < 1e-15)
        );
    }

    #[test]
    fn held_poses_stay_connected() {
        let distances = Distances::between(&[0.0, 1.0, 1.0, 1.0, 2.0, 2.0], 1);
        let paths = geodesics(&distances, 0.0);
        assert_eq!(paths.get(0, 5), 2.0);
        assert_eq!(paths.get(1, 3), 0.0);
    }
}
