//! Ways over the map from one frame to another, through shapes like the motion's own.
//!
//! Away from the curve g may be anything: nothing was asked of it there. Whether it is of use between two
//! frames is seen by looking.

use std::sync::OnceLock;

use rayon::prelude::*;

use crate::diag::Result;
use crate::edit::seam::Clip;
use crate::loom::Loom;
use crate::math::b_spline::Point;
use crate::signal::pose::PoseSignal;
use crate::task::Task;

/// From a frame hops lead to those next in time and to so many of those that lie nearest on the map.
const NEAREST: usize = 8;
/// A hop is judged by the shapes at so many steps along it.
const LOOKS: usize = 8;
/// Shapes that lie s times as far out as the farthest of the motion make a step this power of s as long.
const DETOUR: i32 = 4;

/// A motion without changes of time that is to be looped.
pub(super) struct Motion<'a> {
    pub(super) loom: &'a Loom,
    pub(super) clip: &'a Clip,
    pub(super) task: &'a Task,
    passages: OnceLock<Passages>,
}

impl<'a> Motion<'a> {
    pub(super) fn new(loom: &'a Loom, clip: &'a Clip, task: &'a Task) -> Self {
        Motion {
            loom,
            clip,
            task,
            passages: OnceLock::new(),
        }
    }

    /// The cheapest way from one time to another, which are those of frames or rounded to them.
    ///
    /// # Errors
    /// The task was cancelled.
    pub(super) fn passage(&self, from: f64, to: f64) -> Result<Passage> {
        let (pose, time) = (self.loom.pose(), self.loom.time());
        let passages = match self.passages.get() {
            Some(known) => known,
            None => {
                let at = |frame: usize| time.at(frame as f64).unwrap_or_default();
                let places = (1..=self.loom.frames()).map(at).collect();
                let found = Passages::new(pose, self.clip, places, self.task)?;
                self.passages.get_or_init(|| found)
            }
        };
        let frame = |t: f64| (t.round() as usize).clamp(1, self.loom.frames()) - 1;
        Ok(passages.way((pose, self.clip), frame(from), frame(to)))
    }
}

/// Hops between frames.
struct Passages {
    places: Vec<Point>,
    /// For each frame (from 0) where hops lead, and what they cost.
    hops: Vec<Vec<(usize, f64)>>,
}

/// A way over the map.
pub(super) struct Passage {
    /// Points between which the shapes change by equal lengths.
    pub(super) points: Vec<Point>,
    /// How much they change in all.
    pub(super) length: f64,
}

impl Passages {
    /// Those of a motion whose frames lie at `places`.
    fn new(pose: &PoseSignal, clip: &Clip, places: Vec<Point>, task: &Task) -> Result<Self> {
        let n = places.len();
        let squared = |a: Point, b: Point| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        let pairs = (0..n).into_par_iter().flat_map_iter(|i| {
            let mut others: Vec<usize> = (0..n).filter(|&j| j != i).collect();
            let near = |j: usize| squared(places[i], places[j]);
            others.sort_by(|&a, &b| near(a).total_cmp(&near(b)));
            others.truncate(NEAREST);
            others.extend((i + 1 < n).then_some(i + 1));
            others.into_iter().map(move |j| (i.min(j), i.max(j)))
        });
        // The way back costs the same.
        let mut pairs: Vec<(usize, usize)> = pairs.collect();
        pairs.sort_unstable();
        pairs.dedup();
        let costs = pairs.par_iter().map(|&(i, j)| {
            task.check()?;
            Ok(looked(pose, clip, [places[i], places[j]]).cost)
        });
        let costs = costs.collect::<Result<Vec<f64>>>()?;
        let mut hops = vec![Vec::new(); n];
        for (&(i, j), cost) in pairs.iter().zip(costs) {
            hops[i].push((j, cost));
            hops[j].push((i, cost));
        }
        Ok(Passages { places, hops })
    }

    /// The cheapest way from one frame to another, both from 0: straight over, or by frames between.
    fn way(&self, (pose, clip): (&PoseSignal, &Clip), from: usize, to: usize) -> Passage {
        let straight = looked(pose, clip, [self.places[from], self.places[to]]).cost;
        let frames = self.frames(from, to, straight);
        let hops = frames
            .windows(2)
            .map(|pair| [self.places[pair[0]], self.places[pair[1]]]);
        let mut points = vec![self.places[from]];
        let mut lengths = vec![0.0];
        let mut length = 0.0;
        for ends in hops {
            for (step, by) in looked(pose, clip, ends).steps.iter().enumerate() {
                length += by;
                lengths.push(length);
                points.push(between(ends, step + 1));
            }
        }
        Passage {
            points: evenly(&points, &lengths),
            length,
        }
    }

    /// The frames of the cheapest way (Dijkstra's algorithm), where straight over costs so much.
    fn frames(&self, from: usize, to: usize, straight: f64) -> Vec<usize> {
        let n = self.places.len();
        let mut cost = vec![f64::INFINITY; n];
        let mut before = vec![from; n];
        let mut open = vec![true; n];
        (cost[to], cost[from]) = (straight, 0.0);
        let cheapest = |cost: &[f64], open: &[bool]| {
            let reached = (0..n).filter(|&i| open[i] && cost[i].is_finite());
            reached.min_by(|&a, &b| cost[a].total_cmp(&cost[b]))
        };
        while let Some(here) = cheapest(&cost, &open).filter(|&here| here != to) {
            open[here] = false;
            for &(next, hop) in &self.hops[here] {
                if cost[here] + hop < cost[next] {
                    cost[next] = cost[here] + hop;
                    before[next] = here;
                }
            }
        }
        let mut way = vec![to];
        while let Some(&last) = way.last().filter(|&&last| last != from) {
            way.push(before[last]);
        }
        way.reverse();
        way
    }
}

/// What is seen along a hop.
struct Looked {
    /// How much the shapes change in each step.
    steps: [f64; LOOKS],
    cost: f64,
}

fn looked(pose: &PoseSignal, clip: &Clip, ends: [Point; 2]) -> Looked {
    let (mut before, mut here) = (vec![0.0; pose.modes()], vec![0.0; pose.modes()]);
    let mut seen = Looked {
        steps: [0.0; LOOKS],
        cost: 0.0,
    };
    pose.evaluate(ends[0], &mut before);
    for (i, step) in seen.steps.iter_mut().enumerate() {
        pose.evaluate(between(ends, i + 1), &mut here);
        let squares = here.iter().zip(&before).map(|(a, b)| (a - b) * (a - b));
        *step = squares.sum::<f64>().sqrt();
        let out = clip.poses().strangeness(&here);
        seen.cost += *step * out.max(1.0).powi(DETOUR);
        std::mem::swap(&mut before, &mut here);
    }
    seen
}

/// The point after so many steps of a hop.
fn between([a, b]: [Point; 2], steps: usize) -> Point {
    let part = steps as f64 / LOOKS as f64;
    [0, 1].map(|k| a[k] + part * (b[k] - a[k]))
}

/// As many points as there are, at equal lengths along the line through them; `lengths` tells how far along
/// each of them lies.
fn evenly(points: &[Point], lengths: &[f64]) -> Vec<Point> {
    let last = points.len() - 1;
    let mut piece = 0;
    let at = |i: usize| {
        let sought = lengths[last] * i as f64 / last.max(1) as f64;
        while piece + 1 < last && lengths[piece + 1] < sought {
            piece += 1;
        }
        let next = (piece + 1).min(last);
        let over = lengths[next] - lengths[piece];
        let part = if over > 0.0 {
            ((sought - lengths[piece]) / over).min(1.0)
        } else {
            0.0
        };
        [0, 1].map(|k| points[piece][k] + part * (points[next][k] - points[piece][k]))
    };
    (0..=last).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    fn strangest(motion: &Motion<'_>, points: &[Point]) -> f64 {
        let mut x = vec![0.0; motion.loom.pose().modes()];
        let out = points.iter().map(|&p| {
            motion.loom.pose().evaluate(p, &mut x);
            motion.clip.poses().strangeness(&x)
        });
        out.fold(0.0, f64::max)
    }

    #[test]
    fn a_way_goes_from_end_to_end_in_equal_changes() {
        // one turn of the ring takes 20.27 frames: the way from its end to its beginning is short
        let (loom, task) = (ring(10, 20, true), Task::default());
        let clip = Clip::of(&loom);
        let motion = Motion::new(&loom, &clip, &task);
        for (from, to) in [(19.0, 2.0), (4.0, 9.0), (2.0, 12.0), (7.0, 7.0)] {
            let way = motion.passage(from, to).unwrap();
            let ends = [from, to].map(|t| loom.time().at(t).unwrap());
            let (first, last) = (way.points[0], way.points[way.points.len() - 1]);
            for k in 0..2 {
                assert!((first[k] - ends[0][k]).abs() < 1e-12);
                assert!((last[k] - ends[1][k]).abs() < 1e-12);
            }
            let mean = way.length / (way.points.len() - 1) as f64;
            for pair in way.points.windows(2) {
                let mut x = [vec![0.0; 3], vec![0.0; 3]];
                (0..2).for_each(|k| loom.pose().evaluate(pair[k], &mut x[k]));
                let apart = x[0].iter().zip(&x[1]).map(|(a, b)| (a - b) * (a - b));
                let apart = apart.sum::<f64>().sqrt();
                assert!(apart < 1.6 * mean + 1e-12, "{from} {to}: {apart} {mean}");
            }
        }
    }

    #[test]
    fn a_way_keeps_to_known_shapes_where_straight_over_does_not() {
        let (loom, task) = (ring(10, 60, true), Task::default());
        let clip = Clip::of(&loom);
        let motion = Motion::new(&loom, &clip, &task);
        let mut detours = 0;
        for (from, to) in [(12.0, 3.0), (30.0, 21.0), (8.0, 18.0), (50.0, 5.0)] {
            let way = motion.passage(from, to).unwrap();
            let ends = [from, to].map(|t| loom.time().at(t).unwrap());
            let straight: Vec<Point> = (0..=LOOKS).map(|i| between(ends, i)).collect();
            let (out, over) = (
                strangest(&motion, &way.points),
                strangest(&motion, &straight),
            );
            assert!(out <= over.max(1.2), "{from} {to}: {out} {over}");
            detours += usize::from(way.points.len() > LOOKS + 1);
        }
        assert!(detours > 0);
    }
}
