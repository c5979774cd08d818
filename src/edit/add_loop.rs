//! A part of the motion passed through again (CH12 §4.1, Fig. 5).
//!
//! Control points, knot intervals and frames of the loop are repeated, so k and n grow while l and m stay.
//! Knots are put where the loop begins and ends, so that it takes whole frames and begins where it was
//! asked to: rounded to the nearest knots instead, its ends would move by up to half a span (1.7 frames
//! for a flag of 180 frames with k = 54) and its length would not be whole; the two spans before a seam
//! and the two after it turn from the one into the other with the least change of acceleration (a third,
//! where a knot was put, changes by rounding). Where the ends lie apart, frames
//! with spans of their own lead from one to the other.

use nalgebra::{Isometry3, Translation3, Vector3};

use super::bridge;
use super::forward::{assembled, forward};
use super::seam::Seam;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::math::b_spline::{Curve, Inserted, Place, Point};
use crate::math::curve_join::join;
use crate::math::monotone;
use crate::math::rotation;
use crate::signal::pose::PoseSignal;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::time::TimeSignal;

/// Seams above this show.
const SHOWS: f64 = 1.5;

/// A loom with a loop more, and what was done.
#[derive(Clone)]
pub struct Looped {
    /// The loom.
    pub loom: Loom,
    /// The loop that was repeated: as asked for, its end moved so that it takes whole frames.
    pub stretch: (f64, f64),
    /// Frames between two passes.
    pub bridge: usize,
    /// How much the first seam shows.
    pub seam: Seam,
}

impl From<Looped> for Warned<Loom> {
    fn from(looped: Looped) -> Self {
        let mut all = Warned::clean(looped.loom);
        let worst = looped.seam.worst();
        if worst > SHOWS {
            let message =
                format!("the loop's seam shows: {worst:.1} times the motion's own changes");
            all.warnings.push(
                Diagnostic::warning(message)
                    .hint("a longer bridge, or ends where pose and direction agree, hide it"),
            );
        }
        all
    }
}

/// The loom that passes `times` times more through \[`from`, `to`\]. `to` is moved so that the loop takes
/// whole frames. `bridge` frames go between two passes; none given: as many as the distance between the
/// ends takes at the speed there (none where they meet), and a quarter more again and again until the
/// seam does not show, at most two and a half times the loop (or 60). Frames outside the spans about a
/// seam keep their bits; with root motion every pass adds the loop's increment.
///
/// # Errors
/// The loop leaves \[1, n\], has no length or less than a frame; too many frames; time that runs back and
/// forth; a loom that never moves.
pub fn add_loop(
    loom: &Loom,
    from: f64,
    to: f64,
    times: usize,
    bridge: Option<usize>,
) -> Result<Looped> {
    super::check_stretch(loom, from, to)?;
    let forward = forward(loom)?;
    let (from, to) = forward.stretch(from, to);
    let length = (to - from).round().max(1.0);
    let to = from + length;
    super::check_time(loom, to)?;
    let wanted = bridge.unwrap_or_else(|| bridge_for(forward.loom.time(), from, to));
    super::check_frames(
        (length as usize)
            .saturating_add(wanted)
            .saturating_mul(times),
    )?;
    let mut best = attempt(&forward.loom, (from, to), times, (wanted, bridge::ease))?;
    // A seam that shows is evened out, then given more time.
    let longest = most_bridged(length as usize);
    let mut next = wanted;
    if best.seam.worst() > SHOWS {
        let evened = attempt(&forward.loom, (from, to), times, (wanted, bridge::even))?;
        if evened.seam.worst() < best.seam.worst() {
            best = evened;
        }
    }
    while bridge.is_none() && wanted > 0 && best.seam.worst() > SHOWS {
        next = (5 * next).div_ceil(4).max(next + 1);
        if next > longest {
            break;
        }
        let longer = attempt(&forward.loom, (from, to), times, (next, bridge::even))?;
        if longer.seam.worst() < best.seam.worst() {
            best = longer;
        }
    }
    let mirror = |t: f64| loom.frames() as f64 + 1.0 - t;
    Ok(Looped {
        loom: forward.restore(&best.loom)?,
        stretch: match forward.reversed {
            true => (mirror(to), mirror(from)),
            false => (from, to),
        },
        ..best
    })
}

/// The longest bridge of a loop of so many frames.
fn most_bridged(frames: usize) -> usize {
    5 * frames.max(24) / 2
}

/// How the way over a seam is found: [`bridge::ease`] or [`bridge::even`].
type Ease = fn(&PoseSignal, &Curve, &[Place], usize, usize) -> Curve;

/// The loop with that many frames between passes, on a loom without changes of time.
fn attempt(
    loom: &Loom,
    stretch: (f64, f64),
    times: usize,
    (bridge, ease): (usize, Ease),
) -> Result<Looped> {
    let (from, to) = stretch;
    let plan = Plan::new(loom, from, to, bridge, ease)?;
    let looped = plan.repeat(loom, times)?;
    let last = to.floor() as usize;
    let seam = match times {
        0 => Seam::default(),
        _ => Seam::measure(&looped, last, last + bridge + 1),
    };
    Ok(Looped {
        loom: looped,
        stretch,
        bridge,
        seam,
    })
}

/// Frames that the way from f(b) to f(a) takes: its length over the speed there.
pub(super) fn bridge_for(time: &TimeSignal, from: f64, to: f64) -> usize {
    let size = |v: [f64; 2]| libm::hypot(v[0], v[1]);
    let speed = |t: f64| time.velocity(t).map_or(0.0, size);
    let at = |t: f64| time.at(t).unwrap_or_default();
    let (a, b) = (at(from), at(to));
    let gap = size([b[0] - a[0], b[1] - a[1]]);
    let frames = (to - from).round().max(1.0);
    let mean = (0..frames as usize)
        .map(|i| speed(from + i as f64 + 0.5))
        .sum::<f64>()
        / frames;
    // At an end that rests the speed there says nothing.
    let local = (0.5 * (speed(from) + speed(to))).max(0.5 * mean);
    let needed = if local > 0.0 {
        (gap / local).round()
    } else {
        0.0
    };
    needed.min(frames.max(24.0)) as usize
}

/// Where the loop begins and ends on the curve, and what goes between two passes.
struct Plan {
    from: f64,
    to: f64,
    /// Frames between two passes, and the lengths of their spans.
    bridge: usize,
    spans: Vec<f64>,
    /// Parameter from the last frame before the seam to it.
    lead: f64,
    /// For each frame of the bridge the parameter from that last frame on, and rho's slope.
    steps: Vec<(f64, f64)>,
    ease: Ease,
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
    fn new(loom: &Loom, from: f64, to: f64, bridge: usize, ease: Ease) -> Result<Self> {
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
            frames => ((frames as f64 * density).round() as usize).max(1),
        };
        Ok(Plan {
            from,
            to,
            bridge,
            spans: vec![width / spans.max(1) as f64; spans],
            lead,
            steps,
            ease,
        })
    }

    /// The loom with `times` passes more.
    fn repeat(&self, loom: &Loom, times: usize) -> Result<Loom> {
        if times == 0 {
            return Ok(loom.clone());
        }
        let time = loom.time();
        let place = |t: f64| time.place_at(t).map(|(place, _)| place).unwrap_or_default();
        let (a, b) = (place(self.from), place(self.to));
        let whole = time.curve();
        let (end, start) = (Cut::new(whole, b), Cut::new(whole, a));
        let middle = Cut::new(&start.curve, start.place(b));
        let unjoined = || Box::new(Diagnostic::error("the ends of the loop cannot be joined"));
        let frames = self.frames(time, times, (&end, &middle, &start));
        let eased = {
            let one = join(
                (&end.curve, end.span),
                (&start.curve, start.span),
                &self.spans,
            );
            let frames = self.frames(time, 1, (&end, &middle, &start));
            self.eased(loom, &one.ok_or_else(unjoined)?, end.span, &frames)
        };
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
        let time = TimeSignal::new(curve, places, slopes, Vec::new()).map_err(super::impossible)?;
        let root = loom
            .root()
            .map(|root| self.root(root, &frames))
            .transpose()?;
        assembled(loom, time, root)
    }

    /// The control points of the seam that begins at span `seam` that let the shapes change least.
    fn eased(&self, loom: &Loom, curve: &Curve, seam: usize, frames: &[Frame]) -> Vec<Point> {
        // Frames of the first seam, and two on each side of the spans that it changes.
        let (least, most) = (seam.saturating_sub(2), seam + self.spans.len() + 2);
        let inside = |frame: &Frame| (least..most).contains(&frame.place.span) && frame.pass < 2;
        let first = frames.iter().position(inside).unwrap_or(0);
        let last = frames.iter().rposition(inside).unwrap_or(0);
        let last = (last + 2).min(frames.len() - 1);
        // Half frames too: the curve must not swing between frames.
        let frames = &frames[first.saturating_sub(2)..=last];
        let mut places = vec![frames[0].place];
        for pair in frames.windows(2) {
            let half = 0.5 * curve.distance(pair[0].place, pair[1].place);
            places.extend([curve.advance(pair[0].place, half), pair[1].place]);
        }
        let count = self.spans.len() + 1;
        let eased = (self.ease)(loom.pose(), curve, &places, seam + 1, count);
        eased.controls()[seam + 1..][..count].to_vec()
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

    /// The root motion of all frames; each pass adds the loop's increment and the bridge's.
    fn root(&self, root: &RootSignal, frames: &[Frame]) -> Result<RootSignal> {
        let (a, b) = (root.frame_at(self.from), root.frame_at(self.to));
        let drift = Drift::new(&a, &b);
        let after = drift.after(&b, self.bridge as f64);
        let increment = motion(&after) * motion(&a).inverse();
        let mut carried = vec![Isometry3::identity()];
        let passes = frames.last().map_or(0, |frame| frame.pass);
        for pass in 0..passes {
            carried.push(increment * carried[pass]);
        }
        let begin = self.to.fract();
        let frame = |frame: &Frame| match frame.source {
            Source::Frame(i) if frame.pass == 0 => root.frames()[i],
            Source::Frame(i) => root.carried(&root.frames()[i], &carried[frame.pass]),
            Source::Bridge(i) => {
                root.carried(&drift.after(&b, i as f64 - begin), &carried[frame.pass - 1])
            }
        };
        root.with_frames(frames.iter().map(frame).collect())
            .map_err(|e| {
                Box::new(Diagnostic::error("the root motion is not finite").at_frame(e.frame + 1))
            })
    }
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
struct Frame {
    place: Place,
    slope: f64,
    source: Source,
    pass: usize,
}

/// What a frame was made of.
enum Source {
    /// That frame, from 0.
    Frame(usize),
    /// The bridge's frame, from 1.
    Bridge(usize),
}

/// How the body travels on while it is led from the end of the loop to its start: with the mean of the
/// velocities there, in its own axes.
struct Drift {
    spin: Vector3<f64>,
    slope: Vector3<f64>,
}

impl Drift {
    fn new(a: &RootFrame, b: &RootFrame) -> Self {
        let own = |frame: &RootFrame| frame.rotation.inverse() * frame.slope;
        Drift {
            spin: (a.spin + b.spin) * 0.5,
            slope: (own(a) + own(b)) * 0.5,
        }
    }

    /// The state `frames` frames after `b`.
    fn after(&self, b: &RootFrame, frames: f64) -> RootFrame {
        let rotation = b.rotation * rotation::exp(&(self.spin * frames));
        let halfway = b.rotation * rotation::exp(&(self.spin * (0.5 * frames)));
        RootFrame {
            rotation,
            position: b.position + halfway * self.slope * frames,
            spin: self.spin,
            slope: rotation * self.slope,
        }
    }
}

/// A state as a motion of space that takes the body at the origin there.
fn motion(frame: &RootFrame) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(frame.position), frame.rotation)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::{retime, reverse};
    use crate::loom::test_looms::{ring, travelling};

    #[test]
    fn frames_away_from_the_seams_keep_their_bits() {
        let loom = ring(10, 45, false);
        for (from, to, times, bridge) in [
            (12.0, 32.0, 1, None),
            (12.0, 32.0, 3, Some(2)),
            (8.5, 25.5, 2, Some(0)),
            (1.0, 45.0, 1, None),
        ] {
            let looped = add_loop(&loom, from, to, times, bridge).unwrap();
            let (n, longer) = (loom.frames(), looped.loom.frames());
            let pass = (to - from) as usize + looped.bridge;
            assert_eq!(longer, n + times * pass);
            let shift = (times * pass) as f64;
            for frame in (1..=n).map(|frame| frame as f64) {
                let before = loom.at(frame).unwrap();
                // two spans are at most three frames and a half here
                if frame < to - 4.0 {
                    assert_eq!(looped.loom.at(frame).unwrap(), before, "{frame}");
                }
                if frame > from + 4.0 {
                    assert_eq!(looped.loom.at(frame + shift).unwrap(), before, "{frame}");
                }
            }
            assert_eq!(looped.loom.pose(), loom.pose());
            assert_eq!(looped.loom.shape(), loom.shape());
        }
    }

    #[test]
    fn control_points_grow_by_those_of_the_loop() {
        // a knot at every frame: no knot is put
        let loom = ring(10, 40, true);
        let looped = add_loop(&loom, 10.0, 30.0, 1, Some(0)).unwrap().loom;
        assert_eq!(looped.frames(), 60);
        assert_eq!(looped.time().controls().len(), 42 + 20);
        let bridged = add_loop(&loom, 10.0, 30.0, 2, Some(3)).unwrap().loom;
        assert_eq!(bridged.frames(), 40 + 2 * 23);
        assert_eq!(bridged.time().controls().len(), 42 + 2 * 23);
    }

    #[test]
    fn a_loop_that_closes_shows_no_seam_and_gets_no_bridge() {
        // one turn of the ring takes 20.27 frames
        let looped = add_loop(&ring(10, 60, true), 15.0, 35.0, 2, None).unwrap();
        assert!(looped.bridge <= 1);
        assert!(looped.seam.worst() < SHOWS, "{:?}", looped.seam);
    }

    #[test]
    fn ends_that_lie_apart_are_bridged() {
        let loom = ring(10, 21, true);
        let bare = add_loop(&loom, 7.0, 15.0, 1, Some(0)).unwrap();
        let bridged = add_loop(&loom, 7.0, 15.0, 1, None).unwrap();
        assert!(bridged.bridge > 2);
        assert!(bridged.seam.worst() < 0.5 * bare.seam.worst());
        assert_eq!(Warned::from(bare).warnings.len(), 1);
    }

    #[test]
    fn root_motion_travels_on_without_a_step() {
        // the same motion from every frame to the next, within a loop, over a seam and a bridge
        let loom = travelling(10, 45);
        for (from, to, bridge) in [(10.0, 30.0, 0), (10.0, 30.0, 3), (10.5, 28.5, 2)] {
            let looped = add_loop(&loom, from, to, 2, Some(bridge)).unwrap().loom;
            let at = |frame: usize| looped.root_at(frame as f64).unwrap();
            let step = |frame: usize| at(frame).inverse() * at(frame + 1);
            let first = step(4).to_matrix();
            for frame in 4..looped.frames() - 4 {
                let error = (step(frame).to_matrix() - first).norm();
                // the bridge takes the chord at half the turn; central differences are as good
                assert!(error < 0.02, "{from} {bridge} {frame}: {error}");
            }
        }
    }

    #[test]
    fn a_reversed_loom_loops_where_it_says() {
        let loom = travelling(10, 45);
        let there = reverse(&add_loop(&loom, 12.0, 32.0, 1, None).unwrap().loom).unwrap();
        let here = add_loop(&reverse(&loom).unwrap(), 14.0, 34.0, 1, None).unwrap();
        assert_eq!(
            (here.loom.time(), here.stretch),
            (there.time(), (14.0, 34.0))
        );
    }

    #[test]
    fn a_retimed_loom_loops_on_its_new_frames() {
        let loom = ring(10, 45, true);
        let slow = retime(&loom, &[[1.0, 1.0], [89.0, 45.0]]).unwrap();
        let looped = add_loop(&slow, 21.0, 61.0, 1, Some(0)).unwrap().loom;
        assert_eq!(looped.frames(), 89 + 40);
        for frame in (1..=50).map(f64::from) {
            assert_eq!(looped.at(frame).unwrap(), slow.at(frame).unwrap());
        }
    }

    #[test]
    fn loops_that_are_none_are_refused() {
        let loom = ring(5, 20, true);
        for (from, to) in [
            (9.0, 9.0),
            (9.0, 3.0),
            (0.5, 4.0),
            (3.0, 20.5),
            (f64::NAN, 4.0),
        ] {
            assert!(add_loop(&loom, from, to, 1, None).is_err());
        }
        assert!(add_loop(&loom, 3.0, 9.0, usize::MAX, None).is_err());
        assert!(add_loop(&loom, 3.0, 9.0, 1, Some(usize::MAX)).is_err());
        let none = add_loop(&loom, 3.0, 9.0, 0, None).unwrap();
        assert_eq!(none.loom.time(), loom.time());
    }
}
