//! How anything is reported to a person: what, where, and a hint. Errors are data; whoever owns a
//! terminal prints them.

use std::fmt;
use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::task::Cancelled;

/// How much a [`Diagnostic`] matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The work failed.
    Error,
    /// The work was done; something about it should be known.
    Warning,
    /// The work was cancelled.
    Cancelled,
}

/// Where something is wrong. Lines, columns, frames, vertices and faces are counted from 1.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Place {
    /// The file, as the user named it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<PathBuf>,
    /// Line of a text file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Column of that line, in characters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<usize>,
    /// Frame of a capture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<usize>,
    /// Vertex of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub vertex: Option<usize>,
    /// Face of a mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face: Option<usize>,
}

/// One thing to tell a person: message in lower case without a full stop, place, hints.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Diagnostic {
    /// How much it matters.
    pub severity: Severity,
    /// Where it is.
    #[serde(flatten)]
    pub place: Place,
    /// What is wrong.
    pub message: String,
    /// The line of text that the place names, where a person would want to see it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub excerpt: Option<String>,
    /// What could be done about it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub hints: Vec<String>,
}

/// The result of work that can fail for a reason a person should read.
pub type Result<T, E = Box<Diagnostic>> = std::result::Result<T, E>;

impl Diagnostic {
    /// An error: the work fails.
    pub fn error(message: impl Into<String>) -> Self {
        Diagnostic::new(Severity::Error, message)
    }

    /// A warning: the work goes on.
    pub fn warning(message: impl Into<String>) -> Self {
        Diagnostic::new(Severity::Warning, message)
    }

    fn new(severity: Severity, message: impl Into<String>) -> Self {
        Diagnostic {
            severity,
            place: Place::default(),
            message: message.into(),
            excerpt: None,
            hints: Vec::new(),
        }
    }

    /// Names the file.
    #[must_use]
    pub fn in_file(mut self, file: impl Into<PathBuf>) -> Self {
        self.place.file = Some(file.into());
        self
    }

    /// Names the line, counted from 1.
    #[must_use]
    pub fn at_line(mut self, line: usize) -> Self {
        self.place.line = Some(line);
        self
    }

    /// Names the column, counted from 1.
    #[must_use]
    pub fn at_column(mut self, column: usize) -> Self {
        self.place.column = Some(column);
        self
    }

    /// Names the frame, counted from 1.
    #[must_use]
    pub fn at_frame(mut self, frame: usize) -> Self {
        self.place.frame = Some(frame);
        self
    }

    /// Names the vertex, counted from 1.
    #[must_use]
    pub fn at_vertex(mut self, vertex: usize) -> Self {
        self.place.vertex = Some(vertex);
        self
    }

    /// Names the face, counted from 1.
    #[must_use]
    pub fn at_face(mut self, face: usize) -> Self {
        self.place.face = Some(face);
        self
    }

    /// Shows the line that the place names; a caret is set under its column.
    #[must_use]
    pub fn excerpt(mut self, line: impl Into<String>) -> Self {
        self.excerpt = Some(line.into());
        self
    }

    /// Adds a hint.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hints.push(hint.into());
        self
    }

    /// What stands under the shown line: a caret below the column, after as many spaces; tabs stay tabs,
    /// so that it stands under its letter at any tab width. None where no line or no column is known.
    pub fn caret(&self) -> Option<String> {
        let (line, column) = self.excerpt.as_ref().zip(self.place.column)?;
        let before = line.chars().take(column.saturating_sub(1));
        let indent: String = before.map(|c| if c == '\t' { c } else { ' ' }).collect();
        Some(indent + "^")
    }

    /// This diagnostic as the error of a [`Result`].
    pub fn err<T>(self) -> Result<T> {
        Err(Box::new(self))
    }
}

impl From<Cancelled> for Box<Diagnostic> {
    fn from(_: Cancelled) -> Self {
        Box::new(Diagnostic::new(Severity::Cancelled, "interrupted"))
    }
}

/// `file:line:column: frame 3, vertex 17`, leaving out what is not known.
impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts = Vec::new();
        if let Some(file) = &self.file {
            let mut text = file.display().to_string();
            for number in [self.line, self.column].into_iter().flatten() {
                text.push_str(&format!(":{number}"));
            }
            parts.push(text);
        } else if let Some(line) = self.line {
            parts.push(format!("line {line}"));
        }
        for (name, number) in [
            ("frame", self.frame),
            ("vertex", self.vertex),
            ("face", self.face),
        ] {
            parts.extend(number.map(|number| format!("{name} {number}")));
        }
        f.write_str(&parts.join(", "))
    }
}

/// `error: place: message`, the line with a caret where one is shown, and `  hint: ..` for each hint.
impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.severity {
            Severity::Error => f.write_str("error: ")?,
            Severity::Warning => f.write_str("warning: ")?,
            Severity::Cancelled => {}
        }
        if self.place != Place::default() {
            write!(f, "{}: ", self.place)?;
        }
        f.write_str(&self.message)?;
        if let Some(line) = &self.excerpt {
            write!(f, "\n  | {line}")?;
            if let Some(caret) = self.caret() {
                write!(f, "\n  | {caret}")?;
            }
        }
        self.hints
            .iter()
            .try_for_each(|hint| write!(f, "\n  hint: {hint}"))
    }
}

impl std::error::Error for Diagnostic {}

/// A result, and what should be known about it. Warnings ride along; they do not print.
#[derive(Debug, Clone, PartialEq)]
pub struct Warned<T> {
    /// The result.
    pub output: T,
    /// What should be known about it.
    pub warnings: Vec<Diagnostic>,
}

impl<T> Warned<T> {
    /// A result with nothing to warn of.
    pub fn clean(output: T) -> Self {
        Warned {
            output,
            warnings: Vec::new(),
        }
    }

    /// The result changed by `f`, the warnings kept.
    pub fn map<U>(self, f: impl FnOnce(T) -> U) -> Warned<U> {
        Warned {
            output: f(self.output),
            warnings: self.warnings,
        }
    }

    /// Moves the warnings to `all` and gives the result.
    pub fn unpack(self, all: &mut Vec<Diagnostic>) -> T {
        all.extend(self.warnings);
        self.output
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn place_message_and_hint_are_printed_in_that_order() {
        let error = Diagnostic::error("face index 9 is out of range")
            .in_file("a.obj")
            .at_line(12)
            .hint("the file has 8 vertices");
        assert_eq!(
            error.to_string(),
            "error: a.obj:12: face index 9 is out of range\n  hint: the file has 8 vertices"
        );
    }

    #[test]
    fn the_caret_stands_under_its_column() {
        let error = Diagnostic::error("no `b`")
            .in_file("r.rhai")
            .at_line(1)
            .at_column(3)
            .excerpt("a b");
        assert_eq!(
            error.to_string(),
            "error: r.rhai:1:3: no `b`\n  | a b\n  |   ^"
        );
    }

    #[test]
    fn unknown_places_leave_no_trace() {
        assert_eq!(Diagnostic::warning("slow").to_string(), "warning: slow");
        assert_eq!(
            Diagnostic::error("bad")
                .at_frame(2)
                .at_vertex(5)
                .to_string(),
            "error: frame 2, vertex 5: bad"
        );
    }
}
