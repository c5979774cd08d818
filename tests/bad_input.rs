//! Bad input, through the real binary: each case ends with exit code 1, a message that names the place,
//! and a hint; nothing is written and nothing is overwritten.

mod support;

use std::fs;
use std::path::Path;

use support::capture::{Capture, sheet};
use support::{everything, meshloom};
use tempfile::{TempDir, tempdir};

/// Runs `args` in a folder that `prepare` fills; the run has to fail with all `parts` in its message and
/// to leave everything as it was.
#[track_caller]
fn refused(prepare: impl FnOnce(&Path), args: &str, parts: &[&str]) -> TempDir {
    let folder = tempdir().unwrap();
    fs::create_dir(folder.path().join("out")).unwrap();
    fs::write(folder.path().join("out/frame_0001.obj"), "an older output").unwrap();
    prepare(folder.path());
    let before = everything(folder.path());
    meshloom(folder.path(), args).fails_with(parts);
    assert_eq!(everything(folder.path()), before, "nothing has changed");
    folder
}

fn good() -> Capture {
    sheet(3, 4)
}

/// A good sequence in `in/`, its second frame replaced.
fn second_frame(bytes: impl AsRef<[u8]>) -> impl FnOnce(&Path) {
    move |folder| {
        good().write_objs(&folder.join("in"));
        fs::write(folder.join("in/frame_0002.obj"), bytes).unwrap();
    }
}

fn file(name: &'static str, bytes: impl AsRef<[u8]>) -> impl FnOnce(&Path) {
    move |folder| fs::write(folder.join(name), bytes).unwrap()
}

const CONVERT: &str = "convert in -o out";

#[test]
fn nothing_there() {
    refused(|_| {}, CONVERT, &["in", "no such file"]);
    refused(
        |folder| fs::create_dir(folder.join("in")).unwrap(),
        CONVERT,
        &["in", "no capture"],
    );
}

#[test]
fn a_folder_of_other_things() {
    let prepare = |folder: &Path| {
        fs::create_dir(folder.join("in")).unwrap();
        fs::write(folder.join("in/notes.txt"), "no mesh").unwrap();
    };
    refused(prepare, CONVERT, &["in", "no capture", ".obj"]);
}

#[test]
fn truncated_obj() {
    let whole = good().obj(1);
    let cut = &whole[..whole.len() / 2];
    refused(second_frame(cut), CONVERT, &["frame_0002.obj"]);
}

#[test]
fn another_vertex_count() {
    refused(
        second_frame(sheet(4, 2).obj(1)),
        CONVERT,
        &["frame_0002.obj", "16", "9"],
    );
}

#[test]
fn reordered_and_changed_faces() {
    let mut other = good();
    other.faces.swap(0, 3);
    refused(
        second_frame(other.obj(1)),
        CONVERT,
        &["frame_0002.obj:", "face"],
    );
    let mut other = good();
    other.faces[2].rotate_left(1);
    refused(
        second_frame(other.obj(1)),
        CONVERT,
        &["frame_0002.obj:", "face"],
    );
    let mut other = good();
    other.faces.pop();
    refused(
        second_frame(other.obj(1)),
        CONVERT,
        &["frame_0002.obj", "face"],
    );
}

#[test]
fn coordinates_that_are_not_finite() {
    for wrong in ["nan", "inf", "-inf", "1e99", "one"] {
        let text = good().obj(1).replacen("v 0 ", &format!("v {wrong} "), 1);
        refused(second_frame(&text), CONVERT, &["frame_0002.obj:1"]);
        let prepare = |folder: &Path| {
            fs::create_dir(folder.join("in")).unwrap();
            fs::write(folder.join("in/a1.obj"), text).unwrap();
        };
        refused(prepare, CONVERT, &["a1.obj:1"]);
    }
}

#[test]
fn face_indices_that_name_no_vertex() {
    for wrong in ["0", "10", "-10", "4294967297", "99999999999999999999", "x"] {
        let text = good().obj(0).replacen("f 1 ", &format!("f {wrong} "), 1);
        refused(
            file("in.obj", &text),
            "convert in.obj -o out",
            &["in.obj:10"],
        );
    }
}

#[test]
fn an_empty_file() {
    refused(second_frame(""), CONVERT, &["frame_0002.obj", "empty"]);
    refused(
        file("in.obj", ""),
        "convert in.obj -o out",
        &["in.obj", "empty"],
    );
}

#[test]
fn an_obj_without_faces_or_vertices() {
    refused(
        file("in.obj", "# nothing\n"),
        "convert in.obj -o out",
        &["in.obj"],
    );
    refused(
        file("in.obj", "v 0 0 0\nv 1 0 0\n"),
        "convert in.obj -o out",
        &["in.obj", "face"],
    );
}

#[test]
fn a_file_that_is_not_what_its_ending_says() {
    let noise: Vec<u8> = (0..2000u32).map(|i| (i * 37 % 251) as u8).collect();
    refused(file("in.obj", &noise), "convert in.obj -o out", &["in.obj"]);
    refused(
        file("in.stl", "solid"),
        "convert in.stl -o out",
        &["in.stl", ".stl", ".obj"],
    );
    refused(
        file("in", "v 0 0 0\n"),
        "convert in -o out",
        &["in", "ending"],
    );
}

#[test]
fn formats_that_are_not_there_yet_say_so() {
    for ending in ["usd", "usda", "usdc", "usdz", "abc"] {
        let name = format!("in.{ending}");
        let prepare = |folder: &Path| fs::write(folder.join(&name), "#usda 1.0").unwrap();
        refused(prepare, &format!("convert {name} -o out"), &[&name, "yet"]);
    }
}

#[test]
#[cfg(unix)]
fn a_file_that_cannot_be_read() {
    let prepare = |folder: &Path| {
        good().write_objs(&folder.join("in"));
        std::os::unix::fs::symlink("gone", folder.join("in/frame_0005.obj")).unwrap();
    };
    refused(prepare, CONVERT, &["frame_0005.obj", "no such file"]);
    let prepare = |folder: &Path| fs::create_dir(folder.join("in.obj")).unwrap();
    refused(prepare, "convert in.obj -o out", &["in.obj"]);
}

#[test]
fn a_list_with_a_folder_or_a_gap_in_it() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    refused(
        prepare,
        "convert in in/frame_0001.obj -o out",
        &["in", "folder"],
    );
    refused(
        prepare,
        "convert in/frame_0001.obj in/frame_0009.obj -o out",
        &["frame_0009.obj"],
    );
}

#[test]
fn two_sequences_in_one_folder() {
    let prepare = |folder: &Path| {
        good().write_objs(&folder.join("in"));
        for frame in 0..3 {
            let name = folder.join(format!("in/other_{frame}.obj"));
            fs::write(name, good().obj(frame)).unwrap();
        }
    };
    refused(prepare, CONVERT, &["in", "frame_####.obj", "other_"]);
}

#[test]
fn a_range_outside_of_the_capture() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    refused(
        prepare,
        "convert in --range 2:9 -o out",
        &["2:9", "4 frames"],
    );
}

#[test]
fn an_output_that_is_an_input() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    for output in ["in/frame_####.obj", "in", "./in", "in/../in/frame_####.obj"] {
        let parts = ["frame_0001.obj", "input"];
        refused(prepare, &format!("convert in -o {output}"), &parts);
    }
    // Frames beyond the range would be removed as leftovers of a longer run.
    refused(prepare, "convert in --range 3:4 -o in", &["input"]);
}

#[test]
#[cfg(unix)]
fn an_output_that_is_an_input_by_another_name() {
    let prepare = |folder: &Path| {
        good().write_objs(&folder.join("in"));
        std::os::unix::fs::symlink("in", folder.join("alias")).unwrap();
        fs::hard_link(
            folder.join("in/frame_0002.obj"),
            folder.join("linked_0002.obj"),
        )
        .unwrap();
    };
    refused(prepare, "convert in -o alias", &["input"]);
    refused(prepare, "convert in -o linked_####.obj", &["input"]);
}

#[test]
fn many_frames_for_one_file() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    refused(
        prepare,
        "convert in -o one.obj",
        &["one.obj", "4 frames", "####"],
    );
}

#[test]
fn an_output_of_an_unknown_format() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    refused(prepare, "convert in -o a_####.xyz", &[".xyz", ".obj"]);
    refused(prepare, "convert in -o a.abc", &["yet"]);
}

#[test]
fn an_output_folder_that_cannot_be_created() {
    let prepare = |folder: &Path| {
        good().write_objs(&folder.join("in"));
        fs::write(folder.join("file"), "not a folder").unwrap();
    };
    refused(
        prepare,
        "convert in -o file/below/frame_####.obj",
        &["file"],
    );
    refused(prepare, "convert in -o file/frame_####.obj", &["file"]);
    refused(
        prepare,
        "convert in -o /proc/new/frame_####.obj",
        &["/proc"],
    );
}

/// Root may write anywhere, so the folder is one that nobody can write to: a file system of the kernel's.
#[test]
#[cfg(target_os = "linux")]
fn an_output_folder_that_is_read_only() {
    let prepare = |folder: &Path| good().write_objs(&folder.join("in"));
    refused(prepare, "convert in -o /sys/frame_####.obj", &["/sys"]);
}

/// Files may not grow beyond a block: the disk is as good as full.
#[test]
#[cfg(unix)]
fn an_output_that_fills_up() {
    let folder = tempdir().unwrap();
    sheet(40, 3).write_objs(&folder.path().join("in"));
    let before = everything(folder.path());
    let binary = env!("CARGO_BIN_EXE_meshloom");
    let mut shell = std::process::Command::new("sh");
    let line =
        format!("trap '' XFSZ; ulimit -f 8; exec '{binary}' convert in -o new/frame_####.obj");
    shell.current_dir(folder.path()).args(["-c", &line]);
    support::run(shell).fails_with(&["new"]);
    assert_eq!(everything(folder.path()), before);
}

#[test]
fn sequences_that_cannot_be_compared() {
    let prepare = |folder: &Path| {
        good().write_objs(&folder.join("in"));
        sheet(3, 3).write_objs(&folder.join("shorter"));
        sheet(4, 4).write_objs(&folder.join("finer"));
    };
    refused(prepare, "compare in shorter", &["shorter", "4 frames", "3"]);
    refused(prepare, "compare in finer", &["finer", "9 vertices", "16"]);
}
