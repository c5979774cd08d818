//! Completion through the binary: the command and the recipes' function.

use std::fs;
use std::path::Path;

use tempfile::tempdir;

use crate::support::capture::sheet;
use crate::support::{command, keys as names, meshloom, run};

#[test]
fn the_command_reports_its_ghost() {
    let folder = tempdir().unwrap();
    sheet(12, 3).write_objs(&folder.path().join("keys"));
    let args = "complete keys -o out.pc2 --ghost 60 --lift direct --ghost-residual off --plot p.svg --json";
    let object = meshloom(folder.path(), args).done().object();
    let ghost = &object["report"]["ghost"];
    assert_eq!(ghost["lift"], "direct");
    assert_eq!(ghost["residual"], false);
    assert!(ghost["faces"].as_u64().unwrap() <= 60);
    assert!(ghost["curve"].as_array().unwrap().len() > 10);
    let picture = fs::read_to_string(folder.path().join("p.svg")).unwrap();
    assert!(picture.contains("3 keys in patch-lri") && picture.contains("faces left"));
}

pub(crate) fn keys_in(folder: &Path) {
    sheet(4, 3).write_objs(&folder.join("keys"));
}

#[test]
fn the_command_writes_frames_and_reports_them() {
    let folder = tempdir().unwrap();
    keys_in(folder.path());
    let plan = meshloom(
        folder.path(),
        "complete keys -o out --key-times 1,3,9 --plan --json",
    );
    assert_eq!(plan.done().object()["writes"].as_array().unwrap().len(), 9);
    assert!(!folder.path().join("out").exists());
    let done = meshloom(
        folder.path(),
        "complete keys -o out --key-times 1,3,9 --json",
    )
    .done();
    let object = done.object();
    assert_eq!(
        names(&object),
        ["frames", "outputs", "report", "seconds", "warnings"]
    );
    assert_eq!(object["frames"], 9);
    assert_eq!(object["report"]["keys"], 3);
    let compared = meshloom(
        folder.path(),
        "compare keys/frame_0002.obj out/frame_0003.obj --json",
    );
    let far = compared.done().object()["max"].as_f64().unwrap();
    assert!(far < 1e-5, "the second key at its time: {far}");
    let few =
        "complete keys/frame_0002.obj keys/frame_0001.obj -o few.pc2 --frames 4 --fps 10 --json";
    assert_eq!(meshloom(folder.path(), few).done().object()["frames"], 4);
    let beyond = "complete keys -o beyond.pc2 --times -5,60.5 --json";
    assert_eq!(meshloom(folder.path(), beyond).done().object()["frames"], 2);
}

#[test]
fn the_same_bytes_on_one_thread_and_on_two() {
    let folder = tempdir().unwrap();
    sheet(40, 3).write_objs(&folder.path().join("keys"));
    for ghost in ["off", "500"] {
        let bytes = |threads: &str| {
            let out = format!("out{threads}.pc2");
            let args = ["complete", "keys", "-o", &out, "--threads", threads];
            let args = args.into_iter().chain(["--frames", "9", "--ghost", ghost]);
            run(command(folder.path(), args)).done();
            fs::read(folder.path().join(out)).unwrap()
        };
        assert!(bytes("1") == bytes("2"), "ghost {ghost}");
    }
}

#[test]
fn a_recipe_completes_meshes_and_remembers_it() {
    let folder = tempdir().unwrap();
    keys_in(folder.path());
    let recipe = r#"
        let keys = [mesh("keys/frame_0003.obj"), mesh("keys/frame_0001.obj")];
        let first = complete(keys, #{ times: [0, 5], frames: 6, tension: 0.5 });
        let again = complete(keys, #{ times: [0, 5], frames: 6, tension: 0.5 });
        check(compare(first, again).max == 0, "the same");
        check(first.frames == 6 && fit(first, #{ tolerance: 0.1 }).frames == 6, "frames, and a loom");
        complete(keys, #{ at: [-2, 7.5], boundary: "hermite", velocities_from: first })
    "#;
    fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    let ran = |args: &str| {
        let mut command = command(folder.path(), args.split_whitespace());
        command.env("MESHLOOM_CACHE", folder.path().join(".cache"));
        run(command)
    };
    let object = ran("run r.rhai -o out.pc2 --json").done().object();
    assert_eq!(object["frames"], 2);
    let steps = object["steps"].as_array().unwrap();
    let made: Vec<&str> = steps
        .iter()
        .filter(|step| step["name"] == "complete")
        .map(|step| step["made"].as_str().unwrap())
        .collect();
    assert_eq!(made, ["computed", "remembered", "computed"]);
    let other = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(folder.path().join("other.obj"), other).unwrap();
    for (wrong, part) in [
        (
            r#"complete([mesh("keys/frame_0001.obj"), mesh("other.obj")])"#,
            "shape 2 has 3 vertices",
        ),
        (r#"complete(demo("bar").slice(1, 1))"#, "one key"),
        (
            r#"complete(demo("bar").slice(1, 2), #{ tims: [1, 2] })"#,
            "did you mean `times`",
        ),
        (
            r#"complete(demo("bar").slice(1, 2), #{ ghost: "some" })"#,
            "no ghost size",
        ),
        (
            r#"complete(demo("bar").slice(1, 2), #{ frames: 3, at: [1] })"#,
            "which frames",
        ),
        (r#"complete(5)"#, "keys must be frames"),
    ] {
        fs::write(folder.path().join("r.rhai"), wrong).unwrap();
        ran("run r.rhai").fails_with(&["r.rhai:1", part]);
    }
}

/// The positions of all frames of a point cache.
fn cached(path: &Path) -> Vec<Vec<f64>> {
    let bytes = fs::read(path).unwrap();
    let count = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let (vertices, frames) = (count(16), count(28));
    let number = |bytes: &[u8]| f64::from(f32::from_le_bytes(bytes.try_into().unwrap()));
    let numbers: Vec<f64> = bytes[32..].chunks_exact(4).map(number).collect();
    assert_eq!(numbers.len(), 3 * vertices * frames);
    numbers
        .chunks_exact(3 * vertices)
        .map(<[f64]>::to_vec)
        .collect()
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    squares.sum::<f64>().sqrt()
}

#[test]
fn each_key_has_its_own_handle_on_the_command_line_and_in_recipes() {
    let folder = tempdir().unwrap();
    keys_in(folder.path());
    let frames = |options: &str| {
        let args = format!("complete keys -o out.pc2 --times 1,1.5,24.5,25,25.5 {options}");
        meshloom(folder.path(), &args).done();
        cached(&folder.path().join("out.pc2"))
    };
    let pace = |options: &str| {
        let frames = frames(options);
        [(0, 1), (2, 3), (3, 4)].map(|(a, b)| apart(&frames[a], &frames[b]))
    };
    // at full tension the curve leaves a key as t^2
    let smooth = pace("");
    let rested = pace("--tension 0,1,0");
    assert!(rested[1] < 0.2 * smooth[1] && rested[2] < 0.2 * smooth[2]);
    assert!(rested[0] > 0.5 * smooth[0]);
    let first = pace("--tension 1,0,0");
    assert!(first[0] < 0.2 * smooth[0] && first[1] > 0.5 * smooth[1]);
    // without continuity the way in is not the way out
    let corner = |frames: &[Vec<f64>]| {
        let ahead: Vec<f64> = frames[3]
            .iter()
            .zip(&frames[2])
            .map(|(a, b)| 2.0 * a - b)
            .collect();
        apart(&ahead, &frames[4]) / apart(&frames[2], &frames[3])
    };
    assert!(corner(&frames("--continuity 0,-1,0")) > 5.0 * corner(&frames("")));
    // a turn before the key and one after it come in on other sides
    let [early, late] = ["--bias 0,-1,0", "--bias 0,1,0"].map(frames);
    assert!(apart(&early[2], &late[2]) > 0.1 * smooth[1]);
    let options = "--tension 0.1,0.6,-0.2 --continuity 0,0.5,0 --bias 0.3,-0.5,0 --overshoot 0.1";
    frames(options);
    let recipe = r#"
        complete(input(), #{ at: [1, 1.5, 24.5, 25, 25.5], tension: [0.1, 0.6, -0.2],
            continuity: [0, 0.5, 0], bias: [0.3, -0.5, 0], overshoot: 0.1 })
    "#;
    fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    meshloom(folder.path(), "run r.rhai keys -o told.pc2").done();
    let [one, other] = ["out.pc2", "told.pc2"].map(|name| cached(&folder.path().join(name)));
    assert_eq!(one, other);
}

#[test]
fn velocities_are_given_as_a_pose_as_two_or_by_a_sequence() {
    let folder = tempdir().unwrap();
    keys_in(folder.path());
    let ended = |ends: &str| {
        let keys = "keys/frame_0001.obj keys/frame_0002.obj";
        let args =
            format!("complete {keys} -o out.pc2 --boundary hermite --times 1,7,13,25 {ends}");
        meshloom(folder.path(), &args).done();
        cached(&folder.path().join("out.pc2"))
    };
    let (one, two, three) = (
        "keys/frame_0001.obj",
        "keys/frame_0002.obj",
        "keys/frame_0003.obj",
    );
    // from the first key towards the third shape, from the second key towards it
    let pose = ended(&format!("--start-velocity {three} --end-velocity {three}"));
    let pair = ended(&format!(
        "--start-velocity {one} {three} --end-velocity {two} {three}"
    ));
    for (a, b) in pose.iter().zip(&pair) {
        assert!(apart(a, b) < 1e-5, "single precision");
    }
    fs::create_dir(folder.path().join("two")).unwrap();
    for (at, from) in [(1, one), (2, three)] {
        let to = format!("two/frame_{at:04}.obj");
        fs::copy(folder.path().join(from), folder.path().join(to)).unwrap();
    }
    // a sequence of two frames has one velocity, over the same 24 frames
    let sequence = ended("--velocities-from two");
    let pair = ended(&format!(
        "--start-velocity {one} {three} --end-velocity {one} {three}"
    ));
    for (a, b) in sequence.iter().zip(&pair) {
        assert!(apart(a, b) < 1e-5);
    }
    assert!(
        apart(&sequence[1], &pose[1]) > 1e-2,
        "other ends give other ways"
    );
}

#[test]
fn beyond_the_keys_a_motion_goes_straight_on() {
    let folder = tempdir().unwrap();
    keys_in(folder.path());
    let args = "complete keys -o out.pc2 --space vertices --times 49,55,61,67,-11,-5,1";
    meshloom(folder.path(), args).done();
    let frames = cached(&folder.path().join("out.pc2"));
    for three in [&frames[..3], &frames[1..4], &frames[4..]] {
        let (first, second) = (apart(&three[0], &three[1]), apart(&three[0], &three[2]));
        assert!(
            (second - 2.0 * first).abs() < 1e-5 * second,
            "evenly on a line"
        );
    }
}

#[test]
fn a_ghost_s_collapses_are_told_as_a_curve_of_cost() {
    let folder = tempdir().unwrap();
    sheet(12, 3).write_objs(&folder.path().join("keys"));
    let done = meshloom(folder.path(), "complete keys -o out.pc2 --ghost 60").done();
    let table = done
        .stderr
        .split("collapses")
        .nth(1)
        .expect("a table of collapses");
    let rows: Vec<&str> = table
        .lines()
        .skip(1)
        .filter(|line| !line.trim().is_empty())
        .collect();
    assert!(rows.len() > 4, "{table}");
    let left = |row: &&str| {
        row.split_whitespace()
            .next()
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    let left: Vec<usize> = rows.iter().map(left).collect();
    assert!(left.windows(2).all(|pair| pair[0] > pair[1]));
    assert!(left.last().is_some_and(|&faces| faces <= 60));
}
