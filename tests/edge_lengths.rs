//! `morph --method edge-lengths` through the real binary: what it keeps, what it says, what it refuses.

mod support;

use std::fmt::Write;
use std::fs;
use std::path::Path;

use meshloom::mesh::FrameSource;
use support::meshloom;
use tempfile::tempdir;

/// Writes a mesh as OBJ, triangles counted from 0.
fn write(path: &Path, points: &[[f64; 3]], triangles: &[[usize; 3]]) {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for t in triangles {
        writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap();
    }
    fs::write(path, text).unwrap();
}

/// A closed tube along x of n rings of 8, capped, bent by `turn` radians and `wide` in its section.
fn tube(n: usize, turn: f64, wide: f64) -> (Vec<[f64; 3]>, Vec<[usize; 3]>) {
    let bent = |x: f64, y: f64, z: f64| match turn == 0.0 {
        true => [x, y, z],
        false => {
            let radius = 4.0 / turn;
            let (sine, cosine) = (x / radius).sin_cos();
            [(radius - y) * sine, radius - (radius - y) * cosine, z]
        }
    };
    let mut points = Vec::new();
    for i in 0..n {
        let x = 4.0 * i as f64 / (n - 1) as f64 - 2.0;
        for j in 0..8 {
            let angle = std::f64::consts::TAU * j as f64 / 8.0;
            points.push(bent(x, 0.4 * wide * angle.cos(), 0.4 * angle.sin()));
        }
    }
    points.extend([bent(-2.2, 0.0, 0.0), bent(2.2, 0.0, 0.0)]);
    let at = |i: usize, j: usize| 8 * i + j % 8;
    let mut triangles = Vec::new();
    for j in 0..8 {
        for i in 0..n - 1 {
            triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
        triangles.push([8 * n, at(0, j + 1), at(0, j)]);
        triangles.push([8 * n + 1, at(n - 1, j), at(n - 1, j + 1)]);
    }
    (points, triangles)
}

/// Poses a.obj, b.obj, c.obj, d.obj of a tube in a folder: two turns, two widths.
fn four(folder: &Path) {
    for (name, turn, wide) in [
        ("a", 0.0, 1.0),
        ("b", 1.5, 1.0),
        ("c", 0.0, 1.1),
        ("d", 1.5, 1.1),
    ] {
        let (points, triangles) = tube(14, turn, wide);
        write(&folder.join(format!("{name}.obj")), &points, &triangles);
    }
}

#[test]
fn a_bent_tube_keeps_its_lengths_and_its_poses() {
    let folder = tempdir().unwrap();
    four(folder.path());
    let args = "morph a.obj b.obj -o out --method edge-lengths --frames 9 --json";
    let object = meshloom(folder.path(), args).done().object();
    let report = &object["report"];
    assert_eq!(report["method"], "edge-lengths");
    // positions are written with 32-bit floats
    assert!(
        report["edges"]["worst_percent"].as_f64().unwrap() < 1e-2,
        "{report}"
    );
    let embedding = &report["embedding"];
    assert_eq!(embedding["walks"], 14 * 8 + 2);
    assert_eq!(embedding["embedded"], 9);
    assert!(embedding["residual"].as_f64().unwrap() < 1e-6, "{report}");
    assert_eq!(embedding["within_percent"], 100.0);
    for (frame, pose) in [(1, "a"), (9, "b")] {
        let args = format!("compare {pose}.obj out/frame_000{frame}.obj --json");
        assert_eq!(meshloom(folder.path(), &args).done().object()["max"], 0.0);
    }
}

#[test]
fn frames_between_embedded_ones_have_lengths_and_angles_blended() {
    let folder = tempdir().unwrap();
    four(folder.path());
    let args = "morph a.obj b.obj -o out --method edge-lengths --frames 13 --every 6 --json";
    let report = &meshloom(folder.path(), args).done().object()["report"];
    assert_eq!(report["embedding"]["embedded"], 3);
    // R14 fills so as well: lengths and angles of near shapes nearly fit each other
    assert!(
        report["edges"]["worst_percent"].as_f64().unwrap() < 2.0,
        "{report}"
    );
}

#[test]
fn paths_lead_through_the_space_of_several_poses() {
    let folder = tempdir().unwrap();
    four(folder.path());
    let run = |args: &str| {
        let args = format!("morph {args} --method edge-lengths --json");
        meshloom(folder.path(), &args).done().object()
    };
    let circle = run("a.obj b.obj c.obj d.obj -o circle --path circle --frames 9");
    assert_eq!(circle["frames"], 9);
    assert!(circle["report"]["edges"]["worst_percent"].as_f64().unwrap() < 1.0);
    // around the circle once: the last frame is the first
    let args = "compare circle/frame_0001.obj circle/frame_0009.obj --json";
    let closed = meshloom(folder.path(), args).done().object();
    assert!(closed["edge_max_percent"].as_f64().unwrap() < 0.1);
    run("a.obj b.obj c.obj -o three --path 1,0,0;1,1,1;0,0,1 --frames 5 --squared");
    let args = "compare three/frame_0005.obj c.obj --json";
    assert!(
        meshloom(folder.path(), args).done().object()["max"]
            .as_f64()
            .unwrap()
            < 1e-5
    );
}

#[test]
fn what_a_path_or_a_mesh_cannot_do_is_told() {
    let folder = tempdir().unwrap();
    four(folder.path());
    let refused = |args: &str, parts: &[&str]| {
        let args = format!("morph {args} -o out");
        meshloom(folder.path(), &args).fails_with(parts);
    };
    refused("a.obj b.obj --path 1,0;0,1", &["path", "edge-lengths"]);
    refused("a.obj b.obj --squared", &["squared", "edge-lengths"]);
    refused(
        "a.obj b.obj --method edge-lengths --path circle",
        &["needs four poses"],
    );
    let usage = meshloom(folder.path(), "morph a.obj b.obj -o out --path 1,x;0,1");
    assert_eq!(usage.code, Some(2));
    assert!(
        usage.stderr.contains("`x` is no number"),
        "{}",
        usage.stderr
    );
    // far outside of the poses lengths turn negative: the triangle is named
    refused(
        "a.obj d.obj --method edge-lengths --path 1,0;-30,31",
        &["triangle", "cannot have sides", "vertices"],
    );
    assert!(!folder.path().join("out").exists());
}

#[test]
fn meshes_without_inner_vertices_and_stretched_poses_are_warned_about() {
    let folder = tempdir().unwrap();
    let strip = |angle: f64, size: f64| -> Vec<[f64; 3]> {
        let (sine, cosine) = f64::sin_cos(angle);
        vec![
            [0.0, 0.0, 0.0],
            [2.0 * size, 0.0, 0.0],
            [1.0, cosine, sine],
            [1.0, -cosine, sine],
        ]
    };
    let triangles = [[0, 1, 2], [1, 0, 3]];
    write(&folder.path().join("a.obj"), &strip(0.1, 1.0), &triangles);
    write(&folder.path().join("b.obj"), &strip(0.7, 1.6), &triangles);
    let args = "morph a.obj b.obj -o out --method edge-lengths --frames 3 --json";
    let object = meshloom(folder.path(), args).done().object();
    let told = object["warnings"].to_string();
    assert!(told.contains("no inner vertex"), "{told}");
    assert!(told.contains("not near-isometric"), "{told}");
    assert_eq!(object["report"]["embedding"]["walks"], 0);
    assert!(object["report"]["edges"]["worst_percent"].as_f64().unwrap() < 1e-3);
}

#[test]
fn corner_angles_that_cannot_close_and_flat_triangles_are_told_at_their_vertex() {
    let folder = tempdir().unwrap();
    // two pyramids whose tops lean over a side of their square; beyond the flatter one the triangle there
    // would be wider at the top than the three others together
    let pyramid = |top: [f64; 3]| {
        let mut points = [[1., 1.], [-1., 1.], [-1., -1.], [1., -1.]]
            .map(|[x, y]| [x, y, 0.0])
            .to_vec();
        points.extend([top, [0.0, 0.0, -1.5]]);
        points
    };
    let triangles = [
        [0, 1, 4],
        [1, 2, 4],
        [2, 3, 4],
        [3, 0, 4],
        [1, 0, 5],
        [2, 1, 5],
        [3, 2, 5],
        [0, 3, 5],
    ];
    for (name, top) in [("a", [1.5, 0.0, 1.0]), ("b", [2.0, 0.0, 0.05])] {
        let path = folder.path().join(format!("{name}.obj"));
        write(&path, &pyramid(top), &triangles);
    }
    let args =
        "morph a.obj b.obj -o out --method edge-lengths --path 1,0;-0.4,1.4 --frames 5 --json";
    let object = meshloom(folder.path(), args).done().object();
    let worst = &object["report"]["embedding"]["impossible"][0];
    assert_eq!([&worst["vertex"], &worst["frame"]], [5, 5]);
    // 92.8 degrees against 17.1 + 35.5 + 17.1
    assert!(
        (worst["degrees"].as_f64().unwrap() - 23.13).abs() < 0.1,
        "{worst}"
    );
    let told = object["warnings"].to_string();
    assert!(told.contains("cannot close"), "{told}");
    // a triangle of three points in a row in both poses is carried along
    let flat = |turn: f64| {
        let (mut points, triangles) = tube(5, turn, 1.0);
        let [a, b] = [points[8], points[16]];
        points.push(std::array::from_fn(|i| 0.5 * (a[i] + b[i])));
        let mut triangles = triangles;
        triangles.push([8, 16, points.len() - 1]);
        (points, triangles)
    };
    for (name, turn) in [("c", 0.0), ("d", 0.8)] {
        let (points, triangles) = flat(turn);
        write(
            &folder.path().join(format!("{name}.obj")),
            &points,
            &triangles,
        );
    }
    let args = "morph c.obj d.obj -o flat --method edge-lengths --frames 4 --json";
    let report = &meshloom(folder.path(), args).done().object()["report"];
    assert!(
        report["edges"]["worst_percent"].as_f64().unwrap() < 0.5,
        "{report}"
    );
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let folder = tempdir().unwrap();
    four(folder.path());
    let written = |threads: usize| {
        let args = format!(
            "morph a.obj d.obj -o {threads}.pc2 --method edge-lengths --frames 5 --every 2 --threads {threads}"
        );
        meshloom(folder.path(), &args).done();
        fs::read(folder.path().join(format!("{threads}.pc2"))).unwrap()
    };
    assert_eq!(written(1), written(2));
}

/// Points, three numbers each.
type Points = Vec<[f64; 3]>;

/// Some frames of a capture, as points and triangles.
fn opened(path: &Path, frames: &[usize]) -> (Vec<Points>, Vec<[usize; 3]>) {
    let (world, task) = (meshloom::io::Disk, meshloom::task::Task::default());
    let spec = meshloom::pipeline::InputSpec::new(path);
    let opened = meshloom::pipeline::open(&world, &spec, &task).unwrap();
    let capture = opened.output.content.sequence(&task).unwrap();
    let points = frames.iter().map(|&frame| {
        let (points, _) = capture.frame(frame).as_chunks::<3>();
        points.iter().map(|p| p.map(f64::from)).collect()
    });
    let triangles = capture.topology().triangles().iter();
    let triangles = triangles.map(|t| t.map(|v| v as usize)).collect();
    (points.collect(), triangles)
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    dot(minus(a, b), minus(a, b)).sqrt()
}

/// The vertices around an inner vertex; none at a border.
fn ring(vertex: usize, triangles: &[[usize; 3]]) -> Vec<usize> {
    let with = triangles.iter().filter(|t| t.contains(&vertex)).flatten();
    let mut ring: Vec<usize> = with.copied().filter(|&v| v != vertex).collect();
    // each twice where the ring is closed
    ring.sort_unstable();
    let closed = ring.chunk_by(|a, b| a == b).all(|run| run.len() == 2);
    ring.dedup();
    if closed { ring } else { Vec::new() }
}

/// The middle of the vertices around a vertex, and the unit normal of its triangles.
fn plane(points: &[[f64; 3]], triangles: &[[usize; 3]], vertex: usize) -> [[f64; 3]; 2] {
    let ring = ring(vertex, triangles);
    let middle = std::array::from_fn(|k| {
        ring.iter().map(|&v| points[v][k]).sum::<f64>() / ring.len() as f64
    });
    let mut normal = [0.0; 3];
    for t in triangles.iter().filter(|t| t.contains(&vertex)) {
        let [a, b] = [1, 2].map(|k| minus(points[t[k]], points[t[0]]));
        (0..3).for_each(|k| {
            normal[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        });
    }
    let size = dot(normal, normal).sqrt();
    [middle, normal.map(|x| x / size)]
}

/// The inner vertex with at least five around it for which `measure` is largest.
fn most(triangles: &[[usize; 3]], measure: impl Fn(usize) -> f64) -> usize {
    let vertices = triangles.iter().flatten().max().unwrap() + 1;
    (0..vertices)
        .filter(|&vertex| ring(vertex, triangles).len() >= 5)
        .max_by(|&a, &b| measure(a).total_cmp(&measure(b)))
        .unwrap()
}

/// The first two frames of a real capture with some vertex of the second moved, morphed by thirteen frames:
/// the report of the embedding, and the frames.
fn morphed(capture: &Path, moved: Option<(usize, [f64; 3])>) -> (serde_json::Value, Vec<Points>) {
    let (mut frames, triangles) = opened(capture, &[0, 1]);
    if let Some((vertex, place)) = moved {
        frames[1][vertex] = place;
    }
    let folder = tempdir().unwrap();
    for (name, points) in ["a", "b"].iter().zip(&frames) {
        write(
            &folder.path().join(format!("{name}.obj")),
            points,
            &triangles,
        );
    }
    let args = "morph a.obj b.obj -o out --method edge-lengths --frames 13 --json";
    let report = meshloom(folder.path(), args).done().object()["report"]["embedding"].clone();
    let all: Vec<usize> = (0..13).collect();
    (report, opened(&folder.path().join("out"), &all).0)
}

#[test]
fn a_real_capture_and_a_dent_that_lengths_lead_to_have_no_jumps() {
    let Some(captures) = support::real_captures() else {
        return;
    };
    let capture = captures.join("lowpoly-horse-gallop");
    let (frames, triangles) = opened(&capture, &[1]);
    // a vertex far from the middle of those around it is moved to the other side of that
    let middle = |vertex: usize| plane(&frames[0], &triangles, vertex)[0];
    let vertex = most(&triangles, |v| apart(frames[0][v], middle(v)));
    let middle = middle(vertex);
    let across = std::array::from_fn(|k| 2.0 * middle[k] - frames[0][vertex][k]);
    for moved in [None, Some((vertex, across))] {
        let (found, poses) = morphed(&capture, moved);
        assert_eq!(found["jumps"].as_array().unwrap().len(), 0, "{found}");
        assert!(found["within_percent"].as_f64().unwrap() >= 98.0, "{found}");
        let steps: Vec<f64> = poses
            .windows(2)
            .map(|pair| {
                pair[0]
                    .iter()
                    .zip(&pair[1])
                    .map(|(&a, &b)| apart(a, b).powi(2))
            })
            .map(|squares| squares.sum::<f64>().sqrt())
            .collect();
        let mean = steps.iter().sum::<f64>() / steps.len() as f64;
        assert!(steps.iter().all(|step| *step < 2.0 * mean), "{steps:?}");
    }
}

#[test]
fn a_jump_in_a_real_capture_is_named() {
    let Some(captures) = support::real_captures() else {
        return;
    };
    let capture = captures.join("lowpoly-horse-gallop");
    let (frames, triangles) = opened(&capture, &[1]);
    let points = &frames[0];
    // the sharpest tip, mirrored in the plane of those around it: the same lengths, inside
    let height = |v: usize| {
        let [middle, normal] = plane(points, &triangles, v);
        (dot(minus(points[v], middle), normal), normal, middle)
    };
    let vertex = most(&triangles, |v| {
        let (height, _, middle) = height(v);
        height.abs() / apart(points[v], middle)
    });
    let (height, normal, _) = height(vertex);
    let inside = std::array::from_fn(|k| points[vertex][k] - 2.0 * height * normal[k]);
    let (found, _) = morphed(&capture, Some((vertex, inside)));
    let jumps = found["jumps"].as_array().unwrap();
    assert_eq!(jumps.len(), 1, "{found}");
    // the edge, counted from 1, lies about the vertex: within a tenth of the body
    let size = points
        .iter()
        .map(|&p| apart(p, points[0]))
        .fold(0.0, f64::max);
    for end in jumps[0]["edge"].as_array().unwrap() {
        let end = end.as_u64().unwrap() as usize - 1;
        assert!(apart(points[end], points[vertex]) < 0.1 * size, "{found}");
    }
    // frames that are blended across the jump miss lengths about it; the others keep them
    assert!(found["within_percent"].as_f64().unwrap() >= 98.0, "{found}");
}
