use std::collections::HashMap;
use std::f64::consts::PI;

use super::*;
use crate::mesh::{FrameSource, Topology};

/// Each directed edge once and its reverse once.
fn is_closed(topology: &Topology) -> bool {
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for polygon in topology.polygons() {
        for i in 0..polygon.len() {
            *edges
                .entry((polygon[i], polygon[(i + 1) % polygon.len()]))
                .or_default() += 1;
        }
    }
    edges
        .iter()
        .all(|(&(a, b), &count)| count == 1 && edges.get(&(b, a)) == Some(&1))
}

/// Closed, and the triangles at each vertex make one ring.
pub(super) fn is_closed_manifold(topology: &Topology) -> bool {
    let mut next: Vec<HashMap<u32, u32>> = vec![HashMap::new(); topology.vertices()];
    for &[a, b, c] in topology.triangles() {
        for [at, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            next[at as usize].insert(from, to);
        }
    }
    let one_ring = |ring: &HashMap<u32, u32>| {
        let Some(&start) = ring.keys().next() else {
            return false;
        };
        let (mut at, mut steps) = (ring[&start], 1);
        while at != start && steps <= ring.len() {
            (at, steps) = (ring.get(&at).copied().unwrap_or(start), steps + 1);
        }
        steps == ring.len()
    };
    is_closed(topology) && next.iter().all(one_ring)
}

/// The smallest triangle's area as a share of the mean.
pub(super) fn smallest_face_share(topology: &Topology, positions: &[f32]) -> f64 {
    let at =
        |v: u32| nalgebra::Vector3::from(positions.as_chunks::<3>().0[v as usize]).cast::<f64>();
    let area = |&[a, b, c]: &[u32; 3]| (at(b) - at(a)).cross(&(at(c) - at(a))).norm();
    let areas: Vec<f64> = topology.triangles().iter().map(area).collect();
    let mean = areas.iter().sum::<f64>() / areas.len() as f64;
    areas
        .iter()
        .fold(f64::INFINITY, |least, &area| least.min(area))
        / mean
}

fn volume(topology: &Topology, positions: &[f32]) -> f64 {
    let at =
        |v: u32| std::array::from_fn::<f64, 3, _>(|i| f64::from(positions[3 * v as usize + i]));
    let six: f64 = topology
        .triangles()
        .iter()
        .map(|&[a, b, c]| {
            let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (at(a), at(b), at(c));
            ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        })
        .sum();
    six / 6.0
}

/// The bar's sections move at right angles to themselves, so bends keep its volume (Pappus) but for
/// the cut of sectors down to triangles: 1 - sin(a) / a for slices of angle a.
#[test]
fn the_bar_keeps_its_volume() {
    let topology = bar::generate().topology().clone();
    assert!(is_closed(&topology));
    for bend in [0.0, -90.0, 170.0] {
        let slice: f64 = (bend / 180.0 * PI).abs() / 64.0;
        let lost = if bend == 0.0 {
            0.0
        } else {
            1.0 - slice.sin() / slice
        };
        let found = volume(&topology, &bar_pose(bend / 180.0 * PI, 0.0));
        assert!(
            (found - (1.0 - lost)).abs() < 1e-6,
            "{bend}: {found}, f32 positions"
        );
    }
}

/// A full circle closes: the two ends are the same square; a half turn of twist turns it over.
#[test]
fn the_bar_meets_known_places() {
    let ends = |pose: &[f32]| {
        let points = pose.as_chunks::<3>().0;
        (points[0], points[points.len() - 81])
    };
    let (first, last) = ends(&bar_pose(2.0 * PI, 0.0));
    assert!(
        (0..3).all(|i| (first[i] - last[i]).abs() < 1e-6),
        "{first:?} {last:?}"
    );
    let (first, last) = ends(&bar_pose(0.0, PI));
    assert_eq!(first, [0.0, -0.25, -0.25]);
    assert!(
        (0..3).all(|i| (last[i] - [4.0, 0.25, 0.25][i]).abs() < 1e-6),
        "{last:?}"
    );
    // a tiny bend goes over into none
    let (straight, nearly) = (bar_pose(0.0, 0.0), bar_pose(1e-9, 0.0));
    assert!(
        straight
            .iter()
            .zip(&nearly)
            .all(|(a, b)| (a - b).abs() < 1e-7)
    );
}

/// Generated twice, at the same time on two threads.
#[test]
fn every_capture_is_finite_and_the_same_bytes_every_time() {
    for demo in DEMOS {
        let again = std::thread::spawn(demo.generate);
        let (first, again) = ((demo.generate)(), again.join().unwrap());
        assert_eq!(first.positions(), again.positions(), "{}", demo.name);
        assert!(first.topology().same_connectivity(again.topology()));
        assert!(
            first.positions().iter().all(|value| value.is_finite()),
            "{}",
            demo.name
        );
        assert!(first.frames() > 1);
        assert_eq!(
            first.fps().is_some(),
            demo.kind == Kind::Motion,
            "{}",
            demo.name
        );
    }
}

#[test]
fn names_are_unique_and_found() {
    for demo in DEMOS {
        assert_eq!(
            DEMOS.iter().filter(|other| other.name == demo.name).count(),
            1
        );
        assert_eq!(Demo::find(demo.name).unwrap().about, demo.about);
    }
    assert!(Demo::find("unicorn").is_none());
}
