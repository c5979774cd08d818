//! What is in hand, on the map.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Modifier;

use super::cell_of;
use crate::plot::Plane;
use crate::tui::hands::Held;
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::Picture;

/// What is in hand: a control point, a pin, the points of a sketch.
pub(super) fn draw(
    state: &State,
    picture: &Picture,
    plane: &Plane,
    area: Rect,
    buffer: &mut Buffer,
) {
    let (points, symbol, plain) = match &state.hands.held {
        Some(Held::Control(_, spot)) => (vec![spot.at], "◈", "@"),
        Some(Held::Pin(_, spot)) => (vec![spot.at], "▼", "V"),
        Some(Held::Sketch(points, _)) => (points.clone(), "•", "*"),
        Some(Held::Key(held)) => (held.place(state).into_iter().collect(), "◈", "@"),
        _ => return,
    };
    let symbol = if state.plain_letters { plain } else { symbol };
    let style = state.look.style(Role::Accent).add_modifier(Modifier::BOLD);
    for point in points {
        let cell = cell_of(picture, plane, point, area);
        if let Some(cell) = cell.and_then(|at| buffer.cell_mut(at)) {
            cell.set_symbol(symbol).set_style(style);
        }
    }
}

/// The times at which the control point in hand moves the curve: its four spans.
pub(super) fn support(state: &State) -> Option<[f64; 2]> {
    let Some(Held::Control(control, _)) = state.hands.held else {
        return None;
    };
    let spans = control.saturating_sub(3)..=control;
    let (loom, signals) = (state.loom()?, state.signals()?);
    let moves = |t: &&f64| {
        let place = loom.time().place_at(**t);
        place.is_some_and(|(place, _)| spans.contains(&place.span))
    };
    let times = &signals.0.map.times;
    let first = times.iter().find(moves)?;
    let last = times.iter().rev().find(moves)?;
    (first < last).then_some([*first, *last])
}
