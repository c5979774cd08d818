//! How reports for people look: aligned names and values, numbers short enough to read.

use std::path::PathBuf;

use super::print::Style;
use crate::loom::report::Span;
use crate::pipeline::{Plan, Saved};

/// So many stretches that go astray are listed.
const ASTRAY: usize = 5;

/// A title and its rows, the values aligned.
pub(super) fn table(style: Style, title: &str, rows: &[(&str, String)]) -> String {
    let widest = rows.iter().map(|(name, _)| name.chars().count()).max();
    let width = widest.unwrap_or(0) + 2;
    let mut text = format!("{}\n", style.bold(title));
    for (name, value) in rows {
        text.push_str(&format!("  {name:<width$}{value}\n"));
    }
    text
}

/// Three significant digits, or as many as an integer has.
pub(super) fn number(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let magnitude = value.abs().log10().floor() as i32;
    match magnitude {
        -4..=2 => format!("{value:.*}", (2 - magnitude) as usize),
        3..=8 => format!("{value:.0}"),
        _ => format!("{value:.2e}"),
    }
}

/// A percentage; `of` says what was undefined where the number is.
pub(super) fn percent(value: f64) -> String {
    format!("{} %", number(value))
}

/// `26.1 MB`, in powers of 1000.
pub(super) fn bytes(count: u64) -> String {
    let units = ["B", "kB", "MB", "GB", "TB"];
    let step = (0..units.len() - 1)
        .find(|&step| count < 1000u64.pow(step as u32 + 1))
        .unwrap_or(units.len() - 1);
    match step {
        0 => format!("{count} B"),
        _ => format!(
            "{:.1} {}",
            count as f64 / 1000f64.powi(step as i32),
            units[step]
        ),
    }
}

/// `1 file`, `2 files`.
pub(super) fn count(number: usize, one: &str) -> String {
    let plural = if number == 1 { "" } else { "s" };
    format!("{number} {one}{plural}")
}

/// A row for each stretch of a motion that leaves the way of its frames, the worst first.
pub(super) fn astray(spans: &[Span]) -> Vec<(&'static str, String)> {
    let rows = spans.iter().take(ASTRAY);
    rows.map(|span| ("astray", span.advice())).collect()
}

/// What was written where.
pub(super) fn saved(style: Style, saved: &Saved) -> String {
    let place = match saved.outputs.as_slice() {
        [] => "nothing".to_string(),
        [one] => one.display().to_string(),
        [first, .., last] => format!("{} .. {}", first.display(), last.display()),
    };
    let mut rows = vec![("frames", saved.frames.to_string())];
    if !saved.removed.is_empty() {
        rows.push((
            "removed",
            format!("{} of an earlier, longer run", saved.removed.len()),
        ));
    }
    table(style, &place, &rows)
}

/// Files in a row by the first, the last and their number.
pub(super) fn files(files: &[PathBuf]) -> String {
    match files {
        [] => "nothing".to_string(),
        [one] => one.display().to_string(),
        [first, .., last] => format!(
            "{} .. {} ({})",
            first.display(),
            last.display(),
            files.len()
        ),
    }
}

/// What would be written and removed.
pub(super) fn plan(style: Style, plan: &Plan) -> String {
    let rows = [
        ("writes", files(&plan.writes)),
        ("removes", files(&plan.removals)),
    ];
    table(style, "plan", &rows)
}

/// Paths as data, as they are shown.
pub(super) fn paths(paths: &[PathBuf]) -> Vec<String> {
    paths
        .iter()
        .map(|path| path.display().to_string())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let shown = [
            0.0,
            0.000123456,
            0.0123456,
            1.23456,
            12.3456,
            123.456,
            12345.6,
            1.5e-9,
            2e12,
        ];
        let expected = [
            "0", "0.000123", "0.0123", "1.23", "12.3", "123", "12346", "1.50e-9", "2.00e12",
        ];
        assert_eq!(shown.map(number), expected);
        assert_eq!(number(f64::INFINITY), "inf");
    }

    #[test]
    fn sizes_have_a_unit() {
        assert_eq!(
            [999, 1000, 26_100_000].map(bytes),
            ["999 B", "1.0 kB", "26.1 MB"]
        );
    }

    #[test]
    fn values_are_aligned() {
        let rows = [("a", "1".to_string()), ("long", "2".to_string())];
        let text = table(Style { colour: false }, "title", &rows);
        assert_eq!(text, "title\n  a     1\n  long  2\n");
    }
}
