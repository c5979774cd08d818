//! The whole screen, drawn from the state.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Modifier;
use ratatui::symbols::border::Set;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Clear, Paragraph, Widget};

use super::graphics::{Aside, Painter};
use super::keys::{self, ACTIONS};
use super::layout::{inner, tabbed, tabs};
use super::panels::{self, PANELS};
use super::state::{Content, Front, State};
use super::theme::Role;

/// Draws everything.
pub(super) fn draw(
    state: &State,
    painter: &mut dyn Painter,
    buffer: &mut Buffer,
    aside: &mut Aside,
) {
    let screen = buffer.area;
    if screen.is_empty() {
        return;
    }
    if tabbed(state.size) && !state.enlarged {
        draw_tabs(state, buffer);
    }
    for (index, area) in state.places() {
        draw_panel(
            state,
            index,
            area.intersection(screen),
            painter,
            buffer,
            aside,
        );
    }
    draw_status(state, buffer);
    match &state.front {
        Some(Front::Help(line)) => draw_help(state, *line, buffer),
        Some(Front::Palette(typed, chosen)) => draw_palette(state, typed, *chosen, buffer),
        None => {}
    }
}

fn draw_tabs(state: &State, buffer: &mut Buffer) {
    for (index, column, text) in tabs() {
        let mut style = state.look.style(Role::Muted);
        if index == state.focus {
            style = state
                .look
                .style(Role::Accent)
                .add_modifier(Modifier::REVERSED);
        }
        if column < buffer.area.width {
            buffer.set_string(column, 0, text, style);
        }
    }
}

fn draw_panel(
    state: &State,
    index: usize,
    area: Rect,
    painter: &mut dyn Painter,
    buffer: &mut Buffer,
    aside: &mut Aside,
) {
    let role = if index == state.focus {
        Role::Accent
    } else {
        Role::Muted
    };
    let panel = PANELS[index];
    Block::bordered()
        .border_set(borders(state))
        .title(format!(" {} ", panel.title_of(state)))
        .border_style(state.look.style(role))
        .render(area, buffer);
    let inside = inner(area);
    if inside.is_empty() {
        return;
    }
    if let Some(picture) = &state.slots[index].shown {
        let canvas = state.canvas(index, area);
        painter.paint(index, &picture.image, canvas, buffer, aside);
    } else if panel.subject(state).is_none() {
        let text = waiting(state, index);
        Paragraph::new(text)
            .style(state.look.style(Role::Muted))
            .render(inside, buffer);
    }
    panel.draw(state, inside, buffer);
}

/// Lines around panels.
fn borders(state: &State) -> Set<'static> {
    if !state.plain_letters {
        return ratatui::symbols::border::PLAIN;
    }
    Set {
        top_left: "+",
        top_right: "+",
        bottom_left: "+",
        bottom_right: "+",
        vertical_left: "|",
        vertical_right: "|",
        horizontal_top: "-",
        horizontal_bottom: "-",
    }
}

/// What a panel without a picture waits for.
fn waiting(state: &State, index: usize) -> &'static str {
    match state.content {
        _ if [super::panels::DETAILS, super::panels::RECIPE].contains(&index) => "",
        _ if state.work.is_none() => "nothing to show",
        Content::Nothing | Content::FirstFrame(_) => "reading ..",
        _ => "fitting ..",
    }
}

/// The last row: what is open, where we are, how well it fits, and what happens.
fn draw_status(state: &State, buffer: &mut Buffer) {
    let row = buffer.area.height - 1;
    let area = Rect::new(0, row, buffer.area.width, 1);
    let mut parts = place_words(state);
    parts.extend(loom_words(state));
    parts.extend(panels::posed_words(state).map(|words| (2, Span::raw(words))));
    parts.extend(happening(state).into_iter().map(|span| (0, span)));
    Paragraph::new(Line::from(fitting(parts, usize::from(area.width))))
        .style(state.look.bar())
        .render(area, buffer);
}

/// A part of the status line: where there is no room for all, those of the highest number go first; 0 stays.
type Part = (u8, Span<'static>);

/// What is open, and where in it we are.
fn place_words(state: &State) -> Vec<Part> {
    let playback = &state.playback;
    let muted = state.look.style(Role::Muted);
    let sign = match (playback.playing, state.plain_letters) {
        (true, false) => " ▶ ",
        (false, false) => " ∎ ",
        (true, true) => " > ",
        (false, true) => " . ",
    };
    let rate = format!("{:.4} fps x{} ", Short(state.fps()), playback.speed);
    let seconds = format!("{:.2} s ", (playback.t - 1.0) / state.fps());
    let frame = format!("frame {:.2}/{} ", playback.t, state.frames());
    vec![
        (0, Span::styled(sign, state.look.style(Role::Accent))),
        (0, Span::raw(format!("{} ", state.name))),
        (0, Span::raw(frame)),
        (3, Span::styled(seconds, muted)),
        (
            if playback.speed == 1.0 { 4 } else { 2 },
            Span::styled(rate, muted),
        ),
    ]
}

/// The sizes of the loom, and how far it is from its frames.
fn loom_words(state: &State) -> Vec<Part> {
    let Some(loom) = state.loom() else {
        return Vec::new();
    };
    let (k, l) = (loom.time().controls().len(), loom.pose().sites().len());
    let m = loom.shape().modes();
    let error = 100.0 * loom.report().error.total;
    let muted = state.look.style(Role::Muted);
    vec![
        (2, Span::raw(format!("k={k} l={l} m={m} "))),
        (1, Span::styled(format!("error {error:.3} % "), muted)),
    ]
}

/// The work in the background, what is in hand, and a word to the user.
fn happening(state: &State) -> Vec<Span<'static>> {
    let mut spans = Vec::new();
    if let Some((phase, done, steps)) = state.work {
        let share = if steps > 0 {
            format!(" {} {done}/{steps}", progress_bar(state, done, steps))
        } else {
            String::new()
        };
        let words = format!("{phase}{share} ");
        spans.push(Span::styled(words, state.look.style(Role::Mark)));
    }
    if let Some(held) = &state.hands.held {
        let words = format!("{}: enter lets go, esc puts back ", held.words());
        spans.push(Span::styled(words, state.look.style(Role::Accent)));
    }
    if let Some(notice) = &state.notice {
        let role = if notice.bad { Role::Bad } else { Role::Mark };
        let style = state.look.style(role);
        spans.push(Span::styled(notice.text.clone(), style));
    } else if state.hands.held.is_none() {
        let muted = state.look.style(Role::Muted);
        spans.push(Span::styled("? keys  q quit", muted));
    }
    spans
}

/// Cells of a progress bar.
const BAR: usize = 10;

/// How much of the work is done, as cells.
fn progress_bar(state: &State, done: usize, steps: usize) -> String {
    let full = (BAR * done.min(steps)).div_euclid(steps.max(1));
    let [one, other] = if state.plain_letters {
        ["#", "."]
    } else {
        ["━", "╌"]
    };
    [one.repeat(full), other.repeat(BAR - full)].concat()
}

/// The parts that a line of `width` columns has room for.
fn fitting(mut parts: Vec<Part>, width: usize) -> Vec<Span<'static>> {
    while parts.iter().map(|(_, span)| span.width()).sum::<usize>() > width {
        let most = (0..parts.len()).max_by_key(|&index| parts[index].0);
        match most.filter(|&index| parts[index].0 > 0) {
            Some(index) => drop(parts.remove(index)),
            None => break,
        }
    }
    parts.into_iter().map(|(_, span)| span).collect()
}

/// A number without digits that say nothing.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let text = format!("{:.2}", self.0);
        f.write_str(text.trim_end_matches('0').trim_end_matches('.'))
    }
}

/// A box in the middle of the screen with an empty inside.
fn front(state: &State, title: &str, size: (u16, u16), buffer: &mut Buffer) -> Rect {
    let screen = buffer.area;
    let (width, height) = (size.0.min(screen.width), size.1.min(screen.height));
    let left = (screen.width - width) / 2;
    let top = (screen.height - height) / 2;
    let area = Rect::new(left, top, width, height);
    Clear.render(area, buffer);
    Block::bordered()
        .border_set(borders(state))
        .title(format!(" {title} "))
        .border_style(state.look.style(Role::Accent))
        .style(state.look.front())
        .render(area, buffer);
    inner(area)
}

fn binding_line(state: &State, binding: &keys::Binding) -> Line<'static> {
    let keys = format!("{:>18}  ", binding.keys.join(" "));
    Line::from_iter([
        Span::styled(keys, state.look.style(Role::Accent)),
        Span::raw(binding.about),
    ])
}

fn draw_help(state: &State, line: u16, buffer: &mut Buffer) {
    let height = (ACTIONS.len() + MOUSE.len() + 2) as u16;
    let inside = front(state, "keys and mouse", (78, height), buffer);
    let mouse = MOUSE.iter().map(|(what, about)| {
        Line::from_iter([
            Span::styled(format!("{what:>18}  "), state.look.style(Role::Mark)),
            Span::raw(*about),
        ])
    });
    let keys = ACTIONS.iter().map(|binding| binding_line(state, binding));
    let lines: Vec<Line> = keys.chain(mouse).collect();
    Paragraph::new(lines)
        .scroll((line, 0))
        .render(inside, buffer);
}

/// What the mouse does, for the help.
const MOUSE: &[(&str, &str)] = &[
    ("left, curve", "to that time; drag to scrub"),
    ("left, map", "the pose there"),
    ("left, signals", "to that time; drag to scrub"),
    ("left, mesh", "drag to turn"),
    ("left, control", "drag a control point, or a pin"),
    ("alt/middle, map", "drag the frame there: it is pinned"),
    ("right, map", "drag to move"),
    ("right, signals", "drag that moment to another time"),
    ("alt/middle, signals", "drag over the loop to mark it"),
    ("left, recipe", "drag a slider"),
    (
        "wheel",
        "closer, farther; on the signals a frame on or back",
    ),
];

fn draw_palette(state: &State, typed: &str, chosen: usize, buffer: &mut Buffer) {
    let found = keys::find(typed);
    let inside = front(state, "find an action", (78, 16), buffer);
    if inside.height == 0 {
        return;
    }
    let mut lines = vec![Line::raw(format!(": {typed}_"))];
    let rows = usize::from(inside.height).saturating_sub(1);
    let first = (chosen + 1).saturating_sub(rows);
    for (index, binding) in found.iter().enumerate().skip(first) {
        let line = binding_line(state, binding);
        let picked = index == chosen;
        lines.push(if picked {
            line.patch_style(Modifier::REVERSED)
        } else {
            line
        });
    }
    Paragraph::new(lines).render(inside, buffer);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_spare_leaves_the_status_line_first() {
        let parts = || vec![(0, "a b"), (2, "cc"), (3, "dddd"), (1, "e"), (0, "f")];
        let shown = |width| {
            let parts = parts()
                .into_iter()
                .map(|(rank, text)| (rank, Span::raw(text)));
            let spans = fitting(parts.collect(), width);
            spans.iter().map(|span| &*span.content).collect::<String>()
        };
        assert_eq!(shown(11), "a bccddddef");
        assert_eq!(shown(10), "a bccef");
        assert_eq!(shown(6), "a bef");
        assert_eq!(shown(2), "a bf");
    }
}
