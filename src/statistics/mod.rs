//! Statistics of shapes: mean, principal components, differences, in any shape space or in edge lengths
//! (Rojas et al. 2014, §4.3).
//!
//! Rigid motion is no difference of shape: poses are aligned with the first one before anything else.
//! Where size is none either ([`scale_free`]), poses are scaled to the same sum of edge lengths, their
//! mean (R14, equation 12, up to that factor).

mod ground;
mod lengths;
mod population;

pub use ground::{ByLengths, EDGE_LENGTHS, Ground, Returned};
pub use lengths::Way;
pub use population::Population;

use nalgebra::Point3;

use crate::mesh::rigid_align::rigid;

/// Poses moved rigidly so that each lies nearest the first.
#[must_use]
pub fn aligned(poses: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let Some(first) = poses.first() else {
        return Vec::new();
    };
    let laid = |pose: &Vec<f64>| {
        let motion = rigid(pose, first);
        let points = pose.chunks_exact(3).map(Point3::from_slice);
        points.flat_map(|p| (motion * p).coords.data.0[0]).collect()
    };
    poses.iter().map(laid).collect()
}

/// Poses scaled about the origin so that all have the mean of the sums of their edge lengths. A pose
/// without any length stays.
#[must_use]
pub fn scale_free(poses: &[Vec<f64>], edges: &[[u32; 2]]) -> Vec<Vec<f64>> {
    let sums: Vec<f64> = poses
        .iter()
        .map(|pose| edges.iter().map(|&edge| length(pose, edge)).sum())
        .collect();
    let mean = sums.iter().sum::<f64>() / sums.len().max(1) as f64;
    let scaled = |(pose, &sum): (&Vec<f64>, &f64)| {
        let factor = if sum > 0.0 { mean / sum } else { 1.0 };
        pose.iter().map(|x| x * factor).collect()
    };
    poses.iter().zip(&sums).map(scaled).collect()
}

/// The length of an edge of a shape of 3V positions.
fn length(positions: &[f64], [a, b]: [u32; 2]) -> f64 {
    let (a, b) = (3 * a as usize, 3 * b as usize);
    let sides = (0..3).map(|axis| positions[a + axis] - positions[b + axis]);
    sides.map(|x| x * x).sum::<f64>().sqrt()
}

/// Root mean square distance of the vertices of two shapes, the second aligned with the first: what
/// R14 compares edge lengths with (Fig. 7, 8).
///
/// # Panics
/// The shapes differ in length.
pub fn aligned_rms(a: &[f64], b: &[f64]) -> f64 {
    let motion = rigid(b, a);
    let pairs = a.chunks_exact(3).zip(b.chunks_exact(3));
    let squares: f64 = pairs
        .map(|(p, q)| (Point3::from_slice(p) - motion * Point3::from_slice(q)).norm_squared())
        .sum();
    (squares / (a.len() / 3).max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::math::rotation::exp;
    use crate::mesh::Topology;
    use crate::space::SPACES;
    use crate::task::Task;
    use nalgebra::Vector3;

    /// A tube of 6 rings of 5 vertices, bent by `bend` radians and `wide`.
    fn tube(bend: f64, wide: f64) -> (Arc<Topology>, Vec<f64>) {
        let at = |i: usize, j: usize| (5 * i + j % 5) as u32;
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for i in 0..6 {
            let (s, c) = libm::sincos(bend * i as f64 / 5.0);
            for j in 0..5 {
                let (v, u) = libm::sincos(1.256 * j as f64);
                let out = 4.0 + wide * u;
                positions.extend([
                    out * s,
                    out * c,
                    wide * v + if bend == 0.0 { i as f64 } else { 0.0 },
                ]);
                if i > 0 {
                    let [a, b, c, d] = [at(i - 1, j), at(i - 1, j + 1), at(i, j + 1), at(i, j)];
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        (
            Arc::new(Topology::from_triangles(30, &triangles).unwrap()),
            positions,
        )
    }

    fn poses() -> (Arc<Topology>, Vec<Vec<f64>>) {
        let shapes = [(0.9, 1.0), (1.2, 1.1), (1.5, 0.9), (1.1, 0.8)].map(|(b, w)| tube(b, w));
        let topology = Arc::clone(&shapes[0].0);
        let poses: Vec<_> = shapes.into_iter().map(|(_, pose)| pose).collect();
        (topology, aligned(&poses))
    }

    fn grounds() -> impl Iterator<Item = &'static str> {
        SPACES.iter().map(|kind| kind.name).chain([EDGE_LENGTHS])
    }

    fn population(
        name: &str,
        topology: &Arc<Topology>,
        poses: &[Vec<f64>],
    ) -> (Ground, Population) {
        let ground = Ground::open(name, topology, poses).unwrap();
        let population = Population::new(&ground, poses, &Task::default()).unwrap();
        (ground, population)
    }

    #[test]
    fn coordinates_keep_distances_and_shares_sum_to_one() {
        let (topology, poses) = poses();
        for name in grounds() {
            let (ground, found) = population(name, &topology, &poses);
            assert_eq!(found.modes(), 3, "{name}: four poses span three modes");
            assert!((found.explained().iter().sum::<f64>() - 1.0).abs() < 1e-9);
            let codes: Vec<_> = poses.iter().map(|pose| ground.encode(pose)).collect();
            let distance = |a: &[f64], b: &[f64]| {
                let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
                squares.sum::<f64>().sqrt()
            };
            for i in 1..4 {
                let full = distance(&codes[0], &codes[i]);
                let here = distance(found.coordinates(0), found.coordinates(i));
                assert!((full - here).abs() < 1e-8 * full, "{name}");
            }
        }
    }

    #[test]
    fn a_pose_is_the_mean_and_its_way_along_the_modes() {
        let (topology, poses) = poses();
        for name in grounds() {
            let (ground, found) = population(name, &topology, &poses);
            let code = found.at(found.coordinates(2));
            let weights = found.weights(found.coordinates(2));
            let shape = ground.decode(&code, &weights).unwrap();
            // the spaces promise 1e-6 of the box, of size 8
            assert!(aligned_rms(&poses[2], &shape.positions) < 1e-5, "{name}");
            let way = shape.by.map(|by| by.way);
            assert_eq!(way, (name == EDGE_LENGTHS).then_some(Way::Embedding));
        }
    }

    #[test]
    fn the_mean_of_copies_is_the_copy_and_has_no_modes() {
        let (topology, poses) = poses();
        let turn = exp(&Vector3::new(0.4, 1.0, -0.7));
        let turned = poses[0].chunks_exact(3).flat_map(|p| {
            (turn * Vector3::from_column_slice(p) + Vector3::repeat(3.0))
                .data
                .0[0]
        });
        let copies = aligned(&[poses[0].clone(), turned.collect()]);
        for name in grounds() {
            let (ground, found) = population(name, &topology, &copies);
            assert!(found.sigmas().iter().all(|sigma| *sigma < 1e-6), "{name}");
            let mean = ground.decode(found.mean(), &[0.5, 0.5]).unwrap();
            assert!(aligned_rms(&copies[0], &mean.positions) < 1e-6, "{name}");
        }
    }

    #[test]
    fn size_does_not_show_where_it_should_not() {
        let (topology, poses) = poses();
        let edges = crate::mesh::Edges::new(&topology);
        let large: Vec<f64> = poses[0].iter().map(|x| 3.0 * x).collect();
        let free = scale_free(&[poses[0].clone(), large], edges.ends());
        assert!(aligned_rms(&free[0], &free[1]) < 1e-12);
        let total =
            |pose: &Vec<f64>| -> f64 { edges.ends().iter().map(|&edge| length(pose, edge)).sum() };
        assert!((total(&free[0]) / total(&poses[0]) - 2.0).abs() < 1e-12);
    }

    #[test]
    fn a_difference_added_where_it_comes_from_leads_where_it_goes() {
        let (topology, poses) = poses();
        for name in grounds() {
            let ground = Ground::open(name, &topology, &poses).unwrap();
            let decoded = |code: &[f64], weights: [f64; 4]| {
                let shape = ground.decode(code, &weights).unwrap();
                shape.positions
            };
            let code = ground.moved(&poses[0], &poses[0], &poses[1]);
            let shape = decoded(&code, [0.0, 1.0, 0.0, 0.0]);
            assert!(aligned_rms(&poses[1], &shape) < 1e-5, "{name}");
            let none = ground.moved(&poses[2], &poses[1], &poses[1]);
            let same = decoded(&none, [0.0, 0.0, 1.0, 0.0]);
            assert!(aligned_rms(&poses[2], &same) < 1e-5, "{name}");
        }
    }

    #[test]
    fn lengths_that_no_triangle_has_are_named() {
        let (topology, poses) = poses();
        let ground = Ground::open(EDGE_LENGTHS, &topology, &poses).unwrap();
        let mut code = ground.encode(&poses[0]);
        assert_eq!(ground.broken(&code), None);
        code[0] = 100.0;
        assert!(ground.broken(&code).is_some());
        let space = Ground::open("vertices", &topology, &poses).unwrap();
        assert_eq!(space.broken(&space.encode(&poses[0])), None);
    }
}
