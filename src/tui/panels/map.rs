//! The map: the curve of the time signal in pose space.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{MAP, Panel, cell_of};
use crate::plot::Plane;
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::Subject;

/// The map.
pub(in crate::tui) struct Map;

impl Panel for Map {
    fn title(&self) -> &'static str {
        "pose space"
    }

    fn subject(&self, state: &State) -> Option<Subject> {
        let signals = state.signals()?.clone();
        let span = state.span();
        let marked = state.playback.marks.iter().any(Option::is_some) && span.from < span.to;
        Some(Subject::Map {
            signals,
            window: state.window,
            span: marked.then_some([span.from, span.to]),
        })
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let Some(picture) = &state.slots[MAP].shown else {
            return;
        };
        let (Some(plane), Some(at)) = (picture.planes.first(), state.cursor()) else {
            return;
        };
        if let Some(cell) = cell_of(picture, plane, at, area).and_then(|at| buffer.cell_mut(at)) {
            let symbol = if state.roaming.is_some() {
                "✛"
            } else {
                "●"
            };
            cell.set_symbol(symbol)
                .set_style(state.look.style(Role::Accent));
        }
        let [x, y] = at;
        let place = if state.roaming.is_some() {
            "g at"
        } else {
            "f(t) ="
        };
        let text = format!(" {place} {x:.4}, {y:.4} ");
        let width = text.chars().count() as u16;
        if width <= area.width {
            let left = area.right() - width;
            buffer.set_string(left, area.bottom() - 1, text, state.look.style(Role::Muted));
        }
    }
}

/// The part of the map that is shown: x range, y range.
pub(in crate::tui) fn window(state: &State) -> [[f64; 2]; 2] {
    let shown = || {
        let plane = state.slots[MAP].shown.as_ref()?.planes.first()?;
        Some([plane.x.range, plane.y.range])
    };
    state.window.or_else(shown).unwrap_or([[0.0, 1.0]; 2])
}

/// The time at which the curve comes closest to a pixel, if it comes within `reach` pixels.
pub(in crate::tui) fn nearest_time(
    state: &State,
    plane: &Plane,
    at: [f32; 2],
    reach: f32,
) -> Option<f64> {
    let map = &state.signals()?.0.map;
    let distance = |point: &[f64; 2]| {
        let [x, y] = plane.pixel(*point);
        (x - at[0]).hypot(y - at[1])
    };
    let nearest = map
        .times
        .iter()
        .zip(map.curve.iter().map(distance))
        .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (nearest.1 <= reach).then_some(*nearest.0)
}
