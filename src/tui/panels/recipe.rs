//! The recipe: its text, what is wrong with it at its line, and its parameters as sliders.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Widget};

use super::{Panel, RECIPE, hints};
use crate::diag::Diagnostic;
use crate::recipe::{Param, Setting};
use crate::tui::hands::{Held, Page, VALUE, share, slider};
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::Subject;

/// The recipe.
pub(super) struct Recipe;

impl Panel for Recipe {
    fn title(&self) -> &'static str {
        "recipe"
    }

    fn subject(&self, _: &State) -> Option<Subject> {
        None
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let (first, sliders, names) = slider(state, area);
        for row in sliders.rows() {
            let index = first + usize::from(row.y - sliders.y);
            draw_slider(state, index, names, row, buffer);
        }
        let above = Rect {
            height: area.height - sliders.height,
            ..area
        };
        draw_page(state, above, buffer);
    }
}

/// File, text with the error below its line, and what the run gave.
fn draw_page(state: &State, area: Rect, buffer: &mut Buffer) {
    let page = &state.hands.page;
    let Some(recipe) = &page.recipe else {
        return;
    };
    let told = told(state, page, area);
    let text = text(state, page, usize::from(area.width));
    let room = usize::from(area.height).saturating_sub(1 + told.len());
    let rows = text.len();
    let first = first_row(page, &text, room);
    let shown = text.into_iter().skip(first).take(room).map(|row| row.line);
    let name = recipe.path.file_name().unwrap_or(recipe.path.as_os_str());
    let name = name.to_string_lossy().into_owned();
    let more = rows.saturating_sub(first + room);
    let head = head(state, page, name, more);
    let lines: Vec<Line> = std::iter::once(head).chain(shown).chain(told).collect();
    let used = lines.len() as u16;
    Paragraph::new(lines).render(area, buffer);
    if page.error.is_none() && state.hands.pinning.is_some() {
        hints::draw(state, below(area, used), buffer);
    }
}

/// What is left of `area` below so many rows.
fn below(area: Rect, rows: u16) -> Rect {
    let rows = rows.min(area.height);
    Rect::new(area.x, area.y + rows, area.width, area.height - rows)
}

/// The file's name, whether it holds what is shown, and how much is below.
fn head(state: &State, page: &Page, name: String, below: usize) -> Line<'static> {
    let muted = state.look.style(Role::Muted);
    let mut spans = vec![Span::styled(name, muted)];
    if !page.saved {
        spans.push(Span::styled(" (not saved yet)", muted));
    }
    if page.offered.is_some() {
        let offer = " lost gestures: y takes them up, Y forgets them";
        spans.push(Span::styled(offer, state.look.style(Role::Accent)));
    }
    if page.running {
        spans.push(Span::styled(" running ..", state.look.style(Role::Mark)));
    }
    if below > 0 {
        spans.push(Span::styled(format!(" {below} rows below"), muted));
    }
    Line::from(spans)
}

/// A row of the panel and the line of the recipe (from 1) that it belongs to.
struct Row {
    of: usize,
    line: Line<'static>,
}

/// Columns before the text: the number of its line.
const NUMBER: usize = 4;

/// The text as rows: numbered lines, broken where they are too long, the error below its own.
fn text(state: &State, page: &Page, width: usize) -> Vec<Row> {
    let error = page.error.as_deref();
    let at = error.and_then(|error| here(page, error));
    let mut rows = Vec::new();
    // An error without a line of this text stands in front of it.
    if let (Some(error), None) = (error, at) {
        rows.extend(explained(state, error, 0, width));
    }
    for (index, line) in page.text().lines().enumerate() {
        let of = index + 1;
        let caret = (at == Some(of)).then(|| column(error, line, of));
        rows.extend(broken(state, line, of, width, caret));
        if let Some(error) = error.filter(|_| at == Some(of)) {
            rows.extend(explained(state, error, of, width));
        }
    }
    rows
}

/// Where in its line an error is, from 0: what is missing behind the last line is missed at its end.
fn column(error: Option<&Diagnostic>, line: &str, of: usize) -> usize {
    let place = error.map(|error| &error.place);
    match place {
        Some(place) if place.line == Some(of) => place.column.unwrap_or(1).saturating_sub(1),
        _ => line.chars().count(),
    }
}

/// A line of the recipe in rows, with a caret below one of its columns.
fn broken(state: &State, line: &str, of: usize, width: usize, caret: Option<usize>) -> Vec<Row> {
    let muted = state.look.style(Role::Muted);
    let touched = state.hands.page.touched == Some(of);
    let (mark, style) = if touched {
        ("▸", state.look.style(Role::Mark))
    } else {
        (" ", muted)
    };
    let code = split_comment(line).0.chars().count();
    let letters: Vec<char> = line.chars().collect();
    let room = width.saturating_sub(NUMBER).max(1);
    let parts = letters.len().max(1).div_ceil(room);
    let mut rows = Vec::new();
    for part in 0..parts {
        let range = part * room..((part + 1) * room).min(letters.len());
        let split = code.clamp(range.start, range.end);
        let number = if part == 0 {
            format!("{of:>3}{mark}")
        } else {
            " ".repeat(NUMBER)
        };
        let line = Line::from_iter([
            Span::styled(number, style),
            Span::raw(String::from_iter(&letters[range.start..split])),
            Span::styled(String::from_iter(&letters[split..range.end]), muted),
        ]);
        rows.push(Row { of, line });
        let below = caret.filter(|at| at / room == part || (part + 1 == parts && at / room > part));
        if let Some(at) = below {
            let caret = format!("{}^", " ".repeat(NUMBER + at - range.start));
            let line = Line::styled(caret, state.look.style(Role::Bad));
            rows.push(Row { of, line });
        }
    }
    rows
}

/// The line of the recipe that an error names, if it is one of this file.
fn here(page: &Page, error: &Diagnostic) -> Option<usize> {
    let file = error.place.file.as_ref()?;
    let own = page
        .recipe
        .as_ref()
        .is_some_and(|recipe| recipe.path == *file);
    // What is missing at the end is missed behind the last line.
    let last = page.text().lines().count();
    let line = error.place.line.map(|line| line.min(last));
    line.filter(|&line| own && line > 0)
}

/// The message and its hints.
fn explained(state: &State, error: &Diagnostic, of: usize, width: usize) -> Vec<Row> {
    let bad = state.look.style(Role::Bad);
    let mut lines = Vec::new();
    let mut message = error.message.clone();
    if of == 0
        && let Some(file) = &error.place.file
    {
        let line = error
            .place
            .line
            .map(|line| format!(":{line}"))
            .unwrap_or_default();
        message = format!("{}{line}: {message}", file.display());
    }
    lines.extend(
        wrapped(&message, width, "    ")
            .into_iter()
            .map(|row| (row, bad)),
    );
    let muted = state.look.style(Role::Muted);
    for hint in &error.hints {
        let hint = wrapped(&format!("hint: {hint}"), width, "    ");
        lines.extend(hint.into_iter().map(|row| (row, muted)));
    }
    let row = |(text, style): (String, Style)| Row {
        of,
        line: Line::styled(text, style),
    };
    lines.into_iter().map(row).collect()
}

/// Text in rows of at most `width` columns, broken between words.
fn wrapped(text: &str, width: usize, indent: &str) -> Vec<String> {
    let mut rows = vec![indent.to_string()];
    for word in text.split_whitespace() {
        let length = word.chars().count();
        let row = rows.last().map_or(0, |row| row.chars().count());
        if row > indent.len() && row + 1 + length > width {
            rows.push(indent.to_string());
        }
        if let Some(row) = rows.last_mut() {
            if row.len() > indent.len() {
                row.push(' ');
            }
            row.push_str(word);
        }
    }
    rows
}

/// Code, and the comment behind it.
fn split_comment(line: &str) -> (&str, &str) {
    let quoted = |at: usize| line[..at].matches('"').count() % 2 == 1;
    let start = line.match_indices("//").find(|(at, _)| !quoted(*at));
    line.split_at(start.map_or(line.len(), |(at, _)| at))
}

/// The first row that is shown: where the user scrolled, else so that the line that matters is in sight.
fn first_row(page: &Page, rows: &[Row], room: usize) -> usize {
    let most = rows.len().saturating_sub(room);
    if let Some(first) = page.scroll {
        return first.min(most);
    }
    let error = page.error.as_deref().and_then(|error| here(page, error));
    let Some(line) = error.or(page.touched) else {
        return 0;
    };
    let of_line = |row: &&Row| row.of == line;
    let start = rows.iter().position(|row| row.of == line).unwrap_or(0);
    let end = start + rows.iter().filter(of_line).count();
    end.saturating_sub(room).min(most)
}

/// What the run gave, as many rows as there is room for.
fn told(state: &State, page: &Page, area: Rect) -> Vec<Line<'static>> {
    let most = usize::from(area.height / 3);
    let muted = state.look.style(Role::Muted);
    let style = |text: &str| {
        if text.starts_with("warning") {
            state.look.style(Role::Mark)
        } else {
            muted
        }
    };
    let rows = page.told.iter().flat_map(|text| {
        wrapped(text, usize::from(area.width), "")
            .into_iter()
            .map(move |row| (row, style(text)))
    });
    rows.take(most)
        .map(|(row, style)| Line::styled(row, style))
        .collect()
}

fn draw_slider(state: &State, index: usize, names: u16, row: Rect, buffer: &mut Buffer) {
    let page = &state.hands.page;
    let Some(param) = page.params.get(index) else {
        return;
    };
    let value = match &state.hands.held {
        Some(Held::Slider(held, value)) if held.name == param.name => value,
        _ => &param.value,
    };
    let chosen = state.focus == RECIPE && page.chosen == index;
    let style = if chosen {
        state.look.style(Role::Accent)
    } else {
        Style::new()
    };
    let marker = if chosen { "▸" } else { " " };
    let name: String = param
        .name
        .chars()
        .take(usize::from(names.saturating_sub(3)))
        .collect();
    buffer.set_stringn(
        row.x,
        row.y,
        format!("{marker} {name}"),
        usize::from(row.width),
        style,
    );
    let width = row.width.saturating_sub(names + VALUE);
    draw_track(param, value, style, (row.x + names, row.y, width), buffer);
    let at = row.x + names + width;
    let room = usize::from(row.right().saturating_sub(at));
    buffer.set_stringn(
        at,
        row.y,
        format!(" {value}"),
        room,
        Style::new().add_modifier(Modifier::BOLD),
    );
}

/// The slider itself from a column on, so many columns wide.
fn draw_track(
    param: &Param,
    value: &Setting,
    style: Style,
    (x, y, width): (u16, u16, u16),
    buffer: &mut Buffer,
) {
    let (Some(share), true) = (share(param, value), width > 1) else {
        return;
    };
    let knob = (share * f64::from(width - 1)).round() as u16;
    for column in 0..width {
        let symbol = if column == knob { "●" } else { "─" };
        buffer.set_string(x + column, y, symbol, style);
    }
}
