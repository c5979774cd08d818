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
        let lines: Vec<Line> = match state.loom() {
            None => match posed::facts(state) {
                Some(facts) => facts.into_iter().map(|fact| told(muted, fact)).collect(),
                None => vec![Line::styled("no loom yet", muted)],
            },
            Some(loom) => facts(loom)
                .into_iter()
                .map(|(name, value)| told(muted, (name.to_string(), value)))
                .chain(
                    loom.report()
                        .spans
                        .iter()
                        .map(|span| Line::styled(span.advice(), state.look.style(Role::Mark))),
                )
                .chain(loom.report().warnings.iter().map(|warning| {
                    Line::styled(format!("warning: {warning}"), state.look.style(Role::Bad))
                }))
                .collect(),
        };
        Paragraph::new(lines)
            .wrap(Wrap { trim: false })
            .render(area, buffer);
    }
}

fn told(muted: Style, (name, value): (String, String)) -> Line<'static> {
    Line::from_iter([Span::styled(format!("{name:<18}"), muted), Span::raw(value)])
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
