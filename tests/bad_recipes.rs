//! Recipes that are wrong, endless, greedy or malicious: what is refused, and how that is said.

mod support;

use std::fs;

use serde_json::Value;
use support::capture::sheet;
use support::kitchen::{kitchen, meshloom, outcome};
use support::{Run, everything, run};

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

/// What `--json` must hold of any error in a recipe: the place, the line itself, a caret under the column,
/// a hint.
fn holds_its_place(run: &Run, recipe: &str, (line, column): (usize, usize)) -> Value {
    assert_eq!(run.code, Some(1), "{recipe}");
    let error = run.object()["error"].clone();
    let place = (&error["file"], &error["line"], &error["column"]);
    assert_eq!(
        place,
        (&"r.rhai".into(), &line.into(), &column.into()),
        "{recipe}: {error}"
    );
    let written = recipe.lines().nth(line - 1).unwrap();
    assert_eq!(error["excerpt"], written, "{recipe}");
    let caret = " ".repeat(column - 1) + "^";
    assert_eq!(error["caret"], caret, "{recipe}");
    assert!(
        run.stderr
            .contains(&format!("  | {written}\n  | {caret}\n")),
        "{recipe}: {}",
        run.stderr
    );
    assert_eq!(error["severity"], "error", "{recipe}");
    let hints = error["hints"].as_array();
    assert!(
        hints.is_some_and(|hints| !hints.is_empty()),
        "{recipe}: {error}"
    );
    error
}

#[test]
fn every_kind_of_error_is_data_with_its_place_its_line_and_a_hint() {
    let fit = "let a = fit(input(), #{ tolerance: 0.05 });\n";
    for (kind, text, at, message) in [
        ("unparsed", "let = 3", (1, 5), "name of a variable"),
        ("cut short", "let a = [1,\n 2", (2, 3), ""),
        ("open text", "1;\nlet a = \"abc", (2, 9), ""),
        ("a reserved word", "let async = 3", (1, 5), "reserved"),
        (
            "eval",
            "1;\n eval(\"1\")",
            (2, 2),
            "`eval` is not for recipes",
        ),
        (
            "unknown function",
            "A\n  a.add_lop(1, 5)",
            (2, 5),
            "no function `add_lop` for Loom",
        ),
        (
            "unlike any",
            "1;\n  qqqqq(1)",
            (2, 3),
            "no function `qqqqq`",
        ),
        ("unknown variable", "1 +\n  b", (2, 3), "no variable `b`"),
        ("unknown field", "A\na.framez", (2, 3), "no field `framez`"),
        (
            "wrong arguments",
            "A\na.add_loop(\"a\")",
            (2, 3),
            "`add_loop` does not take",
        ),
        (
            "a wrong option",
            "fit(input(), #{ tolernce: 1 })",
            (1, 1),
            "no option `tolernce`",
        ),
        (
            "a wrong kind",
            "A\n a.trim(1, \"b\")",
            (2, 4),
            "b must be a number",
        ),
        ("native", "A\na.trim(3, 99)", (2, 3), "[1, 12]"),
        (
            "native, deep",
            "A\nfn f(x) {\n  x.speed(2, 5, -1)\n}\nf(a)",
            (3, 5),
            "-1",
        ),
        ("not frames", "compare(1, 2)", (1, 1), "a must be frames"),
        ("a parameter", "param(\"x\", 1, 2, 3)", (1, 1), "`x`"),
        ("steps", "1;\nloop { }", (2, 6), "too many steps"),
        (
            "depth",
            "fn f(n) {\n  f(n + 1)\n}\nf(0)",
            (4, 1),
            "too deeply",
        ),
        (
            "a text too large",
            "let s = \"x\";\nloop { s += s; }",
            (2, 10),
            "too large",
        ),
        (
            "an array too large",
            "let a = [];\na.pad(1000000000, 0)",
            (2, 3),
            "too large",
        ),
        (
            "a native value too large",
            "A\na.resample(frames(90000000))",
            (2, 3),
            "",
        ),
        (
            "arithmetic",
            "let z = 0;\n1 / z",
            (2, 3),
            "division by zero",
        ),
        ("out of an array", "let z = [1];\nz[4]", (2, 3), ""),
        (
            "a failed check",
            "1;\ncheck(1 > 2, \"no\")",
            (2, 1),
            "check failed: no",
        ),
        ("thrown", "1;\n  throw \"mine\"", (2, 3), "mine"),
        (
            "a missing module",
            "1;\nimport \"gone\" as g;",
            (2, 8),
            "no module `gone`",
        ),
        (
            "a module outside",
            "import \"../evil\" as g;",
            (1, 8),
            "outside the recipe's folder",
        ),
        (
            "a file outside",
            "1;\nopen(\"/etc\")",
            (2, 1),
            "outside of what this recipe may read",
        ),
        (
            "nowhere to save",
            "1;\nsave(input(), \"a.obj\")",
            (2, 1),
            "nowhere to write",
        ),
        (
            "no clock",
            "1;\nsleep(1)",
            (2, 1),
            "`sleep` is not for recipes",
        ),
        (
            "no frames at the end",
            "1;\n  frames(3)",
            (2, 3),
            "times without a loom",
        ),
    ] {
        let recipe = text.replace("A\n", fit);
        let run = outcome(&recipe, "");
        let error = holds_its_place(&run, &recipe, at);
        let said = error["message"].as_str().unwrap();
        assert!(said.contains(message), "{kind}: {said}");
    }
    // an error in a module is placed in the module
    let folder = kitchen("import \"m\" as m;\nm::f(0)");
    fs::write(folder.path().join("m.rhai"), "fn f(x) {\n  1 / x\n}").unwrap();
    let error = meshloom(folder.path(), "run r.rhai --json").object()["error"].clone();
    assert_eq!(
        (&error["line"], &error["excerpt"], &error["caret"]),
        (&2.into(), &"  1 / x".into(), &"    ^".into())
    );
    assert!(error["file"].as_str().unwrap().ends_with("m.rhai"));
    // time is up: the place is where the run was then
    let recipe = "let x = 0;\nwhile true { x = 1; }";
    let run = outcome(recipe, "--time-limit 0.3");
    let error = run.object()["error"].clone();
    assert_eq!(
        (&error["severity"], &error["line"]),
        (&"error".into(), &2.into())
    );
    assert!(run.stderr.contains("longer than 0.3 s") && run.stderr.contains("--time-limit"));
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
    // by a link out of the folder, too
    let folder = kitchen("save(input(), \"link/a_##.obj\")");
    for path in ["out", "elsewhere"] {
        fs::create_dir(folder.path().join(path)).unwrap();
    }
    std::os::unix::fs::symlink("../elsewhere", folder.path().join("out/link")).unwrap();
    meshloom(folder.path(), "run r.rhai sheet -o out")
        .fails_with(&["outside of the output folder"]);
    assert_eq!(everything(&folder.path().join("elsewhere")), []);
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
    outcome("timestamp()", "").fails_with(&["`timestamp` is not for recipes"]);
    outcome("rand()", "").fails_with(&["no function `rand`"]);
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

/// What a script holds is more than its limits on single values tell: functions hold what they saw.
#[test]
fn the_values_of_a_script_have_a_limit_together() {
    let text = "let text = \"\"; text.pad(200000, 'x');\n";
    for grow in [
        "let f = || 0;\nfor i in 0..100000 { let own = text + i; let g = f; f = || { g.call(); own }; }",
        "fn two(a, b) { 0 }\nlet all = [];\nfor i in 0..9000 { all.push(Fn(\"two\").curry(text + i)); }",
        "for i in 0..100000 { print(text + i); }",
    ] {
        let run = outcome(&format!("{text}{grow}"), "--memory-limit 0.25");
        run.fails_with(&["more than 0.25 GiB", "--memory-limit"]);
        assert!(run.object()["error"]["line"].as_u64() >= Some(2), "{grow}");
    }
    let native = "let a = fit(input(), #{ tolerance: 0.05 });\na.resample(frames(2000000))";
    outcome(native, "--memory-limit 0.25").fails_with(&["r.rhai:2:", "more than 0.25 GiB"]);
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
    meshloom(folder.path(), "run d.rhai").fails_with(&["d.rhai", "this is a folder"]);
    meshloom(folder.path(), "run lop").fails_with(&["no such recipe", "loop"]);
    meshloom(folder.path(), "run loop").fails_with(&["`input()` needs an input"]);
}
