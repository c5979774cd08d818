//! Deformation transfer: what it reproduces, what it keeps, what it refuses.

mod support;

use std::sync::Arc;

use meshloom::edit::Edit;
use meshloom::edit::transfer::{Examples, transfer};
use meshloom::format;
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{FrameSource, Sequence, Topology};
use meshloom::space::SPACES;
use meshloom::task::Task;

/// A tube along x of `length` rings of `around` vertices.
fn tube(length: usize, around: usize, radius: f64) -> (Arc<Topology>, Vec<f64>) {
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for i in 0..length {
        for j in 0..around {
            let angle = std::f64::consts::TAU * j as f64 / around as f64;
            let x = 4.0 * i as f64 / (length - 1) as f64 - 2.0;
            points.extend([x, radius * angle.cos(), radius * angle.sin()]);
            if i > 0 {
                let [a, b, c, d] = [at(i - 1, j), at(i - 1, j + 1), at(i, j + 1), at(i, j)];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    let topology = Topology::from_triangles(length * around, &triangles).unwrap();
    (Arc::new(topology), points)
}

/// Bent about z by `bend` and sheared up by `lift`, as example poses of any tube.
fn posed(points: &[f64], bend: f64, lift: f64) -> Vec<f64> {
    let point = |p: &[f64]| {
        let (x, y) = match bend == 0.0 {
            true => (p[0], p[1]),
            false => {
                let radius = 4.0 / bend;
                let (sine, cosine) = (p[0] / radius).sin_cos();
                ((radius - p[1]) * sine, radius - (radius - p[1]) * cosine)
            }
        };
        [x, y, p[2] + lift * x]
    };
    points.chunks_exact(3).flat_map(point).collect()
}

const POSES: [(f64, f64); 4] = [(0.0, 0.0), (1.5, 0.0), (0.0, 0.5), (-1.0, 0.3)];

fn sequence(topology: &Arc<Topology>, frames: &[Vec<f64>]) -> Sequence {
    let values = frames.concat().into_iter().map(|x| x as f32).collect();
    Sequence::new(Arc::clone(topology), values, Some(24.0))
}

fn example_poses(topology: &Arc<Topology>, points: &[f64]) -> Sequence {
    let poses = POSES.map(|(bend, lift)| posed(points, bend, lift));
    sequence(topology, &poses)
}

/// The example poses of one tube paired with those of another.
fn pairs(source: (&Arc<Topology>, &[f64]), target: (&Arc<Topology>, &[f64])) -> Examples {
    Examples::new(
        example_poses(source.0, source.1),
        example_poses(target.0, target.1),
    )
    .unwrap()
}

/// Everything kept: every frame is reproduced.
fn exact(capture: &Sequence, space: &str) -> Loom {
    let n = capture.frames();
    let options = FitOptions {
        space: space.to_string(),
        controls: Some(n + 2),
        sites: Some(n),
        modes: Some(n - 1),
        left_out: false,
        ..FitOptions::ch12()
    };
    fit(capture, &options, &Task::default()).unwrap().output
}

fn farthest(a: &[f32], b: &[f32]) -> f32 {
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Single precision in and out of a size of four.
const ROUNDING: f32 = 4e-6;

#[test]
fn examples_become_their_targets() {
    let (source, points) = tube(12, 8, 0.4);
    let (target, others) = tube(9, 10, 0.7);
    let examples = pairs((&source, &points), (&target, &others));
    for space in SPACES {
        let loom = exact(&example_poses(&source, &points), space.name);
        let found = transfer(&loom, &examples, &Task::default()).unwrap().output;
        let expected = example_poses(&target, &others);
        for frame in 0..POSES.len() {
            let shape = found.loom.at((frame + 1) as f64).unwrap();
            let error = farthest(&shape, expected.frame(frame));
            assert!(error < ROUNDING, "{}, frame {frame}: {error}", space.name);
            assert!(found.coverage[frame] < 1e-5);
        }
    }
}

#[test]
fn transfer_to_the_same_examples_changes_nothing_inside_their_span() {
    let (topology, points) = tube(12, 8, 0.4);
    let poses = example_poses(&topology, &points);
    let examples = Examples::new(poses.clone(), poses.clone()).unwrap();
    for space in SPACES {
        // h(g(p)) is a blend of the examples at every time
        let loom = exact(&poses, space.name);
        let found = transfer(&loom, &examples, &Task::default())
            .unwrap()
            .output
            .loom;
        for step in 0..=12 {
            let t = 1.0 + 0.25 * f64::from(step);
            let error = farthest(&found.at(t).unwrap(), &loom.at(t).unwrap());
            assert!(error < ROUNDING, "{}, time {t}: {error}", space.name);
        }
    }
}

#[test]
fn a_loom_about_another_pose_reproduces_the_examples_too() {
    let (topology, points) = tube(12, 8, 0.4);
    let poses = example_poses(&topology, &points);
    let examples = Examples::new(poses.clone(), poses.clone()).unwrap();
    let order = [2, 0, 3, 1];
    let frames = order.map(|i| posed(&points, POSES[i].0, POSES[i].1));
    for space in SPACES {
        let loom = exact(&sequence(&topology, &frames), space.name);
        let found = transfer(&loom, &examples, &Task::default())
            .unwrap()
            .output
            .loom;
        for (frame, &pose) in order.iter().enumerate() {
            let shape = found.at((frame + 1) as f64).unwrap();
            let error = farthest(&shape, poses.frame(pose));
            assert!(error < ROUNDING, "{}, frame {frame}: {error}", space.name);
        }
    }
}

/// Eight frames between the poses, fitted loosely.
fn motion(topology: &Arc<Topology>, points: &[f64], space: &str) -> Loom {
    let frames: Vec<Vec<f64>> = (0..8)
        .map(|i| posed(points, 0.2 * f64::from(i), 0.05 * f64::from(i * i)))
        .collect();
    let options = FitOptions {
        space: space.to_string(),
        left_out: false,
        ..FitOptions::default()
    };
    let capture = sequence(topology, &frames);
    fit(&capture, &options, &Task::default()).unwrap().output
}

#[test]
fn time_stays_and_an_edit_before_or_after_is_the_same() {
    let (topology, points) = tube(12, 8, 0.4);
    let (target, others) = tube(9, 10, 0.7);
    let examples = pairs((&topology, &points), (&target, &others));
    let on_target = |loom: &Loom| {
        let found = transfer(loom, &examples, &Task::default()).unwrap();
        found.output.loom
    };
    let edits = [
        Edit::Hold {
            time: 4.0,
            frames: 3,
        },
        Edit::Speed {
            from: 2.0,
            to: 5.0,
            factor: 0.5,
        },
        Edit::MoveControl {
            control: 3,
            to: [0.1, 0.2],
        },
        Edit::Reverse,
    ];
    for space in SPACES {
        let loom = motion(&topology, &points, space.name);
        let found = on_target(&loom);
        assert_eq!(found.time(), loom.time());
        assert_eq!(found.pose().sites(), loom.pose().sites());
        assert_eq!(found.topology().vertices(), target.vertices());
        assert_eq!(found.fps(), Some(24.0));
        for edit in &edits {
            let edited = |loom: &Loom| edit.apply(loom, &Task::default()).unwrap().output;
            let (before, after) = (on_target(&edited(&loom)), edited(&found));
            assert_eq!(before.frames(), after.frames(), "{edit:?}");
            for frame in 1..=before.frames() {
                let t = frame as f64;
                let error = farthest(&before.at(t).unwrap(), &after.at(t).unwrap());
                // its Gauss-Newton steps end when a step gains a thousandth
                let loose = space.name == "lengths-angles";
                let bound = if loose { 1e-3 } else { ROUNDING };
                assert!(
                    error < bound,
                    "{}, {edit:?}, frame {frame}: {error}",
                    space.name
                );
            }
        }
    }
}

/// Bends of two tubes up to where their ends turn by 4 radians each: branches drawn from frame to frame are
/// not principal.
const BENDS: [f64; 3] = [0.0, 4.0, 8.0];

/// The tube that moves and its points, the points of the other tube, and both bent by [`BENDS`].
fn bent_examples() -> (Arc<Topology>, Vec<f64>, Vec<f64>, Examples) {
    let (source, points) = tube(24, 8, 0.4);
    let (target, others) = tube(19, 10, 0.3);
    let poses = |topology: &Arc<Topology>, points: &[f64]| {
        sequence(topology, &BENDS.map(|bend| posed(points, bend, 0.0)))
    };
    let examples = Examples::new(poses(&source, &points), poses(&target, &others)).unwrap();
    (source, points, others, examples)
}

#[test]
fn a_motion_beyond_a_half_turn_reaches_its_examples() {
    let (source, points, others, examples) = bent_examples();
    let frames: Vec<Vec<f64>> = (0..9).map(|i| posed(&points, f64::from(i), 0.0)).collect();
    for space in SPACES {
        let loom = exact(&sequence(&source, &frames), space.name);
        let found = transfer(&loom, &examples, &Task::default()).unwrap().output;
        for (frame, example) in [(0, 0), (4, 1), (8, 2)] {
            let shape = found.loom.at((frame + 1) as f64).unwrap();
            let error = farthest(&shape, &posed_f32(&others, BENDS[example]));
            assert!(error < ROUNDING, "{}, frame {frame}: {error}", space.name);
            assert!(found.coverage[frame] < 1e-5, "{}", space.name);
        }
    }
}

#[test]
fn a_loom_about_another_pose_draws_its_branches_from_frame_to_frame() {
    let (source, points, others, examples) = bent_examples();
    // from the far end, the reference pose in the middle of the motion, and back
    let motion = [8, 7, 6, 5, 4, 3, 2, 1, 0, 2, 4, 6, 8];
    let frames: Vec<Vec<f64>> = motion
        .iter()
        .map(|&bend| posed(&points, f64::from(bend), 0.0))
        .collect();
    for space in SPACES {
        let loom = exact(&sequence(&source, &frames), space.name);
        let found = transfer(&loom, &examples, &Task::default()).unwrap().output;
        for (frame, example) in [(0, 2), (4, 1), (8, 0), (10, 1), (12, 2)] {
            let shape = found.loom.at((frame + 1) as f64).unwrap();
            let error = farthest(&shape, &posed_f32(&others, BENDS[example]));
            assert!(
                error < 4.0 * ROUNDING,
                "{}, frame {frame}: {error}",
                space.name
            );
        }
        // rotations grow with the bend, so a frame between examples is their blend but for the stretch of a
        // bend; a rotation whole turns away would leave most of it outside
        if ["gradients", "patch-lri"].contains(&space.name) {
            let worst = found.coverage.iter().copied().fold(0.0, f64::max);
            assert!(worst < 0.25, "{}: {:?}", space.name, found.coverage);
        }
    }
}

fn posed_f32(points: &[f64], bend: f64) -> Vec<f32> {
    let pose = posed(points, bend, 0.0);
    pose.into_iter().map(|x| x as f32).collect()
}

#[test]
fn a_loaded_loom_is_transferred_like_the_fitted_one() {
    let (topology, points) = tube(12, 8, 0.4);
    let (target, others) = tube(9, 10, 0.7);
    let examples = pairs((&topology, &points), (&target, &others));
    for space in SPACES {
        let loom = motion(&topology, &points, space.name);
        let loaded = format::loom::read(&format::loom::write(&loom).unwrap()).unwrap();
        let [ours, theirs] = [&loom, &loaded].map(|loom| {
            let found = transfer(loom, &examples, &Task::default()).unwrap();
            (found.output.loom.at(4.5).unwrap(), found.output.coverage)
        });
        assert_eq!(ours, theirs, "{}", space.name);
    }
}

#[test]
fn what_cannot_be_transferred_is_said() {
    let (source, points) = tube(12, 8, 0.4);
    let (target, others) = tube(9, 10, 0.7);
    let (ours, theirs) = (
        example_poses(&source, &points),
        example_poses(&target, &others),
    );
    let message = |result: Result<Examples, _>| -> String {
        let error: Box<meshloom::diag::Diagnostic> = result.err().unwrap();
        error.message
    };
    assert!(message(Examples::new(ours.clone(), theirs.slice(0..3))).contains("4 source"));
    assert!(message(Examples::new(ours.slice(0..1), theirs.slice(0..1))).contains("two pairs"));
    let loom = exact(&ours, "gradients");
    let swapped = Examples::new(theirs.clone(), ours.clone()).unwrap();
    let error = transfer(&loom, &swapped, &Task::default()).err().unwrap();
    assert!(error.message.contains("other faces"));
    let still = sequence(&source, &[points.clone(), points.clone()]);
    let alike = Examples::new(still, theirs.slice(0..2)).unwrap();
    let error = transfer(&loom, &alike, &Task::default()).err().unwrap();
    assert!(error.message.contains("reference pose"));
}

#[test]
fn copies_and_frames_out_of_reach_are_reported() {
    let (source, points) = tube(12, 8, 0.4);
    let (target, others) = tube(9, 10, 0.7);
    let poses = |points: &[f64]| {
        let pose = |i: usize| posed(points, POSES[i].0, POSES[i].1);
        vec![pose(0), pose(1), pose(1)]
    };
    let examples = Examples::new(
        sequence(&source, &poses(&points)),
        sequence(&target, &poses(&others)),
    )
    .unwrap();
    let frames: Vec<Vec<f64>> = (0..6)
        .map(|i| posed(&points, 0.0, 0.2 * f64::from(i)))
        .collect();
    let loom = exact(&sequence(&source, &frames), "vertices");
    let found = transfer(&loom, &examples, &Task::default()).unwrap();
    let said: Vec<&str> = found.warnings.iter().map(|w| w.message.as_str()).collect();
    assert!(
        said.iter()
            .any(|message| message.contains("is a blend of the others"))
    );
    assert!(
        said.iter().any(|message| message.contains("outside")),
        "{said:?}"
    );
    assert!(found.output.coverage[5] > 0.9 && found.output.coverage[0] < 1e-6);
}

/// A folder with two sheets of different size that move alike, and a loom of the first.
fn folder_of_sheets() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, side) in [("small", 5), ("large", 7)] {
        let sheet = support::capture::sheet(side, 12);
        sheet.write_objs(&folder.path().join(name));
    }
    support::meshloom(
        folder.path(),
        "fit small -o small.loom --space gradients --tolerance 0.001 --fps 24",
    )
    .done();
    folder
}

#[test]
fn the_command_writes_frames_or_a_loom_and_reports_the_coverage_of_each_frame() {
    let folder = folder_of_sheets();
    let run = |args: &str| support::meshloom(folder.path(), args);
    let command = "transfer small.loom --examples small large --json -o";
    let object = run(&format!("{command} moved/f_##.obj")).done().object();
    assert_eq!(object["frames"], 12);
    let coverage = object["report"]["coverage"].as_array().unwrap();
    assert_eq!(coverage.len(), 12);
    assert!(coverage.iter().all(|x| x.as_f64().unwrap() < 0.05));
    // every frame is an example: the large sheet's own motion comes back but for what the fit lost
    let found = run("compare large moved --json").done().object();
    assert!(found["kg_percent"].as_f64().unwrap() < 1.0, "{found}");
    run(&format!("{command} moved.loom")).done();
    run("sample moved.loom -o again/f_##.obj").done();
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("moved/f_07.obj"), read("again/f_07.obj"));
}

#[test]
fn the_command_says_what_is_wrong_with_examples() {
    let folder = folder_of_sheets();
    let run = |args: &str| support::meshloom(folder.path(), args);
    run("transfer small.loom --examples large small -o out")
        .fails_with_any(&["other faces", "hint"]);
    run("transfer small.loom --examples small nowhere -o out").fails_with_any(&["nowhere"]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn info_tells_which_space_suits_a_capture_and_why() {
    let folder = folder_of_sheets();
    let run = |args: &str| support::meshloom(folder.path(), args);
    let object = run("info small --spaces --json").done().object();
    let found = object["spaces"].as_array().unwrap();
    assert_eq!(found.len(), SPACES.len());
    for space in found {
        for error in ["psi", "linear", "cubic"] {
            assert!(space["left_out"][error].as_f64().unwrap() >= 0.0);
        }
        assert!(space["seconds"].as_f64().is_some() && space["numbers"].as_u64().is_some());
    }
    let best = object["best_space"].as_str().unwrap();
    assert!(!object["why"].as_str().unwrap().is_empty());
    let text = run("info small --spaces").done();
    let said = format!("{}{}", text.stdout, text.stderr);
    assert!(said.contains(&format!("{best} suits it best")), "{said}");
    run("info small --range 1:3 --spaces").fails_with_any(&["too few"]);
}
