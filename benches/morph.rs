//! Morphs a frame: `cargo bench --bench morph`. Best of several runs, each beside a baseline of the same
//! run: for polygons and skeletons the straight blend of all coordinates (what must be touched), for
//! meshes one decode of the space `gradients` (one solve of the same system). Goals: polygons and
//! skeletons O(n) from 10^3 to 10^6, 20 000 faces in at most 20 ms a frame.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use meshloom::inbetween::isometric::{Alignment, Connectivity, Isometric};
use meshloom::inbetween::polygon::Polygon;
use meshloom::inbetween::skeleton::SkeletonMorph;
use meshloom::mesh::{Cost, Hinges, Joint, Skeleton, Topology, VertexCorners, dual_trees};
use meshloom::space::Spaces;

fn main() {
    println!("what            n         a frame      ns each   against the baseline");
    for n in [1_000, 10_000, 100_000, 1_000_000] {
        polygon(n);
    }
    for n in [1_000, 10_000, 100_000, 1_000_000] {
        skeleton(n);
    }
    for faces in [2_000, 20_000, 85_000] {
        mesh(faces);
    }
}

fn row(what: &str, n: usize, seconds: f64, baseline: f64) {
    println!(
        "{what:<12} {n:>8}  {:>9.3} ms  {:>9.1}   {:>8.2} times",
        1e3 * seconds,
        1e9 * seconds / n as f64,
        seconds / baseline
    );
}

/// Seconds of the fastest of several runs that last about a second together.
fn shortest(mut run: impl FnMut()) -> f64 {
    let begin = Instant::now();
    let mut best = f64::INFINITY;
    let mut runs = 0;
    while runs < 3 || (runs < 200 && begin.elapsed().as_secs_f64() < 0.7) {
        let start = Instant::now();
        run();
        best = best.min(start.elapsed().as_secs_f64());
        runs += 1;
    }
    best
}

/// Seconds of the straight blend of two poses.
fn blended(from: &[f64], to: &[f64]) -> f64 {
    let mut out = vec![0.0; from.len()];
    shortest(|| {
        for ((out, a), b) in out.iter_mut().zip(from).zip(to) {
            *out = a * 0.6 + b * 0.4;
        }
        black_box(&mut out);
    })
}

/// A ribbon of `n` triangles that winds and bends.
fn ribbon(n: usize, bend: f64) -> Vec<f64> {
    let mut positions = Vec::with_capacity(3 * (n + 2));
    let (mut x, mut y) = (0.0, 0.0);
    for i in 0..n + 2 {
        let heading = bend * (i / 2) as f64 / n as f64;
        let (sine, cosine) = heading.sin_cos();
        let side = if i % 2 == 0 { -0.5 } else { 0.5 };
        positions.extend([
            x - side * sine,
            y + side * cosine,
            0.01 * bend * side * heading,
        ]);
        if i % 2 == 1 {
            (x, y) = (x + cosine, y + sine);
        }
    }
    positions
}

fn polygon(n: usize) {
    let (from, to) = (ribbon(n - 2, 3.0), ribbon(n - 2, 20.0));
    let triangles: Vec<[u32; 3]> = (0..n as u32 - 2).map(|i| [i, i + 1, i + 2]).collect();
    let corners = VertexCorners::new(n, &triangles);
    let hinges = Hinges::new(n, &triangles, &corners);
    let cost = |hinge: usize| Cost {
        weight: 0.0,
        place: [hinge as f64, 0.0, 0.0],
    };
    let trees = dual_trees(triangles.len(), hinges.hinges(), cost, |f| [f as f64; 3]);
    let morph = Polygon::new(&triangles, &trees[0], &from, &to);
    let mut out = vec![0.0; from.len()];
    let seconds = shortest(|| morph.at(0.4, &from, &to, black_box(&mut out)));
    row("polygon", n, seconds, blended(&from, &to));
}

fn skeleton(n: usize) {
    let joints = (0..n).map(|joint| Joint {
        name: String::new(),
        parent: (joint > 0).then(|| (joint - 1 - joint * 7 % 5.min(joint)) as u32),
    });
    let skeleton = Skeleton::new(joints.collect()).expect("a tree");
    let pose = |shift: f64| -> Vec<f64> {
        let coordinate = |i: usize| (0.37 * i as f64 + shift * (i % 3) as f64).sin();
        (0..3 * n).map(coordinate).collect()
    };
    let (from, to) = (pose(0.0), pose(0.5));
    let morph = SkeletonMorph::new(&skeleton, &from, &to, Alignment::Rigid);
    let mut out = vec![0.0; from.len()];
    let seconds = shortest(|| morph.at(0.4, black_box(&mut out)));
    row("skeleton", n, seconds, blended(&from, &to));
}

/// A torus of about `faces` triangles; `bend` deforms it.
fn torus(faces: usize, bend: f64) -> (Topology, Vec<f64>) {
    let rows = ((faces / 2) as f64).sqrt() as usize;
    let columns = faces / 2 / rows;
    let at = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..rows {
        for j in 0..columns {
            let (u, v) = (
                TAU * i as f64 / rows as f64,
                TAU * j as f64 / columns as f64,
            );
            let dent = 0.4 + 0.03 * (9.0 * u).sin() * (7.0 * v).cos();
            let r = 1.0 + dent * v.cos();
            let (x, y, z) = (r * u.cos(), r * u.sin(), dent * v.sin());
            positions.extend([x, y + bend * x * x, z + bend * (2.0 * x).sin()]);
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let topology = Topology::from_triangles(rows * columns, &triangles);
    (topology.expect("a torus"), positions)
}

fn mesh(faces: usize) {
    let ((topology, from), (_, to)) = (torus(faces, 0.0), torus(faces, 0.3));
    let connectivity = Connectivity::new(&topology, &from).expect("a mesh");
    let morph = Isometric::new(&connectivity, &from, &to, Alignment::Rigid).expect("a mesh");
    let mut out = vec![0.0; from.len()];
    let seconds = shortest(|| morph.at(0.4, black_box(&mut out)));
    let space = Spaces::new(Arc::new(topology), &from).open("gradients", &[]);
    let space = space.expect("a space");
    let mut code = vec![0.0; space.dimension()];
    space.encode(&to, &mut code);
    let baseline = shortest(|| space.decode(&code, black_box(&mut out)));
    row("isometric", faces, seconds, baseline);
}
