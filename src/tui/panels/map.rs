//! The map: the curve of the time signal in pose space.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;

use super::{MAP, Panel, cell_of, gutter, hand, posed, read_out};
use crate::plot::Plane;
use crate::tui::state::{Content, State};
use crate::tui::theme::Role;
use crate::tui::thumbs::ThumbWish;
use crate::tui::work::{Picture, Subject};

/// The map.
pub(in crate::tui) struct Map;

impl Panel for Map {
    fn title(&self) -> &'static str {
        "pose space"
    }

    fn title_of(&self, state: &State) -> &'static str {
        posed::map_title(state).unwrap_or(self.title())
    }

    fn subject(&self, state: &State) -> Option<Subject> {
        let signals = state.signals()?.clone();
        let span = state.span();
        let marked = state.playback.marks.iter().any(Option::is_some) && span.from < span.to;
        let marked = marked.then_some([span.from, span.to]);
        let thumbs = state.thumbs.shown.clone();
        Some(Subject::Map {
            signals,
            window: state.window,
            span: hand::support(state).or(marked),
            thumbs: thumbs.filter(|_| !state.thumbs.off && state.loom().is_some()),
            arms: posed::arms(state),
        })
    }

    fn canvas(&self, state: &State, area: Rect) -> Rect {
        gutter::canvas(state, area)
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let Some(picture) = &state.slots[MAP].shown else {
            return;
        };
        let canvas = self.canvas(state, area);
        gutter::draw(state, picture, area, canvas, buffer);
        let (panel, area) = (area, canvas);
        draw_marks(state, area, buffer);
        posed::draw_numbers(state, picture, area, buffer);
        if let Some((frame, at)) = hovered_frame(state, area) {
            let text = posed::named(state, frame).unwrap_or(format!(" frame {frame} "));
            let wide = text.chars().count() as u16;
            let left = (at.0 + 2)
                .min(area.right().saturating_sub(wide))
                .max(area.x);
            let row = if at.1 > area.y { at.1 - 1 } else { at.1 + 1 };
            if wide <= area.width && row < area.bottom() {
                let style = state.look.style(Role::Mark).patch(state.look.bar());
                buffer.set_string(left, row, text, style);
            }
        }
        let (Some(plane), Some(at)) = (picture.planes.first(), state.cursor()) else {
            return;
        };
        if let Some(cell) = cell_of(picture, plane, at, area).and_then(|at| buffer.cell_mut(at)) {
            let symbol = match (state.roaming.is_some(), state.plain_letters) {
                (true, false) => "✛",
                (true, true) => "X",
                (false, false) => "●",
                (false, true) => "O",
            };
            cell.set_symbol(symbol)
                .set_style(state.look.style(Role::Accent));
        }
        hand::draw(state, picture, plane, area, buffer);
        let [x, y] = at;
        let place = match (state.roaming.is_some(), state.loom().is_some()) {
            (true, true) => "g at",
            (false, true) => "f(t) =",
            (_, false) => "at",
        };
        let text = format!(" {place} {x:.4}, {y:.4} ");
        read_out(state, Role::Muted, &text, panel, buffer);
    }
}

/// Sites and control points of what the picture shows as letters, where there are few pixels; and pins, also
/// where the picture leaves them out: once the time is edited.
fn draw_marks(state: &State, canvas: Rect, buffer: &mut Buffer) {
    let Some(picture) = &state.slots[MAP].shown else {
        return;
    };
    let (Some(plane), Some(signals)) = (picture.planes.first(), &picture.of) else {
        return;
    };
    let theme = state.look.plot(0.0);
    let map = &signals.0.map;
    let pinning = state.hands.pinning.as_ref();
    let pins = pinning
        .into_iter()
        .flat_map(|of| &of.fitted.0.layout().pins);
    let pins: Vec<[f64; 2]> = match map.pins.as_slice() {
        [] => pins.map(|pin| pin.1).collect(),
        shown => shown.iter().map(|pin| pin.1).collect(),
    };
    let marks = [
        ("∘", theme.series[0], &map.sites, !state.lettered()),
        ("+", theme.series[1], &map.controls, !state.lettered()),
        (
            "◆",
            theme.series[3],
            &pins,
            !state.lettered() || map.pins.is_empty(),
        ),
    ];
    let marks = marks.into_iter().filter(|mark| mark.3);
    for (symbol, colour, points, _) in marks {
        let [red, green, blue, _] = colour.0;
        for &point in points {
            let at = cell_of(picture, plane, point, canvas);
            if let Some(cell) = at.and_then(|at| buffer.cell_mut(at)) {
                let symbol = if state.plain_letters {
                    plain(symbol)
                } else {
                    symbol
                };
                cell.set_symbol(symbol);
                cell.set_fg(state.look.colour([red, green, blue]));
            }
        }
    }
}

/// The same without letters that a font may lack.
fn plain(symbol: &str) -> &str {
    match symbol {
        "∘" => "o",
        "◆" => "^",
        other => other,
    }
}

/// Least pixels of the largest small meshes, and where pictures have few pixels.
const LEAST: f64 = 64.0;
const LEAST_COARSE: f64 = 48.0;

/// The small meshes that the map as it is shown wants; none without a picture that could show them.
pub(in crate::tui) fn thumbs(state: &State) -> Option<ThumbWish> {
    let Content::Loom(scene, _) = &state.content else {
        return None;
    };
    let picture = state.slots[MAP].shown.as_ref()?;
    let plane = picture.planes.first()?;
    if picture.coarse || state.rough {
        return None;
    }
    if state.thumbs.off || !state.cell.shades || !state.places().iter().any(|place| place.0 == MAP)
    {
        return None;
    }
    let least = if state.lettered() {
        LEAST
    } else {
        LEAST_COARSE
    };
    let width = f64::from(plane.area.width);
    let window = [plane.x.range, plane.y.range];
    (width > least).then(|| {
        ThumbWish::new(
            scene.clone(),
            window,
            (width, least),
            state.mesh,
            state.look,
        )
    })
}

/// A frame is under the mouse where it is at most so many columns away.
const REACH: f32 = 1.5;

/// The frame under the mouse, from 1, and the cell of the mouse.
fn hovered_frame(state: &State, canvas: Rect) -> Option<(usize, (u16, u16))> {
    let at = state.hover.filter(|&at| canvas.contains(at.into()))?;
    let picture = state.slots[MAP].shown.as_ref()?;
    let plane = picture.planes.first()?;
    let pixel = picture.pixel(canvas, at);
    let column = picture.image.width as f32 / f32::from(canvas.width.max(1));
    let frames = picture.of.as_ref()?.0.map.frames.iter().enumerate();
    let distances = frames.map(|(index, &place)| {
        let [x, y] = plane.pixel(place);
        (index + 1, (x - pixel[0]).hypot(y - pixel[1]))
    });
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (nearest.1 <= REACH * column).then_some((nearest.0, at))
}

/// The part of the map that is shown: x range, y range.
pub(in crate::tui) fn window(state: &State) -> [[f64; 2]; 2] {
    let shown = || {
        let plane = state.slots[MAP].shown.as_ref()?.planes.first()?;
        Some([plane.x.range, plane.y.range])
    };
    state.window.or_else(shown).unwrap_or([[0.0, 1.0]; 2])
}

/// The time at which the curve comes closest to a pixel, if it comes within `reach` pixels; without a
/// curve, the nearest of the frames.
pub(in crate::tui) fn nearest_time(
    picture: &Picture,
    plane: &Plane,
    at: [f32; 2],
    reach: f32,
) -> Option<f64> {
    let map = &picture.of.as_ref()?.0.map;
    let distance = |point: &[f64; 2]| {
        let [x, y] = plane.pixel(*point);
        (x - at[0]).hypot(y - at[1])
    };
    let on_curve = map
        .times
        .iter()
        .copied()
        .zip(map.curve.iter().map(distance));
    let frames = map.frames.iter().map(distance).enumerate();
    let frames = frames.map(|(index, distance)| (index as f64 + 1.0, distance));
    let nearest = match map.curve.is_empty() {
        true => frames.min_by(|(_, a), (_, b)| a.total_cmp(b)),
        false => on_curve.min_by(|(_, a), (_, b)| a.total_cmp(b)),
    }?;
    (nearest.1 <= reach).then_some(nearest.0)
}
