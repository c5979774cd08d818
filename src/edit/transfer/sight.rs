//! A loom as its source examples see it: its shapes in coordinates about the first example, with the branches
//! that a sequence of them has.

use std::sync::Arc;

use super::{distance, encoded, open};
use crate::diag::Result;
use crate::loom::Loom;
use crate::math::b_spline::Point;
use crate::space::ShapeSpace;
use crate::task::Task;

/// An example whose distance from a frame falls below this part of itself when it takes the frame's branches
/// is that frame, whole turns away.
const BRANCHES: f64 = 0.5;

/// A loom's shapes in coordinates about q_0.
pub(super) struct Sight<'a> {
    pub(super) loom: &'a Loom,
    pub(super) space: Arc<dyn ShapeSpace>,
    /// Whether the loom's own coordinates are those about q_0.
    pub(super) own: bool,
    /// The frame (from 0) nearest q_0, from which branches are drawn where the coordinates are not its own.
    start: usize,
}

impl<'a> Sight<'a> {
    pub(super) fn new(loom: &'a Loom, sources: &[Vec<f64>]) -> Result<Self> {
        let own = loom.space().is_identity() || loom.space().state().reference == sources[0];
        let (space, start) = match own {
            true => (Arc::clone(loom.space()), 0),
            false => (
                open(loom.topology(), loom.space().name(), sources)?,
                nearest_frame(loom, &sources[0])?,
            ),
        };
        Ok(Sight {
            loom,
            space,
            own,
            start,
        })
    }

    /// The shape at a place of the map, its branches nearest those of `near` where they are not the loom's.
    pub(super) fn at(&self, p: Point, near: Option<&[f64]>) -> Vec<f64> {
        let z = coordinates_at(self.loom, p);
        if self.own {
            return z;
        }
        let mut shape = vec![0.0; 3 * self.loom.topology().vertices()];
        self.loom.space().decode(&z, &mut shape);
        let mut seen = encoded(&*self.space, &shape);
        if let Some(near) = near {
            self.space.follow(near, &mut seen);
        }
        seen
    }

    /// Shows every frame (from 0), each with the branches of its neighbour: from `start` to the end, then
    /// back to the beginning.
    pub(super) fn each_frame(
        &self,
        task: &Task,
        mut show: impl FnMut(usize, &[f64]),
    ) -> Result<()> {
        let mut first: Option<Vec<f64>> = None;
        let forth = self.start..self.loom.frames();
        let mut before: Option<Vec<f64>> = None;
        for frame in forth.chain((0..self.start).rev()) {
            task.check()?;
            if frame + 1 == self.start {
                before = first.take();
            }
            let z = self.at(self.place(frame)?, before.as_deref());
            show(frame, &z);
            if frame == self.start {
                first = Some(z.clone());
            }
            before = Some(z);
        }
        Ok(())
    }

    /// Where a frame (from 0) lies in the map.
    pub(super) fn place(&self, frame: usize) -> Result<Point> {
        self.loom.position_at((frame + 1) as f64)
    }
}

/// The frame of a loom (from 0) whose coordinates are nearest those of a shape, whole turns apart.
fn nearest_frame(loom: &Loom, shape: &[f64]) -> Result<usize> {
    let wanted = encoded(&**loom.space(), shape);
    let mut nearest = (f64::INFINITY, 0);
    for frame in 0..loom.frames() {
        let z = coordinates_at(loom, loom.position_at((frame + 1) as f64)?);
        let mut followed = wanted.clone();
        loom.space().follow(&z, &mut followed);
        let found = distance(&z, &followed);
        if found < nearest.0 {
            nearest = (found, frame);
        }
    }
    Ok(nearest.1)
}

/// h(g(p)).
fn coordinates_at(loom: &Loom, p: Point) -> Vec<f64> {
    let mut x = vec![0.0; loom.shape().modes()];
    loom.pose().evaluate(p, &mut x);
    let mut z = vec![0.0; loom.shape().dimension()];
    loom.shape().evaluate(&x, &mut z);
    z
}

/// Gives examples that are frames of the loom the branches of those frames. A sequence draws the branches
/// of its rotations from frame to frame, an example has principal ones: the same shape may lie whole turns
/// away. An example that no frame comes near but for branches keeps its own.
pub(super) fn take_branches_of(
    sight: &Sight,
    examples: &mut [Vec<f64>],
    task: &Task,
) -> Result<()> {
    let mut found: Vec<(f64, Option<Vec<f64>>)> = vec![(f64::INFINITY, None); examples.len()];
    sight.each_frame(task, |_, z| {
        for (example, found) in examples.iter().zip(&mut found).skip(1) {
            let mut followed = example.clone();
            sight.space.follow(z, &mut followed);
            let (after, before) = (distance(z, &followed), distance(z, example));
            if after < BRANCHES * before && after < found.0 {
                *found = (after, Some(followed));
            }
        }
    })?;
    for (example, (_, followed)) in examples.iter_mut().zip(found) {
        if let Some(followed) = followed {
            *example = followed;
        }
    }
    Ok(())
}
