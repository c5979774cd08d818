//! Tubes that bend, and how their motions are compared.

use std::sync::Arc;

use meshloom::inbetween::{CompleteOptions, Keys, Motion, complete};
use meshloom::mesh::{Sequence, Topology};
use meshloom::task::Task;
use nalgebra::{Rotation3, Vector3};

/// A tube along x of `length` rings of `around` vertices, 4 long.
pub(crate) fn tube(length: usize, around: usize) -> (Arc<Topology>, Vec<f64>) {
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..length {
        for j in 0..around {
            let angle = std::f64::consts::TAU * j as f64 / around as f64;
            let x = 4.0 * i as f64 / (length - 1) as f64 - 2.0;
            points.extend([x, 0.4 * angle.cos(), 0.4 * angle.sin()]);
            if i > 0 {
                let [a, b, c, d] = [at(i - 1, j), at(i - 1, j + 1), at(i, j + 1), at(i, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let topology = Topology::from_triangles(length * around, &triangles).unwrap();
    (Arc::new(topology), points)
}

/// The tube bent about z by `bend` radians in all, then turned about y.
pub(crate) fn bent(points: &[f64], bend: f64, turn: f64) -> Vec<f64> {
    let turn = Rotation3::from_axis_angle(&Vector3::y_axis(), turn);
    let point = |p: &[f64]| {
        let place = if bend == 0.0 {
            Vector3::new(p[0], p[1], p[2])
        } else {
            let radius = 4.0 / bend;
            let (sine, cosine) = (p[0] / radius).sin_cos();
            Vector3::new(
                (radius - p[1]) * sine,
                radius - (radius - p[1]) * cosine,
                p[2],
            )
        };
        (turn * place).data.0[0]
    };
    points.chunks_exact(3).flat_map(point).collect()
}

pub(crate) fn sequence(topology: &Arc<Topology>, shapes: &[Vec<f64>]) -> Sequence {
    let values = shapes.concat().into_iter().map(|x| x as f32).collect();
    Sequence::new(Arc::clone(topology), values, None)
}

/// Four bends of the tube at uneven times.
pub(crate) fn bends() -> Keys {
    let (topology, points) = tube(14, 8);
    let poses = [(0.0, 0.0), (1.2, 0.4), (-0.5, 1.0), (0.8, 0.2)];
    let shapes = poses.map(|(bend, turn)| bent(&points, bend, turn));
    let times = vec![-3.0, 1.0, 2.5, 11.0];
    Keys::new(sequence(&topology, &shapes), Some(times)).unwrap()
}

pub(crate) fn motion(keys: &Keys, options: &CompleteOptions) -> Motion {
    complete(keys, options, &Task::default()).unwrap().output
}

pub(crate) fn in_space(space: &str) -> CompleteOptions {
    CompleteOptions {
        space: space.to_string(),
        ..CompleteOptions::default()
    }
}

pub(crate) fn farthest(a: &[f64], b: &[f64]) -> f64 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Relative to the tube's length: what the issue promises of keys.
pub(crate) const REPRODUCED: f64 = 4.0 * 1e-6;

pub(crate) fn reproduces(keys: &Keys, motion: &Motion, what: &str) {
    for (key, &time) in keys.times().iter().enumerate() {
        let error = farthest(&motion.at(time), &keys.pose(key));
        assert!(error < REPRODUCED, "{what}, key {}: {error}", key + 1);
    }
}

/// The sides of all triangles.
pub(crate) fn lengths(topology: &Topology, positions: &[f64]) -> Vec<f64> {
    let point = |v: u32| Vector3::from_column_slice(&positions[3 * v as usize..][..3]);
    let sides = topology
        .triangles()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    sides.map(|[a, b]| (point(a) - point(b)).norm()).collect()
}
