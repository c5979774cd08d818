//! One more position among fixed ones.

use crate::math::b_spline::Point;

/// How many of the nearest fixed positions the search starts from.
const STARTS: usize = 6;

/// Each start lies at its distance from its position, another way round by the golden angle: off every
/// line of positions, which a search that began on it would never leave.
const GOLDEN: f64 = 2.399_963_229_728_653;

/// Majorisation steps from each start, at most.
const STEPS: usize = 500;

/// A step shorter than this part of the positions' extent ends the search.
const STILL: f64 = 1e-12;

/// The place p that minimises the stress of one more point, sum_i w_i (|p - p_i| - delta_i)^2, all others
/// held. The stress has several minima: the search starts beside the positions of smallest delta, and the
/// least stress wins, the earlier start among equals. A point at distance 0 from some p_i lies there;
/// without positions the origin is given.
///
/// # Panics
/// There are not as many distances and weights as positions.
pub fn place_one(positions: &[Point], distances: &[f64], weights: &[f64]) -> Point {
    assert!(positions.len() == distances.len() && positions.len() == weights.len());
    let mut nearest: Vec<usize> = (0..positions.len()).collect();
    nearest.sort_by(|&i, &j| distances[i].total_cmp(&distances[j]));
    let Some(&first) = nearest.first() else {
        return [0.0; 2];
    };
    if distances[first] == 0.0 {
        return positions[first];
    }
    let one = One {
        positions,
        distances,
        weights,
    };
    let starts = nearest.iter().take(STARTS).enumerate();
    let settled = starts.map(|(number, &i)| {
        let turn = 1.0 + GOLDEN * number as f64;
        let (sine, cosine) = (libm::sin(turn), libm::cos(turn));
        let [x, y] = positions[i];
        one.settled([x + distances[i] * cosine, y + distances[i] * sine])
    });
    settled
        .min_by(|&p, &q| one.stress(p).total_cmp(&one.stress(q)))
        .unwrap_or(positions[first])
}

struct One<'a> {
    positions: &'a [Point],
    distances: &'a [f64],
    weights: &'a [f64],
}

impl One<'_> {
    fn rows(&self) -> impl Iterator<Item = (Point, f64, f64)> {
        let numbers = self.distances.iter().zip(self.weights);
        self.positions
            .iter()
            .zip(numbers)
            .map(|(&q, (&delta, &weight))| (q, delta, weight))
    }

    fn stress(&self, p: Point) -> f64 {
        let miss = |(q, delta, weight): (Point, f64, f64)| {
            let off = length([p[0] - q[0], p[1] - q[1]]) - delta;
            weight * off * off
        };
        self.rows().map(miss).sum()
    }

    /// Where majorisation ends from `start`; it never raises the stress.
    fn settled(&self, start: Point) -> Point {
        let extent = self
            .positions
            .iter()
            .map(|q| length([q[0] - start[0], q[1] - start[1]]))
            .fold(0.0, f64::max);
        let mut p = start;
        for _ in 0..STEPS {
            let next = self.transformed(p);
            let step = length([next[0] - p[0], next[1] - p[1]]);
            p = next;
            if step <= STILL * extent {
                break;
            }
        }
        p
    }

    /// The Guttman transform of one point: the weighted mean of where each distance would have it. On top
    /// of a position every direction is alike; the first axis is taken.
    fn transformed(&self, p: Point) -> Point {
        let (mut sum, mut total) = ([0.0; 2], 0.0);
        for (q, delta, weight) in self.rows() {
            let away = [p[0] - q[0], p[1] - q[1]];
            let far = length(away);
            let unit = match far > 0.0 {
                true => [away[0] / far, away[1] / far],
                false => [1.0, 0.0],
            };
            for axis in 0..2 {
                sum[axis] += weight * (q[axis] + delta * unit[axis]);
            }
            total += weight;
        }
        match total > 0.0 {
            true => [sum[0] / total, sum[1] / total],
            false => p,
        }
    }
}

fn length(v: Point) -> f64 {
    (v[0] * v[0] + v[1] * v[1]).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring() -> Vec<Point> {
        let angle = |i: usize| 0.4 * i as f64;
        (0..14)
            .map(|i| [2.0 * libm::cos(angle(i)), libm::sin(angle(i))])
            .collect()
    }

    #[test]
    fn true_distances_give_the_place_back() {
        let positions = ring();
        for target in [[0.3, -0.2], [2.5, 1.0], [-4.0, 0.1]] {
            let far = |q: &Point| length([target[0] - q[0], target[1] - q[1]]);
            let distances: Vec<f64> = positions.iter().map(far).collect();
            let found = place_one(&positions, &distances, &[1.0; 14]);
            // the search ends where a step is below 1e-12; its rate is far below 1 here
            assert!(length([found[0] - target[0], found[1] - target[1]]) < 1e-9);
        }
    }

    #[test]
    fn no_place_near_by_has_less_stress() {
        let positions = ring();
        let distances: Vec<f64> = (0..14).map(|i| 0.5 + 0.1 * i as f64).collect();
        let weights: Vec<f64> = distances.iter().map(|d| 1.0 / (d * d)).collect();
        let one = One {
            positions: &positions,
            distances: &distances,
            weights: &weights,
        };
        let p = place_one(&positions, &distances, &weights);
        for [x, y] in [[1e-4, 0.0], [-1e-4, 0.0], [0.0, 1e-4], [0.0, -1e-4]] {
            assert!(one.stress([p[0] + x, p[1] + y]) > one.stress(p));
        }
    }

    #[test]
    fn distance_zero_is_that_position_and_nothing_the_origin() {
        let positions = ring();
        let mut distances = vec![1.0; 14];
        distances[5] = 0.0;
        assert_eq!(place_one(&positions, &distances, &[1.0; 14]), positions[5]);
        assert_eq!(place_one(&[], &[], &[]), [0.0, 0.0]);
    }
}
