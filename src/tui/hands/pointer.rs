//! What the mouse does by hand: it takes what lies under it, moves it, and lets it go.

use ratatui::crossterm::event::{KeyModifiers, MouseButton, MouseEvent, MouseEventKind};
use ratatui::layout::Rect;

use super::act::{pinnable, scroll, take_moment};
use super::held::{Held, Spot, cancel, drop, shift, take};
use super::{keys, sliders};
use crate::tui::event::Command;
use crate::tui::panels::{MAP, RECIPE, TIME};
use crate::tui::state::State;
use crate::tui::update::{scrub, under};
use crate::tui::work::Picture;

/// Control points this near are taken, in cells.
const REACH: f64 = 1.0;
/// Frames this near are pinned, in cells.
const PIN_REACH: f64 = 2.5;
/// A control point goes before the curve unless the curve is nearer by this, in cells: in its own cell it
/// always does.
const HEAD_START: f64 = 0.75;
/// Points of a sketch lie this far apart, in cells.
const STRIDE: f64 = 2.5;

/// What the mouse means for the hands; none where it means what it always means.
pub(in crate::tui) fn mouse(state: &mut State, mouse: MouseEvent) -> Option<Vec<Command>> {
    match mouse.kind {
        MouseEventKind::Down(button) => press(state, mouse, button),
        MouseEventKind::Drag(_) => drag(state, mouse),
        MouseEventKind::Up(_) => release(state, mouse),
        MouseEventKind::ScrollUp | MouseEventKind::ScrollDown => {
            let (panel, _) = under(state, mouse)?;
            if panel != RECIPE {
                return None;
            }
            let up = mouse.kind == MouseEventKind::ScrollUp;
            scroll(state, if up { -3 } else { 3 });
            Some(Vec::new())
        }
        MouseEventKind::Moved | MouseEventKind::ScrollLeft | MouseEventKind::ScrollRight => None,
    }
}

fn press(state: &mut State, mouse: MouseEvent, button: MouseButton) -> Option<Vec<Command>> {
    let (panel, area) = under(state, mouse)?;
    let area = state.canvas(panel, area);
    if panel == RECIPE {
        return press_recipe(state, area, mouse);
    }
    let sketching = matches!(state.hands.held, Some(Held::Sketch(..)));
    if !sketching {
        cancel(state);
    }
    state.hands.good.as_ref()?;
    let picture = state.slots[panel].shown.clone()?;
    let spot = Pointed::at(&picture, area, mouse)?;
    let aside = button == MouseButton::Middle
        || mouse
            .modifiers
            .intersects(KeyModifiers::ALT | KeyModifiers::CONTROL);
    if keys::press(state, panel, &spot, button, aside) {
        return Some(taken(state, panel));
    }
    match (panel, button) {
        (TIME, MouseButton::Right) | (MAP, _) if state.loom().is_none() => return None,
        (MAP, MouseButton::Left) if sketching => {
            state.hands.held = Some(Held::Sketch(vec![spot.place], true));
            state.roaming = Some(spot.place);
        }
        (MAP, _) if aside => take_frame(state, &spot),
        (MAP, MouseButton::Left) => {
            return take_handle(state, &spot, area, mouse).then(|| taken(state, panel));
        }
        (TIME, MouseButton::Right) => take_moment(state, spot.place[0]),
        (TIME, _) if aside => take(state, Held::Marks(spot.place[0])),
        _ => return None,
    }
    Some(taken(state, panel))
}

fn taken(state: &mut State, panel: usize) -> Vec<Command> {
    state.focus = panel;
    state.drag = None;
    Vec::new()
}

fn press_recipe(state: &mut State, area: Rect, mouse: MouseEvent) -> Option<Vec<Command>> {
    let (index, _) = sliders::under(state, area, mouse.column, mouse.row)?;
    state.focus = RECIPE;
    state.drag = None;
    let page = &mut state.hands.page;
    page.chosen = index;
    let param = page.params[index].clone();
    let value = param.value.clone();
    take(state, Held::Slider(param, value));
    Some(sliders::slide(state, area, mouse.column))
}

fn drag(state: &mut State, mouse: MouseEvent) -> Option<Vec<Command>> {
    let panel = match state.hands.held.as_ref()? {
        Held::Slider(..) => RECIPE,
        Held::Moment(_) | Held::Marks(_) => TIME,
        Held::Control(..) | Held::Pin(..) | Held::Sketch(_, true) => MAP,
        Held::Sketch(_, false) => return None,
        Held::Key(held) => held.panel()?,
    };
    let (_, area) = state.places().into_iter().find(|(at, _)| *at == panel)?;
    let area = state.canvas(panel, area);
    if panel == RECIPE {
        return Some(sliders::slide(state, area, mouse.column));
    }
    let picture = state.slots[panel].shown.clone()?;
    let spot = Pointed::at(&picture, area, mouse)?;
    let [x, y] = spot.place;
    if matches!(state.hands.held, Some(Held::Key(_))) {
        return Some(keys::dragged(state, [x, y]));
    }
    if let Some(Held::Marks(from)) = state.hands.held {
        let last = state.frames() as f64;
        let frames = [from.min(x), from.max(x)].map(|t| state.off_axis(t));
        let ends = frames.map(|t| Some(t.round().clamp(1.0, last)));
        state.playback.marks = ends;
        return Some(Vec::new());
    }
    if let Some(Held::Sketch(points, _)) = &state.hands.held {
        state.roaming = Some([x, y]);
        let near = points
            .last()
            .is_some_and(|last| spot.distance(*last) < STRIDE);
        if near {
            return Some(Vec::new());
        }
    }
    Some(shift(state, [x, y], x))
}

fn release(state: &mut State, mouse: MouseEvent) -> Option<Vec<Command>> {
    match state.hands.held.as_ref()? {
        Held::Sketch(_, false) => None,
        Held::Key(_) => Some(keys::let_go(state)),
        Held::Control(..) if !state.hands.held.as_ref()?.moved() => {
            // A click goes to the time there, as anywhere on the curve.
            cancel(state);
            click(state, mouse);
            Some(Vec::new())
        }
        Held::Sketch(..) => {
            state.roaming = None;
            Some(drop(state))
        }
        _ => Some(drop(state)),
    }
}

fn click(state: &mut State, mouse: MouseEvent) {
    let spot = || {
        let (panel, area) = under(state, mouse).filter(|(panel, _)| *panel == MAP)?;
        let picture = state.slots[panel].shown.as_ref()?;
        let spot = Pointed::at(picture, state.canvas(panel, area), mouse)?;
        nearest_on_curve(&spot)
    };
    if let Some((t, _)) = spot() {
        scrub(state, t);
    }
}

/// A pin or a control point under the mouse, as the picture shows them.
fn handle(state: &State, spot: &Pointed) -> Option<Held> {
    let pins = state
        .hands
        .pinning
        .as_ref()
        .map(|pins| &pins.fitted.0.layout().pins);
    let places = pins.into_iter().flatten().map(|(_, at)| *at);
    if let Some((index, _)) = nearest(places, spot).filter(|(_, distance)| *distance <= REACH) {
        let &(frame, at) = pins?.get(index)?;
        return Some(Held::Pin(frame, Spot::still(at)));
    }
    let seen = &spot.picture.of.as_ref()?.0.map.controls;
    let to_curve = nearest_on_curve(spot).map_or(f64::INFINITY, |(_, distance)| distance);
    let near =
        |(_, distance): &(usize, f64)| *distance <= REACH && *distance <= to_curve + HEAD_START;
    let (index, _) = nearest(seen.iter().copied(), spot).filter(near)?;
    let now = state.loom()?.time().controls();
    // The loom may have become another since the picture was drawn.
    let index = if now.len() == seen.len() {
        index
    } else {
        let away = |at: &[f64; 2]| (at[0] - spot.place[0]).hypot(at[1] - spot.place[1]);
        (0..now.len()).min_by(|&a, &b| away(&now[a]).total_cmp(&away(&now[b])))?
    };
    Some(Held::Control(index, Spot::still(*now.get(index)?)))
}

/// What is under the mouse comes into the hand: of the map that is shown, or of the one that was there when
/// the hand set out.
fn take_handle(state: &mut State, spot: &Pointed, area: Rect, mouse: MouseEvent) -> bool {
    let before = state.slots[MAP].before.clone();
    let earlier = || {
        let spot = Pointed::at(before.as_deref()?, area, mouse)?;
        handle(state, &spot)
    };
    let Some(held) = handle(state, spot).or_else(earlier) else {
        return false;
    };
    take(state, held);
    true
}

/// The frame under the mouse comes into the hand as a pin.
fn take_frame(state: &mut State, spot: &Pointed) {
    let Some(fitted) = pinnable(state) else {
        return;
    };
    let places = &fitted.0.layout().positions;
    let found = nearest(places.iter().copied(), spot);
    if let Some((frame, _)) = found.filter(|(_, distance)| *distance <= PIN_REACH) {
        take(state, Held::Pin(frame, Spot::still(places[frame])));
    }
}

/// The time at which the curve comes closest, and its distance in cells.
fn nearest_on_curve(spot: &Pointed) -> Option<(f64, f64)> {
    let map = &spot.picture.of.as_ref()?.0.map;
    let (index, distance) = nearest(map.curve.iter().copied(), spot)?;
    Some((*map.times.get(index)?, distance))
}

fn nearest(points: impl Iterator<Item = [f64; 2]>, spot: &Pointed) -> Option<(usize, f64)> {
    let distances = points.map(|point| spot.distance(point)).enumerate();
    distances.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// Where the mouse points in the first plane of a picture.
pub(super) struct Pointed<'a> {
    picture: &'a Picture,
    /// Pixels of a cell, across and down.
    cell: [f32; 2],
    at: [f32; 2],
    /// The same in the plane's data.
    pub(super) place: [f64; 2],
}

impl<'a> Pointed<'a> {
    fn at(picture: &'a Picture, area: Rect, mouse: MouseEvent) -> Option<Self> {
        let plane = picture.planes.first()?;
        let at = picture.pixel(area, (mouse.column, mouse.row));
        let place = plane.data(at);
        let cells = [area.width.max(1), area.height.max(1)].map(f32::from);
        let pixels = [picture.image.width as f32, picture.image.height as f32];
        place.iter().all(|x| x.is_finite()).then_some(Pointed {
            picture,
            cell: [pixels[0] / cells[0], pixels[1] / cells[1]],
            at,
            place,
        })
    }

    /// How far a point of the data is, in cells; half as much upright, where cells are twice as long.
    pub(super) fn distance(&self, point: [f64; 2]) -> f64 {
        let Some(plane) = self.picture.planes.first() else {
            return f64::INFINITY;
        };
        let [x, y] = plane.pixel(point);
        let across = (x - self.at[0]) / self.cell[0];
        let down = (y - self.at[1]) / self.cell[1];
        f64::from(across.hypot(down))
    }
}
