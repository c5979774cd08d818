//! The laws that `src/space/mod.rs` states, over every space of the registry, on generated meshes with
//! every sort of defect and on real captures where they are at hand.

mod captures;
mod meshes;

use std::sync::Arc;

use meshes::{Case, bar_pair, generated, mapped, turned};
use meshloom::mesh::Edges;
use meshloom::space::{
    Invariance, MEAN_ROTATION, MEAN_VERTEX, SPACES, ShapeSpace, Spaces, encode_frames,
};
use meshloom::task::{Cancelled, Task};

fn spaces_of(case: &Case) -> Vec<Arc<dyn ShapeSpace>> {
    let spaces = Spaces::new(Arc::clone(&case.topology), &case.poses[0]);
    let poses: Vec<&[f64]> = case.poses.iter().map(Vec::as_slice).collect();
    SPACES
        .iter()
        .map(|kind| spaces.open(kind.name, &poses).unwrap())
        .collect()
}

fn encoded(space: &dyn ShapeSpace, pose: &[f64]) -> Vec<f64> {
    let mut coordinates = vec![f64::NAN; space.dimension()];
    space.encode(pose, &mut coordinates);
    coordinates
}

fn decoded(space: &dyn ShapeSpace, coordinates: &[f64], vertices: usize) -> Vec<f64> {
    let mut positions = vec![f64::NAN; 3 * vertices];
    space.decode(coordinates, &mut positions);
    positions
}

/// The diagonal of the bounding box.
fn size(pose: &[f64]) -> f64 {
    let range = |axis: usize| {
        let values = || pose.iter().skip(axis).step_by(3).copied();
        values().fold(f64::MIN, f64::max) - values().fold(f64::MAX, f64::min)
    };
    (0..3).map(|axis| range(axis).powi(2)).sum::<f64>().sqrt()
}

fn farthest(a: &[f64], b: &[f64]) -> f64 {
    let far = a
        .chunks_exact(3)
        .zip(b.chunks_exact(3))
        .map(|(a, b)| distance(a, b));
    // a NaN must not hide behind max
    far.fold(0.0, |worst, d| if d <= worst { worst } else { d })
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f64>().sqrt()
}

fn midway(a: &[f64], b: &[f64], t: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + t * (b - a)).collect()
}

fn check_round_trip(case: &Case) {
    for space in spaces_of(case) {
        for (index, pose) in case.poses.iter().enumerate() {
            let coordinates = encoded(&*space, pose);
            let back = decoded(&*space, &coordinates, case.topology.vertices());
            let error = farthest(&back, pose) / size(pose);
            assert!(
                error <= 1e-6,
                "{}: {}, pose {index}: {error:e}",
                case.name,
                space.name()
            );
        }
    }
}

#[test]
fn decode_undoes_encode() {
    generated().iter().for_each(check_round_trip);
}

#[test]
fn decode_undoes_encode_at_any_scale_and_far_from_the_origin() {
    for case in generated() {
        for (scale, far) in [(1e-8, 0.0), (1e8, 0.0), (1.0, 1e6)] {
            let moved = |pose: &Vec<f64>| mapped(pose, |p| p.map(|x| x * scale + far));
            check_round_trip(&Case {
                name: format!("{} times {scale:e} plus {far:e}", case.name),
                poses: case.poses.iter().map(moved).collect(),
                topology: Arc::clone(&case.topology),
            });
        }
    }
}

#[test]
fn decode_undoes_encode_on_real_captures() {
    captures::each(4, check_round_trip);
}

/// The first pose and others, moved far and turned.
fn check_rigid_copies(case: &Case) {
    for space in spaces_of(case) {
        if space.invariance() == Invariance::None {
            continue;
        }
        for pose in &case.poses {
            let far = size(pose) / 4.0;
            let copy = mapped(&turned(pose, [1.0, -2.0, 0.5], 2.4), |p| {
                [p[0] + 3.0 * far, p[1] - far, p[2] + 0.5 * far]
            });
            let (a, b) = (encoded(&*space, pose), encoded(&*space, &copy));
            for block in space.blocks() {
                if [MEAN_ROTATION, MEAN_VERTEX].contains(&block.name) {
                    continue;
                }
                for at in block.range.clone() {
                    let difference = (a[at] - b[at]).abs() / block.weight;
                    assert!(
                        difference <= 1e-9,
                        "{}: {}, {} at {at}: {difference:e}",
                        case.name,
                        space.name(),
                        block.name
                    );
                }
            }
        }
    }
}

#[test]
fn coordinates_of_rigid_copies_differ_in_placement_only() {
    generated().iter().for_each(check_rigid_copies);
}

#[test]
fn coordinates_of_rigid_copies_of_real_captures_differ_in_placement_only() {
    captures::each(1, check_rigid_copies);
}

/// The largest change of a distance between vertices: of every vertex to some few that span space.
fn distortion(a: &[f64], b: &[f64]) -> f64 {
    let vertices = a.len() / 3;
    let anchors = [0, vertices / 5, vertices / 2, vertices - 1];
    let mut worst = 0.0_f64;
    for vertex in 0..vertices {
        for anchor in anchors {
            let of = |pose: &[f64]| distance(&pose[3 * vertex..], &pose[3 * anchor..]);
            worst = worst.max((of(a) - of(b)).abs());
        }
    }
    worst
}

fn check_turned_copy(case: &Case) {
    for space in spaces_of(case) {
        let pose = &case.poses[0];
        let shift = size(pose) / 4.0;
        let copy = mapped(
            &turned(pose, [0.2, 1.0, 0.6], 179.0_f64.to_radians()),
            |p| [p[0] + shift, p[1], p[2]],
        );
        let (a, b) = (encoded(&*space, pose), encoded(&*space, &copy));
        for t in [0.3, 0.5] {
            let between = decoded(&*space, &midway(&a, &b, t), case.topology.vertices());
            let change = distortion(&between, pose) / size(pose);
            match space.invariance() {
                Invariance::Rigid => {
                    assert!(change < 1e-6, "{}: {}: {change:e}", case.name, space.name());
                }
                Invariance::None => assert!(change > 0.1, "{}: {change:e}", case.name),
            }
        }
    }
}

#[test]
fn between_a_pose_and_its_turned_copy_lies_a_rigid_motion() {
    generated().iter().for_each(check_turned_copy);
}

#[test]
fn between_a_real_pose_and_its_turned_copy_lies_a_rigid_motion() {
    captures::each(1, check_turned_copy);
}

#[test]
fn a_bar_bent_by_170_degrees_keeps_its_edges_halfway() {
    let case = bar_pair(170.0_f64.to_radians());
    let edges = Edges::new(&case.topology);
    for space in spaces_of(&case) {
        let ends = [0, 1].map(|pose| encoded(&*space, &case.poses[pose]));
        let halfway = decoded(
            &*space,
            &midway(&ends[0], &ends[1], 0.5),
            case.topology.vertices(),
        );
        let length = |pose: &[f64], [a, b]: [u32; 2]| {
            distance(&pose[3 * a as usize..], &pose[3 * b as usize..])
        };
        let worst = edges
            .ends()
            .iter()
            .map(|&edge| {
                let mean = 0.5 * (length(&case.poses[0], edge) + length(&case.poses[1], edge));
                (length(&halfway, edge) / mean - 1.0).abs()
            })
            .fold(0.0, f64::max);
        match space.invariance() {
            Invariance::Rigid => assert!(worst < 0.02, "{}: {worst}", space.name()),
            Invariance::None => assert!(worst > 0.1, "{}: {worst}", space.name()),
        }
    }
}

#[test]
fn branches_follow_a_shape_that_turns_without_end() {
    let case = bar_pair(1.0);
    for space in spaces_of(&case) {
        let frames = 20;
        let mut rows = vec![0.0; frames * space.dimension()];
        let pose = |frame: usize| turned(&case.poses[0], [1.0, 1.0, 0.0], 0.8 * frame as f64);
        let turns = encode_frames::<Cancelled>(
            &*space,
            case.topology.vertices(),
            |frame, positions| {
                positions.copy_from_slice(&pose(frame));
                Ok(())
            },
            &mut rows,
            &Task::default(),
        );
        assert_eq!(turns, Ok(0));
        if space.invariance() == Invariance::None {
            continue;
        }
        // an even turn is a straight line in the logarithm of the mean rotation
        let rows: Vec<&[f64]> = rows.chunks_exact(space.dimension()).collect();
        for frame in 1..frames - 1 {
            let straight = midway(rows[frame - 1], rows[frame + 1], 0.5);
            let off = straight.iter().zip(rows[frame]).map(|(a, b)| (a - b).abs());
            let worst = off.fold(0.0, f64::max);
            let scale: f64 = space
                .blocks()
                .iter()
                .map(|block| block.weight)
                .fold(0.0, f64::max);
            assert!(
                worst < 1e-8 * scale,
                "{}: frame {frame}: {worst:e}",
                space.name()
            );
        }
    }
}

#[test]
fn blocks_cover_the_coordinates_in_order() {
    for case in generated() {
        for space in spaces_of(&case) {
            let mut next = 0;
            for block in space.blocks() {
                assert_eq!(block.range.start, next, "{}", space.name());
                assert!(block.weight > 0.0);
                next = block.range.end;
            }
            assert_eq!(next, space.dimension(), "{}: {}", case.name, space.name());
        }
    }
}

#[test]
fn a_space_is_made_again_from_its_state() {
    for case in generated() {
        for space in spaces_of(&case) {
            let state = space.state();
            let spaces = Spaces::of_state(Arc::clone(&case.topology), &state).unwrap();
            let again = spaces.restore(&state).unwrap();
            assert_eq!(
                encoded(&*again, &case.poses[1]),
                encoded(&*space, &case.poses[1])
            );
            assert_eq!(again.state(), state);
        }
    }
}

fn check_patches(case: &Case) {
    let spaces = Spaces::new(Arc::clone(&case.topology), &case.poses[0]);
    let poses: Vec<&[f64]> = case.poses.iter().map(Vec::as_slice).collect();
    let patches = spaces.open("patch-lri", &poses).unwrap().state().patches;
    let count = *patches.iter().max().unwrap() as usize + 1;
    let mut sizes = vec![0; count];
    patches.iter().for_each(|&patch| sizes[patch as usize] += 1);
    assert!((8..=200).contains(&count), "{}: {count} patches", case.name);
    assert!(
        sizes.iter().all(|&size| size >= 10),
        "{}: {sizes:?}",
        case.name
    );
}

#[test]
fn there_are_8_to_200_patches_of_ten_triangles_or_more() {
    check_patches(&bar_pair(1.0));
    captures::each(2, check_patches);
}

#[test]
fn differences_count_like_displacements_in_every_space() {
    // a shift, a small turn and a small growth move every vertex: the norm of the difference of
    // coordinates is that of the displacements, up to the shape's anisotropy
    let case = bar_pair(0.3);
    let pose = &case.poses[0];
    let changes: [(&str, Vec<f64>); 3] = [
        ("shift", mapped(pose, |p| [p[0] + 0.1, p[1], p[2]])),
        ("turn", turned(pose, [0.0, 1.0, 1.0], 0.02)),
        ("growth", mapped(pose, |p| p.map(|x| 1.01 * x))),
    ];
    let norm = |a: &[f64], b: &[f64]| {
        let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
        squares.sum::<f64>().sqrt()
    };
    for space in spaces_of(&case) {
        for (name, changed) in &changes {
            let ratio =
                norm(&encoded(&*space, pose), &encoded(&*space, changed)) / norm(pose, changed);
            assert!(
                (0.5..2.0).contains(&ratio),
                "{}: {name}: {ratio}",
                space.name()
            );
        }
    }
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let case = bar_pair(1.0);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            spaces_of(&case)
                .iter()
                .map(|space| {
                    let coordinates = encoded(&**space, &case.poses[1]);
                    let back = decoded(&**space, &coordinates, case.topology.vertices());
                    (coordinates, back)
                })
                .collect::<Vec<_>>()
        })
    };
    assert_eq!(run(1), run(2));
}
