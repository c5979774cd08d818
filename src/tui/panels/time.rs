//! The signals over time.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{Panel, TIME, gutter, posed, read_out};
use crate::tui::hands::Held;
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::{Picture, Subject};

/// The signals over time.
pub(super) struct Time;

impl Panel for Time {
    fn title(&self) -> &'static str {
        "time signals"
    }

    fn title_of(&self, state: &State) -> &'static str {
        posed::time_title(state).unwrap_or(self.title())
    }

    fn subject(&self, state: &State) -> Option<Subject> {
        match state.poses() {
            Some(poses) => Some(Subject::Shares(poses.found.clone())),
            None => state.signals().cloned().map(Subject::Times),
        }
    }

    fn canvas(&self, state: &State, area: Rect) -> Rect {
        gutter::canvas(state, area)
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let Some(picture) = &state.slots[TIME].shown else {
            return;
        };
        let canvas = self.canvas(state, area);
        gutter::draw(state, picture, area, canvas, buffer);
        let (panel, area) = (area, canvas);
        if state.poses().is_some() {
            return;
        }
        posed::draw_times(state, picture, area, buffer);
        for (mark, symbol) in state.playback.marks.iter().zip(["[", "]"]) {
            if let Some(t) = mark {
                upright(picture, state.on_axis(*t), area, |x, y| {
                    if let Some(cell) = buffer.cell_mut((x, y)) {
                        cell.set_symbol(symbol)
                            .set_style(state.look.style(Role::Mark));
                    }
                });
            }
        }
        if let Some(Held::Moment(moment)) = &state.hands.held {
            upright(picture, moment.time(), area, |x, y| {
                if let Some(cell) = buffer.cell_mut((x, y)) {
                    cell.set_symbol("┃").set_style(state.look.style(Role::Mark));
                }
            });
        }
        upright(picture, state.on_axis(state.playback.t), area, |x, y| {
            if let Some(cell) = buffer.cell_mut((x, y)) {
                let line = if state.plain_letters { "|" } else { "│" };
                cell.set_symbol(line)
                    .set_style(state.look.style(Role::Accent));
            }
        });
        let read = state.hover.filter(|&at| area.contains(at.into()));
        let t =
            read.and_then(|at| Some(picture.planes.first()?.x.value(picture.pixel(area, at)[0])));
        if let Some(text) = t.and_then(|t| values(state, t)) {
            read_out(state, Role::Mark, &text, panel, buffer);
        }
    }
}

/// The signals at a time, in words.
fn values(state: &State, t: f64) -> Option<String> {
    if let Some(keys) = state.keys() {
        return Some(posed::values(keys, t));
    }
    let loom = state.loom()?;
    let t = t.clamp(1.0, loom.frames() as f64);
    let [x, y] = loom.position_at(t).ok()?;
    let [vx, vy] = loom.time().velocity(t)?;
    let frame = t.round() as usize;
    let errors = &state.signals()?.0.times.error;
    let error = errors.get(frame - 1).map_or_else(String::new, |error| {
        format!("  error of frame {frame} {:.3} %", 100.0 * error)
    });
    Some(format!(
        " t {t:.2}  p₁ {x:.4}  p₂ {y:.4}  speed {:.4}{error} ",
        vx.hypot(vy)
    ))
}

/// Visits the cells of a vertical line at a time, through all planes.
pub(super) fn upright(picture: &Picture, t: f64, area: Rect, mut visit: impl FnMut(u16, u16)) {
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
