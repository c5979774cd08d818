//! Which times to sample, and a loom as the frames at those times.
//!
//! A loom of n frames lives on times [1, n]; frame i of the capture is at time i.

use std::fmt;
use std::io;
use std::str::FromStr;
use std::sync::{Arc, Mutex, PoisonError};

use crate::diag::{Diagnostic, Result};
use crate::loom::{Loom, Scratch};
use crate::mesh::{FrameSource, Topology};

/// How far, in steps, a time may lie from an end and still hit it.
const HIT: f64 = 1e-9;
/// More frames than this are taken for a slip of the keyboard: two days of 60 frames a second.
const MOST_TIMES: f64 = 1e7;

/// Which times are wanted.
#[derive(Debug, Clone, Default, PartialEq)]
pub enum Times {
    /// 1, 2, .., n: the frames of the capture.
    #[default]
    Integers,
    /// This many times, evenly over [1, n], both ends among them; 1 is the first time alone.
    Count(usize),
    /// This many times as many frames a second: steps of 1/rate from 1 on, as far as n.
    Rate(f64),
    /// As many frames a second, for a loom that knows its own: `floor((n-1) r/fps + 1e-9) + 1` frames
    /// at `1 + i fps/r`.
    PerSecond(f64),
    /// Exactly these, in any order.
    List(Vec<f64>),
    /// From `start` in steps as far as `end`, which is among them when a step hits it (to 1e-9 steps).
    Steps {
        /// The first time.
        start: f64,
        /// No time is beyond this.
        end: f64,
        /// Between two times, above 0.
        step: f64,
    },
}

/// Times within a loom, and the rate at which frames taken there are to be played.
#[derive(Debug, Clone, PartialEq)]
pub struct Sampling {
    /// The times.
    pub times: Vec<f64>,
    /// Frames per second at which the motion keeps its speed: a finer sampling plays faster. A
    /// [`Times::List`] has no step of its own and keeps the loom's rate. `None` where the loom has none.
    pub fps: Option<f64>,
}

impl Times {
    /// The times within a loom of `frames` frames, played at `fps`.
    ///
    /// # Errors
    /// A time outside [1, n], a rate in seconds of a loom without one, no frames at all, or more than
    /// ten million.
    pub fn over(&self, frames: usize, fps: Option<f64>) -> Result<Sampling> {
        self.check()?;
        let intervals = frames.saturating_sub(1);
        let at_rate = |rate: f64| steps(1.0, frames as f64, intervals as f64 * rate, |i| i / rate);
        let played = |rate: f64| fps.map(|fps| fps * rate);
        let sampling = |times, fps| Sampling { times, fps };
        match self {
            Times::Integers => Ok(sampling((1..=frames).map(|i| i as f64).collect(), fps)),
            Times::Count(count) => {
                let times = evenly(intervals, *count)?;
                let spans = count.saturating_sub(1);
                let finer = spans as f64 / intervals as f64;
                let stretched = spans > 0 && intervals > 0;
                Ok(sampling(times, if stretched { played(finer) } else { fps }))
            }
            Times::Rate(rate) => Ok(sampling(at_rate(*rate)?, played(*rate))),
            Times::PerSecond(wanted) => {
                let fps = fps.ok_or_else(no_rate)?;
                let count = intervals as f64 * wanted / fps;
                let times = steps(1.0, frames as f64, count, |i| i * fps / wanted)?;
                Ok(sampling(times, Some(*wanted)))
            }
            Times::List(times) => {
                within(times, frames)?;
                Ok(sampling(times.clone(), fps))
            }
            Times::Steps { start, end, step } => {
                within(&[*start, *end], frames)?;
                let times = steps(*start, *end, (end - start) / step, |i| i * step)?;
                Ok(sampling(times, played(1.0 / step)))
            }
        }
    }

    /// The times of a motion that is defined beyond its ends `first` and `last` too: lists and steps may
    /// leave them. A rate counts frames to the unit of time; in seconds there is none.
    ///
    /// # Errors
    /// No frames at all, or more than ten million; a number of frames a second.
    pub fn between(&self, first: f64, last: f64) -> Result<Vec<f64>> {
        self.check()?;
        let span = last - first;
        match self {
            Times::Integers => steps(first, last, span, |i| i),
            Times::Count(count) => {
                let spans = count.saturating_sub(1).max(1) as f64;
                let shares = evenly(1, *count)?;
                let time = |i: usize| match i as f64 == spans {
                    true => last,
                    false => first + span * (i as f64 / spans),
                };
                Ok((0..shares.len()).map(time).collect())
            }
            Times::Rate(rate) => steps(first, last, span * rate, |i| i / rate),
            Times::PerSecond(_) => Err(no_rate()),
            Times::List(times) => Ok(times.clone()),
            Times::Steps { start, end, step } => {
                steps(*start, *end, (end - start) / step, |i| i * step)
            }
        }
    }

    /// Rates and steps are above 0.
    fn check(&self) -> Result<()> {
        match *self {
            Times::Rate(number) | Times::PerSecond(number) | Times::Steps { step: number, .. }
                if !(number > 0.0 && number.is_finite()) =>
            {
                Diagnostic::error(format!("a rate or step of {number} gives no times"))
                    .hint("rates and steps are above 0")
                    .err()
            }
            _ => Ok(()),
        }
    }
}

/// A loom as the frames at chosen times. Nothing is computed before a frame is asked for, and frames may
/// be asked for from several threads.
pub struct Sampled {
    loom: Loom,
    sampling: Sampling,
    /// Memory of the evaluations that are not going on just now.
    idle: Mutex<Vec<Scratch>>,
}

impl Sampled {
    /// `loom` at the times of `sampling`.
    pub fn new(loom: Loom, sampling: Sampling) -> Self {
        Sampled {
            loom,
            sampling,
            idle: Mutex::default(),
        }
    }

    /// The frames that the capture had: `loom` at 1, 2, .., n.
    pub fn integers(loom: Loom) -> Self {
        let times = (1..=loom.frames()).map(|i| i as f64).collect();
        let fps = loom.fps();
        Sampled::new(loom, Sampling { times, fps })
    }

    /// The loom that is sampled.
    pub fn loom(&self) -> &Loom {
        &self.loom
    }

    /// The time of every frame.
    pub fn times(&self) -> &[f64] {
        &self.sampling.times
    }
}

impl fmt::Debug for Sampled {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sampled")
            .field("sampling", &self.sampling)
            .finish_non_exhaustive()
    }
}

impl FrameSource for Sampled {
    fn topology(&self) -> &Arc<Topology> {
        self.loom.topology()
    }

    fn frames(&self) -> usize {
        self.sampling.times.len()
    }

    fn fps(&self) -> Option<f64> {
        self.sampling.fps
    }

    fn read_frame(&self, frame: usize, positions: &mut [f32]) -> io::Result<()> {
        let idle = || self.idle.lock().unwrap_or_else(PoisonError::into_inner);
        let mut scratch = idle().pop().unwrap_or_default();
        let time = self.sampling.times[frame];
        let evaluated = self.loom.evaluate(time, &mut scratch, positions);
        idle().push(scratch);
        evaluated.map_err(io::Error::other)
    }
}

/// `start + offset(i)` for i = 0 .. `count` intervals; what comes within [`HIT`] of `end` is `end`.
fn steps(start: f64, end: f64, count: f64, offset: impl Fn(f64) -> f64) -> Result<Vec<f64>> {
    let last = (count + HIT).floor();
    if last.is_nan() || last >= MOST_TIMES {
        return too_many(last + 1.0).err();
    }
    let hit = (count - last).abs() <= HIT;
    let mut times: Vec<f64> = (0..=last as usize)
        .map(|i| (start + offset(i as f64)).min(end))
        .collect();
    if let Some(time) = times.last_mut().filter(|_| hit) {
        *time = end;
    }
    Ok(times)
}

/// `count` times over 1 ..= 1 + `intervals`. The product is taken before the quotient, so that every
/// whole time among them is met exactly.
fn evenly(intervals: usize, count: usize) -> Result<Vec<f64>> {
    if count == 0 {
        return Diagnostic::error("0 frames are asked for")
            .hint("ask for at least 1")
            .err();
    }
    if count as f64 > MOST_TIMES {
        return too_many(count as f64).err();
    }
    let spans = count.saturating_sub(1).max(1) as f64;
    let time = |i: usize| 1.0 + i as f64 * intervals as f64 / spans;
    Ok((0..count).map(time).collect())
}

fn within(times: &[f64], frames: usize) -> Result<()> {
    let last = frames as f64;
    match times.iter().find(|&&time| !(1.0 <= time && time <= last)) {
        None => Ok(()),
        Some(time) => Diagnostic::error(format!("time {time} is outside [1, {frames}]"))
            .hint(format!(
                "this loom has {frames} frames, at times 1 to {frames}"
            ))
            .err(),
    }
}

fn too_many(count: f64) -> Diagnostic {
    Diagnostic::error(format!("{count:.0} frames are asked for")).hint(format!(
        "at most {MOST_TIMES:.0} are made at once; take a larger step"
    ))
}

fn no_rate() -> Box<Diagnostic> {
    Diagnostic::error("the loom does not know its frames per second")
        .hint("give them when fitting: `fit --fps F`; or sample with --rate, --frames or --times")
        .into()
}

/// What is wrong with the text of a [`Times`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TimesError(String);

impl fmt::Display for TimesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for TimesError {}

/// `1,2.5,4` or `START:END:STEP` (START:END steps by 1).
impl FromStr for Times {
    type Err = TimesError;

    fn from_str(text: &str) -> std::result::Result<Self, TimesError> {
        let number = |text: &str| match text.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(TimesError(format!("`{}` is not a time", text.trim()))),
        };
        if !text.contains(':') {
            let times: std::result::Result<_, _> = text.split(',').map(number).collect();
            return times.map(Times::List);
        }
        let parts: Vec<f64> = text
            .split(':')
            .map(number)
            .collect::<std::result::Result<_, _>>()?;
        let (start, end, step) = match parts[..] {
            [start, end] => (start, end, 1.0),
            [start, end, step] => (start, end, step),
            _ => return Err(TimesError("a span of times is START:END:STEP".into())),
        };
        if step <= 0.0 {
            return Err(TimesError("the step of a span of times is above 0".into()));
        }
        if end < start {
            return Err(TimesError(format!("time {end} comes before time {start}")));
        }
        Ok(Times::Steps { start, end, step })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::{ring, travelling};

    #[test]
    fn times_between_any_ends_meet_them_and_may_leave_them() {
        let between = |times: Times| times.between(-0.5, 2.5).unwrap();
        assert_eq!(between(Times::Integers), [-0.5, 0.5, 1.5, 2.5]);
        assert_eq!(between(Times::Count(3)), [-0.5, 1.0, 2.5]);
        assert_eq!(between(Times::Count(1)), [-0.5]);
        assert_eq!(between(Times::List(vec![9.0, -3.0])), [9.0, -3.0]);
        assert_eq!(between("4:5:0.5".parse().unwrap()), [4.0, 4.5, 5.0]);
        assert!(Times::Count(0).between(0.0, 1.0).is_err());
    }

    #[test]
    fn frames_are_the_loom_at_their_times() {
        let loom = travelling(40, 12);
        let sampling = Times::Rate(3.0).over(12, loom.fps()).unwrap();
        let frames = Sampled::new(loom.clone(), sampling);
        assert_eq!((frames.frames(), frames.fps()), (34, Some(72.0)));
        let mut positions = vec![0.0; 120];
        for (frame, &time) in frames.times().iter().enumerate() {
            frames.read_frame(frame, &mut positions).unwrap();
            assert_eq!(positions, loom.at(time).unwrap(), "at {time}");
        }
        assert_eq!(Sampled::integers(ring(5, 9, true)).times(), times("1:9", 9));
    }

    fn times(text: &str, frames: usize) -> Vec<f64> {
        let times: Times = text.parse().unwrap();
        times.over(frames, None).unwrap().times
    }

    #[test]
    fn spans_include_an_end_that_is_hit() {
        assert_eq!(times("1:3:0.5", 3), [1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!(times("1:3:0.8", 3), [1.0, 1.8, 2.6]);
        assert_eq!(times("2:2:1", 3), [2.0]);
        assert_eq!(times("1:3", 3), [1.0, 2.0, 3.0]);
        // A step that is not representable: 23 / 0.1 is 230 only to rounding.
        let tenths = times("1:24:0.1", 24);
        assert_eq!((tenths.len(), tenths.last()), (231, Some(&24.0)));
    }

    #[test]
    fn counts_cover_both_ends_and_meet_whole_times() {
        let over = |count, frames| Times::Count(count).over(frames, Some(24.0)).unwrap();
        assert_eq!(over(5, 3).times, [1.0, 1.5, 2.0, 2.5, 3.0]);
        assert_eq!(over(5, 3).fps, Some(48.0));
        assert_eq!(over(1, 3).times, [1.0]);
        assert_eq!(over(3, 1).times, [1.0, 1.0, 1.0]);
        let thirds = over(3 * 100 + 1, 101).times;
        let whole: Vec<f64> = thirds.iter().copied().step_by(3).collect();
        assert_eq!(whole, (1..=101).map(f64::from).collect::<Vec<_>>());
    }

    #[test]
    fn rates_keep_the_speed_of_the_motion() {
        let double = Times::Rate(2.0).over(3, Some(24.0)).unwrap();
        assert_eq!((double.times.len(), double.fps), (5, Some(48.0)));
        // MATHS §1: floor((n-1) r/fps + 1e-9) + 1 frames at 1 + i fps/r; duration (n-1)/fps.
        let film = Times::PerSecond(30.0).over(49, Some(24.0)).unwrap();
        assert_eq!((film.times.len(), film.fps), (61, Some(30.0)));
        assert_eq!(film.times[5], 5.0);
        let ntsc = Times::PerSecond(24.0 / 1.001).over(25, Some(24.0)).unwrap();
        assert_eq!(ntsc.times.len(), 24);
        assert!(*ntsc.times.last().unwrap() < 25.0);
        let same = Times::PerSecond(24.0).over(25, Some(24.0)).unwrap();
        assert_eq!(same.times, Times::Integers.over(25, None).unwrap().times);
    }

    #[test]
    fn every_rate_gives_the_frames_that_the_duration_holds() {
        // as fractions, so that the counts are exact: 23.976 stands for 24000/1001, and so on
        let rates: [(u64, u64); 9] = [
            (24_000, 1001),
            (24, 1),
            (25, 1),
            (30_000, 1001),
            (30, 1),
            (48, 1),
            (50, 1),
            (60_000, 1001),
            (60, 1),
        ];
        for (from, from_by) in rates {
            for (to, to_by) in rates {
                for n in [1, 2, 24, 49, 1001, 1002] {
                    let fps = from as f64 / from_by as f64;
                    let wanted = to as f64 / to_by as f64;
                    let sampling = Times::PerSecond(wanted).over(n, Some(fps)).unwrap();
                    // floor((n - 1) r / fps) + 1 in whole numbers
                    let spans = (n as u64 - 1) * to * from_by / (to_by * from);
                    assert_eq!(sampling.times.len() as u64, spans + 1, "{n} {fps} {wanted}");
                    let last = sampling.times[sampling.times.len() - 1];
                    assert!(last <= n as f64 && last > n as f64 - fps / wanted - 1e-6);
                    assert_eq!((sampling.times[0], sampling.fps), (1.0, Some(wanted)));
                }
            }
        }
    }

    #[test]
    fn what_is_outside_is_an_error_that_names_the_bound() {
        for (text, frames) in [("0.5", 24), ("1,25", 24), ("1:24.5:0.5", 24), ("0:3:1", 24)] {
            let error = text
                .parse::<Times>()
                .unwrap()
                .over(frames, None)
                .unwrap_err();
            assert!(error.message.contains("outside [1, 24]"), "{text}: {error}");
            assert!(!error.hints.is_empty());
        }
    }

    #[test]
    fn seconds_need_a_rate() {
        let error = Times::PerSecond(30.0).over(24, None).unwrap_err();
        assert!(error.hints[0].contains("--fps"));
        assert_eq!(Times::Rate(2.0).over(24, None).unwrap().fps, None);
    }

    #[test]
    fn absurd_numbers_of_frames_are_refused() {
        let tiny: Times = "1:24:1e-12".parse().unwrap();
        for times in [
            tiny,
            Times::Count(usize::MAX),
            Times::Rate(1e300),
            Times::Count(0),
            Times::Rate(0.0),
            Times::PerSecond(f64::NAN),
        ] {
            assert!(times.over(24, None).is_err(), "{times:?}");
        }
    }

    #[test]
    fn texts_that_are_no_times_are_refused() {
        for text in [
            "", "a", "nan", "1:inf:1", "1:2:0", "1:2:-1", "3:1:1", "1:2:3:4", "1,,2",
        ] {
            assert!(text.parse::<Times>().is_err(), "{text}");
        }
    }
}
