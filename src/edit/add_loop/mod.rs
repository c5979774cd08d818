//! A part of the motion passed through again (CH12 §4.1, Fig. 5).
//!
//! Control points, knot intervals and frames of the loop are repeated, so k and n grow while l and m stay.
//! Knots are put where the loop begins and ends, so that it takes whole frames and begins where it was
//! asked to: rounded to the nearest knots instead, its ends would move by up to half a span (1.7 frames
//! for a flag of 180 frames with k = 54) and its length would not be whole. What is rounded is the length:
//! the end moves to a whole number of frames after the beginning, which is returned and told. The two
//! spans before a seam and the two after it turn from the one into the other so that what shows of it is
//! least; a third changes by rounding, or turns too where the seam lies within a span; all other frames keep
//! their bits. The spans next to a seam are cut into pieces of about a frame: what the motion does within
//! a frame, a few control points over ten frames cannot meet. Where the ends lie apart, frames with
//! a span each lead from one to the other.
//!
//! Between the strands of its curve a map may hold anything: a bridge that was only smooth led a gallop through
//! hooves as big as its trunk. So it keeps to shapes that lie hardly farther out than the motion's own, and
//! begins with the shortest way over the map through such.
//!
//! Some ends no bridge can leave or meet so: where the motion is fast, or turns at once. A seam that shows
//! for all the time it is given may turn over more spans, and where that is not enough, the bridge may leave
//! the motion later and come back to it earlier, where it is calm: an animal that is to be thrown again is
//! led to the hand that throws it, not into its flight.

mod bridge;
mod cut;
mod passage;
mod plan;
mod root;
mod search;

use super::forward::forward;
use super::poses::STRANGE;
use super::seam::{Clip, SHOWS, Seam};
use crate::diag::{Diagnostic, Result, Warned};
use crate::loom::Loom;
use crate::signal::time::TimeSignal;
use crate::task::Task;
use passage::Motion;
use search::Search;

/// Times that are meant to be whole miss whole numbers by less.
const ROUNDING: f64 = 1e-9;

/// A loom with a loop more, and what was done.
#[derive(Clone)]
pub struct Looped {
    /// The loom.
    pub loom: Loom,
    /// The loop that was repeated: as asked for, its end moved so that it takes whole frames.
    pub stretch: (f64, f64),
    /// By how many frames its end was moved for that.
    pub moved: f64,
    /// Frames between two passes.
    pub bridge: usize,
    /// How many of these are the motion's own: before the bridge leaves it, and after it has come back.
    pub own: (usize, usize),
    /// Frames (from 1) of the motion as it was: before a seam all up to the first of these keep their bits,
    /// after it all from the second on; what is nearer to it turns into the bridge.
    pub kept: (usize, usize),
    /// How much the seam of one pass more shows.
    pub seam: Seam,
    /// How far from the mean shape the bridge and what turns into it go at their frames, for 1 of the motion's
    /// farthest frame; each mode is measured by its own deviation. Above 1.75 shapes begin to look strange.
    pub strangeness: f64,
}

impl Looped {
    /// No pass more.
    fn none(loom: &Loom, stretch: (f64, f64), moved: f64) -> Self {
        Looped {
            loom: loom.clone(),
            stretch,
            moved,
            bridge: 0,
            own: (0, 0),
            kept: (loom.frames(), 1),
            seam: Seam::default(),
            strangeness: 0.0,
        }
    }

    /// How much the seam shows, or how strange the shapes about it are, on one scale: above 1.5 it shows.
    pub fn shown(&self) -> f64 {
        shown(&self.seam, self.strangeness)
    }
}

/// How much a seam shows, or how strange the shapes about it are, on the scale of its ratios.
fn shown(seam: &Seam, strangeness: f64) -> f64 {
    seam.worst().max(SHOWS * strangeness / STRANGE)
}

impl From<Looped> for Warned<Loom> {
    fn from(looped: Looped) -> Self {
        let mut all = Warned::clean(looped.loom);
        if looped.moved.abs() > ROUNDING {
            let (from, to) = looped.stretch;
            let message = format!("the loop goes from {from} to {to}: it takes whole frames");
            all.warnings.push(Diagnostic::warning(message));
        }
        let (out, back) = looped.own;
        if out + back > 0 {
            let (from, to) = looped.stretch;
            let message = format!(
                "the bridge leaves the motion at {} and comes back to it at {}, where it is calmer",
                to + out as f64,
                from - back as f64
            );
            all.warnings.push(
                Diagnostic::warning(message)
                    .hint("a loop with ends where the motion is calm needs a shorter bridge"),
            );
        }
        if looped.strangeness > STRANGE {
            let message = format!(
                "the bridge's shapes lie up to {:.1} times as far out as the motion's own",
                looped.strangeness
            );
            all.warnings.push(
                Diagnostic::warning(message)
                    .hint("a longer bridge, or ends where the poses are alike, need none such"),
            );
        }
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
/// ends takes at the speed there (none where they meet), and a quarter to a half more again and again until
/// the seam does not show and its shapes are not strange, at least what known shapes on the way take, at most
/// two and a half times the loop (or 125), and not where more shows no less. If it shows then, ever more
/// spans beside it turn into the bridge; if that does not help, the bridge begins and ends with frames of the
/// motion's own, up to a third of the longest on either side. Other frames keep their bits; with root motion
/// every pass adds the loop's increment.
///
/// # Errors
/// The loop leaves \[1, n\], has no length or less than a frame; too many frames; time that runs back and
/// forth; a loom that never moves; `task` was cancelled.
pub fn add_loop(
    loom: &Loom,
    from: f64,
    to: f64,
    times: usize,
    bridge: Option<usize>,
    task: &Task,
) -> Result<Looped> {
    super::check_stretch(loom, from, to)?;
    let forward = forward(loom)?;
    let (from, to) = forward.stretch(from, to);
    // Times that people compute miss frames by rounding.
    let whole = (from - from.round()).abs() < ROUNDING;
    let from = if whole { from.round() } else { from };
    let length = (to - from).round().max(1.0);
    let moved = from + length - to;
    let to = from + length;
    super::check_time(loom, to)?;
    let mirror = |t: f64| loom.frames() as f64 + 1.0 - t;
    let stretch = match forward.reversed {
        true => (mirror(to), mirror(from)),
        false => (from, to),
    };
    if times == 0 {
        return Ok(Looped::none(loom, stretch, moved));
    }
    let grows = |bridge: usize| {
        let pass = (length as usize).saturating_add(bridge);
        super::check_frames(pass.saturating_mul(times))
    };
    grows(bridge.unwrap_or(0))?;
    let clip = Clip::of(&forward.loom);
    let search = Search {
        motion: Motion::new(&forward.loom, &clip, task),
        times,
    };
    let best = match bridge {
        None => search.run((from, to))?,
        Some(bridge) => search.bridged((from, to), bridge)?,
    };
    let own = best.plan.beyond((from, to));
    let bridged = own.0 + best.plan.bridge + own.1;
    grows(bridged)?;
    let looped = match times {
        1 => best.looped,
        times => best.plan.repeat(&forward.loom, times, &best.eased)?,
    };
    let kept = best.plan.kept(forward.loom.time());
    let counted = |frame: usize| loom.frames() + 1 - frame;
    Ok(Looped {
        loom: forward.restore(&looped)?,
        stretch,
        moved,
        bridge: bridged,
        own: match forward.reversed {
            true => (own.1, own.0),
            false => own,
        },
        kept: match forward.reversed {
            true => (counted(kept.1), counted(kept.0)),
            false => kept,
        },
        strangeness: best.strangeness,
        seam: best.seam,
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
            let looped = add_loop(&loom, from, to, times, bridge, &Task::default()).unwrap();
            let (n, longer) = (loom.frames(), looped.loom.frames());
            let pass = (to - from) as usize + looped.bridge;
            assert_eq!(longer, n + times * pass);
            let shift = (times * pass) as f64;
            for frame in (1..=n).map(|frame| frame as f64) {
                let before = loom.at(frame).unwrap();
                // two spans are at most three frames and a half here
                if frame < to - 4.0 {
                    assert_eq!(looped.loom.at(frame).unwrap(), before, "{frame}");
                    assert!(frame > to - 7.0 || frame <= looped.kept.0 as f64);
                }
                if frame > from + 4.0 {
                    assert_eq!(looped.loom.at(frame + shift).unwrap(), before, "{frame}");
                    assert!(frame < from + 7.0 || frame >= looped.kept.1 as f64);
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
        let looped = add_loop(&loom, 10.0, 30.0, 1, Some(0), &Task::default())
            .unwrap()
            .loom;
        assert_eq!(looped.frames(), 60);
        assert_eq!(looped.time().controls().len(), 42 + 20);
        let bridged = add_loop(&loom, 10.0, 30.0, 2, Some(3), &Task::default())
            .unwrap()
            .loom;
        assert_eq!(bridged.frames(), 40 + 2 * 23);
        // three frames take four steps, a span each
        assert_eq!(bridged.time().controls().len(), 42 + 2 * 24);
    }

    #[test]
    fn a_loop_that_closes_shows_no_seam_and_gets_no_bridge() {
        // one turn of the ring takes 20.27 frames
        let looped = add_loop(&ring(10, 60, true), 15.0, 35.0, 2, None, &Task::default()).unwrap();
        assert!(looped.bridge <= 1);
        assert!(looped.seam.worst() < SHOWS, "{:?}", looped.seam);
    }

    #[test]
    fn ends_that_lie_apart_are_bridged() {
        let loom = ring(10, 21, true);
        let bare = add_loop(&loom, 7.0, 15.0, 1, Some(0), &Task::default()).unwrap();
        let bridged = add_loop(&loom, 7.0, 15.0, 1, None, &Task::default()).unwrap();
        assert!(bridged.bridge > 2);
        assert!(bridged.seam.worst() < 0.5 * bare.seam.worst());
        assert_eq!(Warned::from(bare).warnings.len(), 1);
    }

    /// Half an old frame a new one, but for frames 20 to 24: there seven.
    fn rushing() -> Loom {
        let keys = [[1.0, 1.0], [20.0, 10.0], [24.0, 40.0], [64.0, 60.0]];
        retime(&ring(10, 60, true), &keys).unwrap()
    }

    #[test]
    fn a_bridge_leaves_and_meets_the_motion_where_it_is_calm() {
        let loom = rushing();
        let looped = add_loop(&loom, 22.0, 50.0, 1, None, &Task::default()).unwrap();
        assert!(looped.seam.worst() <= SHOWS, "{:?}", looped.seam);
        let (out, back) = looped.own;
        assert!((1..12).contains(&back) && out + back < looped.bridge);
        assert_eq!(looped.loom.frames(), 64 + 28 + looped.bridge);
        // its own frames are the motion's, and so are those of the loop
        assert!(looped.kept.1 <= 22 - back + 4);
        for frame in looped.kept.1..=64 {
            let there = (frame + looped.loom.frames() - 64) as f64;
            assert_eq!(
                looped.loom.at(there).unwrap(),
                loom.at(frame as f64).unwrap()
            );
        }
        let told = Warned::from(looped).warnings;
        let place = format!("comes back to it at {}", 22 - back);
        assert!(told[0].message.contains(&place), "{told:?}");
    }

    #[test]
    fn a_reversed_bridge_is_told_where_it_is() {
        let reversed = reverse(&rushing()).unwrap();
        let looped = add_loop(&reversed, 15.0, 43.0, 1, None, &Task::default()).unwrap();
        let straight = add_loop(&rushing(), 22.0, 50.0, 1, None, &Task::default()).unwrap();
        assert_eq!(looped.own, (straight.own.1, straight.own.0));
        assert_eq!(looped.kept, (65 - straight.kept.1, 65 - straight.kept.0));
        let grown = looped.loom.frames() - 64;
        assert_eq!(grown, 28 + looped.bridge);
        for frame in 1..=looped.kept.0 {
            let t = frame as f64;
            assert_eq!(looped.loom.at(t).unwrap(), reversed.at(t).unwrap());
        }
        for frame in looped.kept.1..=64 {
            let there = (frame + grown) as f64;
            let t = frame as f64;
            assert_eq!(looped.loom.at(there).unwrap(), reversed.at(t).unwrap());
        }
    }

    #[test]
    fn frames_kept_keep_their_bits_where_the_ends_lie_on_knots() {
        // knots at every second frame, and the spans there are cut
        let slow = retime(&ring(10, 45, true), &[[1.0, 1.0], [89.0, 45.0]]).unwrap();
        for (from, to, times, bridge) in [
            (21.0, 61.0, 1, Some(0)),
            (21.0, 61.0, 2, Some(3)),
            (20.0, 62.0, 1, None),
        ] {
            let looped = add_loop(&slow, from, to, times, bridge, &Task::default()).unwrap();
            let x = |loom: &Loom, frame: usize| loom.coordinates_at(frame as f64).unwrap();
            let grown = looped.loom.frames() - 89;
            assert!(looped.kept.0 > 40 && looped.kept.1 < 40);
            for frame in 1..=looped.kept.0 {
                assert_eq!(x(&looped.loom, frame), x(&slow, frame), "{frame}");
            }
            for frame in looped.kept.1..=89 {
                assert_eq!(x(&looped.loom, frame + grown), x(&slow, frame), "{frame}");
            }
        }
    }

    #[test]
    fn a_rest_at_an_end_stays_a_rest() {
        let once = add_loop(
            &ring(10, 45, true),
            12.0,
            31.0,
            1,
            Some(0),
            &Task::default(),
        );
        let resting = crate::edit::hold(&once.unwrap().loom, 31.0, 5).unwrap();
        for (from, to) in [(31.0, 50.0), (33.0, 50.0), (36.0, 50.0), (20.0, 33.0)] {
            let looped = add_loop(&resting, from, to, 1, Some(0), &Task::default()).unwrap();
            let n = looped.loom.frames();
            let grown = n - resting.frames();
            assert_eq!(grown, (to - from) as usize);
            for frame in looped.kept.1..=resting.frames() {
                let there = (frame + grown) as f64;
                let t = frame as f64;
                assert_eq!(
                    looped.loom.at(there).unwrap(),
                    resting.at(t).unwrap(),
                    "{frame}"
                );
            }
        }
    }

    #[test]
    fn a_bridge_of_so_many_frames_goes_where_it_was_asked_to() {
        let looped = add_loop(&rushing(), 22.0, 50.0, 1, Some(9), &Task::default()).unwrap();
        assert_eq!((looped.bridge, looped.own), (9, (0, 0)));
        assert!(looped.seam.worst() > SHOWS);
    }

    #[test]
    fn ends_between_frames_are_moved_by_whole_frames() {
        let loom = rushing();
        for (from, to) in [(1.5, 23.5), (22.25, 63.25), (21.75, 50.75)] {
            let looped = add_loop(&loom, from, to, 1, None, &Task::default()).unwrap();
            let grown = looped.loom.frames() - loom.frames();
            assert_eq!(grown, (to - from) as usize + looped.bridge, "{from}..{to}");
            assert_eq!(looped.stretch, (from, to));
        }
    }

    #[test]
    fn passes_are_alike() {
        let loom = rushing();
        for (from, to) in [(22.0, 50.0), (30.0, 33.0), (12.0, 40.0)] {
            let looped = add_loop(&loom, from, to, 3, None, &Task::default()).unwrap();
            let pass = (to - from) as usize + looped.bridge;
            let at = |frame: usize| looped.loom.coordinates_at(frame as f64).unwrap();
            for frame in from as usize + 1..from as usize + pass {
                let pairs = at(frame + pass).into_iter().zip(at(frame + 2 * pass));
                let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(apart < 1e-9, "{from}..{to}: {frame} {apart}");
            }
        }
    }

    #[test]
    fn root_motion_travels_on_without_a_step() {
        // the same motion from every frame to the next, within a loop, over a seam and a bridge
        let loom = travelling(10, 45);
        for (from, to, bridge) in [(10.0, 30.0, 0), (10.0, 30.0, 3), (10.5, 28.5, 2)] {
            let looped = add_loop(&loom, from, to, 2, Some(bridge), &Task::default())
                .unwrap()
                .loom;
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
        let there = reverse(
            &add_loop(&loom, 12.0, 32.0, 1, None, &Task::default())
                .unwrap()
                .loom,
        )
        .unwrap();
        let here = add_loop(
            &reverse(&loom).unwrap(),
            14.0,
            34.0,
            1,
            None,
            &Task::default(),
        )
        .unwrap();
        assert_eq!(
            (here.loom.time(), here.stretch),
            (there.time(), (14.0, 34.0))
        );
    }

    #[test]
    fn a_retimed_loom_loops_on_its_new_frames() {
        let loom = ring(10, 45, true);
        let slow = retime(&loom, &[[1.0, 1.0], [89.0, 45.0]]).unwrap();
        let looped = add_loop(&slow, 21.0, 61.0, 1, Some(0), &Task::default())
            .unwrap()
            .loom;
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
            assert!(add_loop(&loom, from, to, 1, None, &Task::default()).is_err());
        }
        assert!(add_loop(&loom, 3.0, 9.0, usize::MAX, None, &Task::default()).is_err());
        assert!(add_loop(&loom, 3.0, 9.0, 1, Some(usize::MAX), &Task::default()).is_err());
        for bridge in [None, Some(usize::MAX)] {
            let none = add_loop(&loom, 3.0, 9.0, 0, bridge, &Task::default()).unwrap();
            assert_eq!(none.loom.time(), loom.time());
            assert_eq!((none.bridge, none.kept), (0, (20, 1)));
            assert_eq!(Warned::from(none).warnings, []);
        }
    }

    #[test]
    fn a_cancelled_loop_ends_at_once() {
        let task = Task::default();
        task.cancel();
        let ended = add_loop(&ring(10, 45, false), 12.0, 31.0, 1, None, &task);
        let why = ended.err().map(|why| why.severity);
        assert_eq!(why, Some(crate::diag::Severity::Cancelled));
    }

    #[test]
    fn an_end_that_was_moved_is_told() {
        let loom = ring(10, 45, false);
        let looped = add_loop(&loom, 12.25, 31.5, 1, None, &Task::default()).unwrap();
        assert_eq!((looped.stretch, looped.moved), ((12.25, 31.25), -0.25));
        let told = Warned::from(looped).warnings;
        assert!(told[0].message.contains("from 12.25 to 31.25"), "{told:?}");
        let whole = add_loop(&loom, 12.0, 31.0, 1, None, &Task::default()).unwrap();
        assert_eq!(whole.moved, 0.0);
    }
}
