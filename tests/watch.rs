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

const JOURNAL: &str = ".meshloom-journal.jsonl";
const LOCK: &str = ".meshloom-lock";

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
        .filter(|(path, _)| !path.starts_with(JOURNAL) && !path.starts_with(LOCK))
        .collect()
}

/// What was published but for the reports: they hold the inputs' times, which differ between two places.
fn results(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let files = published(folder).into_iter();
    files
        .filter(|(path, _)| !path.ends_with("report.json"))
        .collect()
}

/// Hidden entries of OUT.
fn hidden(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder.join("out")).unwrap();
    let names = entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.starts_with('.')).collect();
    names.sort();
    names
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
    assert_eq!(results(rough.path()), results(calm.path()));
    assert_eq!(hidden(rough.path()), [JOURNAL, LOCK]);
}

/// Leaves the marker that says that a capture is whole.
fn declare_done(folder: &Path, name: &str) {
    fs::write(folder.join("in").join(name).join(".done"), "").unwrap();
}

#[test]
fn a_thousand_captures_at_once_are_each_processed_once_in_bounded_memory() {
    let peak = |count: usize| {
        let folder = place();
        // as cheap as a recipe can be: the bookkeeping is what is tested
        fs::write(folder.path().join("r.rhai"), "input()").unwrap();
        let capture = sheet(3, 2);
        for index in 0..count {
            let name = format!("c{index:04}");
            capture.write_objs(&folder.path().join("in").join(&name));
            declare_done(folder.path(), &name);
        }
        let mut lines = Lines::of(watch(folder.path(), ""));
        let mut done = Vec::new();
        while done.len() < count {
            let line = lines.next().expect("all are processed");
            assert_ne!(line["event"], "failed", "{line}");
            if line["event"] == "done" {
                done.push(line["capture"].as_str().unwrap().to_string());
            }
        }
        let peak = lines.peak_memory();
        lines.terminate();
        done.sort();
        let all: Vec<String> = (0..count).map(|index| format!("c{index:04}")).collect();
        assert_eq!(done, all);
        let journal = fs::read_to_string(folder.path().join("out").join(JOURNAL)).unwrap();
        assert_eq!(journal.lines().count(), count);
        peak
    };
    let (few, many) = (peak(50), peak(1000));
    // what is remembered of a capture (names, states, fingerprints, its results) is some kilobytes
    assert!(many < few + 950 * 32 * 1024, "{few} {many}");
}

/// A number that looks random, from 0 to `below`.
fn chance(seed: &mut u64, below: u64) -> u64 {
    *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
    (*seed >> 33) % below
}

#[test]
fn fifty_kills_slow_copies_renames_and_deletions_change_nothing_in_the_end() {
    let (calm, rough) = (place(), place());
    let capture = |index: usize| sheet(3, 5 + index % 4);
    let name = |index: usize| format!("c{index:02}");
    let input = |index: usize| rough.path().join("in").join(name(index));
    for index in 0..25 {
        capture(index).write_objs(&calm.path().join("in").join(name(index)));
    }
    once(calm.path()).done();
    let mut seed = 7;
    for kill in 0..50 {
        let lines = Lines::of(watch(rough.path(), ""));
        let index = kill / 2;
        match (kill % 2, index % 5) {
            // half of a capture, and the rest under the next watch
            (0, 0) => {
                capture(index).write_objs(&input(index));
                fs::remove_file(input(index).join("frame_0002.obj")).unwrap();
            }
            // copied elsewhere and moved here
            (0, 1) => {
                let beside = rough.path().join("beside");
                capture(index).write_objs(&beside);
                fs::rename(beside, input(index)).unwrap();
            }
            // another capture of that name, which is taken away again
            (0, 2) => {
                sheet(3, 9).write_objs(&input(index));
                declare_done(rough.path(), &name(index));
            }
            (1, 2) => fs::remove_dir_all(input(index)).unwrap(),
            // a file that was cut short
            (0, 3) => {
                capture(index).write_objs(&input(index));
                fs::write(input(index).join("frame_0001.obj"), "v 0 0").unwrap();
            }
            (0, _) => capture(index).write_objs(&input(index)),
            _ => {}
        }
        if kill % 2 == 1 {
            capture(index).write_objs(&input(index));
            declare_done(rough.path(), &name(index));
        }
        let moment = chance(&mut seed, 120_000);
        std::thread::sleep(std::time::Duration::from_micros(moment));
        lines.kill();
    }
    once(rough.path()).done();
    assert_eq!(results(rough.path()), results(calm.path()));
    assert_eq!(hidden(rough.path()), [JOURNAL, LOCK]);
}

#[test]
fn told_to_end_it_leaves_nothing_half_written() {
    let (calm, folder) = (place(), place());
    for index in 0..6 {
        for folder in [&calm, &folder] {
            land(folder.path(), &format!("c{index}"), 12);
        }
    }
    once(calm.path()).done();
    let mut lines = Lines::of(watch(folder.path(), ""));
    lines.find(|line| line["event"] == "running").unwrap();
    lines.terminate();
    let left = hidden(folder.path());
    assert!(
        left.iter().all(|name| name == JOURNAL || name == LOCK),
        "{left:?}"
    );
    once(folder.path()).done();
    assert_eq!(results(folder.path()), results(calm.path()));
}

#[test]
fn a_folder_that_vanishes_and_returns_is_watched_again() {
    let folder = place();
    land(folder.path(), "a", 6);
    let mut lines = Lines::of(watch(folder.path(), ""));
    let done =
        |name: &'static str| move |line: &Value| line["event"] == "done" && line["capture"] == name;
    lines.find(done("a")).unwrap();
    fs::rename(folder.path().join("in"), folder.path().join("gone")).unwrap();
    fs::create_dir(folder.path().join("in")).unwrap();
    land(folder.path(), "b", 6);
    lines.find(done("b")).unwrap();
    land(folder.path(), "c", 6);
    lines.find(done("c")).unwrap();
    fs::remove_dir_all(folder.path().join("in")).unwrap();
    fs::rename(folder.path().join("gone"), folder.path().join("in")).unwrap();
    land(folder.path(), "d", 6);
    lines.find(done("d")).unwrap();
    assert!(!lines.ended());
}

#[test]
fn a_changed_recipe_is_seen_at_once_and_a_broken_one_is_waited_out() {
    let folder = place();
    land(folder.path(), "a", 6);
    let mut lines = Lines::of(watch(folder.path(), ""));
    let done = |line: &Value| line["event"] == "done";
    lines.find(done).unwrap();
    fs::write(folder.path().join("r.rhai"), "fit(input(").unwrap();
    fs::write(folder.path().join("r.tmp"), "input().slice(2, 4)").unwrap();
    fs::rename(folder.path().join("r.tmp"), folder.path().join("r.rhai")).unwrap();
    let again = lines.find(done).unwrap();
    assert_eq!(again["report"]["result"]["frames"], 3);
    fs::write(
        folder.path().join("part.rhai"),
        "fn first(frames) { frames.slice(1, 2) }",
    )
    .unwrap();
    let text = "import \"part\" as part;\npart::first(input())";
    fs::write(folder.path().join("r.rhai"), text).unwrap();
    let again = lines.find(done).unwrap();
    assert_eq!(again["report"]["result"]["frames"], 2);
    fs::write(
        folder.path().join("part.rhai"),
        "fn first(frames) { frames.slice(1, 5) }",
    )
    .unwrap();
    let again = lines.find(done).unwrap();
    assert_eq!(again["report"]["result"]["frames"], 5);
}

#[test]
fn a_file_that_shrinks_while_it_is_read_is_read_again() {
    let (calm, rough) = (place(), place());
    for folder in [&calm, &rough] {
        sheet(30, 40).write_objs(&folder.path().join("in/a"));
    }
    let shrink = |folder: &Path| {
        let last = folder.join("in/a/frame_0040.obj");
        let other = fs::read(folder.join("in/a/frame_0001.obj")).unwrap();
        fs::write(&last, &other[..100]).unwrap();
        other
    };
    once(calm.path()).done();
    let mut lines = Lines::of(watch(rough.path(), ""));
    lines.find(|line| line["event"] == "running").unwrap();
    let whole = shrink(rough.path());
    let ended = lines.find(|line| line["event"] == "done" || line["event"] == "failed");
    assert!(ended.is_some());
    let last = "in/a/frame_0040.obj";
    for folder in [&calm, &rough] {
        fs::write(folder.path().join(last), &whole).unwrap();
    }
    drop(lines);
    for folder in [&calm, &rough] {
        once(folder.path()).done();
    }
    assert_eq!(results(rough.path()), results(calm.path()));
}

/// A capture that may not be read fails by itself. Whoever may read everything runs the program as nobody.
#[test]
#[cfg(unix)]
fn a_capture_that_may_not_be_read_blocks_nobody() {
    use std::os::unix::fs::PermissionsExt;
    use std::os::unix::process::CommandExt;
    let folder = place();
    for name in ["a", "b", "c"] {
        land(folder.path(), name, 6);
    }
    let allow = |path: &str, mode: u32| {
        fs::set_permissions(folder.path().join(path), fs::Permissions::from_mode(mode)).unwrap();
    };
    allow("", 0o777);
    allow("in/b/frame_0003.obj", 0o000);
    let mut command = watch(folder.path(), "--once");
    if fs::read(folder.path().join("in/b/frame_0003.obj")).is_ok() {
        command.uid(65534).gid(65534);
    }
    let Ok(output) = command.output() else {
        println!("skipped: nobody may not run the program");
        return;
    };
    let first = Run::of(output).done();
    assert_eq!(events(&first, "done"), ["a", "c"]);
    assert_eq!(events(&first, "failed"), ["b"]);
    let said = fs::read_to_string(folder.path().join("out/b.error.txt")).unwrap();
    assert!(said.contains("ermission"), "{said}");
}

/// A small file system of its own in `folder`, unmounted when it goes; none where it may not be made.
struct Small(PathBuf);

impl Small {
    fn mount(folder: &Path, kilobytes: usize) -> Option<Self> {
        fs::create_dir_all(folder).unwrap();
        let mut mount = Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", &format!("size={kilobytes}k"), "tmpfs"]);
        let made = mount
            .arg(folder)
            .output()
            .is_ok_and(|made| made.status.success());
        if !made {
            println!("skipped: no small file system may be mounted");
        }
        made.then(|| Small(folder.to_path_buf()))
    }

    fn grow(&self, kilobytes: usize) {
        let size = format!("remount,size={kilobytes}k");
        let mut mount = Command::new("mount");
        let grown = mount.args(["-o", &size]).arg(&self.0).status();
        assert!(grown.unwrap().success());
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).status();
    }
}

#[test]
fn a_full_disk_fails_what_does_not_fit_and_keeps_what_is_there() {
    let (calm, folder) = (place(), place());
    let Some(small) = Small::mount(&folder.path().join("out"), 400) else {
        return;
    };
    land(folder.path(), "a", 6);
    once(folder.path()).done();
    let before = results(folder.path());
    let big = sheet(40, 60);
    big.write_objs(&folder.path().join("in/big"));
    land(folder.path(), "later", 6);
    // one after another: what comes later has the room that the failure gave back
    let full = run(watch(folder.path(), "--once --threads 1")).done();
    assert_eq!(events(&full, "failed"), ["big"]);
    assert_eq!(events(&full, "done"), ["later"]);
    for (path, bytes) in &before {
        assert_eq!(results(folder.path()).get(path), Some(bytes), "{path:?}");
    }
    small.grow(64 * 1024);
    // landed again, it is tried again
    big.write_objs(&folder.path().join("in/big"));
    assert_eq!(events(&once(folder.path()).done(), "done"), ["big"]);
    for name in ["a", "later"] {
        land(calm.path(), name, 6);
    }
    big.write_objs(&calm.path().join("in/big"));
    once(calm.path()).done();
    assert_eq!(results(folder.path()), results(calm.path()));
}

#[test]
fn frames_of_a_group_keep_their_order() {
    let folder = place();
    fs::write(folder.path().join("r.rhai"), "input()").unwrap();
    land(folder.path(), "whole", 12);
    for frame in (1..=12).rev() {
        let from = folder.path().join(format!("in/whole/frame_{frame:04}.obj"));
        fs::copy(from, folder.path().join(format!("in/run_{frame}.obj"))).unwrap();
    }
    once(folder.path()).done();
    for frame in 1..=12 {
        let of = |name: &str| {
            let path = format!("out/{name}/frame_{frame:04}.obj");
            fs::read(folder.path().join(path)).unwrap()
        };
        assert_eq!(of("run"), of("whole"), "{frame}");
    }
}
