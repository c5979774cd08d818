//! `morph --method conformal` through the real binary: between equivalent poses, to the sphere, and what it
//! refuses.

mod support;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use serde_json::Value;
use support::meshloom;
use tempfile::tempdir;

type Points = Vec<[f64; 3]>;

/// An octahedron cut three times, with bumps: a closed mesh of 258 vertices.
fn ball() -> (Points, Vec<[usize; 3]>) {
    let mut points: Points = [[1., 0., 0.], [0., 1., 0.], [0., 0., 1.]]
        .into_iter()
        .flat_map(|p: [f64; 3]| [p, p.map(|x| -x)])
        .collect();
    let mut triangles = Vec::new();
    for [x, y, z] in [[0, 0, 0], [1, 1, 0], [1, 0, 1], [0, 1, 1]] {
        triangles.push([x, 2 + y, 4 + z]);
        triangles.push([1 - x, 4 + 1 - z, 2 + 1 - y]);
    }
    for _ in 0..3 {
        let mut middles = BTreeMap::new();
        let mut cut = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: usize, j: usize| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let sum: [f64; 3] = std::array::from_fn(|k| points[i][k] + points[j][k]);
                    let size = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                    points.push(sum.map(|x| x / size));
                    points.len() - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            cut.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = cut;
    }
    let bumpy = |[x, y, z]: [f64; 3]| {
        let radius = 1.0 + 0.15 * ((3.0 * x + 1.0).sin() + (2.0 * y).cos() * z);
        [x, y, z].map(|x| x * radius)
    };
    (points.into_iter().map(bumpy).collect(), triangles)
}

fn write(path: &Path, points: &[[f64; 3]], triangles: &[[usize; 3]]) {
    let mut text = String::new();
    for [x, y, z] in points {
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for [a, b, c] in triangles {
        writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1).unwrap();
    }
    fs::write(path, text).unwrap();
}

fn read(path: &Path) -> Points {
    let text = fs::read_to_string(path).unwrap();
    let vertices = text.lines().filter_map(|line| line.strip_prefix("v "));
    vertices
        .map(|line| {
            let mut numbers = line.split_whitespace().map(|x| x.parse().unwrap());
            std::array::from_fn(|_| numbers.next().unwrap())
        })
        .collect()
}

fn lengths(points: &Points, triangles: &[[usize; 3]]) -> Vec<f64> {
    let sides = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    sides
        .map(|[a, b]| {
            let squares = (0..3).map(|k| (points[a][k] - points[b][k]).powi(2));
            squares.sum::<f64>().sqrt()
        })
        .collect()
}

/// Half way between two shapes each length is the geometric mean of its lengths there: factors u / 2.
fn assert_half_way(folder: &Path, triangles: &[[usize; 3]], names: [&str; 3]) {
    let [first, middle, last] = names.map(|name| lengths(&read(&folder.join(name)), triangles));
    for ((a, m), b) in first.iter().zip(&middle).zip(&last) {
        let wanted = (a * b).sqrt();
        // files hold single precision
        assert!((m / wanted - 1.0).abs() < 1e-3, "{m} instead of {wanted}");
    }
}

fn factors(report: &Value) -> [f64; 2] {
    [0, 1].map(|k| report["conformal"]["factors"][k].as_f64().unwrap())
}

#[test]
fn a_closed_mesh_becomes_a_sphere() {
    let folder = tempdir().unwrap();
    let (points, triangles) = ball();
    write(&folder.path().join("ball.obj"), &points, &triangles);
    let args = "morph ball.obj -o out --method conformal --frames 5 --json";
    let object = meshloom(folder.path(), args).done().object();
    let report = &object["report"];
    assert_eq!(object["frames"], 5);
    assert_eq!(report["method"], "conformal");
    assert_eq!(report["conformal"]["sphere"], true);
    // the head is read with single precision, the sphere is found in double precision
    assert!(report["conformal"]["residual_percent"].as_f64().unwrap() < 1e-5);
    let [least, most] = factors(report);
    assert!(least < -0.05 && most > 0.05, "{report}");
    assert!(report["edges"]["worst_percent"].as_f64().unwrap() < 0.1);
    assert_half_way(
        folder.path(),
        &triangles,
        [
            "out/frame_0001.obj",
            "out/frame_0003.obj",
            "out/frame_0005.obj",
        ],
    );
    // all vertices of the last frame are as far from one point: opposite ones of the octahedron tell it
    let round = read(&folder.path().join("out/frame_0005.obj"));
    let count = round.len() as f64;
    let centre: [f64; 3] = std::array::from_fn(|k| round.iter().map(|p| p[k]).sum::<f64>() / count);
    let radii: Vec<f64> = round
        .iter()
        .map(|p| {
            (0..3)
                .map(|k| (p[k] - centre[k]).powi(2))
                .sum::<f64>()
                .sqrt()
        })
        .collect();
    assert!(radii.iter().all(|r| (r / radii[0] - 1.0).abs() < 1e-5));
    assert_eq!(
        read(&folder.path().join("out/frame_0001.obj")).len(),
        points.len()
    );
}

#[test]
fn equivalent_poses_are_interpolated_by_their_factors() {
    let folder = tempdir().unwrap();
    let (points, triangles) = ball();
    // an inversion in a sphere about a point outside: |p' - q'| = |p - q| / (|p| |q|)
    let inverted = |p: &[f64; 3]| {
        let [x, y, z] = [p[0] - 4.0, p[1], p[2]];
        let square = x * x + y * y + z * z;
        // mirrored back, so that the outside stays outside
        [-16.0 * x / square, 16.0 * y / square, 16.0 * z / square]
    };
    let other: Points = points.iter().map(inverted).collect();
    write(&folder.path().join("a.obj"), &points, &triangles);
    write(&folder.path().join("b.obj"), &other, &triangles);
    let args = "morph a.obj b.obj -o out --method conformal --frames 3 --json";
    let object = meshloom(folder.path(), args).done().object();
    let report = &object["report"];
    assert_eq!(report["conformal"]["sphere"], false);
    assert!(report["conformal"]["residual_percent"].as_f64().unwrap() < 1e-3);
    // u = -2 log |p| + log 16, the points being 2.6 to 5.4 away
    let distances = points
        .iter()
        .map(|p| ((p[0] - 4.0).powi(2) + p[1].powi(2) + p[2].powi(2)).sqrt());
    let wanted = distances.map(|d| (16.0 / (d * d)).ln());
    let (least, most) = wanted.fold((f64::MAX, f64::MIN), |(a, b), u| (a.min(u), b.max(u)));
    let found = factors(report);
    assert!((found[0] - least).abs() < 1e-3 && (found[1] - most).abs() < 1e-3);
    let names = [
        "out/frame_0001.obj",
        "out/frame_0002.obj",
        "out/frame_0003.obj",
    ];
    assert_half_way(folder.path(), &triangles, names);
    // a recipe does the same
    let recipe = r#"morph([mesh("a.obj"), mesh("b.obj")], #{ method: "conformal", frames: 3 })"#;
    fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    meshloom(folder.path(), "run r.rhai -o again").done();
    for name in ["frame_0001.obj", "frame_0002.obj", "frame_0003.obj"] {
        let [one, two] = ["out", "again"].map(|at| read(&folder.path().join(at).join(name)));
        assert_eq!(one, two);
    }
}

#[test]
fn what_has_no_conformal_map_is_told() {
    let folder = tempdir().unwrap();
    let (points, triangles) = ball();
    let put = |name: &str, points: &Points, triangles: &[[usize; 3]]| {
        write(&folder.path().join(name), points, triangles);
    };
    put("a.obj", &points, &triangles);
    let wide: Points = points.iter().map(|[x, y, z]| [1.5 * x, *y, *z]).collect();
    put("wide.obj", &wide, &triangles);
    put("open.obj", &points, &triangles[1..]);
    let refused = |args: &str, parts: &[&str]| {
        let args = format!("morph {args} -o out --method conformal");
        meshloom(folder.path(), &args).fails_with(parts);
    };
    refused(
        "a.obj wide.obj",
        &["not conformally equivalent", "poses 1 and 2", "%"],
    );
    refused(
        "open.obj",
        &[
            "only a closed mesh",
            "258 vertices, 768 edges and 511 triangles",
        ],
    );
    refused("a.obj --squared", &["squared", "edge-lengths"]);
    refused("a.obj --space gradients", &["without a shape space"]);
    // drawn out so far that triangles would have to be cut otherwise
    let long: Points = points.iter().map(|[x, y, z]| [8.0 * x, *y, *z]).collect();
    put("long.obj", &long, &triangles);
    refused(
        "long.obj",
        &["degenerates at triangle", "edges are flipped", "vertices"],
    );
    assert!(!folder.path().join("out").exists());
}
