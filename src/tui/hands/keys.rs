//! Key poses in hand: a key that goes to another time, or whose tangents are pulled.

use ratatui::crossterm::event::MouseButton;

use super::held::{Held, cancel, drop, preview, take};
use super::pointer::Pointed;
use super::trial::What;
use crate::pipeline::{Handle, KeyControls, Side};
use crate::recipe::gesture::rounded;
use crate::recipe::{Gesture, KeyNumber};
use crate::tui::event::Command;
use crate::tui::keys::Action;
use crate::tui::panels::{MAP, TIME, arm_ends};
use crate::tui::posed::KeyScene;
use crate::tui::state::{Content, Notice, State};
use crate::tui::update::scrub;

/// A key this near is taken, in cells.
const REACH: f64 = 1.5;
/// Keys stay this far from each other, as a share of the time between the first and the last.
const APART: f64 = 1e-3;
/// A key press changes a handle by this.
const TURN: f64 = 0.05;
/// The mouse takes keys to whole frames where so many lie between the first and the last.
const COARSE: f64 = 20.0;

/// A key in hand.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::tui) struct KeyHeld {
    /// Which, from 0.
    key: usize,
    grip: Grip,
    /// Times and handles of all keys, with the hand's change, and before it.
    controls: KeyControls,
    before: KeyControls,
}

/// What of a key is in hand.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Grip {
    /// Its time.
    Time,
    /// Its handle, by keys.
    Handle,
    /// An arm of its tangents; whether the other one stays where it is.
    Arm(Side, bool),
}

impl KeyHeld {
    /// Where it is shown on the map.
    pub(in crate::tui) fn place(&self, state: &State) -> Option<[f64; 2]> {
        let keys = state.keys()?;
        match self.grip {
            Grip::Arm(side, _) => {
                let handle = *self.controls.handles.get(self.key)?;
                keys.motion().tangents(self.key).arm(handle, side)
            }
            _ => keys.signals.0.map.frames.get(self.key).copied(),
        }
    }

    /// The panel that the mouse moves it on, if it does.
    pub(super) fn panel(&self) -> Option<usize> {
        match self.grip {
            Grip::Time => Some(TIME),
            Grip::Arm(..) => Some(MAP),
            Grip::Handle => None,
        }
    }

    /// Whether letting it go changes anything.
    pub(super) fn moved(&self) -> bool {
        !self.numbers().is_empty()
    }

    /// What letting it go does to the recipe.
    pub(super) fn gesture(&self) -> Gesture {
        Gesture::Key {
            key: self.key + 1,
            numbers: self.numbers(),
        }
    }

    /// How it is shown meanwhile.
    pub(super) fn what(&self) -> What {
        What::Keys(self.controls.clone())
    }

    /// What it is, in words.
    pub(super) fn words(&self) -> String {
        let key = self.key + 1;
        let Handle {
            tension,
            continuity,
            bias,
        } = self.handle();
        match self.grip {
            Grip::Time => format!("key {key} at {:.4}", self.controls.times[self.key]),
            _ => format!(
                "key {key}: tension {tension:.2}, bias {bias:.2}, continuity {continuity:.2} (arrows , .)"
            ),
        }
    }

    fn handle(&self) -> Handle {
        self.controls.handles[self.key]
    }

    /// The numbers that differ from before as a recipe would say them, those of all keys for each.
    fn numbers(&self) -> Vec<(KeyNumber, Vec<f64>)> {
        let of = |controls: &KeyControls, number| -> Vec<f64> {
            let handles = controls.handles.iter();
            match number {
                KeyNumber::Time => controls.times.clone(),
                KeyNumber::Tension => handles.map(|handle| handle.tension).collect(),
                KeyNumber::Continuity => handles.map(|handle| handle.continuity).collect(),
                KeyNumber::Bias => handles.map(|handle| handle.bias).collect(),
            }
        };
        let all = [
            KeyNumber::Time,
            KeyNumber::Tension,
            KeyNumber::Continuity,
            KeyNumber::Bias,
        ];
        let changed = |number: KeyNumber| {
            let (before, now) = (of(&self.before, number), of(&self.controls, number));
            let differs = rounded(before[self.key]) != rounded(now[self.key]);
            differs.then_some((number, now))
        };
        all.into_iter().filter_map(changed).collect()
    }

    /// Takes it to a time, between its neighbours.
    fn put_at(&mut self, time: f64) {
        let times = &mut self.controls.times;
        let least = APART * (self.before.times[times.len() - 1] - self.before.times[0]);
        let low = self.key.checked_sub(1).map(|before| times[before] + least);
        let high = times.get(self.key + 1).map(|after| after - least);
        times[self.key] = time
            .min(high.unwrap_or(f64::INFINITY))
            .max(low.unwrap_or(f64::NEG_INFINITY));
    }

    fn turn(&mut self, tension: f64, continuity: f64, bias: f64) {
        let handle = &mut self.controls.handles[self.key];
        let turned = |number: f64, by: f64| {
            // Whole steps, so that 0 is met again.
            (((number + by * TURN) / TURN).round() * TURN).clamp(-1.0, 1.0)
        };
        if tension != 0.0 {
            handle.tension = turned(handle.tension, tension);
        }
        if continuity != 0.0 {
            handle.continuity = turned(handle.continuity, continuity);
        }
        if bias != 0.0 {
            handle.bias = turned(handle.bias, bias);
        }
    }
}

/// The keys of the last good result.
fn good(state: &State) -> Option<&KeyScene> {
    match &state.hands.good {
        Some(Content::Keys(keys)) => Some(keys),
        _ => None,
    }
}

fn say(state: &mut State, text: &str) {
    state.notice = Some(Notice {
        text: text.into(),
        bad: true,
    });
}

/// Takes a key in hand.
fn take_key(state: &mut State, key: usize, grip: Grip) {
    let Some(keys) = good(state) else { return };
    let controls = keys.motion().controls().clone();
    if key >= controls.times.len() {
        return;
    }
    state.hands.key = Some(key);
    let held = KeyHeld {
        key,
        grip,
        before: controls.clone(),
        controls,
    };
    take(state, Held::Key(held));
}

/// Chooses a key and goes there.
fn choose(state: &mut State, key: usize) {
    let Some(keys) = state.keys() else { return };
    let motion = keys.motion();
    let frame = motion
        .controls()
        .times
        .get(key)
        .map(|time| motion.frame_at(*time));
    state.hands.key = frame.map(|_| key);
    if let Some(frame) = frame {
        scrub(state, frame);
    }
}

/// The chosen key, or the one whose time is nearest the cursor's.
fn at_hand(state: &State) -> Option<usize> {
    let motion = state.keys()?.motion();
    let count = motion.controls().times.len();
    let nearest = || motion.nearest_key(motion.time_at(state.playback.t));
    let chosen = state.hands.key.filter(|key| *key < count);
    Some(chosen.unwrap_or_else(nearest))
}

/// What an action does to key poses; none where there are none.
pub(super) fn act(state: &mut State, action: Action) -> Option<Vec<Command>> {
    good(state)?;
    let key = at_hand(state)?;
    let count = state.keys()?.motion().controls().times.len();
    match action {
        Action::TakeMoment => take_key(state, key, Grip::Time),
        Action::TakeControl => take_key(state, key, Grip::Handle),
        Action::NextControl | Action::PreviousControl => {
            let on = action == Action::NextControl;
            let next = match (state.hands.key, on) {
                (None, _) => key,
                (Some(_), true) => (key + 1) % count,
                (Some(_), false) => (key + count - 1) % count,
            };
            return Some(other(state, next));
        }
        _ => say(
            state,
            "this is a motion through key poses: F makes a loom of it",
        ),
    }
    Some(Vec::new())
}

/// Another key is chosen, and taken as the one in hand was, which is let go.
fn other(state: &mut State, key: usize) -> Vec<Command> {
    let grip = match &state.hands.held {
        Some(Held::Key(held)) => Some(held.grip),
        _ => None,
    };
    let commands = drop(state);
    choose(state, key);
    if let Some(grip) = grip {
        take_key(state, key, grip);
    }
    commands
}

/// A key press for what is in hand, `far` times as far with shift.
pub(super) fn pressed(state: &mut State, name: &str) -> Option<Vec<Command>> {
    let (far, name) = match name.strip_prefix("shift-") {
        Some(arrow) => (10.0, arrow),
        None => (1.0, name),
    };
    let Some(Held::Key(held)) = &mut state.hands.held else {
        return None;
    };
    match (held.grip, name) {
        (Grip::Time, "left" | "right" | "up" | "down") => {
            let step = match name {
                "left" => -1.0,
                "right" => 1.0,
                "up" => 0.1,
                _ => -0.1,
            };
            held.put_at(held.controls.times[held.key] + far * step);
        }
        (Grip::Time, _) => return None,
        (_, "up") => held.turn(far, 0.0, 0.0),
        (_, "down") => held.turn(-far, 0.0, 0.0),
        (_, "left") => held.turn(0.0, 0.0, -far),
        (_, "right") => held.turn(0.0, 0.0, far),
        (_, ".") => held.turn(0.0, far, 0.0),
        (_, ",") => held.turn(0.0, -far, 0.0),
        (_, "0") => held.controls.handles[held.key] = Handle::default(),
        _ => return None,
    }
    Some(preview(state))
}

/// The left button, or another, on the map or on the axis of time.
pub(super) fn press(
    state: &mut State,
    panel: usize,
    spot: &Pointed<'_>,
    button: MouseButton,
    aside: bool,
) -> bool {
    let Some(scene) = good(state) else {
        return false;
    };
    let nearest = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let distances = points.map(|at| spot.distance(at)).enumerate();
        let found = distances.min_by(|a, b| a.1.total_cmp(&b.1));
        found.filter(|(_, distance)| *distance <= REACH)
    };
    if panel == TIME && !aside {
        let times = &scene.motion().controls().times;
        let along = |time: &f64| [*time, spot.place[1]];
        let found = nearest(&mut times.iter().map(along)).map(|(key, _)| key);
        let any = scene.motion().nearest_key(spot.place[0]);
        let key = match button {
            MouseButton::Left => found,
            _ => Some(any),
        };
        if let Some(key) = key {
            take_key(state, key, Grip::Time);
        }
        return key.is_some();
    }
    if panel != MAP || (button != MouseButton::Left && !aside) {
        return false;
    }
    let ends = state.hands.key.map(|key| (key, arm_ends(state, key)));
    let arm = ends.as_ref().and_then(|(key, ends)| {
        let (index, far) = nearest(&mut ends.iter().map(|(_, end)| *end))?;
        Some((*key, ends[index].0, far))
    });
    let keys = &scene.signals.0.map.frames;
    let key = nearest(&mut keys.iter().copied());
    match (arm, key) {
        (Some((key, side, far)), nearer) if nearer.is_none_or(|(_, key)| far <= key) => {
            take_key(state, key, Grip::Arm(side, aside));
        }
        (_, Some((key, _))) if aside => {
            // With full tension its arms lie here.
            let sides = arm_ends(state, key);
            if let Some((side, _)) = sides.last() {
                take_key(state, key, Grip::Arm(*side, false));
            }
        }
        (_, Some((key, _))) => choose(state, key),
        _ => return false,
    }
    true
}

/// The mouse moves what is in hand.
pub(super) fn dragged(state: &mut State, place: [f64; 2]) -> Vec<Command> {
    let Some(scene) = good(state) else {
        return Vec::new();
    };
    let motion = scene.motion();
    let [first, last] = motion.motion().ends();
    let tangents = |key| motion.tangents(key);
    let Some(Held::Key(held)) = &state.hands.held else {
        return Vec::new();
    };
    let mut held = held.clone();
    match held.grip {
        Grip::Time => {
            let step = match last - first >= COARSE {
                true => 1.0,
                false => 0.1,
            };
            held.put_at((place[0] / step).round() * step);
        }
        Grip::Arm(side, corner) => {
            let before = held.before.handles[held.key];
            held.controls.handles[held.key] =
                tangents(held.key).pulled(before, side, place, corner);
        }
        Grip::Handle => return Vec::new(),
    }
    state.hands.held = Some(Held::Key(held));
    preview(state)
}

/// The mouse lets go; a click chooses the key.
pub(super) fn let_go(state: &mut State) -> Vec<Command> {
    let Some(Held::Key(held)) = &state.hands.held else {
        return Vec::new();
    };
    if held.moved() {
        return drop(state);
    }
    let key = held.key;
    cancel(state);
    choose(state, key);
    Vec::new()
}
