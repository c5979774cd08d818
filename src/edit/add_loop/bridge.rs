//! The way over a seam: control points that let the shapes change as evenly as the motion itself does, and
//! that keep to shapes like the motion's own.

use rayon::prelude::*;

use crate::diag::Result;
use crate::edit::poses::{Poses, STRANGE};
use crate::edit::seam::{Clip, SHOWS};
use crate::math::b_spline::{Curve, Place, Point, basis};
use crate::math::banded_cholesky::BandedSymmetric;
use crate::signal::pose::PoseSignal;
use crate::task::Task;

/// Steps of the solver for each power; it stops earlier when a step gains less than a thousandth.
const STEPS: usize = 40;

/// What is made least is the sum of these powers of what shows, one after another. What shows at a seam is
/// its largest change; of a motion with the least squares alone that is up to twice what it needs to be.
const POWERS: [i32; 4] = [2, 4, 8, 16];

/// A way that shows this much of the motion's own changes at most is not bettered.
const ENOUGH: f64 = 1.25;

/// What it counts that a shape is as far out again as the farthest of the motion: one that looks strange counts
/// as much as a seam that shows.
const OUT: f64 = SHOWS / (STRANGE - 1.0);

/// Of the ways with the least squares so many are followed on, the least first.
const FOLLOWED: usize = 2;

/// Steps and second differences of shapes at consecutive places, of which a few control points are to be
/// moved.
pub(super) struct Way<'a> {
    pose: &'a PoseSignal,
    poses: &'a Poses,
    task: &'a Task,
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
    /// What kind it is of.
    kind: &'static Kind,
    /// What its factors are in units of the motion.
    unit: f64,
    /// What it is in the motion as it was, where its places followed each other there.
    own: Vec<f64>,
}

/// A kind of difference: of places a stride apart.
struct Kind {
    stride: usize,
    factors: &'static [f64],
}

/// Steps from half frame to half frame, as those of whole ones.
const STEP: Kind = Kind {
    stride: 1,
    factors: &[-2.0, 2.0],
};

/// Second differences over whole frames, at half frames too: over half ones a sharp turn, as that of the shapes
/// at a site, would count twice.
const BEND: Kind = Kind {
    stride: 2,
    factors: &[1.0, -2.0, 1.0],
};

/// So many places are evaluated in a row by one thread at least.
const MIN_PLACES: usize = 32;

/// Places that meet in a term lie less than this apart.
const APART: usize = 5;

impl Term {
    /// Its places and their factors.
    fn parts(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let factors = self.kind.factors.iter().enumerate();
        factors.map(|(k, factor)| (self.at + k * self.kind.stride, factor * self.unit))
    }

    /// Whether it is a second difference at half frames.
    fn halves(&self) -> bool {
        self.kind.stride == BEND.stride && self.at % 2 == 1
    }
}

impl<'a> Way<'a> {
    /// The way over `places` of `curve`, two for each frame (at even numbers the frame itself), whose control
    /// points from `first` on, `count` of them, are free. `source` gives where the motion was at each place
    /// before, and on which side of the seam; none where the place is new. Cancelling `task` ends the
    /// search.
    pub(super) fn new(
        (pose, clip, task): (&'a PoseSignal, &'a Clip, &'a Task),
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
        let per = |motion: f64| if motion > 0.0 { 1.0 / motion } else { 0.0 };
        let kinds = [(&STEP, per(clip.step())), (&BEND, per(clip.bend()))];
        let mut terms = Vec::new();
        for (kind, unit) in kinds {
            let over = kind.stride * (kind.factors.len() - 1);
            for at in 0..source.len().saturating_sub(over) {
                let own = vec![0.0; pose.modes()];
                let mut term = Term {
                    at,
                    kind,
                    unit,
                    own,
                };
                // Beside the bridge half of what the motion does at a frame lies between frames.
                if term.halves() && term.parts().any(|(at, _)| source[at].is_some()) {
                    continue;
                }
                if let Some(own) = own_of(&source, &term) {
                    term.own = own;
                }
                terms.push(term);
            }
        }
        let weighed = |&place: &Place| (place, basis(curve.around(place.span), place.offset));
        Way {
            pose,
            poses: clip.poses(),
            task,
            places: places.iter().map(weighed).collect(),
            terms,
            first,
            count,
        }
    }

    /// Of the curves that the `starts` lead to the one where the largest of what shows is about least, or
    /// the first that is good enough; it is never larger than on any of the starts. None without starts.
    ///
    /// # Errors
    /// The task was cancelled.
    pub(super) fn best(&self, starts: &[Curve]) -> Result<Option<Curve>> {
        let mut best: Option<(f64, Curve)> = None;
        let mut keep = |state: &State| {
            let shown = state.largest();
            if best.as_ref().is_none_or(|(least, _)| shown < *least) {
                best = Some((shown, state.curve.clone()));
            }
            shown
        };
        let followed = starts.par_iter().map(|start| {
            let start = State::new(self, start.clone());
            let squares = self.descend(start.clone(), POWERS[0])?;
            Ok((start, squares))
        });
        let mut ways = Vec::new();
        for (start, squares) in followed.collect::<Result<Vec<_>>>()? {
            keep(&start);
            keep(&squares);
            ways.push((squares.energy(POWERS[0], 1.0), squares));
        }
        ways.sort_by(|a, b| a.0.total_cmp(&b.0));
        // Starts that lead to the same way lead on to the same.
        ways.dedup_by(|b, a| b.0 - a.0 <= 1e-3 * a.0);
        for (_, mut way) in ways.into_iter().take(FOLLOWED) {
            for power in &POWERS[1..] {
                if way.largest() <= ENOUGH {
                    break;
                }
                way = self.descend(way, *power)?;
                keep(&way);
            }
            if way.largest() <= ENOUGH {
                break;
            }
        }
        Ok(best.map(|(_, curve)| curve))
    }

    /// The curve with `count` of its free control points, beginning with number `from` of them, laid evenly
    /// along a way of points.
    pub(super) fn laid(
        &self,
        curve: &Curve,
        (from, count): (usize, usize),
        way: &[Point],
    ) -> Curve {
        let parts = (way.len().max(2) - 1) as f64;
        let to = (0..count).map(|j| {
            let along = parts * (j + 1) as f64 / (count + 1) as f64;
            let (piece, part) = (along.floor() as usize, along.fract());
            let at = |i: usize| way.get(i).or(way.last()).copied().unwrap_or_default();
            let (a, b) = (at(piece), at(piece + 1));
            [0, 1].map(|k| a[k] + part * (b[k] - a[k]))
        });
        curve.with_controls(self.first + from, to)
    }

    /// Newton's method on the sum of a power of what shows, the curvature of the shapes left out, damped
    /// as by Levenberg and Marquardt.
    fn descend(&self, start: State, power: i32) -> Result<State> {
        let top = start.largest();
        let mut best = start;
        if top == 0.0 {
            return Ok(best);
        }
        let mut damping = 1e-4;
        let mut before = best.energy(power, top);
        for _ in 0..STEPS {
            self.task.check()?;
            let Some(step) = self.step(&best, (power, top), damping) else {
                break;
            };
            let free = &best.curve.controls()[self.first..][..self.count];
            let moved = free.iter().zip(step.chunks_exact(2));
            let moved = moved.map(|(at, by)| [at[0] + by[0], at[1] + by[1]]);
            let next = State::new(self, best.curve.with_controls(self.first, moved));
            let after = next.energy(power, top);
            if after < before {
                let gained = before - after;
                best = next;
                damping = (0.2 * damping).max(1e-9);
                if gained < 1e-3 * before {
                    break;
                }
                before = after;
            } else {
                damping *= 8.0;
                if damping > 1e6 {
                    break;
                }
            }
        }
        Ok(best)
    }

    /// The damped step of the free control points, x and y of each.
    ///
    /// Of |r|^p, r being what is left of a term and u its direction, the gradient is p |r|^(p-1) J^T u and
    /// the Hessian p |r|^(p-2) (J^T J + (p-2) J^T u u^T J), J linear. Both are gathered for the places
    /// first, each of which meets the next few only, and go to the control points by the weights.
    fn step(&self, state: &State, (power, top): (i32, f64), damping: f64) -> Option<Vec<f64>> {
        let m = self.pose.modes();
        let mut pulls = vec![[0.0; 2]; self.places.len()];
        let mut pairs = vec![[Pair::default(); APART]; self.places.len()];
        for (term, (rest, size)) in self.terms.iter().zip(state.rests(self)) {
            if size == 0.0 {
                continue;
            }
            let weight = (size / top).powi(power - 2);
            let stiff = f64::from(power - 2) * weight;
            let along = |(place, factor): (usize, f64)| {
                let rows = state.slopes(place, m);
                rows.map(|row| factor * dot(row, rest) / size)
            };
            let parts: Vec<_> = term.parts().map(|part| (part, along(part))).collect();
            for (k, ((place, factor), slope)) in parts.iter().enumerate() {
                (0..2).for_each(|axis| pulls[*place][axis] -= weight * size * slope[axis]);
                for ((next, other), slope_there) in &parts[k..] {
                    let pair = &mut pairs[*place][next - place];
                    pair.common += weight * factor * other;
                    for (i, entry) in pair.entries.iter_mut().enumerate() {
                        *entry += stiff * slope[i / 2] * slope_there[i % 2];
                    }
                }
            }
        }
        for (place, (size, slope)) in state.strange.iter().enumerate() {
            if *size == 0.0 {
                continue;
            }
            let weight = (size / top).powi(power - 2);
            (0..2).for_each(|axis| pulls[place][axis] -= weight * size * slope[axis]);
            for (i, entry) in pairs[place][0].entries.iter_mut().enumerate() {
                *entry += f64::from(power - 1) * weight * slope[i / 2] * slope[i % 2];
            }
        }
        let mut matrix = BandedSymmetric::new(2 * self.count, 2 * self.reach());
        let mut right = vec![0.0; 2 * self.count];
        for (place, pull) in pulls.iter().enumerate() {
            for (c, w) in self.free(place) {
                (0..2).for_each(|axis| right[2 * c + axis] += w * pull[axis]);
            }
            for (apart, pair) in pairs[place].iter().enumerate() {
                if pair.is_none() || self.free(place).next().is_none() {
                    continue;
                }
                let (a, b) = (state.slopes(place, m), state.slopes(place + apart, m));
                for (i, entry) in pair.entries.iter().enumerate() {
                    let value = entry + pair.common * dot(a[i / 2], b[i % 2]);
                    for (c, w) in self.free(place) {
                        for (d, z) in self.free(place + apart) {
                            let (row, column) = (2 * c + i / 2, 2 * d + i % 2);
                            let value = w * z * value;
                            // a pair of two places stands for both its orders
                            match (apart, row.cmp(&column)) {
                                (0, std::cmp::Ordering::Greater) => {}
                                (0, _) => matrix.add(row, column, value),
                                (_, std::cmp::Ordering::Equal) => matrix.add(row, row, 2.0 * value),
                                _ => matrix.add(row.min(column), row.max(column), value),
                            }
                        }
                    }
                }
            }
        }
        for j in 0..2 * self.count {
            // relative to each unknown's own column; one that nothing depends on stays
            matrix.add(j, j, damping * matrix.diagonal(j) + f64::MIN_POSITIVE);
        }
        matrix.solve(&right)
    }

    /// The free control points that a place depends on, with its weights; none beyond the last place.
    fn free(&self, place: usize) -> impl Iterator<Item = (usize, f64)> {
        let known = self.places.get(place);
        let (first, count) = (self.first, self.count);
        known.into_iter().flat_map(move |(place, weights)| {
            weights.iter().enumerate().filter_map(move |(c, weight)| {
                let free = (place.span + c).checked_sub(first)?;
                (free < count).then_some((free, *weight))
            })
        })
    }

    /// So many control points in a row meet in a term.
    fn reach(&self) -> usize {
        let spans = self.places.windows(APART);
        let spans = spans.map(|p| p[APART - 1].0.span - p[0].0.span);
        4 + spans.max().unwrap_or(0)
    }
}

/// What two places have to do with each other: a factor of the product of their derivatives, and what is
/// added to it, row after row.
#[derive(Clone, Copy, Default)]
struct Pair {
    common: f64,
    entries: [f64; 4],
}

impl Pair {
    fn is_none(&self) -> bool {
        self.common == 0.0 && self.entries == [0.0; 4]
    }
}

/// The difference in the motion as it was, where all its shapes are known on one side of the seam.
fn own_of(source: &[Option<(bool, Vec<f64>)>], term: &Term) -> Option<Vec<f64>> {
    let side = source[term.at].as_ref()?.0;
    let mut sum = vec![0.0; term.own.len()];
    for (place, factor) in term.parts() {
        let (_, x) = source[place].as_ref().filter(|(own, _)| *own == side)?;
        sum.iter_mut()
            .zip(x)
            .for_each(|(sum, x)| *sum += factor * x);
    }
    Some(sum)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A curve, the derivatives of the shape along both axes of the map at each place (two rows of m), and for
/// each term what is left of it beside the motion's own, and its norm.
#[derive(Clone)]
struct State {
    curve: Curve,
    slopes: Vec<f64>,
    rests: Vec<f64>,
    sizes: Vec<f64>,
    /// What it counts that shapes lie farther out than the motion's, for each place, and its derivatives along
    /// both axes of the map.
    strange: Vec<(f64, Point)>,
}

impl State {
    fn new(way: &Way<'_>, curve: Curve) -> Self {
        let m = way.pose.modes();
        let mut x = vec![0.0; m * way.places.len()];
        let mut slopes = vec![0.0; 2 * x.len()];
        let rows = x
            .par_chunks_mut(m.max(1))
            .zip(slopes.par_chunks_mut(2 * m.max(1)));
        let places = way.places.par_iter().zip(rows).with_min_len(MIN_PLACES);
        places.for_each(|((place, _), (x, slopes))| {
            way.pose.evaluate_with_jacobian(curve.at(*place), x, slopes);
        });
        let mut rests = Vec::with_capacity(m * way.terms.len());
        for term in &way.terms {
            let from = rests.len();
            rests.extend(term.own.iter().map(|own| -own));
            for (place, factor) in term.parts() {
                let shape = &x[place * m..][..m];
                rests[from..]
                    .iter_mut()
                    .zip(shape)
                    .for_each(|(rest, x)| *rest += factor * x);
            }
        }
        let sizes = rests.chunks(m.max(1)).map(|rest| dot(rest, rest).sqrt());
        let mut along = vec![0.0; m];
        let rows = x.chunks(m.max(1)).zip(slopes.chunks(2 * m.max(1)));
        let strange = rows.map(|(x, slopes)| {
            let strangeness = way.poses.strangeness_with_gradient(x, &mut along);
            let count = OUT * (strangeness - 1.0).max(0.0);
            let (first, second) = slopes.split_at(m);
            (count, [first, second].map(|row| OUT * dot(row, &along)))
        });
        State {
            sizes: sizes.collect(),
            strange: strange.collect(),
            curve,
            slopes,
            rests,
        }
    }

    /// The derivatives at a place.
    fn slopes(&self, place: usize, m: usize) -> [&[f64]; 2] {
        let rows = &self.slopes[2 * m * place..][..2 * m];
        [&rows[..m], &rows[m..]]
    }

    /// For each term what is left, and its norm.
    fn rests<'a>(&'a self, way: &Way<'_>) -> impl Iterator<Item = (&'a [f64], f64)> {
        let m = way.pose.modes().max(1);
        self.rests.chunks(m).zip(self.sizes.iter().copied())
    }

    fn largest(&self) -> f64 {
        self.shown().fold(0.0, f64::max)
    }

    fn shown(&self) -> impl Iterator<Item = f64> + '_ {
        let strange = self.strange.iter().map(|(count, _)| *count);
        self.sizes.iter().copied().chain(strange)
    }

    /// The sum of a power of the norms, `top` being 1.
    fn energy(&self, power: i32, top: f64) -> f64 {
        self.shown().map(|size| (size / top).powi(power)).sum()
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
        let task = Task::default();
        let way = Way::new((loom.pose(), &clip, &task), &rough, places, &source, (8, 5));
        let largest = |curve: &Curve| State::new(&way, curve.clone()).largest();
        let evened = way.best(std::slice::from_ref(&rough)).unwrap().unwrap();
        assert!(largest(&evened) < largest(&rough));
        // the smooth motion's own control points are among the choices
        assert!(largest(&evened) < ENOUGH.max(1.05 * largest(curve)));
        for (j, (a, b)) in evened.controls().iter().zip(rough.controls()).enumerate() {
            assert!((8..13).contains(&j) || a == b);
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
        let task = Task::default();
        let way = Way::new((loom.pose(), &clip, &task), curve, places, &source, (8, 5));
        assert!(State::new(&way, curve.clone()).largest() < 1e-12);
        let rough = curve.with_control(10, [0.0, 0.0]);
        let evened = way.best(std::slice::from_ref(&rough)).unwrap().unwrap();
        assert!(State::new(&way, evened).largest() < 1e-3);
    }
}
