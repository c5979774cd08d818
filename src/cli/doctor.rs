//! `meshloom doctor`: what this machine and this terminal offer, and what the terminal answers when it is
//! asked.

use std::io::{self, IsTerminal};
use std::path::Path;

use serde_json::{Value, json};

use super::runs::cache_folder;
use super::session::{Outcome, Session};
use crate::diag::Result;
use crate::io::listing;
use crate::tui;

/// Say what this machine and this terminal offer
#[derive(Debug, clap::Args)]
pub(super) struct Args {}

pub(super) fn run(_: &Args, session: &Session) -> Result<Outcome> {
    let machine = machine(session);
    let (terminal, pictures) = (terminal(session), pictures());
    let mut report = section(session, "machine", &machine);
    report.push_str(&section(session, "terminal", &terminal));
    report.push_str(&section(session, "pictures", &pictures));
    Ok(Outcome {
        object: json!({
            "machine": object(&machine),
            "terminal": object(&terminal),
            "pictures": object(&pictures),
        }),
        report,
        ..Outcome::default()
    })
}

/// Name and value, in the order they are shown.
type Facts = Vec<(&'static str, Value)>;

fn machine(session: &Session) -> Facts {
    let threads = session.threads;
    vec![
        ("meshloom", json!(env!("CARGO_PKG_VERSION"))),
        ("system", json!(std::env::consts::OS)),
        ("processor", json!(std::env::consts::ARCH)),
        ("vector_units", json!(vector_units())),
        ("cores", json!(threads.cores)),
        ("threads", json!(rayon::current_num_threads())),
        ("threads_from", json!(threads.from)),
        ("cache", json!(cache_folder())),
        (
            "cache_bytes",
            json!(cache_folder().map(|folder| held(&folder))),
        ),
    ]
}

/// Bytes of all files in a folder: what is remembered there.
fn held(folder: &Path) -> u64 {
    let listed = listing(folder, Path::new("")).unwrap_or_default();
    listed.iter().map(|(_, length, _)| length).sum()
}

/// What fitting can use of the processor: results of `fit` may differ in the last bits between two
/// processors that differ here.
#[cfg(target_arch = "x86_64")]
fn vector_units() -> Vec<&'static str> {
    [
        ("avx2", is_x86_feature_detected!("avx2")),
        ("fma", is_x86_feature_detected!("fma")),
        ("avx512f", is_x86_feature_detected!("avx512f")),
    ]
    .into_iter()
    .filter_map(|(name, there)| there.then_some(name))
    .collect()
}

#[cfg(not(target_arch = "x86_64"))]
fn vector_units() -> Vec<&'static str> {
    Vec::new()
}

fn terminal(session: &Session) -> Facts {
    let variable = |name| json!(std::env::var(name).ok());
    let size = terminal_size::terminal_size_of(io::stderr());
    vec![
        ("stdin_is_terminal", json!(io::stdin().is_terminal())),
        ("stdout_is_terminal", json!(io::stdout().is_terminal())),
        ("stderr_is_terminal", json!(io::stderr().is_terminal())),
        ("columns", json!(size.map(|(width, _)| width.0))),
        ("rows", json!(size.map(|(_, height)| height.0))),
        ("colour", json!(session.style.colour)),
        ("TERM", variable("TERM")),
        ("COLORTERM", variable("COLORTERM")),
        ("TERM_PROGRAM", variable("TERM_PROGRAM")),
        ("NO_COLOR", variable("NO_COLOR")),
        ("TMUX", variable("TMUX")),
        ("SSH_CONNECTION", variable("SSH_CONNECTION")),
    ]
}

/// What the terminal is asked and answers, and how the studio would show pictures.
fn pictures() -> Facts {
    if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
        let reason = "not asked: stdin or stdout is no terminal";
        return vec![("graphics", Value::Null), ("because", json!(reason))];
    }
    let given = |name| std::env::var(name).is_ok_and(|value| !value.is_empty());
    let tmux = given("TMUX");
    let answers = tui::ask(tmux);
    let choice = tui::choose(None, &answers, tmux, !given("NO_COLOR"));
    let cell = answers
        .cell
        .map(|(width, height)| format!("{width} x {height} pixels"));
    let background = answers
        .background
        .map(|[r, g, b]| format!("#{r:02x}{g:02x}{b:02x}"));
    vec![
        (
            "asked",
            json!(tui::query(tmux).escape_default().to_string()),
        ),
        ("answered", json!(answers.bytes.escape_ascii().to_string())),
        ("terminal", json!(answers.name)),
        ("kitty", json!(answers.kitty)),
        ("sixel", json!(answers.sixel)),
        ("sixel_colours", json!(answers.registers)),
        ("background", json!(background)),
        ("cell", json!(cell)),
        ("graphics", json!(choice.protocol.name())),
        ("because", json!(choice.reason)),
    ]
}

fn object(facts: &Facts) -> Value {
    facts
        .iter()
        .map(|(name, value)| (name.to_string(), value.clone()))
        .collect()
}

fn section(session: &Session, title: &str, facts: &Facts) -> String {
    let mut text = format!("{}\n", session.style.bold(title));
    for (name, value) in facts {
        // Environment variables keep their names.
        let words = name.replace(|c| c == '_' && !name.starts_with(char::is_uppercase), " ");
        text.push_str(&format!("  {words:<20}{}\n", shown(value)));
    }
    text
}

fn shown(value: &Value) -> String {
    match value {
        Value::Null => "not set".to_string(),
        Value::Bool(yes) => if *yes { "yes" } else { "no" }.to_string(),
        Value::String(text) => text.clone(),
        Value::Array(list) if list.is_empty() => "none".to_string(),
        Value::Array(list) => list.iter().map(shown).collect::<Vec<_>>().join(" "),
        other => other.to_string(),
    }
}
