use super::*;

fn check(recipe: &str, gesture: &Gesture, wanted: &str) {
    let written = write(recipe, gesture).unwrap();
    assert_eq!(written.text, wanted);
    // The line that is named is the one that differs.
    let after: Vec<&str> = written.text.lines().collect();
    let differs = recipe.lines().zip(&after).position(|(a, b)| a != *b);
    let first = differs.unwrap_or_else(|| recipe.lines().count()) + 1;
    let removed = after.len() < recipe.lines().count();
    assert!(removed || written.line == first, "{written:?}");
}

fn moved(control: usize, x: f64, y: f64) -> Gesture {
    Gesture::MoveControl {
        control,
        to: [x, y],
    }
}

#[test]
fn the_first_drag_gets_a_line_and_the_next_amends_it() {
    let start = "// walk\nfit(input())\n";
    let once = "// walk\nfit(input())\n    .move_control(3, [0.3333, -2])\n";
    let twice = "// walk\nfit(input())\n    .move_control(3, [1235, 0])\n";
    check(start, &moved(3, 1.0 / 3.0, -2.0), once);
    check(once, &moved(3, 1234.6, 0.0), twice);
    let other =
        "// walk\nfit(input())\n    .move_control(3, [1235, 0])\n    .move_control(4, [1, 1])\n";
    check(twice, &moved(4, 1.0, 1.0), other);
    check(
        other,
        &moved(3, 1.0 / 3.0, -2.0),
        &other.replace("1235, 0", "0.3333, -2"),
    );
}

#[test]
fn what_loops_variables_and_formulas_made_gets_a_new_line() {
    for recipe in [
        "let j = 3;\nfit(input()).move_control(j, [1, 2])",
        "fit(input()).move_control(3, [x, 2])",
        "fit(input()).move_control(3, [1 * 2, 2])",
        "fit(input()).move_control(3, [1, 2]).add_loop(2, 4)",
        "let a = fit(input());\nfor j in 1..4 { a = a.move_control(3, [1, 2]); }\na",
        "let a = fit(input()).move_control(3, [1, 2]);\na",
    ] {
        let wanted = format!("{recipe}\n    .move_control(3, [5, 6])");
        check(recipe, &moved(3, 5.0, 6.0), &wanted);
    }
    check(
        "fit(input()).move_control(3, [1, 2]).hold(4, 2)",
        &moved(3, 5.0, 6.0),
        "fit(input()).move_control(3, [5, 6]).hold(4, 2)",
    );
}

#[test]
fn lines_go_before_the_resampling_that_ends_a_recipe() {
    check(
        "horse.speed(3, 4, 0.5) // slow\n     .resample(fps(60))\n",
        &Gesture::Reverse,
        "horse.speed(3, 4, 0.5) // slow\n     .reverse()\n     .resample(fps(60))\n",
    );
    let short = write("horse.resample(rate(2))", &Gesture::Reverse).unwrap();
    assert_eq!(short.text, "horse\n    .reverse().resample(rate(2))");
    check(
        "fit(input())\n    .hold(3, 5)\n    .resample(rate(2))",
        &Gesture::Hold {
            time: 3.0,
            frames: 5,
        },
        "fit(input())\n    .hold(3, 10)\n    .resample(rate(2))",
    );
}

#[test]
fn repeated_gestures_add_up_on_their_line() {
    let again = Gesture::AddLoop {
        from: 5.0,
        to: 29.0,
    };
    check(
        "a.add_loop(5, 29)",
        &again,
        "a.add_loop(5, 29, #{ times: 2 })",
    );
    check(
        "a.add_loop(5, 29, #{ bridge: 0, times: 9 })",
        &again,
        "a.add_loop(5, 29, #{ bridge: 0, times: 10 })",
    );
    check(
        "a.add_loop(5, 29, #{ times: times })",
        &again,
        "a.add_loop(5, 29, #{ times: times })\n    .add_loop(5, 29)",
    );
    check(
        "a.add_loop(5, 28)",
        &again,
        "a.add_loop(5, 28)\n    .add_loop(5, 29)",
    );
    let slower = Gesture::Speed {
        from: 1.0,
        to: 9.0,
        factor: 0.5,
    };
    check("a.speed(1, 9, 0.5)", &slower, "a.speed(1, 9, 0.25)");
    let sketch = Gesture::Path {
        points: vec![[0.0, 1.0], [2.5, 3.0]],
    };
    check("a.path([[9, 9]])", &sketch, "a.path([[0, 1], [2.5, 3]])");
    check(
        "a.path(points)",
        &sketch,
        "a.path(points)\n    .path([[0, 1], [2.5, 3]])",
    );
    check(
        "a.exaggerate(1.5)",
        &Gesture::Exaggerate { amount: 0.5 },
        "a.exaggerate(0.75)",
    );
}

#[test]
fn pins_are_amended_wherever_they_stand_and_let_go() {
    let recipe = "fit(input())\n    .pin(4, [1, 2])\n    .add_loop(2, 5)";
    let pin = Gesture::Pin {
        frame: 4,
        to: [3.0, 4.0],
    };
    check(recipe, &pin, &recipe.replace("[1, 2]", "[3, 4]"));
    let free = Gesture::Unpin { frame: 4 };
    check(recipe, &free, "fit(input())\n    .add_loop(2, 5)");
    check("a.pin(4, [1, 2])", &free, "a.pin(4, [1, 2])\n    .unpin(4)");
    check("a.unpin(4)", &pin, "a.unpin(4)\n    .pin(4, [3, 4])");
}

#[test]
fn keys_of_a_retime_are_read_and_replaced() {
    let recipe = "a.retime([[1, 1], [4.5, 3],\n [9, 9]])";
    let keys = retime_keys(recipe).unwrap();
    assert_eq!(keys, [[1.0, 1.0], [4.5, 3.0], [9.0, 9.0]]);
    let gesture = Gesture::Retime {
        keys: keys[..2].to_vec(),
    };
    check(recipe, &gesture, "a.retime([[1, 1], [4.5, 3]])");
    for recipe in [
        "a.retime(keys)",
        "a.retime([[1, 1], [2]])",
        "a.retime(|t| t)",
        "a",
    ] {
        assert_eq!(retime_keys(recipe), None);
    }
}

#[test]
fn a_pose_of_the_loom_itself_needs_its_name() {
    let keep = Gesture::AddPose { at: [0.5, 2.0] };
    let added = |recipe: &str| write(recipe, &keep).unwrap().text;
    assert_eq!(
        added("let horse = fit(input());\nhorse\n"),
        "let horse = fit(input());\nhorse\n    .add_pose(horse.pose([0.5, 2]), [0.5, 2])\n"
    );
    let named =
        "let motion = fit(input()); // all\nmotion.add_pose(motion.pose([0.5, 2]), [0.5, 2])\n";
    assert_eq!(added("fit(input()) // all\n"), named);
    assert_eq!(
        added(named),
        "let motion = fit(input()); // all\nlet motion2 = motion.add_pose(motion.pose([0.5, 2]), [0.5, 2]);\nmotion2.add_pose(motion2.pose([0.5, 2]), [0.5, 2])\n"
    );
    assert_eq!(
        added("a.b()\n .resample(rate(2))"),
        "let motion = a.b();\nmotion.add_pose(motion.pose([0.5, 2]), [0.5, 2])\n .resample(rate(2))"
    );
}

#[test]
fn sliders_change_the_default() {
    let recipe = "let t = param(\"times\", 2, 1, 6); // passes\nlet s = param(\"s\", 0.5);\na";
    let set = |name: &str, value| Gesture::Param {
        name: name.into(),
        value,
    };
    check(
        recipe,
        &set("times", Setting::Integer(5)),
        &recipe.replace("\", 2", "\", 5"),
    );
    check(
        recipe,
        &set("s", Setting::Number(1.0)),
        &recipe.replace("0.5", "1.0"),
    );
    assert!(write(recipe, &set("other", Setting::Flag(true))).is_err());
    assert!(write("param(\"x\", y)", &set("x", Setting::Integer(1))).is_err());
}

#[test]
fn a_recipe_without_a_result_is_refused_with_a_hint() {
    for recipe in ["", "let a = fit(input());", "// nothing"] {
        let error = write(recipe, &Gesture::Reverse).unwrap_err();
        assert!(error.hints[0].contains("semicolon"));
    }
}

/// The recipe of the contract: a loom with a name, edited below.
#[test]
fn a_named_loom_is_edited_where_the_recipe_ends_and_its_own_line_stays() {
    let recipe = "let horse = fit(input(), #{ tolerance: 0.02 });\nhorse.add_loop(12, 24, #{ times: times })\n     .speed(30, 40, 0.5)\n     .resample(fps(60))\n";
    let once = recipe.replace(
        "     .resample",
        "     .move_control(3, [1, 2])\n     .resample",
    );
    check(recipe, &moved(3, 1.0, 2.0), &once);
    check(
        &once,
        &moved(3, 4.0, 5.0),
        &once.replace("[1, 2]", "[4, 5]"),
    );
    let pin = |x: f64| Gesture::Pin {
        frame: 7,
        to: [x, 0.0],
    };
    let pinned = once.replace("     .resample", "     .pin(7, [1, 0])\n     .resample");
    check(&once, &pin(1.0), &pinned);
    check(&pinned, &pin(3.0), &pinned.replace("[1, 0]", "[3, 0]"));
    check(&pinned, &Gesture::Unpin { frame: 7 }, &once);
}
