//! Gestures that repeat a line of the recipe change it, and nothing else; a line is found by what it does, if
//! it is written in plain numbers.

use super::{Gesture, Written, list, point, retime_keys};
use crate::diag::{Diagnostic, Result};
use crate::recipe::Setting;
use crate::recipe::text::{self, Call, amend, calls, is_literal, number};

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

/// The text with an earlier line changed, where the gesture repeats one.
pub(super) fn amended(recipe: &str, calls: &[Call], gesture: &Gesture) -> Option<Written> {
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
pub(super) fn set_default(recipe: &str, name: &str, value: &Setting) -> Result<Written> {
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

pub(super) fn written(text: String, at: usize) -> Written {
    let line = text::position(&text, at).0;
    Written { text, line }
}

/// An argument, if it is written in plain numbers.
pub(super) fn literal<'a>(recipe: &'a str, call: &Call, argument: usize) -> Option<&'a str> {
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
