//! Numbers in the options `#{ name: [..] }` of a call: one item is changed, everything else stays as it is
//! written. What a variable or a formula made is not rewritten: a map with the new numbers is laid over it.

use std::ops::Range;

use super::text::{Call, Token, is_literal, number, tokens};

/// Numbers of an option, one of which is changed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Change<'a> {
    /// The option's name.
    pub(super) name: &'a str,
    /// Which number changes, from 0.
    pub(super) item: usize,
    /// All of them, the new one among them.
    pub(super) all: &'a [f64],
}

/// The recipe with numbers of an option changed, and the byte at which it differs. `argument` is the place
/// of the options among the arguments of `call`, behind those that it has or the last of them.
pub(super) fn changed(
    recipe: &str,
    call: &Call,
    argument: usize,
    change: &Change<'_>,
) -> (String, usize) {
    let map = format!("#{{ {}: {} }}", change.name, list(change.all));
    let Some(options) = call.arguments.get(argument) else {
        return match call.arguments.last() {
            Some(last) => inserted(recipe, last.end, &format!(", {map}")),
            None => inserted(recipe, call.end - 1, &map),
        };
    };
    let over = || inserted(recipe, options.end, &format!(" + {map}"));
    let Some(entries) = last_map(recipe, options) else {
        return over();
    };
    let entry = entries.named.iter().find(|(name, _)| *name == change.name);
    let Some((_, value)) = entry else {
        let new = format!("{}: {}", change.name, list(change.all));
        return match entries.named.last() {
            Some((_, last)) => inserted(recipe, last.end, &format!(", {new}")),
            None => replaced(recipe, &entries.inside, &format!(" {new} ")),
        };
    };
    if !is_literal(recipe, value) {
        return over();
    }
    match items(recipe, value) {
        Some(items) if items.len() == change.all.len() => replaced(
            recipe,
            &items[change.item],
            &number(change.all[change.item]),
        ),
        _ => replaced(recipe, value, &list(change.all)),
    }
}

fn list(numbers: &[f64]) -> String {
    let numbers: Vec<String> = numbers.iter().map(|&x| number(x)).collect();
    format!("[{}]", numbers.join(", "))
}

fn inserted(recipe: &str, at: usize, new: &str) -> (String, usize) {
    replaced(recipe, &(at..at), new)
}

fn replaced(recipe: &str, range: &Range<usize>, new: &str) -> (String, usize) {
    let text = [&recipe[..range.start], new, &recipe[range.end..]].concat();
    (text, range.start)
}

/// A map as it is written.
struct Entries {
    /// Between its brackets.
    inside: Range<usize>,
    /// Names and where their values stand.
    named: Vec<(String, Range<usize>)>,
}

/// The map that an expression ends in: it stands alone, or is laid over others by `+`.
fn last_map(recipe: &str, expression: &Range<usize>) -> Option<Entries> {
    let start = expression.start;
    let tokens: Vec<(Token, Range<usize>)> = tokens(&recipe[expression.clone()])
        .into_iter()
        .map(|(token, range)| (token, range.start + start..range.end + start))
        .collect();
    let mut depth = 0_usize;
    let mut open = None;
    for (index, (token, _)) in tokens.iter().enumerate() {
        match token {
            Token::Mark(b'(' | b'[' | b'{') => {
                let hash = index > 0 && matches!(tokens[index - 1].0, Token::Mark(b'#'));
                let before = index.checked_sub(2).map(|before| &tokens[before].0);
                let alone = matches!(before, None | Some(Token::Mark(b'+')));
                if depth == 0 {
                    open = (hash && alone).then_some(index);
                }
                depth += 1;
            }
            Token::Mark(b')' | b']' | b'}') => depth = depth.saturating_sub(1),
            // Something behind the map.
            _ if depth == 0 && index > 0 => open = None,
            _ => {}
        }
    }
    let (open, close) = (open?, tokens.len() - 1);
    let named = parts(&tokens[open + 1..close])
        .into_iter()
        .filter_map(|part| match part {
            [(_, name), (Token::Mark(b':'), _), (_, first), ..] => {
                let name = recipe[name.clone()].trim_matches('"').to_string();
                let end = part.last().map_or(first.end, |last| last.1.end);
                Some((name, first.start..end))
            }
            _ => None,
        });
    Some(Entries {
        named: named.collect(),
        inside: tokens[open].1.end..tokens[close].1.start,
    })
}

/// The items of an array of plain numbers; none for a lone number.
fn items(recipe: &str, value: &Range<usize>) -> Option<Vec<Range<usize>>> {
    let tokens: Vec<(Token, Range<usize>)> = tokens(&recipe[value.clone()])
        .into_iter()
        .map(|(token, range)| (token, range.start + value.start..range.end + value.start))
        .collect();
    let [(Token::Mark(b'['), _), inner @ .., (Token::Mark(b']'), _)] = &tokens[..] else {
        return None;
    };
    let range = |part: &[(Token, Range<usize>)]| part[0].1.start..part[part.len() - 1].1.end;
    Some(parts(inner).into_iter().map(range).collect())
}

/// What commas outside of brackets separate; nothing for nothing.
fn parts(tokens: &[(Token, Range<usize>)]) -> Vec<&[(Token, Range<usize>)]> {
    let mut depth = 0_usize;
    let comma = |(token, _): &(Token, Range<usize>)| {
        match token {
            Token::Mark(b'(' | b'[' | b'{') => depth += 1,
            Token::Mark(b')' | b']' | b'}') => depth = depth.saturating_sub(1),
            _ => {}
        }
        depth == 0 && matches!(token, Token::Mark(b','))
    };
    tokens
        .split(comma)
        .filter(|part| !part.is_empty())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recipe::text::calls;

    /// Item 2 of three times, changed to 30.
    fn check(recipe: &str, wanted: &str) {
        let call = calls(recipe)
            .into_iter()
            .find(|call| call.name == "complete");
        let change = Change {
            name: "times",
            item: 1,
            all: &[1.0, 30.0, 49.0],
        };
        let call = call.unwrap();
        let (text, at) = changed(recipe, &call, usize::from(!call.method), &change);
        assert_eq!(text, wanted);
        let same = recipe.bytes().zip(text.bytes()).take_while(|(a, b)| a == b);
        assert!(at <= same.count());
    }

    #[test]
    fn one_number_changes_and_every_other_byte_stays() {
        for (before, after) in [
            (
                "complete(keys, #{ tension: 0,\n  times: [1, 25.5 , 49], })",
                "complete(keys, #{ tension: 0,\n  times: [1, 30 , 49], })",
            ),
            (
                "complete(k(1, [2]), #{ \"times\": [1,-5,9] }) // times: [1, 2, 3]",
                "complete(k(1, [2]), #{ \"times\": [1,30,9] }) // times: [1, 2, 3]",
            ),
            (
                "keys.complete(#{ at: #{ times: [1, 2, 3] }, times: [1, 2, 3] })",
                "keys.complete(#{ at: #{ times: [1, 2, 3] }, times: [1, 30, 3] })",
            ),
        ] {
            check(before, after);
        }
    }

    #[test]
    fn what_is_not_written_yet_is_added() {
        for (before, after) in [
            ("complete(keys)", "complete(keys, #{ times: [1, 30, 49] })"),
            ("keys.complete()", "keys.complete(#{ times: [1, 30, 49] })"),
            (
                "complete(keys, #{})",
                "complete(keys, #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ frames: 30 })",
                "complete(keys, #{ frames: 30, times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ times: 4 })",
                "complete(keys, #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ times: [1, 2] })",
                "complete(keys, #{ times: [1, 30, 49] })",
            ),
        ] {
            check(before, after);
        }
    }

    #[test]
    fn what_a_variable_or_a_formula_made_is_laid_over() {
        for (before, after) in [
            (
                "complete(keys, options)",
                "complete(keys, options + #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, options + #{ times: [1, 20, 49] })",
                "complete(keys, options + #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ times: t })",
                "complete(keys, #{ times: t } + #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ times: t } + #{ times: [1, 20, 49] })",
                "complete(keys, #{ times: t } + #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, #{ times: [1, 2 * n, 9] })",
                "complete(keys, #{ times: [1, 2 * n, 9] } + #{ times: [1, 30, 49] })",
            ),
            (
                "complete(keys, of(#{ times: [1, 2, 9] }))",
                "complete(keys, of(#{ times: [1, 2, 9] }) + #{ times: [1, 30, 49] })",
            ),
        ] {
            check(before, after);
        }
    }
}
