//! Meshes like those of Rojas et al. 2014: an arm, and shapes that change without keeping lengths.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use meshloom::mesh::Topology;

/// A mesh with 3V positions.
pub(crate) type Mesh = (Arc<Topology>, Vec<f64>);

/// A closed tube of `rings` rings of `around` vertices, with a vertex at each end: `place` gives the point
/// at a share of the length and an angle around, r = 0 at the ends.
fn tube(rings: usize, around: usize, place: impl Fn(f64, f64, f64) -> [f64; 3]) -> Mesh {
    let mut positions = Vec::new();
    for i in 0..rings {
        let along = (i as f64 + 0.5) / rings as f64;
        for j in 0..around {
            positions.extend(place(along, TAU * j as f64 / around as f64, 1.0));
        }
    }
    positions.extend(place(0.0, 0.0, 0.0));
    positions.extend(place(1.0, 0.0, 0.0));
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let ends = [at(rings, 0), at(rings, 0) + 1];
    let mut triangles = Vec::new();
    for j in 0..around {
        for i in 0..rings - 1 {
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            // diagonals alternate, so that none has a side
            match (i + j) % 2 {
                0 => triangles.extend([[a, b, c], [a, c, d]]),
                _ => triangles.extend([[a, b, d], [b, c, d]]),
            }
        }
        triangles.push([ends[0], at(0, j + 1), at(0, j)]);
        triangles.push([ends[1], at(rings - 1, j), at(rings - 1, j + 1)]);
    }
    let topology = Topology::from_triangles(positions.len() / 3, &triangles);
    (Arc::new(topology.expect("a tube")), positions)
}

/// An arm of 2,502 vertices along x, of length 4, its elbow at 0 bent by `bend` radians, a muscle swollen
/// by `flex` above it, the wrist turned by `twist`. The bend is spread over a length of 1.6, as skin
/// does.
pub(crate) fn arm(bend: f64, flex: f64, twist: f64) -> Mesh {
    tube(100, 25, |along, angle, inside| {
        let x = 4.0 * along - 2.0;
        let round = inside * (1.0 - (2.0 * along - 1.0).powi(20)).max(0.0).sqrt();
        let swell = 0.22 * flex * (-((x + 0.8) / 0.45).powi(2)).exp();
        let thick = 0.34 - 0.05 * x + 0.04 * (PI * x).cos() + swell * angle.cos().max(0.0);
        let turn = angle + twist * (0.5 + 0.5 * (2.0 * (x - 1.0)).tanh());
        let (y, z) = (
            round * thick * turn.cos(),
            round * 0.85 * thick * turn.sin(),
        );
        bent(x, y, z, bend)
    })
}

/// A point of a straight body about the x axis after a bend by `angle` towards +y over -0.8 < x < 0.8.
fn bent(x: f64, y: f64, z: f64, angle: f64) -> [f64; 3] {
    // the axis: heading angle * s(x) with a smooth s; positions by the midpoint rule
    let heading = |x: f64| {
        let t = ((x + 0.8) / 1.6).clamp(0.0, 1.0);
        angle * t * t * (3.0 - 2.0 * t)
    };
    let steps = 64;
    let width = x / steps as f64;
    let (mut px, mut py) = (0.0, 0.0);
    for i in 0..steps {
        let h = heading((i as f64 + 0.5) * width);
        px += width * h.cos();
        py += width * h.sin();
    }
    let (sine, cosine) = heading(x).sin_cos();
    [px - y * sine, py + y * cosine, z]
}

/// The icosahedron, and the same with a vertex pushed inside: equal edge lengths (Fig. 1).
pub(crate) fn icosahedra() -> (Arc<Topology>, [Vec<f64>; 2]) {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let points = [
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
    let pose = points.concat();
    let mut dented = pose.clone();
    for axis in 0..3 {
        let ring: f64 = [1, 5, 7, 10, 11]
            .iter()
            .map(|&v: &usize| points[v][axis])
            .sum();
        dented[axis] = 2.0 * ring / 5.0 - points[0][axis];
    }
    let topology = Topology::from_triangles(12, &triangles).expect("an icosahedron");
    (Arc::new(topology), [pose, dented])
}

/// A torus of quads with a random diagonal each, `tall` times as high: a ring at 1, a barrel at 6 (R14 §6).
pub(crate) fn barrel(tall: f64) -> Mesh {
    let (n, m) = (60, 24);
    let mut positions = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let (u, v) = (TAU * i as f64 / n as f64, TAU * j as f64 / m as f64);
            let ring = 1.0 + 0.35 * v.cos();
            positions.extend([ring * u.cos(), tall * 0.35 * v.sin(), ring * u.sin()]);
        }
    }
    let at = |i: usize, j: usize| ((i % n) * m + j % m) as u32;
    let mut seed = 12345_u32;
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let (a, b, c, d) = (at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
            match seed >> 31 {
                0 => triangles.extend([[a, b, c], [a, c, d]]),
                _ => triangles.extend([[a, b, d], [b, c, d]]),
            }
        }
    }
    let topology = Topology::from_triangles(n * m, &triangles).expect("a torus");
    (Arc::new(topology), positions)
}

/// A head: a closed surface of genus 0 with a nose, sockets and a chin, the back flat (Fig. 11's face with
/// the back of the head closed off). An octahedron cut `divisions` times.
pub(crate) fn head(divisions: usize) -> Mesh {
    let mut points: Vec<[f64; 3]> = vec![
        [1., 0., 0.],
        [-1., 0., 0.],
        [0., 1., 0.],
        [0., -1., 0.],
        [0., 0., 1.],
        [0., 0., -1.],
    ];
    let mut triangles = vec![
        [0, 2, 4],
        [2, 1, 4],
        [1, 3, 4],
        [3, 0, 4],
        [2, 0, 5],
        [1, 2, 5],
        [3, 1, 5],
        [0, 3, 5],
    ];
    let unit = |p: [f64; 3]| {
        let size = p.iter().map(|x| x * x).sum::<f64>().sqrt();
        p.map(|x| x / size)
    };
    for _ in 0..divisions {
        let mut middles = std::collections::BTreeMap::new();
        let mut next = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (points[i as usize], points[j as usize]);
                    points.push(unit(std::array::from_fn(|k| p[k] + q[k])));
                    points.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = next;
    }
    let bump = |p: &[f64; 3], at: [f64; 3], width: f64| {
        let at = unit(at);
        let square: f64 = (0..3).map(|k| (p[k] - at[k]).powi(2)).sum();
        (-square / (width * width)).exp()
    };
    let shaped = points.iter().map(|p| {
        let nose = 0.3 * bump(p, [0.0, -0.05, 1.0], 0.2);
        let sockets = 0.12 * (bump(p, [0.35, 0.2, 0.9], 0.18) + bump(p, [-0.35, 0.2, 0.9], 0.18));
        let chin = 0.12 * bump(p, [0.0, -0.75, 0.7], 0.3);
        let radius = 1.0 + nose - sockets + chin;
        let z = p[2] * radius;
        [
            0.8 * p[0] * radius,
            1.05 * p[1] * radius,
            if z < -0.4 { -0.4 + 0.25 * (z + 0.4) } else { z },
        ]
    });
    let positions: Vec<f64> = shaped.flatten().collect();
    let topology = Topology::from_triangles(points.len(), &triangles).expect("a head");
    (Arc::new(topology), positions)
}
