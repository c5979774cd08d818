//! Layouts that respect the order: from unrolled, where only consecutive samples and returning poses
//! are near, towards plain distances, as far as the motion between the frames allows.
//!
//! D0 are the distances of the samples, G those along the order graph with reach tau times their root
//! mean square. A layout minimises the stress of D = D0^(1-theta) G^theta with weights
//! 1/(D + eps max D)^2. Whether it is *accepted* depends on how well a curve and a plate of fixed
//! fidelity (k = .8n, l = .6n) over it meet the motion at samples that were not fitted.

use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::samples::{Curve, Samples, mean};
use super::unrefined;
use crate::math::b_spline::Point;
use crate::math::layout::{Distances, Stop, majorise};
use crate::math::order_graph::geodesics;
use crate::math::symmetric;
use crate::task::{Cancelled, Task};

/// Reaches of the order graph, in root mean square distances.
const REACHES: [f64; 7] = [0.2, 0.14, 0.1, 0.07, 0.05, 0.025, 0.0];
/// The walk from geodesic (1) to plain distances (0).
const WALK: [f64; 7] = [0.8, 0.6, 0.45, 0.3, 0.2, 0.1, 0.0];
/// A layout is accepted up to so many times the best score found.
const WORSE: f64 = 2.0;
/// .. or up to so many times what the modes leave out.
const FLOORS: f64 = 1.5;
/// Softening of the weights, of the largest distance.
const SOFTENING: f64 = 0.02;
/// The stress need not be exact: what follows moves the curve anyway.
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

/// A layout that may be refined, at the layout's samples.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub(super) choice: Choice,
    pub(super) layout: Mat<f64>,
    /// Deviation at the check samples, as a norm.
    pub(super) score: f64,
}

/// All that was laid out.
pub(super) struct Layouts {
    unrolled: Vec<Candidate>,
    accepted: usize,
    walk: Vec<Candidate>,
}

/// What scores a layout.
struct Scale<'a> {
    samples: &'a Samples,
    curve: Curve,
    sites: usize,
}

impl Scale<'_> {
    fn score(&self, layout: MatRef<'_, f64>) -> f64 {
        let points = self.samples.dense_layout(layout);
        let (controls, plate) = unrefined(self.samples, &self.curve, points.as_ref(), self.sites);
        let between = plate.at(self.curve.finer.apply(controls.as_ref()).as_ref());
        (&self.samples.finer - between).norm_l2()
    }
}

impl Layouts {
    /// Lays out the motion unrolled for each reach, takes the largest accepted one and walks.
    pub(super) fn find(
        frames: MatRef<'_, f64>,
        samples: &Samples,
        floor: f64,
        task: &Task,
    ) -> Result<Self, Cancelled> {
        let count = frames.nrows();
        let budget = |share: f64| ((share * count as f64) as usize).max(4);
        let scale = Scale {
            samples,
            curve: samples.curve(budget(0.8)),
            sites: budget(0.6),
        };
        let rows: Vec<f64> = samples
            .laid_out
            .row_iter()
            .flat_map(|row| row.iter().copied().collect::<Vec<_>>())
            .collect();
        let plain = Distances::between(&rows, samples.laid_out.ncols());
        let radius = root_mean_square(&plain);
        let tolerated = FLOORS * floor * samples.spread;
        let started: Vec<(Candidate, Distances)> = REACHES
            .par_iter()
            .map(|&tau| {
                task.check()?;
                let graph = geodesics(&plain, tau * radius);
                let layout = stressed(&graph, classical(&graph), task)?;
                task.step();
                Ok((scale.candidate(tau, 1.0, layout), graph))
            })
            .collect::<Result<_, _>>()?;
        let mut least = started
            .iter()
            .map(|(one, _)| one.score)
            .fold(f64::INFINITY, f64::min);
        let limit = |least: f64| (WORSE * least).max(tolerated);
        let accepted = started
            .iter()
            .position(|(one, _)| one.score <= limit(least))
            .unwrap_or(started.len() - 1);
        let graph = &started[accepted].1;
        let mut walk = vec![started[accepted].0.clone()];
        for theta in WALK {
            task.check()?;
            let targets = blend(&plain, graph, theta, 1e-9 * radius);
            let layout = stressed(&targets, walk[walk.len() - 1].layout.clone(), task)?;
            let next = scale.candidate(walk[0].choice.tau, theta, layout);
            task.step();
            least = least.min(next.score);
            if next.score > limit(least) {
                break;
            }
            walk.push(next);
        }
        Ok(Layouts {
            unrolled: started.into_iter().map(|(one, _)| one).collect(),
            accepted,
            walk,
        })
    }

    /// In the order in which they should be tried: the end of the walk, its start, then unrolled ones
    /// of shorter reach (the next, one in the middle, none at all).
    pub(super) fn candidates(&self) -> Vec<&Candidate> {
        let last = self.unrolled.len() - 1;
        let mut order: Vec<&Candidate> = self.walk.last().into_iter().collect();
        if self.walk.len() > 1 {
            order.push(&self.walk[0]);
        }
        let next = self.accepted + 1;
        let mut reserves = vec![next, (next + last).div_ceil(2), last];
        reserves.retain(|&i| next <= i && i <= last);
        reserves.dedup();
        order.extend(reserves.into_iter().map(|i| &self.unrolled[i]));
        order
    }
}

impl Scale<'_> {
    fn candidate(&self, tau: f64, theta: f64, layout: Mat<f64>) -> Candidate {
        Candidate {
            choice: Choice { tau, theta },
            score: self.score(layout.as_ref()),
            layout,
        }
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

/// The layout of least relative stress near `start`, centred, of root mean square radius 1.
fn stressed(targets: &Distances, mut start: Mat<f64>, task: &Task) -> Result<Mat<f64>, Cancelled> {
    let radius = start.norm_l2() / (start.nrows() as f64).sqrt();
    if radius > 0.0 {
        // Mean squared distance is twice the squared radius.
        start *= faer::Scale(root_mean_square(targets) / (2f64.sqrt() * radius));
    }
    let largest = targets.values().iter().copied().fold(0.0, f64::max);
    let soft = SOFTENING * largest.max(f64::MIN_POSITIVE);
    // In units of the largest distance, so that no square leaves the range of numbers.
    let weight = |target: &f64| 1.0 / ((target + soft) / largest).powi(2);
    let weights: Vec<f64> = targets.values().iter().map(weight).collect();
    let points: Vec<Point> = (0..start.nrows())
        .map(|i| [start[(i, 0)], start[(i, 1)]])
        .collect();
    task.check()?;
    match majorise(targets, Some(&weights), &points, &[], &STOP, task) {
        Ok(layout) => Ok(normalised(Mat::from_fn(start.nrows(), 2, |i, a| {
            layout.positions[i][a]
        }))),
        Err(_) => {
            task.check()?;
            Ok(normalised(start))
        }
    }
}

/// Root mean square over all ordered pairs, each with itself included.
fn root_mean_square(distances: &Distances) -> f64 {
    let squares: f64 = distances.values().iter().map(|d| d * d).sum();
    (2.0 * squares).sqrt() / distances.count().max(1) as f64
}

/// Classical scaling: the two leading principal coordinates of `targets`, slightly shaken.
fn classical(targets: &Distances) -> Mat<f64> {
    let count = targets.count();
    let squares = Mat::from_fn(count, count, |i, j| targets.get(i, j).powi(2));
    let means = mean(squares.as_ref());
    let total = means.iter().sum::<f64>() / count as f64;
    let gram = Mat::from_fn(count, count, |i, j| {
        -0.5 * (squares[(i, j)] - means[i] - means[j] + total)
    });
    let Some((values, vectors)) = symmetric::eigen(gram.as_ref()) else {
        return Mat::from_fn(count, 2, |i, a| if a == 0 { i as f64 } else { 0.0 });
    };
    let mut points = Mat::from_fn(count, 2, |i, a| {
        vectors[(i, a.min(count - 1))] * values[a.min(count - 1)].max(0.0).sqrt()
    });
    let noise = NOISE * points.norm_l2() / (2.0 * count as f64).sqrt();
    let mut random = seeded();
    for a in 0..2 {
        points
            .col_as_slice_mut(a)
            .iter_mut()
            .for_each(|x| *x += noise * random());
    }
    points
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

fn normalised(mut points: Mat<f64>) -> Mat<f64> {
    let mean = mean(points.as_ref());
    for (a, mean) in mean.iter().enumerate() {
        points
            .col_as_slice_mut(a)
            .iter_mut()
            .for_each(|x| *x -= mean);
    }
    let radius = points.norm_l2() / (points.nrows() as f64).sqrt();
    if radius > 0.0 {
        points *= faer::Scale(1.0 / radius);
    }
    points
}
