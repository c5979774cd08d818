//! The longer curve of a loop and its frames: which parts are repeated, and what goes over a seam.

use crate::diag::{Diagnostic, Result};
use crate::edit::bridge::{Way, through};
use crate::edit::forward::assembled;
use crate::edit::seam::Clip;
use crate::loom::Loom;
use crate::math::b_spline::{Curve, Inserted, Place, Point};
use crate::math::curve_join::join;
use crate::math::monotone;
use crate::signal::time::TimeSignal;

use super::root;

/// Where the loop begins and ends on the curve, and what goes between two passes.
pub(super) struct Plan {
    from: f64,
    to: f64,
    /// Frames between two passes, and the lengths of their spans.
    pub(super) bridge: usize,
    spans: Vec<f64>,
    /// Parameter from the last frame before the seam to it.
    lead: f64,
    /// For each frame of the bridge the parameter from that last frame on, and rho's slope.
    steps: Vec<(f64, f64)>,
}

/// A curve with a knot at a place: the span that begins there, and how places move.
struct Cut {
    curve: Curve,
    span: usize,
    inserted: Option<Inserted>,
}

impl Cut {
    fn new(curve: &Curve, place: Place) -> Self {
        match curve.insert_knot(place) {
            Some(inserted) => Cut {
                curve: inserted.curve.clone(),
                span: place.span + 1,
                inserted: Some(inserted),
            },
            None => Cut {
                curve: curve.clone(),
                span: place.span + usize::from(place.offset > 0.0),
                inserted: None,
            },
        }
    }

    fn place(&self, former: Place) -> Place {
        self.inserted
            .as_ref()
            .map_or(former, |inserted| inserted.place(former))
    }
}

impl Plan {
    /// The plan with `bridge` frames between passes.
    pub(super) fn new(loom: &Loom, from: f64, to: f64, bridge: usize) -> Result<Self> {
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
        let rest = lead + curve.distance(a, r).max(0.0);
        let ends = [time.slopes()[left], time.slopes()[right]];
        let count = (bridge + 1) as f64;
        let rate = match 0.5 * (ends[0] + ends[1]) {
            rate if rate > 0.0 => rate,
            _ => pass / (to - from),
        };
        let width = if bridge == 0 {
            0.0
        } else {
            (count * rate - rest).max(0.5 * rate)
        };
        let whole = rest + width;
        let slopes = bounded(ends, whole / count);
        let steps = (1..=bridge)
            .map(|i| monotone::piece(count, whole, slopes, i as f64))
            .collect();
        let density = (b.span - a.span + 1) as f64 / (to - from);
        let spans = match bridge {
            0 => 0,
            // one a frame at least: it has to turn sooner than the motion does
            frames => ((frames as f64 * density).round() as usize).max(frames),
        };
        Ok(Plan {
            from,
            to,
            bridge,
            spans: vec![width / spans.max(1) as f64; spans],
            lead,
            steps,
        })
    }

    /// The curve cut where the loop ends, where it begins, and (after that cut) where it ends.
    fn cuts(&self, time: &TimeSignal) -> [Cut; 3] {
        let place = |t: f64| time.place_at(t).map(|(place, _)| place).unwrap_or_default();
        let (a, b) = (place(self.from), place(self.to));
        let (end, start) = (Cut::new(time.curve(), b), Cut::new(time.curve(), a));
        let middle = Cut::new(&start.curve, start.place(b));
        [end, middle, start]
    }

    /// The loom with `times` passes more, control points `eased` over each seam.
    pub(super) fn repeat(&self, loom: &Loom, times: usize, eased: &[Point]) -> Result<Loom> {
        if times == 0 {
            return Ok(loom.clone());
        }
        let time = loom.time();
        let [end, middle, start] = self.cuts(time);
        let frames = self.frames(time, times, (&end, &middle, &start));
        let pass = |left: &Cut, right: &Curve| {
            let joined = join((&left.curve, left.span), (right, start.span), &self.spans)?;
            let set =
                |curve: Curve, (j, at): (usize, &Point)| curve.with_control(left.span + 1 + j, *at);
            Some(eased.iter().enumerate().fold(joined, set))
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

    /// The control points over a seam that let it show least.
    pub(super) fn eased(&self, loom: &Loom, clip: &Clip) -> Result<Vec<Point>> {
        let [end, middle, start] = self.cuts(loom.time());
        let (left, right) = ((&end.curve, end.span), (&start.curve, start.span));
        let joined = join(left, right, &self.spans).ok_or_else(unjoined)?;
        let frames = self.frames(loom.time(), 1, (&end, &middle, &start));
        // Frames of the spans that change, and two on each side.
        let seam = end.span;
        let (least, most) = (seam.saturating_sub(2), seam + self.spans.len() + 2);
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
        let (free, count) = (seam + 1, self.spans.len() + 1);
        let way = Way::new(
            (loom.pose(), clip),
            &joined,
            &places,
            &source,
            (free, count),
        );
        let (a, b) = (self.from.round() as usize, self.to.round() as usize);
        let shapes = through(clip, b - 1, a - 1);
        let place = |frame: usize| loom.time().at((frame + 1) as f64).unwrap_or_default();
        let known: Vec<Point> = shapes.into_iter().map(place).collect();
        let straight = [place(b - 1), place(a - 1)];
        let starts = [
            joined.clone(),
            way.laid(&joined, &known),
            way.laid(&joined, &straight),
        ];
        let curve = way.best(&starts).ok_or_else(unjoined)?;
        Ok(curve.controls()[free..][..count].to_vec())
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
            .map(|i| kept(i, 0, knot_before(end, end.place(place(i)))))
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
                let inside = |i: usize| knot_before(middle, middle.place(start.place(place(i))));
                frames.extend((first..last).map(|i| kept(i, pass, moved(inside(i)))));
                shift += middle.span - start.span;
            } else {
                let rest = first..time.places().len();
                frames.extend(rest.map(|i| kept(i, pass, moved(start.place(place(i))))));
            }
        }
        frames
    }

    /// The bridge's frames, its spans beginning at span `start` of the curve.
    fn bridge_frames(&self, pass: usize, start: usize) -> impl Iterator<Item = Frame> + '_ {
        let width = self.spans.first().copied().unwrap_or(0.0);
        let total: f64 = width * self.spans.len() as f64;
        self.steps.iter().enumerate().map(move |(i, (y, slope))| {
            let y = (y - self.lead).clamp(0.0, total);
            let span = ((y / width) as usize).min(self.spans.len() - 1);
            let place = Place {
                span: start + span,
                offset: (y - span as f64 * width).clamp(0.0, width),
            };
            Frame {
                place,
                slope: *slope,
                source: Source::Bridge(i + 1),
                pass,
            }
        })
    }
}

fn unjoined() -> Box<Diagnostic> {
    Box::new(Diagnostic::error("the ends of the loop cannot be joined"))
}

/// Slopes brought into the disc of radius 3 about a secant.
fn bounded(slopes: [f64; 2], secant: f64) -> [f64; 2] {
    let limited = monotone::limited(&[secant], &slopes);
    [limited[0], limited[1]]
}

/// A place at the knot where the loop ends, as the end of the span before it: what follows there is
/// another part of the curve.
fn knot_before(cut: &Cut, place: Place) -> Place {
    if place.span == cut.span && place.offset == 0.0 && cut.span > 0 {
        return Place {
            span: cut.span - 1,
            offset: cut.curve.span_length(cut.span - 1),
        };
    }
    place
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
