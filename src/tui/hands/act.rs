//! What keys and the palette do by hand.

use ratatui::crossterm::event::KeyEvent;

use super::held::{Held, Moment, Spot, cancel, drop, shift, take};
use super::runner::Run;
use super::{Errand, keys, sliders};
use crate::loom::Loom;
use crate::recipe::Make;
use crate::recipe::gesture::{Gesture, write};
use crate::tui::event::Command;
use crate::tui::keys::{Action, named};
use crate::tui::panels::{RECIPE, map};
use crate::tui::state::{Notice, Same, State};

/// Frames that one `hold` adds.
const HOLD: usize = 5;
/// Frames that one `extend` adds.
const EXTEND: usize = 10;
/// Faster, and slower.
const FASTER: f64 = 1.25;
const SLOWER: f64 = 0.8;
/// Straighter.
const SMOOTHER: f64 = 0.25;
/// Larger, and smaller, than life.
const MORE: f64 = 1.25;
const LESS: f64 = 0.8;
/// An arrow moves what is in hand by this share of the map's view, with shift ten times as far.
const SHARE: f64 = 0.01;

fn say(state: &mut State, text: impl Into<String>, bad: bool) {
    let text = text.into();
    state.notice = Some(Notice { text, bad });
}

/// A key for what is in hand, or for the sliders; none where it means what it always means.
pub(in crate::tui) fn key(state: &mut State, key: KeyEvent) -> Option<Vec<Command>> {
    let name = named(key)?;
    if state.hands.held.is_some() {
        return held_key(state, &name);
    }
    if state.focus != RECIPE || state.hands.page.recipe.is_none() {
        return None;
    }
    let params = state.hands.page.params.len();
    let chosen = &mut state.hands.page.chosen;
    match name.as_str() {
        "up" | "down" if params == 0 => scroll(state, if name == "up" { -1 } else { 1 }),
        "k" => scroll(state, -1),
        "j" => scroll(state, 1),
        _ if params == 0 => return None,
        "up" => *chosen = chosen.saturating_sub(1),
        "down" => *chosen = (*chosen + 1).min(params - 1),
        "left" => return Some(sliders::step(state, -1.0)),
        "right" => return Some(sliders::step(state, 1.0)),
        "shift-left" => return Some(sliders::step(state, -10.0)),
        "shift-right" => return Some(sliders::step(state, 10.0)),
        _ => return None,
    }
    Some(Vec::new())
}

/// Other lines of the recipe.
pub(super) fn scroll(state: &mut State, lines: isize) {
    let page = &mut state.hands.page;
    let last = page.text().lines().count().saturating_sub(1);
    let first = page.scroll.unwrap_or(0);
    page.scroll = Some(first.saturating_add_signed(lines).min(last));
}

fn held_key(state: &mut State, name: &str) -> Option<Vec<Command>> {
    if let Some(commands) = keys::pressed(state, name) {
        return Some(commands);
    }
    let (far, arrow) = match name.strip_prefix("shift-") {
        Some(arrow) => (10.0, arrow),
        None => (1.0, name),
    };
    let direction = match arrow {
        "left" => [-1.0, 0.0],
        "right" => [1.0, 0.0],
        "up" => [0.0, 1.0],
        "down" => [0.0, -1.0],
        _ => return other_held_key(state, name),
    };
    Some(nudge(state, direction.map(|step| far * step)))
}

fn other_held_key(state: &mut State, name: &str) -> Option<Vec<Command>> {
    let held = state.hands.held.clone()?;
    match (name, held) {
        ("enter", held) => {
            if matches!(held, Held::Sketch(..)) {
                state.roaming = None;
            }
            Some(drop(state))
        }
        ("esc", Held::Sketch(..)) => {
            state.roaming = None;
            cancel(state);
            Some(Vec::new())
        }
        ("esc" | "u", _) => {
            cancel(state);
            Some(Vec::new())
        }
        ("space" | ".", Held::Sketch(..)) => {
            let at = state.roaming?;
            Some(shift(state, at, 0.0))
        }
        _ => None,
    }
}

/// Arrows on what is in hand.
fn nudge(state: &mut State, steps: [f64; 2]) -> Vec<Command> {
    let window = map::window(state);
    let by = [0, 1].map(|i| steps[i] * SHARE * (window[i][1] - window[i][0]));
    let beside = |at: [f64; 2]| [at[0] + by[0], at[1] + by[1]];
    match state.hands.held.clone() {
        Some(Held::Control(_, spot) | Held::Pin(_, spot)) => shift(state, beside(spot.at), 0.0),
        Some(Held::Moment(moment)) => {
            let to = moment.time() + steps[0] + 0.1 * steps[1];
            shift(state, [0.0; 2], to)
        }
        Some(Held::Sketch(..)) => {
            // The cursor goes; space puts a point where it is.
            state.roaming = state.cursor().map(beside);
            Vec::new()
        }
        _ => Vec::new(),
    }
}

/// What an action does by hand.
pub(in crate::tui) fn act(state: &mut State, action: Action) -> Vec<Command> {
    match action {
        Action::Undo => through_history(state, true),
        Action::Redo => through_history(state, false),
        Action::EditRecipe => vec![Command::Hands(Errand::Edit)],
        Action::TakeUp => take_up(state),
        Action::Forget => forget(state),
        Action::MakeLoom => gesture(state, &Gesture::Make(Make::Loom)),
        Action::MakeMotion => gesture(state, &Gesture::Make(Make::Motion)),
        Action::MakeStatistics => gesture(state, &Gesture::Make(Make::Statistics)),
        _ if state.keys().is_some() => keys::act(state, action).unwrap_or_default(),
        _ if state.loom().is_none() || state.hands.good.is_none() => {
            say(state, "there is no loom to edit yet", true);
            Vec::new()
        }
        Action::TakeControl => take_control(state),
        Action::NextControl => other_control(state, 1),
        Action::PreviousControl => other_control(state, -1),
        Action::TakePin => take_pin(state),
        Action::Unpin => unpin(state),
        Action::TakeMoment => {
            take_moment(state, state.playback.t);
            Vec::new()
        }
        Action::Sketch => sketch(state),
        Action::KeepPose => match state.cursor() {
            Some(at) => gesture(state, &Gesture::AddPose { at }),
            None => Vec::new(),
        },
        _ => on_time(state, action),
    }
}

/// Actions on a stretch of time, or on a moment.
fn on_time(state: &mut State, action: Action) -> Vec<Command> {
    let span = stretch(state);
    let [from, to] = span;
    let marked = state.playback.marks.iter().any(Option::is_some);
    let done = match action {
        Action::AddLoop if !marked => {
            say(
                state,
                "mark the loop first: [ where it begins, ] where it ends",
                true,
            );
            return Vec::new();
        }
        Action::AddLoop => Gesture::AddLoop { from, to },
        Action::Trim if !marked => {
            say(state, "mark what is to stay first: [ and ]", true);
            return Vec::new();
        }
        Action::Trim => Gesture::Trim { from, to },
        Action::Reverse => Gesture::Reverse,
        Action::SpeedUp => Gesture::Speed {
            from,
            to,
            factor: FASTER,
        },
        Action::SlowDown => Gesture::Speed {
            from,
            to,
            factor: SLOWER,
        },
        Action::Smooth => Gesture::Smooth {
            from,
            to,
            amount: SMOOTHER,
        },
        Action::Exaggerate => Gesture::Exaggerate { amount: MORE },
        Action::Attenuate => Gesture::Exaggerate { amount: LESS },
        Action::HoldStill => Gesture::Hold {
            time: now(state),
            frames: HOLD,
        },
        Action::Extend => Gesture::Extend { frames: EXTEND },
        Action::InsertControl => Gesture::InsertControl { time: now(state) },
        _ => return Vec::new(),
    };
    let commands = gesture(state, &done);
    if !marked {
        state.hands.whole = Some((state.hands.page.text().to_string(), span));
    }
    if matches!(action, Action::Trim | Action::Reverse) {
        state.playback.marks = [None; 2];
    }
    commands
}

/// The time of the cursor as a recipe says it.
fn now(state: &State) -> f64 {
    crate::recipe::gesture::rounded(state.playback.t)
}

/// Between the marks, or everything: as the last gesture said it, if that is what is repeated.
fn stretch(state: &State) -> [f64; 2] {
    let span = state.span();
    let marked = state.playback.marks.iter().any(Option::is_some);
    match &state.hands.whole {
        Some((text, whole)) if !marked && text == state.hands.page.text() => *whole,
        _ => [span.from, span.to].map(crate::recipe::gesture::rounded),
    }
}

/// Writes a gesture into the recipe and runs it.
pub(super) fn gesture(state: &mut State, gesture: &Gesture) -> Vec<Command> {
    match write(state.hands.page.text(), gesture) {
        Ok(written) => {
            state.hands.page.touched = Some(written.line);
            if !page_shown(state) {
                let line = crate::recipe::text::line(&written.text, written.line);
                say(state, format!("{}: {}", written.line, line.trim()), false);
            }
            replace(state, written.text, true)
        }
        Err(error) => {
            say(state, error.to_string().replace("\n  ", "; "), true);
            if let Some(good) = &state.hands.good {
                state.content = good.clone();
            }
            Vec::new()
        }
    }
}

/// Whether the recipe is on the screen: what it shows is not said again.
pub(super) fn page_shown(state: &State) -> bool {
    state.places().iter().any(|(panel, _)| *panel == RECIPE)
}

/// Another text of the recipe, that of before remembered, and a run of it.
pub(super) fn replace(state: &mut State, text: String, save: bool) -> Vec<Command> {
    let before = state.hands.page.text().to_string();
    state.hands.history.replaced(&before);
    set_text(state, text);
    run(state, save, Vec::new())
}

fn set_text(state: &mut State, text: String) {
    let page = &mut state.hands.page;
    page.scroll = None;
    if let Some(recipe) = &mut page.recipe {
        recipe.text = text;
    }
}

/// Asks for a run of the recipe, with parameters set besides.
pub(super) fn run(state: &mut State, save: bool, set: Vec<(String, String)>) -> Vec<Command> {
    let hands = &mut state.hands;
    let Some(recipe) = hands.page.recipe.clone() else {
        return Vec::new();
    };
    hands.page.saved &= !save;
    if !hands.ready && !save {
        return Vec::new();
    }
    hands.runs += 1;
    hands.page.running = true;
    let mut settings = hands.settings.clone();
    settings.extend(set);
    vec![Command::Hands(Errand::Run(Run {
        number: hands.runs,
        recipe,
        settings,
        save,
    }))]
}

fn through_history(state: &mut State, back: bool) -> Vec<Command> {
    if state.hands.held.is_some() {
        cancel(state);
        return Vec::new();
    }
    let present = state.hands.page.text().to_string();
    let history = &mut state.hands.history;
    let text = if back {
        history.undo(&present)
    } else {
        history.redo(&present)
    };
    let Some(text) = text else {
        let what = if back { "undo" } else { "redo" };
        say(state, format!("nothing to {what}"), false);
        return Vec::new();
    };
    state.hands.page.touched = changed_line(&present, &text);
    set_text(state, text);
    run(state, true, Vec::new())
}

/// The first line (from 1) that differs, if the new text has it.
pub(super) fn changed_line(before: &str, after: &str) -> Option<usize> {
    let same = before
        .lines()
        .zip(after.lines())
        .take_while(|(a, b)| a == b)
        .count();
    (same < after.lines().count()).then_some(same + 1)
}

fn take_control(state: &mut State) -> Vec<Command> {
    let (Some(at), Some(loom)) = (state.cursor(), state.loom()) else {
        return Vec::new();
    };
    let controls = loom.time().controls();
    let distance = |index: &usize| {
        let control = controls[*index];
        (control[0] - at[0]).hypot(control[1] - at[1])
    };
    let nearest = (0..controls.len()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
    if let Some(index) = nearest {
        let spot = Spot::still(controls[index]);
        take(state, Held::Control(index, spot));
    }
    Vec::new()
}

/// The control point after or before the one in hand, which is let go.
fn other_control(state: &mut State, by: isize) -> Vec<Command> {
    let Some(Held::Control(index, _)) = state.hands.held else {
        return take_control(state);
    };
    let commands = drop(state);
    let Some(loom) = state.loom() else {
        return commands;
    };
    let controls = loom.time().controls();
    let next = (index as isize + by).rem_euclid(controls.len() as isize) as usize;
    let spot = Spot::still(controls[next]);
    take(state, Held::Control(next, spot));
    commands
}

/// The loom as it was fitted, whose frames can be pinned; it is said if they cannot.
pub(super) fn pinnable(state: &mut State) -> Option<Same<Loom>> {
    let fitted = state.hands.pinning.as_ref().map(|pins| pins.fitted.clone());
    if fitted.is_none() {
        say(
            state,
            "pins need the frames: open the capture, not its loom",
            true,
        );
    }
    fitted
}

/// The frame (from 0) of the fit at the cursor: that of the cursor's time, or once the time is edited the one
/// whose place on the map is nearest.
fn frame_here(state: &State, fitted: &Loom) -> Option<usize> {
    let places = &fitted.layout().positions;
    if state.signals()?.0.map.frames == *places {
        let frame = (state.playback.t.round() as usize).saturating_sub(1);
        return Some(frame.min(places.len().checked_sub(1)?));
    }
    let at = state.cursor()?;
    let distance = |place: &[f64; 2]| (place[0] - at[0]).hypot(place[1] - at[1]);
    (0..places.len()).min_by(|&a, &b| distance(&places[a]).total_cmp(&distance(&places[b])))
}

fn take_pin(state: &mut State) -> Vec<Command> {
    if let Some(fitted) = pinnable(state)
        && let Some(frame) = frame_here(state, &fitted.0)
        && let Some(&place) = fitted.0.layout().positions.get(frame)
    {
        take(state, Held::Pin(frame, Spot::still(place)));
    }
    Vec::new()
}

fn unpin(state: &mut State) -> Vec<Command> {
    let fitted = pinnable(state);
    let here = fitted.and_then(|fitted| Some((frame_here(state, &fitted.0)?, fitted)));
    let Some((frame, fitted)) = here else {
        return Vec::new();
    };
    let pins = &fitted.0.layout().pins;
    if pins.iter().any(|(pinned, _)| *pinned == frame) {
        return gesture(state, &Gesture::Unpin { frame: frame + 1 });
    }
    say(state, format!("frame {} is not pinned", frame + 1), true);
    Vec::new()
}

/// The moment at an output time comes into the hand.
pub(super) fn take_moment(state: &mut State, t: f64) {
    let moment = state
        .loom()
        .and_then(|loom| Moment::at(loom, state.hands.page.text(), t));
    match moment {
        Some(moment) => take(state, Held::Moment(moment)),
        None => say(state, "the first moment stays the first", true),
    }
}

fn sketch(state: &mut State) -> Vec<Command> {
    take(state, Held::Sketch(Vec::new(), false));
    state.roaming = state.cursor();
    say(
        state,
        "sketch: draw with the mouse, or arrows and space; enter writes it, esc drops it",
        false,
    );
    Vec::new()
}

/// Gestures of a lost session become the recipe's text.
fn take_up(state: &mut State) -> Vec<Command> {
    match state.hands.page.offered.take() {
        Some(text) => {
            state.hands.page.touched = changed_line(state.hands.page.text(), &text);
            let mut commands = replace(state, text, true);
            commands.push(Command::Hands(Errand::Keep(None)));
            commands
        }
        None => {
            say(state, "no lost session left anything", false);
            Vec::new()
        }
    }
}

fn forget(state: &mut State) -> Vec<Command> {
    match state.hands.page.offered.take() {
        Some(_) => vec![Command::Hands(Errand::Keep(None))],
        None => Vec::new(),
    }
}
