//! What is in hand between taking it and letting it go.

use crate::edit::{Edit, Sketch};
use crate::loom::Loom;
use crate::recipe::gesture::{Gesture, retime_keys};
use crate::recipe::{Param, Setting};
use crate::signal::warp::{Keys, Warp};
use crate::tui::state::{Content, State};

use super::keys::KeyHeld;
use super::trial::{Base, Pinning, Try, What};
use super::{Errand, sliders};
use crate::tui::event::Command;
use crate::tui::panels::map;

/// What is in hand.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) enum Held {
    /// A control point (from 0) of the time signal.
    Control(usize, Spot),
    /// A frame (from 0) of the map.
    Pin(usize, Spot),
    /// A moment, taken to another time.
    Moment(Moment),
    /// Points of a new curve, and whether the mouse draws it.
    Sketch(Vec<[f64; 2]>, bool),
    /// A parameter and the value that it is being given.
    Slider(Param, Setting),
    /// A stretch of time that is being marked, from here.
    Marks(f64),
    /// A key pose.
    Key(KeyHeld),
}

/// A place of the map, and whether it is another than at first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::tui) struct Spot {
    pub(in crate::tui) at: [f64; 2],
    pub(in crate::tui) moved: bool,
}

/// A key of a retime in hand.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) struct Moment {
    /// Output time and source time.
    keys: Vec<[f64; 2]>,
    /// Which of them.
    key: usize,
    /// Whether the recipe ends in these keys already.
    again: bool,
    moved: bool,
}

/// Keys of a retime stay this far from each other, in frames.
const APART: f64 = 0.25;
/// A key this near is taken instead of making another, in frames.
const NEAR: f64 = 0.5;

impl Moment {
    /// The moment at output time `t` of `loom`, which `recipe` gave. None for the first moment, which
    /// stays the first.
    pub(in crate::tui) fn at(loom: &Loom, recipe: &str, t: f64) -> Option<Self> {
        let n = loom.frames() as f64;
        let ends_warped = !loom.time().warps().is_empty();
        let known = retime_keys(recipe).filter(|_| ends_warped);
        let again = known.is_some();
        let mut keys = known.unwrap_or_else(|| vec![[1.0, 1.0], [n, n]]);
        let near = |[out, _]: &[f64; 2]| (out - t).abs() <= NEAR;
        let key = match keys.iter().position(near) {
            Some(key) => key,
            None => {
                let source = source(&keys, t)?;
                let key = keys.partition_point(|[out, _]| *out < t);
                keys.insert(key, [t, source]);
                key
            }
        };
        (key > 0).then_some(Moment {
            keys,
            key,
            again,
            moved: false,
        })
    }

    /// When it is now.
    pub(in crate::tui) fn time(&self) -> f64 {
        self.keys[self.key][0]
    }

    /// Takes it to an output time, between its neighbours; the last one to a whole number.
    fn to(&mut self, t: f64) {
        let least = self.keys[self.key - 1][0] + APART;
        let t = match self.keys.get(self.key + 1) {
            Some(next) => t.clamp(least, (next[0] - APART).max(least)),
            None => t.round().max(least.ceil()),
        };
        self.moved |= t != self.time();
        self.keys[self.key][0] = t;
    }
}

/// What keys show at an output time.
fn source(keys: &[[f64; 2]], t: f64) -> Option<f64> {
    let column = |axis: usize| keys.iter().map(|key| key[axis]).collect();
    let keys = Keys::monotone(column(0), column(1)).ok()?;
    Some(Warp::Keys(keys).at(t).0)
}

impl Spot {
    /// Where it has not been moved from yet.
    pub(in crate::tui) fn still(at: [f64; 2]) -> Self {
        Spot { at, moved: false }
    }

    fn to(&mut self, at: [f64; 2]) {
        self.moved |= at != self.at;
        self.at = at;
    }
}

impl Held {
    /// Whether letting it go changes anything.
    pub(super) fn moved(&self) -> bool {
        match self {
            Held::Control(_, spot) | Held::Pin(_, spot) => spot.moved,
            Held::Moment(moment) => moment.moved,
            Held::Sketch(points, _) => points.len() > 1,
            Held::Slider(param, value) => param.value != *value,
            Held::Marks(_) => false,
            Held::Key(held) => held.moved(),
        }
    }

    /// What letting it go does to the recipe.
    pub(super) fn gesture(&self) -> Option<Gesture> {
        match self {
            Held::Control(control, spot) => Some(Gesture::MoveControl {
                control: control + 1,
                to: spot.at,
            }),
            Held::Pin(frame, spot) => Some(Gesture::Pin {
                frame: frame + 1,
                to: spot.at,
            }),
            Held::Moment(moment) => Some(Gesture::Retime {
                keys: moment.keys.clone(),
            }),
            Held::Sketch(points, _) => Some(Gesture::Path {
                points: points.clone(),
            }),
            Held::Slider(param, value) => Some(Gesture::Param {
                name: param.name.clone(),
                value: value.clone(),
            }),
            Held::Marks(_) => None,
            Held::Key(held) => Some(held.gesture()),
        }
    }

    /// How it is shown meanwhile.
    fn what(&self, pinning: Option<&Pinning>) -> Option<What> {
        Some(match self {
            Held::Control(control, spot) => What::Edit(Edit::MoveControl {
                control: control + 1,
                to: spot.at,
            }),
            Held::Pin(frame, spot) => What::Pin(*frame, spot.at, pinning?.clone()),
            Held::Moment(moment) if moment.again => What::RetimeAgain(moment.keys.clone()),
            Held::Moment(moment) => What::Edit(Edit::Retime {
                keys: moment.keys.clone(),
            }),
            Held::Key(held) => held.what(),
            Held::Sketch(points, _) => What::Edit(Edit::Path {
                points: points.clone(),
                sketch: Sketch::Through,
                frames: None,
            }),
            Held::Slider(..) | Held::Marks(_) => return None,
        })
    }

    /// What it is, for the status line.
    pub(in crate::tui) fn words(&self) -> String {
        let place = |at: &[f64; 2]| format!("{:.4}, {:.4}", at[0], at[1]);
        match self {
            Held::Control(control, spot) => {
                format!("control point {} at {}", control + 1, place(&spot.at))
            }
            Held::Pin(frame, spot) => format!("pin of frame {} at {}", frame + 1, place(&spot.at)),
            Held::Moment(moment) => {
                let [out, source] = moment.keys[moment.key];
                format!("time {source:.2} shown at {out:.2}")
            }
            Held::Sketch(points, _) => format!("sketch of {} points", points.len()),
            Held::Slider(param, value) => format!("{} = {value}", param.name),
            Held::Marks(from) => format!("marks from {from:.2}"),
            Held::Key(held) => held.words(),
        }
    }
}

/// Takes something in hand: the map's view stays where it is meanwhile.
pub(super) fn take(state: &mut State, held: Held) {
    state.playback.playing = false;
    let on_map = matches!(
        held,
        Held::Control(..) | Held::Pin(..) | Held::Sketch(..) | Held::Key(_)
    );
    if state.window.is_none() && state.signals().is_some() && on_map {
        state.window = Some(map::window(state));
        state.hands.frozen = true;
    }
    if matches!(held, Held::Control(..) | Held::Pin(..)) {
        state.roaming = None;
    }
    state.hands.first_try = state.hands.tries + 1;
    state.hands.held = Some(held);
}

/// Moves what is in hand to a place of the map, or a time, and asks for it to be shown.
pub(super) fn shift(state: &mut State, place: [f64; 2], time: f64) -> Vec<Command> {
    let Some(held) = &mut state.hands.held else {
        return Vec::new();
    };
    match held {
        Held::Control(_, spot) | Held::Pin(_, spot) => spot.to(place),
        Held::Moment(moment) => moment.to(time),
        Held::Sketch(points, _) => points.push(place),
        Held::Slider(..) | Held::Marks(_) | Held::Key(_) => {}
    }
    show(state)
}

/// Asks for what is in hand to be shown.
fn show(state: &mut State) -> Vec<Command> {
    let held = state.hands.held.as_ref();
    if held.is_some_and(Held::moved) {
        preview(state)
    } else {
        Vec::new()
    }
}

/// The same where it may be back at where it was.
pub(super) fn preview(state: &mut State) -> Vec<Command> {
    let hands = &state.hands;
    let held = hands.held.as_ref();
    match held.and_then(|held| held.what(hands.pinning.as_ref())) {
        Some(what) => try_out(state, what),
        None => Vec::new(),
    }
}

fn try_out(state: &mut State, what: What) -> Vec<Command> {
    let base = match &state.hands.good {
        Some(Content::Loom(base, _)) => Base::Loom(base.clone()),
        Some(Content::Keys(keys)) => Base::Keys(keys.clone()),
        _ => return Vec::new(),
    };
    state.rough = true;
    state.hands.tries += 1;
    vec![Command::Hands(Errand::Try(Try {
        number: state.hands.tries,
        base,
        what,
    }))]
}

/// Lets go: what was moved becomes a gesture.
pub(super) fn drop(state: &mut State) -> Vec<Command> {
    let Some(held) = release(state) else {
        return Vec::new();
    };
    match (&held, held.gesture()) {
        (Held::Slider(param, value), _) => sliders::set(state, param, value),
        (_, Some(gesture)) if held.moved() => super::act::gesture(state, &gesture),
        // What was moved and moved back.
        (Held::Key(_), _) => {
            shown_again(state);
            Vec::new()
        }
        _ => Vec::new(),
    }
}

/// Forgets what is in hand: the last good result is shown again.
pub(super) fn cancel(state: &mut State) {
    if release(state).is_some() {
        shown_again(state);
    }
}

fn shown_again(state: &mut State) {
    if let Some(good) = &state.hands.good {
        state.content = good.clone();
    }
}

fn release(state: &mut State) -> Option<Held> {
    let held = state.hands.held.take()?;
    state.rough = false;
    if std::mem::take(&mut state.hands.frozen) {
        state.window = None;
    }
    Some(held)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::loom::test_looms::ring;
    use crate::task::Task;

    #[test]
    fn a_moment_keeps_between_its_neighbours() {
        let loom = ring(20, 15, false);
        let mut moment = Moment::at(&loom, "fit(input())", 6.0).unwrap();
        assert_eq!(moment.keys, [[1.0, 1.0], [6.0, 6.0], [15.0, 15.0]]);
        moment.to(9.5);
        assert_eq!(moment.keys[1], [9.5, 6.0]);
        for (to, kept) in [(40.0, 14.75), (-3.0, 1.25)] {
            moment.to(to);
            assert_eq!(moment.time(), kept);
        }
    }

    #[test]
    fn the_last_moment_takes_the_end_along_in_whole_frames() {
        let loom = ring(20, 15, false);
        let mut moment = Moment::at(&loom, "fit(input())", 14.8).unwrap();
        moment.to(20.3);
        assert_eq!(moment.keys, [[1.0, 1.0], [20.0, 15.0]]);
        assert!(Moment::at(&loom, "fit(input())", 1.2).is_none());
    }

    #[test]
    fn keys_that_the_recipe_ends_in_are_taken_up() {
        let loom = ring(20, 15, false);
        let keys = vec![[1.0, 1.0], [5.0, 9.0], [15.0, 15.0]];
        let loom = Edit::Retime { keys }
            .apply(&loom, &Task::default())
            .unwrap()
            .output;
        let recipe = "a.retime([[1, 1], [5, 9], [15, 15]])";
        let moment = Moment::at(&loom, recipe, 5.2).unwrap();
        assert_eq!((moment.again, moment.keys[moment.key]), (true, [5.0, 9.0]));
    }
}
