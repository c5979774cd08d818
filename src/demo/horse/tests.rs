use super::{Build, horse_gallop, horse_poses};
use crate::demo::tests::{capture, is_closed_manifold, smallest_face_share};
use crate::mesh::FrameSource;

/// Mean distance of corresponding vertices.
fn distance(a: &[f32], b: &[f32]) -> f64 {
    let squares = a
        .as_chunks::<3>()
        .0
        .iter()
        .zip(b.as_chunks::<3>().0)
        .map(|(a, b)| {
            (0..3)
                .map(|i| f64::from(a[i] - b[i]).powi(2))
                .sum::<f64>()
                .sqrt()
        });
    squares.sum::<f64>() / (a.len() / 3) as f64
}

#[test]
fn the_skin_is_closed_and_of_the_promised_size() {
    let gallop = capture("gallop");
    let topology = gallop.topology();
    assert!((5_000..=10_000).contains(&topology.vertices()));
    assert!(is_closed_manifold(topology));
    for frame in 0..gallop.frames() {
        // small where hocks fold and at the tips of the ears, nowhere nothing
        assert!(
            smallest_face_share(topology, gallop.frame(frame)) > 5e-4,
            "frame {frame}"
        );
    }
}

/// A frame is nearer to the same moment of the other stride than to what comes a tenth of a stride
/// later, yet not equal to it.
#[test]
fn the_two_strides_are_alike_and_unequal() {
    let gallop = capture("gallop");
    for frame in 0..27 {
        let other = distance(gallop.frame(frame), gallop.frame(frame + 30));
        let later = distance(gallop.frame(frame), gallop.frame(frame + 3));
        assert!(other < 0.7 * later, "frame {frame}: {other} of {later}");
    }
    let differences: Vec<f64> = (0..30)
        .map(|frame| distance(gallop.frame(frame), gallop.frame(frame + 30)))
        .collect();
    assert!(
        differences.iter().sum::<f64>() / 30.0 > 2e-3,
        "more than 2 mm in the mean"
    );
}

/// In place: the end of the second stride meets the beginning of the first.
#[test]
fn the_gallop_closes() {
    let gallop = capture("gallop");
    let (end, step) = (gallop.frame(59), distance(gallop.frame(0), gallop.frame(1)));
    assert!(distance(end, gallop.frame(0)) < 1.5 * step);
}

/// Vertices that have been on the ground for three frames did not slide between the last two: the
/// hoof only turns about its toe, by less than 1 mm.
#[test]
fn standing_feet_do_not_slide() {
    let walk = capture("walk");
    let point = |frame: usize, vertex: usize| walk.frame(frame).as_chunks::<3>().0[vertex];
    for frame in 2..walk.frames() {
        let mut standing = 0;
        for vertex in 0..walk.topology().vertices() {
            let [first, before, now] = [2, 1, 0].map(|ago| point(frame - ago, vertex));
            assert!(
                now[1] > -0.005,
                "frame {frame} is {} below the ground",
                -now[1]
            );
            if [first, before, now].iter().all(|point| point[1] < 0.002) {
                standing += 1;
                let slid = (now[0] - before[0]).hypot(now[2] - before[2]);
                assert!(slid < 1e-3, "frame {frame}: {slid}");
            }
        }
        assert!(
            standing > 10,
            "frame {frame}: {standing} vertices on the ground"
        );
    }
    let travelled = walk.frame(walk.frames() - 1)[0] - walk.frame(0)[0];
    assert!(travelled > 3.0, "two and a half strides of 1.35 m");
}

/// Both builds take the same poses and gallop alike, on meshes that differ.
#[test]
fn builds_have_bones_in_common_and_faces_of_their_own() {
    let [light, heavy] = [Build::Light, Build::Heavy].map(horse_poses);
    assert!(is_closed_manifold(heavy.topology()));
    assert!(!heavy.topology().same_connectivity(light.topology()));
    assert_eq!((light.frames(), heavy.frames()), (10, 10));
    assert!(
        light
            .topology()
            .same_connectivity(capture("gallop").topology())
    );
    let middle = |sequence: &crate::mesh::Sequence, frame: usize| {
        let points = sequence.frame(frame).as_chunks::<3>().0;
        points.iter().map(|p| f64::from(p[0])).sum::<f64>() / points.len() as f64
    };
    // a leg that swings takes the middle of either with it
    for frame in 1..9 {
        let shift = [&light, &heavy].map(|horse| middle(horse, frame) - middle(horse, 0));
        assert!(shift[0] * shift[1] > 0.0, "pose {frame}: {shift:?}");
    }
    assert_eq!(horse_gallop(Build::Heavy).frames(), 60);
}
