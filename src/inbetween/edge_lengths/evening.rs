//! Frames across a jump, evened out: a path from one branch to another that keeps lengths as well as it can.
//!
//! Two branches are often the ends of one valley: shapes lead from one to the other that all nearly have the
//! lengths of their frames, but for a soft bend, and a frame embedded alone falls to either end. So frames
//! are held by springs to the middle of those beside, sum ((l - l*) / l*)^2 + k sum |x - (x- + x+) / 2|^2 / m^2
//! with m the mean edge length, one frame after the other, forth through all, while the springs are made
//! softer. Where no valley leads across (a tip that is inside after), soft springs let go and all of the
//! change is left to one step: then nothing is evened.

use super::Embedding;
use super::finishing::{Spring, Wanted};
use super::shape::point;

/// Springs k, ever softer: by the last, steps of a hundredth of an edge weigh as relative errors of 1e-4.
const SPRINGS: [f64; 2] = [1e-3, 1e-4];

/// How often each frame is moved with the same springs.
const SWEEPS: usize = 2;

/// Steps are even where none moves a vertex farther than this many times what they do on average.
const UNEVEN: f64 = 1.15;

impl Embedding {
    /// The frames between the first and the last of a path of positions, evened out; `lengths` has a row for
    /// each of them. The first and the last stay. None where the steps do not become even.
    pub(super) fn evened(
        &self,
        mut path: Vec<Vec<f64>>,
        lengths: &[Vec<f64>],
    ) -> Option<Vec<Vec<f64>>> {
        let mut kept = None;
        let mut found = None;
        for spring in SPRINGS {
            for _ in 0..SWEEPS {
                for (at, lengths) in (1..).zip(lengths) {
                    let beside = path[at - 1].iter().zip(&path[at + 1]);
                    let middle: Vec<f64> = beside.map(|(a, b)| 0.5 * (a + b)).collect();
                    let mean = lengths.iter().sum::<f64>() / lengths.len().max(1) as f64;
                    let wanted = Wanted {
                        edges: self.edges(),
                        lengths,
                        spring: Some(Spring {
                            anchor: &middle,
                            stiffness: spring / (mean * mean),
                        }),
                    };
                    self.finisher.finish(&wanted, &mut path[at], &mut kept);
                }
            }
            // stiff springs may not have got far yet
            if even(&path) {
                found = Some(path[1..path.len() - 1].to_vec());
            }
        }
        found
    }
}

/// Whether no step of a path stands out.
fn even(path: &[Vec<f64>]) -> bool {
    let farthest = |pair: &[Vec<f64>]| {
        let vertices = 0..pair[0].len() as u32 / 3;
        let moves = vertices.map(|v| (point(&pair[1], v) - point(&pair[0], v)).norm());
        moves.fold(0.0, f64::max)
    };
    let steps: Vec<f64> = path.windows(2).map(farthest).collect();
    let mean = steps.iter().sum::<f64>() / steps.len().max(1) as f64;
    steps.iter().all(|step| *step <= UNEVEN * mean)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{ball, icosahedron};
    use super::*;

    #[test]
    fn a_path_that_lengths_allow_is_found_from_a_crooked_one() {
        // a ball that turns keeps its lengths; halfway the straight blend of two places has them shorter
        let (topology, first) = ball(9, 8, 0.1);
        let embedding = Embedding::new(&topology).unwrap();
        let turned = |angle: f64| -> Vec<f64> {
            let (sine, cosine) = angle.sin_cos();
            let each = first.chunks_exact(3);
            each.flat_map(|p| {
                [
                    cosine * p[0] - sine * p[1],
                    sine * p[0] + cosine * p[1],
                    p[2],
                ]
            })
            .collect()
        };
        let last = turned(1.2);
        let blend = |t: f64| -> Vec<f64> {
            let pairs = first.iter().zip(&last);
            pairs.map(|(a, b)| a + t * (b - a)).collect()
        };
        let own = embedding.lengths(&first);
        // places that are not even either
        let path = vec![
            first.clone(),
            blend(0.1),
            blend(0.5),
            blend(0.6),
            last.clone(),
        ];
        let shortest = |pose: &[f64]| {
            let pairs = embedding.lengths(pose).into_iter().zip(&own);
            pairs.map(|(l, own)| l / own).fold(1.0, f64::min)
        };
        assert!(shortest(&path[2]) < 0.9);
        let found = embedding.evened(path, &vec![own.clone(); 3]).unwrap();
        assert!(found.iter().all(|pose| shortest(pose) > 0.99));
    }

    #[test]
    fn a_tip_that_must_pop_is_not_evened() {
        // the icosahedron with a vertex outside and inside: between, its edges are too short
        let (topology, pose) = icosahedron();
        let embedding = Embedding::new(&topology).unwrap();
        let ring = [1, 5, 7, 10, 11];
        let centre = |axis: usize| ring.iter().map(|v| pose[3 * v + axis]).sum::<f64>() / 5.0;
        let mut dented = pose.clone();
        (0..3).for_each(|axis| dented[axis] = 2.0 * centre(axis) - pose[axis]);
        let between = |t: f64| -> Vec<f64> {
            let pairs = pose.iter().zip(&dented);
            pairs.map(|(a, b)| a + t * (b - a)).collect()
        };
        let path: Vec<Vec<f64>> = (0..=5).map(|i| between(f64::from(i) / 5.0)).collect();
        let own = embedding.lengths(&pose);
        assert_eq!(embedding.evened(path, &vec![own; 4]), None);
    }
}
