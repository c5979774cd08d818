//! The motion continued past its end.

use super::add_loop::{add_loop, bridge_for};
use super::forward::{assembled, forward};
use super::poses::{Poses, STRANGE};
use super::trim::trim;
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::math::b_spline::{Curve, Place, Point};
use crate::math::rotation;
use crate::signal::root::{RootFrame, RootSignal};
use crate::signal::time::TimeSignal;
use crate::task::Task;

/// The loom with `frames` frames more: around the loop again where the end meets the start (a step or
/// less apart, moving on the same way), else on along the last speed. All former frames keep their bits,
/// but for the three spans at a seam. A warning names the first frame whose shape looks strange.
///
/// # Errors
/// Too many frames; time that runs back and forth; the task was cancelled.
pub fn extend(loom: &Loom, frames: usize, task: &Task) -> Result<Warned<Loom>> {
    super::check_frames(frames)?;
    if frames == 0 {
        return Ok(Warned::clean(loom.clone()));
    }
    let last = loom.frames() as f64;
    if meets(loom.time()) {
        let passes = frames.div_ceil(loom.frames() - 1);
        // A pass takes as many frames each time as the way round: what shows is evened, not given more.
        let bridge = bridge_for(loom.time(), 1.0, last);
        let looped = add_loop(loom, 1.0, last, passes, Some(bridge), task)?;
        let all = Warned::from(looped);
        let mut warnings = all.warnings;
        let output = trim(&all.output, 1.0, last + frames as f64)?.unpack(&mut warnings);
        return Ok(Warned { output, warnings });
    }
    if loom
        .time()
        .place_at(last)
        .is_none_or(|(_, rate)| rate == 0.0)
    {
        return super::hold(loom, last, frames).map(Warned::clean);
    }
    let output = onward(loom, frames)?;
    let warnings = strange(loom, &output, task)?.into_iter().collect();
    Ok(Warned { output, warnings })
}

/// What is to be told where the motion goes on through shapes that look strange: the map ends with its curve.
fn strange(before: &Loom, after: &Loom, task: &Task) -> Result<Option<Diagnostic>> {
    let n = before.frames();
    let known = (1..=n).map(|frame| before.coordinates_at(frame as f64));
    let poses = Poses::of(&known.collect::<Result<Vec<_>>>()?);
    for frame in n + 1..=after.frames() {
        task.check()?;
        let out = poses.strangeness(&after.coordinates_at(frame as f64)?);
        if out > STRANGE {
            let message =
                format!("from here on shapes lie {out:.1} times as far out as the motion's own");
            return Ok(Some(
                Diagnostic::warning(message)
                    .at_frame(frame)
                    .hint("`add_loop` goes on through shapes that are known"),
            ));
        }
    }
    Ok(None)
}

/// Whether the signal closes: the end about a step from the start, in about the same direction.
fn meets(time: &TimeSignal) -> bool {
    let last = time.frames() as f64;
    let ends = time.velocity(1.0).zip(time.velocity(last));
    let same = ends.is_some_and(|(a, b)| a[0] * b[0] + a[1] * b[1] > 0.0);
    time.frames() > 3 && same && bridge_for(time, 1.0, last) <= 1
}

/// Along the last speed.
fn onward(loom: &Loom, frames: usize) -> Result<Loom> {
    // A loom that runs backwards goes on before its curve's start: the curve is turned for good.
    let forward = forward(loom)?;
    let straight = match forward.reversed {
        true => turned(&forward.loom)?,
        false => forward.loom,
    };
    let time = straight.time();
    let (mut places, mut slopes) = (time.places().to_vec(), time.slopes().to_vec());
    let (Some(&end), Some(&rate)) = (places.last(), slopes.last()) else {
        return Ok(straight);
    };
    let curve = lengthened(time.curve(), end, rate * frames as f64)?;
    for frame in 1..=frames {
        places.push(curve.advance(end, rate * frame as f64));
        slopes.push(rate);
    }
    let time = TimeSignal::new(curve, places, slopes, Vec::new()).map_err(super::impossible)?;
    let root = straight
        .root()
        .map(|root| drifting(root, frames))
        .transpose()?;
    assembled(&straight, time, root)
}

/// The curve with spans appended until `length` lies past `end`. Spans so far keep their bits: those
/// appended begin with the same point, velocity and acceleration, and go on straight.
fn lengthened(curve: &Curve, end: Place, length: f64) -> Result<Curve> {
    let mut intervals = curve.intervals().to_vec();
    let mut controls = curve.controls().to_vec();
    let spans = curve.spans();
    let width = (0..spans)
        .rev()
        .map(|s| curve.span_length(s))
        .find(|&w| w > 0.0)
        .unwrap_or(1.0);
    let mut left = length + end.offset - curve.span_length(end.span);
    if intervals[spans + 2..] == [0.0, 0.0] {
        let last = Place {
            span: spans - 1,
            offset: curve.span_length(spans - 1),
        };
        let [slope, bend] = curve.derivatives(last);
        let from = controls[spans + 2];
        let ahead = |by: f64, curl: f64| -> Point {
            [0, 1].map(|axis| from[axis] + by * slope[axis] + curl * bend[axis])
        };
        // Control points of a cubic at knots 0 0 0 w 2w: blossoms of the parabola at the end.
        controls.push(ahead(width / 3.0, 0.0));
        controls.push(ahead(width, width * width / 3.0));
        left = left.max(0.0);
    }
    let steps = (left / width).ceil().max(1.0) as usize + 2;
    for _ in 0..steps {
        let k = controls.len();
        let (a, b) = (controls[k - 2], controls[k - 1]);
        // Knot averages of neighbouring control points lie this far apart.
        let knot = |i: usize| intervals.get(i).copied().unwrap_or(width);
        let before = (knot(k - 2) + knot(k - 1) + knot(k)) / 3.0;
        let after = (knot(k - 1) + knot(k) + width) / 3.0;
        let ratio = if before > 0.0 { after / before } else { 1.0 };
        controls.push([0, 1].map(|axis| b[axis] + ratio * (b[axis] - a[axis])));
    }
    intervals.resize(controls.len() + 1, width);
    Curve::new(intervals, controls)
        .map_err(|_| Box::new(Diagnostic::error("the signal cannot be continued so far")))
}

/// A loom on the reversed curve that runs the other way.
fn turned(loom: &Loom) -> Result<Loom> {
    let time = loom.time();
    let curve = time.curve();
    let mirrored = |place: &Place| Place {
        span: curve.spans() - 1 - place.span,
        offset: curve.span_length(place.span) - place.offset,
    };
    let places = time.places().iter().rev().map(mirrored).collect();
    let slopes = time.slopes().iter().rev().copied().collect();
    let time = TimeSignal::new(curve.reversed(), places, slopes, Vec::new());
    let back = |frame: &RootFrame| RootFrame {
        spin: -frame.spin,
        slope: -frame.slope,
        ..*frame
    };
    let root = loom
        .root()
        .map(|root| root.with_frames(root.frames().iter().rev().map(back).collect()));
    let root = root.transpose().map_err(|_| unfinished())?;
    assembled(loom, time.map_err(super::impossible)?, root)
}

/// Root motion that goes on with its last velocities.
fn drifting(root: &RootSignal, frames: usize) -> Result<RootSignal> {
    let mut all = root.frames().to_vec();
    if let Some(&end) = all.last() {
        for frame in (1..=frames).map(|frame| frame as f64) {
            all.push(RootFrame {
                rotation: end.rotation * rotation::exp(&(end.spin * frame)),
                position: end.position + end.slope * frame,
                ..end
            });
        }
    }
    root.with_frames(all).map_err(|_| unfinished())
}

fn unfinished() -> Box<Diagnostic> {
    Box::new(Diagnostic::error("the root motion is not finite"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::edit::Sketch;
    use crate::edit::{Edit, path, reverse};
    use crate::loom::test_looms::{ring, travelling};

    #[test]
    fn it_goes_on_along_the_last_speed_and_former_frames_keep_their_bits() {
        for loom in [ring(10, 30, false), ring(10, 31, true)] {
            let n = loom.frames();
            let longer = extend(&loom, 12, &Task::default()).unwrap().output;
            assert_eq!(longer.frames(), n + 12);
            for frame in (1..=n).map(|frame| frame as f64) {
                assert_eq!(longer.at(frame).unwrap(), loom.at(frame).unwrap());
            }
            let v = longer.time().velocity(n as f64).unwrap();
            let before = loom.time().velocity(n as f64).unwrap();
            assert!((0..2).all(|k| (v[k] - before[k]).abs() < 1e-12));
            // straight from a few frames on
            let w = [n + 6, n + 11].map(|t| longer.time().velocity(t as f64).unwrap());
            assert!((0..2).all(|k| (w[0][k] - w[1][k]).abs() < 1e-12));
        }
    }

    #[test]
    fn shapes_beyond_the_map_are_told() {
        let loom = ring(10, 31, true);
        let told = |frames| extend(&loom, frames, &Task::default()).unwrap().warnings;
        assert_eq!(told(1), []);
        let far = told(60);
        let frame = far[0].place.frame.unwrap();
        assert!((33..91).contains(&frame) && far[0].message.contains("as far out"));
        // up to there all is well, and with so many frames more the same is told
        assert_eq!(told(frame - 32), []);
        assert_eq!(told(frame - 31), far);
    }

    #[test]
    fn a_signal_that_closes_goes_round_again() {
        let angle = |i: u8| std::f64::consts::TAU * f64::from(i) / 12.0;
        let round: Vec<Point> = (0..=12)
            .map(|i| [libm::cos(angle(i)), libm::sin(angle(i))])
            .collect();
        let loom = path(&ring(10, 41, true), &round, Sketch::Through, None)
            .unwrap()
            .output;
        assert!(meets(loom.time()) && !meets(ring(10, 41, true).time()));
        let longer = extend(&loom, 100, &Task::default()).unwrap().output;
        assert_eq!(longer.frames(), 141);
        // a pass takes 40 frames, the same each time
        for frame in (10..=30).map(f64::from) {
            let pass = longer.at(frame + 40.0).unwrap();
            assert_eq!(pass, longer.at(frame + 80.0).unwrap());
            assert_eq!(pass, loom.at(frame).unwrap());
        }
    }

    #[test]
    fn root_motion_goes_on_and_backwards_too() {
        let loom = travelling(10, 30);
        for loom in [loom.clone(), reverse(&loom).unwrap()] {
            let longer = extend(&loom, 5, &Task::default()).unwrap().output;
            for frame in (1..=30).map(f64::from) {
                let (a, b) = (longer.at(frame).unwrap(), loom.at(frame).unwrap());
                // turned, places are counted from the other end: a rounding, then single precision
                assert!(
                    a.iter()
                        .zip(&b)
                        .all(|(a, b)| (a - b).abs() <= 1e-5 * (1.0 + b.abs()))
                );
            }
            let at = |t: f64| longer.root_at(t).unwrap().translation.vector;
            let (last, next) = (at(30.0) - at(29.5), at(34.5) - at(34.0));
            assert!((last - next).norm() < 0.05);
        }
    }

    #[test]
    fn extending_what_was_trimmed_or_extended_is_possible() {
        let loom = ring(10, 30, false);
        let part = trim(&loom, 5.0, 19.0).unwrap().output;
        let task = Task::default();
        let longer = extend(&extend(&part, 4, &task).unwrap().output, 4, &task)
            .unwrap()
            .output;
        assert_eq!(longer.frames(), 23);
        for frame in (1..=15).map(f64::from) {
            assert_eq!(longer.at(frame).unwrap(), loom.at(frame + 4.0).unwrap());
        }
    }

    #[test]
    fn edits_as_data_do_what_their_verbs_do() {
        let loom = ring(10, 30, false);
        let edit = Edit::Extend { frames: 7 };
        assert_eq!(
            edit.apply(&loom, &Task::default()).unwrap().output.time(),
            extend(&loom, 7, &Task::default()).unwrap().output.time()
        );
        assert!(extend(&loom, usize::MAX, &Task::default()).is_err());
    }
}
