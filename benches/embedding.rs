//! Table 1 of Rojas et al. 2014: the time of one embedding. The paper needs 3.9 minutes for an arm of 2,502
//! vertices, 9.1 for a hand of 10,000, 9.6 for a centaur of 15,768 and 20.6 for a face of 58,327. Here a
//! bent and dented tube of as many vertices, half way between two poses: cold (connectivity analysed,
//! dihedral angles blended) and warm (the frame before known). One factorisation of the same system stands
//! beside them as the baseline. Run with `cargo bench --bench embedding`.

use std::f64::consts::TAU;

use divan::{Bencher, black_box};
use meshloom::inbetween::edge_lengths::{Blend, Embedded, Embedding, KeyShapes, Memory};
use meshloom::math::block_sparse::BlockPattern;
use meshloom::mesh::Topology;

fn main() {
    divan::main();
}

/// Vertices of the arm, the hand, the centaur and the face.
const SIZES: &[usize] = &[2_502, 10_000, 15_768, 58_327];

/// A closed tube of about `vertices` vertices whose axis is bent by `turn` radians, with dents that are
/// `deep`.
fn tube(vertices: usize, turn: f64, deep: f64) -> (Topology, Vec<f64>) {
    let around = (((vertices - 2) as f64 / 6.0).sqrt() as usize).max(8);
    let rings = (vertices - 2) / around;
    let place = |x: f64, angle: f64, inside: f64| {
        let r = inside * (0.4 + deep * (9.0 * x).sin() * (3.0 * angle).cos());
        let (y, z) = (r * angle.cos(), r * angle.sin());
        let radius = 4.0 / turn;
        let (sine, cosine) = (x / radius).sin_cos();
        [(radius - y) * sine, radius - (radius - y) * cosine, z]
    };
    let mut positions = Vec::new();
    for i in 0..rings {
        let x = 4.0 * (i as f64 + 0.5) / rings as f64 - 2.0;
        (0..around).for_each(|j| positions.extend(place(x, TAU * j as f64 / around as f64, 1.0)));
    }
    positions.extend(place(-2.1, 0.0, 0.0));
    positions.extend(place(2.1, 0.0, 0.0));
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let mut triangles = Vec::new();
    for j in 0..around {
        for i in 0..rings - 1 {
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([at(rings, 0), at(0, j + 1), at(0, j)]);
        triangles.push([at(rings, 1), at(rings - 1, j), at(rings - 1, j + 1)]);
    }
    let topology = Topology::from_triangles(positions.len() / 3, &triangles);
    (topology.expect("a tube"), positions)
}

fn poses(vertices: usize) -> (Topology, Vec<f64>, Vec<f64>) {
    let (topology, first) = tube(vertices, 0.2, 0.03);
    let (_, second) = tube(vertices, 1.9, 0.05);
    (topology, first, second)
}

/// Connectivity, poses and one frame from nothing.
#[divan::bench(args = SIZES, sample_count = 1, sample_size = 1)]
fn cold(bencher: Bencher, vertices: usize) {
    let (topology, first, second) = poses(vertices);
    bencher.bench_local(|| {
        let embedding = Embedding::new(&topology).expect("a tube fits in memory");
        let keys = KeyShapes::new(&embedding, &[&first, &second]);
        let target = keys.blend(&[0.5, 0.5], Blend::Lengths);
        black_box(
            embedding
                .embed(&target, &mut Memory::default())
                .expect("triangles"),
        )
    });
}

/// The next of a hundred frames.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn warm(bencher: Bencher, vertices: usize) {
    let (topology, first, second) = poses(vertices);
    let embedding = Embedding::new(&topology).expect("a tube fits in memory");
    let keys = KeyShapes::new(&embedding, &[&first, &second]);
    let mut memory = Memory::default();
    let before = keys.blend(&[0.5, 0.5], Blend::Lengths);
    let found: Embedded = embedding.embed(&before, &mut memory).expect("triangles");
    let mut target = keys.blend(&[0.49, 0.51], Blend::Lengths);
    for (angle, (found, blended)) in target
        .dihedrals
        .iter_mut()
        .zip(found.dihedrals.iter().zip(&before.dihedrals))
    {
        *angle += found - blended;
    }
    bencher.bench_local(|| black_box(embedding.embed(&target, &mut memory).expect("triangles")));
}

/// The baseline: one factorisation of a system with the same blocks.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn one_factorisation(bencher: Bencher, vertices: usize) {
    let (topology, _, _) = poses(vertices);
    let embedding = Embedding::new(&topology).expect("a tube fits in memory");
    let pattern =
        BlockPattern::new(vertices.max(topology.vertices()), embedding.edges()).expect("it fits");
    let mut entries = vec![0.0; pattern.analysis().pattern().entries()];
    for (edge, &[a, b]) in embedding.edges().iter().enumerate() {
        let block = nalgebra::Matrix3::identity();
        pattern.add_node(&mut entries, a as usize, &block);
        pattern.add_node(&mut entries, b as usize, &block);
        pattern.add_link(&mut entries, edge, &-block);
    }
    pattern.shift(&mut entries, 1e-3);
    bencher.bench_local(|| {
        black_box(
            pattern
                .analysis()
                .factor(&entries)
                .expect("positive definite"),
        )
    });
}
