//! Looms made up for tests.

use super::*;
use crate::math::thin_plate::Rows;
use crate::signal::root::RootKind;
use crate::space::Vertices;

/// A made-up motion of `vertices` vertices over n frames: three modes over a ring of poses, in the
/// space of vertices, interpolated where `exact`.
pub(crate) fn ring(vertices: usize, n: usize, exact: bool) -> Loom {
    let (m, d) = (3, 3 * vertices);
    let angle = |i: usize| 0.31 * i as f64;
    let positions: Vec<Point> = (0..n)
        .map(|i| [libm::cos(angle(i)), libm::sin(1.1 * angle(i))])
        .collect();
    let coordinates: Vec<f64> = (0..n)
        .flat_map(|i| [1.0, 2.0, 3.0].map(|j| libm::sin(j * angle(i)) / j))
        .collect();
    let rows = Rows {
        positions: &positions,
        targets: &coordinates,
        width: m,
        weights: None,
    };
    let (sites, controls) = if exact {
        (n, n + 2)
    } else {
        (n / 2, (2 * n).div_ceil(3))
    };
    let pose = PoseSignal::fit(&rows, sites)
        .expect("rows are sound")
        .signal;
    let time = TimeSignal::fit(&positions, controls, 0.5).expect("controls are possible");
    let wave = |i: usize, by: f64| libm::sin(by * i as f64) + 0.1 * (i % 7) as f64;
    let offset: Vec<f64> = (0..d).map(|i| wave(i, 0.7)).collect();
    let vectors = (0..m * d)
        .map(|i| wave(i, 1.3) / (d as f64).sqrt())
        .collect();
    let faces: Vec<[u32; 3]> = (2..vertices as u32).map(|i| [0, i - 1, i]).collect();
    let parts = Parts {
        topology: Arc::new(Topology::from_triangles(vertices, &faces).expect("faces are sound")),
        fps: Some(24.0),
        space: Arc::new(Vertices::new(vertices)),
        shape: Arc::new(ShapeSignal::new(offset, vectors, m).expect("numbers are finite")),
        pose: Arc::new(pose),
        time: Arc::new(time),
        root: None,
        layout: Arc::new(Layout {
            positions,
            coordinates,
            residuals: vec![0.01; n],
            pins: vec![(2, [0.5, 0.25])],
        }),
        report: Arc::new(FitReport {
            frames: n,
            ..FitReport::default()
        }),
    };
    Loom::new(parts).expect("parts fit")
}

/// The ring travelling over the ground and turning.
pub(crate) fn travelling(vertices: usize, n: usize) -> Loom {
    let loom = ring(vertices, n, true);
    // The same step every frame, seen from the body: along an arc.
    let step = Isometry3::new(Vector3::new(0.5, 0.0, 0.1), Vector3::y() * 0.2);
    let start = Isometry3::translation(1.0, 0.0, 2.0);
    let motions = (0..n).scan(start, |at, _| {
        let now = *at;
        *at *= step;
        Some(now)
    });
    let motions: Vec<_> = motions.collect();
    let root = RootSignal::through(RootKind::Ground, Vector3::new(0.1, 0.2, 0.3), &motions);
    Loom::new(Parts {
        root: Some(Arc::new(root.expect("motions are finite"))),
        ..loom.parts()
    })
    .expect("parts fit")
}
