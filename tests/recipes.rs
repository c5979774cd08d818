//! Recipes through the real binary: what they do.

mod support;

use std::fs;

use serde_json::Value;
use support::capture::sheet;
use support::kitchen::{kitchen, meshloom, outcome};
use support::{command, everything};

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

#[test]
fn a_live_run_follows_what_the_recipe_reads() {
    let folder =
        kitchen("import \"m\" as m;\nlet f = open(\"takes\").frames;\n`${m::name()} ${f}`");
    fs::write(folder.path().join("m.rhai"), "fn name() { \"a\" }").unwrap();
    let mut command = command(folder.path(), "run r.rhai --live --json".split(' '));
    command.env("MESHLOOM_CACHE", folder.path().join(".cache"));
    let mut live = support::Lines::of(command);
    let failed = live.next().map(|line| line["error"]["severity"].clone());
    assert_eq!(failed, Some("error".into()));
    // what was missing appears, whole
    sheet(3, 4).write_objs(&folder.path().join("beside"));
    fs::rename(folder.path().join("beside"), folder.path().join("takes")).unwrap();
    let mut next = |wanted: &str| {
        // a folder may be seen while it is filled
        let line = live.find(|line| line["report"] == wanted);
        assert!(line.is_some(), "{wanted}");
    };
    next("a 4");
    let frame = |number: usize| folder.path().join(format!("takes/frame_{number:04}.obj"));
    fs::copy(frame(1), frame(5)).unwrap();
    next("a 5");
    fs::write(folder.path().join("m.rhai"), "fn name() { \"b\" }").unwrap();
    next("b 5");
}
