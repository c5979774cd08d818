//! Where the motion between frames goes astray, and what would mend it (CH12 §6 names negative Gaussian
//! curvature as the sign of a saddle; that the frames were left tells which ones matter).
//!
//! Between frames i and i+1 the way through g is compared with the cubic spline through the frames and
//! with the segment between them; the Gaussian curvature of the surface g along the curve is
//!
//! ```text
//! K = (II_11 . II_22 - |II_12|^2) / det(g_a . g_b),   II_ab the part of g_ab normal to g_1 and g_2
//! ```
//!
//! Consecutive frames that are left visibly are one span. For the worst spans the remedies are tried:
//! more sites, and a pin that takes a frame of the span away from the other strands it lies among.

use crate::diag::Result;
use crate::loom::ch12::Signals;
use crate::loom::report::{Change, Held, Mend, Span};
use crate::loom::subspace::Subspace;
use crate::math::b_spline::Point;
use crate::math::cubic_spline::{CubicSpline, Ends};

/// Deviations above this part of a frame step are seen as pops.
pub const VISIBLE: f64 = 0.06;

/// So many samples an interval, off the frames and off most sites.
const SAMPLES: usize = 6;

/// Remedies are tried for so many spans: each costs a fit.
const TREATED: usize = 3;

/// A remedy that leaves more than this of a span's deviation is none.
const WORTHWHILE: f64 = 0.8;

/// The spans in which the motion goes astray, the worst first; none where fewer than three frames move.
pub fn spans(subspace: &Subspace, signals: &Signals) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    for here in intervals(subspace, signals) {
        if here.deviation <= VISIBLE {
            continue;
        }
        match spans.last_mut() {
            Some(span) if span.last == here.first => span.join(&here),
            _ => spans.push(here),
        }
    }
    spans.sort_by(|a, b| b.deviation.total_cmp(&a.deviation));
    spans
}

/// Adds to the worst spans what would mend them; `fit` makes signals under a change of the options, under
/// which the frames `pinned` (from 1) are held already.
///
/// # Errors
/// Those of `fit`.
pub fn advise(
    subspace: &Subspace,
    signals: &Signals,
    pinned: &[usize],
    spans: &mut [Span],
    fit: &dyn Fn(&Change) -> Result<Signals>,
) -> Result<()> {
    if spans.is_empty() {
        return Ok(());
    }
    let sites = signals.pose.sites().len();
    let more = (sites + sites.div_ceil(4)).min(subspace.frames);
    let with_more = match more > sites {
        true => Some(intervals(subspace, &fit(&Change::Sites(more))?)),
        false => None,
    };
    for span in spans.iter_mut().take(TREATED) {
        if let Some(after) = &with_more {
            span.consider(Change::Sites(more), after);
        }
        if let Some(pins) = away(&signals.layout.positions, pinned, span) {
            let change = Change::Pins(pins);
            let after = intervals(subspace, &fit(&change)?);
            span.consider(change, &after);
        }
        span.mends.sort_by(|a, b| a.left.total_cmp(&b.left));
    }
    Ok(())
}

impl Span {
    fn join(&mut self, next: &Span) {
        self.last = next.last;
        self.deviation = self.deviation.max(next.deviation);
        self.off_segment = self.off_segment.max(next.off_segment);
        self.curvature = self.curvature.min(next.curvature);
    }

    /// Keeps a change that helps; `after` are the intervals under it.
    fn consider(&mut self, change: Change, after: &[Span]) {
        let left = worst_within(after, self) / self.deviation;
        if left < WORTHWHILE {
            self.mends.push(Mend { change, left });
        }
    }
}

/// The largest deviation between the frames of `span`.
fn worst_within(intervals: &[Span], span: &Span) -> f64 {
    let inside = intervals
        .iter()
        .filter(|one| span.first <= one.first && one.last <= span.last);
    inside.map(|one| one.deviation).fold(0.0, f64::max)
}

/// Every two consecutive frames.
pub fn intervals(subspace: &Subspace, signals: &Signals) -> Vec<Span> {
    let (n, m) = (subspace.frames, subspace.modes);
    let knots: Vec<f64> = (0..n).map(|i| i as f64 + 1.0).collect();
    let step = mean_step(subspace);
    let spline = CubicSpline::new(&knots, &subspace.x, m, Ends::NotAKnot);
    let (Ok(spline), true) = (spline, step > 0.0 && m > 0) else {
        return Vec::new();
    };
    let mut at = vec![0.0; m];
    let mut expected = vec![0.0; m];
    let mut surface = Surface::new(m);
    let mut interval = |first: usize| {
        let mut span = Span {
            first: first + 1,
            last: first + 2,
            curvature: f64::INFINITY,
            ..Span::default()
        };
        let ends = (subspace.row(first), subspace.row(first + 1));
        for sample in 0..SAMPLES {
            let t = knots[first] + (sample as f64 + 0.5) / SAMPLES as f64;
            let p = signals.time.at(t).unwrap_or_default();
            signals.pose.evaluate(p, &mut at);
            spline.evaluate(t, &mut expected);
            span.deviation = span.deviation.max(distance(&at, &expected) / step);
            span.off_segment = span.off_segment.max(off_segment(&at, ends));
            span.curvature = span
                .curvature
                .min(surface.curvature(signals, p) * step * step);
        }
        span
    };
    (0..n.saturating_sub(1)).map(&mut interval).collect()
}

/// Root mean square distance between consecutive frames.
fn mean_step(subspace: &Subspace) -> f64 {
    let steps = (1..subspace.frames).map(|i| distance(subspace.row(i), subspace.row(i - 1)));
    let squares: f64 = steps.map(|step| step * step).sum();
    (squares / (subspace.frames.max(2) - 1) as f64).sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Distance from the segment between two frames, in its lengths; 0 where they are the same.
fn off_segment(at: &[f64], (a, b): (&[f64], &[f64])) -> f64 {
    let along: Vec<f64> = a.iter().zip(b).map(|(a, b)| b - a).collect();
    let length = dot(&along, &along);
    if length == 0.0 {
        return 0.0;
    }
    let from: Vec<f64> = a.iter().zip(at).map(|(a, at)| at - a).collect();
    let part = (dot(&from, &along) / length).clamp(0.0, 1.0);
    let off = from.iter().zip(&along).map(|(f, d)| f - part * d);
    (off.map(|x| x * x).sum::<f64>() / length).sqrt()
}

/// Derivatives of g at a point.
struct Surface {
    first: Vec<f64>,
    second: Vec<f64>,
}

impl Surface {
    fn new(modes: usize) -> Self {
        Surface {
            first: vec![0.0; 2 * modes],
            second: vec![0.0; 3 * modes],
        }
    }

    /// K at `p`; 0 where g is not a surface.
    fn curvature(&mut self, signals: &Signals, p: Point) -> f64 {
        signals.pose.jacobian(p, &mut self.first);
        signals.pose.hessian(p, &mut self.second);
        let modes = self.first.len() / 2;
        let (g1, g2) = self.first.split_at(modes);
        let (e, f, g) = (dot(g1, g1), dot(g1, g2), dot(g2, g2));
        let determinant = e * g - f * f;
        if determinant <= 1e-12 * e * g || determinant == 0.0 {
            return 0.0;
        }
        for second in self.second.chunks_exact_mut(modes) {
            let (a, b) = (dot(second, g1), dot(second, g2));
            let (along, across) = ((g * a - f * b) / determinant, (e * b - f * a) / determinant);
            for (j, x) in second.iter_mut().enumerate() {
                *x -= along * g1[j] + across * g2[j];
            }
        }
        let (first, rest) = self.second.split_at(modes);
        let (mixed, last) = rest.split_at(modes);
        (dot(first, last) - dot(mixed, mixed)) / determinant
    }
}

/// The middle frame of a span, pinned away from the nearest frame of another strand by as much again as
/// it is near, and two far frames pinned where they are (fewer where pins hold the map already); None
/// where there is no other strand, or the frame is pinned.
fn away(positions: &[Point], pinned: &[usize], span: &Span) -> Option<Vec<Held>> {
    let frame = (span.first + span.last) / 2 - 1;
    if pinned.contains(&(frame + 1)) {
        return None;
    }
    let [x, y] = positions[frame];
    let others = positions.iter().enumerate();
    let (_, nearest) = others
        .filter(|(other, _)| other.abs_diff(frame) > 3 + span.last - span.first)
        .min_by(|a, b| apart(positions[frame], *a.1).total_cmp(&apart(positions[frame], *b.1)))?;
    let size = positions
        .iter()
        .map(|&p| apart(positions[frame], p))
        .fold(0.0, f64::max);
    let distance = apart(positions[frame], *nearest);
    let shift = (0.15 * size).max(distance);
    let direction = match distance > 0.0 {
        true => [(x - nearest[0]) / distance, (y - nearest[1]) / distance],
        false => [0.0, 1.0],
    };
    let at = [x + shift * direction[0], y + shift * direction[1]];
    let mut pins = vec![Held {
        frame: frame + 1,
        at,
    }];
    for _ in pinned.len()..2 {
        pins.push(farthest(positions, &pins));
    }
    Some(pins)
}

/// The frame that lies farthest from all of `pins`, where it lies.
fn farthest(positions: &[Point], pins: &[Held]) -> Held {
    let far = |at: Point| {
        let distances = pins.iter().map(|pin| apart(positions[pin.frame - 1], at));
        distances.fold(f64::INFINITY, f64::min)
    };
    let farthest =
        (0..positions.len()).max_by(|&a, &b| far(positions[a]).total_cmp(&far(positions[b])));
    let frame = farthest.unwrap_or(0);
    Held {
        frame: frame + 1,
        at: positions[frame],
    }
}

fn apart(p: Point, q: Point) -> f64 {
    let (dx, dy) = (p[0] - q[0], p[1] - q[1]);
    (dx * dx + dy * dy).sqrt()
}
