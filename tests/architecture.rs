//! Holds the imports of `src/` against the map: which room may know which, and which crates are
//! reserved to one room.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// Each room and the rooms it may import.
const MAP: &[(&str, &str)] = &[
    ("task", ""),
    ("diag", "task"),
    ("image", ""),
    ("world", "diag"),
    ("math", "task"),
    ("mesh", "math task"),
    ("space", "diag task math mesh"),
    ("signal", "task math"),
    ("loom", "diag task math mesh space signal"),
    ("inbetween", "diag task math mesh space"),
    ("statistics", "diag task math mesh space inbetween"),
    ("metric", "task math mesh"),
    ("edit", "diag task math mesh space signal loom"),
    ("sample", "diag task mesh loom"),
    ("demo", "task math mesh"),
    ("format", "diag math mesh loom"),
    ("plot", "image math mesh"),
    ("view", "image math mesh"),
    (
        "pipeline",
        "diag task image world math mesh space signal loom inbetween statistics metric edit sample demo format plot view",
    ),
    ("recipe", "diag task pipeline"),
    ("script", "diag task world pipeline recipe"),
    ("inbox", "diag"),
    ("io", "diag world"),
    (
        "tui",
        "diag task image pipeline recipe inbox plot view mesh signal loom edit sample",
    ),
    ("cli", "*"),
];

/// Words that may stand in the code of some rooms only.
const RESERVED: &[(&str, &str)] = &[
    ("rhai::", "script"),
    ("ratatui::", "tui"),
    ("crossterm::", "tui"),
    ("clap::", "cli"),
    ("std::env", "cli"),
    ("println!", "cli"),
    ("eprintln!", "cli"),
    ("process::exit", "cli"),
    ("std::fs", "io"),
    ("notify::", "io"),
    ("Instant", "io tui cli"),
    ("SystemTime", "io tui cli"),
    ("todo!", ""),
    ("unimplemented!", ""),
];

fn rust_files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder)
        .expect("src is readable")
        .map(|entry| entry.expect("an entry").path())
    {
        if entry.is_dir() {
            rust_files(&entry, found);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            found.push(entry);
        }
    }
}

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// (room, path, code without comments and without the tests at the end of the file)
fn code() -> Vec<(String, String, String)> {
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    files.sort();
    let room_of = |path: &Path| {
        let first = path
            .strip_prefix(source())
            .expect("below src")
            .components()
            .next()
            .expect("a name");
        first
            .as_os_str()
            .to_string_lossy()
            .trim_end_matches(".rs")
            .to_string()
    };
    files
        .iter()
        .map(|path| {
            let text = fs::read_to_string(path).expect("source is readable");
            let text = text
                .split("#[cfg(test)]\nmod tests")
                .next()
                .unwrap_or_default()
                .to_string();
            let lines: Vec<&str> = text
                .lines()
                .map(|line| line.split("//").next().unwrap_or_default())
                .collect();
            (room_of(path), path.display().to_string(), lines.join("\n"))
        })
        .filter(|(room, ..)| room != "lib" && room != "main")
        .collect()
}

/// The rooms named after `crate::` in `text`, also inside `use crate::{a, b::c}`.
fn imported_rooms(text: &str) -> BTreeSet<String> {
    let mut rooms = BTreeSet::new();
    for part in text.split("crate::").skip(1) {
        let names: Vec<&str> = match part.strip_prefix('{') {
            None => vec![part],
            Some(list) => top_level_items(list),
        };
        for name in names {
            let name = name.trim_start();
            let end = name
                .find(|c: char| !c.is_alphanumeric() && c != '_')
                .unwrap_or(name.len());
            rooms.insert(name[..end].to_string());
        }
    }
    rooms
}

/// Splits `a::{b, c}, d}` at the commas outside inner braces, up to the closing brace.
fn top_level_items(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut items) = (0, 0, Vec::new());
    for (at, letter) in list.char_indices() {
        match letter {
            '{' => depth += 1,
            '}' if depth == 0 => {
                items.push(&list[start..at]);
                return items;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                items.push(&list[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    items
}

#[test]
fn rooms_import_only_what_the_map_lists() {
    let mut faults = Vec::new();
    for (room, path, text) in code() {
        let allowed = MAP
            .iter()
            .find(|(name, _)| *name == room)
            .map(|(_, allowed)| *allowed);
        let allowed = allowed.unwrap_or_else(|| panic!("{path}: room `{room}` is not on the map"));
        for name in imported_rooms(&text) {
            let known = name == room || allowed == "*" || allowed.split(' ').any(|one| one == name);
            if !known {
                faults.push(format!("{path}: `{room}` imports `{name}`"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn reserved_words_stay_in_their_rooms() {
    let mut faults = Vec::new();
    for (room, path, text) in code() {
        for (word, rooms) in RESERVED {
            if !rooms.split(' ').any(|one| one == room) && mentions(&text, word) {
                faults.push(format!("{path}: `{word}` is for {rooms}"));
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Whether `word` stands in `text` with no letter before it and, if it ends in one, none after it.
fn mentions(text: &str, word: &str) -> bool {
    let joins = |c: char| c.is_alphanumeric() || c == '_';
    text.match_indices(word).any(|(at, _)| {
        let before = text[..at].chars().next_back();
        let after = text[at + word.len()..].chars().next();
        let open_end = word.ends_with(joins);
        !(before.is_some_and(joins) || open_end && after.is_some_and(joins))
    })
}

#[test]
fn no_two_rooms_import_each_other() {
    let files = code();
    let edges: BTreeSet<(String, String)> = files
        .iter()
        .flat_map(|(room, _, text)| {
            imported_rooms(text)
                .into_iter()
                .map(move |name| (room.clone(), name))
        })
        .filter(|(from, to)| from != to)
        .collect();
    let knots: Vec<_> = edges
        .iter()
        .filter(|(from, to)| edges.contains(&(to.clone(), from.clone())))
        .collect();
    assert!(knots.is_empty(), "{knots:?}");
}

#[test]
fn the_readers_of_imports_see_braces_and_paths() {
    let rooms = imported_rooms(
        "use crate::{mesh::{Sequence, Topology}, task::Task};\nlet a = crate::diag::Diagnostic::error(\"\");",
    );
    assert_eq!(
        rooms.into_iter().collect::<Vec<_>>(),
        ["diag", "mesh", "task"]
    );
    assert!(mentions("let now = Instant::now();", "Instant") && !mentions("Instantly", "Instant"));
}
