//! The signals over time.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{Panel, TIME};
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::{Picture, Subject};

/// The signals over time.
pub(super) struct Time;

impl Panel for Time {
    fn title(&self) -> &'static str {
        "time signals"
    }

    fn subject(&self, state: &State) -> Option<Subject> {
        state.signals().cloned().map(Subject::Times)
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let Some(picture) = &state.slots[TIME].shown else {
            return;
        };
        for (mark, symbol) in state.playback.marks.iter().zip(["[", "]"]) {
            if let Some(t) = mark {
                upright(picture, *t, area, |x, y| {
                    if let Some(cell) = buffer.cell_mut((x, y)) {
                        cell.set_symbol(symbol)
                            .set_style(state.look.style(Role::Mark));
                    }
                });
            }
        }
        upright(picture, state.playback.t, area, |x, y| {
            if let Some(cell) = buffer.cell_mut((x, y)) {
                cell.set_symbol("│")
                    .set_style(state.look.style(Role::Accent));
            }
        });
    }
}

/// Visits the cells of a vertical line at a time, through all planes.
fn upright(picture: &Picture, t: f64, area: Rect, mut visit: impl FnMut(u16, u16)) {
    let (Some(first), Some(last)) = (picture.planes.first(), picture.planes.last()) else {
        return;
    };
    let x = first.x.pixel(t) / picture.image.width.max(1) as f32 * f32::from(area.width);
    if !(0.0..f32::from(area.width)).contains(&x) {
        return;
    }
    let row = |pixel: f32| {
        let row = pixel / picture.image.height.max(1) as f32 * f32::from(area.height);
        area.y + (row.max(0.0) as u16).min(area.height.saturating_sub(1))
    };
    let bottom = row(last.area.top + last.area.height - 1.0);
    for y in row(first.area.top)..=bottom {
        visit(area.x + x as u16, y);
    }
}
