//! What hands can do, at the foot of a recipe that leaves room: keys by the table that binds them.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use crate::tui::keys::{ACTIONS, Action};
use crate::tui::state::State;
use crate::tui::theme::Role;

/// In pairs, one row each.
const HINTS: [[(Action, &str); 2]; 4] = [
    [
        (Action::TakeControl, "drag a control point"),
        (Action::TakePin, "pin this frame"),
    ],
    [
        (Action::AddLoop, "loop from [ to ]"),
        (Action::Sketch, "sketch a curve"),
    ],
    [
        (Action::TakeMoment, "retime this moment"),
        (Action::EditRecipe, "in your editor"),
    ],
    [(Action::Undo, "undo"), (Action::Palette, "all there is")],
];
/// Columns of a pair's first, and of both.
const FIRST: u16 = 25;
const BOTH: u16 = FIRST + 19;

/// Writes them into the last rows of `area`, if a free one remains above.
pub(super) fn draw(state: &State, area: Rect, buffer: &mut Buffer) {
    let rows = HINTS.len() as u16;
    if area.height <= rows || area.width < BOTH {
        return;
    }
    for (row, pair) in (area.bottom() - rows..).zip(HINTS) {
        for (column, (action, words)) in [area.x, area.x + FIRST].into_iter().zip(pair) {
            let bound = ACTIONS.iter().find(|binding| binding.action == action);
            let key = bound.and_then(|binding| binding.keys.first());
            let accent = state.look.style(Role::Accent);
            buffer.set_string(column + 1, row, key.unwrap_or(&""), accent);
            buffer.set_string(column + 3, row, words, state.look.style(Role::Muted));
        }
    }
}
