//! The laws of edits, on built-in captures and on real ones, where these are beside the repository.

use std::path::Path;
use std::sync::OnceLock;

use meshloom::demo::Demo;
use meshloom::diag::{Diagnostic, Warned};
use meshloom::edit::transfer::{Examples, transfer};
use meshloom::edit::{
    Edit, Looped, add_loop, exaggerate, extend, hold, insert_control, move_control, retime,
    reverse, smooth, speed, trim,
};
use meshloom::io::Disk;
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{FrameSource, Sequence};
use meshloom::pipeline::{self, InputSpec};
use meshloom::sample::{Sampled, Times};
use meshloom::signal::root::RootKind;
use meshloom::task::Task;

/// A real capture; none where there are no captures.
fn capture(name: &str) -> Option<Sequence> {
    let data = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let path = data.join(name);
    if !path.exists() {
        println!("skipped: no real captures");
        return None;
    }
    let opened = pipeline::open(&Disk, &InputSpec::new(path), &Task::default());
    let content = opened.expect("the capture is sound").output.content;
    Some(content.sequence(&Task::default()).expect("it can be read"))
}

fn fitted(sequence: &Sequence, options: &FitOptions) -> Loom {
    let fitted = fit(sequence, options, &Task::default());
    fitted.expect("the capture can be fitted").output
}

/// Looms as recipes get them: `fit(input())`, of demos and of real captures; one that walks over the ground.
fn looms() -> &'static [(&'static str, Loom)] {
    static MADE: OnceLock<Vec<(&'static str, Loom)>> = OnceLock::new();
    MADE.get_or_init(|| {
        let demo = |name: &str| Demo::find(name).expect("a demo").generate();
        let travelling = FitOptions {
            root: Some(RootKind::Ground),
            ..FitOptions::default()
        };
        let mut all = vec![
            ("gallop", fitted(&demo("gallop"), &FitOptions::default())),
            ("walk", fitted(&demo("walk"), &travelling)),
        ];
        for name in [
            "horse-gallop",
            "flag",
            "lowpoly-horse-walk",
            "lowpoly-deer-gallop",
        ] {
            let found = capture(name).map(|found| fitted(&found, &FitOptions::default()));
            all.extend(found.map(|loom| (name, loom)));
        }
        all
    })
}

fn at(loom: &Loom, t: f64) -> Vec<f32> {
    loom.at(t).expect("a time of the loom")
}

/// The span of the curve that a time lies in.
fn span(loom: &Loom, t: f64) -> usize {
    loom.time().place_at(t).expect("a time of the loom").0.span
}

/// How far the capture reaches: what differences are relative to.
fn extent(loom: &Loom) -> f32 {
    at(loom, 1.0).iter().fold(0.0, |most, x| most.max(x.abs()))
}

fn farthest(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Frame `frame` of `before` has the same bits `shift` frames later in `after`.
fn same_bits(name: &str, before: &Loom, after: &Loom, frame: usize, shift: i64) {
    let there = (frame as i64 + shift) as f64;
    let same = at(before, frame as f64) == at(after, there);
    assert!(same, "{name}: frame {frame} by {shift}");
}

#[test]
fn frames_outside_of_a_changed_support_keep_their_bits() {
    for (name, loom) in looms() {
        let (n, k) = (loom.frames(), loom.time().controls().len());
        let spans: Vec<usize> = (1..=n).map(|frame| span(loom, frame as f64)).collect();
        let (from, to) = (n / 3, 2 * n / 3);
        let (a, b) = (from as f64, to as f64);

        let control = k / 2;
        let place = loom.time().controls()[control - 1];
        let moved = move_control(loom, control, [place[0] + 0.1, place[1]]).expect("it exists");
        // control point j (from 1) acts on the spans j-4 to j-1 (from 0)
        let acts = control.saturating_sub(4)..control;
        let more = insert_control(loom, 0.5 * (a + b) + 0.37).expect("no knot there");
        let put = span(loom, 0.5 * (a + b) + 0.37);
        let smoothed = smooth(loom, a, b, 0.7).expect("long enough");
        let slower = speed(loom, a, b, 0.5).expect("a speed").output;
        let held = hold(loom, a, 5).expect("a time");
        let part = trim(loom, a, b).expect("a stretch").output;
        let mut untouched = 0;
        for frame in 1..=n {
            let own = spans[frame - 1];
            if !acts.contains(&own) {
                same_bits(name, loom, &moved, frame, 0);
                untouched += 1;
            }
            if own.abs_diff(put) > 2 {
                same_bits(name, loom, &more, frame, 0);
            }
            if frame <= from || frame >= to {
                same_bits(name, loom, &smoothed, frame, 0);
                let shift = if frame >= to { to - from } else { 0 };
                same_bits(name, loom, &slower, frame, shift as i64);
            }
            if frame < from || frame > from + 1 {
                same_bits(name, loom, &held, frame, if frame > from { 5 } else { 0 });
            }
            if (from..=to).contains(&frame) {
                same_bits(name, loom, &part, frame, 1 - from as i64);
            }
        }
        assert!(untouched > 0 && untouched < n, "{name}: {untouched}");
        let longer = extend(loom, 7, &Task::default())
            .expect("few frames")
            .output;
        // around a loop that closes the two spans at the seam change
        let kept = |frame: &usize| spans[frame - 1] + 2 < spans[n - 1];
        (1..=n)
            .filter(kept)
            .for_each(|frame| same_bits(name, loom, &longer, frame, 0));
        let plain = exaggerate(loom, 1.0).expect("finite");
        (1..=n).for_each(|frame| same_bits(name, loom, &plain, frame, 0));
    }
}

#[test]
fn an_inserted_control_point_leaves_the_motion_as_it_is() {
    for (name, loom) in looms() {
        let t = 0.43 * loom.frames() as f64;
        let more = insert_control(loom, t).expect("no knot there");
        assert_eq!(
            more.time().controls().len(),
            loom.time().controls().len() + 1
        );
        for i in -30..=30 {
            let (a, b) = (
                at(loom, t + 0.2 * f64::from(i)),
                at(&more, t + 0.2 * f64::from(i)),
            );
            // roundings of the curve's doubles, then of single precision
            assert!(farthest(&a, &b) <= 1e-5 * extent(loom), "{name} {i}");
        }
    }
}

#[test]
fn resampling_at_the_frames_own_times_is_the_identity() {
    for (name, loom) in looms() {
        let n = loom.frames();
        let rate = loom.fps().unwrap_or(24.0);
        let loom = loom.with_fps(Some(rate)).expect("a rate");
        let own: Vec<f64> = (1..=n).map(|frame| frame as f64).collect();
        for times in [
            Times::Integers,
            Times::Count(n),
            Times::Rate(1.0),
            Times::PerSecond(rate),
            Times::List(own),
        ] {
            let sampling = times.over(n, loom.fps()).expect("its own times");
            assert_eq!(sampling.fps, Some(rate), "{name} {times:?}");
            let sampled = Sampled::new(loom.clone(), sampling);
            assert_eq!(sampled.frames(), n, "{name} {times:?}");
            let mut frame = vec![0.0; 3 * sampled.topology().vertices()];
            for index in 0..n {
                sampled
                    .read_frame(index, &mut frame)
                    .expect("it is computed");
                assert_eq!(
                    frame,
                    at(&loom, (index + 1) as f64),
                    "{name} {times:?} {index}"
                );
            }
        }
    }
}

#[test]
fn reversing_twice_is_the_identity() {
    for (name, loom) in looms() {
        let n = loom.frames() as f64;
        let back = reverse(loom).expect("time can be turned");
        let again = reverse(&back).expect("time can be turned");
        for i in 0..=4 * (loom.frames() - 1) {
            let t = 1.0 + 0.25 * i as f64;
            assert_eq!(at(loom, t), at(&again, t), "{name} {t}");
        }
        for frame in 1..=loom.frames() {
            let mirrored = at(&back, n + 1.0 - frame as f64);
            assert_eq!(at(loom, frame as f64), mirrored, "{name} {frame}");
        }
    }
}

#[test]
fn retimes_compose() {
    for (name, loom) in looms() {
        let n = loom.frames() as f64;
        let first = [[1.0, 1.0], [0.4 * n, 0.6 * n], [n, n]];
        let second = [[1.0, 1.0], [0.5 * n, 0.3 * n], [(1.2 * n).floor(), n]];
        let one = retime(loom, &first).expect("keys ascend");
        let both = retime(&one, &second).expect("keys ascend");
        // the second change of time alone
        let alone = retime(loom, &second).expect("keys ascend");
        for i in 0..=40 {
            let t = 1.0 + f64::from(i) / 40.0 * (both.frames() as f64 - 1.0);
            let (inner, _) = alone.time().source_time(t).expect("within");
            let (a, b) = (at(&both, t), at(&one, inner));
            assert!(farthest(&a, &b) <= 1e-5 * extent(loom), "{name} {t}");
        }
        let same = retime(loom, &[[1.0, 1.0], [n, n]]).expect("keys ascend");
        (1..=loom.frames()).for_each(|frame| same_bits(name, loom, &same, frame, 0));
    }
}

#[test]
fn every_frame_rate_gives_the_frames_of_the_formula() {
    const RATES: [f64; 9] = [23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 59.94, 60.0];
    for (name, loom) in looms() {
        let n = loom.frames();
        for own in RATES {
            for rate in RATES {
                let sampling = Times::PerSecond(rate).over(n, Some(own)).expect("rates");
                // MATHS.md: floor((n-1) r/fps + 1e-9) + 1 frames at 1 + i fps/r
                let steps = ((n - 1) as f64 * rate / own + 1e-9).floor();
                assert_eq!(
                    sampling.times.len(),
                    steps as usize + 1,
                    "{name} {own} {rate}"
                );
                assert_eq!(sampling.fps, Some(rate));
                for (i, t) in sampling.times.iter().enumerate() {
                    let wanted = (1.0 + i as f64 * own / rate).min(n as f64);
                    assert!((t - wanted).abs() < 1e-9, "{name} {own} {rate} {i}");
                }
            }
        }
    }
}

#[test]
fn small_moves_of_a_control_point_are_small_changes() {
    for (name, loom) in looms() {
        let control = loom.time().controls().len() / 2;
        let place = loom.time().controls()[control - 1];
        // in the middle of the spans that it acts on
        let middle = (1..=loom.frames()).find(|&frame| span(loom, frame as f64) + 2 >= control);
        let t = middle.expect("it acts on some frame") as f64;
        let change = |by: f64| {
            let moved = move_control(loom, control, [place[0] + by, place[1]]).expect("it exists");
            let (a, b) = (
                loom.shape_at(t).expect("within"),
                moved.shape_at(t).expect("within"),
            );
            a.iter()
                .zip(&b)
                .map(|(a, b)| (a - b) * (a - b))
                .sum::<f64>()
                .sqrt()
        };
        let (whole, half) = (change(1e-5), change(5e-6));
        assert!(whole > 0.0, "{name}");
        // differentiable: half the move, half the change
        assert!((whole / half - 2.0).abs() < 0.02, "{name}: {whole} {half}");
    }
}

/// The seam of a loop is told apart from the motion by at most this (PEERS.md E.6).
const SHOWS: f64 = 1.5;
/// Shapes so many times as far out as those of the motion look strange.
const STRANGE: f64 = 1.75;

/// Loops of an eighth to three quarters of a motion of so many frames, laid over it evenly.
fn loops(frames: usize) -> Vec<(usize, usize)> {
    let mut all = Vec::new();
    for eighths in [1, 2, 4, 6] {
        let length = (frames * eighths / 8).max(4);
        let room = frames - 1 - length;
        let starts = (0..=2).map(|i| 1 + room * i / 2);
        all.extend(starts.map(|from| (from, from + length)));
    }
    all
}

fn looped(loom: &Loom, (from, to): (usize, usize), bridge: Option<usize>) -> Looped {
    let looped = add_loop(loom, from as f64, to as f64, 1, bridge, &Task::default());
    looped.expect("within")
}

/// The loop, whose seam does not show, and whose frames more than three spans from it keep their bits.
fn looped_without_a_seam(name: &str, loom: &Loom, (from, to): (usize, usize)) {
    let looped = looped(loom, (from, to), None);
    let (bridge, seam) = (looped.bridge, looped.seam);
    assert!(
        seam.worst() <= SHOWS,
        "{name} {from}..{to}: {bridge} {seam:?}"
    );
    only_the_seam_changes(name, loom, &looped, (from, to));
    let (a, b) = (span(loom, from as f64), span(loom, to as f64));
    let shift = looped.loom.frames() - loom.frames();
    for frame in 1..=loom.frames() {
        let own = span(loom, frame as f64);
        if own + 2 < b {
            same_bits(name, loom, &looped.loom, frame, 0);
        }
        if own > a + 2 {
            let same = shape(loom, frame) == shape(&looped.loom, frame + shift);
            assert!(same, "{name}: frame {frame} by {shift}");
        }
        assert!(own + 3 >= b || frame <= looped.kept.0, "{name}: {frame}");
        assert!(own <= a + 3 || frame >= looped.kept.1, "{name}: {frame}");
    }
}

/// What a frame looks like where what travels arrives elsewhere.
fn shape(loom: &Loom, frame: usize) -> Vec<f64> {
    loom.coordinates_at(frame as f64).expect("within")
}

fn only_the_seam_changes(name: &str, loom: &Loom, looped: &Looped, (from, to): (usize, usize)) {
    let shift = looped.loom.frames() - loom.frames();
    assert_eq!(shift, to - from + looped.bridge);
    for frame in 1..=looped.kept.0 {
        same_bits(name, loom, &looped.loom, frame, 0);
    }
    for frame in looped.kept.1..=loom.frames() {
        let same = shape(loom, frame) == shape(&looped.loom, frame + shift);
        assert!(same, "{name}: frame {frame} by {shift}");
    }
}

#[test]
fn loops_of_fits_in_the_papers_way_show_no_seam() {
    // the flag's ends lie far apart, the horse's strides on each other
    for (name, [k, l, m], ends) in [
        ("flag", [140, 120, 60], (30, 48)),
        ("horse-gallop", [40, 30, 20], (12, 36)),
    ] {
        let Some(found) = capture(name) else {
            return;
        };
        let options = FitOptions {
            controls: Some(k),
            sites: Some(l),
            modes: Some(m),
            left_out: false,
            ..FitOptions::ch12()
        };
        looped_without_a_seam(name, &fitted(&found, &options), ends);
    }
}

#[test]
fn loops_show_no_seam() {
    for (name, loom) in looms() {
        let ends: &[(usize, usize)] = match *name {
            "flag" => &[(30, 48), (18, 107)],
            "horse-gallop" => &[(10, 40), (8, 25)],
            _ => &[],
        };
        for &ends in ends {
            looped_without_a_seam(name, loom, ends);
        }
        for (from, to) in loops(loom.frames()) {
            let looped = looped(loom, (from, to), None);
            let seam = looped.seam;
            assert!(seam.worst() <= SHOWS, "{name} {from}..{to}: {seam:?}");
            let strange = looped.strangeness;
            assert!(strange <= STRANGE, "{name} {from}..{to}: {strange}");
            only_the_seam_changes(name, loom, &looped, (from, to));
        }
    }
}

#[test]
fn a_seam_that_shows_is_told_with_its_number() {
    let mut shown = 0;
    for (name, loom) in looms() {
        for ends in loops(loom.frames()) {
            let looped = looped(loom, ends, Some(0));
            only_the_seam_changes(name, loom, &looped, ends);
            let worst = looped.seam.worst();
            shown += usize::from(worst > SHOWS);
            let told = Warned::from(looped).warnings;
            let said = told
                .iter()
                .any(|w| w.message.contains(&format!("{worst:.1} times")));
            assert_eq!(said, worst > SHOWS, "{name} {ends:?}: {worst} {told:?}");
        }
    }
    assert!(shown > 0);
}

#[test]
fn edits_follow_each_other() {
    let edits = [
        Edit::AddLoop {
            from: 12.0,
            to: 36.0,
            times: 2,
            bridge: None,
        },
        Edit::Speed {
            from: 30.0,
            to: 40.0,
            factor: 0.5,
        },
        Edit::Reverse,
        Edit::Hold {
            time: 20.0,
            frames: 6,
        },
        Edit::Trim {
            from: 10.0,
            to: 90.0,
        },
        Edit::Extend { frames: 12 },
        Edit::Smooth {
            from: 5.0,
            to: 40.0,
            amount: 0.3,
        },
        Edit::InsertControl { time: 17.3 },
        Edit::Exaggerate { amount: 1.2 },
    ];
    for (name, loom) in looms() {
        let last = edits.iter().try_fold(loom.clone(), |loom, edit| {
            Ok(edit.apply(&loom, &Task::default())?.output)
        });
        let last: Loom = last
            .map_err(|e: Box<Diagnostic>| e.to_string())
            .expect("edits apply");
        assert_eq!(last.frames(), 81 + 12, "{name}");
        for i in 0..=920 {
            let positions = at(&last, 1.0 + f64::from(i) / 10.0);
            assert!(positions.iter().all(|x| x.is_finite()), "{name}");
        }
    }
}

#[test]
fn a_looped_walk_travels_on_without_a_step() {
    let (_, walk) = &looms()[1];
    let (from, to) = (12.0, 45.0);
    let looped = add_loop(walk, from, to, 2, None, &Task::default())
        .expect("within")
        .loom;
    let place = |loom: &Loom, frame: usize| {
        let root = loom.root_at(frame as f64).expect("within");
        root.translation.vector
    };
    let step = |loom: &Loom, frame: usize| place(loom, frame + 1) - place(loom, frame);
    let all = 1..walk.frames();
    let longest = all
        .clone()
        .map(|frame| step(walk, frame).norm())
        .fold(0.0, f64::max);
    let changes = all
        .skip(1)
        .map(|frame| (step(walk, frame) - step(walk, frame - 1)).norm());
    let jolt = changes.fold(0.0, f64::max);
    for frame in 2..looped.frames() {
        let (before, after) = (step(&looped, frame - 1), step(&looped, frame));
        assert!(after.norm() <= 1.001 * longest, "{frame}");
        assert!((after - before).norm() <= 1.5 * jolt, "{frame}");
    }
    // the same frame, pass after pass, each time as far on
    let pass = (looped.frames() - walk.frames()) / 2;
    let [first, second, third] = [0, 1, 2].map(|i| place(&looped, 20 + i * pass));
    let (one, two) = ((second - first).norm(), (third - second).norm());
    assert!(
        one > 20.0 * jolt && (two - one).abs() < 1e-9 * one,
        "{one} {two}"
    );
}

/// The looms of one pair of example sets, in the vertices themselves and in gradients: source, target.
fn examples(source: &str, target: &str) -> Option<(Sequence, Sequence)> {
    Some((capture(source)?, capture(target)?))
}

/// A loom that reproduces every frame.
fn exact(sequence: &Sequence, space: &str) -> Loom {
    let n = sequence.frames();
    let options = FitOptions {
        controls: Some(n + 2),
        sites: Some(n),
        modes: Some(n - 1),
        space: space.to_string(),
        ..FitOptions::ch12()
    };
    fitted(sequence, &options)
}

#[test]
fn examples_of_real_captures_map_to_their_targets_and_identity_is_the_source() {
    for (source, target) in [
        ("lowpoly-horse-poses", "lowpoly-deer-poses"),
        ("cat-poses", "lion-poses"),
        ("horse-poses", "elephant-poses"),
    ] {
        let Some((sources, targets)) = examples(source, target) else {
            return;
        };
        for space in ["vertices", "gradients"] {
            let loom = exact(&sources, space);
            let there = |to: &Sequence| {
                let pairs = Examples::new(sources.clone(), to.clone()).expect("they pair up");
                let found = transfer(&loom, &pairs, &Task::default());
                found.expect("examples span it").output.loom
            };
            let (same, other) = (there(&sources), there(&targets));
            let reach = |sequence: &Sequence| {
                let all = sequence.positions().iter();
                all.fold(0.0_f32, |most, x| most.max(x.abs()))
            };
            for frame in 0..sources.frames() {
                let t = (frame + 1) as f64;
                let error = farthest(&at(&same, t), sources.frame(frame)) / reach(&sources);
                // 1e-6 in coordinates; files and frames are in single precision
                assert!(error < 2e-6, "{source}, {space}, frame {t}: {error:e}");
                let error = farthest(&at(&other, t), targets.frame(frame)) / reach(&targets);
                assert!(error < 2e-6, "{target}, {space}, frame {t}: {error:e}");
            }
            // Between frames a face may turn the other way about in the source: as a motion it follows its
            // own frame before, as an example it takes the shorter turn (MATHS.md §2).
            let between = if space == "vertices" {
                sources.frames() - 1
            } else {
                0
            };
            for i in 0..=2 * between {
                let t = 1.0 + 0.5 * i as f64;
                let error = farthest(&at(&same, t), &at(&loom, t)) / reach(&sources);
                assert!(error < 4e-6, "{source}, {space}, time {t}: {error:e}");
            }
        }
    }
}

#[test]
fn a_transfer_after_a_loop_keeps_the_loop() {
    let Some((sources, targets)) = examples("lowpoly-horse-poses", "lowpoly-deer-poses") else {
        return;
    };
    let Some(gallop) = capture("lowpoly-horse-gallop") else {
        return;
    };
    let loom = fitted(&gallop, &FitOptions::default());
    let looped = add_loop(&loom, 10.0, 34.0, 2, None, &Task::default()).expect("within");
    let pairs = Examples::new(sources, targets).expect("they pair up");
    let there = |loom: &Loom| {
        let found = transfer(loom, &pairs, &Task::default());
        found.expect("examples span something").output.loom
    };
    let (before, after) = (there(&loom), there(&looped.loom));
    assert_eq!(after.frames(), looped.loom.frames());
    assert_eq!(after.time(), looped.loom.time());
    // inside of the passes, away from the seams, they are the same frames again
    let pass = 24 + looped.bridge as i64;
    let (last, first) = looped.kept;
    assert!(last > first);
    for frame in first..=last {
        same_bits("first pass", &before, &after, frame, 0);
        same_bits("second pass", &after, &after, frame, pass);
        same_bits("third pass", &after, &after, frame, 2 * pass);
    }
}
