//! Progress for people, and the time each phase took. The work itself knows no clock: it names its
//! phases and counts its steps, here they are stamped and shown.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde_json::{Map, Value, json};

use super::print;
use crate::task::Observer;

/// Between two lines on a log that is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(5);
/// Work that is done sooner shows no bar: it would only flash.
const BAR_AFTER: Duration = Duration::from_millis(300);
/// How often the bar moves.
const TICK: Duration = Duration::from_millis(100);

/// Watches one run.
pub(super) struct Progress {
    begun: Instant,
    view: View,
    state: Mutex<State>,
}

enum View {
    Bar(Bar),
    Lines,
    Silent,
}

struct State {
    phase: &'static str,
    since: Instant,
    steps: usize,
    done: usize,
    spent: Vec<(&'static str, Duration)>,
    said: Instant,
}

impl Progress {
    /// A bar where stderr is a terminal, lines elsewhere, nothing when `quiet`.
    pub(super) fn begin(quiet: bool) -> Self {
        let view = if quiet {
            View::Silent
        } else if io::stderr().is_terminal() {
            View::Bar(Bar::begin())
        } else {
            View::Lines
        };
        let now = Instant::now();
        Progress {
            begun: now,
            view,
            state: Mutex::new(State {
                phase: "",
                since: now,
                steps: 0,
                done: 0,
                spent: Vec::new(),
                said: now,
            }),
        }
    }

    /// Takes the bar away for good; what is printed next stands alone.
    pub(super) fn end(&self) {
        if let View::Bar(bar) = &self.view {
            bar.end();
        }
    }

    /// Takes the bar away until the next phase.
    pub(super) fn rest(&self) {
        if let View::Bar(bar) = &self.view {
            bar.rest();
        }
    }

    /// Seconds of each of `names`, in that order, and `total` since the start. Phases that did not
    /// happen took 0.
    pub(super) fn seconds(&self, names: &[&str]) -> Value {
        let state = self.state();
        let now = Instant::now();
        let phase = |name: &str| {
            let before = state.spent.iter().filter(|(phase, _)| *phase == name);
            let present = (state.phase == name).then(|| now - state.since);
            before.map(|(_, time)| *time).chain(present).sum()
        };
        let mut seconds: Map<String, Value> = names
            .iter()
            .map(|name| (name.to_string(), micros(phase(name))))
            .collect();
        seconds.insert("total".into(), micros(now - self.begun));
        Value::Object(seconds)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn show(&self, state: &mut State) {
        match &self.view {
            View::Bar(bar) => bar.bar.set_position(state.done as u64),
            View::Lines if state.said.elapsed() >= LINE_EVERY => {
                state.said = Instant::now();
                print::people(&line(state));
            }
            View::Lines | View::Silent => {}
        }
    }
}

impl Observer for Progress {
    fn phase(&self, name: &'static str, steps: usize) {
        let mut state = self.state();
        let now = Instant::now();
        let ended = (state.phase, now - state.since);
        state.spent.push(ended);
        (state.phase, state.since) = (name, now);
        (state.steps, state.done) = (steps, 0);
        if let View::Bar(bar) = &self.view {
            bar.phase(name, steps);
        }
        self.show(&mut state);
    }

    fn step(&self) {
        let mut state = self.state();
        state.done += 1;
        self.show(&mut state);
    }
}

/// A bar that comes late: work that is done before shows none.
struct Bar {
    bar: ProgressBar,
    /// How often the bar went away; whoever wanted it to come before that is too late.
    gone: Arc<Mutex<u64>>,
    /// Nothing is being done until the next phase.
    rests: AtomicBool,
    /// The terminal is somebody else's: it does not come back.
    over: AtomicBool,
}

impl Bar {
    fn begin() -> Self {
        let bar = Bar {
            bar: ProgressBar::hidden(),
            gone: Arc::default(),
            rests: AtomicBool::new(false),
            over: AtomicBool::new(false),
        };
        bar.come();
        bar
    }

    /// Shows itself after a while, unless it goes away before.
    fn come(&self) {
        let (late, gone) = (self.bar.clone(), Arc::clone(&self.gone));
        let count = |gone: &Mutex<u64>| *gone.lock().unwrap_or_else(PoisonError::into_inner);
        let now = count(&gone);
        thread::spawn(move || {
            thread::sleep(BAR_AFTER);
            let gone = gone.lock().unwrap_or_else(PoisonError::into_inner);
            if *gone == now {
                late.set_draw_target(ProgressDrawTarget::stderr());
                late.enable_steady_tick(TICK);
            }
        });
    }

    fn phase(&self, name: &'static str, steps: usize) {
        if self.over.load(Ordering::SeqCst) {
            return;
        }
        if self.rests.swap(false, Ordering::SeqCst) {
            self.come();
        }
        let template = if steps == 0 {
            "{spinner} {msg} {elapsed}"
        } else {
            "{spinner} {msg} {wide_bar} {pos}/{len}, {eta} left"
        };
        let style = ProgressStyle::with_template(template);
        self.bar
            .set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        self.bar.reset();
        self.bar.set_length(steps as u64);
        self.bar.set_message(name);
    }

    fn rest(&self) {
        if !self.rests.swap(true, Ordering::SeqCst) {
            self.leave();
        }
    }

    fn end(&self) {
        self.over.store(true, Ordering::SeqCst);
        self.leave();
    }

    fn leave(&self) {
        *self.gone.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        self.bar.finish_and_clear();
        self.bar.set_draw_target(ProgressDrawTarget::hidden());
    }
}

/// `pose: 120 of 400, 12 s left`.
fn line(state: &State) -> String {
    let (done, steps) = (state.done, state.steps);
    if steps == 0 || done == 0 {
        return format!("{} ..", state.phase);
    }
    let left =
        state.since.elapsed().as_secs_f64() * steps.saturating_sub(done) as f64 / done as f64;
    format!("{}: {done} of {steps}, {left:.0} s left", state.phase)
}

/// Seconds to the microsecond.
fn micros(time: Duration) -> Value {
    json!((time.as_secs_f64() * 1e6).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_that_return_are_added_and_missing_ones_are_zero() {
        let progress = Progress::begin(true);
        for name in ["load", "pose", "load", "time"] {
            progress.phase(name, 1);
            progress.step();
        }
        let seconds = progress.seconds(&["load", "pose", "shape"]);
        let parts: f64 = ["load", "pose"]
            .map(|name| seconds[name].as_f64().unwrap())
            .iter()
            .sum();
        assert!(parts <= seconds["total"].as_f64().unwrap() + 2e-6);
        assert_eq!(seconds["shape"], 0.0);
        assert!(seconds.get("time").is_none());
        assert_eq!(progress.state().spent.len(), 4);
    }

    #[test]
    fn a_line_says_how_far_and_how_long() {
        let progress = Progress::begin(true);
        progress.phase("pose", 4);
        assert_eq!(line(&progress.state()), "pose ..");
        progress.step();
        assert!(line(&progress.state()).starts_with("pose: 1 of 4, 0 s left"));
    }
}
