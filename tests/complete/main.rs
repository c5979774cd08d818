//! Key poses to motion: what it reproduces, how it moves between, what it refuses.

mod bad_input;
mod command;
mod ghosts;
mod shapes;
#[path = "../support/mod.rs"]
mod support;

use std::sync::Arc;

use meshloom::inbetween::{
    Boundary, CompleteOptions, Handle, Keys, MotionFrames, Velocity, complete,
};
use meshloom::mesh::FrameSource;
use meshloom::space::{MEAN_ROTATION, SPACES};
use meshloom::task::Task;
use nalgebra::Vector3;
use shapes::{
    REPRODUCED, bends, bent, farthest, in_space, lengths, motion, reproduces, sequence, tube,
};

#[test]
fn every_space_passes_through_the_keys() {
    for space in SPACES {
        let keys = bends();
        reproduces(&keys, &motion(&keys, &in_space(space.name)), space.name);
    }
}

#[test]
fn every_end_and_every_control_passes_through_the_keys() {
    let keys = bends();
    let velocity = Velocity {
        from: None,
        to: keys.poses().frame(1).to_vec(),
        time: 2.0,
    };
    let hermite = Boundary::Hermite {
        start: Some(velocity.clone()),
        end: Some(velocity),
    };
    for boundary in [Boundary::Natural, hermite] {
        for overshoot in [None, Some(0.0), Some(0.2)] {
            let handles = (0..4).map(|key| Handle {
                tension: 0.3,
                continuity: 0.2 * f64::from(key) - 0.4,
                bias: -0.5,
            });
            let options = CompleteOptions {
                boundary: boundary.clone(),
                handles: handles.collect(),
                overshoot,
                ..CompleteOptions::default()
            };
            reproduces(&keys, &motion(&keys, &options), "controls");
        }
    }
}

#[test]
fn two_natural_keys_give_the_straight_path() {
    let (topology, points) = tube(14, 8);
    let shapes = [bent(&points, 0.0, 0.0), bent(&points, 1.5, 0.7)];
    let keys = Keys::new(sequence(&topology, &shapes), Some(vec![0.0, 8.0])).unwrap();
    let found = motion(&keys, &CompleteOptions::default());
    let [mut start, mut end, mut between] = [(); 3].map(|()| vec![0.0; found.spline().width()]);
    found.spline().evaluate(0.0, &mut start);
    found.spline().evaluate(8.0, &mut end);
    for share in [-0.5, 0.25, 0.8, 1.5] {
        found.spline().evaluate(8.0 * share, &mut between);
        let line: Vec<f64> = start
            .iter()
            .zip(&end)
            .map(|(a, b)| a + share * (b - a))
            .collect();
        // rounding of coordinates up to 40
        assert!(farthest(&between, &line) < 1e-12);
    }
}

#[test]
fn a_turn_over_several_keys_goes_on_and_stays_rigid() {
    let (topology, points) = tube(14, 8);
    // one and a half turns; the principal logarithms would turn back after each half
    let turns = [0.0, 2.4, 4.8, 7.2, 9.6];
    let shapes = turns.map(|turn| bent(&points, 1.0, turn));
    let keys = Keys::new(sequence(&topology, &shapes), None).unwrap();
    for space in SPACES.iter().filter(|space| space.name != "vertices") {
        let found = motion(&keys, &in_space(space.name));
        for share in 0..=40 {
            let t = 1.0 + 2.4 * f64::from(share);
            let shape = found.at(t);
            let expected = bent(&points, 1.0, 0.1 * (t - 1.0));
            // keys are rounded to single precision: 1e-7 of 2
            let error = farthest(&lengths(&topology, &shape), &lengths(&topology, &expected));
            assert!(error < 4e-6, "{}, {t}: {error}", space.name);
            // the mean vertex has a spline of its own: shapes are compared about it
            let centred = |shape: &[f64]| {
                let mean = meshloom::mesh::rigid_align::mean(shape);
                let about = |p: &[f64]| (Vector3::from_column_slice(p) - mean).data.0[0];
                shape.chunks_exact(3).flat_map(about).collect::<Vec<f64>>()
            };
            let error = farthest(&centred(&shape), &centred(&expected));
            assert!(error < 1e-5, "{}, {t}: {error}", space.name);
        }
    }
}

#[test]
fn velocities_copied_from_a_motion_give_that_motion_again() {
    let keys = bends();
    let natural = motion(&keys, &CompleteOptions::default());
    let [first, last] = keys.ends();
    // X26: from its frames, finely sampled
    let steps = 14_000;
    let times = |step: usize| first + (last - first) * step as f64 / steps as f64;
    let shapes = [0, 1, steps - 1, steps].map(|step| {
        natural
            .at(times(step))
            .iter()
            .map(|&x| x as f32)
            .collect::<Vec<f32>>()
    });
    let apart = |from: &[f32], to: &[f32]| Velocity {
        from: Some(from.to_vec()),
        to: to.to_vec(),
        time: (last - first) / steps as f64,
    };
    let options = CompleteOptions {
        boundary: Boundary::Hermite {
            start: Some(apart(&shapes[0], &shapes[1])),
            end: Some(apart(&shapes[2], &shapes[3])),
        },
        ..CompleteOptions::default()
    };
    let copied = motion(&keys, &options);
    for step in 0..=20 {
        let t = times(step * steps / 20);
        // single precision over a step of 1e-3: 2e-4 of the velocity
        assert!(farthest(&copied.at(t), &natural.at(t)) < 2e-3);
    }
}

#[test]
fn a_period_closes_smoothly_and_goes_round() {
    let (topology, points) = tube(14, 8);
    let poses = [(0.0, 0.0), (1.2, 0.4), (-0.5, 1.0), (0.0, 0.0)];
    let shapes = poses.map(|(bend, turn)| bent(&points, bend, turn));
    let keys = Keys::new(sequence(&topology, &shapes), None).unwrap();
    let options = CompleteOptions {
        boundary: Boundary::Periodic { drift: false },
        ..CompleteOptions::default()
    };
    let found = motion(&keys, &options);
    reproduces(&keys, &found, "periodic");
    assert!(farthest(&found.at(20.0), &found.at(92.0)) < 1e-9);
    let slope = |t: f64| {
        let mut slope = vec![0.0; found.spline().width()];
        found.spline().derivative(t, &mut slope);
        slope
    };
    assert!(farthest(&slope(73.0 - 1e-9), &slope(1.0)) < 1e-7);
}

#[test]
fn a_motion_that_travels_is_periodic_but_for_its_drift() {
    let (topology, points) = tube(14, 8);
    let poses = [(0.0, 0.0), (1.2, 0.1), (-0.5, 0.5), (0.0, 0.6)];
    let shapes: Vec<Vec<f64>> = poses
        .iter()
        .enumerate()
        .map(|(i, &(bend, turn))| {
            let shape = bent(&points, bend, turn);
            shape.iter().map(|x| x + i as f64).collect()
        })
        .collect();
    let keys = Keys::new(sequence(&topology, &shapes), None).unwrap();
    let of = |drift: bool| CompleteOptions {
        boundary: Boundary::Periodic { drift },
        ..CompleteOptions::default()
    };
    let told = complete(&keys, &of(false), &Task::default()).unwrap_err();
    assert!(told.to_string().contains("drift"), "{told}");
    let found = motion(&keys, &of(true));
    reproduces(&keys, &found, "drift");
    // a period later everything has gone through the same motion
    let gone = meshloom::mesh::rigid_align::rigid(&found.at(1.0), &found.at(73.0));
    for t in [1.0, 10.0, 40.0, 60.0] {
        let moved: Vec<f64> = found
            .at(t)
            .chunks_exact(3)
            .flat_map(|p| (gone * nalgebra::Point3::from_slice(p)).coords.data.0[0])
            .collect();
        assert!(farthest(&moved, &found.at(t + 72.0)) < REPRODUCED);
    }
}

/// X24: lengths become negative beyond the keys, gradients and edge vectors go on.
#[test]
fn lengths_cannot_be_extrapolated_but_rotation_invariant_coordinates_can() {
    let (topology, points) = tube(14, 8);
    let scaled = |x: f64| -> Vec<f64> {
        let scale = |p: &[f64]| [x * p[0], p[1], p[2]];
        points.chunks_exact(3).flat_map(scale).collect()
    };
    let shapes = [scaled(1.0), scaled(0.4)];
    let keys = Keys::new(sequence(&topology, &shapes), Some(vec![0.0, 1.0])).unwrap();
    // straight on: 1 - 0.6 t
    let expected = scaled(1.0 - 0.6 * 2.2);
    let error = farthest(&motion(&keys, &in_space("patch-lri")).at(2.2), &expected);
    assert!(error < REPRODUCED, "{error}");
    let lengths = motion(&keys, &in_space("lengths-angles"));
    let mut coordinates = vec![0.0; lengths.spline().width()];
    lengths.spline().evaluate(2.2, &mut coordinates);
    let edges = lengths.space().blocks()[0].range.clone();
    let negative = coordinates[edges].iter().filter(|length| **length < 0.0);
    assert!(negative.count() > 0, "lengths that do not exist");
    assert!(farthest(&lengths.at(2.2), &expected) > 0.1);
}

#[test]
fn a_bend_goes_on_beyond_the_keys() {
    let (topology, points) = tube(41, 12);
    let shapes = [0.0, 0.8].map(|bend| bent(&points, bend, 0.0));
    let keys = Keys::new(sequence(&topology, &shapes), Some(vec![0.0, 1.0])).unwrap();
    let expected = bent(&points, 2.4, 0.0);
    for name in ["lri", "patch-lri"] {
        let found = motion(&keys, &in_space(name)).at(3.0);
        let near = meshloom::mesh::rigid_align::rigid(&found, &expected);
        let moved: Vec<f64> = found
            .chunks_exact(3)
            .flat_map(|p| (near * nalgebra::Point3::from_slice(p)).coords.data.0[0])
            .collect();
        // triangles of a tenth of the length turn by a twentieth against each other
        let error = farthest(&moved, &expected);
        assert!(error < 0.04 * 4.0, "{name}: {error}");
    }
}

#[test]
fn an_overshoot_of_0_keeps_every_coordinate_in_the_range_of_its_neighbours() {
    let keys = bends();
    let options = CompleteOptions {
        overshoot: Some(0.0),
        ..CompleteOptions::default()
    };
    let found = motion(&keys, &options);
    let at = |t: f64| {
        let mut coordinates = vec![0.0; found.spline().width()];
        found.spline().evaluate(t, &mut coordinates);
        coordinates
    };
    for pair in keys.times().windows(2) {
        let (from, to) = (at(pair[0]), at(pair[1]));
        for share in 1..8 {
            let here = at(pair[0] + (pair[1] - pair[0]) * f64::from(share) / 8.0);
            for (x, (a, b)) in here.iter().zip(from.iter().zip(&to)) {
                let room = 1e-12 * (1.0 + a.abs() + b.abs());
                assert!(a.min(*b) - room <= *x && *x <= a.max(*b) + room);
            }
        }
    }
}

#[test]
fn the_mean_rotation_has_a_spline_of_its_own() {
    let keys = bends();
    let found = motion(&keys, &CompleteOptions::default());
    let blocks = found.space().blocks();
    let mean = blocks.iter().find(|block| block.name == MEAN_ROTATION);
    let mean = mean.unwrap().range.clone();
    let mut coordinates = vec![0.0; found.spline().width()];
    found.spline().evaluate(keys.times()[0], &mut coordinates);
    // a logarithm about the first key
    assert!(coordinates[mean].iter().all(|x| x.abs() < 1e-9));
}

#[test]
fn frames_are_the_motion_at_their_times() {
    let keys = bends();
    let found = Arc::new(motion(&keys, &CompleteOptions::default()));
    let frames = MotionFrames::new(Arc::clone(&found), vec![0.5, 20.0], Some(12.0));
    assert_eq!((frames.frames(), frames.fps()), (2, Some(12.0)));
    let mut narrow = vec![0.0; 3 * keys.poses().topology().vertices()];
    frames.read_frame(1, &mut narrow).unwrap();
    let expected: Vec<f32> = found.at(20.0).iter().map(|&x| x as f32).collect();
    assert_eq!(narrow, expected);
}
