//! Layouts that respect the order: from unrolled, where only consecutive samples and returning poses are
//! near, halfway and, over the widest reach, all the way to plain distances.
//!
//! D0 are the distances of the samples, G those along the order graph with reach tau times their root
//! mean square. A layout minimises the stress of D = D0^(1-theta) G^theta with weights
//! 1/(D + eps max D)^2. Nothing here depends on the fidelity that is asked for.

use faer::{Mat, MatRef};

use super::samples::{Samples, mean, rows};
use crate::math::b_spline::Point;
use crate::math::layout::{Distances, Stop, majorise, to_principal_axes, turned_to};
use crate::math::order_graph::geodesics;
use crate::math::symmetric;
use crate::task::{Cancelled, Task};

/// Reaches of the order graph, in root mean square distances. They are few and far apart, so that a
/// little more or less of the motion seldom changes which one is chosen.
pub(super) const REACHES: [f64; 3] = [0.1, 0.025, 0.0];
/// Between unrolled (1) and plain distances (0), where most motions show their shape and hide no saddle.
const HALFWAY: f64 = 0.5;
/// Distances along two graphs that differ by less than this part are the same map.
const SAME: f64 = 0.01;
/// Softening of the weights, of the largest distance.
const SOFTENING: f64 = 0.02;
/// The stress need not be exact: refinement moves the curve anyway.
const STOP: Stop = Stop {
    change: 1e-5,
    steps: 60,
};
/// Noise on the start, of its spread: it takes straight layouts off their line.
const NOISE: f64 = 1e-3;

/// Which layout: how far apart returning poses may be to be joined, and how far it is from unrolled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    /// Reach of the order graph, in root mean square distances; 0 joins consecutive samples only.
    pub tau: f64,
    /// 1: distances along the graph, 0: plain distances.
    pub theta: f64,
}

/// A layout at the layout's samples, along its principal axes, of root mean square radius 1.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) choice: Choice,
    pub(super) layout: Mat<f64>,
    /// Its radius before it was made 1, in units of the motion.
    pub(super) natural: f64,
}

/// The distances that layouts are made from.
#[derive(Debug, Clone)]
pub(super) struct Order {
    plain: Distances,
    /// Their root mean square.
    radius: f64,
}

impl Order {
    pub(super) fn new(samples: &Samples) -> Self {
        let laid_out = samples.laid_out.as_ref();
        let plain = Distances::between(&rows(laid_out), laid_out.ncols());
        Order {
            radius: root_mean_square(&plain),
            plain,
        }
    }

    /// Distances along the graph of a reach.
    pub(super) fn graph(&self, tau: f64) -> Distances {
        geodesics(&self.plain, tau * self.radius)
    }

    /// D of a theta.
    fn targets(&self, graph: &Distances, theta: f64) -> Distances {
        blend(&self.plain, graph, theta, 1e-9 * self.radius)
    }

    /// The layout of a choice over its graph, reached by way of those that are more unrolled; these
    /// before it.
    pub(super) fn walk(
        &self,
        choice: Choice,
        graph: &Distances,
        task: &Task,
    ) -> Result<Vec<Candidate>, Cancelled> {
        let mut walk = vec![candidate(
            Choice {
                theta: 1.0,
                ..choice
            },
            graph,
            &classical(graph),
            task,
        )?];
        for theta in [HALFWAY, choice.theta] {
            let last = &walk[walk.len() - 1];
            if theta < last.choice.theta && theta >= choice.theta {
                let start = points(last.layout.as_ref());
                let targets = self.targets(graph, theta);
                walk.push(candidate(
                    Choice { theta, ..choice },
                    &targets,
                    &start,
                    task,
                )?);
            }
        }
        Ok(walk)
    }

    /// What is worth trying of a reach, the better maps first: plain distances (of the widest reach, they are
    /// the same for all), halfway, unrolled.
    pub(super) fn candidates(
        &self,
        tau: f64,
        graph: &Distances,
        task: &Task,
    ) -> Result<Vec<Candidate>, Cancelled> {
        let theta = if tau == REACHES[0] { 0.0 } else { HALFWAY };
        let mut walk = self.walk(Choice { tau, theta }, graph, task)?;
        walk.reverse();
        Ok(walk)
    }

    /// A candidate with its samples `pins` where they belong.
    pub(super) fn pinned(
        &self,
        candidate: &Candidate,
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Candidate, Cancelled> {
        if pins.is_empty() {
            return Ok(candidate.clone());
        }
        let Choice { tau, theta } = candidate.choice;
        let targets = self.targets(&self.graph(tau), theta);
        let mut values = targets.values().iter();
        let targets = Distances::from_fn(targets.count(), |_, _| {
            values.next().unwrap_or(&0.0) / candidate.natural
        });
        let start = candidate.layout.as_ref();
        Ok(Candidate {
            layout: held(&targets, start, pins, &Stop::default(), task)?,
            ..candidate.clone()
        })
    }
}

/// Whether distances along two graphs are nearly the same.
pub(super) fn alike(one: &Distances, other: &Distances) -> bool {
    let pairs = one.values().iter().zip(other.values());
    let apart: f64 = pairs.map(|(a, b)| (a - b) * (a - b)).sum();
    let whole: f64 = one.values().iter().map(|a| a * a).sum();
    apart <= SAME * SAME * whole
}

/// The layout of least stress near `start`.
fn candidate(
    choice: Choice,
    targets: &Distances,
    start: &[Point],
    task: &Task,
) -> Result<Candidate, Cancelled> {
    let size = radius(start);
    // The mean squared distance is twice the squared radius.
    let scale = match size > 0.0 {
        true => root_mean_square(targets) / (2f64.sqrt() * size),
        false => 1.0,
    };
    let start: Vec<Point> = start.iter().map(|p| p.map(|x| scale * x)).collect();
    let mut found = least_stress(targets, &start, &[], &STOP, task)?;
    to_principal_axes(&mut found);
    let natural = Some(radius(&found))
        .filter(|&size| size > 0.0)
        .unwrap_or(1.0);
    Ok(Candidate {
        choice,
        layout: Mat::from_fn(found.len(), 2, |i, a| found[i][a] / natural),
        natural,
    })
}

/// Points (n x 2) that keep their `distances` as far as `pins` allow, from where they are: none as they
/// are, one translated, more held while the others follow.
pub(super) fn held(
    distances: &Distances,
    start: MatRef<'_, f64>,
    pins: &[(usize, Point)],
    stop: &Stop,
    task: &Task,
) -> Result<Mat<f64>, Cancelled> {
    let start = points(start);
    let moved = match pins {
        [] => start,
        [one] => translated(&start, *one),
        _ => least_stress(distances, &turned_to(pins, &start), pins, stop, task)?,
    };
    Ok(Mat::from_fn(moved.len(), 2, |i, a| moved[i][a]))
}

/// Positions of least relative stress near `start`, the pins held.
fn least_stress(
    targets: &Distances,
    start: &[Point],
    pins: &[(usize, Point)],
    stop: &Stop,
    task: &Task,
) -> Result<Vec<Point>, Cancelled> {
    task.check()?;
    let largest = targets
        .values()
        .iter()
        .copied()
        .fold(f64::MIN_POSITIVE, f64::max);
    // In units of the largest distance, so that no square leaves the range of numbers.
    let weight = |target: &f64| 1.0 / (target / largest + SOFTENING).powi(2);
    let weights: Vec<f64> = targets.values().iter().map(weight).collect();
    match majorise(targets, Some(&weights), start, pins, stop, task) {
        Ok(layout) => Ok(layout.positions),
        // All weights are positive: only cancelling stops it.
        Err(_) => task.check().map(|()| start.to_vec()),
    }
}

/// D0^(1-theta) G^theta; `least` keeps both away from 0.
fn blend(plain: &Distances, graph: &Distances, theta: f64, least: f64) -> Distances {
    let mut pairs = plain.values().iter().zip(graph.values());
    Distances::from_fn(plain.count(), |_, _| {
        let (plain, graph) = pairs.next().unwrap_or((&0.0, &0.0));
        (plain + least) * libm::pow((graph + least) / (plain + least), theta)
    })
}

/// Classical scaling: the two leading principal coordinates of `targets`, slightly shaken.
fn classical(targets: &Distances) -> Vec<Point> {
    let count = targets.count();
    let squares = Mat::from_fn(count, count, |i, j| targets.get(i, j).powi(2));
    let means = mean(squares.as_ref());
    let total = means.iter().sum::<f64>() / count as f64;
    let gram = Mat::from_fn(count, count, |i, j| {
        -0.5 * (squares[(i, j)] - means[i] - means[j] + total)
    });
    let Some((values, vectors)) = symmetric::eigen(gram.as_ref()) else {
        return (0..count).map(|i| [i as f64, 0.0]).collect();
    };
    let coordinate = |i: usize, a: usize| vectors[(i, a)] * values[a].max(0.0).sqrt();
    let points: Vec<Point> = (0..count)
        .map(|i| [coordinate(i, 0), coordinate(i, 1)])
        .collect();
    let noise = NOISE * radius(&points);
    let mut random = seeded();
    points
        .iter()
        .map(|p| p.map(|x| x + noise * random()))
        .collect()
}

/// Root mean square over all ordered pairs, each with itself included.
fn root_mean_square(distances: &Distances) -> f64 {
    let squares: f64 = distances.values().iter().map(|d| d * d).sum();
    (2.0 * squares).sqrt() / distances.count().max(1) as f64
}

/// Root mean square distance from the origin.
fn radius(points: &[Point]) -> f64 {
    let squares: f64 = points.iter().map(|[x, y]| x * x + y * y).sum();
    (squares / points.len().max(1) as f64).sqrt()
}

fn points(layout: MatRef<'_, f64>) -> Vec<Point> {
    (0..layout.nrows())
        .map(|i| [layout[(i, 0)], layout[(i, 1)]])
        .collect()
}

/// All points moved so that one lies where it should.
fn translated(points: &[Point], (pinned, to): (usize, Point)) -> Vec<Point> {
    let from = points[pinned];
    let shift = [to[0] - from[0], to[1] - from[1]];
    points
        .iter()
        .map(|p| [p[0] + shift[0], p[1] + shift[1]])
        .collect()
}

/// Numbers in \[-1, 1\], always the same ones (xorshift).
fn seeded() -> impl FnMut() -> f64 {
    let mut state = 0x9E37_79B9_7F4A_7C15_u64;
    move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
