//! A watched folder through the real binary: everything that lands is processed once, whatever happens.

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::Value;
use support::capture::sheet;
use support::{Lines, Run, command, everything, run};
use tempfile::{TempDir, tempdir};

const RECIPE: &str = "fit(input(), #{ controls: 5, sites: 4, modes: 2 }).reverse()";

fn place() -> TempDir {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("in")).unwrap();
    fs::write(folder.path().join("r.rhai"), RECIPE).unwrap();
    folder
}

fn land(folder: &Path, name: &str, frames: usize) {
    sheet(3, frames).write_objs(&folder.join("in").join(name));
}

fn watch(folder: &Path, args: &str) -> Command {
    let args = format!("watch in --recipe r.rhai -o out --settle 0.05 --json {args}");
    let mut command = command(folder, args.split_whitespace());
    command.env("MESHLOOM_CACHE", folder.join(".cache"));
    command
}

fn once(folder: &Path) -> Run {
    run(watch(folder, "--once"))
}

fn events(run: &Run, event: &str) -> Vec<String> {
    let lines = run
        .stdout
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    let mut names: Vec<String> = lines
        .filter(|line| line["event"] == event)
        .map(|line| line["capture"].as_str().unwrap_or_default().to_string())
        .collect();
    names.sort();
    names
}

/// Published files and their content, without the journal.
fn published(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let out = folder.join("out");
    let files = everything(&out)
        .into_iter()
        .filter(|(path, _)| path.is_file());
    files
        .map(|(path, bytes)| (path.strip_prefix(&out).unwrap().to_path_buf(), bytes))
        .filter(|(path, _)| !path.starts_with(".meshloom-journal.jsonl"))
        .collect()
}

#[test]
fn what_is_there_is_processed_once() {
    let folder = place();
    for name in ["a", "b", "c"] {
        land(folder.path(), name, 6);
    }
    let first = once(folder.path()).done();
    assert_eq!(events(&first, "done"), ["a", "b", "c"]);
    assert!(
        folder.path().join("out/a/frame_0006.obj").exists()
            && folder.path().join("out/a/recipe.rhai").exists()
    );
    let report: Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("out/b/report.json")).unwrap())
            .unwrap();
    assert_eq!(
        (&report["capture"], &report["result"]["frames"]),
        (&"b".into(), &6.into())
    );
    assert_eq!(
        events(&once(folder.path()).done(), "done"),
        Vec::<String>::new()
    );
}

#[test]
fn changed_inputs_and_changed_recipes_are_due_again() {
    let folder = place();
    land(folder.path(), "a", 6);
    land(folder.path(), "b", 6);
    once(folder.path()).done();
    land(folder.path(), "b", 7);
    assert_eq!(events(&once(folder.path()).done(), "done"), ["b"]);
    fs::write(folder.path().join("r.rhai"), format!("{RECIPE}.reverse()")).unwrap();
    assert_eq!(events(&once(folder.path()).done(), "done"), ["a", "b"]);
}

#[test]
fn a_failed_capture_says_why_and_blocks_nobody() {
    let folder = place();
    land(folder.path(), "good", 6);
    fs::create_dir(folder.path().join("in/bad")).unwrap();
    fs::write(folder.path().join("in/bad/f1.obj"), "v 0 0 nan\nf 1 1 1\n").unwrap();
    let first = once(folder.path()).done();
    assert_eq!(
        (events(&first, "done"), events(&first, "failed")),
        (vec!["good".to_string()], vec!["bad".to_string()])
    );
    assert!(
        fs::read_to_string(folder.path().join("out/bad.error.txt"))
            .unwrap()
            .contains("f1.obj")
    );
    assert!(!folder.path().join("out/bad").exists());
    assert_eq!(
        events(&once(folder.path()).done(), "failed"),
        Vec::<String>::new()
    );
    fs::remove_file(folder.path().join("in/bad/f1.obj")).unwrap();
    land(folder.path(), "bad", 6);
    assert_eq!(events(&once(folder.path()).done(), "done"), ["bad"]);
    assert!(!folder.path().join("out/bad.error.txt").exists());
}

#[test]
fn captures_that_land_while_it_watches_are_taken() {
    let folder = place();
    let mut lines = Lines::of(watch(folder.path(), ""));
    land(folder.path(), "late", 6);
    let done = lines.find(|line| line["event"] == "done").unwrap();
    assert_eq!(done["capture"], "late");
    fs::write(folder.path().join("in/.ignored"), "x").unwrap();
    land(folder.path(), "later", 6);
    let done = lines.find(|line| line["event"] == "done").unwrap();
    assert_eq!(done["capture"], "later");
    assert!(!lines.ended());
}

#[test]
fn its_own_outputs_never_wake_it_inside_of_the_watched_folder() {
    let folder = place();
    land(folder.path(), "a", 6);
    let args = "watch in --recipe r.rhai -o in/out --settle 0.05 --json --once";
    let run = |args: &str| {
        let mut command = command(folder.path(), args.split_whitespace());
        command.env("MESHLOOM_CACHE", folder.path().join(".cache"));
        run(command).done()
    };
    assert_eq!(events(&run(args), "done"), ["a"]);
    assert_eq!(events(&run(args), "done"), Vec::<String>::new());
}

#[test]
fn killed_at_any_moment_it_ends_with_what_an_undisturbed_run_gives() {
    let (calm, rough) = (place(), place());
    for index in 0..6 {
        for folder in [&calm, &rough] {
            land(folder.path(), &format!("c{index}"), 5 + index);
        }
    }
    once(calm.path()).done();
    for kill in 0..8_u64 {
        let mut lines = Lines::of(watch(rough.path(), ""));
        // Killed after a few events, another number every time: while settling, running, writing.
        for _ in 0..2 * kill {
            if lines.soon().is_none() {
                break;
            }
        }
        lines.kill();
    }
    once(rough.path()).done();
    let without_keys = |folder: &Path| -> BTreeMap<PathBuf, Vec<u8>> {
        // Reports hold the inputs' times, which differ between the two places.
        published(folder)
            .into_iter()
            .filter(|(path, _)| !path.ends_with("report.json"))
            .collect()
    };
    assert_eq!(without_keys(rough.path()), without_keys(calm.path()));
    assert!(
        !everything(&rough.path().join("out"))
            .iter()
            .any(|(path, _)| path.to_string_lossy().ends_with(".part"))
    );
}
