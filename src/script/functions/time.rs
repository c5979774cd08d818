//! When things happen: loops, retimes, resampling.

use rhai::plugin::*;
use rhai::{Array, Engine, FnPtr, Map};

use crate::diag::Diagnostic;
use crate::pipeline::{Edit, Frames, LoomValue, Sketch, Times};
use crate::script::arguments::{Options, Raw, count, number, numbers, points};
use crate::script::context::Context;
use crate::script::diagnostics::{pass, raise};

/// Times to sample a loom at, not yet bound to one.
#[derive(Debug, Clone)]
pub(in crate::script) struct Clock(pub(super) Times);

pub(super) fn register(engine: &mut Engine) {
    engine.register_global_module(exported_module!(functions).into());
}

/// `loom` after `edit`, its warnings noted.
pub(super) fn edited(call: &NativeCallContext, loom: &LoomValue, edit: &Edit) -> Raw<LoomValue> {
    let context = Context::of(call)?;
    let edited = pass(context.bench().edit(loom, edit))?;
    Ok(context.warned(edited))
}

/// Samples of a script's function at most this many: one for every 1/16 of a frame of the longest loom
/// that stays legible.
const CLOSURE_SAMPLES: usize = 100_000;

/// What a retime's closure gives at every 1/8 of an output frame; the output lasts as long as the loom.
fn sampled(call: &NativeCallContext, loom: &LoomValue, closure: &FnPtr) -> Raw<Vec<[f64; 2]>> {
    let frames = loom.loom.value.frames();
    let samples = 8 * frames.saturating_sub(1) + 1;
    if samples > CLOSURE_SAMPLES {
        return raise(
            Diagnostic::error(format!(
                "a loom of {frames} frames is too long to retime by a function"
            ))
            .hint("give keys: [[out, in], ..]"),
        );
    }
    let at = |index: usize| {
        let out = 1.0 + index as f64 / 8.0;
        let source: Dynamic = closure.call_within_context(call, (out,))?;
        Ok([out, number(&source, "what the function gives")?])
    };
    (0..samples).map(at).collect()
}

fn keys(value: &Dynamic) -> Raw<Vec<[f64; 2]>> {
    points(value, "a key [out, in]")
}

fn sketch(curve: Option<&str>) -> Raw<Sketch> {
    match curve {
        None | Some("through") => Ok(Sketch::Through),
        Some("controls") => Ok(Sketch::Controls),
        Some(other) => raise(
            Diagnostic::error(format!("no curve `{other}`"))
                .hint("the points are passed (\"through\") or are its \"controls\""),
        ),
    }
}

#[export_module]
mod functions {
    /// Plays [a, b] more often: `times` more passes, the default one.
    ///
    /// `loom.add_loop(a, b)`, `loom.add_loop(a, b, #{ times, bridge })`
    ///
    /// a and b are times in frames; b is moved so that the loop takes whole frames (a warning tells where
    /// to), and knots are put at both. n grows by the frames inside and the bridges. Where the ends lie apart,
    /// `bridge` frames go between two passes (default: the distance over the local speed, and more until
    /// the seam does not show and its shapes are like the motion's own; 0: none). Frames more than three spans
    /// from a seam keep their bits; where no bridge meets the motion so, the default turns more of it, or
    /// leaves it later and comes back earlier, where it is calm, which a warning tells.
    ///
    /// ```rhai
    /// let walk = fit(demo("gallop"), #{ tolerance: 0.05 });
    /// check(walk.add_loop(4, 16, #{ times: 2 }).frames > walk.frames, "n grows");
    /// ```
    #[rhai_fn(name = "add_loop", return_raw)]
    pub fn add_loop(
        call: NativeCallContext,
        loom: LoomValue,
        a: Dynamic,
        b: Dynamic,
    ) -> Raw<LoomValue> {
        add_loop_with(call, loom, a, b, Map::new())
    }

    #[rhai_fn(name = "add_loop", return_raw)]
    pub fn add_loop_with(
        call: NativeCallContext,
        loom: LoomValue,
        a: Dynamic,
        b: Dynamic,
        options: Map,
    ) -> Raw<LoomValue> {
        let options = Options::new(options, &["times", "bridge"])?;
        let edit = Edit::AddLoop {
            from: number(&a, "a")?,
            to: number(&b, "b")?,
            times: options.count("times", 0)?.unwrap_or(1),
            bridge: options.count("bridge", 0)?,
        };
        edited(&call, &loom, &edit)
    }

    /// Finds the loop whose seam shows least: gives [a, b].
    ///
    /// `loom.find_loop()`, `loom.find_loop(shortest, longest)`
    ///
    /// Loops take whole frames, from `shortest` to `longest` of them (an eighth of the motion to all of
    /// it). Ends are alike in shape and in speed, wherever the body has travelled.
    ///
    /// ```rhai
    /// let gallop = fit(demo("gallop"), #{ tolerance: 0.05 });
    /// let ends = gallop.find_loop(20, 40);
    /// check(seam(gallop, ends[0], ends[1]).worst <= 1.5, "it closes");
    /// check(gallop.add_loop(ends[0], ends[1]).frames > 80, "a stride more");
    /// ```
    #[rhai_fn(name = "find_loop", return_raw)]
    pub fn find_loop(call: NativeCallContext, loom: LoomValue) -> Raw<Array> {
        let n = loom.loom.value.frames();
        find_loop_of(
            call,
            loom,
            Dynamic::from((n / 8).max(1) as i64),
            Dynamic::from(n as i64),
        )
    }

    #[rhai_fn(name = "find_loop", return_raw)]
    pub fn find_loop_of(
        call: NativeCallContext,
        loom: LoomValue,
        shortest: Dynamic,
        longest: Dynamic,
    ) -> Raw<Array> {
        let lengths = (
            count(&shortest, "shortest", 1)?,
            count(&longest, "longest", 1)?,
        );
        let found = Context::of(&call)?
            .bench()
            .find_loop(&loom, lengths.0, lengths.1);
        Ok(pass(found)?.map(Dynamic::from).to_vec())
    }

    /// Continues past the end: along the last speed, or around the loop if the ends meet.
    ///
    /// The map ends with its curve: a warning names the frame from which shapes look strange.
    ///
    /// `loom.extend(frames)`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.extend(5).frames == bar.frames + 5, "five frames more");
    /// ```
    #[rhai_fn(name = "extend", return_raw)]
    pub fn extend(call: NativeCallContext, loom: LoomValue, frames: Dynamic) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::Extend {
                frames: count(&frames, "frames", 0)?,
            },
        )
    }

    /// Keeps the times [a, b].
    ///
    /// `loom.trim(a, b)`
    ///
    /// a and b are times in frames, from 1; n becomes floor(b - a) + 1.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.trim(3, 8).frames == 6, "3, 4, .., 8");
    /// ```
    #[rhai_fn(name = "trim", return_raw)]
    pub fn trim(
        call: NativeCallContext,
        loom: LoomValue,
        a: Dynamic,
        b: Dynamic,
    ) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::Trim {
                from: number(&a, "a")?,
                to: number(&b, "b")?,
            },
        )
    }

    /// Turns time backwards.
    ///
    /// `loom.reverse()`
    ///
    /// Twice is the identity, bit for bit.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.reverse().frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "reverse", return_raw)]
    pub fn reverse(call: NativeCallContext, loom: LoomValue) -> Raw<LoomValue> {
        edited(&call, &loom, &Edit::Reverse)
    }

    /// Stays at psi(t) for that many frames more.
    ///
    /// `loom.hold(t, frames)`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.hold(4, 10).frames == bar.frames + 10, "ten frames more");
    /// ```
    #[rhai_fn(name = "hold", return_raw)]
    pub fn hold(
        call: NativeCallContext,
        loom: LoomValue,
        t: Dynamic,
        frames: Dynamic,
    ) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::Hold {
                time: number(&t, "t")?,
                frames: count(&frames, "frames", 0)?,
            },
        )
    }

    /// Plays [a, b] `x` times as fast, eased over a frame at its ends.
    ///
    /// `loom.speed(a, b, x)`
    ///
    /// n changes, the frame rate does not. x is above 0.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.speed(3, 8, 0.5).frames > bar.frames, "slower is longer");
    /// ```
    #[rhai_fn(name = "speed", return_raw)]
    pub fn speed(
        call: NativeCallContext,
        loom: LoomValue,
        a: Dynamic,
        b: Dynamic,
        x: Dynamic,
    ) -> Raw<LoomValue> {
        let edit = Edit::Speed {
            from: number(&a, "a")?,
            to: number(&b, "b")?,
            factor: number(&x, "x")?,
        };
        edited(&call, &loom, &edit)
    }

    /// Shows at each output time another source time.
    ///
    /// `loom.retime([[out, in], ..])`, `loom.retime(|t| ..)`
    ///
    /// Keys are joined by a monotone cubic; the last output time is the new n. A function is asked at every
    /// eighth of a frame of [1, n].
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.retime([[1, 1], [2 * bar.frames - 1, bar.frames]]).frames == 2 * bar.frames - 1, "half as fast");
    /// check(bar.retime(|t| t).frames == bar.frames, "the identity");
    /// ```
    #[rhai_fn(name = "retime", return_raw)]
    pub fn retime(call: NativeCallContext, loom: LoomValue, keys: Array) -> Raw<LoomValue> {
        edited(
            &call,
            &loom,
            &Edit::Retime {
                keys: super::keys(&keys.into())?,
            },
        )
    }

    #[rhai_fn(name = "retime", return_raw)]
    pub fn retime_by(call: NativeCallContext, loom: LoomValue, closure: FnPtr) -> Raw<LoomValue> {
        let keys = sampled(&call, &loom, &closure)?;
        edited(&call, &loom, &Edit::Retime { keys })
    }

    /// Straightens [a, b] towards the curve of least bending.
    ///
    /// `loom.smooth(a, b, amount)`
    ///
    /// amount is 0 (nothing) to 1 (the least-bending curve through the ends).
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.smooth(1, bar.frames, 0.5).frames == bar.frames, "as many frames");
    /// ```
    #[rhai_fn(name = "smooth", return_raw)]
    pub fn smooth(
        call: NativeCallContext,
        loom: LoomValue,
        a: Dynamic,
        b: Dynamic,
        amount: Dynamic,
    ) -> Raw<LoomValue> {
        let edit = Edit::Smooth {
            from: number(&a, "a")?,
            to: number(&b, "b")?,
            amount: number(&amount, "amount")?,
        };
        edited(&call, &loom, &edit)
    }

    /// A new motion: a curve sketched in the map of poses.
    ///
    /// `loom.path([[x, y], ..])`, `loom.path([[x, y], ..], #{ frames, curve })`
    ///
    /// The points are in layout units. The motion passes them in order; with curve "controls" they are the
    /// control points of a cubic B-spline with uniform knots (at least four), smooth however they lie.
    /// frames is as many as before where it is not given. Root motion is dropped.
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// let sketch = bar.path([[0, 0], [0.1, 0], [0.2, 0.1], [0, 0.1]]);
    /// check(sketch.frames == bar.frames, "it moves elsewhere");
    /// let swing = [[0, 0], [0.1, 0], [0.2, 0.1], [0.1, 0], [0, 0]];
    /// check(bar.path(swing, #{ frames: 60, curve: "controls" }).frames == 60, "as long as you like");
    /// ```
    #[rhai_fn(name = "path", return_raw)]
    pub fn path(call: NativeCallContext, loom: LoomValue, points: Array) -> Raw<LoomValue> {
        path_with(call, loom, points, Map::new())
    }

    #[rhai_fn(name = "path", return_raw)]
    pub fn path_with(
        call: NativeCallContext,
        loom: LoomValue,
        points: Array,
        options: Map,
    ) -> Raw<LoomValue> {
        let options = Options::new(options, &["frames", "curve"])?;
        let edit = Edit::Path {
            points: super::points(&points.into(), "a point")?,
            sketch: super::sketch(options.word("curve")?.as_deref())?,
            frames: options.count("frames", 1)?,
        };
        edited(&call, &loom, &edit)
    }

    /// Frames of a loom at chosen times.
    ///
    /// `loom.resample(fps(r))`, `loom.resample(frames(n))`, `loom.resample(rate(x))`, `loom.resample(times([..]))`
    ///
    /// ```rhai
    /// let bar = fit(demo("bar"), #{ tolerance: 0.05 });
    /// check(bar.resample(frames(7)).frames == 7, "both ends and five between");
    /// check(bar.resample(rate(2)).frames == 2 * bar.frames - 1, "twice as many");
    /// ```
    #[rhai_fn(name = "resample", return_raw)]
    pub fn resample(call: NativeCallContext, loom: LoomValue, clock: Clock) -> Raw<Frames> {
        pass(Context::of(&call)?.bench().sample(&loom, &clock.0))
    }

    /// As many frames a second, for `resample`; needs a loom that knows its own rate.
    ///
    /// `fps(r)`
    ///
    /// ```rhai
    /// check(fit(demo("bar"), #{ tolerance: 0.05, fps: 24 }).resample(fps(48)).frames > 1, "twice as many");
    /// ```
    #[rhai_fn(name = "fps", return_raw)]
    pub fn fps(rate: Dynamic) -> Raw<Clock> {
        Ok(Clock(Times::PerSecond(number(&rate, "the rate")?)))
    }

    /// That many frames from the first time to the last, for `resample`.
    ///
    /// `frames(n)`
    ///
    /// ```rhai
    /// check(fit(demo("bar"), #{ tolerance: 0.05 }).resample(frames(3)).frames == 3, "three");
    /// ```
    #[rhai_fn(name = "frames", return_raw)]
    pub fn frames(n: Dynamic) -> Raw<Clock> {
        Ok(Clock(Times::Count(count(&n, "n", 1)?)))
    }

    /// x times as many frames, for `resample`.
    ///
    /// `rate(x)`
    ///
    /// ```rhai
    /// check(fit(demo("bar"), #{ tolerance: 0.05 }).resample(rate(0.5)).frames > 1, "every second");
    /// ```
    #[rhai_fn(name = "rate", return_raw)]
    pub fn rate(x: Dynamic) -> Raw<Clock> {
        Ok(Clock(Times::Rate(number(&x, "x")?)))
    }

    /// Exactly these times, in frames from 1, for `resample`.
    ///
    /// `times([t, ..])`
    ///
    /// ```rhai
    /// check(fit(demo("bar"), #{ tolerance: 0.05 }).resample(times([1, 1.5, 2])).frames == 3, "three");
    /// ```
    #[rhai_fn(name = "times", return_raw)]
    pub fn times(list: Array) -> Raw<Clock> {
        Ok(Clock(Times::List(numbers(&list.into(), "a time")?)))
    }
}
