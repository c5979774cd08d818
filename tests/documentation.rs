//! The README is true: its commands run, it names every subcommand and every format, and no others.

mod support;

use std::collections::BTreeSet;

use meshloom::format::FORMATS;
use support::{command, run, subcommands};
use tempfile::tempdir;

const README: &str = include_str!("../README.md");

/// The lines between ```` ```sh ```` and the next fence.
fn shell_lines() -> Vec<&'static str> {
    let mut inside = false;
    let lines = README.lines().filter(|line| {
        let fence = line.starts_with("```");
        if fence {
            inside = *line == "```sh";
        }
        inside && !fence
    });
    lines
        .filter(|line| !line.is_empty() && !line.starts_with('#'))
        .collect()
}

#[test]
fn every_command_of_the_readme_runs() {
    let folder = tempdir().unwrap();
    let mut count = 0;
    for line in shell_lines() {
        if line == "cargo test --release" {
            continue; // that is what runs this
        }
        let arguments = line
            .strip_prefix("meshloom ")
            .or_else(|| line.strip_prefix("cargo run --release -- "));
        let arguments = arguments.unwrap_or_else(|| panic!("nothing runs `{line}`"));
        let run = run(command(folder.path(), arguments.split_whitespace()));
        assert_eq!(run.code, Some(0), "`{line}`: {}", run.stderr);
        count += 1;
    }
    assert!(count > 5, "{count} commands were found");
}

#[test]
fn the_table_of_commands_is_that_of_the_program() {
    let known: BTreeSet<String> = subcommands().into_iter().collect();
    let rows = README.lines().filter(|line| line.starts_with("| `"));
    let named: BTreeSet<String> = rows
        .filter_map(|row| row.split('|').nth(1))
        .flat_map(|cell| cell.split('`').skip(1).step_by(2))
        .filter_map(|code| code.split_whitespace().next())
        .map(String::from)
        .collect();
    assert_eq!(named, known);
}

#[test]
fn every_format_is_named() {
    for format in FORMATS {
        assert!(README.contains(format.name), "{}", format.name);
    }
}
