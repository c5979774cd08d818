//! Errors of positions. With A the 3V x n matrix of the reference and B the other's:
//!
//! - KG error (Karni & Gotsman 2004; Xia et al. 2019 eq. 7): `100 |A - B| / |A - E(A)|` in Frobenius
//!   norms, E(A) repeating for every frame the mean over frames of each coordinate;
//! - root mean square and maximum of the distances between corresponding vertices.
//!
//! `|A - E(A)|^2` is updated frame by frame as in Welford (1962), so it does not cancel far from the
//! origin and needs one pass.

use rayon::prelude::*;

use super::FramePair;

/// Coordinates summed by one worker: whole vertices, and a few pages of state.
const CHUNK: usize = 3 * 2048;

/// The errors of positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VertexErrors {
    /// KG error in percent; infinite when the reference never moves but the other differs, 0 when
    /// both are the same.
    pub kg_percent: f64,
    /// Root mean square distance of corresponding vertices, in the mesh's units.
    pub rms: f64,
    /// Largest distance of corresponding vertices, in the mesh's units.
    pub max: f64,
}

/// Gathers [`VertexErrors`] from blocks of frames.
#[derive(Debug, Clone)]
pub struct KarniGotsman {
    vertices: usize,
    frames: usize,
    parts: Vec<Part>,
}

/// The sums over some coordinates.
#[derive(Debug, Clone)]
struct Part {
    mean: Vec<f64>,
    spread: f64,
    difference: f64,
    farthest: f64,
}

impl KarniGotsman {
    /// Nothing gathered yet, for frames of `vertices` vertices.
    pub fn new(vertices: usize) -> Self {
        let parts = (0..3 * vertices)
            .step_by(CHUNK)
            .map(|start| Part {
                mean: vec![0.0; CHUNK.min(3 * vertices - start)],
                spread: 0.0,
                difference: 0.0,
                farthest: 0.0,
            })
            .collect();
        KarniGotsman {
            vertices,
            frames: 0,
            parts,
        }
    }

    /// Adds the next frames.
    pub fn add(&mut self, block: &[FramePair]) {
        let before = self.frames;
        self.parts
            .par_iter_mut()
            .enumerate()
            .for_each(|(at, part)| {
                let start = at * CHUNK;
                let range = start..start + part.mean.len();
                for (frame, pair) in block.iter().enumerate() {
                    part.add_spread(&pair.first[range.clone()], before + frame + 1);
                    part.add_difference(&pair.first[range.clone()], &pair.second[range.clone()]);
                }
            });
        self.frames += block.len();
    }

    /// The errors over all frames so far; all 0 without frames or vertices.
    pub fn errors(&self) -> VertexErrors {
        let spread: f64 = self.parts.iter().map(|part| part.spread).sum();
        let difference: f64 = self.parts.iter().map(|part| part.difference).sum();
        let farthest = self.parts.iter().map(|part| part.farthest);
        let pairs = (self.vertices * self.frames).max(1) as f64;
        VertexErrors {
            kg_percent: percent(difference.sqrt(), spread.sqrt()),
            rms: (difference / pairs).sqrt(),
            max: farthest.fold(0.0, f64::max).sqrt(),
        }
    }
}

impl Part {
    /// Welford's update of mean and sum of squares by the `count`-th frame.
    fn add_spread(&mut self, coordinates: &[f32], count: usize) {
        let share = 1.0 / count as f64;
        let mut sum = 0.0;
        for (mean, &coordinate) in self.mean.iter_mut().zip(coordinates) {
            let step = f64::from(coordinate) - *mean;
            *mean += step * share;
            sum += step * (f64::from(coordinate) - *mean);
        }
        self.spread += sum;
    }

    fn add_difference(&mut self, first: &[f32], second: &[f32]) {
        let mut sum = 0.0;
        for (a, b) in first.chunks_exact(3).zip(second.chunks_exact(3)) {
            let squared: f64 = (0..3)
                .map(|axis| f64::from(a[axis]) - f64::from(b[axis]))
                .map(|difference| difference * difference)
                .sum();
            sum += squared;
            self.farthest = self.farthest.max(squared);
        }
        self.difference += sum;
    }
}

/// `100 part / whole`; 0 where both vanish.
pub(super) fn percent(part: f64, whole: f64) -> f64 {
    if part == 0.0 {
        0.0
    } else {
        100.0 * part / whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pairs(first: &[Vec<f64>], second: &[Vec<f64>]) -> Vec<FramePair> {
        let narrow = |frame: &Vec<f64>| frame.iter().map(|&x| x as f32).collect();
        first
            .iter()
            .zip(second)
            .map(|(a, b)| FramePair {
                first: narrow(a),
                second: narrow(b),
            })
            .collect()
    }

    fn errors(vertices: usize, first: &[Vec<f64>], second: &[Vec<f64>]) -> VertexErrors {
        let mut metric = KarniGotsman::new(vertices);
        pairs(first, second)
            .chunks(3)
            .for_each(|block| metric.add(block));
        metric.errors()
    }

    /// V vertices that swing, and the same with an error of relative size `noise`.
    fn swing(scale: f64, shift: f64, noise: f64) -> [Vec<Vec<f64>>; 2] {
        let at = |frame: usize, i: usize| ((frame * 7 + i * 3) % 11) as f64 - 5.0;
        [0.0, noise].map(|noise| {
            (0..8)
                .map(|frame| {
                    (0..12_000)
                        .map(|i| scale * (at(frame, i) + noise * (i % 2) as f64) + shift)
                        .collect()
                })
                .collect()
        })
    }

    /// The definition, in two passes and f64.
    fn by_definition(first: &[Vec<f64>], second: &[Vec<f64>]) -> f64 {
        let n = first.len() as f64;
        let (mut above, mut below) = (0.0, 0.0);
        for i in 0..first[0].len() {
            let mean = first.iter().map(|frame| frame[i]).sum::<f64>() / n;
            for (a, b) in first.iter().zip(second) {
                above += (a[i] - b[i]).powi(2);
                below += (a[i] - mean).powi(2);
            }
        }
        100.0 * (above / below).sqrt()
    }

    #[test]
    fn it_is_the_definition_at_any_scale() {
        for scale in [1e-8, 1.0, 1e8] {
            let [first, second] = swing(scale, 0.0, 0.25);
            let expected = by_definition(&first, &second);
            let found = errors(4000, &first, &second).kg_percent;
            // Positions pass through f32: relative rounding 6e-8 of each, against errors of 1/20.
            assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
        }
    }

    #[test]
    fn far_from_the_origin_nothing_cancels() {
        // 2^20 away, steps of 1/4 are exact in f32; the two results differ by f64 rounding only.
        let [first, second] = swing(1.0, f64::from(1 << 20), 0.25);
        let [near, near_second] = swing(1.0, 0.0, 0.25);
        let (far, near) = (
            errors(4000, &first, &second),
            errors(4000, &near, &near_second),
        );
        assert!((far.kg_percent / near.kg_percent - 1.0).abs() < 1e-9);
        assert_eq!((far.rms, far.max), (near.rms, near.max));
    }

    #[test]
    fn one_moved_vertex_has_the_distance_it_was_moved() {
        let still = vec![vec![0.0; 9]; 4];
        let mut moved = still.clone();
        moved[2][3..6].copy_from_slice(&[2.0, 3.0, 6.0]);
        let found = errors(3, &still, &moved);
        assert_eq!(found.max, 7.0);
        assert!((found.rms - 7.0 / 12f64.sqrt()).abs() < 1e-12);
        assert!(found.kg_percent.is_infinite());
        assert_eq!(errors(3, &still, &still).kg_percent, 0.0);
    }

    #[test]
    fn the_mean_frame_in_place_of_all_is_100_percent() {
        let [first, _] = swing(1.0, 0.0, 0.0);
        let n = first.len() as f64;
        let mean: Vec<f64> = (0..first[0].len())
            .map(|i| first.iter().map(|frame| frame[i]).sum::<f64>() / n)
            .collect();
        let found = errors(4000, &first, &vec![mean; first.len()]).kg_percent;
        // The mean is rounded to f32 (6e-8).
        assert!((found - 100.0).abs() < 1e-4, "{found}");
    }
}
