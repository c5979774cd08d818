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

/// A hip, two legs and their ends, the right one bent by `turn` degrees about x.
fn legs(turn: f64) -> String {
    format!(
        "HIERARCHY\nROOT hip\n{{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation \
         Xrotation Yrotation\nJOINT left\n{{\nOFFSET 0.2 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\n\
         End Site\n{{\nOFFSET 0 -1 0\n}}\n}}\nJOINT right\n{{\nOFFSET -0.2 0 0\nCHANNELS 3 Zrotation \
         Xrotation Yrotation\nEnd Site\n{{\nOFFSET 0 -1 0\n}}\n}}\n}}\nMOTION\nFrames: 1\nFrame Time: \
         0.04\n0 1 0 0 0 0 0 0 0 0 {turn} 0\n"
    )
}

#[test]
fn skeletons_keep_the_lengths_of_their_bones() {
    let folder = tempdir().unwrap();
    for (name, turn) in [("a.bvh", 0.0), ("b.bvh", 80.0)] {
        fs::write(folder.path().join(name), legs(turn)).unwrap();
    }
    for out in ["out.bvh", "out.json"] {
        let args = format!("morph a.bvh b.bvh -o {out} --frames 11 --json");
        let object = meshloom(folder.path(), &args).done().object();
        assert_eq!(object["frames"], 11);
        let worst = object["report"]["edges"]["worst_percent"].as_f64().unwrap();
        // isometric poses: rounding of doubles
        assert!(worst < 1e-12, "{worst}");
        assert!(object["warnings"].as_array().unwrap().is_empty());
    }
    // what was written can be morphed on
    let again = meshloom(
        folder.path(),
        "morph out.bvh out.json --range 6:12 -o c.json --json",
    );
    assert_eq!(again.done().object()["report"]["poses"], 7);
    let text = fs::read_to_string(folder.path().join("out.bvh")).unwrap();
    assert!(text.contains("Frames: 11") && text.contains("End Site"));
}

#[test]
fn a_skeleton_that_only_turns_keeps_its_angles_by_the_alignment() {
    let folder = tempdir().unwrap();
    let turned = legs(20.0).replace("\n0 1 0 0 0 0 ", "\n0 1 0 40 100 30 ");
    assert_ne!(turned, legs(20.0));
    fs::write(folder.path().join("a.bvh"), legs(20.0)).unwrap();
    fs::write(folder.path().join("b.bvh"), turned).unwrap();
    let args = "morph a.bvh b.bvh -o out.json --frames 5 --json";
    let object = meshloom(folder.path(), args).done().object();
    let alignment = &object["report"]["alignment"];
    let worst = |which: &str| alignment[which]["joint_worst_degrees"].as_f64().unwrap();
    // bvh files hold a few digits
    assert!(worst("with") < 1e-3, "{alignment}");
    assert!(worst("without") > 1.0, "{alignment}");
    assert!(alignment["turn_degrees"].as_f64().unwrap() > 90.0);
    let told = meshloom(folder.path(), "morph a.bvh b.bvh -o again.json --frames 5").done();
    assert!(told.stderr.contains("angles at joints"), "{}", told.stderr);
}

#[test]
fn what_is_no_skeleton_is_named() {
    let folder = tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put("a.bvh", &legs(0.0));
    put("cut.bvh", &legs(0.0)[..300]);
    put(
        "other.bvh",
        &legs(0.0).replace("JOINT right", "JOINT wrong"),
    );
    put(
        "cycle.json",
        r#"{"joints": [{"name": "r", "parent": null, "position": [0, 0, 0]},
           {"name": "a", "parent": "b", "position": [0, 1, 0]},
           {"name": "b", "parent": "a", "position": [0, 2, 0]}]}"#,
    );
    put(
        "roots.json",
        r#"{"joints": [{"name": "a", "parent": null, "position": [0, 0, 0]},
           {"name": "b", "parent": null, "position": [0, 1, 0]}]}"#,
    );
    sheet(3, 1).write_objs(&folder.path().join("mesh"));
    let refused = |args: &str, parts: &[&str]| meshloom(folder.path(), args).fails_with(parts);
    refused("morph a.bvh cut.bvh -o o.bvh", &["cut.bvh", "too early"]);
    refused("morph a.bvh other.bvh -o o.bvh", &["other.bvh", "`right`"]);
    refused(
        "morph a.bvh cycle.json -o o.bvh",
        &["cycle.json", "`a`", "itself"],
    );
    refused("morph a.bvh roots.json -o o.bvh", &["`a` and `b`"]);
    refused("morph a.bvh mesh -o o.bvh", &["a mesh among skeletons"]);
    refused("morph a.bvh a.bvh -o o.obj", &["o.obj", "skeleton"]);
    refused("morph a.bvh a.bvh -o a.bvh", &["replace an input"]);
    refused("morph a.bvh -o o.bvh", &["two poses"]);
    assert!(!folder.path().join("o.bvh").exists());
    // opposite bones: done, and told
    let cross = |z: f64| {
        let arms = [("e", 1, 0), ("w", -1, 0), ("n", 0, 1), ("s", 0, -1)];
        let arms = arms.map(|(name, x, y)| {
            format!(r#"{{"name": "{name}", "parent": "r", "position": [{x}, {y}, 0]}}"#)
        });
        format!(
            r#"{{"joints": [{{"name": "r", "parent": null, "position": [0, 0, 0]}}, {},
               {{"name": "up", "parent": "r", "position": [0, 0, {z}]}}]}}"#,
            arms.join(", ")
        )
    };
    put("up.json", &cross(0.3));
    put("down.json", &cross(-0.3));
    let over = meshloom(folder.path(), "morph up.json down.json -o o.bvh --json").done();
    let warning = over.object()["warnings"][0]["message"].to_string();
    assert!(
        warning.contains("`up`") && warning.contains("opposite"),
        "{warning}"
    );
}

#[test]
fn a_spline_goes_through_all_poses_in_a_space() {
    let folder = tempdir().unwrap();
    sheet(5, 3).write_objs(&folder.path().join("poses"));
    for space in ["", "--space gradients"] {
        let args = format!("morph poses -o s.pc2 --method spline {space} --frames 5 --json");
        let object = meshloom(folder.path(), &args).done().object();
        assert_eq!(object["report"]["method"], "spline");
        assert!(object["report"].get("alignment").is_none());
    }
    let refused = |args: &str, parts: &[&str]| meshloom(folder.path(), args).fails_with(parts);
    refused(
        "morph poses -o s.pc2 --space gradients",
        &["without a shape space"],
    );
    meshloom(
        folder.path(),
        "morph poses -o t.pc2 --method spline --space x",
    )
    .fails_with_any(&["`x`"]);
}

/// A plane polygon of four triangles; its last vertex at `tip`, all of it `size` times as large.
fn plate(tip: [f64; 2], size: f64) -> String {
    let corners = [
        [0.0, 0.0],
        [4.0, 0.0],
        [4.0, 3.0],
        [0.0, 3.0],
        [2.0, 6.0],
        tip,
    ];
    let vertex = |[x, y]: [f64; 2]| format!("v {} {} 0\n", x * size, y * size);
    let faces = "f 1 2 3\nf 1 3 4\nf 4 3 5\nf 4 5 6\n";
    corners.map(vertex).concat() + faces
}

#[test]
fn poses_that_fold_stretch_or_have_no_area_are_done_and_told() {
    let folder = tempdir().unwrap();
    let put = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    put("open.obj", &plate([-1.0, 5.0], 1.0));
    // the tip folded over the side from (0, 3) to (2, 6), within the plane
    put(
        "folded.obj",
        &plate([2.230769230769231, 2.846153846153846], 1.0),
    );
    put("large.obj", &plate([-1.0, 5.0], 2.0));
    // the tip on the line of that side
    put("flat.obj", &plate([1.0, 4.5], 1.0));
    let warnings = |poses: &str| {
        let args = format!("morph {poses} -o out.pc2 --frames 5 --json");
        let object = meshloom(folder.path(), &args).done().object();
        let worst = object["report"]["edges"]["worst_percent"].as_f64().unwrap();
        // lengths of polygons are exact up to the file's f32
        assert!(worst < 1e-3, "{poses}: {worst}");
        object["warnings"].to_string()
    };
    let folded = warnings("open.obj folded.obj");
    assert!(
        folded.contains("opposite normals") && folded.contains("face"),
        "{folded}"
    );
    let large = warnings("open.obj large.obj");
    assert!(
        large.contains("not near-isometric") && large.contains("67 %"),
        "{large}"
    );
    warnings("open.obj flat.obj");
    warnings("flat.obj flat.obj");
}
