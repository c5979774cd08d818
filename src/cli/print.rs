//! The one place that writes to the terminal. A closed pipe is no error; nothing here panics.

use std::io::{self, ErrorKind, IsTerminal, Write};
use std::process::ExitCode;

use serde_json::{Value, json};

use crate::diag::{Diagnostic, Severity};

/// The work failed.
pub(super) const FAILED: u8 = 1;

/// How text for people looks: in colour on a terminal, unless NO_COLOR or TERM=dumb say no.
#[derive(Debug, Clone, Copy)]
pub(super) struct Style {
    pub(super) colour: bool,
}

impl Style {
    /// For stderr, as it is now.
    pub(super) fn detect() -> Self {
        let set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        Style {
            colour: io::stderr().is_terminal() && !set("NO_COLOR") && !dumb,
        }
    }

    /// `text` between an ANSI colour and its end.
    pub(super) fn paint(self, code: &str, text: &str) -> String {
        if self.colour {
            format!("\x1b[{code}m{text}\x1b[0m")
        } else {
            text.to_string()
        }
    }

    pub(super) fn bold(self, text: &str) -> String {
        self.paint("1", text)
    }

    /// A diagnostic as a person reads it, the word that says how bad it is in colour.
    pub(super) fn diagnostic(self, diagnostic: &Diagnostic) -> String {
        let text = without_controls(&diagnostic.to_string());
        let (word, code) = match diagnostic.severity {
            Severity::Error => ("error", "1;31"),
            Severity::Warning => ("warning", "1;33"),
            Severity::Cancelled => return text,
        };
        let text = match text.strip_prefix(word) {
            Some(rest) => self.paint(code, word) + rest,
            None => text,
        };
        let hint = self.paint("36", "hint");
        text.replace("\n  hint:", &format!("\n  {hint}:"))
    }
}

/// Text without what could steer a terminal: file names may hold anything.
fn without_controls(text: &str) -> String {
    let steers = |letter: char| letter.is_control() && !matches!(letter, '\n' | '\t');
    text.replace(steers, "\u{fffd}")
}

/// A line or more for people, on stderr. If that is closed nobody is there to be told.
pub(super) fn people(text: &str) {
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Bytes that were asked for, on stdout.
///
/// # Errors
/// Stdout cannot take them; a closed pipe is no error, its reader has what it wanted.
pub(super) fn product(bytes: &[u8]) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(bytes).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        other => other,
    }
}

/// One JSON object and a line end, on stdout; as [`product`].
pub(super) fn object(object: &Value) -> io::Result<()> {
    product(format!("{object}\n").as_bytes())
}

/// A diagnostic as data. Paths that are not Unicode are shown as they are in messages.
pub(super) fn as_data(diagnostic: &Diagnostic) -> Value {
    let mut shown = diagnostic.clone();
    if let Some(file) = &mut shown.place.file {
        *file = file.to_string_lossy().into_owned().into();
    }
    let mut data =
        serde_json::to_value(&shown).unwrap_or_else(|_| json!({ "message": shown.message }));
    if let (Some(caret), Value::Object(map)) = (shown.caret(), &mut data) {
        map.insert("caret".into(), caret.into());
    }
    data
}

/// What a failed run prints with `--json`.
pub(super) fn failure(error: &Diagnostic, warnings: &[Diagnostic]) -> Value {
    let warnings: Vec<Value> = warnings.iter().map(as_data).collect();
    json!({ "error": as_data(error), "warnings": warnings })
}

/// Help and version on stdout, wrong usage on stderr (and as data on stdout with `--json`).
pub(super) fn usage(error: &clap::Error, as_json: bool) -> ExitCode {
    // As everywhere: a closed pipe or stderr is not worth a second error.
    let _ = error.print();
    if error.use_stderr() && as_json {
        let text = error.to_string();
        let line = text.lines().next().unwrap_or_default();
        let message = line.strip_prefix("error: ").unwrap_or(line);
        let _ = object(&failure(&Diagnostic::error(message), &[]));
    }
    ExitCode::from(u8::try_from(error.exit_code()).unwrap_or(FAILED))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colour_marks_the_word_and_the_hint_only() {
        let error = Diagnostic::error("no such file")
            .in_file("a.obj")
            .hint("look again");
        let plain = Style { colour: false };
        assert_eq!(plain.diagnostic(&error), error.to_string());
        let coloured = Style { colour: true };
        assert_eq!(
            coloured.diagnostic(&error),
            "\x1b[1;31merror\x1b[0m: a.obj: no such file\n  \x1b[36mhint\x1b[0m: look again"
        );
    }

    #[test]
    fn file_names_cannot_steer_the_terminal() {
        let error = Diagnostic::error("empty").in_file("a\x1b[2Jb.obj");
        let shown = Style { colour: false }.diagnostic(&error);
        assert_eq!(shown, "error: a\u{fffd}[2Jb.obj: empty");
    }

    #[test]
    fn failures_are_data() {
        let error = Diagnostic::error("bad")
            .in_file("a.obj")
            .at_line(3)
            .hint("so");
        let object = failure(&error, &[Diagnostic::warning("odd")]);
        assert_eq!(object["error"]["severity"], "error");
        assert_eq!(object["error"]["file"], "a.obj");
        assert_eq!(object["error"]["line"], 3);
        assert_eq!(object["error"]["hints"][0], "so");
        assert_eq!(object["warnings"][0]["severity"], "warning");
    }
}
