//! Errors of edge lengths (compare Rojas et al. 2014, Fig. 12), which do not see rigid motion. With l
//! the lengths of the reference and m the other's, over all edges and frames:
//!
//! - rms: `100 sqrt(mean (m - l)^2) / mean l`;
//! - max: `100 max |m - l| / l`; where l is 0, the mean of l stands below.

use rayon::prelude::*;

use super::FramePair;
use super::karni_gotsman::percent;
use crate::mesh::Edges;

/// Edges measured by one worker.
const CHUNK: usize = 4096;

/// The errors of edge lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EdgeErrors {
    /// Root mean square error, in percent of the mean length.
    pub rms_percent: f64,
    /// Largest error, in percent of the edge's own length.
    pub max_percent: f64,
}

/// Gathers [`EdgeErrors`] from blocks of frames.
#[derive(Debug, Clone)]
pub struct EdgeLengths {
    ends: Vec<[u32; 2]>,
    count: usize,
    sums: Sums,
}

#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    length: f64,
    squares: f64,
    ratio: f64,
    /// Largest error of an edge without length.
    from_nothing: f64,
}

impl EdgeLengths {
    /// Nothing gathered yet, for these edges.
    pub fn new(edges: &Edges) -> Self {
        EdgeLengths {
            ends: edges.ends().to_vec(),
            count: 0,
            sums: Sums::default(),
        }
    }

    /// Adds the next frames.
    pub fn add(&mut self, block: &[FramePair]) {
        for pair in block {
            let parts: Vec<Sums> = self
                .ends
                .par_chunks(CHUNK)
                .map(|ends| Sums::of(ends, pair))
                .collect();
            parts.iter().for_each(|part| self.sums.join(part));
            self.count += self.ends.len();
        }
    }

    /// The errors over all frames so far; 0 without edges.
    pub fn errors(&self) -> EdgeErrors {
        let count = self.count.max(1) as f64;
        let mean = self.sums.length / count;
        EdgeErrors {
            rms_percent: percent((self.sums.squares / count).sqrt(), mean),
            max_percent: (100.0 * self.sums.ratio).max(percent(self.sums.from_nothing, mean)),
        }
    }
}

impl Sums {
    fn of(ends: &[[u32; 2]], pair: &FramePair) -> Self {
        let mut sums = Sums::default();
        for &edge in ends {
            let length = distance(&pair.first, edge);
            let error = (distance(&pair.second, edge) - length).abs();
            sums.length += length;
            sums.squares += error * error;
            if length > 0.0 {
                sums.ratio = sums.ratio.max(error / length);
            } else {
                sums.from_nothing = sums.from_nothing.max(error);
            }
        }
        sums
    }

    fn join(&mut self, other: &Sums) {
        self.length += other.length;
        self.squares += other.squares;
        self.ratio = self.ratio.max(other.ratio);
        self.from_nothing = self.from_nothing.max(other.from_nothing);
    }
}

fn distance(positions: &[f32], [a, b]: [u32; 2]) -> f64 {
    let (a, b) = (3 * a as usize, 3 * b as usize);
    (0..3)
        .map(|axis| f64::from(positions[a + axis]) - f64::from(positions[b + axis]))
        .map(|difference| difference * difference)
        .sum::<f64>()
        .sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Topology;

    fn errors(first: &[f32], second: &[f32]) -> EdgeErrors {
        let topology = Topology::from_triangles(first.len() / 3, &[[0, 1, 2]]).unwrap();
        let mut metric = EdgeLengths::new(&Edges::new(&topology));
        metric.add(&[FramePair {
            first: first.to_vec(),
            second: second.to_vec(),
        }]);
        metric.errors()
    }

    const TRIANGLE: [f32; 9] = [0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0, 0.0];

    #[test]
    fn rigid_motion_is_not_seen() {
        let turned = [1.0, 1.0, 5.0, 1.0, 4.0, 5.0, -3.0, 1.0, 5.0];
        let found = errors(&TRIANGLE, &turned);
        assert_eq!((found.rms_percent, found.max_percent), (0.0, 0.0));
    }

    #[test]
    fn a_scaled_mesh_is_off_by_its_scale() {
        for size in [1e-8f32, 1.0, 1e8] {
            let small = TRIANGLE.map(|x| x * size);
            let found = errors(&small, &small.map(|x| 1.5 * x));
            // Lengths 3, 4, 5: mean 4, root mean square sqrt(50/3). Positions are rounded to f32.
            let expected = 50.0 * (50f64 / 3.0).sqrt() / 4.0;
            assert!((found.max_percent - 50.0).abs() < 1e-4);
            assert!((found.rms_percent / expected - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn an_edge_without_length_is_held_against_the_mean() {
        let folded = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0];
        let opened = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 3.0, 0.0, 0.0];
        assert_eq!(errors(&folded, &opened).max_percent, 50.0);
    }
}
