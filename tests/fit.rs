//! What a fit must keep, on motions with known answers: Cashman & Hormann 2012, sections 2 and 3.

use std::fs;
use std::path::PathBuf;
use std::sync::Arc;

use meshloom::loom::Loom;
use meshloom::loom::fit::{self, FitOptions};
use meshloom::loom::fitted::{Fitted, fit_rows};
use meshloom::loom::frames::Frames;
use meshloom::loom::pins::{Pin, PinPlace};
use meshloom::loom::session::Session;
use meshloom::mesh::{FrameSource, Sequence, Topology};
use meshloom::signal::root::RootKind;
use meshloom::space::SPACES;
use meshloom::task::Task;

/// n frames of `vertices` vertices; `point(vertex, time)` with time from 0 to 1.
fn capture(n: usize, vertices: usize, point: impl Fn(f64, f64) -> [f64; 3]) -> Sequence {
    let positions = (0..n).flat_map(|frame| {
        let time = frame as f64 / (n - 1).max(1) as f64;
        let point = &point;
        (0..vertices).flat_map(move |vertex| point(vertex as f64, time).map(|x| x as f32))
    });
    let positions = positions.collect();
    let topology = Topology::from_triangles(vertices, &[]).unwrap();
    Sequence::new(Arc::new(topology), positions, Some(24.0))
}

/// A string that swings and twists: smooth, of full rank, never twice the same.
fn swing(n: usize, vertices: usize) -> Sequence {
    capture(n, vertices, |v, t| {
        let (place, turn) = (v * 0.7, 9.0 * t);
        [
            place.sin() + 0.4 * (turn + 0.3 * place.cos()).sin(),
            place.cos() + 0.3 * (1.7 * turn + place.sin()).cos(),
            0.2 * (place + 0.5 * turn * turn).sin() + t,
        ]
    })
}

/// Every vertex on its own straight line at constant speed.
fn straight(n: usize) -> Sequence {
    capture(n, 20, |v, t| {
        [v.sin() + t * v.cos(), v + 2.0 * t, t * (0.3 * v).sin()]
    })
}

fn given(controls: usize, sites: usize, modes: usize) -> FitOptions {
    FitOptions {
        controls: Some(controls),
        sites: Some(sites),
        modes: Some(modes),
        ..FitOptions::ch12()
    }
}

fn fit(sequence: &Sequence, options: &FitOptions) -> Fitted {
    fit_rows(&Frames::new(sequence), options, &Task::default()).unwrap()
}

fn refusal(sequence: &Sequence, options: &FitOptions) -> String {
    let result = fit_rows(&Frames::new(sequence), options, &Task::default());
    result.err().expect("a refusal").to_string()
}

/// psi at `t`, in doubles.
fn psi(fitted: &Fitted, t: f64) -> Vec<f64> {
    let mut x = vec![0.0; fitted.shape.modes()];
    let mut z = vec![0.0; fitted.shape.dimension()];
    fitted
        .signals
        .pose
        .evaluate(fitted.signals.time.at(t).unwrap(), &mut x);
    fitted.shape.evaluate(&x, &mut z);
    z
}

/// sqrt(sum ||z_i - psi(i)||^2) / sqrt(sum ||z_i - mean||^2), from the frames themselves.
fn measured(sequence: &Sequence, fitted: &Fitted) -> f64 {
    let n = fitted.subspace.frames;
    let (mut error, mut whole) = (0.0, 0.0);
    for frame in 0..n {
        let found = psi(fitted, 1.0 + frame as f64);
        let mean = fitted.shape.offset();
        for ((z, found), mean) in sequence.frame(frame).iter().zip(found).zip(mean) {
            error += (f64::from(*z) - found).powi(2);
            whole += (f64::from(*z) - mean).powi(2);
        }
    }
    (error / whole).sqrt()
}

#[test]
fn the_reported_total_is_what_the_frames_say() {
    let sequence = swing(30, 60);
    for options in [
        given(32, 30, 5),
        given(12, 20, 4),
        given(20, 9, 8),
        given(32, 3, 0),
    ] {
        let fitted = fit(&sequence, &options);
        let measured = measured(&sequence, &fitted);
        // sums of squares in different orders; the mean mode carries (3) + (4) exactly
        assert!(
            (fitted.errors.total - measured).abs() < 1e-12,
            "{:?} {measured}",
            fitted.errors
        );
    }
}

#[test]
fn the_frames_errors_have_the_total_as_their_mean() {
    let sequence = swing(30, 60);
    for options in [given(12, 20, 4), given(32, 30, 29)] {
        let loom = fit::fit(&sequence, &options, &Task::default())
            .unwrap()
            .output;
        let squares: f64 = loom.frame_errors().iter().map(|error| error * error).sum();
        let total = loom.report().error.total;
        // squares of frames differ from those of the whole by rounding of the motion's own
        assert!(
            (squares / 30.0 - total * total).abs() < 1e-14,
            "{squares} {total}"
        );
    }
}

#[test]
fn with_an_exact_time_signal_shape_and_pose_errors_add_up() {
    let fitted = fit(&swing(30, 60), &given(32, 12, 5));
    let (shape, pose) = (fitted.errors.shape, fitted.errors.pose);
    assert!(fitted.errors.time < 1e-14);
    // (3) + (4), H orthonormal
    assert!((fitted.errors.total.powi(2) - shape * shape - pose * pose).abs() < 1e-14);
}

#[test]
fn everything_kept_reproduces_every_frame() {
    for n in [5, 30] {
        let sequence = swing(n, 60);
        let fitted = fit(&sequence, &given(n + 2, n, n - 1));
        assert!(fitted.warnings.is_empty() || fitted.left_out.is_some());
        // what issue and paper ask for: k-2 = l = m+1 = n is exact
        assert!(measured(&sequence, &fitted) < 1e-8);
    }
}

#[test]
fn more_of_anything_never_makes_its_own_error_worse() {
    let sequence = swing(40, 50);
    let errors = |k, l, m| fit(&sequence, &given(k, l, m)).errors;
    for (less, more) in [(4, 6), (6, 9), (9, 20), (20, 39)] {
        assert!(errors(42, 40, more).shape < errors(42, 40, less).shape);
        assert!(errors(42, more, 8).pose <= errors(42, less, 8).pose * (1.0 + 1e-12));
    }
    assert!(errors(42, 20, 8).time < errors(12, 20, 8).time);
}

#[test]
fn a_moved_turned_or_scaled_capture_has_the_same_errors() {
    let sequence = swing(30, 60);
    let fitted = fit(&sequence, &given(14, 12, 6));
    for (scale, shift) in [(1e8, 0.0), (1e-8, 0.0), (1.0, 8.0)] {
        let moved: Vec<f32> = sequence
            .positions()
            .chunks_exact(3)
            .flat_map(|p| [p[1], -p[0], p[2]])
            .map(|x| x * scale + shift)
            .collect();
        let topology = Arc::new(Topology::from_triangles(60, &[]).unwrap());
        let again = fit(&Sequence::new(topology, moved, None), &given(14, 12, 6));
        let pairs = [
            (fitted.errors.shape, again.errors.shape),
            (fitted.errors.pose, again.errors.pose),
            (fitted.errors.time, again.errors.time),
            (fitted.errors.total, again.errors.total),
        ];
        for (a, b) in pairs {
            // f32 frames, rounded again after the shift: 1e-6 of coordinates of size 10
            assert!((a - b).abs() < 1e-4, "scale {scale} shift {shift}: {a} {b}");
        }
    }
}

#[test]
fn a_tolerance_is_kept_or_its_breach_is_said() {
    let sequence = swing(40, 50);
    for tolerance in [0.2, 0.05, 0.01, 1e-3, 1e-5] {
        let options = FitOptions {
            tolerance,
            ..FitOptions::ch12()
        };
        let fitted = fit(&sequence, &options);
        assert!(fitted.errors.total <= tolerance, "{:?}", fitted.errors);
        assert!(measured(&sequence, &fitted) <= tolerance * (1.0 + 1e-9));
    }
    let options = FitOptions {
        tolerance: 1e-4,
        sites: Some(3),
        ..FitOptions::ch12()
    };
    let fitted = fit(&sequence, &options);
    assert!(fitted.errors.total > 1e-4);
    let said = fitted
        .warnings
        .iter()
        .any(|w| w.message.contains("cannot be kept"));
    assert!(said, "{:?}", fitted.warnings);
}

#[test]
fn a_looser_tolerance_stores_no_more() {
    let sequence = swing(40, 50);
    let numbers = |tolerance| {
        let fitted = fit(
            &sequence,
            &FitOptions {
                tolerance,
                ..FitOptions::ch12()
            },
        );
        let signals = &fitted.signals;
        2 * signals.time.controls().len() + signals.pose.sites().len() * fitted.shape.modes()
    };
    let sizes = [0.2, 0.1, 0.03, 0.01, 0.001].map(numbers);
    assert!(sizes.is_sorted(), "{sizes:?}");
}

#[test]
fn what_is_given_is_kept_and_the_rest_follows() {
    let sequence = swing(40, 50);
    let options = FitOptions {
        sites: Some(36),
        tolerance: 0.05,
        ..FitOptions::ch12()
    };
    let fitted = fit(&sequence, &options);
    assert_eq!(fitted.signals.pose.sites().len(), 36);
    assert!(fitted.errors.total <= 0.05, "{:?}", fitted.errors);
    let options = FitOptions {
        controls: Some(30),
        tolerance: 0.05,
        ..FitOptions::ch12()
    };
    let fitted = fit(&sequence, &options);
    assert_eq!(fitted.signals.time.controls().len(), 30);
}

#[test]
fn numbers_out_of_bounds_are_refused_and_the_bound_is_named() {
    let sequence = swing(10, 20);
    for (options, bound) in [
        (given(3, 5, 5), "4 <= k <= n+2, which is 12"),
        (given(13, 5, 5), "4 <= k <= n+2, which is 12"),
        (given(8, 2, 5), "3 <= l <= n, which is 10"),
        (given(8, 11, 5), "3 <= l <= n, which is 10"),
        (given(8, 5, 10), "0 <= m <= n-1, which is 9"),
    ] {
        let refusal = refusal(&sequence, &options);
        assert!(refusal.contains(bound), "{refusal}");
    }
    let alpha = FitOptions {
        alpha: 1.5,
        ..FitOptions::ch12()
    };
    assert!(refusal(&sequence, &alpha).contains("alpha is 1.5"));
    let tolerance = FitOptions {
        tolerance: f64::NAN,
        ..FitOptions::ch12()
    };
    assert!(refusal(&sequence, &tolerance).contains("tolerance"));
}

#[test]
fn pinned_frames_stay_where_they_are_put() {
    let sequence = swing(25, 40);
    let free = fit(&sequence, &given(20, 15, 6));
    let pin = |frame, at| Pin { frame, at };
    let pins = vec![
        pin(3, PinPlace::Layout([0.25, -1.5])),
        pin(20, PinPlace::Layout([1.0 / 3.0, 2.0])),
    ];
    let pinned = fit(
        &sequence,
        &FitOptions {
            pins,
            ..given(20, 15, 6)
        },
    );
    assert_eq!(pinned.signals.layout.positions[2], [0.25, -1.5]);
    assert_eq!(pinned.signals.layout.positions[19], [1.0 / 3.0, 2.0]);
    assert!(pinned.signals.layout.stress > free.signals.layout.stress);
    let pins = vec![
        pin(1, PinPlace::Box([0.0, 1.0])),
        pin(9, PinPlace::Box([0.5, 0.5])),
    ];
    let pinned = fit(
        &sequence,
        &FitOptions {
            pins,
            ..given(20, 15, 6)
        },
    );
    let axis = |axis: usize| free.signals.layout.positions.iter().map(move |p| p[axis]);
    let (least, most) = (
        axis(0).fold(f64::MAX, f64::min),
        axis(1).fold(f64::MIN, f64::max),
    );
    assert_eq!(pinned.signals.layout.positions[0][0], least);
    // low + (high - low) rounds once
    assert!((pinned.signals.layout.positions[0][1] - most).abs() < 1e-14);
}

#[test]
fn pins_that_name_no_frame_or_one_twice_are_refused() {
    let sequence = swing(10, 20);
    let pins = |frames: &[usize]| FitOptions {
        pins: frames
            .iter()
            .map(|&frame| Pin {
                frame,
                at: PinPlace::Layout([0.0, 0.0]),
            })
            .collect(),
        ..FitOptions::ch12()
    };
    assert!(refusal(&sequence, &pins(&[11])).contains("no frame 11 to pin"));
    assert!(refusal(&sequence, &pins(&[0])).contains("no frame 0 to pin"));
    assert!(refusal(&sequence, &pins(&[4, 4])).contains("pinned twice"));
}

#[test]
fn straight_motion_needs_one_mode_and_is_right_between_frames() {
    let fitted = fit(
        &straight(21),
        &FitOptions {
            tolerance: 1e-4,
            ..FitOptions::ch12()
        },
    );
    assert_eq!(fitted.shape.modes(), 1);
    let left_out = fitted.left_out.expect("21 frames");
    for error in [left_out.psi, left_out.linear, left_out.cubic] {
        // frames are f32: 1e-7 of their coordinates, which are ten times the motion
        assert!(error < 1e-5, "{left_out:?}");
    }
    assert!(fitted.warnings.is_empty() || left_out.psi > left_out.linear);
}

#[test]
fn few_or_motionless_frames_are_constant_or_a_segment() {
    for n in [1, 2, 6] {
        let still = capture(n, 10, |v, _| [v, v * 0.1, 0.3]);
        let fitted = fit(&still, &FitOptions::ch12());
        assert_eq!(fitted.shape.modes(), 0);
        assert_eq!(fitted.errors.total, 0.0);
        for (z, expected) in psi(&fitted, 1.0).iter().zip(still.frame(0)) {
            assert_eq!(*z, f64::from(*expected));
        }
        assert!(
            fitted
                .warnings
                .iter()
                .any(|w| w.message.contains("nothing moves"))
        );
    }
    let two = straight(2);
    let fitted = fit(&two, &FitOptions::ch12());
    assert!(measured(&two, &fitted) < 1e-12);
    let (a, b, middle) = (psi(&fitted, 1.0), psi(&fitted, 2.0), psi(&fitted, 1.5));
    for ((a, b), middle) in a.iter().zip(&b).zip(&middle) {
        assert!((0.5 * (a + b) - middle).abs() < 1e-12);
    }
}

#[test]
fn a_pose_that_is_held_and_a_cycle_run_twice_are_fitted() {
    let held = capture(30, 30, |v, t| {
        let t = t.clamp(0.3, 0.6);
        [
            v.sin() + (8.0 * t).sin(),
            v.cos() * (1.0 + t),
            (v + 5.0 * t).sin(),
        ]
    });
    let cycle = capture(33, 30, |v, t| {
        let turn = 4.0 * std::f64::consts::PI * t;
        [
            v.sin() + turn.sin(),
            v.cos() * (2.0 + turn.cos()),
            (v + turn.sin()).sin(),
        ]
    });
    for sequence in [held, cycle] {
        let fitted = fit(
            &sequence,
            &FitOptions {
                tolerance: 1e-3,
                ..FitOptions::ch12()
            },
        );
        assert!(measured(&sequence, &fitted) <= 1e-3, "{:?}", fitted.errors);
    }
}

#[test]
fn the_number_of_threads_does_not_show() {
    // more than 2^16 coordinates: several panels, several groups
    let sequence = swing(9, 22_000);
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        let fitted = pool.install(|| fit(&sequence, &given(9, 7, 8)));
        (fitted.shape, fitted.signals, fitted.errors)
    };
    assert_eq!(run(1), run(2));
}

fn loom(sequence: &Sequence, options: &FitOptions) -> Loom {
    fit::fit(sequence, options, &Task::default())
        .unwrap()
        .output
}

/// A tube of 8 x 12 vertices that bends, twists and travels `way` along x, turning about y by `turn`.
fn tube(n: usize, way: f64, turn: f64) -> Sequence {
    let (around, along) = (8, 12);
    let moving = capture(n, around * along, |v, t| {
        let angle = (v % around as f64) * std::f64::consts::TAU / around as f64;
        let height = (v / around as f64).floor() / 3.0;
        let bend = 0.5 * (7.0 * t).sin() * height;
        let x = 0.3 * (angle + bend).cos() + bend * bend;
        let z = 0.3 * (angle + bend).sin() + 0.2 * height * (5.0 * t).cos();
        let (sin, cos) = (turn * t).sin_cos();
        [cos * x + sin * z + way * t, height, cos * z - sin * x]
    });
    let corner = |i: usize, j: usize| (j * around + i % around) as u32;
    let faces: Vec<[u32; 3]> = (0..along - 1)
        .flat_map(|j| (0..around).map(move |i| (i, j)))
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [
                corner(i, j),
                corner(i + 1, j),
                corner(i, j + 1),
                corner(i + 1, j + 1),
            ];
            [[a, c, b], [b, c, d]]
        })
        .collect();
    let topology = Topology::from_triangles(around * along, &faces).unwrap();
    Sequence::new(Arc::new(topology), moving.positions().to_vec(), Some(24.0))
}

/// Largest distance of a coordinate of psi(i) from frame i.
fn worst(sequence: &Sequence, loom: &Loom) -> f32 {
    let frame = |i: usize| {
        let found = loom.at((i + 1) as f64).unwrap();
        let pairs = found.into_iter().zip(sequence.frame(i));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    (0..sequence.frames()).map(frame).fold(0.0, f32::max)
}

#[test]
fn a_loom_plays_its_capture_in_every_space() {
    let sequence = tube(12, 0.0, 0.0);
    for kind in SPACES {
        let options = FitOptions {
            space: kind.name.to_string(),
            ..given(14, 12, 11)
        };
        let loom = loom(&sequence, &options);
        assert_eq!(loom.report().space, kind.name);
        // single precision of coordinates of size 4; spaces decode to 1e-6 of the box
        assert!(worst(&sequence, &loom) < 1e-5, "{}", kind.name);
    }
    let options = FitOptions {
        space: "quaternions".to_string(),
        ..given(14, 12, 11)
    };
    let error = fit::fit(&sequence, &options, &Task::default()).expect_err("a refusal");
    assert!(error.message.contains("no space `quaternions`"), "{error}");
}

#[test]
fn root_motion_is_kept_apart_and_put_back() {
    let sequence = tube(30, 9.0, 2.5);
    let still = fit::fit(&sequence, &given(32, 30, 29), &Task::default()).unwrap();
    assert!(
        still.warnings.iter().any(|w| w.message.contains("travels")),
        "{:?}",
        still.warnings
    );
    let without = worst(&sequence, &loom(&sequence, &given(32, 30, 4)));
    for kind in [RootKind::Ground, RootKind::Rigid] {
        let options = FitOptions {
            root: Some(kind),
            ..given(32, 30, 29)
        };
        let rooted = fit::fit(&sequence, &options, &Task::default()).unwrap();
        assert!(
            !rooted
                .warnings
                .iter()
                .any(|w| w.message.contains("travels"))
        );
        // frames are single precision, of size 10
        assert!(worst(&sequence, &rooted.output) < 1e-5);
        // the way and the turns take no modes any more
        let few = loom(
            &sequence,
            &FitOptions {
                root: Some(kind),
                ..given(32, 30, 4)
            },
        );
        assert!(worst(&sequence, &few) < 0.5 * without);
    }
}

#[test]
fn the_report_names_what_the_command_line_promises() {
    let loom = loom(&tube(12, 0.0, 0.0), &given(10, 8, 5));
    let json = serde_json::to_value(loom.report().as_ref()).unwrap();
    for key in [
        "frames",
        "vertices",
        "faces",
        "space",
        "dimension",
        "controls",
        "sites",
        "modes",
        "fps",
        "error",
        "left_out",
        "stress",
        "warnings",
    ] {
        assert!(json.get(key).is_some(), "{key} in {json}");
    }
    for (group, keys) in [
        ("error", &["shape", "pose", "time", "total"][..]),
        ("left_out", &["psi", "linear", "cubic"][..]),
    ] {
        assert!(
            keys.iter().all(|key| json[group][key].is_number()),
            "{group} in {json}"
        );
    }
    assert_eq!(
        (json["controls"].as_u64(), json["sites"].as_u64()),
        (Some(10), Some(8))
    );
    assert_eq!(
        (json["frames"].as_u64(), json["dimension"].as_u64()),
        (Some(12), Some(288))
    );
}

#[test]
fn a_dragged_pin_settles_into_what_a_fit_under_it_gives() {
    let sequence = tube(25, 0.0, 0.0);
    let free = loom(&sequence, &given(20, 15, 6));
    let task = Task::default();
    let mut session = Session::of(&free).unwrap();
    let place = |frame: usize, by: f64| free.layout().positions[frame].map(|x| x + by);
    session.drag(4, place(4, 0.0), &task).unwrap();
    for step in 1..=5 {
        let to = place(18, 0.02 * f64::from(step));
        let signals = session.drag(18, to, &task).unwrap();
        assert_eq!(signals.layout.positions[18], to);
        assert_eq!(signals.layout.positions[4], place(4, 0.0));
        assert_eq!(signals.pose.site_frames(), free.pose().site_frames());
        assert_eq!(signals.time.controls().len(), 20);
    }
    let settled = session.settle(&task).unwrap();
    let settled = session.loom(&free, settled).unwrap();
    let pin = |frame: usize, by: f64| Pin {
        frame: frame + 1,
        at: PinPlace::Layout(place(frame, by)),
    };
    let pins = vec![pin(4, 0.0), pin(18, 0.1)];
    let cold = loom(
        &sequence,
        &FitOptions {
            pins,
            ..given(20, 15, 6)
        },
    );
    assert_eq!(settled.layout(), cold.layout());
    assert_eq!(settled.at(7.3).unwrap(), cold.at(7.3).unwrap());
    assert!((settled.report().error.total - cold.report().error.total).abs() < 1e-12);
    assert!(session.drag(25, [0.0, 0.0], &task).is_err());
    assert!(session.drag(3, [f64::NAN, 0.0], &task).is_err());
}

/// Every `step`-th frame of a shared capture, where there is one.
fn shared(name: &str, step: usize) -> Option<Sequence> {
    let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let Ok(bytes) = fs::read(folder.join(name).join("frames.pc2")) else {
        println!("skipped: no real captures");
        return None;
    };
    let vertices = u32::from_le_bytes(bytes[16..20].try_into().unwrap()) as usize;
    let frames = bytes[32..].chunks_exact(12 * vertices).step_by(step);
    let numbers = frames.flat_map(|frame| frame.as_chunks::<4>().0);
    let positions = numbers.map(|number| f32::from_le_bytes(*number)).collect();
    let topology = Topology::from_triangles(vertices, &[]).unwrap();
    Some(Sequence::new(Arc::new(topology), positions, None))
}

#[test]
fn the_gallop_of_figure_1_is_as_good_as_the_orientation_says() {
    let Some(sequence) = shared("horse-gallop", 2) else {
        return;
    };
    let fitted = fit(&sequence, &given(16, 12, 7));
    let errors = fitted.errors;
    // shape .06665, pose .0001, time .081, total .181, each times 1.05
    assert!((errors.shape - 0.06665).abs() < 5e-6, "{errors:?}");
    assert!(
        errors.pose <= 1.05e-4 && errors.time <= 0.0851 && errors.total <= 0.190,
        "{errors:?}"
    );
    assert_eq!(fitted.signals.distinct, 12);
    // the two strides lie on each other
    let positions = &fitted.signals.layout.positions;
    let size = fitted.subspace.spread / (positions.len() as f64).sqrt();
    for i in 0..12 {
        let (p, q) = (positions[i], positions[i + 12]);
        assert!((p[0] - q[0]).hypot(p[1] - q[1]) < 1e-3 * size);
    }
}

#[test]
fn real_captures_are_exact_at_full_fidelity() {
    for name in ["flag", "lowpoly-deer-gallop"] {
        let Some(sequence) = shared(name, 1) else {
            return;
        };
        let n = sequence.frames();
        let fitted = fit(
            &sequence,
            &FitOptions {
                left_out: false,
                ..given(n + 2, n, n - 1)
            },
        );
        assert!(
            measured(&sequence, &fitted) < 1e-8,
            "{name}: {:?}",
            fitted.errors
        );
    }
}
