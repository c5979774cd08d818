use std::collections::{BTreeMap, HashMap};
use std::f64::consts::PI;
use std::sync::{Mutex, PoisonError};

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
    let topology = capture("bar").topology().clone();
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

/// Generated twice, likely on different threads.
#[test]
fn every_capture_is_finite_and_the_same_bytes_every_time() {
    for demo in DEMOS {
        let (first, again) = (capture(demo.name), demo.generate());
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
fn nothing_is_made_for_whoever_has_cancelled() {
    let task = Task::default();
    task.cancel();
    for demo in DEMOS {
        assert_eq!((demo.make)(&task).err(), Some(Cancelled), "{}", demo.name);
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

/// A capture, generated once for all tests.
pub(super) fn capture(name: &'static str) -> Sequence {
    static MADE: Mutex<BTreeMap<&str, Sequence>> = Mutex::new(BTreeMap::new());
    let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
    made.entry(name)
        .or_insert_with(|| Demo::find(name).unwrap().generate())
        .clone()
}

/// The pole holds one side, and nylon keeps its lengths: to 2 % in the mean over a frame; single sides
/// give way by up to a third at the ends of the pole, where all the cloth pulls.
#[test]
fn the_flag_hangs_on_its_pole_and_keeps_its_lengths() {
    let flag = capture("flag");
    let topology = flag.topology();
    let lengths = [1.5_f32 / 48.0, 1.0 / 32.0];
    for frame in 0..flag.frames() {
        let points = flag.frame(frame).as_chunks::<3>().0;
        let point = |vertex: u32| nalgebra::Vector3::from(points[vertex as usize]);
        for row in 0..33 {
            assert_eq!(points[49 * row], [0.0, row as f32 / 32.0, 0.0]);
        }
        let mut sum = 0.0;
        for quad in topology.polygons() {
            for (side, length) in lengths.into_iter().enumerate() {
                let share = (point(quad[side]) - point(quad[side + 1])).norm() / length;
                assert!(share < 1.33, "frame {frame}: {share}");
                sum += share;
            }
        }
        let mean = sum / (2 * topology.faces()) as f32;
        assert!((mean - 1.0).abs() < 0.02, "frame {frame}: {mean}");
    }
}

/// Jelly stays on the floor or over it, keeps its volume but for a quarter, is lifted and lands.
#[test]
fn the_jelly_is_lifted_and_lands_whole() {
    let jelly = capture("jelly");
    assert!(is_closed_manifold(jelly.topology()));
    let rest = volume(jelly.topology(), jelly.frame(0));
    let lowest = |frame: usize| {
        let heights = jelly
            .frame(frame)
            .as_chunks::<3>()
            .0
            .iter()
            .map(|point| point[1]);
        heights.fold(f32::INFINITY, f32::min)
    };
    for frame in 0..jelly.frames() {
        let share = volume(jelly.topology(), jelly.frame(frame)) / rest;
        assert!((0.75..1.25).contains(&share), "frame {frame}: {share}");
        assert!(lowest(frame) > -0.01, "frame {frame}: {}", lowest(frame));
    }
    assert!(lowest(0) < 0.01 && lowest(79) > 0.5 && lowest(199) < 0.01);
}

/// A bend of curvature k changes volumes by 1 - k u, u the offset towards the middle of the arc. So the
/// bends to the left and to the right add up to twice the straight cactus, which the bend to the front
/// equals, as the cactus is the same before and behind; but for what chords cut off arcs.
#[test]
fn the_cactus_is_closed_and_bends_as_pappus_says() {
    let cactus = capture("cactus");
    let topology = cactus.topology();
    assert!(is_closed_manifold(topology));
    assert!((9_000..11_000).contains(&topology.faces()));
    let [left, front, right] = [0, 1, 2].map(|i| volume(topology, cactus.frame(i)));
    assert!(
        (0.5 * (left + right) / front - 1.0).abs() < 1e-3,
        "{left} {front} {right}"
    );
    for pose in 0..3 {
        assert!(smallest_face_share(topology, cactus.frame(pose)) > 0.05);
    }
}

/// Where the front of the face (z > 6 cm) shows each expression, in metres against the neutral pose.
#[test]
fn faces_do_what_their_names_say() {
    let face = capture("face");
    assert!(is_closed_manifold(face.topology()));
    assert_eq!(face.frames(), FACE_POSES.len());
    let pose = |name: &str| {
        let index = FACE_POSES.iter().position(|&known| known == name).unwrap();
        face.frame(index).as_chunks::<3>().0
    };
    let neutral = pose("neutral");
    // mean rise of what lies within 1 cm of a place of the neutral face, on both sides
    let rise = |name: &str, place: [f32; 3]| {
        let near = |point: &[f32; 3]| {
            let offset = [
                point[0].abs() - place[0],
                point[1] - place[1],
                point[2] - place[2],
            ];
            offset.iter().map(|value| value * value).sum::<f32>() < 1e-4
        };
        let moved: Vec<f32> = neutral
            .iter()
            .zip(pose(name))
            .filter(|(rest, _)| near(rest))
            .map(|(rest, now)| now[1] - rest[1])
            .collect();
        assert!(!moved.is_empty());
        moved.iter().sum::<f32>() / moved.len() as f32
    };
    let (corner, brow, chin) = (
        [0.028, -0.049, 0.078],
        [0.012, 0.043, 0.094],
        [0.0, -0.09, 0.084],
    );
    for happy in ["smile", "grin", "laugh"] {
        assert!(rise(happy, corner) > 0.004, "{happy}");
    }
    for unhappy in ["sad", "cry", "anger"] {
        assert!(rise(unhappy, corner) < -0.004, "{unhappy}");
    }
    for frowning in ["anger", "rage"] {
        assert!(rise(frowning, brow) < -0.008, "{frowning}");
    }
    for open in ["surprise", "laugh", "rage"] {
        assert!(rise(open, chin) < -0.015, "{open}");
    }
    assert!(rise("surprise", brow) > 0.01 && rise("sad", brow) > 0.008);
}
