//! The way over a seam: control points that let the shapes change as evenly as the motion itself does.

use faer::Mat;

use super::seam::Clip;
use crate::math::b_spline::{Curve, Place, Point, basis};
use crate::math::symmetric::inverse;
use crate::signal::pose::PoseSignal;

/// Steps of the solver for each power; it stops earlier when a step gains less than a thousandth.
const STEPS: usize = 40;

/// What is made least is the sum of these powers of what shows, one after another. What shows at a seam is
/// its largest change; of a motion with the least squares alone that is up to twice what it needs to be.
const POWERS: [i32; 4] = [2, 4, 8, 16];

/// A way that shows this much of the motion's own changes at most is not bettered.
const ENOUGH: f64 = 1.25;

/// Steps and second differences of shapes at consecutive places, of which a few control points are to be
/// moved.
pub(super) struct Way<'a> {
    pose: &'a PoseSignal,
    /// Span and weights of the four control points of each place.
    places: Vec<(Place, [f64; 4])>,
    terms: Vec<Term>,
    first: usize,
    count: usize,
}

/// A difference of shapes beside that of the motion.
struct Term {
    /// Its first place.
    at: usize,
    /// Factors of the shapes there and at the next ones; 0 beyond a step.
    factors: [f64; 3],
    /// What it is in the motion as it was, where its places followed each other there.
    own: Vec<f64>,
}

impl<'a> Way<'a> {
    /// The way over `places` of `curve`, two for each frame, whose control points from `first` on, `count`
    /// of them, are free. `source` gives where the motion was at each place before, and on which side of
    /// the seam; none where the place is new.
    pub(super) fn new(
        (pose, clip): (&'a PoseSignal, &Clip),
        curve: &Curve,
        places: &[Place],
        source: &[Option<(bool, Point)>],
        (first, count): (usize, usize),
    ) -> Self {
        let shape = |p: Point| {
            let mut x = vec![0.0; pose.modes()];
            pose.evaluate(p, &mut x);
            x
        };
        let source: Vec<Option<(bool, Vec<f64>)>> = source
            .iter()
            .map(|known| known.map(|(side, p)| (side, shape(p))))
            .collect();
        // Over half frames steps are halves and second differences quarters.
        let per = |motion: f64, part: f64| if motion > 0.0 { part / motion } else { 0.0 };
        let (step, bend) = (per(clip.step(), 2.0), per(clip.bend(), 4.0));
        let mut terms = Vec::new();
        for (factors, length) in [([-step, step, 0.0], 2), ([bend, -2.0 * bend, bend], 3)] {
            for (at, known) in source.windows(length).enumerate() {
                let own = own(known, &factors).unwrap_or_else(|| vec![0.0; pose.modes()]);
                terms.push(Term { at, factors, own });
            }
        }
        let weighed = |&place: &Place| (place, basis(curve.around(place.span), place.offset));
        Way {
            pose,
            places: places.iter().map(weighed).collect(),
            terms,
            first,
            count,
        }
    }

    /// The curve with its free control points where the largest of what shows is about least; it is never
    /// larger than on the curve given.
    pub(super) fn evened(&self, curve: &Curve) -> Curve {
        let mut best = State::new(self, curve.clone());
        for power in POWERS {
            if power > POWERS[0] && best.largest() <= ENOUGH {
                break;
            }
            let next = self.descend(&best, power);
            // The first power may trade a larger peak for less in all.
            if power == POWERS[0] || next.largest() < best.largest() {
                best = next;
            }
        }
        match best.largest() < State::new(self, curve.clone()).largest() {
            true => best.curve,
            false => curve.clone(),
        }
    }

    /// Of the curves that the `starts` lead to the one where the largest of what shows is least, or the
    /// first that is good enough.
    pub(super) fn best(&self, starts: &[Curve]) -> Option<Curve> {
        let mut best: Option<(f64, Curve)> = None;
        for start in starts {
            let curve = self.evened(start);
            let shown = State::new(self, curve.clone()).largest();
            if best.as_ref().is_none_or(|(least, _)| shown < *least) {
                best = Some((shown, curve));
            }
            if shown <= ENOUGH {
                break;
            }
        }
        best.map(|(_, curve)| curve)
    }

    /// The curve with its free control points laid evenly along a way of points.
    pub(super) fn laid(&self, curve: &Curve, way: &[Point]) -> Curve {
        let parts = (way.len().max(2) - 1) as f64;
        (0..self.count).fold(curve.clone(), |curve, j| {
            let along = parts * (j + 1) as f64 / (self.count + 1) as f64;
            let (from, part) = (along.floor() as usize, along.fract());
            let at = |i: usize| way.get(i).or(way.last()).copied().unwrap_or_default();
            let (a, b) = (at(from), at(from + 1));
            curve.with_control(self.first + j, [0, 1].map(|k| a[k] + part * (b[k] - a[k])))
        })
    }

    /// Levenberg-Marquardt with analytic derivatives on the sum of a power of what shows.
    fn descend(&self, start: &State, power: i32) -> State {
        let top = start.largest();
        let mut best = start.clone();
        if top == 0.0 {
            return best;
        }
        let mut damping = 1e-3;
        for _ in 0..STEPS {
            let Some(step) = self.step(&best, (power, top), damping) else {
                break;
            };
            let curve = (0..self.count).fold(best.curve.clone(), |curve, j| {
                let at = curve.controls()[self.first + j];
                let to = [at[0] + step[2 * j], at[1] + step[2 * j + 1]];
                curve.with_control(self.first + j, to)
            });
            let next = State::new(self, curve);
            let (before, after) = (best.energy(power, top), next.energy(power, top));
            if after < before {
                best = next;
                damping = (0.2 * damping).max(1e-9);
                if after > (1.0 - 1e-3) * before {
                    break;
                }
            } else {
                damping *= 5.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        best
    }

    /// The damped Gauss-Newton step of the free control points, x and y of each.
    fn step(&self, state: &State, (power, top): (i32, f64), damping: f64) -> Option<Vec<f64>> {
        let n = 2 * self.count;
        let slopes = self.slopes(&state.curve);
        let (mut matrix, mut right) = (Mat::<f64>::zeros(n, n), vec![0.0; n]);
        for (term, (rest, size)) in self.terms.iter().zip(state.rests(self)) {
            let weight = (size / top).powi(power - 2);
            let involved = |k: usize| Some((term.factors[k], slopes.get(term.at + k)?.as_ref()?));
            for (p, (f, a)) in (0..3).filter_map(|k| Some((k, involved(k)?))) {
                self.each(term.at + p, |c, w| {
                    for axis in 0..2 {
                        right[2 * c + axis] -= weight * f * w * dot(a.along(axis), rest);
                    }
                });
                for (q, (g, b)) in (0..3).filter_map(|k| Some((k, involved(k)?))) {
                    let products = a.times(b);
                    self.each(term.at + p, |c, w| {
                        self.each(term.at + q, |d, z| {
                            for (i, product) in products.iter().enumerate() {
                                matrix[(2 * c + i / 2, 2 * d + i % 2)] +=
                                    weight * f * g * w * z * product;
                            }
                        });
                    });
                }
            }
        }
        for j in 0..n {
            // relative to each unknown's own column; one that nothing depends on stays
            matrix[(j, j)] += damping * matrix[(j, j)] + f64::MIN_POSITIVE;
        }
        let inverse = inverse(matrix)?;
        let row = |i: usize| (0..n).map(|j| inverse[(i, j)] * right[j]).sum();
        Some((0..n).map(row).collect())
    }

    /// Calls for each free control point that place `i` depends on, with its weight.
    fn each(&self, i: usize, mut call: impl FnMut(usize, f64)) {
        let (place, weights) = &self.places[i];
        for (c, weight) in weights.iter().enumerate() {
            let free = (place.span + c).checked_sub(self.first);
            if let Some(j) = free.filter(|&j| j < self.count) {
                call(j, *weight);
            }
        }
    }

    /// The derivatives of the shape at each place that depends on a free control point.
    fn slopes(&self, curve: &Curve) -> Vec<Option<Slopes>> {
        let free =
            |place: &Place| place.span + 3 >= self.first && place.span < self.first + self.count;
        let slopes = |(place, _): &(Place, [f64; 4])| {
            free(place).then(|| {
                let mut rows = vec![0.0; 2 * self.pose.modes()];
                self.pose.jacobian(curve.at(*place), &mut rows);
                Slopes(rows)
            })
        };
        self.places.iter().map(slopes).collect()
    }
}

/// Frames (from 0) of the motion that lead from one to another, both among them, in steps whose squares
/// are least in all: where shapes of the motion lie between them, through these.
pub(super) fn through(clip: &Clip, from: usize, to: usize) -> Vec<usize> {
    let n = clip.frames();
    let mut cost = vec![f64::INFINITY; n];
    let mut before = vec![from; n];
    let mut open = vec![true; n];
    cost[from] = 0.0;
    // Dijkstra's algorithm on all pairs
    while let Some(here) = (0..n)
        .filter(|&i| open[i] && cost[i].is_finite())
        .min_by(|&a, &b| cost[a].total_cmp(&cost[b]))
    {
        open[here] = false;
        if here == to {
            break;
        }
        for next in (0..n).filter(|&i| open[i]) {
            let apart = clip.apart(here, next);
            if cost[here] + apart < cost[next] {
                cost[next] = cost[here] + apart;
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

/// The difference in the motion as it was, where all shapes are known on one side of the seam.
fn own(known: &[Option<(bool, Vec<f64>)>], factors: &[f64; 3]) -> Option<Vec<f64>> {
    let side = known[0].as_ref()?.0;
    let mut sum = vec![0.0; known[0].as_ref()?.1.len()];
    for (shape, factor) in known.iter().zip(factors) {
        let (_, x) = shape.as_ref().filter(|(own, _)| *own == side)?;
        sum.iter_mut()
            .zip(x)
            .for_each(|(sum, x)| *sum += factor * x);
    }
    Some(sum)
}

/// The derivatives of a shape along both axes of the map, one row after the other.
struct Slopes(Vec<f64>);

impl Slopes {
    fn along(&self, axis: usize) -> &[f64] {
        let m = self.0.len() / 2;
        &self.0[axis * m..(axis + 1) * m]
    }

    /// Products of the rows: 00, 01, 10, 11.
    fn times(&self, other: &Slopes) -> [f64; 4] {
        [0, 1, 2, 3].map(|i| dot(self.along(i / 2), other.along(i % 2)))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A curve, and for each term what is left of it beside the motion's own, and its norm.
#[derive(Clone)]
struct State {
    curve: Curve,
    rests: Vec<f64>,
    sizes: Vec<f64>,
}

impl State {
    fn new(way: &Way<'_>, curve: Curve) -> Self {
        let m = way.pose.modes();
        let mut x = vec![0.0; m * way.places.len()];
        for ((place, _), x) in way.places.iter().zip(x.chunks_mut(m.max(1))) {
            way.pose.evaluate(curve.at(*place), x);
        }
        let mut rests = Vec::with_capacity(m * way.terms.len());
        for term in &way.terms {
            rests.extend((0..m).map(|j| {
                let at = |k: usize| x.get((term.at + k) * m + j).copied().unwrap_or(0.0);
                let [f, g, h] = term.factors;
                f * at(0) + g * at(1) + h * at(2) - term.own[j]
            }));
        }
        let sizes = rests.chunks(m.max(1)).map(|rest| dot(rest, rest).sqrt());
        State {
            sizes: sizes.collect(),
            curve,
            rests,
        }
    }

    /// For each term what is left, and its norm.
    fn rests<'a>(&'a self, way: &Way<'_>) -> impl Iterator<Item = (&'a [f64], f64)> {
        let m = way.pose.modes().max(1);
        self.rests.chunks(m).zip(self.sizes.iter().copied())
    }

    fn largest(&self) -> f64 {
        self.sizes.iter().copied().fold(0.0, f64::max)
    }

    /// The sum of a power of the norms, `top` being 1.
    fn energy(&self, power: i32, top: f64) -> f64 {
        self.sizes.iter().map(|size| (size / top).powi(power)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn what_shows_is_evened_and_other_control_points_stay() {
        let loom = ring(5, 21, true);
        let (curve, places) = (loom.time().curve(), &loom.time().places()[4..16]);
        let rough = (8..13).fold(curve.clone(), |curve, j| {
            let at = curve.controls()[j];
            curve.with_control(j, [at[0] + 0.1 * libm::sin(j as f64), at[1]])
        });
        let clip = Clip::of(&loom);
        let source = vec![None; places.len()];
        let way = Way::new((loom.pose(), &clip), &rough, places, &source, (8, 5));
        let largest = |curve: &Curve| State::new(&way, curve.clone()).largest();
        let evened = way.evened(&rough);
        assert!(largest(&evened) < largest(&rough));
        // the smooth motion's own control points are among the choices
        assert!(largest(&evened) < ENOUGH.max(1.05 * largest(curve)));
        for (j, (a, b)) in evened.controls().iter().zip(rough.controls()).enumerate() {
            assert!((8..13).contains(&j) || a == b);
        }
    }

    #[test]
    fn a_way_leads_through_the_shapes_between() {
        // one turn of the ring takes 20.27 frames: the way from its end to its beginning is short
        let clip = Clip::of(&ring(10, 20, true));
        assert_eq!(through(&clip, 3, 7), [3, 4, 5, 6, 7]);
        assert_eq!(through(&clip, 7, 7), [7]);
        let cost = |way: &[usize]| -> f64 { way.windows(2).map(|w| clip.apart(w[0], w[1])).sum() };
        let way = through(&clip, 18, 1);
        assert_eq!((way.first(), way.last()), (Some(&18), Some(&1)));
        for other in [&[18, 1][..], &[18, 19, 1], &[18, 19, 0, 1]] {
            assert!(cost(&way) <= cost(other), "{way:?} {other:?}");
        }
    }

    #[test]
    fn what_the_motion_does_by_itself_is_left_to_it() {
        // nothing is new: whatever the motion does, it is to stay
        let loom = ring(5, 21, true);
        let (curve, places) = (loom.time().curve(), &loom.time().places()[4..16]);
        let clip = Clip::of(&loom);
        let source: Vec<_> = places
            .iter()
            .map(|place| Some((true, curve.at(*place))))
            .collect();
        let way = Way::new((loom.pose(), &clip), curve, places, &source, (8, 5));
        assert!(State::new(&way, curve.clone()).largest() < 1e-12);
        let rough = curve.with_control(10, [0.0, 0.0]);
        let evened = way.evened(&rough);
        assert!(State::new(&way, evened).largest() < 1e-3);
    }
}
