//! psi at any time, and what cannot be a loom.

use super::test_looms::{ring, travelling};
use super::*;

#[test]
fn every_frame_is_reproduced_when_nothing_is_left_out() {
    let loom = ring(50, 30, true);
    for (i, p) in loom.layout().positions.iter().enumerate() {
        let t = (i + 1) as f64;
        let found = loom.position_at(t).unwrap();
        assert!((found[0] - p[0]).abs() < 1e-12 && (found[1] - p[1]).abs() < 1e-12);
        let x = loom.coordinates_at(t).unwrap();
        let target = &loom.layout().coordinates[3 * i..3 * i + 3];
        assert!(x.iter().zip(target).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}

#[test]
fn positions_are_the_shape_moved_and_rounded_in_blocks_as_in_one() {
    // more coordinates than two blocks
    let loom = travelling(2100, 12);
    let motion = loom.root_at(4.3).unwrap();
    let z = loom.shape_at(4.3).unwrap();
    let found = loom.at(4.3).unwrap();
    for (p, q) in z.chunks_exact(3).zip(found.chunks_exact(3)) {
        let moved = motion * nalgebra::Point3::new(p[0], p[1], p[2]);
        for axis in 0..3 {
            assert!((moved[axis] - f64::from(q[axis])).abs() < 1e-6 * (1.0 + moved[axis].abs()));
        }
    }
}

#[test]
fn velocity_matches_central_differences() {
    for loom in [ring(20, 25, false), travelling(20, 25)] {
        let psi = |t: f64| -> Vec<f64> {
            let motion = loom.root_at(t).unwrap();
            let z = loom.shape_at(t).unwrap();
            let points = z
                .chunks_exact(3)
                .map(|p| motion * nalgebra::Point3::new(p[0], p[1], p[2]));
            points.flat_map(|p| [p.x, p.y, p.z]).collect()
        };
        let h = 1e-5;
        for i in 0..70 {
            let t = 1.1 + 0.331 * f64::from(i);
            let (before, after) = (psi(t - h), psi(t + h));
            let velocity = loom.velocity(t).unwrap();
            let size = velocity.iter().fold(0.0, |a: f64, v| a.max(v.abs()));
            for (v, (a, b)) in velocity.iter().zip(before.iter().zip(&after)) {
                assert!(((b - a) / (2.0 * h) - v).abs() < 1e-6 * size);
            }
        }
    }
}

#[test]
fn the_map_gives_the_pose_without_root_motion() {
    let (still, moving) = (ring(40, 20, true), travelling(40, 20));
    let p = moving.position_at(7.0).unwrap();
    assert_eq!(moving.pose_at(p).unwrap(), still.at(7.0).unwrap());
    assert!(moving.pose_at([f64::NAN, 0.0]).is_err());
}

#[test]
fn times_outside_are_refused_with_the_range() {
    let loom = ring(5, 10, true);
    for t in [0.99, 10.01, f64::NAN, f64::INFINITY] {
        let error = loom.at(t).unwrap_err();
        assert!(error.message.contains("outside [1, 10]"), "{error}");
        assert!(loom.velocity(t).is_err() && loom.root_at(t).is_err());
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let loom = ring(5, 10, true);
    let shape = ring(6, 10, true).shape().clone();
    assert!(
        Loom::new(Parts {
            shape,
            ..loom.parts()
        })
        .is_err()
    );
    assert!(loom.with_fps(Some(0.0)).is_err());
    let moving = travelling(5, 10);
    assert!(
        moving
            .with_time(ring(5, 11, true).time().as_ref().clone())
            .is_err()
    );
}
