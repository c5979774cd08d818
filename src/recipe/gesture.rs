//! What a hand does to a loom, as a line of its recipe, written as a person would: the line that a gesture
//! repeats is amended, anything else gets a new line, numbers have four digits, and every other byte
//! stays. What a loop or a variable made is never rewritten.

use super::text::{Call, Chain, amend, calls, insert_method, is_literal, number, result_chain};
use super::{KeyNumber, Make, Setting, result, text};
use crate::diag::{Diagnostic, Result};

/// Something done by hand to the recipe's result.
#[derive(Debug, Clone, PartialEq)]
pub enum Gesture {
    /// `move_control`: a control point (from 1) and its new place.
    MoveControl {
        /// Which.
        control: usize,
        /// Where to.
        to: [f64; 2],
    },
    /// `insert_control` at a time.
    InsertControl {
        /// When.
        time: f64,
    },
    /// `pin`: a frame (from 1) held at a place of the map.
    Pin {
        /// Which.
        frame: usize,
        /// Where.
        to: [f64; 2],
    },
    /// A pinned frame (from 1) let go.
    Unpin {
        /// Which.
        frame: usize,
    },
    /// `add_loop`: one more pass over a stretch.
    AddLoop {
        /// Start.
        from: f64,
        /// End.
        to: f64,
    },
    /// `trim` to a stretch.
    Trim {
        /// Start.
        from: f64,
        /// End.
        to: f64,
    },
    /// `reverse`.
    Reverse,
    /// `hold` at a time for that many frames more.
    Hold {
        /// When.
        time: f64,
        /// How many.
        frames: usize,
    },
    /// `speed` over a stretch, times a factor.
    Speed {
        /// Start.
        from: f64,
        /// End.
        to: f64,
        /// How many times as fast as now.
        factor: f64,
    },
    /// `smooth` over a stretch, that much more.
    Smooth {
        /// Start.
        from: f64,
        /// End.
        to: f64,
        /// 0 to 1.
        amount: f64,
    },
    /// `exaggerate`, times an amount.
    Exaggerate {
        /// By how much more.
        amount: f64,
    },
    /// `extend` by frames.
    Extend {
        /// How many.
        frames: usize,
    },
    /// `path` through points of the map.
    Path {
        /// The points in order.
        points: Vec<[f64; 2]>,
    },
    /// `retime` with these keys (output time, source time); those of a retime that ends the recipe
    /// ([`retime_keys`]) are replaced.
    Retime {
        /// The keys.
        keys: Vec<[f64; 2]>,
    },
    /// `add_pose`: the shape at a place of the map becomes one of its poses.
    AddPose {
        /// Where.
        at: [f64; 2],
    },
    /// `complete`: numbers of a key pose (from 1).
    Key {
        /// Which.
        key: usize,
        /// What changes, and the numbers of all keys.
        numbers: Vec<(KeyNumber, Vec<f64>)>,
    },
    /// Another thing is made of the poses.
    Make(Make),
    /// The default of a parameter.
    Param {
        /// Which.
        name: String,
        /// Its new value.
        value: Setting,
    },
}

/// A recipe with a gesture written into it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Written {
    /// The whole text.
    pub text: String,
    /// The line (from 1) that was amended or is new.
    pub line: usize,
}

/// Methods behind which there is no loom any more: new lines go before them.
const LAST: [&str; 5] = ["resample", "at", "pose", "slice", "frame"];

/// Methods that leave control points, their numbers and their places as they are.
const KEEP_CONTROLS: [&str; 10] = [
    "move_control",
    "hold",
    "speed",
    "retime",
    "trim",
    "reverse",
    "exaggerate",
    "transfer",
    "pin",
    "unpin",
];

/// `recipe` with `gesture` written into it.
///
/// # Errors
/// The recipe does not end in an expression that a method could follow; a parameter is not declared with
/// a plain value; the result is no completion whose key could be changed.
pub fn write(recipe: &str, gesture: &Gesture) -> Result<Written> {
    match gesture {
        Gesture::Param { name, value } => return set_default(recipe, name, value),
        Gesture::Key { key, numbers } => return result::with_key(recipe, *key, numbers),
        Gesture::Make(make) => return result::made(recipe, *make),
        _ => {}
    }
    let Some(chain) = result_chain(recipe) else {
        return Diagnostic::error(
            "the recipe does not end in a loom: there is nothing to add a line to",
        )
        .hint("let its last line be the loom, without a semicolon")
        .err();
    };
    let looms = looms(&chain);
    if let Gesture::AddPose { at } = gesture {
        return Ok(with_pose(recipe, &chain, looms, *at));
    }
    Ok(amended(recipe, &chain.calls[..looms], gesture)
        .unwrap_or_else(|| appended(recipe, &chain, looms, &gesture.call())))
}

/// The keys of the retime that ends the recipe, if it is written in plain numbers.
pub fn retime_keys(recipe: &str) -> Option<Vec<[f64; 2]>> {
    let chain = result_chain(recipe)?;
    let call = chain.calls[..looms(&chain)].last()?;
    let keys = &literal(recipe, call, 0).filter(|_| call.name == "retime")?;
    let numbers: Vec<f64> = keys
        .split(|c: char| "[], \n\t".contains(c))
        .filter(|part| !part.is_empty())
        .map(|part| part.parse().ok())
        .collect::<Option<_>>()?;
    let pairs = numbers.chunks_exact(2);
    pairs
        .remainder()
        .is_empty()
        .then(|| pairs.map(|pair| [pair[0], pair[1]]).collect())
}

/// How many calls of the chain, from the first, give looms.
fn looms(chain: &Chain) -> usize {
    let last = |call: &&Call| LAST.contains(&call.name.as_str());
    chain.calls.len() - chain.calls.iter().rev().take_while(last).count()
}

/// The loom takes one of its own shapes: it needs a name, which it gets unless it has one.
fn with_pose(recipe: &str, chain: &Chain, looms: usize, at: [f64; 2]) -> Written {
    let end = chain
        .calls
        .get(looms)
        .map_or(chain.range.end, |next| next.receiver);
    let (loom, at) = (&recipe[chain.range.start..end], point(at));
    let named = loom.chars().all(|c| c.is_alphanumeric() || c == '_');
    if named {
        return appended(
            recipe,
            chain,
            looms,
            &format!("add_pose({loom}.pose({at}), {at})"),
        );
    }
    let names = std::iter::once("motion".to_string()).chain((2..).map(|n| format!("motion{n}")));
    let name = names
        .into_iter()
        .find(|name| !recipe.contains(name.as_str()));
    let name = name.unwrap_or_default();
    let bound = [
        &recipe[..chain.range.start],
        "let ",
        &name,
        " = ",
        loom,
        ";",
    ]
    .concat();
    let rest = &recipe[end..];
    let line = &rest[..rest.find('\n').unwrap_or(rest.len())];
    let comment = if line.trim_start().starts_with("//") {
        line
    } else {
        ""
    };
    let call = format!("\n{name}.add_pose({name}.pose({at}), {at})");
    let text = [&bound, comment, &call, &rest[comment.len()..]].concat();
    written(text, bound.len() + comment.len() + 1)
}

/// A new line behind the last call that gives a loom.
fn appended(recipe: &str, chain: &Chain, looms: usize, call: &str) -> Written {
    let end = chain
        .calls
        .get(looms)
        .map_or(chain.range.end, |next| next.receiver);
    let (text, line) = insert_method(recipe, end, call);
    Written { text, line }
}

/// The text with an earlier line changed, where the gesture repeats one.
fn amended(recipe: &str, calls: &[Call], gesture: &Gesture) -> Option<Written> {
    let last = calls.last();
    let named = |name: &str| last.filter(|call| call.name == name);
    match gesture {
        Gesture::MoveControl { control, to } => {
            let call = moved_before(recipe, calls, *control)?;
            literal(recipe, call, 1)?;
            Some(change(recipe, call, 1, &point(*to)))
        }
        Gesture::Pin { frame, to } => {
            let call = pinned_before(recipe, calls, *frame)?;
            literal(recipe, call, 1)?;
            Some(change(recipe, call, 1, &point(*to)))
        }
        Gesture::Unpin { frame } => {
            let call = pinned_before(recipe, calls, *frame)?;
            without(recipe, call)
        }
        Gesture::AddLoop { from, to } => {
            let call =
                named("add_loop").filter(|call| stretch(recipe, call) == Some((*from, *to)))?;
            one_more(recipe, call)
        }
        Gesture::Hold { time, frames } => {
            let call = named("hold").filter(|call| value(recipe, call, 0) == Some(*time))?;
            let more = value(recipe, call, 1)? + *frames as f64;
            Some(change(recipe, call, 1, &number(more)))
        }
        Gesture::Speed { from, to, factor } => {
            let call = named("speed").filter(|call| stretch(recipe, call) == Some((*from, *to)))?;
            let factor = value(recipe, call, 2)? * factor;
            Some(change(recipe, call, 2, &number(factor)))
        }
        Gesture::Smooth { from, to, amount } => {
            let call =
                named("smooth").filter(|call| stretch(recipe, call) == Some((*from, *to)))?;
            let amount = (value(recipe, call, 2)? + amount).min(1.0);
            Some(change(recipe, call, 2, &number(amount)))
        }
        Gesture::Exaggerate { amount } => {
            let call = named("exaggerate")?;
            let amount = value(recipe, call, 0)? * amount;
            Some(change(recipe, call, 0, &number(amount)))
        }
        Gesture::Extend { frames } => {
            let call = named("extend")?;
            let frames = value(recipe, call, 0)? + *frames as f64;
            Some(change(recipe, call, 0, &number(frames)))
        }
        Gesture::Path { points } => {
            let call = named("path").filter(|call| literal(recipe, call, 0).is_some())?;
            Some(change(recipe, call, 0, &list(points)))
        }
        Gesture::Retime { keys } => {
            retime_keys(recipe)?;
            Some(change(recipe, last?, 0, &list(keys)))
        }
        Gesture::Reverse
        | Gesture::AddPose { .. }
        | Gesture::Trim { .. }
        | Gesture::InsertControl { .. }
        | Gesture::Key { .. }
        | Gesture::Make(_)
        | Gesture::Param { .. } => None,
    }
}

/// The call that moved this control point last, if nothing behind it numbers or moves control points anew.
fn moved_before<'a>(recipe: &str, calls: &'a [Call], control: usize) -> Option<&'a Call> {
    for call in calls.iter().rev() {
        if !KEEP_CONTROLS.contains(&call.name.as_str()) {
            return None;
        }
        if call.name == "move_control" && value(recipe, call, 0)? == control as f64 {
            return Some(call);
        }
    }
    None
}

/// The call that pinned this frame last.
fn pinned_before<'a>(recipe: &str, calls: &'a [Call], frame: usize) -> Option<&'a Call> {
    let pins = calls
        .iter()
        .rev()
        .filter(|call| ["pin", "unpin"].contains(&call.name.as_str()));
    for call in pins {
        if value(recipe, call, 0)? == frame as f64 {
            return Some(call).filter(|call| call.name == "pin");
        }
    }
    None
}

/// `add_loop` with a pass more than it says.
fn one_more(recipe: &str, call: &Call) -> Option<Written> {
    let Some(options) = call.arguments.get(2) else {
        let end = call.arguments[1].end;
        let text = [&recipe[..end], ", #{ times: 2 }", &recipe[end..]].concat();
        return Some(written(text, end));
    };
    let map = &recipe[options.clone()];
    let at = map.find("times")? + "times".len();
    let rest = map[at..].trim_start().strip_prefix(':')?.trim_start();
    let digits = rest
        .find(|c: char| !c.is_ascii_digit())
        .unwrap_or(rest.len());
    // A formula is not a plain number.
    let next = rest[digits..].trim_start();
    let times: usize = rest[..digits]
        .parse()
        .ok()
        .filter(|_| next.starts_with([',', '}']))?;
    let start = options.end - rest.len();
    let more = (times + 1).to_string();
    let text = [&recipe[..start], &more, &recipe[start + digits..]].concat();
    Some(written(text, start))
}

/// The recipe without a call that has a line of its own.
fn without(recipe: &str, call: &Call) -> Option<Written> {
    let start = recipe[..call.at.start].rfind('\n')?;
    let alone = recipe[start..call.at.start].trim() == ".";
    let rest = &recipe[call.end..];
    let ends = rest.is_empty() || rest.starts_with('\n');
    (alone && ends).then(|| written([&recipe[..start], rest].concat(), start))
}

/// The default of a declared parameter, changed.
fn set_default(recipe: &str, name: &str, value: &Setting) -> Result<Written> {
    let declares = |call: &Call| {
        let named = call.arguments.first().map(|range| &recipe[range.clone()]);
        call.name == "param" && !call.method && named == Some(&format!("\"{name}\""))
    };
    let plain = |call: &Call| {
        let default = call.arguments.get(1).map(|range| &recipe[range.clone()]);
        literal(recipe, call, 1).is_some()
            || default
                .is_some_and(|text| ["true", "false"].contains(&text) || text.starts_with('"'))
    };
    let Some(call) = calls(recipe)
        .into_iter()
        .find(|call| declares(call) && plain(call))
    else {
        return Diagnostic::error(format!(
            "the default of parameter `{name}` is not a plain value here"
        ))
        .hint("`--set` changes it on the command line")
        .err();
    };
    let text = match value {
        Setting::Number(value) => with_point(number(*value)),
        Setting::Text(text) => format!("{text:?}"),
        other => other.to_string(),
    };
    Ok(change(recipe, &call, 1, &text))
}

/// A number that stays a number: `2.0`, where `2` would be a whole number.
fn with_point(text: String) -> String {
    if text.contains(['.', 'e']) {
        return text;
    }
    text + ".0"
}

fn change(recipe: &str, call: &Call, argument: usize, new: &str) -> Written {
    written(
        amend(recipe, call, argument, new),
        call.arguments[argument].start,
    )
}

fn written(text: String, at: usize) -> Written {
    let line = text::position(&text, at).0;
    Written { text, line }
}

/// An argument, if it is written in plain numbers.
fn literal<'a>(recipe: &'a str, call: &Call, argument: usize) -> Option<&'a str> {
    let range = call.arguments.get(argument)?;
    (!call.nested && is_literal(recipe, range)).then(|| &recipe[range.clone()])
}

fn value(recipe: &str, call: &Call, argument: usize) -> Option<f64> {
    literal(recipe, call, argument)?
        .replace('_', "")
        .parse()
        .ok()
}

/// The first two arguments of a call.
fn stretch(recipe: &str, call: &Call) -> Option<(f64, f64)> {
    Some((value(recipe, call, 0)?, value(recipe, call, 1)?))
}

fn point([x, y]: [f64; 2]) -> String {
    format!("[{}, {}]", number(x), number(y))
}

fn list(points: &[[f64; 2]]) -> String {
    let points: Vec<String> = points.iter().map(|&at| point(at)).collect();
    format!("[{}]", points.join(", "))
}

impl Gesture {
    /// As a call, without its dot.
    fn call(&self) -> String {
        let n = |value: &f64| number(*value);
        match self {
            Gesture::MoveControl { control, to } => {
                format!("move_control({control}, {})", point(*to))
            }
            Gesture::InsertControl { time } => format!("insert_control({})", n(time)),
            Gesture::Pin { frame, to } => format!("pin({frame}, {})", point(*to)),
            Gesture::Unpin { frame } => format!("unpin({frame})"),
            Gesture::AddLoop { from, to } => format!("add_loop({}, {})", n(from), n(to)),
            Gesture::Trim { from, to } => format!("trim({}, {})", n(from), n(to)),
            Gesture::Reverse => "reverse()".to_string(),
            Gesture::Hold { time, frames } => format!("hold({}, {frames})", n(time)),
            Gesture::Speed { from, to, factor } => {
                format!("speed({}, {}, {})", n(from), n(to), n(factor))
            }
            Gesture::Smooth { from, to, amount } => {
                format!("smooth({}, {}, {})", n(from), n(to), n(amount))
            }
            Gesture::Exaggerate { amount } => format!("exaggerate({})", n(amount)),
            Gesture::Extend { frames } => format!("extend({frames})"),
            Gesture::Path { points } => format!("path({})", list(points)),
            Gesture::Retime { keys } => format!("retime({})", list(keys)),
            Gesture::AddPose { at } => format!("add_pose({})", point(*at)),
            Gesture::Param { name, value } => format!("param({name:?}, {value})"),
            Gesture::Key { key, .. } => format!("complete(key {key})"),
            Gesture::Make(make) => format!("{}()", make.function()),
        }
    }
}

/// The nearest number that a recipe would say.
pub fn rounded(value: f64) -> f64 {
    number(value).parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
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
        let other = "// walk\nfit(input())\n    .move_control(3, [1235, 0])\n    .move_control(4, [1, 1])\n";
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
}
