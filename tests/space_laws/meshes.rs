//! Generated meshes with poses of known kind, among them every sort of defect.

use std::sync::Arc;

use meshloom::mesh::Topology;

/// A mesh with poses; the first is the reference.
pub(crate) struct Case {
    pub(crate) name: String,
    pub(crate) topology: Arc<Topology>,
    pub(crate) poses: Vec<Vec<f64>>,
}

type Point = [f64; 3];

fn case(name: &str, points: &[Point], triangles: &[[u32; 3]]) -> Case {
    let reference = points.concat();
    let bend = |turn: f64| move |p: Point| bent(p, turn);
    let wave = |p: Point| {
        [
            p[0] + 0.2 * (2.0 * p[1]).sin(),
            p[1] + 0.1 * (3.0 * p[2] + 1.0).cos(),
            p[2] * 1.3 + 0.15 * (1.5 * p[0]).sin(),
        ]
    };
    let poses = vec![
        reference.clone(),
        mapped(&reference, wave),
        mapped(&mapped(&reference, bend(1.2)), wave),
        turned(&mapped(&reference, bend(-0.7)), [0.3, 0.8, -0.5], 2.0),
    ];
    Case {
        name: name.to_string(),
        topology: Arc::new(Topology::from_triangles(points.len(), triangles).unwrap()),
        poses,
    }
}

/// Applies a map to every point.
pub(crate) fn mapped(pose: &[f64], map: impl Fn(Point) -> Point) -> Vec<f64> {
    pose.chunks_exact(3)
        .flat_map(|p| map([p[0], p[1], p[2]]))
        .collect()
}

/// Turned by `angle` about an axis through the origin (Rodrigues' formula).
pub(crate) fn turned(pose: &[f64], axis: Point, angle: f64) -> Vec<f64> {
    let size = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let a = axis.map(|x| x / size);
    let (sine, cosine) = angle.sin_cos();
    mapped(pose, |p| {
        let dot: f64 = (0..3).map(|i| a[i] * p[i]).sum();
        let cross = [
            a[1] * p[2] - a[2] * p[1],
            a[2] * p[0] - a[0] * p[2],
            a[0] * p[1] - a[1] * p[0],
        ];
        std::array::from_fn(|i| p[i] * cosine + cross[i] * sine + a[i] * dot * (1.0 - cosine))
    })
}

/// A bar along x, bent about z by `turn` radians over the length 4 from x = -2 to 2: its middle line
/// keeps its length.
pub(crate) fn bent(p: Point, turn: f64) -> Point {
    if turn == 0.0 {
        return p;
    }
    let radius = 4.0 / turn;
    let angle = p[0] / radius;
    let r = radius - p[1];
    [r * angle.sin(), radius - r * angle.cos(), p[2]]
}

/// A closed box of `length` x 1 x 1 cells of size 4 / length, its middle at the origin.
fn bar(length: usize, around: usize) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut points = Vec::new();
    let thickness = 0.5;
    for i in 0..=length {
        let x = 4.0 * i as f64 / length as f64 - 2.0;
        for j in 0..around {
            let (side, along) = (
                4 * j / around,
                (4 * j % around) as f64 / around as f64 - 0.5,
            );
            let (y, z) = [(along, -0.5), (0.5, along), (-along, 0.5), (-0.5, -along)][side];
            points.push([x, thickness * y, thickness * z]);
        }
    }
    let mut triangles = Vec::new();
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    for i in 0..length {
        for j in 0..around {
            triangles.push([at(i, j), at(i, j + 1), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i + 1, j)]);
        }
    }
    for (i, flip) in [(0, true), (length, false)] {
        let centre = points.len() as u32;
        points.push([4.0 * i as f64 / length as f64 - 2.0, 0.0, 0.0]);
        for j in 0..around {
            let (a, b) = (at(i, j), at(i, j + 1));
            triangles.push(if flip { [centre, b, a] } else { [centre, a, b] });
        }
    }
    (points, triangles)
}

fn grid(n: usize) -> (Vec<Point>, Vec<[u32; 3]>) {
    let points = (0..n * n)
        .map(|i| {
            let (x, y) = ((i % n) as f64 / n as f64, (i / n) as f64 / n as f64);
            [3.0 * x - 1.5, y, 0.1 * (5.0 * x).sin() * y]
        })
        .collect();
    let mut triangles = Vec::new();
    for i in 0..n - 1 {
        for j in 0..n - 1 {
            let a = (i * n + j) as u32;
            let n = n as u32;
            triangles.extend([[a, a + 1, a + n + 1], [a, a + n + 1, a + n]]);
        }
    }
    (points, triangles)
}

/// Both meshes side by side, the second moved by `shift`.
fn beside(
    (mut points, mut triangles): (Vec<Point>, Vec<[u32; 3]>),
    (more, faces): (Vec<Point>, Vec<[u32; 3]>),
    shift: Point,
) -> (Vec<Point>, Vec<[u32; 3]>) {
    let first = points.len() as u32;
    points.extend(
        more.iter()
            .map(|p| std::array::from_fn(|i| p[i] + shift[i])),
    );
    triangles.extend(faces.iter().map(|face| face.map(|v| v + first)));
    (points, triangles)
}

/// The bar straight and bent by `turn`.
pub(crate) fn bar_pair(turn: f64) -> Case {
    let (points, triangles) = bar(32, 16);
    let reference = points.concat();
    let other = mapped(&reference, |p| bent(p, turn));
    Case {
        name: "bar".to_string(),
        topology: Arc::new(Topology::from_triangles(points.len(), &triangles).unwrap()),
        poses: vec![reference, other],
    }
}

/// Every generated mesh.
pub(crate) fn generated() -> Vec<Case> {
    let (bar_points, bar_triangles) = bar(12, 8);
    let (grid_points, grid_triangles) = grid(9);
    let several = beside(bar(6, 8), grid(5), [0.5, 2.0, 1.0]);
    let mut loose = several.clone();
    loose.0.insert(0, [0.0, 1.0, 3.0]);
    loose.0.push([2.0, -1.0, 0.0]);
    loose.1.iter_mut().flatten().for_each(|v| *v += 1);
    vec![
        case("bar", &bar_points, &bar_triangles),
        case("grid", &grid_points, &grid_triangles),
        case("several parts", &several.0, &several.1),
        case("parts and loose vertices", &loose.0, &loose.1),
        bow_tie(),
        book(),
        defects(),
        case(
            "one triangle",
            &[[0.0; 3], [1.0, 0.0, 0.2], [0.3, 1.0, 0.0]],
            &[[0, 1, 2]],
        ),
        case("no triangle", &[[0.0; 3], [1.0, 0.0, 0.2]], &[]),
    ]
}

/// Two grids that share one vertex.
fn bow_tie() -> Case {
    let (mut points, mut triangles) = beside(grid(4), grid(4), [1.0, 1.1, 0.4]);
    points.pop();
    for corner in triangles.iter_mut().flatten() {
        if *corner as usize == points.len() {
            *corner = 0;
        }
    }
    case("bow tie", &points, &triangles)
}

/// Three grids that share one row of edges.
fn book() -> Case {
    let n = 4;
    let (mut points, mut triangles) = grid(n);
    for page in 1..3_u32 {
        let first = points.len() as u32;
        let (page_points, page_triangles) = grid(n);
        let tilt = 2.0 * f64::from(page);
        points.extend(
            page_points[n..]
                .iter()
                .map(|p| [p[0], p[1] * tilt.cos(), p[2] + p[1] * tilt.sin()]),
        );
        let shared = |v: u32| {
            if v < n as u32 {
                v
            } else {
                v - n as u32 + first
            }
        };
        triangles.extend(page_triangles.iter().map(|face| face.map(shared)));
    }
    case("book of three pages", &points, &triangles)
}

/// A grid with a duplicate triangle, one turned over, a collinear one, one of two coincident vertices
/// and one that names a vertex twice.
fn defects() -> Case {
    let (mut points, mut triangles) = grid(6);
    triangles.extend([
        triangles[7],
        [triangles[9][1], triangles[9][0], triangles[9][2]],
    ]);
    points[8] = std::array::from_fn(|i| 0.5 * (points[7][i] + points[9][i]));
    triangles.push([7, 8, 9]);
    let copy = points.len() as u32;
    points.push(points[20]);
    triangles.extend([[20, copy, 21], [14, 14, 15]]);
    case("defects", &points, &triangles)
}
