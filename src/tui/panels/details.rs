//! What the fit said about itself, in words.

use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::Style;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Paragraph, Widget, Wrap};

use super::{Panel, posed};
use crate::loom::Loom;
use crate::tui::state::State;
use crate::tui::theme::Role;
use crate::tui::work::Subject;

/// Words about the loom.
pub(super) struct Details;

impl Panel for Details {
    fn title(&self) -> &'static str {
        "loom"
    }

    fn subject(&self, _: &State) -> Option<Subject> {
        None
    }

    fn draw(&self, state: &State, area: Rect, buffer: &mut Buffer) {
        let muted = state.look.style(Role::Muted);
        let Some(loom) = state.loom() else {
            let known = posed::facts(state).into_iter().flatten();
            let mut lines: Vec<Line> = known.map(|fact| told(muted, fact)).collect();
            if lines.is_empty() {
                lines.push(Line::styled("no loom yet", muted));
            }
            return Paragraph::new(lines)
                .wrap(Wrap { trim: false })
                .render(area, buffer);
        };
        let told = loom.report().spans.len() + loom.report().warnings.len();
        let facts = facts(loom);
        let short = |(_, value): &(_, String)| NAME + value.chars().count() < usize::from(COLUMN);
        let low = usize::from(area.height) < facts.len() + told;
        let low = low && area.width >= 2 * COLUMN && facts.iter().all(short);
        let columns = if low { 2 } else { 1 };
        let rows = facts.len().div_ceil(columns);
        let fact = |(name, value): &(&'static str, String)| {
            let width = usize::from(COLUMN) - NAME - 1;
            let name = Span::styled(format!("{name:<NAME$}"), muted);
            [name, Span::raw(format!("{value:<width$} "))]
        };
        let facts = (0..rows).map(|row| {
            let across = facts.iter().skip(row).step_by(rows);
            Line::from_iter(across.flat_map(fact))
        });
        let lines: Vec<Line> = facts.chain(remarks(state, loom)).collect();
        Paragraph::new(lines)
            .wrap(Wrap { trim: false })
            .render(area, buffer);
    }
}

/// Letters of a fact's name, and of name and value.
const NAME: usize = 17;
const COLUMN: u16 = 27;

fn told(muted: Style, (name, value): (String, String)) -> Line<'static> {
    Line::from_iter([Span::styled(format!("{name:<18}"), muted), Span::raw(value)])
}

/// What the fit advises and warns of.
fn remarks(state: &State, loom: &Loom) -> impl Iterator<Item = Line<'static>> {
    let (mark, bad) = (state.look.style(Role::Mark), state.look.style(Role::Bad));
    let report = loom.report();
    let advice = report.spans.iter();
    let advice = advice.map(move |span| Line::styled(span.advice(), mark));
    let warnings = report.warnings.iter();
    advice.chain(warnings.map(move |warning| Line::styled(format!("warning: {warning}"), bad)))
}

fn facts(loom: &Loom) -> Vec<(&'static str, String)> {
    let report = loom.report();
    let percent = |value: f64| format!("{:.4} %", 100.0 * value);
    vec![
        ("frames", loom.frames().to_string()),
        ("vertices", loom.topology().vertices().to_string()),
        ("faces", loom.topology().faces().to_string()),
        ("shape space", report.space.clone()),
        ("control points k", loom.time().controls().len().to_string()),
        ("sites l", loom.pose().sites().len().to_string()),
        ("modes m", loom.shape().modes().to_string()),
        ("error, shape", percent(report.error.shape)),
        ("error, pose", percent(report.error.pose)),
        ("error, time", percent(report.error.time)),
        ("error, total", percent(report.error.total)),
        ("stress", format!("{:.4}", report.stress)),
    ]
}
