//! Panels: each says which picture it wants and draws cells on top of it. They change nothing.

mod details;
mod gutter;
mod hand;
mod hints;
pub(super) mod map;
pub(super) mod mesh;
mod posed;
mod recipe;
mod time;

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::state::State;
use super::theme::Role;
use super::work::{Picture, Subject, Wish};
use crate::plot::Plane;

/// One panel.
pub(super) trait Panel: Sync {
    /// What stands on its border or tab.
    fn title(&self) -> &'static str;

    /// What stands on its border, with what is open in mind.
    fn title_of(&self, _: &State) -> &'static str {
        self.title()
    }

    /// What its picture shows; none where there is nothing to show yet, or never a picture.
    fn subject(&self, state: &State) -> Option<Subject>;

    /// The part of `area` that its picture fills.
    fn canvas(&self, _: &State, area: Rect) -> Rect {
        area
    }

    /// Draws text and cursors on `area` over the picture.
    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer);
}

pub(super) use posed::{ends as arm_ends, words as posed_words};

/// All panels, in the order of the tabs.
pub(super) const PANELS: &[&dyn Panel] = &[
    &map::Map,
    &time::Time,
    &mesh::Mesh,
    &recipe::Recipe,
    &details::Details,
];

/// Index of the map.
pub(super) const MAP: usize = 0;
/// Index of the signals over time.
pub(super) const TIME: usize = 1;
/// Index of the mesh.
pub(super) const MESH: usize = 2;
/// Index of the recipe.
pub(super) const RECIPE: usize = 3;
/// Index of the words about the loom.
pub(super) const DETAILS: usize = 4;

impl dyn Panel + '_ {
    /// The picture for `area` on the screen.
    pub(super) fn wish(&self, state: &State, area: Rect) -> Option<Wish> {
        if area.is_empty() {
            return None;
        }
        let text = if state.lettered() {
            0.72 * f32::from(state.cell.height) / f32::from(state.coarseness())
        } else {
            0.0
        };
        Some(Wish {
            subject: self.subject(state)?,
            size: state.pixels(area),
            text,
            fine: usize::from(state.cell.fine),
            coarse: state.coarseness() > 1,
            look: state.look,
        })
    }

    /// The picture for a file.
    pub(super) fn picture(&self, state: &State) -> Option<Wish> {
        let subject = self.subject(state)?;
        let size = if matches!(subject, Subject::Times(_) | Subject::Shares(_)) {
            (1280, 720)
        } else {
            (1280, 960)
        };
        Some(Wish {
            subject,
            size,
            text: 15.0,
            fine: 1,
            coarse: false,
            look: state.look,
        })
    }
}

/// Writes a read-out on the border below `area`, at its right end; nothing where it is too long.
fn read_out(state: &State, role: Role, text: &str, area: Rect, buffer: &mut Buffer) {
    let text = state.written(text.to_string());
    let wide = text.chars().count() as u16;
    if wide <= area.width {
        let style = state.look.style(role).patch(state.look.bar());
        buffer.set_string(area.right() - wide, area.bottom(), text, style);
    }
}

/// The cell of `area` that a point of a plane falls on; none outside the plane.
fn cell_of(picture: &Picture, plane: &Plane, point: [f64; 2], area: Rect) -> Option<(u16, u16)> {
    let [x, y] = plane.pixel(point);
    let box_ = plane.area;
    let inside = (box_.left - 1.0..=box_.left + box_.width + 1.0).contains(&x)
        && (box_.top - 1.0..=box_.top + box_.height + 1.0).contains(&y);
    let cell = |at: f32, pixels: usize, cells: u16| {
        let index = at / pixels.max(1) as f32 * f32::from(cells);
        (index.max(0.0) as u16).min(cells.saturating_sub(1))
    };
    inside.then(|| {
        (
            area.x + cell(x, picture.image.width, area.width),
            area.y + cell(y, picture.image.height, area.height),
        )
    })
}

#[cfg(test)]
mod snapshots;
#[cfg(test)]
mod tests;
