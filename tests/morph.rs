//! `morph` through the real binary: what it writes and reports, what it refuses.

mod support;

use std::fs;

use support::capture::sheet;
use support::{keys, meshloom};
use tempfile::tempdir;

#[test]
fn poses_are_reproduced_and_what_was_measured_is_reported() {
    let folder = tempdir().unwrap();
    sheet(6, 3).write_objs(&folder.path().join("poses"));
    let run = meshloom(folder.path(), "morph poses -o out --frames 9 --json").done();
    let object = run.object();
    assert_eq!(
        keys(&object),
        ["frames", "outputs", "report", "seconds", "warnings"]
    );
    assert_eq!(
        (&object["frames"], &object["report"]["poses"]),
        (&9.into(), &3.into())
    );
    assert_eq!(object["report"]["method"], "isometric");
    assert!(object["report"]["edges"]["worst_percent"].as_f64().unwrap() >= 0.0);
    assert!(object["report"]["alignment"]["turn_degrees"].is_number());
    let same = |frame: &str, pose: &str| {
        let args = format!("compare poses/{pose} out/{frame} --json");
        assert_eq!(meshloom(folder.path(), &args).done().object()["max"], 0.0);
    };
    let mut names: Vec<String> = fs::read_dir(folder.path().join("poses"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    for (frame, pose) in [(1, 0), (5, 1), (9, 2)] {
        same(&format!("frame_000{frame}.obj"), &names[pose]);
    }
}

#[test]
fn a_plan_names_what_would_be_written_and_writes_nothing() {
    let folder = tempdir().unwrap();
    sheet(4, 2).write_objs(&folder.path().join("poses"));
    let plan = meshloom(
        folder.path(),
        "morph poses -o out/f_##.obj --frames 4 --plan --json",
    );
    let plan = plan.done().object();
    assert_eq!(plan["writes"].as_array().unwrap().len(), 4);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn what_cannot_be_morphed_is_told_with_a_hint() {
    let folder = tempdir().unwrap();
    sheet(4, 2).write_objs(&folder.path().join("poses"));
    let refused = |args: &str, parts: &[&str]| meshloom(folder.path(), args).fails_with(parts);
    refused("morph poses --range 1:1 -o out", &["two poses", "is 1"]);
    refused("morph poses -o out --frames 1", &["2 frames"]);
    refused("morph poses -o poses", &["replace an input"]);
    fs::write(
        folder.path().join("other.obj"),
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    let mut names = fs::read_dir(folder.path().join("poses")).unwrap();
    let one = names.next().unwrap().unwrap().file_name();
    let args = format!("morph poses/{} other.obj -o out", one.display());
    meshloom(folder.path(), &args).fails_with(&["other.obj", "3 vertices"]);
    let unknown = meshloom(folder.path(), "morph poses -o out --method x");
    assert_eq!(unknown.code, Some(2));
    assert!(unknown.stderr.contains("isometric"), "{}", unknown.stderr);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let folder = tempdir().unwrap();
    sheet(12, 2).write_objs(&folder.path().join("poses"));
    for threads in [1, 2] {
        let args = format!("morph poses -o {threads}.pc2 --frames 7 --threads {threads}");
        meshloom(folder.path(), &args).done();
    }
    let read = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(read("1.pc2") == read("2.pc2"));
}
