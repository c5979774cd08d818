//! Known answers: shapes whose lengths were taken come back, whatever moves them.

use super::*;
use crate::math::rotation::exp;

type Point = [f64; 3];

/// A closed torus of n x m quads, each cut in two: genus 1, bumpy so that nothing is symmetric.
fn torus(n: usize, m: usize, bump: f64) -> (Topology, Vec<f64>) {
    let mut points = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (
                std::f64::consts::TAU * i as f64 / n as f64,
                std::f64::consts::TAU * j as f64 / m as f64,
            );
            let r = 0.4 + bump * (3.0 * u + 1.0).sin() * (2.0 * v).cos();
            let ring = 1.0 + r * v.cos();
            points.extend([ring * u.cos(), ring * u.sin(), r * v.sin()]);
        }
    }
    let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let corners = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            let [a, b, c, d] = corners;
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    (Topology::from_triangles(n * m, &triangles).unwrap(), points)
}

/// A closed ball of n rings of m vertices and two poles: genus 0, bumpy.
pub(super) fn ball(n: usize, m: usize, bump: f64) -> (Topology, Vec<f64>) {
    let mut points = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let u = std::f64::consts::PI * (i as f64 + 1.0) / (n as f64 + 1.0);
            let v = std::f64::consts::TAU * j as f64 / m as f64;
            let r = 1.0 + bump * ((3.0 * u + 1.0).sin() * (2.0 * v).cos() + (v + 2.0 * u).sin());
            points.extend([
                r * u.sin() * v.cos(),
                r * u.sin() * v.sin(),
                1.3 * r * u.cos(),
            ]);
        }
    }
    points.extend([0.0, 0.0, 1.3, 0.0, 0.0, -1.3]);
    let at = |i: usize, j: usize| (i * m + j % m) as u32;
    let poles = [(n * m) as u32, (n * m) as u32 + 1];
    let mut triangles = Vec::new();
    for j in 0..m {
        for i in 0..n - 1 {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        triangles.push([poles[0], at(0, j), at(0, j + 1)]);
        triangles.push([poles[1], at(n - 1, j + 1), at(n - 1, j)]);
    }
    (
        Topology::from_triangles(points.len() / 3, &triangles).unwrap(),
        points,
    )
}

/// An open patch of n x n vertices over a saddle.
fn patch(n: usize, height: f64) -> (Topology, Vec<f64>) {
    let points: Vec<f64> = (0..n * n)
        .flat_map(|i| {
            let (x, y) = ((i % n) as f64 / n as f64, (i / n) as f64 / n as f64);
            [x, y, height * (x * x - y * y + 0.3 * (4.0 * x).sin() * y)]
        })
        .collect();
    let mut triangles = Vec::new();
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let (a, n) = ((i * n + j) as u32, n as u32);
            triangles.extend([[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]);
        }
    }
    (
        Topology::from_triangles(points.len() / 3, &triangles).unwrap(),
        points,
    )
}

/// The icosahedron.
pub(super) fn icosahedron() -> (Topology, Vec<f64>) {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let points: [Point; 12] = [
        [-1., g, 0.],
        [1., g, 0.],
        [-1., -g, 0.],
        [1., -g, 0.],
        [0., -1., g],
        [0., 1., g],
        [0., -1., -g],
        [0., 1., -g],
        [g, 0., -1.],
        [g, 0., 1.],
        [-g, 0., -1.],
        [-g, 0., 1.],
    ];
    let triangles = [
        [0, 11, 5],
        [0, 5, 1],
        [0, 1, 7],
        [0, 7, 10],
        [0, 10, 11],
        [1, 5, 9],
        [5, 11, 4],
        [11, 10, 2],
        [10, 7, 6],
        [7, 1, 8],
        [3, 9, 4],
        [3, 4, 2],
        [3, 2, 6],
        [3, 6, 8],
        [3, 8, 9],
        [4, 9, 5],
        [2, 4, 11],
        [6, 2, 10],
        [8, 6, 7],
        [9, 8, 1],
    ];
    (
        Topology::from_triangles(12, &triangles).unwrap(),
        points.concat(),
    )
}

fn moved(pose: &[f64], turn: Vector3<f64>, scale: f64, shift: f64) -> Vec<f64> {
    let turn = exp(&turn);
    let each = pose
        .chunks_exact(3)
        .map(|p| turn * Vector3::from_column_slice(p) * scale);
    each.flat_map(|p| [p.x + shift, p.y - shift, p.z + shift])
        .collect()
}

fn size(pose: &[f64]) -> f64 {
    let centre = crate::mesh::rigid_align::mean(pose);
    let far = pose
        .chunks_exact(3)
        .map(|p| (Vector3::from_column_slice(p) - centre).norm());
    far.fold(0.0, f64::max)
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    let far = a.chunks_exact(3).zip(b.chunks_exact(3));
    far.map(|(a, b)| (Vector3::from_column_slice(a) - Vector3::from_column_slice(b)).norm())
        .fold(0.0, |worst, d| if d <= worst { worst } else { d })
}

/// The lengths of a pose with its dihedral angles disturbed by up to `noise` radians.
fn disturbed(embedding: &Embedding, pose: &[f64], noise: f64) -> Target {
    let mut dihedrals = embedding.dihedrals(pose);
    for (at, angle) in dihedrals.iter_mut().enumerate() {
        *angle += noise * (12.9898 * at as f64).sin();
    }
    Target {
        lengths: embedding.lengths(pose),
        dihedrals,
        guide: pose.to_vec(),
    }
}

#[test]
fn a_shapes_own_walks_close() {
    for (topology, pose) in [torus(12, 8, 0.1), patch(7, 0.4), icosahedron()] {
        let embedding = Embedding::new(&topology).unwrap();
        let energy = embedding.energy(&embedding.lengths(&pose), &embedding.dihedrals(&pose));
        // each walk is a product of some twelve rotations, each good to an ulp
        assert!(energy < 1e-26 * topology.vertices() as f64, "{energy:e}");
        // and those of its mirror image (all angles negated), which lengths cannot tell
        let negated: Vec<f64> = embedding.dihedrals(&pose).iter().map(|a| -a).collect();
        assert!(embedding.energy(&embedding.lengths(&pose), &negated) < 1e-24);
    }
}

#[test]
fn the_energy_is_the_papers_sum_of_squared_matrix_differences() {
    let (topology, pose) = icosahedron();
    let embedding = Embedding::new(&topology).unwrap();
    let target = disturbed(&embedding, &pose, 0.4);
    let corners = shape::corner_angles(&embedding.hinges, &target.lengths);
    let mut energy = 0.0;
    for fan in &embedding.fans.fans {
        let mut walked = Matrix3::<f64>::identity();
        for step in &embedding.fans.steps[fan.steps()] {
            let sign = if step.negated { -1.0 } else { 1.0 };
            let angle = -sign * target.dihedrals[step.hinge as usize];
            let z = exp(&Vector3::new(0.0, 0.0, corners[step.corner as usize]));
            let x = exp(&Vector3::new(angle, 0.0, 0.0));
            walked *= z.to_rotation_matrix().matrix() * x.to_rotation_matrix().matrix();
        }
        energy += (walked - Matrix3::identity()).norm_squared();
    }
    let found = embedding.energy(&target.lengths, &target.dihedrals);
    assert!((found / energy - 1.0).abs() < 1e-12);
}

#[test]
fn derivatives_of_walks_are_the_limits_of_differences() {
    let (topology, pose) = torus(7, 5, 0.1);
    let embedding = Embedding::new(&topology).unwrap();
    let target = disturbed(&embedding, &pose, 0.5);
    let angles = shape::corner_angles(&embedding.hinges, &target.lengths);
    let corners = walk::corner_halves(&angles);
    let errors = embedding.fans.errors(&corners, &target.dihedrals);
    for hinge in 0..target.dihedrals.len() {
        let step = 1e-5;
        let at = |by: f64| {
            let mut dihedrals = target.dihedrals.clone();
            dihedrals[hinge] += by;
            embedding.fans.errors(&corners, &dihedrals)
        };
        let (low, high) = (at(-step), at(step));
        let steps = embedding.fans.steps.iter().enumerate();
        for (index, _) in steps.filter(|(_, s)| s.hinge as usize == hinge) {
            let fan = embedding.fans.fan_of[index] as usize;
            let limit = (high.residuals[fan] - low.residuals[fan]) / (2.0 * step);
            // the error of a central difference is h^2 / 6 times a third derivative of order one
            assert!((limit - errors.columns[index]).norm() < 1e-9);
        }
        // equations (10) and (11): dE / d(angle) from both ends
        let gradient: f64 = embedding
            .fans
            .steps
            .iter()
            .enumerate()
            .filter(|(_, s)| s.hinge as usize == hinge)
            .map(|(i, _)| {
                4.0 * errors.columns[i].dot(&errors.residuals[embedding.fans.fan_of[i] as usize])
            })
            .sum();
        let limit = (high.energy() - low.energy()) / (2.0 * step);
        assert!((gradient - limit).abs() < 1e-7, "{gradient} {limit}");
    }
}

#[test]
fn lengths_of_a_pose_embed_back_to_it() {
    for ((topology, pose), noise) in [(ball(13, 12, 0.1), 0.1), (icosahedron(), 0.2)] {
        let embedding = Embedding::new(&topology).unwrap();
        for (scale, shift) in [(1.0, 0.0), (1e8, 0.0), (1e-8, 0.0), (1.0, 1e5)] {
            let pose = moved(&pose, Vector3::new(0.3, -2.0, 1.0), scale, shift);
            let target = disturbed(&embedding, &pose, noise);
            let found = embedding.embed(&target, &mut Memory::default()).unwrap();
            let report = &found.report;
            assert!(report.residual <= 1e-6 && report.residual_before > 1e-2);
            assert!(report.edges.max_percent() < 0.01, "{:?}", report.edges);
            // soft bends magnify what is left of the lengths
            assert!(farthest(&found.positions, &pose) < 0.01 * size(&pose));
            assert_eq!((report.mirrored, report.impossible.len()), (0, 0));
        }
    }
}

#[test]
fn surfaces_with_handles_are_embedded_too() {
    // around a handle walks do not tell whether the surface closes; the finishing solve does
    let (topology, pose) = torus(24, 12, 0.1);
    let embedding = Embedding::new(&topology).unwrap();
    let target = disturbed(&embedding, &pose, 0.15);
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert!(found.report.residual <= 1e-6);
    assert!(
        found.report.edges.max_percent() < 0.01,
        "{:?}",
        found.report.edges
    );
    // blends of two tori have six edges more than freedoms: they are met nearly
    let (_, other) = torus(24, 12, 0.02);
    let keys = KeyShapes::new(&embedding, &[&pose, &other]);
    let target = keys.blend(&[0.5, 0.5], Blend::Lengths);
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert!(
        found.report.edges.max_percent() < 1.0,
        "{:?}",
        found.report.edges
    );
}

#[test]
fn open_meshes_keep_the_angles_that_lengths_leave_free() {
    let (topology, pose) = patch(13, 0.5);
    let embedding = Embedding::new(&topology).unwrap();
    assert_eq!(embedding.walks(), 11 * 11);
    let target = disturbed(&embedding, &pose, 0.05);
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert!(found.report.residual <= 1e-6);
    assert!(
        found.report.edges.max_percent() < 0.01,
        "{:?}",
        found.report
    );
    // a saddle with a border bends without stretching; it stays as near as the guess is
    assert!(farthest(&found.positions, &pose) < 0.1 * size(&pose));
}

#[test]
fn parts_loose_vertices_and_sheets_that_touch_are_placed_on_the_guide() {
    let (one, first) = torus(9, 6, 0.05);
    let (_, second) = patch(5, 0.3);
    let shift = one.vertices() as u32;
    let mut triangles = one.triangles().to_vec();
    let (two, _) = patch(5, 0.3);
    triangles.extend(two.triangles().iter().map(|t| t.map(|v| v + shift)));
    let last = shift + 25;
    // a third page at an edge of the patch, a triangle that touches a vertex, one that has no area
    triangles.extend([
        [shift, shift + 1, last],
        [shift + 24, last + 1, last + 2],
        [shift + 7, shift + 7, shift + 8],
    ]);
    let mut pose = first;
    pose.extend(moved(&second, Vector3::new(0.0, 1.0, 0.4), 1.0, 3.0));
    pose.extend([
        3.5, -3.5, 4.0, 4.0, -2.0, 3.3, 4.5, -2.2, 3.0, 9.0, 9.0, 9.0,
    ]);
    let topology = Topology::from_triangles(pose.len() / 3, &triangles).unwrap();
    let embedding = Embedding::new(&topology).unwrap();
    let target = disturbed(&embedding, &pose, 0.0);
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert!(
        found.report.edges.max_percent() < 1e-6,
        "{:?}",
        found.report
    );
    assert!(farthest(&found.positions, &pose) < 1e-6);
}

#[test]
fn a_guess_with_all_signs_changed_gives_the_mirror_image() {
    let (topology, pose) = torus(10, 7, 0.1);
    let embedding = Embedding::new(&topology).unwrap();
    let mut target = disturbed(&embedding, &pose, 0.0);
    target
        .dihedrals
        .iter_mut()
        .for_each(|angle| *angle = -*angle);
    let mirrored: Vec<f64> = pose
        .chunks_exact(3)
        .flat_map(|p| [-p[0], p[1], p[2]])
        .collect();
    target.guide.copy_from_slice(&mirrored);
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert!(farthest(&found.positions, &mirrored) < 1e-6);
    assert!(
        found
            .dihedrals
            .iter()
            .zip(&target.dihedrals)
            .all(|(a, b)| (a - b).abs() < 1e-6)
    );
    assert_eq!(found.report.mirrored, 0);
}

#[test]
fn a_mirror_image_is_reflected() {
    let (topology, pose) = torus(10, 7, 0.1);
    let embedding = Embedding::new(&topology).unwrap();
    let guess = embedding.dihedrals(&pose);
    let mut positions: Vec<f64> = pose
        .chunks_exact(3)
        .flat_map(|p| [p[0], -p[1], p[2]])
        .collect();
    assert_eq!(embedding.reflect_mirrored(&guess, &mut positions), 1);
    assert_eq!(embedding.reflect_mirrored(&guess, &mut positions), 0);
}

#[test]
fn the_order_of_corners_and_of_triangles_does_not_matter() {
    let (topology, pose) = ball(9, 8, 0.1);
    let (_, other) = ball(9, 8, 0.02);
    let mut triangles = topology.triangles().to_vec();
    triangles.reverse();
    for (at, triangle) in triangles.iter_mut().enumerate() {
        triangle.rotate_left(at % 3);
    }
    let again = Topology::from_triangles(topology.vertices(), &triangles).unwrap();
    let halfway = |topology: &Topology| {
        let embedding = Embedding::new(topology).unwrap();
        let keys = KeyShapes::new(&embedding, &[&pose, &other]);
        let target = keys.blend(&[0.5, 0.5], Blend::Lengths);
        embedding.embed(&target, &mut Memory::default()).unwrap()
    };
    let (one, two) = (halfway(&topology), halfway(&again));
    assert!(one.report.edges.max_percent() < 0.5, "{:?}", one.report);
    // both stop when they gain nothing more
    assert!(farthest(&one.positions, &two.positions) < 0.01);
}

#[test]
fn a_frame_beside_a_known_one_takes_few_factorisations() {
    // a ball bent along an arc, as a limb is: its lengths are nearly those of a shape
    let (topology, pose) = ball(40, 40, 0.1);
    let bent = |p: &[f64]| {
        let (sine, cosine) = (0.2 * p[2]).sin_cos();
        let arm = 5.0 - p[0];
        [5.0 - arm * cosine, p[1], arm * sine]
    };
    let other: Vec<f64> = pose.chunks_exact(3).flat_map(bent).collect();
    let embedding = Embedding::new(&topology).unwrap();
    let keys = KeyShapes::new(&embedding, &[&pose, &other]);
    let mut follower = sequence::Follower::new(&embedding);
    let mut frame = |t: f64| {
        let target = keys.blend(&[1.0 - t, t], Blend::Lengths);
        follower.next(&target).unwrap().report
    };
    frame(0.5);
    for t in [0.51, 0.52, 0.53] {
        let found = frame(t);
        assert!(found.edges.max_percent() < 0.01, "{found:?}");
        // an iteration that follows what cannot be seen takes twenty
        assert!(found.steps[0] + found.steps[1] <= 8, "{found:?}");
    }
}

#[test]
fn sides_that_make_no_triangle_are_named() {
    let (topology, pose) = icosahedron();
    let embedding = Embedding::new(&topology).unwrap();
    let mut target = disturbed(&embedding, &pose, 0.0);
    let edge = embedding.edges().iter().position(|&e| e == [3, 8]).unwrap();
    target.lengths[edge] *= 2.5;
    let error = embedding
        .embed(&target, &mut Memory::default())
        .unwrap_err();
    assert_eq!(
        error.to_string(),
        "triangle 14 cannot have sides 2.0000, 2.0000, 5.0000"
    );
}

#[test]
fn corner_angles_that_cannot_close_are_reported_at_their_vertex() {
    let (topology, pose) = icosahedron();
    let embedding = Embedding::new(&topology).unwrap();
    let mut target = disturbed(&embedding, &pose, 0.0);
    // vertex 0 is drawn out to a needle: one of its five triangles keeps a wide corner
    for (length, ends) in target.lengths.iter_mut().zip(embedding.edges()) {
        if ends[0] == 0 && ends[1] != 1 && ends[1] != 5 {
            *length = 1.9;
        }
        if [[1, 7], [7, 10], [10, 11], [5, 11]].contains(ends) {
            *length = 0.3;
        }
    }
    let found = embedding.embed(&target, &mut Memory::default()).unwrap();
    assert_eq!(found.report.impossible[0].0, 0);
    assert!(found.positions.iter().all(|x| x.is_finite()));
    assert!(!found.report.edges.missed.is_empty());
}

#[test]
fn poses_are_reproduced_and_blends_lie_between() {
    let (topology, pose) = torus(14, 9, 0.1);
    let bent = moved(&torus(14, 9, 0.05).1, Vector3::new(0.0, 0.0, 2.8), 1.0, 1.0);
    let embedding = Embedding::new(&topology).unwrap();
    let keys = KeyShapes::new(&embedding, &[&pose, &bent]);
    for (at, wanted) in [(0.0, &pose), (1.0, &bent)] {
        let target = keys.blend(&[1.0 - at, at], Blend::Lengths);
        let found = embedding.embed(&target, &mut Memory::default()).unwrap();
        assert!(farthest(&found.positions, wanted) < 1e-9);
    }
    let half = keys.blend(&[0.5, 0.5], Blend::Squares);
    for (edge, length) in half.lengths.iter().enumerate() {
        let [a, b] = [keys.lengths(0)[edge], keys.lengths(1)[edge]];
        assert!((length * length - 0.5 * (a * a + b * b)).abs() < 1e-12);
    }
    let strain = keys.strain();
    assert!(strain.rms_percent > 1.0 && strain.max_percent >= strain.rms_percent);
}

#[test]
fn nothing_and_a_single_triangle_are_embedded() {
    let none = Topology::from_triangles(2, &[]).unwrap();
    let pose = vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0];
    let embedding = Embedding::new(&none).unwrap();
    let found = embedding.embed(&disturbed(&embedding, &pose, 0.0), &mut Memory::default());
    assert_eq!(found.unwrap().positions, pose);
    let one = Topology::from_triangles(3, &[[0, 1, 2]]).unwrap();
    let pose = vec![0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 2.0];
    let embedding = Embedding::new(&one).unwrap();
    let found = embedding.embed(&disturbed(&embedding, &pose, 0.0), &mut Memory::default());
    assert!(farthest(&found.unwrap().positions, &pose) < 1e-12);
}

#[test]
fn results_do_not_depend_on_threads_or_on_memory() {
    let (topology, pose) = torus(40, 30, 0.1);
    let (_, other) = torus(40, 30, 0.03);
    let run = |threads: usize, memory: &mut Memory| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let embedding = Embedding::new(&topology).unwrap();
            let keys = KeyShapes::new(&embedding, &[&pose, &other]);
            embedding
                .embed(&keys.blend(&[0.4, 0.6], Blend::Lengths), memory)
                .unwrap()
                .positions
        })
    };
    let mut memory = Memory::default();
    let first = run(1, &mut memory);
    assert_eq!(first, run(2, &mut Memory::default()));
    let embedding = Embedding::new(&topology).unwrap();
    let keys = KeyShapes::new(&embedding, &[&pose, &other]);
    let target = keys.blend(&[0.4, 0.6], Blend::Lengths);
    let mut kept = Memory::default();
    embedding
        .embed(&keys.blend(&[0.9, 0.1], Blend::Lengths), &mut kept)
        .unwrap();
    assert_eq!(
        first,
        embedding.embed(&target, &mut kept).unwrap().positions
    );
}
