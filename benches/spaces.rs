//! Shape spaces at the sizes of X19's Table 1 (10 K, 80 K, 233 K and 1.3 M faces): one frame encoded,
//! one decoded, a batch of frames on all cores, and what is done once per mesh. The mesh is a dented
//! torus, its vertices in rows; run with `cargo bench --bench spaces`.

use std::f64::consts::TAU;
use std::sync::Arc;

use divan::{Bencher, black_box};
use meshloom::mesh::Topology;
use meshloom::space::{ShapeSpace, Spaces, encode_frames};
use meshloom::task::{Cancelled, Task};

fn main() {
    divan::main();
}

/// Numbers of faces.
const SIZES: &[usize] = &[10_000, 80_000, 233_000, 1_300_000];

/// A torus of about `faces` triangles; `bend` deforms it.
fn torus(faces: usize, bend: f64) -> (Arc<Topology>, Vec<f64>) {
    let rows = ((faces / 2) as f64).sqrt() as usize;
    let columns = faces / 2 / rows;
    let at = |i: usize, j: usize| ((i % rows) * columns + j % columns) as u32;
    let mut positions = Vec::with_capacity(3 * rows * columns);
    let mut triangles = Vec::with_capacity(2 * rows * columns);
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
    (Arc::new(topology.expect("a torus")), positions)
}

/// A space about the torus, and coordinates of a bent one.
fn posed(name: &str, faces: usize) -> (Arc<dyn ShapeSpace>, Vec<f64>, Vec<f64>) {
    let (topology, reference) = torus(faces, 0.0);
    let (_, pose) = torus(faces, 0.3);
    let spaces = Spaces::new(topology, &reference);
    let space = spaces.open(name, &[&reference, &pose]).expect("a space");
    let mut coordinates = vec![0.0; space.dimension()];
    space.encode(&pose, &mut coordinates);
    (space, coordinates, pose)
}

macro_rules! per_space {
    ($module:ident, $name:literal, $sizes:expr) => {
        mod $module {
            use super::*;

            #[divan::bench(args = $sizes)]
            fn encode(bencher: Bencher, faces: usize) {
                let (space, mut coordinates, pose) = posed($name, faces);
                bencher.bench_local(|| space.encode(black_box(&pose), &mut coordinates));
            }

            #[divan::bench(args = $sizes)]
            fn decode(bencher: Bencher, faces: usize) {
                let (space, coordinates, mut pose) = posed($name, faces);
                bencher.bench_local(|| space.decode(black_box(&coordinates), &mut pose));
            }
        }
    };
}

per_space!(gradients, "gradients", SIZES);
per_space!(patch_lri, "patch-lri", SIZES);

/// Analysis and factorisation.
#[divan::bench(args = SIZES, sample_count = 3, sample_size = 1)]
fn set_up(bencher: Bencher, faces: usize) {
    let (topology, reference) = torus(faces, 0.0);
    bencher.bench_local(|| {
        Spaces::new(Arc::clone(&topology), &reference)
            .open("gradients", &[])
            .expect("a space")
    });
}

/// 48 frames of 85 K faces encoded, on all cores.
#[divan::bench(sample_count = 3, sample_size = 1)]
fn encode_48_frames_of_85_k_faces(bencher: Bencher) {
    let (space, ..) = posed("gradients", 85_000);
    let frames: Vec<_> = (0..48)
        .map(|frame| torus(85_000, 0.01 * frame as f64).1)
        .collect();
    let mut rows = vec![0.0; 48 * space.dimension()];
    bencher.bench_local(|| {
        encode_frames::<Cancelled>(
            &*space,
            frames[0].len() / 3,
            |frame, positions| {
                positions.copy_from_slice(&frames[frame]);
                Ok(())
            },
            &mut rows,
            &Task::default(),
        )
    });
}
