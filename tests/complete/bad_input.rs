//! What cannot be completed is refused with what is wrong and what helps, and nothing is written.

use std::fs;
use std::path::Path;

use tempfile::tempdir;

use crate::command::keys_in;
use crate::support::{everything, meshloom};

/// The run fails with all `parts` and a hint, and changes nothing.
#[track_caller]
fn refused(prepare: impl FnOnce(&Path), args: &str, parts: &[&str]) {
    let folder = tempdir().unwrap();
    prepare(folder.path());
    let before = everything(folder.path());
    meshloom(folder.path(), args).fails_with(parts);
    assert_eq!(everything(folder.path()), before, "nothing has changed");
}

#[test]
fn keys_that_make_no_motion_are_refused() {
    refused(
        keys_in,
        "complete keys/frame_0001.obj -o out",
        &["one key", "two or more"],
    );
    refused(
        keys_in,
        "complete keys -o out --key-times 1,5,5",
        &["keys 2 and 3 have the same time 5"],
    );
    refused(
        keys_in,
        "complete keys -o out --key-times 1,9,5",
        &["key 3 at time 5 comes before key 2 at time 9"],
    );
    refused(
        keys_in,
        "complete keys -o out --key-times 1,9",
        &["2 times for 3 keys"],
    );
}

#[test]
fn keys_of_other_faces_are_refused_with_the_first_that_differs() {
    let other = |folder: &Path| {
        keys_in(folder);
        let path = folder.join("keys/frame_0002.obj");
        let text = fs::read_to_string(&path).unwrap();
        let faces: Vec<&str> = text.lines().filter(|line| line.starts_with("f ")).collect();
        let turned: Vec<&str> = faces[2].split(' ').collect();
        let turned = format!("f {} {}", turned[2..].join(" "), turned[1]);
        fs::write(&path, text.replacen(faces[2], &turned, 1)).unwrap();
    };
    refused(other, "complete keys -o out", &["frame_0002.obj", "face 3"]);
}

#[test]
fn ends_that_are_not_what_they_are_called_are_refused() {
    refused(
        keys_in,
        "complete keys -o out --boundary periodic",
        &["the last key (3) differs from the first"],
    );
    refused(
        keys_in,
        "complete keys -o out --boundary hermite",
        &["without a velocity at the first key", "--velocities-from"],
    );
    refused(
        keys_in,
        "complete keys -o out --boundary hermite --start-velocity keys/frame_0002.obj",
        &["without a velocity at the last key"],
    );
    refused(
        keys_in,
        "complete keys -o out --start-velocity keys/frame_0002.obj",
        &["natural ends take no velocities"],
    );
    refused(
        keys_in,
        "complete keys -o out --drift rigid",
        &["natural ends have no drift"],
    );
}

#[test]
fn a_last_key_that_is_the_first_moved_is_told_so() {
    let moved = |folder: &Path| {
        keys_in(folder);
        let first = fs::read_to_string(folder.join("keys/frame_0001.obj")).unwrap();
        let shift = |line: &str| match line.strip_prefix("v ") {
            None => line.to_string(),
            Some(numbers) => {
                let numbers: Vec<f64> = numbers
                    .split_whitespace()
                    .map(|x| x.parse().unwrap())
                    .collect();
                format!("v {} {} {}", numbers[0] + 2.0, numbers[1], numbers[2])
            }
        };
        let lines: Vec<String> = first.lines().map(shift).collect();
        fs::write(folder.join("keys/frame_0003.obj"), lines.join("\n")).unwrap();
    };
    refused(
        moved,
        "complete keys -o out --boundary periodic",
        &["differs from the first", "--drift rigid"],
    );
    let folder = tempdir().unwrap();
    moved(folder.path());
    let split = "complete keys -o out --boundary periodic --drift rigid --times 1,49,97 --json";
    meshloom(folder.path(), split).done();
    let compared = meshloom(
        folder.path(),
        "compare keys/frame_0003.obj out/frame_0002.obj --json",
    );
    assert!(compared.done().object()["max"].as_f64().unwrap() < 1e-5);
}

/// Two keys of three triangles at one edge.
fn no_manifold(folder: &Path) {
    fs::create_dir(folder.join("keys")).unwrap();
    for key in 1..=2 {
        let text = format!(
            "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 {key}\nv 0 -1 0\nf 1 2 3\nf 2 1 4\nf 1 2 5\n"
        );
        fs::write(folder.join(format!("keys/key_{key}.obj")), text).unwrap();
    }
}

#[test]
fn meshes_that_cannot_be_collapsed_are_refused() {
    refused(
        no_manifold,
        "complete keys -o out --ghost 2",
        &["vertex 1", "no manifold", "vertices 1 and 2", "--ghost off"],
    );
    let folder = tempdir().unwrap();
    no_manifold(folder.path());
    for ghost in ["off", "auto", "3"] {
        // nothing has to be collapsed
        meshloom(
            folder.path(),
            &format!("complete keys -o out --ghost {ghost}"),
        )
        .done();
    }
    refused(
        |folder| {
            // a closed surface of four triangles twice
            fs::create_dir(folder.join("keys")).unwrap();
            for key in 1..=2 {
                let solid =
                    |x: i32| format!("v {x} 0 0\nv {} 0 0\nv {x} 1 0\nv {x} 0 {key}\n", x + 1);
                let faces = |at: i32| {
                    let face =
                        |[a, b, c]: [i32; 3]| format!("f {} {} {}\n", a + at, b + at, c + at);
                    [[1, 3, 2], [1, 2, 4], [2, 3, 4], [3, 1, 4]]
                        .map(face)
                        .concat()
                };
                let text = [solid(0), solid(5), faces(0), faces(4)].concat();
                fs::write(folder.join(format!("keys/key_{key}.obj")), text).unwrap();
            }
        },
        "complete keys -o out --ghost 5",
        &["cannot be collapsed to 5 faces", "holds at 8", "--ghost 8"],
    );
    refused(
        keys_in,
        "complete keys -o out --ghost some",
        &["no ghost size `some`", "a number of faces, auto, off"],
    );
}

#[test]
fn controls_out_of_range_are_refused() {
    refused(
        keys_in,
        "complete keys -o out --tension 2",
        &["lie in [-1, 1], got 2"],
    );
    refused(
        keys_in,
        "complete keys -o out --bias 0,0.5",
        &["2 numbers of bias for 3 keys"],
    );
    refused(
        keys_in,
        "complete keys -o out --overshoot -0.5",
        &["an overshoot of -0.5 is no share"],
    );
    refused(keys_in, "complete keys -o out --frames 0", &["0 frames"]);
}
