//! The longer curve of a loop and its frames: which parts are repeated, and what goes over a seam.

use crate::diag::{Diagnostic, Result};
use crate::edit::forward::assembled;
use crate::loom::Loom;
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::curve_join::{join, join_exactly};
use crate::math::monotone;
use crate::signal::time::TimeSignal;

use super::bridge::Way;
use super::cut::Cut;
use super::passage::Motion;
use super::root;

/// A bridge goes on at this part of the loop's mean rate at least, where its ends rest.
const SLOWEST: f64 = 0.1;

/// Where the loop begins and ends on the curve, and what goes between two passes.
pub(super) struct Plan {
    from: f64,
    to: f64,
    /// Frames between two passes, and the lengths of their spans.
    pub(super) bridge: usize,
    spans: Vec<f64>,
    /// For each frame of the bridge its place in these spans, and rho's slope.
    steps: Vec<(Place, f64)>,
    /// Knots put into the last span before the seam and into the first after it, and into those more that may
    /// change, so that there is a control point a frame: a seam is turned into within a frame or two.
    before: Vec<Place>,
    after: Vec<Place>,
    /// How many spans more may change before the seam and after it, ..
    wide: [usize; 2],
    /// .. and one where a knot was put, which changes it by rounding anyway.
    rounded: [usize; 2],
    /// The span that ends with the loop, and the one that begins with it.
    ends: [usize; 2],
}

/// Spans that one span beside a seam is cut into, at most.
const MOST_PIECES: usize = 12;

impl Plan {
    /// The plan with `bridge` frames between passes, and `wide` spans more before and after that may change.
    pub(super) fn new(
        loom: &Loom,
        (from, to): (f64, f64),
        bridge: usize,
        wide: [usize; 2],
    ) -> Result<Self> {
        let time = loom.time();
        let curve = time.curve();
        let ends = time.place_at(from).zip(time.place_at(to));
        let Some(((a, _), (b, _))) = ends.filter(|_| curve.spans() > 0) else {
            return Diagnostic::error("a loom that never moves cannot loop")
                .hint("`hold` makes it longer")
                .err();
        };
        let pass = curve.distance(a, b);
        if pass <= 0.0 {
            return Diagnostic::error(format!("nothing moves between {from} and {to}"))
                .hint("`hold` makes a rest longer")
                .err();
        }
        // The frames on both sides of the seam, and the parameter from them to it.
        let (left, right) = (to.floor() as usize - 1, from.floor() as usize);
        let right = right.min(time.places().len() - 1);
        let (l, r) = (time.places()[left], time.places()[right]);
        let lead = curve.distance(l, b).max(0.0);
        let rest = curve.distance(a, r).max(0.0);
        // Parameter a frame; a rest has none, but its bridge needs spans.
        let mean = pass / (to - from);
        let rates = [left, right].map(|frame| time.slopes()[frame].max(SLOWEST * mean));
        let (spans, steps) = match bridge {
            0 => Default::default(),
            frames => paced(frames, rates, (lead, rest)),
        };
        let (a, b) = inside(curve, (a, b));
        let (before, after) = pieces(curve, (a, b), rates, wide);
        let within =
            |place: Place| 0.0 < place.offset && place.offset < curve.span_length(place.span);
        let rounded = [b, a].map(|end| usize::from(within(end) && b.span > a.span + 1));
        Ok(Plan {
            from,
            to,
            bridge,
            spans,
            steps,
            before,
            after,
            wide,
            rounded,
            ends: [b.span, a.span],
        })
    }

    /// How many frames after `to` and before `from` the plan passes through beyond that loop.
    pub(super) fn beyond(&self, (from, to): (f64, f64)) -> (usize, usize) {
        let whole = |t: f64| t.round().max(0.0) as usize;
        (whole(self.to - to), whole(from - self.from))
    }

    /// The frames (from 1) up to the first of which, and from the second on, all keep their bits.
    pub(super) fn kept(&self, time: &TimeSignal) -> (usize, usize) {
        // Beside the spans with knots of their own two more change, by rounding at least.
        let [b, a] = self.ends;
        let before = |place: &&Place| place.span + 2 + self.wide[0] < b;
        let upto = |place: &&Place| place.span <= a + 2 + self.wide[1];
        let count = |some: &dyn Fn(&&Place) -> bool| time.places().iter().take_while(some).count();
        (count(&before), count(&upto) + 1)
    }

    /// The curve cut where the loop ends, where it begins, and (after that cut) where it ends.
    fn cuts(&self, time: &TimeSignal) -> [Cut; 3] {
        let place = |t: f64| time.place_at(t).map(|(place, _)| place).unwrap_or_default();
        let (a, b) = (place(self.from), place(self.to));
        let end = Cut::new(time.curve(), b, &self.before);
        let start = Cut::new(time.curve(), a, &self.after);
        let before: Vec<Place> = self.before.iter().map(|&p| start.place(p)).collect();
        let middle = Cut::new(&start.curve, start.place(b), &before);
        [end, middle, start]
    }

    /// How many free control points there are before those of the bridge: they act on the spans that may
    /// change and on none before.
    fn lead(&self) -> usize {
        self.before.len() + self.wide[0] + self.rounded[0]
    }

    /// How many there are after those of the bridge.
    fn trail(&self) -> usize {
        self.after.len() + self.wide[1] + self.rounded[1]
    }

    /// The number of the first free control point of a curve joined after `left`.
    fn first(&self, left: &Cut) -> usize {
        left.span + 1 - self.lead()
    }

    /// How many free control points there are.
    fn count(&self) -> usize {
        self.lead() + self.spans.len() + 1 + self.trail()
    }

    /// The loom with `times` >= 1 passes more, control points `eased` over each seam.
    pub(super) fn repeat(&self, loom: &Loom, times: usize, eased: &[Point]) -> Result<Loom> {
        let time = loom.time();
        let [end, middle, start] = self.cuts(time);
        let frames = self.frames(time, times, (&end, &middle, &start));
        let pass = |left: &Cut, right: &Curve| {
            let joined = join((&left.curve, left.span), (right, start.span), &self.spans)?;
            Some(joined.with_controls(self.first(left), eased.iter().copied()))
        };
        let mut curve = start.curve.clone();
        for _ in 1..times {
            curve = pass(&middle, &curve).ok_or_else(unjoined)?;
        }
        curve = pass(&end, &curve).ok_or_else(unjoined)?;
        let slopes = frames.iter().map(|frame| frame.slope).collect::<Vec<_>>();
        let places = frames.iter().map(|frame| frame.place).collect::<Vec<_>>();
        let rises: Vec<f64> = places
            .windows(2)
            .map(|p| curve.distance(p[0], p[1]))
            .collect();
        let slopes = monotone::limited(&rises, &slopes);
        let time =
            TimeSignal::new(curve, places, slopes, Vec::new()).map_err(crate::edit::impossible)?;
        let root = loom
            .root()
            .map(|root| root::repeated(root, (self.from, self.to), self.bridge, &frames))
            .transpose()?;
        assembled(loom, time, root)
    }

    /// The control points over a seam that let it show least; `known` are those of another plan for it.
    pub(super) fn eased(
        &self,
        motion: &Motion<'_>,
        known: Option<(&Plan, &[Point])>,
    ) -> Result<Vec<Point>> {
        let loom = motion.loom;
        let [end, middle, start] = self.cuts(loom.time());
        let (left, right) = ((&end.curve, end.span), (&start.curve, start.span));
        let joined = join(left, right, &self.spans).ok_or_else(unjoined)?;
        let frames = self.frames(loom.time(), 1, (&end, &middle, &start));
        // Frames of the spans that change, and two on each side.
        let seam = end.span;
        let least = seam.saturating_sub(2 + self.lead());
        let most = seam + self.spans.len() + 2 + self.trail();
        let inside = |frame: &Frame| (least..most).contains(&frame.place.span);
        let first = frames.iter().position(inside).unwrap_or(0);
        let last = frames.iter().rposition(inside).unwrap_or(0);
        let last = (last + 2).min(frames.len() - 1);
        // Half frames too: the curve must not swing between frames.
        let frames = &frames[first.saturating_sub(2)..=last];
        let mut places = vec![frames[0].place];
        for pair in frames.windows(2) {
            let half = 0.5 * joined.distance(pair[0].place, pair[1].place);
            places.extend([joined.advance(pair[0].place, half), pair[1].place]);
        }
        let source = |place: &Place| {
            let after = place.span.checked_sub(seam + self.spans.len());
            match after {
                _ if place.span < seam => Some((true, end.curve.at(*place))),
                Some(beyond) => {
                    let span = start.span + beyond;
                    Some((false, start.curve.at(Place { span, ..*place })))
                }
                None => None,
            }
        };
        let source: Vec<_> = places.iter().map(source).collect();
        let (free, count) = (self.first(&end), self.count());
        let way = Way::new(
            (loom.pose(), motion.clip, motion.task),
            &joined,
            &places,
            &source,
            (free, count),
        );
        let mut starts = vec![joined];
        if let Some(exact) = join_exactly(left, right, &self.spans) {
            // The first and last control points of the bridge hold what was there.
            let inner = (self.lead() + 2, self.spans.len().saturating_sub(3));
            if inner.1 > 0 {
                let points = motion.passage(self.to, self.from)?.points;
                starts.push(way.laid(&exact, inner, &points));
                starts.push(way.laid(&exact, inner, &[points[0], points[points.len() - 1]]));
            }
            if let Some((plan, known)) = known {
                let from = free + self.lead() - plan.lead();
                if plan.bridge == self.bridge {
                    starts.push(starts[0].with_controls(from, known.iter().copied()));
                } else if let Some(known) = plan.inner_of(known) {
                    starts.push(way.laid(&exact, inner, known));
                }
            }
            starts.push(exact);
        }
        let curve = way.best(&starts)?.ok_or_else(unjoined)?;
        Ok(curve.controls()[free..][..count].to_vec())
    }

    /// Of control points over a seam those in the midst of the bridge.
    fn inner_of<'a>(&self, eased: &'a [Point]) -> Option<&'a [Point]> {
        let (lead, trail) = (self.lead() + 1, self.trail() + 1);
        eased.get(lead..eased.len().checked_sub(trail)?)
    }

    /// All frames: those up to the end of the loop, then for each pass the bridge and the frames inside,
    /// then the rest.
    fn frames(&self, time: &TimeSignal, times: usize, cuts: (&Cut, &Cut, &Cut)) -> Vec<Frame> {
        let (end, middle, start) = cuts;
        let (first, last) = (self.from.floor() as usize, self.to.floor() as usize);
        let kept = |frame: usize, pass: usize, place: Place| Frame {
            place,
            slope: time.slopes()[frame],
            source: Source::Frame(frame),
            pass,
        };
        let place = |frame: usize| time.places()[frame];
        let mut frames: Vec<Frame> = (0..last)
            .map(|i| kept(i, 0, end.place_before(place(i))))
            .collect();
        let mut shift = end.span;
        for pass in 1..=times {
            frames.extend(self.bridge_frames(pass, shift));
            shift += self.spans.len();
            let moved = |place: Place| Place {
                span: place.span - start.span + shift,
                ..place
            };
            if pass < times {
                let inside = |i: usize| middle.place_before(start.place_after(place(i)));
                frames.extend((first..last).map(|i| kept(i, pass, moved(inside(i)))));
                shift += middle.span - start.span;
            } else {
                let rest = first..time.places().len();
                frames.extend(rest.map(|i| kept(i, pass, moved(start.place_after(place(i))))));
            }
        }
        frames
    }

    /// The bridge's frames, its spans beginning at span `start` of the curve.
    fn bridge_frames(&self, pass: usize, start: usize) -> impl Iterator<Item = Frame> + '_ {
        self.steps
            .iter()
            .enumerate()
            .map(move |(i, (place, slope))| Frame {
                place: Place {
                    span: start + place.span,
                    offset: place.offset,
                },
                slope: *slope,
                source: Source::Bridge(i + 1),
                pass,
            })
    }
}

fn unjoined() -> Box<Diagnostic> {
    Box::new(Diagnostic::error("the ends of the loop cannot be joined"))
}

/// Spans of a bridge and, for each of its frames, the place in them and rho's slope. From step to step the
/// parameter grows evenly from the rate before the seam to that after it; `beside` is how much of the first
/// and the last step lies before and after the bridge. There is a span a step: where steps are whole, a
/// knot at every frame.
fn paced(frames: usize, rates: [f64; 2], beside: (f64, f64)) -> (Vec<f64>, Vec<(Place, f64)>) {
    let count = frames + 1;
    let step = |i: usize| {
        let part = (i as f64 + 0.5) / count as f64;
        rates[0] * libm::pow(rates[1] / rates[0], part)
    };
    let mut steps: Vec<f64> = (0..count).map(step).collect();
    let outside = beside.0 + beside.1;
    // at least half a step is the bridge's own
    let least = outside + 0.25 * (rates[0] + rates[1]);
    let longer = (least / steps.iter().sum::<f64>()).max(1.0);
    steps.iter_mut().for_each(|step| *step *= longer);
    let whole: f64 = steps.iter().sum();
    let spans: Vec<f64> = steps
        .iter()
        .map(|step| step * ((whole - outside) / whole))
        .collect();
    let mut at = -beside.0;
    let places = steps.windows(2).map(|pair| {
        at += pair[0];
        let mut place = Place {
            span: 0,
            offset: at.max(0.0),
        };
        while place.span + 1 < spans.len() && place.offset > spans[place.span] {
            place.offset -= spans[place.span];
            place.span += 1;
        }
        place.offset = place.offset.min(spans[place.span]);
        (place, 0.5 * (pair[0] + pair[1]))
    });
    let places = places.collect();
    (spans, places)
}

/// How many spans more there are to change before a seam and after it, up to the ends of the motion; where
/// there are more passes than one, half of the loop.
pub(super) fn room(time: &TimeSignal, (from, to): (f64, f64), times: usize) -> [usize; 2] {
    let span = |t: f64| time.place_at(t).map_or(0, |(place, _)| place.span);
    let (a, b, all) = (span(from), span(to), time.curve().spans());
    let most = match times {
        1 => [b, all.saturating_sub(a + 1)],
        _ => [b.saturating_sub(a + 1) / 2; 2],
    };
    // two spans more than these are changed
    most.map(|spans| spans.saturating_sub(2))
}

/// The same places, where they are knots: a as the beginning of a span, b as the end of one.
fn inside(curve: &Curve, (a, b): (Place, Place)) -> (Place, Place) {
    let length = |span: usize| curve.span_length(span);
    let b = match b.span.checked_sub(1) {
        Some(span) if b.offset == 0.0 => Place {
            span,
            offset: length(span),
        },
        _ => b,
    };
    let a = match a.offset == length(a.span) && a.span + 1 < curve.spans() {
        true => Place {
            span: a.span + 1,
            offset: 0.0,
        },
        false => a,
    };
    (a, b)
}

/// Knots in the span that ends at b and in the one that begins at a, and in `wide` spans beyond, so that each
/// piece takes about a frame at these rates; none where the ends are in one span.
fn pieces(
    curve: &Curve,
    (a, b): (Place, Place),
    rates: [f64; 2],
    wide: [usize; 2],
) -> (Vec<Place>, Vec<Place>) {
    let length = |span: usize| curve.span_length(span);
    if a.span >= b.span {
        return (Vec::new(), Vec::new());
    }
    let cut = |span: usize, (from, to): (f64, f64), rate: f64| -> Vec<Place> {
        let pieces = ((to - from) / rate).round().clamp(1.0, MOST_PIECES as f64);
        let knot = |i: usize| from + (to - from) * i as f64 / pieces;
        let place = |i: usize| Place {
            span,
            offset: knot(i),
        };
        (1..pieces as usize).map(place).collect()
    };
    let whole = |span: usize, rate: f64| cut(span, (0.0, length(span)), rate);
    let before = (b.span.saturating_sub(wide[0])..b.span).flat_map(|span| whole(span, rates[0]));
    let after = (a.span + 1..=a.span + wide[1]).flat_map(|span| whole(span, rates[1]));
    (
        before
            .chain(cut(b.span, (0.0, b.offset), rates[0]))
            .collect(),
        after
            .chain(cut(a.span, (a.offset, length(a.span)), rates[1]))
            .collect(),
    )
}

/// A frame of the longer loom.
pub(super) struct Frame {
    place: Place,
    slope: f64,
    pub(super) source: Source,
    pub(super) pass: usize,
}

/// What a frame was made of.
pub(super) enum Source {
    /// That frame, from 0.
    Frame(usize),
    /// The bridge's frame, from 1.
    Bridge(usize),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;

    #[test]
    fn steps_of_a_bridge_grow_evenly_from_rate_to_rate() {
        for (frames, rates, beside) in [
            (1, [1.0, 1.0], (0.0, 0.0)),
            (9, [0.2, 3.0], (0.0, 0.0)),
            (4, [2.0, 1.0], (0.5, 0.25)),
            (1, [0.1, 0.1], (1.0, 1.0)),
        ] {
            let (spans, places) = paced(frames, rates, beside);
            assert_eq!((spans.len(), places.len()), (frames + 1, frames));
            assert!(spans.iter().all(|&w| w > 0.0));
            let at = |place: &Place| spans[..place.span].iter().sum::<f64>() + place.offset;
            let mut all = vec![-beside.0];
            all.extend(places.iter().map(|(place, _)| at(place)));
            all.push(spans.iter().sum::<f64>() + beside.1);
            let steps: Vec<f64> = all.windows(2).map(|pair| pair[1] - pair[0]).collect();
            if steps[0] > beside.0 {
                let ratio = steps[1] / steps[0];
                let even = |pair: &[f64]| (pair[1] / pair[0] - ratio).abs() < 1e-9 * ratio;
                assert!(steps.windows(2).all(even), "{steps:?}");
            }
            if beside == (0.0, 0.0) {
                // a knot at every frame
                assert!(
                    all.windows(2)
                        .zip(&spans)
                        .all(|(p, w)| (p[1] - p[0] - w).abs() < 1e-9)
                );
            }
        }
    }

    #[test]
    fn spans_beside_a_seam_are_cut_into_frames() {
        let loom = ring(5, 60, false);
        let time = loom.time();
        let place = |t: f64| time.place_at(t).unwrap().0;
        let (a, b) = (place(10.0), place(50.0));
        let rates = [time.slopes()[49], time.slopes()[9]];
        let (before, after) = pieces(time.curve(), (a, b), rates.map(|rate| 0.25 * rate), [0; 2]);
        assert!(!before.is_empty() && !after.is_empty());
        assert!(
            before
                .iter()
                .all(|p| p.span == b.span && p.offset < b.offset)
        );
        assert!(
            after
                .iter()
                .all(|p| p.span == a.span && p.offset > a.offset)
        );
        // ends within one span share it
        let near = Place {
            offset: 0.5 * a.offset,
            ..a
        };
        assert_eq!(
            pieces(time.curve(), (near, a), rates, [0; 2]),
            (vec![], vec![])
        );
    }
}
