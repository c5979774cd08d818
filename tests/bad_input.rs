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
    refused(second_frame(""), CONVERT, &["frame_0002.obj", "0 bytes"]);
    refused(
        file("in.obj", ""),
        "convert in.obj -o out",
        &["in.obj", "0 bytes"],
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

/// A base mesh and a cache of these bytes beside it.
fn cache(name: &'static str, bytes: impl AsRef<[u8]>) -> impl FnOnce(&Path) {
    move |folder| {
        fs::write(folder.join("base.obj"), good().obj(0)).unwrap();
        fs::write(folder.join(name), bytes).unwrap();
    }
}

#[test]
fn truncated_ply() {
    let whole = good().ply(0);
    for cut in [whole.len() - 4, whole.len() / 2, 30, 3] {
        let line = "convert in.ply -o out";
        refused(file("in.ply", &whole[..cut]), line, &["in.ply"]);
    }
}

#[test]
fn wrong_numbers_in_a_ply() {
    let whole = good().ply(0);
    let line = "convert in.ply -o out";
    refused(
        file("in.ply", whole.replacen("\n0 0 ", "\nnan 0 ", 1)),
        line,
        &["in.ply", "vertex 1"],
    );
    refused(
        file("in.ply", whole.replacen("\n3 0 ", "\n3 9 ", 1)),
        line,
        &["in.ply", "face 1"],
    );
    refused(
        file("in.ply", whole.replacen("\n3 0 ", "\n3 -1 ", 1)),
        line,
        &["in.ply", "face 1"],
    );
    refused(file("in.ply", ""), line, &["in.ply", "0 bytes"]);
    refused(file("in.ply", good().obj(0)), line, &["in.ply"]);
}

#[test]
fn a_ply_that_claims_more_than_it_holds() {
    for (element, count) in [
        ("vertex 9", "vertex 500000000"),
        ("face 8", "face 4000000000"),
    ] {
        let text = good().ply(0).replacen(element, count, 1);
        let line = "convert in.ply -o out";
        refused(file("in.ply", &text), line, &["in.ply"]);
        let binary = text.replacen("ascii", "binary_little_endian", 1);
        refused(file("in.ply", &binary), line, &["in.ply"]);
    }
}

#[test]
fn caches_that_are_cut_short() {
    for (name, whole) in [("in.pc2", good().pc2()), ("in.mdd", good().mdd())] {
        for cut in [whole.len() - 1, whole.len() / 2, 20, 5, 0] {
            let line = format!("convert {name} --mesh base.obj -o out");
            refused(cache(name, &whole[..cut]), &line, &[name]);
        }
    }
}

#[test]
fn caches_that_claim_more_than_they_hold() {
    // 250 million vertices in 8 frames of 12 bytes: far more than the machine has.
    let mut pc2 = good().pc2();
    pc2[16..20].copy_from_slice(&250_000_000i32.to_le_bytes());
    refused(
        cache("in.pc2", &pc2),
        "convert in.pc2 --mesh base.obj -o out",
        &["in.pc2"],
    );
    let mut pc2 = good().pc2();
    pc2[28..32].copy_from_slice(&i32::MAX.to_le_bytes());
    refused(
        cache("in.pc2", &pc2),
        "convert in.pc2 --mesh base.obj -o out",
        &["in.pc2"],
    );
    pc2[28..32].copy_from_slice(&(-1i32).to_le_bytes());
    refused(
        cache("in.pc2", &pc2),
        "convert in.pc2 --mesh base.obj -o out",
        &["in.pc2"],
    );
    let mut mdd = good().mdd();
    mdd[..4].copy_from_slice(&u32::MAX.to_be_bytes());
    refused(
        cache("in.mdd", &mdd),
        "convert in.mdd --mesh base.obj -o out",
        &["in.mdd"],
    );
    let mut mdd = good().mdd();
    mdd[4..8].copy_from_slice(&u32::MAX.to_be_bytes());
    refused(
        cache("in.mdd", &mdd),
        "convert in.mdd --mesh base.obj -o out",
        &["in.mdd"],
    );
}

#[test]
fn caches_that_do_not_fit_their_mesh() {
    let other = sheet(4, 4);
    for (name, bytes) in [("in.pc2", other.pc2()), ("in.mdd", other.mdd())] {
        let line = format!("convert {name} --mesh base.obj -o out");
        refused(cache(name, bytes), &line, &[name, "16", "9"]);
    }
}

#[test]
fn caches_with_numbers_that_are_not_finite() {
    let (mut pc2, mut mdd) = (good().pc2(), good().mdd());
    // Frame 2, vertex 3, y: after the header 9 vertices and 2.
    pc2[32 + 4 * (27 + 7)..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    mdd[8 + 4 * 4 + 4 * (27 + 7)..][..4].copy_from_slice(&f32::INFINITY.to_be_bytes());
    for (name, bytes) in [("in.pc2", pc2), ("in.mdd", mdd)] {
        let line = format!("convert {name} --mesh base.obj -o out");
        refused(
            cache(name, bytes),
            &line,
            &[name, "frame 2", "vertex 3", "finite"],
        );
    }
}

#[test]
fn a_cache_without_its_mesh() {
    for (name, bytes) in [("in.pc2", good().pc2()), ("in.mdd", good().mdd())] {
        let prepare = |folder: &Path| fs::write(folder.join(name), bytes).unwrap();
        refused(
            prepare,
            &format!("convert {name} -o out"),
            &[name, "--mesh"],
        );
    }
    let line = "convert in.pc2 --mesh gone.obj -o out";
    refused(
        cache("in.pc2", good().pc2()),
        line,
        &["gone.obj", "no such file"],
    );
    let line = "convert base.obj --mesh base.obj -o out";
    refused(cache("in.pc2", good().pc2()), line, &["base.obj", "--mesh"]);
}

#[test]
fn a_cache_by_name_that_is_something_else() {
    for name in ["in.pc2", "in.mdd"] {
        let line = format!("convert {name} --mesh base.obj -o out");
        refused(cache(name, good().obj(0)), &line, &[name]);
        refused(cache(name, ""), &line, &[name, "0 bytes"]);
    }
}

fn objs(folder: &Path) {
    good().write_objs(&folder.join("in"));
}

#[test]
fn fidelity_out_of_bounds_names_the_bound() {
    // 4 frames: 4 <= k <= 6, 3 <= l <= 4, 0 <= m <= 3.
    for (option, parts) in [
        ("-k 3", ["3", "4", "6"]),
        ("-k 7", ["7", "4", "6"]),
        ("-l 2", ["2", "3", "4"]),
        ("-l 5", ["5", "3", "4"]),
        ("-m 4", ["4", "0", "3"]),
    ] {
        refused(objs, &format!("fit in -o f.loom {option}"), &parts);
    }
    refused(objs, "fit in -o f.loom --alpha 1.5", &["alpha", "1.5"]);
}

#[test]
fn a_pin_on_a_frame_that_does_not_exist() {
    for frame in ["0", "5"] {
        let line = format!("fit in -o f.loom --pin {frame}=0,0");
        refused(objs, &line, &[&format!("frame {frame}"), "1 to 4"]);
    }
    refused(
        objs,
        "fit in -o f.loom --pin 2=0,0 --pin 2=1,1",
        &["frame 2", "twice"],
    );
}

#[test]
fn a_loom_by_another_ending() {
    refused(objs, "fit in -o f.obj", &["f.obj", ".loom"]);
    refused(objs, "fit in -o f", &["f", ".loom"]);
}

/// A loom of the good sequence, `in.loom`, changed by `change`.
fn loom(change: impl FnOnce(Vec<u8>) -> Vec<u8>) -> impl FnOnce(&Path) {
    move |folder| {
        objs(folder);
        meshloom(folder, "fit in -o in.loom").done();
        let bytes = fs::read(folder.join("in.loom")).unwrap();
        fs::write(folder.join("in.loom"), change(bytes)).unwrap();
    }
}

#[test]
fn times_outside_of_a_loom() {
    for times in ["0.5", "1,4.1", "1:5:1", "-1:2:1", "0:2:1"] {
        let line = format!("sample in.loom -o out --times={times}");
        refused(loom(|bytes| bytes), &line, &["outside [1, 4]"]);
    }
    refused(
        loom(|bytes| bytes),
        "sample in.loom -o out --range 2:5",
        &["2:5", "4 frames"],
    );
    refused(
        loom(|bytes| bytes),
        "sample in.loom -o out --times 1:4:1e-12",
        &["frames"],
    );
}

#[test]
fn seconds_without_a_rate() {
    refused(
        loom(|bytes| bytes),
        "sample in.loom -o out --fps 30",
        &["frames per second", "--fps"],
    );
}

#[test]
fn damaged_looms() {
    for cut in [1, 1000] {
        let shorter = move |bytes: Vec<u8>| bytes[..bytes.len() - cut].to_vec();
        refused(
            loom(shorter),
            "sample in.loom -o out",
            &["in.loom", "cut short"],
        );
    }
    for keep in [0, 5, 8, 100] {
        let shorter = move |bytes: Vec<u8>| bytes[..keep].to_vec();
        refused(loom(shorter), "sample in.loom -o out", &["in.loom", "loom"]);
    }
    let claims = |mut bytes: Vec<u8>| {
        bytes[..8].copy_from_slice(&2_000_000_000u64.to_le_bytes());
        bytes.truncate(1024);
        bytes
    };
    refused(loom(claims), "info in.loom", &["in.loom"]);
    refused(
        loom(|_| good().obj(0).into_bytes()),
        "sample in.loom -o out",
        &["in.loom"],
    );
    let not_finite = |mut bytes: Vec<u8>| {
        let end = bytes.len();
        // The last doubles come before the single-precision numbers and whole numbers; one of the first.
        let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
        bytes[8 + header..8 + header + 8].copy_from_slice(&f64::NAN.to_le_bytes());
        assert_eq!(bytes.len(), end);
        bytes
    };
    refused(
        loom(not_finite),
        "sample in.loom -o out",
        &["in.loom", "finite"],
    );
    refused(
        |_| {},
        "sample in.loom -o out",
        &["in.loom", "no such file"],
    );
}

#[test]
fn a_loom_that_would_replace_its_input() {
    refused(
        loom(|bytes| bytes),
        "fit in.loom -o in.loom",
        &["in.loom", "input"],
    );
}

/// One triangle in a buffer of its own file.
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":"in.bin","byteLength":36}]}"#;

#[test]
fn damaged_gltf() {
    let line = "convert in.gltf -o out";
    let with_buffer = |text: String, buffer: Vec<u8>| {
        move |folder: &Path| {
            fs::write(folder.join("in.gltf"), text).unwrap();
            fs::write(folder.join("in.bin"), buffer).unwrap();
        }
    };
    let (whole, buffer) = (GLTF.to_string(), vec![0; 36]);
    let cut = whole[..whole.len() / 2].to_string();
    refused(with_buffer(cut, buffer.clone()), line, &["in.gltf"]);
    refused(with_buffer(whole.clone(), vec![0; 20]), line, &["in."]);
    refused(file("in.gltf", GLTF), line, &["in.bin", "no such file"]);
    refused(file("in.gltf", ""), line, &["in.gltf"]);
    refused(file("in.gltf", good().obj(0)), line, &["in.gltf"]);
    for (claim, huge) in [
        ("\"count\":3", "\"count\":178956970"),
        ("Length\":36", "Length\":2147483640"),
    ] {
        let text = whole.replace(claim, huge);
        refused(with_buffer(text, buffer.clone()), line, &["in."]);
    }
    let far = whole.replace("in.bin", "../../in.bin");
    refused(with_buffer(far, buffer), line, &["in.bin"]);
}

#[test]
fn damaged_glb() {
    let mut header = b"glTF".to_vec();
    header.extend(2u32.to_le_bytes());
    header.extend(2_000_000_000u32.to_le_bytes());
    header.extend(1_999_999_980u32.to_le_bytes());
    header.extend(b"JSON");
    header.resize(1024, b' ');
    for length in [1024, 20, 12, 7, 0] {
        refused(
            file("in.glb", &header[..length]),
            "convert in.glb -o out",
            &["in.glb"],
        );
    }
}
