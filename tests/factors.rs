//! No factor is computed twice for the same mesh: one test in a process of its own, for it counts.

use std::sync::Arc;

use meshloom::demo::Demo;
use meshloom::edit::transfer::{Examples, transfer};
use meshloom::format;
use meshloom::loom::Loom;
use meshloom::loom::fit::{FitOptions, fit};
use meshloom::math::sparse::factorisations;
use meshloom::mesh::{Sequence, Topology};
use meshloom::pipeline::{FitRequest, Memory, Times, Workbench};
use meshloom::task::Task;
use meshloom::world::MemoryWorld;

/// A tube that bends and swells, frame by frame.
fn tube(length: usize, around: usize, frames: usize) -> Sequence {
    let at = |i: usize, j: usize| (i * around + j % around) as u32;
    let mut triangles = Vec::new();
    for i in 1..length {
        for j in 0..around {
            let [a, b, c, d] = [at(i - 1, j), at(i - 1, j + 1), at(i, j + 1), at(i, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    let mut positions = Vec::new();
    for frame in 0..frames {
        let t = frame as f64 / frames as f64;
        for i in 0..length {
            for j in 0..around {
                let x = 4.0 * i as f64 / length as f64 - 2.0;
                let angle = std::f64::consts::TAU * j as f64 / around as f64;
                let r = 0.5 + 0.1 * (3.0 * x + 7.0 * t).sin();
                let p = [
                    x,
                    r * angle.cos() + (2.0 * t).sin() * x * x,
                    r * angle.sin(),
                ];
                positions.extend(p.map(|x| x as f32));
            }
        }
    }
    let topology = Topology::from_triangles(length * around, &triangles).unwrap();
    Sequence::new(Arc::new(topology), positions, Some(24.0))
}

/// How many factors `work` made.
fn made<T>(work: impl FnOnce() -> T) -> (T, usize) {
    let before = factorisations();
    let done = work();
    (done, factorisations() - before)
}

/// The factors that one mesh and reference pose need: one for positions or rotations, or one for each.
const NEEDED: [(&str, usize); 3] = [("gradients", 1), ("patch-lri", 2), ("lri", 2)];

fn loom_of(capture: &Sequence, space: &str) -> Loom {
    let options = FitOptions {
        space: space.to_string(),
        ..FitOptions::default()
    };
    fit(capture, &options, &Task::default()).unwrap().output
}

#[test]
fn a_mesh_and_its_reference_pose_are_factored_once() {
    let (capture, target) = (tube(16, 8, 9), tube(11, 9, 9));
    for (space, needed) in NEEDED {
        // a fit tries many k, l, m, and measures the frames between
        let (loom, factors) = made(|| loom_of(&capture, space));
        assert_eq!(factors, needed, "{space}: fit");
        let ((), factors) = made(|| {
            for t in 1..=9 {
                loom.at(f64::from(t)).unwrap();
            }
        });
        assert_eq!(factors, 0, "{space}: sample");
        let (again, factors) = made(|| loom_of(&capture, space));
        assert_eq!(factors, 0, "{space}: the same fit again");
        let bytes = format::loom::write(&again).unwrap();
        let (loaded, factors) = made(|| format::loom::read(&bytes).unwrap());
        assert_eq!(factors, 0, "{space}: load");
        assert_eq!(loaded.at(3.5).unwrap(), loom.at(3.5).unwrap());
        // the source examples begin with the loom's own reference pose: the target is what is new
        let examples = Examples::new(capture.slice(0..4), target.slice(0..4)).unwrap();
        let (moved, factors) = made(|| transfer(&loom, &examples, &Task::default()).unwrap());
        assert_eq!(factors, needed, "{space}: transfer");
        let (_, factors) = made(|| transfer(&loaded, &examples, &Task::default()).unwrap());
        assert_eq!(factors, 0, "{space}: transfer of the loaded loom");
        drop(moved);
    }
    // gradients and patch-lri need the same system for positions
    let gradients = loom_of(&capture, "gradients");
    let (_, factors) = made(|| loom_of(&capture, "patch-lri"));
    assert_eq!(factors, 1, "patch-lri beside gradients");
    // what is no longer held is given back: it has to be made again
    drop(gradients);
    let (_, factors) = made(|| loom_of(&capture, "gradients"));
    assert_eq!(factors, 1);
    // a recipe's fits that differ in what they keep, its edits and frames
    let bar = Demo::find("bar").unwrap().generate();
    let held = loom_of(&bar, "gradients");
    let (_, factors) = made(recipe);
    assert_eq!(factors, 0, "a recipe beside a loom of the same capture");
    drop(held);
    let (_, factors) = made(recipe);
    assert_eq!(factors, 1, "a recipe alone");
}

/// Two fits of the bar, sampled, in one workbench as a recipe has it.
fn recipe() {
    let memory = Arc::new(Memory::new(1 << 26, None));
    let bench = Workbench::new(Arc::new(MemoryWorld::default()), memory, Task::default());
    let frames = bench.demo("bar").unwrap().output;
    for tolerance in [0.05, 0.01] {
        let request = FitRequest {
            space: Some("gradients".to_string()),
            tolerance: Some(tolerance),
            ..FitRequest::default()
        };
        let loom = bench.fit(&frames, &request).unwrap().output;
        let times = Times::Rate(2.0);
        bench.sample(&loom, &times).unwrap();
    }
}
