//! The reference of all functions a recipe can call, read from the doc comments of the functions
//! themselves: for the generated pages, for hints, for `--check`.
//!
//! A doc comment is: a sentence; the forms of the call in backticks; notes; an example in Rhai, which the
//! tests run.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use rhai::Engine;
use serde_json::Value as Json;

/// One function, under all its forms.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Entry {
    /// What it does, in a sentence or two.
    pub summary: String,
    /// How it is called, each form in backticks.
    pub forms: String,
    /// What else there is to know: units, ranges, what fails.
    pub notes: String,
    /// Examples in Rhai.
    pub examples: Vec<String>,
}

/// All functions, by name.
#[derive(Debug, Clone, Default)]
pub struct Reference {
    entries: BTreeMap<String, Entry>,
    standard: Vec<String>,
    signatures: Vec<(String, String)>,
}

/// The types that recipes pass around.
const TYPES: &[&str] = &["Loom", "Sequence", "Shape", "Examples", "Clock", "Image"];

impl Reference {
    /// Reads the doc comments of everything registered with `engine`.
    pub(super) fn of(engine: &Engine) -> Self {
        let parsed = |standard: bool| {
            engine
                .gen_fn_metadata_to_json(standard)
                .ok()
                .and_then(|text| serde_json::from_str::<Json>(&text).ok())
        };
        let mut reference = Reference::default();
        for (name, comment) in parsed(false).iter().flat_map(functions) {
            let entry = entry(&comment);
            if !entry.forms.is_empty() {
                reference.entries.insert(name, entry);
            }
        }
        reference.signatures = parsed(false).iter().flat_map(signatures).collect();
        reference.signatures.sort();
        reference.standard = parsed(true)
            .iter()
            .flat_map(functions)
            .map(|(name, _)| name)
            .collect();
        reference.standard.sort();
        reference.standard.dedup();
        reference
    }

    /// The functions of ours and what is said of each, by name.
    pub fn entries(&self) -> impl Iterator<Item = (&str, &Entry)> {
        self.entries
            .iter()
            .map(|(name, entry)| (name.as_str(), entry))
    }

    /// The names of our functions.
    pub(super) fn names(&self) -> impl Iterator<Item = &str> {
        self.entries.keys().map(String::as_str)
    }

    /// Whether a function of this name exists, ours or the language's own.
    pub(super) fn knows(&self, name: &str) -> bool {
        self.entries.contains_key(name)
            || self
                .standard
                .binary_search_by(|known| known.as_str().cmp(name))
                .is_ok()
    }

    /// How the function is called, if it is ours.
    pub(super) fn forms(&self, name: &str) -> Option<&str> {
        self.entries.get(name).map(|entry| entry.forms.as_str())
    }

    /// Whether recipes know a type of this name.
    pub(super) fn is_type(&self, name: &str) -> bool {
        TYPES.contains(&name)
    }

    /// The editor definitions that `scripts/meshloom.d.rhai` holds.
    pub fn definitions(&self) -> String {
        let mut text = String::from(
            "// Written by the tests from src/script/functions; do not edit.\nmodule static;\n",
        );
        let mut last = "";
        for (name, signature) in &self.signatures {
            if let Some(entry) = self.entries.get(name).filter(|_| name != last) {
                let _ = write!(text, "\n/// {}\n///\n/// {}\n", entry.summary, entry.forms);
            }
            let _ = writeln!(text, "fn {signature};");
            last = name;
        }
        text
    }

    /// The page that `scripts/reference.md` holds.
    pub fn page(&self) -> String {
        let mut page = String::from(
            "# What a recipe can call\n\nWritten by the tests from the doc comments in `src/script/functions`; do not edit.\n",
        );
        for (name, entry) in &self.entries {
            let _ = write!(
                page,
                "\n## {name}\n\n{}\n\n{}\n",
                entry.forms, entry.summary
            );
            if !entry.notes.is_empty() {
                let _ = write!(page, "\n{}\n", entry.notes);
            }
            for example in &entry.examples {
                let _ = write!(page, "\n```rhai\n{example}```\n");
            }
        }
        page
    }
}

/// (name, doc comment) of every function in the engine's metadata.
fn functions(metadata: &Json) -> Vec<(String, String)> {
    let list = metadata["functions"].as_array().into_iter().flatten();
    let text = |function: &Json| {
        let lines = function["docComments"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(Json::as_str);
        lines.map(uncommented).collect::<Vec<_>>().join("\n")
    };
    list.filter_map(|function| Some((function["name"].as_str()?.to_string(), text(function))))
        .collect()
}

/// (name, `name(loom: Loom, a: ?) -> Loom`) of every function of ours; fields are not functions.
fn signatures(metadata: &Json) -> Vec<(String, String)> {
    let list = metadata["functions"].as_array().into_iter().flatten();
    let parameter = |parameter: &Json| {
        format!(
            "{}: {}",
            parameter["name"].as_str().unwrap_or("_"),
            friendly(&parameter["type"])
        )
    };
    let signature = |function: &Json| {
        let name = function["name"].as_str()?;
        let parameters = function["params"]
            .as_array()
            .into_iter()
            .flatten()
            .map(parameter)
            .collect::<Vec<_>>()
            .join(", ");
        let plain = name.starts_with(|c: char| c.is_ascii_alphabetic()) && !name.contains('$');
        plain.then(|| {
            (
                name.to_string(),
                format!(
                    "{name}({parameters}) -> {}",
                    friendly(&function["returnType"])
                ),
            )
        })
    };
    list.filter_map(signature).collect()
}

/// The name that recipes know a type by; `?` where any will do.
fn friendly(name: &Json) -> &'static str {
    let name = name.as_str().unwrap_or_default();
    let known = [
        ("LoomValue", "Loom"),
        ("Frames", "Sequence"),
        ("ShapeValue", "Shape"),
        ("Clock", "Clock"),
        ("Array", "Array"),
        ("Map", "Map"),
        ("FnPtr", "Fn"),
        ("str", "String"),
        ("String", "String"),
        ("bool", "bool"),
        ("i64", "int"),
        ("()", "()"),
    ];
    known
        .iter()
        .find(|(ours, _)| name.contains(ours))
        .map_or("?", |(_, theirs)| theirs)
}

/// A doc comment's text without its slashes.
fn uncommented(line: &str) -> String {
    line.lines()
        .map(|line| {
            line.trim_start()
                .trim_start_matches("///")
                .strip_prefix(' ')
                .unwrap_or(line.trim_start().trim_start_matches("///"))
        })
        .collect::<Vec<_>>()
        .join("\n")
}

fn entry(comment: &str) -> Entry {
    let mut entry = Entry::default();
    let mut parts = comment.split("```");
    let prose = parts.next().unwrap_or_default();
    for (index, part) in parts.enumerate() {
        if let (0, Some(code)) = (index % 2, part.strip_prefix("rhai\n")) {
            entry.examples.push(code.to_string());
        }
    }
    for paragraph in prose
        .split("\n\n")
        .map(str::trim)
        .filter(|paragraph| !paragraph.is_empty())
    {
        let part = match paragraph {
            forms if forms.starts_with('`') && entry.forms.is_empty() => &mut entry.forms,
            _ if entry.summary.is_empty() => &mut entry.summary,
            _ => &mut entry.notes,
        };
        if !part.is_empty() {
            part.push_str("\n\n");
        }
        part.push_str(&paragraph.replace('\n', " "));
    }
    entry
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_comment_is_summary_forms_notes_and_examples() {
        let entry = entry(
            "Turns time\nbackwards.\n\n`loom.reverse()`\n\nTwice is the same.\n\n```rhai\ndemo(\"bar\")\n```\n",
        );
        assert_eq!(entry.summary, "Turns time backwards.");
        assert_eq!(entry.forms, "`loom.reverse()`");
        assert_eq!(entry.notes, "Twice is the same.");
        assert_eq!(entry.examples, ["demo(\"bar\")\n"]);
    }
}
