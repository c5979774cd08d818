//! Edits of real captures, where these are beside the repository.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use meshloom::edit::{Edit, add_loop};
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::mesh::{Sequence, Topology};
use meshloom::task::Task;

/// A capture's frames as points, fitted the paper's way with k, l, m; none where there are no captures.
fn fitted(name: &str, (k, l, m): (usize, usize, usize)) -> Option<Loom> {
    let options = FitOptions {
        controls: Some(k),
        sites: Some(l),
        modes: Some(m),
        ..FitOptions::ch12()
    };
    fitted_with(name, options)
}

fn fitted_with(name: &str, options: FitOptions) -> Option<Loom> {
    let data = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared/data"));
    let Ok(bytes) = fs::read(data.join(name).join("frames.pc2")) else {
        println!("skipped: no real captures");
        return None;
    };
    let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
    let vertices = u32::from_le_bytes(word(16)) as usize;
    let positions = (32..bytes.len())
        .step_by(4)
        .map(|at| f32::from_le_bytes(word(at)));
    let points = Topology::from_triangles(vertices, &[]).expect("no faces, no faults");
    let sequence = Sequence::new(Arc::new(points), positions.collect(), Some(24.0));
    let options = FitOptions {
        left_out: false,
        ..options
    };
    let fitted = fit(&sequence, &options, &Task::default()).expect("the capture is sound");
    Some(fitted.output)
}

#[test]
fn loops_of_real_captures_show_no_seam() {
    // the flag's ends lie far apart, the horse's strides on each other
    for (name, size, from, to) in [
        ("flag", (140, 120, 60), 30.0, 48.0),
        ("horse-gallop", (40, 30, 20), 12.0, 36.0),
    ] {
        let Some(loom) = fitted(name, size) else {
            return;
        };
        let looped = add_loop(&loom, from, to, 1, None).expect("the loop lies within");
        assert!(
            looped.seam.worst() <= 1.5,
            "{name}: {} {:?}",
            looped.bridge,
            looped.seam
        );
        let shift = looped.loom.frames() - loom.frames();
        for frame in (1..=loom.frames()).map(|frame| frame as f64) {
            let before = loom.at(frame).expect("a frame");
            if frame < to - 5.0 {
                assert_eq!(
                    looped.loom.at(frame).expect("a frame"),
                    before,
                    "{name} {frame}"
                );
            }
            if frame > from + 5.0 {
                let there = frame + shift as f64;
                assert_eq!(
                    looped.loom.at(there).expect("a frame"),
                    before,
                    "{name} {frame}"
                );
            }
        }
    }
}

#[test]
fn loops_of_ordered_fits_show_no_seam() {
    for (name, from, to) in [
        ("flag", 30.0, 48.0),
        ("flag", 18.0, 107.0),
        ("horse-gallop", 10.0, 40.0),
        ("horse-gallop", 8.0, 25.0),
    ] {
        let Some(loom) = fitted_with(name, FitOptions::default()) else {
            return;
        };
        let looped = add_loop(&loom, from, to, 1, None).expect("the loop lies within");
        let (bridge, seam) = (looped.bridge, looped.seam);
        assert!(
            seam.worst() <= 1.5,
            "{name} {from}..{to}: {bridge} {seam:?}"
        );
    }
}

#[test]
fn edits_follow_each_other_on_a_real_capture() {
    let Some(loom) = fitted("horse-gallop", (40, 30, 20)) else {
        return;
    };
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
    let last = edits
        .iter()
        .try_fold(loom, |loom, edit| Ok(edit.apply(&loom)?.output));
    let last: Loom = last
        .map_err(|e: Box<meshloom::diag::Diagnostic>| e.to_string())
        .expect("edits apply");
    assert_eq!(last.frames(), 81 + 12);
    for i in 0..=920 {
        let positions = last.at(1.0 + f64::from(i) / 10.0).expect("within");
        assert!(positions.iter().all(|x| x.is_finite()));
    }
}
