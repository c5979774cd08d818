//! What a hand does to a loom, as a line of its recipe, written as a person would: the line that a gesture
//! repeats is amended, anything else gets a new line, numbers have four digits, and every other byte
//! stays. What a loop or a variable made is never rewritten.

mod amend;

use super::text::{Call, Chain, insert_method, number, result_chain};
use super::{KeyNumber, Make, Setting, result};
use crate::diag::{Diagnostic, Result};
use amend::{amended, literal, set_default, written};

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
mod tests;
