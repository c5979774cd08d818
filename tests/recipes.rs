//! Recipes through the real binary: what they do, what they refuse and how they say it.

mod support;

use std::fs;
use std::path::Path;

use serde_json::Value;
use support::capture::sheet;
use support::{Run, command, everything, run};
use tempfile::{TempDir, tempdir};

/// A folder with a capture `sheet` of 12 frames, a loom of it, and a recipe.
fn kitchen(recipe: &str) -> TempDir {
    let folder = tempdir().unwrap();
    sheet(5, 12).write_objs(&folder.path().join("sheet"));
    fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    folder
}

/// Runs the binary with a cache folder of the test's own.
fn meshloom(folder: &Path, args: &str) -> Run {
    let mut command = command(folder, args.split_whitespace());
    command.env("MESHLOOM_CACHE", folder.join(".cache"));
    run(command)
}

/// Runs the recipe on the sheet.
fn outcome(recipe: &str, args: &str) -> Run {
    let folder = kitchen(recipe);
    meshloom(folder.path(), &format!("run r.rhai sheet --json {args}"))
}

#[test]
fn the_last_value_is_written_by_the_ending_of_out() {
    let folder = kitchen("fit(input(), #{ tolerance: 0.05 }).reverse()");
    let object = meshloom(folder.path(), "run r.rhai sheet -o back/f_##.obj --json")
        .done()
        .object();
    assert_eq!(object["frames"], 12);
    assert_eq!(object["outputs"].as_array().unwrap().len(), 12);
    assert!(folder.path().join("back/f_12.obj").exists());
    meshloom(folder.path(), "run r.rhai sheet -o back.loom").done();
    let info = meshloom(folder.path(), "info back.loom --json")
        .done()
        .object();
    assert_eq!(info["frames"], 12);
}

#[test]
fn frames_outside_of_a_loop_keep_their_bits() {
    let folder = kitchen(
        "save(fit(input(), #{ controls: 10, sites: 9, modes: 6 }), \"plain/f_##.obj\");\nfit(input(), #{ controls: 10, sites: 9, modes: 6 }).add_loop(4, 8)",
    );
    let object = meshloom(folder.path(), "run r.rhai sheet -o out --json")
        .done()
        .object();
    let longer = object["frames"].as_u64().unwrap() as usize;
    assert!(longer > 12);
    let read = |path: String| fs::read(folder.path().join(path)).unwrap();
    for frame in 1..=4 {
        assert_eq!(
            read(format!("out/plain/f_{frame:02}.obj")),
            read(format!("out/frame_{frame:04}.obj")),
            "{frame}"
        );
    }
    for back in 0..3 {
        assert_eq!(
            read(format!("out/plain/f_{:02}.obj", 12 - back)),
            read(format!("out/frame_{:04}.obj", longer - back)),
            "{back} from the end"
        );
    }
}

#[test]
fn parameters_are_declared_set_and_listed() {
    let recipe = "let times = param(\"times\", 2, 1, 6);\n`times ${times}`";
    assert_eq!(outcome(recipe, "").done().object()["report"], "times 2");
    assert_eq!(
        outcome(recipe, "--set times=3").done().object()["report"],
        "times 3"
    );
    outcome(recipe, "--set times=7")
        .fails_with_any(&["parameter `times` is 1 to 6, got 7", "r.rhai:1:"]);
    outcome(recipe, "--set tims=3").fails_with(&[
        "no parameter `tims`",
        "did you mean `times`?",
        "times (1 to 6, default 2)",
    ]);
    let checked = outcome(recipe, "--check --set times=4").done().object();
    assert_eq!(
        (
            &checked["params"][0]["name"],
            &checked["params"][0]["value"]
        ),
        (&Value::from("times"), &Value::from(4))
    );
}

#[test]
fn expensive_results_are_remembered_until_something_they_depend_on_changes() {
    let folder = kitchen("fit(input(), #{ tolerance: param(\"tolerance\", 0.05) }).reverse()");
    let fit_made = |args: &str| {
        let object = meshloom(folder.path(), &format!("run r.rhai sheet --json {args}"))
            .done()
            .object();
        let steps = object["steps"].as_array().unwrap().clone();
        let fits: Vec<_> = steps.iter().filter(|step| step["name"] == "fit").collect();
        assert_eq!(fits.len(), 1);
        fits[0]["made"].as_str().unwrap().to_string()
    };
    assert_eq!([fit_made(""), fit_made("")], ["computed", "remembered"]);
    assert_eq!(
        [
            fit_made("--set tolerance=0.06"),
            fit_made("--set tolerance=0.06")
        ],
        ["computed", "remembered"]
    );
    let frame = fs::read_dir(folder.path().join("sheet"))
        .unwrap()
        .next()
        .unwrap()
        .unwrap()
        .path();
    let text = fs::read_to_string(&frame).unwrap();
    let (first, rest) = text.split_once('\n').unwrap();
    assert!(first.starts_with("v "), "{first}");
    let number = first.rsplit(' ').next().unwrap();
    let changed = first.replacen(
        number,
        &format!("{}", number.parse::<f32>().unwrap() + 0.001),
        9,
    );
    fs::write(&frame, format!("{changed}\n{rest}")).unwrap();
    assert_eq!([fit_made(""), fit_made("")], ["computed", "remembered"]);
}

#[test]
fn a_plan_writes_nothing() {
    let folder = kitchen("save(input(), \"copy/f_##.obj\");\nfit(input(), #{ tolerance: 0.05 })");
    fs::create_dir(folder.path().join("out")).unwrap();
    let before = everything(folder.path());
    let plan = meshloom(folder.path(), "run r.rhai sheet -o out --plan --json")
        .done()
        .object();
    assert_eq!(plan["writes"].as_array().unwrap().len(), 24);
    assert!(
        plan["steps"]
            .as_array()
            .unwrap()
            .iter()
            .any(|step| step["name"] == "fit")
    );
    assert!(
        plan["reads"]
            .as_array()
            .unwrap()
            .iter()
            .any(|path| path == "r.rhai")
    );
    let after: Vec<_> = everything(folder.path())
        .into_iter()
        .filter(|(path, _)| !path.starts_with(folder.path().join(".cache")))
        .collect();
    assert_eq!(before, after);
}

#[test]
fn modules_stay_inside_of_the_folder() {
    let folder = kitchen("import \"lib/twice\" as twice;\n`${twice::twice(4)}`");
    fs::create_dir(folder.path().join("lib")).unwrap();
    fs::write(
        folder.path().join("lib/twice.rhai"),
        "fn twice(x) { 2 * x }",
    )
    .unwrap();
    assert_eq!(
        meshloom(folder.path(), "run r.rhai --json").done().object()["report"],
        "8"
    );
    fs::write(folder.path().join("evil.rhai"), "fn f() { 1 }").unwrap();
    fs::create_dir(folder.path().join("inner")).unwrap();
    fs::write(
        folder.path().join("inner/r.rhai"),
        "import \"../evil\" as evil;\nevil::f()",
    )
    .unwrap();
    meshloom(folder.path(), "run inner/r.rhai")
        .fails_with(&["inner/r.rhai:1:", "outside the recipe's folder"]);
    std::os::unix::fs::symlink(
        folder.path().join("evil.rhai"),
        folder.path().join("inner/link.rhai"),
    )
    .unwrap();
    fs::write(
        folder.path().join("inner/r.rhai"),
        "import \"link\" as evil;\nevil::f()",
    )
    .unwrap();
    meshloom(folder.path(), "run inner/r.rhai").fails_with(&["outside the recipe's folder"]);
}

#[test]
fn errors_name_line_column_and_show_the_line() {
    let run = outcome(
        "let a = fit(input(), #{ tolerance: 0.05 });\n  a.add_lop(1, 5)",
        "",
    );
    run.fails_with(&[
        "r.rhai:2:",
        "no function `add_lop` for Loom",
        "  |   a.add_lop(1, 5)",
        "^",
        "did you mean `add_loop`?",
    ]);
    let object = run.object();
    assert_eq!(
        (&object["error"]["line"], &object["error"]["severity"]),
        (&Value::from(2), &Value::from("error"))
    );
    outcome("fit(input(), #{ tolerance: 0.05 }).add_loop(\"a\")", "")
        .fails_with(&["`add_loop` does not take", "`loom.add_loop(a, b)`"]);
    outcome("fit(input(), #{ tolernce: 0.05 })", "")
        .fails_with(&["no option `tolernce`", "did you mean `tolerance`?"]);
    outcome("let = 3", "").fails_with_any(&["r.rhai:1:", "  | let = 3"]);
    outcome("fit(input(), #{ tolerance: 0.05 }).trim(3, 99)", "")
        .fails_with_any(&["r.rhai:1:", "99"]);
    outcome("fit(input(), #{ tolerance: 0.05 }).speed(2, 5, -1)", "")
        .fails_with_any(&["r.rhai:1:", "-1"]);
    outcome("fit(input(), #{ tolerance: 0.05 }).add_loop(8, 3)", "")
        .fails_with_any(&["r.rhai:1:", "8"]);
    outcome("check(1 > 2, \"one is not more\")", "")
        .fails_with_any(&["check failed: one is not more"]);
}

#[test]
fn a_check_resolves_without_running() {
    let folder = kitchen("fit(inptu())\n// never_called()\n");
    meshloom(folder.path(), "run r.rhai --check").fails_with(&[
        "r.rhai:1:5",
        "no function `inptu`",
        "did you mean `input`?",
    ]);
    fs::write(
        folder.path().join("r.rhai"),
        "fn own(x) { x }\nown(fit(open(\"missing\")))",
    )
    .unwrap();
    meshloom(folder.path(), "run r.rhai --check").done();
}

#[test]
fn nothing_is_written_when_the_recipe_fails_after_a_save() {
    let folder = kitchen("save(input(), \"copy/f_##.obj\");\ncheck(false, \"no\")");
    fs::create_dir(folder.path().join("out")).unwrap();
    assert_eq!(
        meshloom(folder.path(), "run r.rhai sheet -o out").code,
        Some(1)
    );
    assert_eq!(everything(&folder.path().join("out")), []);
}

#[test]
fn a_recipe_reads_and_writes_only_where_it_may() {
    outcome("save(input(), \"../evil.obj\")", "-o out")
        .fails_with(&["outside of the output folder"]);
    outcome("save(input(), \"/tmp/meshloom-evil.obj\")", "-o out")
        .fails_with(&["outside of the output folder"]);
    outcome("open(\"/etc\")", "")
        .fails_with(&["outside of what this recipe may read", "--allow-read"]);
    outcome("save(input(), \"a.obj\")", "").fails_with(&["nowhere to write", "-o"]);
}

#[test]
fn endless_and_greedy_recipes_end() {
    for (recipe, message) in [
        ("loop { }", "too many steps"),
        ("fn f(n) { f(n + 1) } f(0)", "too deeply"),
        ("let s = \"x\"; for i in 0..40 { s += s; } s", "too large"),
        (
            "let a = []; for i in 0..1000000 { a.push(i); } a",
            "too large",
        ),
        ("let a = []; a.pad(1000000000, 0); a", "too large"),
        ("1 / 0", "division by zero"),
    ] {
        let run = outcome(recipe, "");
        assert_eq!(run.code, Some(1), "{recipe}");
        assert!(
            run.stderr.to_lowercase().contains(message),
            "{recipe}: {}",
            run.stderr
        );
    }
    outcome("sleep(1)", "").fails_with(&["`sleep` is not for recipes"]);
    outcome("eval(\"1\")", "").fails_with_any(&["r.rhai:1:"]);
    outcome(
        "while true { fit(input(), #{ tolerance: 0.05 }).at(1.5); }",
        "--time-limit 0.5",
    )
    .fails_with(&["longer than 0.5 s", "--time-limit"]);
}

#[test]
fn native_results_have_a_limit_of_their_own() {
    outcome(
        "let loom = fit(demo(\"bar\"), #{ tolerance: 0.05 });\nloom.resample(frames(1000000))",
        "",
    )
    .fails_with(&["r.rhai:2:", "more than 8 GiB", "sample fewer frames"]);
}

#[test]
fn times_outside_of_a_loom_are_refused_with_its_range() {
    for edit in [
        "add_loop(0.5, 5)",
        "add_loop(3, 99)",
        "add_loop(5, 5)",
        "at(12.5)",
        "hold(0, 3)",
    ] {
        let recipe = format!("let a = fit(input(), #{{ tolerance: 0.05 }});\na.{edit}");
        outcome(&recipe, "").fails_with_any(&["r.rhai:2:"]);
    }
    outcome("fit(input(), #{ tolerance: 0.05 }).add_loop(3, 99)", "").fails_with(&["[1, 12]"]);
}

#[test]
fn examples_that_do_not_fit_are_refused() {
    let loom = "let a = fit(input(), #{ tolerance: 0.05 });\n";
    let with = |rest: &str| outcome(&format!("{loom}{rest}"), "");
    with("a.transfer(examples([a.at(1), a.at(4)], [a.at(1)]))")
        .fails_with(&["r.rhai:2:", "2 source examples and 1 target examples"]);
    with("a.transfer(examples([a.at(1), a.at(1)], [a.at(1), a.at(4)]))")
        .fails_with_any(&["all source examples are the reference pose"]);
    with("a.transfer(examples(demo(\"cactus\"), demo(\"cactus\")))")
        .fails_with(&["other faces than the loom"]);
    with("a.transfer(examples([a.at(1), 3], [a.at(1), a.at(4)]))")
        .fails_with_any(&["item 2 of the array"]);
    // two examples of a motion with more modes: what they do not span is told
    let told = with("a.transfer(examples([a.at(1), a.at(6)], [a.at(1), a.at(6)]))").done();
    assert!(
        told.stderr.contains("outside of what the examples span"),
        "{}",
        told.stderr
    );
}

#[test]
fn maps_from_scratch_say_what_is_wrong_with_them() {
    let poses = "let c = demo(\"cactus\");\n";
    let with = |rest: &str| outcome(&format!("{poses}{rest}"), "");
    with("pose_map([[c.frame(1), [0, 0]], [c.frame(2), [0, 0]]])")
        .fails_with(&["r.rhai:2:", "poses 1 and 2 have the same place"]);
    with("pose_map([[c.frame(1), [0]]])").fails_with_any(&["must be [x, y]"]);
    with("pose_map([c.frame(1)])").fails_with_any(&["a pose [mesh, [x, y]]"]);
    with("pose_map([])").fails_with_any(&["r.rhai:2:"]);
    with("pose_map([[c.frame(1), [0, 0]], [demo(\"bar\").frame(1), [1, 0]]])")
        .fails_with_any(&["shape 2 has"]);
    with("pose_map([[c.frame(1), [0, 0]]]).add_pose(demo(\"bar\").frame(1))")
        .fails_with(&["the mesh has other faces than the loom"]);
    with("pose_map([[c.frame(1), [0, 0]], [c.frame(2), [1, 0]]]).path([[0, 0]], #{ curve: \"round\" })")
        .fails_with(&["no curve `round`", "controls"]);
}

#[test]
fn a_transfer_keeps_the_loops_made_before_it() {
    let recipe = "
        let a = fit(input(), #{ controls: 10, sites: 9, modes: 3 });
        let shapes = [a.at(1), a.at(3), a.at(6), a.at(9)];
        let pairs = examples(shapes, shapes);
        let looped = a.add_loop(4, 8, #{ times: 2, bridge: 2 });
        let there = looped.transfer(pairs);
        check(there.frames == looped.frames && there.frames > a.frames, \"the loop is kept\");
        check(compare(there, looped).max < 1e-5, \"onto itself it is the same motion\");
        let after = a.transfer(pairs).add_loop(4, 8, #{ times: 2, bridge: 2 });
        check(after.frames == there.frames, \"either way round\");";
    outcome(recipe, "").done();
}

#[test]
fn a_disk_that_fills_up_keeps_earlier_outputs() {
    let folder = kitchen("save(input(), \"copy/f_##.obj\");\nfit(input(), #{ tolerance: 0.05 })");
    meshloom(folder.path(), "run r.rhai sheet -o out").done();
    let before = everything(&folder.path().join("out"));
    sheet(40, 3).write_objs(&folder.path().join("big"));
    let binary = env!("CARGO_BIN_EXE_meshloom");
    let mut shell = std::process::Command::new("sh");
    // files may not grow beyond a block: the disk is as good as full
    let line = format!("trap '' XFSZ; ulimit -f 8; exec '{binary}' run r.rhai big -o out");
    shell.current_dir(folder.path()).args(["-c", &line]);
    shell.env("MESHLOOM_CACHE", folder.path().join(".cache"));
    run(shell).fails_with_any(&["out"]);
    assert_eq!(everything(&folder.path().join("out")), before);
}

#[test]
fn what_is_no_recipe_is_refused() {
    let folder = kitchen("");
    meshloom(folder.path(), "run r.rhai").fails_with(&["the recipe is empty"]);
    fs::write(folder.path().join("r.rhai"), b"let a = 1;\n\xff\xfe").unwrap();
    meshloom(folder.path(), "run r.rhai").fails_with(&["not UTF-8", "r.rhai:2"]);
    fs::create_dir(folder.path().join("d.rhai")).unwrap();
    assert_eq!(meshloom(folder.path(), "run d.rhai").code, Some(1));
    meshloom(folder.path(), "run lop").fails_with(&["no such recipe", "loop"]);
    meshloom(folder.path(), "run loop").fails_with(&["`input()` needs an input"]);
}

#[test]
fn stock_recipes_run() {
    let folder = kitchen("");
    let four = sheet(5, 4);
    for side in ["sources", "targets"] {
        four.write_objs(&folder.path().join(side));
    }
    let list = meshloom(folder.path(), "run --list --json").done().object();
    for entry in list.as_array().unwrap() {
        let name = entry["name"].as_str().unwrap();
        let set = match name {
            "loop" | "longer-walk" => "--set from=3 --set to=8 --set tolerance=0.05",
            "slow-motion" => "--set from=3 --set to=8 --set tolerance=0.05",
            "frame-rate" => "--set rate=60 --fps 24 --set tolerance=0.05",
            "quality-gate" => "--set tolerance=0.05 --set between=50",
            "transfer" => "--set sources=sources --set targets=targets --set tolerance=0.05",
            "from-scratch" => "--set frames=30",
            _ => "--set tolerance=0.05",
        };
        let run = meshloom(
            folder.path(),
            &format!("run {name} sheet -o out/{name} --json {set}"),
        );
        assert_eq!(run.code, Some(0), "{name}: {}", run.stderr);
    }
    assert!(folder.path().join("out/contact-sheet/sheet.png").exists());
    assert!(
        folder
            .path()
            .join("out/from-scratch/frame_0030.obj")
            .exists()
    );
    assert!(folder.path().join("out/transfer/frame_0012.obj").exists());
    // 12 frames at 24 fps are 11/24 s: 27 frames and a half at 60.
    assert_eq!(
        fs::read_dir(folder.path().join("out/frame-rate"))
            .unwrap()
            .count(),
        28
    );
}

#[test]
fn a_live_run_follows_the_recipe() {
    let folder = kitchen("`one`");
    let mut command = command(folder.path(), "run r.rhai sheet --live --json".split(' '));
    command.env("MESHLOOM_CACHE", folder.path().join(".cache"));
    let mut live = support::Lines::of(command);
    let report = |line: Value| line["report"].as_str().map(str::to_string);
    assert_eq!(live.next().and_then(report).as_deref(), Some("one"));
    // Saved in place, then twice in a row by renaming, then wrongly, then well again.
    fs::write(folder.path().join("r.rhai"), "`two`").unwrap();
    assert_eq!(live.next().and_then(report).as_deref(), Some("two"));
    for text in ["`three`", "`four`"] {
        fs::write(folder.path().join("r.tmp"), text).unwrap();
        fs::rename(folder.path().join("r.tmp"), folder.path().join("r.rhai")).unwrap();
    }
    let mut last = live.next().and_then(report);
    if last.as_deref() == Some("three") {
        last = live.next().and_then(report);
    }
    assert_eq!(last.as_deref(), Some("four"));
    fs::write(folder.path().join("r.rhai"), "`fi").unwrap();
    assert_eq!(
        live.next().map(|line| line["error"]["severity"].clone()),
        Some("error".into())
    );
    fs::write(folder.path().join("r.rhai"), "`five`").unwrap();
    assert_eq!(live.next().and_then(report).as_deref(), Some("five"));
    assert!(!live.ended());
}
