//! Layouts that respect the order: from unrolled, where only consecutive samples and returning poses
//! are near, towards plain distances, as far as the motion between the frames allows.
//!
//! D0 are the distances of the samples, G those along the order graph with reach tau times their root
//! mean square. A layout minimises the stress of D = D0^(1-theta) G^theta with weights
//! 1/(D + eps max D)^2. Whether it is *accepted* depends on how well a curve and a plate of fixed
//! fidelity (k = .8n, l = .6n) over it meet the motion at samples that were not fitted; nothing here
//! depends on the fidelity that is asked for, so that the choice does not change with it.

use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::refine::unrefined;
use super::samples::{Curve, Samples, mean, rows};
use crate::math::b_spline::Point;
use crate::math::layout::{Distances, Stop, majorise, to_principal_axes, turned_to};
use crate::math::order_graph::geodesics;
use crate::math::symmetric;
use crate::task::{Cancelled, Task};

/// Reaches of the order graph, in root mean square distances. Each is half the one before: neighbours
/// are so different that a little more or less of the motion seldom changes which one is chosen.
const REACHES: [f64; 5] = [0.2, 0.1, 0.05, 0.025, 0.0];
/// The walk from geodesic (1) to plain distances (0), coarse for the same reason.
const WALK: [f64; 2] = [HALFWAY, 0.0];
const HALFWAY: f64 = 0.5;
/// A layout is accepted up to so many times the best score found,
const WORSE: f64 = 1.5;
/// .. or up to so many times what the modes leave out.
const FLOORS: f64 = 0.75;
/// .. or up to so many steps between frames in root mean square: refinement makes that invisible.
const STEPS: f64 = 0.05;
/// So many candidates are worth refining.
const CANDIDATES: usize = 6;
/// Softening of the weights, of the largest distance.
const SOFTENING: f64 = 0.02;
/// The stress need not be exact: refinement moves the curve anyway.
const STOP: Stop = Stop {
    change: 1e-5,
    steps: 60,
};
/// Noise on the start, of its spread: it takes straight layouts off their line.
const NOISE: f64 = 1e-3;

/// Which layout: how far apart returning poses may be to be joined, and how far the walk went.
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
    natural: f64,
    /// Deviation at the check samples, as a norm.
    score: f64,
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

    /// D of a choice.
    fn targets(&self, choice: Choice) -> Distances {
        blend(
            &self.plain,
            &self.graph(choice.tau),
            choice.theta,
            1e-9 * self.radius,
        )
    }

    fn graph(&self, tau: f64) -> Distances {
        geodesics(&self.plain, tau * self.radius)
    }

    /// How many pairs a reach joins.
    fn joined(&self, tau: f64) -> usize {
        let reach = tau * self.radius;
        self.plain.values().iter().filter(|&&d| d < reach).count()
    }

    /// A candidate with its samples `pins` where they belong. Without a score of its own.
    pub(super) fn pinned(
        &self,
        candidate: &Candidate,
        pins: &[(usize, Point)],
        task: &Task,
    ) -> Result<Candidate, Cancelled> {
        if pins.is_empty() {
            return Ok(candidate.clone());
        }
        let targets = self.targets(candidate.choice);
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

impl Candidate {
    /// Its radius in units of the motion.
    pub(super) fn natural(&self) -> f64 {
        self.natural
    }
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

/// Lays the motion out unrolled for each reach, walks from the largest accepted one, and returns what
/// is worth refining in the order in which it should be tried: the end of the walk, its start, then the
/// unrolled ones of the least scores, each after what lies halfway from it. Never empty.
pub(super) fn candidates(
    order: &Order,
    samples: &Samples,
    floor: f64,
    task: &Task,
) -> Result<Vec<Candidate>, Cancelled> {
    let scale = Scale::new(samples);
    let mut unrolled = unrolled(order, &scale, task)?;
    let tolerated = (FLOORS * floor * samples.spread)
        .max(STEPS * samples.step * (samples.finer.nrows() as f64).sqrt());
    let least = unrolled
        .iter()
        .map(|one| one.score)
        .fold(f64::INFINITY, f64::min);
    let accepts = |score: f64, least: f64| score <= (WORSE * least).max(tolerated);
    let first = unrolled
        .iter()
        .position(|one| accepts(one.score, least))
        .unwrap_or(0);
    let mut worth = walk(order, &scale, &unrolled[first], least, &accepts, task)?;
    worth.reverse();
    if worth.len() > 1 {
        worth.drain(1..worth.len() - 1);
    }
    unrolled.remove(first);
    unrolled.sort_by(|a, b| a.score.total_cmp(&b.score));
    for one in unrolled.into_iter().take((CANDIDATES - worth.len()) / 2) {
        worth.push(halfway(order, &scale, &one, task)?);
        worth.push(one);
    }
    Ok(worth)
}

/// The layout of a choice, reached as the search would: unrolled first, then walked.
pub(super) fn known(
    order: &Order,
    samples: &Samples,
    choice: Choice,
    task: &Task,
) -> Result<Candidate, Cancelled> {
    let scale = Scale::new(samples);
    let tau = choice.tau;
    let graph = order.graph(tau);
    let unrolled = Choice { tau, theta: 1.0 };
    let mut candidate = scale.candidate(unrolled, &graph, &classical(&graph), task)?;
    for theta in WALK.into_iter().filter(|&theta| theta >= choice.theta) {
        let targets = blend(&order.plain, &graph, theta, 1e-9 * order.radius);
        let start = points(candidate.layout.as_ref());
        candidate = scale.candidate(Choice { tau, theta }, &targets, &start, task)?;
    }
    Ok(candidate)
}

/// theta = 1 for every reach that joins other pairs than the one before.
fn unrolled(order: &Order, scale: &Scale<'_>, task: &Task) -> Result<Vec<Candidate>, Cancelled> {
    let mut reaches = REACHES.to_vec();
    reaches.dedup_by_key(|tau| order.joined(*tau));
    reaches
        .par_iter()
        .map(|&tau| {
            task.check()?;
            let graph = order.graph(tau);
            let start = classical(&graph);
            let candidate = scale.candidate(Choice { tau, theta: 1.0 }, &graph, &start, task)?;
            task.step();
            Ok(candidate)
        })
        .collect()
}

/// From `first` towards plain distances, as far as it is accepted; `first` included.
fn walk(
    order: &Order,
    scale: &Scale<'_>,
    first: &Candidate,
    mut least: f64,
    accepts: &dyn Fn(f64, f64) -> bool,
    task: &Task,
) -> Result<Vec<Candidate>, Cancelled> {
    let tau = first.choice.tau;
    let graph = order.graph(tau);
    let mut walk = vec![first.clone()];
    for theta in WALK {
        task.check()?;
        let targets = blend(&order.plain, &graph, theta, 1e-9 * order.radius);
        let start = points(walk[walk.len() - 1].layout.as_ref());
        let next = scale.candidate(Choice { tau, theta }, &targets, &start, task)?;
        task.step();
        least = least.min(next.score);
        if !accepts(next.score, least) {
            break;
        }
        walk.push(next);
    }
    Ok(walk)
}

/// Halfway from an unrolled layout to plain distances.
fn halfway(
    order: &Order,
    scale: &Scale<'_>,
    unrolled: &Candidate,
    task: &Task,
) -> Result<Candidate, Cancelled> {
    let choice = Choice {
        theta: HALFWAY,
        ..unrolled.choice
    };
    let start = points(unrolled.layout.as_ref());
    scale.candidate(choice, &order.targets(choice), &start, task)
}

/// What scores a layout.
struct Scale<'a> {
    samples: &'a Samples,
    curve: Curve,
    sites: usize,
}

impl<'a> Scale<'a> {
    fn new(samples: &'a Samples) -> Self {
        Scale {
            samples,
            curve: samples.curve(samples.usual_controls()),
            sites: samples.usual_sites(),
        }
    }

    /// The layout of least stress near `start`, scored.
    fn candidate(
        &self,
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
        let layout = Mat::from_fn(found.len(), 2, |i, a| found[i][a] / natural);
        let between = unrefined(self.samples, &self.curve, layout.as_ref(), self.sites);
        Ok(Candidate {
            choice,
            layout,
            natural,
            score: (&self.samples.finer - between).norm_l2(),
        })
    }
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
