//! What a recipe makes of poses: a loom, a motion through them, their statistics. Each is one call about
//! the recipe's result, which a gesture changes for another.

use std::ops::Range;

use super::gesture::Written;
use super::options::{Change, changed};
use super::text::{Call, Token, calls, position, result_chain, tokens};
use crate::diag::{Diagnostic, Result};

/// What can be made of poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Make {
    /// `fit`: a loom.
    Loom,
    /// `complete`: a motion through key poses.
    Motion,
    /// `pca`: principal components.
    Statistics,
}

/// A number that each key of a motion has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeyNumber {
    /// When the key is reached.
    Time,
    /// See [`crate::pipeline::Handle`].
    Tension,
    /// The same.
    Continuity,
    /// The same.
    Bias,
}

impl KeyNumber {
    fn option(self) -> &'static str {
        match self {
            KeyNumber::Time => "times",
            KeyNumber::Tension => "tension",
            KeyNumber::Continuity => "continuity",
            KeyNumber::Bias => "bias",
        }
    }
}

impl Make {
    /// The function's name.
    pub(super) fn function(self) -> &'static str {
        match self {
            Make::Loom => "fit",
            Make::Motion => "complete",
            Make::Statistics => "pca",
        }
    }

    fn of(name: &str) -> Option<Self> {
        let all = [Make::Loom, Make::Motion, Make::Statistics];
        all.into_iter().find(|make| make.function() == name)
    }
}

/// The recipe with numbers of key `key` (from 1) changed in its `complete(..)`: for each kind the numbers
/// of all keys.
///
/// # Errors
/// The result is no `complete(..)` nor a variable that one was given.
pub(super) fn with_key(
    recipe: &str,
    key: usize,
    numbers: &[(KeyNumber, Vec<f64>)],
) -> Result<Written> {
    let mut text = recipe.to_string();
    let mut first = None;
    for (number, all) in numbers {
        let call = completion(&text)?;
        let change = Change {
            name: number.option(),
            item: key.saturating_sub(1),
            all,
        };
        let (new, at) = changed(&text, &call, usize::from(!call.method), &change);
        first = Some(first.map_or(at, |first: usize| first.min(at)));
        text = new;
    }
    let line = position(&text, first.unwrap_or(0)).0;
    Ok(Written { text, line })
}

/// The call of `complete` that gives the recipe's result.
fn completion(recipe: &str) -> Result<Call> {
    let made = || {
        let range = result_chain(recipe)?.range;
        let found = || calls(recipe).into_iter();
        let ends = |call: &Call, end: usize| call.name == "complete" && call.end == end;
        let own = found().find(|call| ends(call, range.end));
        own.or_else(|| {
            let value = given(recipe, &recipe[range])?;
            found().find(|call| ends(call, value.end) && call.at.start >= value.start)
        })
    };
    made().map_or_else(
        || {
            Diagnostic::error("the result is not written as `complete(..)` here: its keys stay")
                .hint("let the recipe end in `complete(keys, #{ .. })`, or in a variable that is")
                .err()
        },
        Ok,
    )
}

/// What the last `let name = ..;` outside of blocks gives a variable.
fn given(recipe: &str, name: &str) -> Option<Range<usize>> {
    let tokens = tokens(recipe);
    let mut depth = 0_usize;
    let (mut begun, mut found) = (None, None);
    for (index, (token, range)) in tokens.iter().enumerate() {
        match token {
            Token::Mark(b'(' | b'[' | b'{') => depth += 1,
            Token::Mark(b')' | b']' | b'}') => depth = depth.saturating_sub(1),
            Token::Mark(b';') if depth == 0 => {
                if let Some(start) = begun.take() {
                    found = Some(start..tokens[index - 1].1.end);
                }
            }
            Token::Mark(b'=') if depth == 0 && index >= 2 => {
                let words = [index - 2, index - 1].map(|at| &recipe[tokens[at].1.clone()]);
                if words == ["let", name] {
                    begun = Some(range.end);
                }
            }
            _ => {}
        }
    }
    found
}

/// The recipe with something else made of its poses: a call in the place of the one that makes another
/// thing of them, or around the result. Of a motion a loom is made around it.
///
/// # Errors
/// The recipe does not end in an expression, or makes that already.
pub(super) fn made(recipe: &str, make: Make) -> Result<Written> {
    let Some(chain) = result_chain(recipe) else {
        return Diagnostic::error("the recipe ends in nothing that something could be made of")
            .hint("let its last line be the poses, without a semicolon")
            .err();
    };
    let range = chain.range;
    let outer = calls(recipe)
        .into_iter()
        .find(|call| !call.method && call.at.start == range.start && call.end == range.end);
    let now = outer.as_ref().and_then(|call| Make::of(&call.name));
    let poses = match (&outer, now) {
        (_, Some(now)) if now == make => {
            return Diagnostic::error(format!(
                "the recipe ends in `{}(..)` already",
                make.function()
            ))
            .err();
        }
        (Some(call), Some(now)) if !(now == Make::Motion && make == Make::Loom) => {
            call.arguments.first().cloned()
        }
        _ => None,
    };
    let poses = poses.unwrap_or(range.clone());
    let inner = recipe[poses].trim();
    // A loom of a motion becomes the motion again.
    let whole = make == Make::Motion && inner.starts_with("complete(");
    let new = match whole {
        true => inner.to_string(),
        false => format!("{}({inner})", make.function()),
    };
    let text = [&recipe[..range.start], &new, &recipe[range.end..]].concat();
    let line = position(&text, range.start).0;
    Ok(Written { text, line })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(recipe: &str) -> Result<String> {
        let numbers = [(KeyNumber::Time, vec![1.0, 30.25, 49.0])];
        with_key(recipe, 2, &numbers).map(|written| written.text)
    }

    #[test]
    fn a_key_is_moved_in_the_call_that_gives_the_result() {
        for (before, after) in [
            (
                "complete(keys, #{ times: [1, 25, 49] })\n",
                "complete(keys, #{ times: [1, 30.25, 49] })\n",
            ),
            (
                "let a = complete(k, #{ times: [1, 2, 3] });\nlet b = complete(k, #{ times: [1, 2, 3] }); // b\nb",
                "let a = complete(k, #{ times: [1, 2, 3] });\nlet b = complete(k, #{ times: [1, 30.25, 3] }); // b\nb",
            ),
            (
                "let b = input();\nb.complete()",
                "let b = input();\nb.complete(#{ times: [1, 30.25, 49] })",
            ),
        ] {
            assert_eq!(moved(before).unwrap(), after);
        }
        for refused in [
            "complete(keys).slice(1, 2)",
            "fit(complete(keys))",
            "let a = if x { complete(k) } else { 1 };\na",
            "let a = complete(k);",
        ] {
            let error = moved(refused).unwrap_err();
            assert!(error.hints[0].contains("complete(keys"), "{refused}");
        }
    }

    #[test]
    fn numbers_of_several_kinds_are_one_gesture() {
        let numbers = [
            (KeyNumber::Tension, vec![0.0, 0.5]),
            (KeyNumber::Bias, vec![0.1, -0.123_456]),
        ];
        let recipe = "// two\ncomplete(k, #{\n  bias: [0.1, 0],\n  frames: 9\n})";
        let written = with_key(recipe, 2, &numbers).unwrap();
        let wanted =
            "// two\ncomplete(k, #{\n  bias: [0.1, -0.1235],\n  frames: 9, tension: [0, 0.5]\n})";
        assert_eq!((written.text.as_str(), written.line), (wanted, 3));
    }

    #[test]
    fn poses_become_a_loom_a_motion_or_statistics() {
        let check = |before: &str, make, after: &str| {
            let written = made(before, make).unwrap();
            assert_eq!(written.text, after);
        };
        check(
            "fit(input()) // all\n",
            Make::Motion,
            "complete(input()) // all\n",
        );
        check(
            "fit(input(), #{ modes: 3 })",
            Make::Statistics,
            "pca(input())",
        );
        check("pca(a, #{})", Make::Loom, "fit(a)");
        check("complete(k, #{})\n", Make::Loom, "fit(complete(k, #{}))\n");
        check("fit(complete(k, #{}))", Make::Motion, "complete(k, #{})");
        check(
            "let k = input();\n[k.frame(1), k.frame(2)]",
            Make::Motion,
            "let k = input();\ncomplete([k.frame(1), k.frame(2)])",
        );
        check(
            "fit(a).reverse()",
            Make::Statistics,
            "pca(fit(a).reverse())",
        );
        let twice = made("pca(input())", Make::Statistics).unwrap_err();
        assert!(twice.message.contains("already"));
        assert!(made("let a = 1;", Make::Motion).is_err());
    }
}
