//! Ghosts: what the mesh behind one keeps, and how near it comes to its own splines.

use std::sync::Arc;

use meshloom::inbetween::{
    Boundary, CompleteOptions, GhostOptions, GhostSize, Keys, Lift, Motion, Velocity,
};
use meshloom::mesh::{FrameSource, Topology};

use crate::shapes::{bent, farthest, lengths, motion, reproduces, sequence, tube};

fn with_ghost(faces: usize, lift: Lift, residual: bool) -> CompleteOptions {
    CompleteOptions {
        ghost: GhostOptions {
            size: GhostSize::Faces(faces),
            lift,
            residual,
        },
        ..CompleteOptions::default()
    }
}

/// Bends of a finer tube, with dents that its ghost does not have, and of a second one beside it.
fn dented(parts: usize) -> Keys {
    let (tube, points) = tube(40, 24);
    let poses = [(0.0, 0.0), (1.2, 0.4), (-0.5, 1.0), (0.8, 0.2)];
    let shapes = poses.map(|(bend, turn)| {
        let dent = |p: &[f64]| {
            let depth = 1.0 + 0.05 * (9.0 * p[0]).sin();
            [p[0], depth * p[1], depth * p[2]]
        };
        let points: Vec<f64> = points.chunks_exact(3).flat_map(dent).collect();
        let one = bent(&points, bend, turn);
        let beside = |part: usize| {
            one.iter()
                .map(move |x| x + 3.0 * part as f64 * (1.0 + bend))
        };
        (0..parts).flat_map(beside).collect::<Vec<f64>>()
    });
    let shift = |part: usize| {
        tube.triangles()
            .iter()
            .map(move |t| t.map(|v| v + 960 * part as u32))
    };
    let triangles: Vec<[u32; 3]> = (0..parts).flat_map(shift).collect();
    let topology = Arc::new(Topology::from_triangles(960 * parts, &triangles).unwrap());
    Keys::new(
        sequence(&topology, &shapes),
        Some(vec![-3.0, 1.0, 2.5, 11.0]),
    )
    .unwrap()
}

#[test]
fn a_mesh_behind_its_ghost_passes_through_the_keys() {
    for parts in [1, 2] {
        let keys = dented(parts);
        for lift in [Lift::Solve, Lift::Direct] {
            let found = motion(&keys, &with_ghost(300 * parts, lift, true));
            let ghost = found.report().ghost.as_ref().unwrap();
            assert!(ghost.faces <= 300 * parts && ghost.faces > 280 * parts);
            reproduces(&keys, &found, &format!("{lift:?}, {parts} part(s)"));
        }
    }
}

#[test]
fn a_ghost_of_a_period_and_of_given_velocities_passes_through_the_keys() {
    let keys = dented(1);
    let around: Vec<Vec<f64>> = [0, 1, 2, 0].map(|key| keys.pose(key)).into();
    let closed = sequence(keys.poses().topology(), &around);
    let closed = Keys::new(closed, None).unwrap();
    let options = CompleteOptions {
        boundary: Boundary::Periodic { drift: false },
        ..with_ghost(300, Lift::Solve, true)
    };
    let found = motion(&closed, &options);
    reproduces(&closed, &found, "periodic");
    assert!(farthest(&found.at(20.0), &found.at(92.0)) < 1e-9);
    let velocity = Velocity {
        from: None,
        to: keys.poses().frame(1).to_vec(),
        time: 4.0,
    };
    let options = CompleteOptions {
        boundary: Boundary::Hermite {
            start: Some(velocity.clone()),
            end: Some(velocity),
        },
        ..with_ghost(300, Lift::Direct, true)
    };
    reproduces(&keys, &motion(&keys, &options), "hermite");
}

/// KG error (X19 eq. 7) in percent over the time of the keys.
fn kg(keys: &Keys, one: &Motion, other: &Motion) -> f64 {
    let [first, last] = keys.ends();
    let times = |i: usize| first + (last - first) * i as f64 / 24.0;
    let frames: Vec<[Vec<f64>; 2]> = (0..=24)
        .map(|i| [one.at(times(i)), other.at(times(i))])
        .collect();
    let n = frames.len() as f64;
    let (mut above, mut below) = (0.0, 0.0);
    for at in 0..frames[0][0].len() {
        let mean = frames.iter().map(|pair| pair[0][at]).sum::<f64>() / n;
        for [one, other] in &frames {
            above += (one[at] - other[at]).powi(2);
            below += (one[at] - mean).powi(2);
        }
    }
    100.0 * (above / below).sqrt()
}

#[test]
fn a_ghost_moves_the_mesh_as_its_own_splines_would_also_without_the_residual() {
    let keys = dented(1);
    let whole = motion(&keys, &CompleteOptions::default());
    let mut before = f64::INFINITY;
    for faces in [100, 400, 1200] {
        let error = kg(
            &keys,
            &whole,
            &motion(&keys, &with_ghost(faces, Lift::Solve, false)),
        );
        // falls as the ghost grows, up to a tenth
        assert!(error < 1.1 * before, "{faces}: {error}");
        before = error;
    }
    // what X19 finds from its second thousand of faces on
    for lift in [Lift::Solve, Lift::Direct] {
        for residual in [true, false] {
            let error = kg(
                &keys,
                &whole,
                &motion(&keys, &with_ghost(400, lift, residual)),
            );
            assert!(error < 5.0, "{lift:?} {residual}: {error}");
        }
    }
}

#[test]
fn a_rigid_motion_stays_rigid_behind_a_ghost() {
    let keys = dented(1);
    let rest = keys.pose(0);
    let shapes: Vec<Vec<f64>> = (0..4)
        .map(|i| bent(&rest, 0.0, 1.5 * f64::from(i)))
        .collect();
    let keys = Keys::new(sequence(keys.poses().topology(), &shapes), None).unwrap();
    for lift in [Lift::Solve, Lift::Direct] {
        let found = motion(&keys, &with_ghost(200, lift, true));
        let topology = keys.poses().topology();
        for t in [5.0, 13.0, 40.0, 70.0, 80.0] {
            let error = farthest(&lengths(topology, &found.at(t)), &lengths(topology, &rest));
            // single precision of keys of size 4, 24 frames apart
            assert!(error < 1e-5, "{lift:?} {t}: {error}");
        }
    }
}

/// Captures whose vertices do not correspond everywhere: one border lies across the mesh in one key.
#[test]
fn a_torn_border_leaves_the_rest_of_the_motion_alone() {
    const AROUND: usize = 24;
    let (topology, points) = tube(40, AROUND);
    let shapes = [0.0, 1.2, -0.5].map(|bend| bent(&points, bend, 0.0));
    let mut across = shapes.clone();
    let (start, end) = (..3 * AROUND, shapes[1].len() - 3 * AROUND..);
    across[1][end.clone()].copy_from_slice(&shapes[1][start]);
    let keys =
        [shapes, across].map(|shapes| Keys::new(sequence(&topology, &shapes), None).unwrap());
    for size in [GhostSize::Off, GhostSize::Faces(600)] {
        let options = CompleteOptions {
            ghost: GhostOptions {
                size,
                ..GhostOptions::default()
            },
            ..CompleteOptions::default()
        };
        let [whole, torn] = [0, 1].map(|of| motion(&keys[of], &options));
        reproduces(&keys[1], &torn, "torn");
        assert_eq!(
            [&whole, &torn].map(|motion| motion.report().torn),
            [0, 2 * AROUND]
        );
        for t in [7.0, 13.0, 19.0, 31.0, 40.0] {
            // the mean vertex goes with the border
            let [whole, torn] = [&whole, &torn].map(|motion| motion.at(t)[..end.start].to_vec());
            let near = meshloom::mesh::rigid_align::rigid(&torn, &whole);
            let moved: Vec<f64> = torn
                .chunks_exact(3)
                .flat_map(|p| (near * nalgebra::Point3::from_slice(p)).coords.data.0[0])
                .collect();
            // a side, a fortieth of the length
            let error = farthest(&moved, &whole);
            assert!(error < 0.1, "{size:?} {t}: {error}");
        }
    }
}

/// Ghosts of a mesh whose joints turn far, which patches must not see otherwise than the mesh does.
#[test]
fn a_ghost_bends_joints_as_its_mesh_does() {
    let (topology, points) = tube(80, 24);
    // rolled up to more than a round and twisted
    let poses = [(0.4, 0.0), (5.0, 1.0), (-3.0, 2.0)];
    let shapes = poses.map(|(bend, turn)| bent(&points, bend, turn));
    let keys = Keys::new(sequence(&topology, &shapes), None).unwrap();
    let whole = motion(&keys, &CompleteOptions::default());
    for faces in [200, 400, 800] {
        for lift in [Lift::Solve, Lift::Direct] {
            let error = kg(
                &keys,
                &whole,
                &motion(&keys, &with_ghost(faces, lift, true)),
            );
            assert!(error < 2.0, "{faces} {lift:?}: {error}");
        }
    }
}

#[test]
fn large_meshes_have_a_ghost_unless_it_is_refused() {
    let (topology, points) = tube(102, 100);
    let shapes = [bent(&points, 0.0, 0.0), bent(&points, 1.0, 0.0)];
    let keys = Keys::new(sequence(&topology, &shapes), None).unwrap();
    let ghost = |size: GhostSize, space: &str| {
        let options = CompleteOptions {
            space: space.to_string(),
            ghost: GhostOptions {
                size,
                ..GhostOptions::default()
            },
            ..CompleteOptions::default()
        };
        motion(&keys, &options).report().ghost.clone()
    };
    let found = ghost(GhostSize::Auto, "patch-lri").unwrap();
    assert!(found.faces <= 2000 && found.faces > 1990);
    assert!(found.curve.len() > 20 && found.curve.len() <= 64);
    assert_eq!(found.curve.last().unwrap().0, found.faces);
    assert_eq!(ghost(GhostSize::Off, "patch-lri"), None);
    assert_eq!(ghost(GhostSize::Auto, "vertices"), None);
}
