//! Parameters of the recipe as sliders.

use ratatui::layout::Rect;

use super::act::{gesture, run};
use super::held::Held;
use crate::recipe::gesture::{Gesture, rounded, write};
use crate::recipe::{Param, Setting};
use crate::tui::event::Command;
use crate::tui::state::{Notice, State};

/// A step of a slider, as a part of its range.
const STEP: f64 = 0.02;

/// The range of a parameter that can be slid.
pub(in crate::tui) fn range(param: &Param) -> Option<(f64, f64)> {
    match param.value {
        Setting::Integer(_) | Setting::Number(_) => param.range.filter(|(a, b)| a < b),
        Setting::Flag(_) => Some((0.0, 1.0)),
        Setting::Text(_) => None,
    }
}

/// Where in its range the value lies, 0 to 1.
pub(in crate::tui) fn share(param: &Param, value: &Setting) -> Option<f64> {
    let (least, greatest) = range(param)?;
    Some(((number(value)? - least) / (greatest - least)).clamp(0.0, 1.0))
}

/// The index of the first slider, where the sliders stand in the panel, and how wide their names are: the
/// rows at its foot, at most half of it.
pub(in crate::tui) fn slider(state: &State, area: Rect) -> (usize, Rect, u16) {
    let params = &state.hands.page.params;
    let rows = (params.len() as u16).min(area.height / 2);
    let first = (state.hands.page.chosen + 1).saturating_sub(usize::from(rows));
    let longest = params.iter().map(|param| param.name.chars().count());
    let names = (longest.max().unwrap_or(0) as u16 + 3).min(area.width / 2);
    let place = Rect::new(area.x, area.bottom() - rows, area.width, rows);
    (first, place, names)
}

/// Columns behind a slider for its value.
pub(in crate::tui) const VALUE: u16 = 9;

/// The slider under a cell, and the share of its range there.
pub(super) fn under(state: &State, area: Rect, column: u16, row: u16) -> Option<(usize, f64)> {
    let (first, place, names) = slider(state, area);
    if !place.contains((column, row).into()) {
        return None;
    }
    let index = first + usize::from(row - place.y);
    (index < state.hands.page.params.len()).then(|| (index, share_at(place, names, column)))
}

/// The share of a slider's range at a column.
fn share_at(place: Rect, names: u16, column: u16) -> f64 {
    let width = place.width.saturating_sub(names + VALUE).max(2);
    let at = f64::from(column) - f64::from(place.x + names);
    (at / f64::from(width - 1)).clamp(0.0, 1.0)
}

/// The mouse at a column gives the slider in hand a value; the recipe runs with it.
pub(super) fn slide(state: &mut State, area: Rect, column: u16) -> Vec<Command> {
    let (_, place, names) = slider(state, area);
    let share = share_at(place, names, column);
    let Some(Held::Slider(param, value)) = &mut state.hands.held else {
        return Vec::new();
    };
    let Some((least, greatest)) = range(param) else {
        return Vec::new();
    };
    let next = setting(param, least + share * (greatest - least));
    if next == *value {
        return Vec::new();
    }
    *value = next;
    let set = (param.name.clone(), value.to_string());
    run(state, false, vec![set])
}

/// Keys: the chosen slider by steps.
pub(super) fn step(state: &mut State, steps: f64) -> Vec<Command> {
    let page = &state.hands.page;
    let Some(param) = page.params.get(page.chosen).cloned() else {
        return Vec::new();
    };
    let (Some((least, greatest)), Some(value)) = (range(&param), number(&param.value)) else {
        let text = format!("{} has no range to slide in", param.name);
        state.notice = Some(Notice { text, bad: true });
        return Vec::new();
    };
    let size = match param.value {
        Setting::Number(_) => STEP * (greatest - least),
        _ => 1.0,
    };
    let next = setting(&param, (value + steps * size).clamp(least, greatest));
    set(state, &param, &next)
}

/// Writes a parameter's new value as its default, or where that is no plain value sets it for this
/// session.
pub(super) fn set(state: &mut State, param: &Param, value: &Setting) -> Vec<Command> {
    if param.value == *value {
        // Runs with other values may be under way.
        return run(state, false, Vec::new());
    }
    let name = param.name.clone();
    if let Some(shown) = state.hands.page.params.iter_mut().find(|p| p.name == name) {
        shown.value = value.clone();
    }
    let change = Gesture::Param {
        name: name.clone(),
        value: value.clone(),
    };
    state.hands.settings.retain(|(set, _)| *set != name);
    match write(state.hands.page.text(), &change) {
        Ok(_) => gesture(state, &change),
        Err(error) => {
            let hint = error.hints.first().map_or("", String::as_str);
            let text = format!("{name} = {value} for now: {}; {hint}", error.message);
            state.notice = Some(Notice { text, bad: false });
            state.hands.settings.push((name, value.to_string()));
            run(state, false, Vec::new())
        }
    }
}

fn number(value: &Setting) -> Option<f64> {
    match value {
        Setting::Integer(value) => Some(*value as f64),
        Setting::Number(value) => Some(*value),
        Setting::Flag(value) => Some(f64::from(u8::from(*value))),
        Setting::Text(_) => None,
    }
}

/// A value of the parameter's kind.
fn setting(param: &Param, value: f64) -> Setting {
    match param.value {
        Setting::Integer(_) => Setting::Integer(value.round() as i64),
        Setting::Flag(_) => Setting::Flag(value >= 0.5),
        _ => Setting::Number(rounded(value)),
    }
}
