//! Numbers of the axes as cells, beside plots with too few pixels for letters.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::plot::{Axis, Plane, Ticks};
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::Picture;

/// Columns left of a plot, and rows below it.
const WIDE: u16 = 6;
const TALL: u16 = 1;
/// Below this there is no room for numbers.
const ROOM: (u16, u16) = (30, 8);
/// A number on the horizontal axis has this many columns.
const SPACING: u16 = 10;
/// A number on the vertical axis has this many rows.
const LINES: u16 = 3;

/// What is left of `area` for the plot.
pub(super) fn canvas(state: &State, area: Rect) -> Rect {
    if state.lettered() || area.width < ROOM.0 || area.height < ROOM.1 {
        return area;
    }
    Rect::new(area.x + WIDE, area.y, area.width - WIDE, area.height - TALL)
}

/// Writes the numbers of these planes, one above the other, around `canvas` within `area`.
pub(super) fn draw(
    state: &State,
    picture: &Picture,
    area: Rect,
    canvas: Rect,
    buffer: &mut Buffer,
) {
    if canvas == area {
        return;
    }
    for plane in &picture.planes {
        beside(state, picture, plane, canvas, buffer);
    }
    if let Some(plane) = picture.planes.last() {
        below(state, picture, plane, canvas, buffer);
    }
}

fn beside(state: &State, picture: &Picture, plane: &Plane, canvas: Rect, buffer: &mut Buffer) {
    let cells = plane.area.height / picture.image.height.max(1) as f32 * f32::from(canvas.height);
    let most = (cells as u16 / LINES).max(2);
    let style = state.look.style(Role::Muted);
    for (value, text) in written(state, &plane.y.ticks(usize::from(most))) {
        let row = cell(&plane.y, value, picture.image.height, canvas.height);
        if row < canvas.height && text.chars().count() < usize::from(WIDE) {
            let line = format!("{text:>width$}", width = usize::from(WIDE) - 1);
            buffer.set_string(canvas.x - WIDE, canvas.y + row, line, style);
        }
    }
}

fn below(state: &State, picture: &Picture, plane: &Plane, canvas: Rect, buffer: &mut Buffer) {
    let style = state.look.style(Role::Muted);
    let most = (canvas.width / SPACING).max(1);
    let mut free = canvas.x - WIDE;
    for (value, text) in written(state, &plane.x.ticks(usize::from(most))) {
        let column = canvas.x + cell(&plane.x, value, picture.image.width, canvas.width);
        let wide = text.chars().count() as u16;
        let start = column.saturating_sub(wide / 2).max(free);
        if start + wide <= canvas.right() {
            buffer.set_string(start, canvas.bottom(), text, style);
            free = start + wide + 1;
        }
    }
}

/// Ticks as text, the power of ten that they have in common with each.
fn written(state: &State, ticks: &Ticks) -> Vec<(f64, String)> {
    let power = match ticks.exponent {
        0 => String::new(),
        exponent => format!("e{exponent}"),
    };
    let marks = ticks.marks.iter();
    marks
        .map(|tick| {
            let text = format!("{}{power}", tick.text);
            (tick.value, state.written(text))
        })
        .collect()
}

/// The cell of a value along an axis of so many cells.
fn cell(axis: &Axis, value: f64, pixels: usize, cells: u16) -> u16 {
    let share = axis.pixel(value) / pixels.max(1) as f32;
    (share.clamp(0.0, 1.0) * f32::from(cells)) as u16
}
