//! Whether frames are a motion or poses.

use crate::mesh::{FrameSource, Sequence};

/// More frames than this are not looked through.
const MOST: usize = 64;
/// So many vertices at most say how far frames are from each other.
const VERTICES: usize = 1000;
/// In a motion the next frame is nearer than others: steps below this share of the mean distance. A straight
/// motion of three frames has 0.75; poses that have nothing to do with each other have about 1.
const SHARE: f64 = 0.8;

/// Whether the frames are separate poses, not a motion: the next one is about as far away as any other.
/// Where they stand does not count. One frame, and more than 64, are never.
pub fn separate(frames: &Sequence) -> bool {
    let n = frames.frames();
    if !(2..=MOST).contains(&n) {
        return false;
    }
    let shapes: Vec<Vec<f64>> = (0..n).map(|frame| centred(frames.frame(frame))).collect();
    let distance = |a: usize, b: usize| -> f64 {
        let pairs = shapes[a].iter().zip(&shapes[b]);
        libm::sqrt(pairs.map(|(x, y)| (x - y) * (x - y)).sum())
    };
    let steps: f64 = (1..n).map(|b| distance(b - 1, b)).sum();
    let all: f64 = (1..n)
        .flat_map(|b| (0..b).map(move |a| (a, b)))
        .map(|(a, b)| distance(a, b))
        .sum();
    let pairs = (n * (n - 1) / 2) as f64;
    steps / (n - 1) as f64 > SHARE * all / pairs
}

/// Some of the vertices, about their mean.
fn centred(positions: &[f32]) -> Vec<f64> {
    let step = (positions.len() / 3).div_ceil(VERTICES).max(1);
    let points = positions.chunks_exact(3).step_by(step);
    let mut some: Vec<f64> = points.flatten().map(|&x| f64::from(x)).collect();
    let count = (some.len() / 3).max(1) as f64;
    for axis in 0..3 {
        let sum: f64 = some.iter().skip(axis).step_by(3).sum();
        for x in some.iter_mut().skip(axis).step_by(3) {
            *x -= sum / count;
        }
    }
    some
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::demo::{DEMOS, Kind};
    use crate::mesh::Topology;

    fn corners(places: &[f32]) -> Sequence {
        let topology = Arc::new(Topology::from_triangles(3, &[[0, 1, 2]]).unwrap());
        let shape = |x: &f32| [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, *x, 1.0, 0.0];
        Sequence::new(topology, places.iter().flat_map(shape).collect(), None)
    }

    #[test]
    fn steps_on_a_line_are_a_motion_and_leaps_are_poses() {
        assert!(!separate(&corners(&[0.0, 1.0, 2.0])));
        assert!(!separate(&corners(&[0.0, 1.0, 2.0, 3.0, 2.0, 1.0])));
        assert!(separate(&corners(&[0.0, 3.0, 1.0, 4.0])));
        assert!(separate(&corners(&[0.0, 1.0])));
        for few in [&[][..], &[1.0], &[1.0, 1.0]] {
            assert!(!separate(&corners(few)));
        }
    }

    #[test]
    fn built_in_captures_are_what_they_say() {
        for demo in DEMOS {
            let frames = demo.generate();
            // The bar twists to and fro between what it does.
            let some = frames.slice(0..frames.frames().min(16));
            assert_eq!(separate(&some), demo.kind == Kind::Poses, "{}", demo.name);
        }
    }
}
