//! Looms from scratch (CH12 §4.4): shapes put on a map by hand, g through them, and a first time signal
//! that visits them in order.

use std::sync::Arc;

use super::frames::Frames;
use super::report::FitReport;
use super::subspace::{Subspace, decomposed};
use super::{Layout, Loom, Parts, ch12};
use crate::diag::{Diagnostic, Result};
use crate::math::b_spline::Point;
use crate::math::layout;
use crate::math::pca::{Rows, Table};
use crate::mesh::{FrameSource, Sequence};
use crate::signal::pose::COINCIDENT;
use crate::signal::shape::ShapeSignal;
use crate::space::{ShapeSpace, Spaces};
use crate::task::Task;

/// What the report of a loom from scratch says of its method.
pub const SCRATCH: &str = "scratch";

/// The loom whose map has the shape `poses[i]` at `places[i]`, in the space called `space` about the
/// first. g interpolates all shapes (every one a site, in the greedy order); f passes the places in
/// order, one a frame, and another may be sketched.
///
/// One shape gives that shape everywhere; places on one line give a map that changes along it only.
///
/// # Errors
/// No shapes, or not as many places; a place that is not finite, or nearer to another than 1e-4 of all
/// their extent; a space that is unknown or does not suit the mesh; a frame rate that is not positive;
/// the task was cancelled.
pub fn pose_map(
    poses: &Sequence,
    places: &[Point],
    space: &str,
    fps: Option<f64>,
    task: &Task,
) -> Result<Loom> {
    check(poses.frames(), places)?;
    task.phase("encode", poses.frames());
    let shapes: Vec<Vec<f64>> = (0..poses.frames())
        .map(|pose| poses.frame(pose).iter().map(|&x| f64::from(x)).collect())
        .collect();
    let rows: Vec<&[f64]> = shapes.iter().map(Vec::as_slice).collect();
    let spaces = Spaces::new(Arc::clone(poses.topology()), &shapes[0]);
    let space = spaces.open(space, &rows)?;
    if space.is_identity() {
        return of_rows(&Frames::new(poses), poses, places, &space, fps, task);
    }
    let mut coordinates = vec![0.0; shapes.len() * space.dimension()];
    for (shape, row) in shapes.iter().zip(coordinates.chunks_mut(space.dimension())) {
        task.check()?;
        space.encode(shape, row);
        task.step();
    }
    let table = Table::new(&coordinates, space.dimension());
    of_rows(&table, poses, places, &space, fps, task)
}

fn of_rows(
    rows: &dyn Rows,
    poses: &Sequence,
    places: &[Point],
    space: &Arc<dyn ShapeSpace>,
    fps: Option<f64>,
    task: &Task,
) -> Result<Loom> {
    task.phase("shape", 0);
    let (pca, basis) = decomposed(rows, poses.frames().saturating_sub(1), task)?;
    let subspace = Subspace::new(&pca, &basis);
    let pose = ch12::pose(&subspace, places, places.len())?;
    let signals = ch12::Signals {
        layout: placed(places),
        pose: pose.signal,
        time: ch12::time_within(places, usize::MAX, 0.5)?,
        distinct: pose.distinct,
        merged: pose.spread,
        ordered: None,
    };
    let report = FitReport {
        vertices: poses.topology().vertices(),
        faces: poses.topology().faces(),
        space: space.name().to_string(),
        dimension: space.dimension(),
        fps,
        method: SCRATCH.to_string(),
        alpha: 0.5,
        rank: basis.rank,
        ..FitReport::of_signals(&subspace, &signals, places.len())
    };
    let shape = ShapeSignal::new(pca.mean().to_vec(), basis.vectors, basis.modes)
        .map_err(|error| Diagnostic::error(error.to_string()))?;
    Loom::new(Parts {
        topology: Arc::clone(poses.topology()),
        fps,
        space: Arc::clone(space),
        layout: Arc::new(Layout {
            positions: places.to_vec(),
            coordinates: subspace.x,
            residuals: subspace.residuals,
            pins: places.iter().copied().enumerate().collect(),
        }),
        shape: Arc::new(shape),
        pose: Arc::new(signals.pose),
        time: Arc::new(signals.time),
        root: None,
        report: Arc::new(report),
    })
}

/// Places as a layout that nothing was solved for.
fn placed(places: &[Point]) -> layout::Layout {
    layout::Layout {
        positions: places.to_vec(),
        stress: 0.0,
        relative_stress: 0.0,
        steps: 0,
        converged: true,
    }
}

fn check(poses: usize, places: &[Point]) -> Result<()> {
    if poses == 0 {
        return Diagnostic::error("a map of poses needs at least one").err();
    }
    if poses != places.len() {
        let message = format!("{poses} shapes and {} places", places.len());
        return Diagnostic::error(message).err();
    }
    if let Some(bad) = places.iter().position(|p| !finite(*p)) {
        let message = format!("the place of pose {} is not finite", bad + 1);
        return Diagnostic::error(message).err();
    }
    let near = COINCIDENT * extent(places);
    for (i, p) in places.iter().enumerate() {
        if let Some(j) = places[..i].iter().position(|q| distance(*p, *q) <= near) {
            let message = format!("poses {} and {} have the same place", j + 1, i + 1);
            return Diagnostic::error(message)
                .hint("one place of the map shows one shape")
                .err();
        }
    }
    Ok(())
}

fn finite(p: Point) -> bool {
    p[0].is_finite() && p[1].is_finite()
}

/// The larger side of the box around some points.
pub(crate) fn extent(points: &[Point]) -> f64 {
    let side = |axis: usize| {
        let along = || points.iter().map(|p| p[axis]);
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    side(0).max(side(1)).max(0.0)
}

pub(crate) fn distance(p: Point, q: Point) -> f64 {
    libm::hypot(p[0] - q[0], p[1] - q[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::demo::Demo;

    fn cactus() -> Sequence {
        Demo::find("cactus").expect("a demo").generate()
    }

    const PLACES: [Point; 3] = [[0.0, 0.0], [2.0, 0.0], [0.5, 1.5]];

    #[test]
    fn each_place_shows_its_pose_in_every_space() {
        let poses = cactus();
        let size = poses
            .positions()
            .iter()
            .fold(0.0_f32, |a, x| a.max(x.abs()));
        for kind in crate::space::SPACES {
            let map = pose_map(&poses, &PLACES, kind.name, None, &Task::default()).unwrap();
            assert_eq!((map.frames(), map.pose().sites().len()), (3, 3));
            for (pose, place) in PLACES.iter().enumerate() {
                let at_place = map.pose_at(*place).unwrap();
                let in_order = map.at((pose + 1) as f64).unwrap();
                // the round trip of a space
                let close = |(a, b): (&f32, &f32)| (a - b).abs() <= 1e-6 * size;
                let wanted = poses.frame(pose);
                assert!(at_place.iter().zip(wanted).all(close), "{}", kind.name);
                assert!(in_order.iter().zip(wanted).all(close), "{}", kind.name);
            }
        }
    }

    #[test]
    fn one_pose_is_everywhere() {
        let poses = cactus().slice(1..2);
        let map = pose_map(&poses, &[[3.0, 4.0]], "vertices", None, &Task::default()).unwrap();
        assert_eq!(map.pose_at([-1.0, 9.0]).unwrap(), poses.frame(0));
        assert_eq!((map.frames(), map.shape().modes()), (1, 0));
    }

    #[test]
    fn places_that_make_no_map_are_refused() {
        let poses = cactus();
        let of = |places: &[Point]| {
            let map = pose_map(&poses, places, "vertices", None, &Task::default());
            map.map(|_| ()).unwrap_err().message
        };
        assert!(of(&PLACES[..2]).contains("3 shapes and 2 places"));
        let twice = of(&[[0.0, 0.0], [1.0, 0.0], [1.00001, 0.0]]);
        assert!(twice.contains("poses 2 and 3 have the same place"));
        assert!(of(&[[0.0, 0.0], [f64::NAN, 0.0], [1.0, 1.0]]).contains("pose 2"));
    }
}
