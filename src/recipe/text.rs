//! A recipe as text: where its calls and their arguments stand, and how to change one of them while
//! every other byte of the file stays.
//!
//! This reads just enough of Rhai to do that: comments, strings, identifiers and brackets.

use std::ops::Range;

/// A piece of a recipe that is not white space or comment. Ranges are bytes of the text.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Token {
    /// An identifier or keyword.
    Word,
    /// A number, string, character or template.
    Literal,
    /// One character of punctuation.
    Mark(u8),
}

/// One call `name(..)` or `value.name(..)`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Call {
    /// The function's name.
    pub name: String,
    /// Where the name stands.
    pub at: Range<usize>,
    /// Whether the name follows a dot.
    pub method: bool,
    /// Of a method, where what it is called on ends; else where the name stands.
    pub receiver: usize,
    /// Each argument without the white space around it.
    pub arguments: Vec<Range<usize>>,
    /// Just behind the closing bracket.
    pub end: usize,
    /// Whether the call stands inside braces: in a loop, a function, a branch or a map.
    pub nested: bool,
}

/// Line and column of byte `at`, both from 1; the column counts characters.
pub fn position(text: &str, at: usize) -> (usize, usize) {
    let before = &text[..at];
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (
        before.matches('\n').count() + 1,
        text[start..at].chars().count() + 1,
    )
}

/// Line `line` (from 1) of `text` without its line break; empty when there is none.
pub fn line(text: &str, line: usize) -> &str {
    text.lines().nth(line.saturating_sub(1)).unwrap_or_default()
}

/// All calls of a recipe, outer before inner, in the order of their names. Text that does not parse
/// gives the calls that can be told.
pub fn calls(text: &str) -> Vec<Call> {
    let tokens = tokens(text);
    let mut depth = 0_usize;
    let mut found = Vec::new();
    for (index, (token, range)) in tokens.iter().enumerate() {
        match token {
            Token::Mark(b'{') => depth += 1,
            Token::Mark(b'}') => depth = depth.saturating_sub(1),
            Token::Word
                if !is_keyword(&text[range.clone()]) && mark(&tokens, index + 1) == Some(b'(') =>
            {
                let defines = index > 0 && &text[tokens[index - 1].1.clone()] == "fn";
                if !defines && let Some((arguments, end)) = arguments(&tokens, index + 1) {
                    let method = index > 0 && mark(&tokens, index - 1) == Some(b'.');
                    let name = text[range.clone()].to_string();
                    let before = index.checked_sub(2).filter(|_| method);
                    found.push(Call {
                        name,
                        at: range.clone(),
                        method,
                        receiver: before.map_or(range.start, |before| tokens[before].1.end),
                        arguments,
                        end,
                        nested: depth > 0,
                    });
                }
            }
            _ => {}
        }
    }
    found
}

/// The modules that a recipe imports by a plain text, as they are written.
pub fn imports(text: &str) -> Vec<String> {
    let tokens = tokens(text);
    let pairs = tokens.windows(2);
    let named = pairs.filter_map(|pair| match pair {
        [(Token::Word, word), (Token::Literal, name)] if &text[word.clone()] == "import" => {
            let name = text[name.clone()].strip_prefix('"')?;
            name.strip_suffix('"').map(str::to_string)
        }
        _ => None,
    });
    named.collect()
}

/// The names of the functions that the recipe itself defines.
pub fn definitions(text: &str) -> Vec<String> {
    let tokens = tokens(text);
    let words = tokens
        .windows(2)
        .filter(|pair| &text[pair[0].1.clone()] == "fn");
    words
        .map(|pair| text[pair[1].1.clone()].to_string())
        .collect()
}

/// The text with argument `index` of `call` replaced by `new`.
///
/// # Panics
/// `call` is not of this text or has no such argument.
pub fn amend(text: &str, call: &Call, index: usize, new: &str) -> String {
    let range = call.arguments[index].clone();
    [&text[..range.start], new, &text[range.end..]].concat()
}

/// Whether `range` of the text is written as plain numbers: a number, or an array of numbers. What a
/// variable or a formula made is not to be rewritten.
pub fn is_literal(text: &str, range: &Range<usize>) -> bool {
    let part = &text[range.clone()];
    !part.is_empty()
        && tokens(part).iter().all(|(token, range)| match token {
            Token::Literal => part[range.clone()].starts_with(|c: char| c.is_ascii_digit()),
            Token::Mark(mark) => b"[],-+".contains(mark),
            Token::Word => false,
        })
}

/// The expression that a recipe ends in, and the calls `.name(..)` of its chain in order: not those within
/// arguments.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chain {
    /// Where the expression stands.
    pub range: Range<usize>,
    /// The calls.
    pub calls: Vec<Call>,
}

/// Words that begin something that is no chain.
const STATEMENTS: [&str; 12] = [
    "let", "const", "if", "for", "while", "loop", "do", "switch", "fn", "import", "return", "throw",
];

/// The chain that is the recipe's result; `None` when the recipe does not end in an expression.
pub fn result_chain(text: &str) -> Option<Chain> {
    let tokens = tokens(text);
    let mut depth = 0_usize;
    let mut first = 0;
    for (index, (token, _)) in tokens.iter().enumerate() {
        match token {
            Token::Mark(b'(' | b'[' | b'{') => depth += 1,
            Token::Mark(b')' | b']' | b'}') => depth = depth.saturating_sub(1),
            _ => {}
        }
        // A block ends a statement, a map does not: maps stand inside brackets.
        if depth == 0 && matches!(token, Token::Mark(b';' | b'}')) {
            first = index + 1;
        }
    }
    let begin = tokens.get(first)?.1.clone();
    if STATEMENTS.contains(&&text[begin.clone()]) {
        return None;
    }
    let range = begin.start..tokens.last()?.1.end;
    let mut outer = 0_usize;
    let mut of_chain = |call: &Call| {
        let own = call.at.start >= range.start && call.at.start >= outer;
        if own {
            outer = call.end;
        }
        own && call.method && !call.nested
    };
    let calls = calls(text)
        .into_iter()
        .filter(|call| of_chain(call))
        .collect();
    Some(Chain { range, calls })
}

/// The text with `call` (without its dot) put on a line of its own behind the part of the chain that ends
/// at byte `end`, indented as the chain's other lines are, and the line on which it stands. A comment
/// stays on the line that it ends.
pub fn insert_method(text: &str, end: usize, call: &str) -> (String, usize) {
    let start = text[..end].rfind('\n').map_or(0, |newline| newline + 1);
    let own = indent(&text[start..end]);
    let chained = |line: &str| line.trim_start().starts_with('.');
    let next = text[end..].lines().nth(1).filter(|line| chained(line));
    let indent = match next {
        _ if chained(&text[start..end]) => own.to_string(),
        Some(next) => indent(next).to_string(),
        None => format!("{own}    "),
    };
    let rest = &text[end..];
    let rest = &rest[..rest.find('\n').unwrap_or(rest.len())];
    let comment = rest.trim_start().starts_with("//");
    let at = if comment {
        end + rest.trim_end().len()
    } else {
        end
    };
    let text = [&text[..at], "\n", &indent, ".", call, &text[at..]].concat();
    let line = position(&text, at + 1).0;
    (text, line)
}

fn indent(line: &str) -> &str {
    &line[..line.len() - line.trim_start().len()]
}

/// A number as a person would write it: four digits, no trailing zeros.
pub fn number(value: f64) -> String {
    let text = if value.abs() >= 1e-3 && value.abs() < 1e6 {
        let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 9) as usize;
        format!("{value:.digits$}")
    } else {
        format!("{value:.3e}").replace("e0", "")
    };
    let text = match text.split_once('.') {
        Some((whole, rest)) if !rest.contains('e') => {
            let rest = rest.trim_end_matches('0');
            if rest.is_empty() {
                whole.to_string()
            } else {
                format!("{whole}.{rest}")
            }
        }
        _ => text,
    };
    if value == 0.0 || text == "-0" {
        "0".to_string()
    } else {
        text
    }
}

fn is_keyword(word: &str) -> bool {
    [
        "if", "while", "for", "switch", "return", "throw", "in", "until", "else", "let", "const",
        "catch",
    ]
    .contains(&word)
}

fn mark(tokens: &[(Token, Range<usize>)], index: usize) -> Option<u8> {
    match tokens.get(index)?.0 {
        Token::Mark(mark) => Some(mark),
        _ => None,
    }
}

/// The arguments between the bracket at `open` and its partner, and the byte behind that.
fn arguments(tokens: &[(Token, Range<usize>)], open: usize) -> Option<(Vec<Range<usize>>, usize)> {
    let (mut depth, mut found, mut current) = (0_usize, Vec::new(), None::<Range<usize>>);
    let mut bars = false;
    for (token, range) in &tokens[open..] {
        let mark = if let Token::Mark(mark) = token {
            *mark
        } else {
            0
        };
        match mark {
            b'|' if depth == 1 => bars = !bars,
            b'(' | b'[' | b'{' => depth += 1,
            b')' | b']' | b'}' => depth -= 1,
            _ => {}
        }
        let opening = depth == 1
            && mark == b'('
            && current.is_none()
            && found.is_empty()
            && range.start == tokens[open].1.start;
        if depth == 0 {
            found.extend(current.take());
            return Some((found, range.end));
        }
        if depth == 1 && mark == b',' && !bars {
            found.extend(current.take());
        } else if !opening {
            current = Some(current.map_or(range.start, |current| current.start)..range.end);
        }
    }
    None
}

pub(super) fn tokens(text: &str) -> Vec<(Token, Range<usize>)> {
    let bytes = text.as_bytes();
    let mut found = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let start = at;
        let rest = &text[at..];
        let first = bytes[at];
        if first.is_ascii_whitespace() {
            at += 1;
        } else if rest.starts_with("//") {
            at += rest.find('\n').unwrap_or(rest.len());
        } else if rest.starts_with("/*") {
            at += block_comment(rest);
        } else if matches!(first, b'"' | b'\'' | b'`') {
            at += quoted(rest, first);
            found.push((Token::Literal, start..at));
        } else if first.is_ascii_digit() {
            at += number_length(rest);
            found.push((Token::Literal, start..at));
        } else if first.is_ascii_alphabetic() || first == b'_' || !first.is_ascii() {
            at += rest
                .find(|c: char| !(c.is_alphanumeric() || c == '_'))
                .unwrap_or(rest.len())
                .max(1);
            while !text.is_char_boundary(at) {
                at += 1;
            }
            found.push((Token::Word, start..at));
        } else {
            at += 1;
            found.push((Token::Mark(first), start..at));
        }
    }
    found
}

/// The length of a block comment, which may hold others.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < text.len() {
        let rest = &text.as_bytes()[at..];
        if rest.starts_with(b"/*") {
            depth += 1;
            at += 2;
        } else if rest.starts_with(b"*/") {
            depth -= 1;
            at += 2;
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    text.len()
}

/// The length of a string, character or template that begins and ends with `quote`.
fn quoted(text: &str, quote: u8) -> usize {
    let bytes = text.as_bytes();
    let mut at = 1;
    while at < bytes.len() {
        match bytes[at] {
            b'\\' => at += 1,
            byte if byte == quote => return at + 1,
            _ => {}
        }
        at += 1;
    }
    bytes.len()
}

/// The length of a number; a range `1..5` ends it at the dots, a method call `1.max` at the dot.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digit = |at: usize| {
        bytes
            .get(at)
            .is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
    };
    let mut at = 0;
    let mut dotted = false;
    loop {
        let exponent = at > 0
            && matches!(bytes[at - 1], b'e' | b'E')
            && matches!(bytes.get(at), Some(b'-' | b'+'));
        let dot = !dotted
            && bytes.get(at) == Some(&b'.')
            && bytes.get(at + 1).is_some_and(u8::is_ascii_digit);
        if !(digit(at) || exponent || dot) {
            return at;
        }
        dotted |= dot;
        at += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECIPE: &str = "// walk.rhai, add_loop(1, 2)\nlet horse = fit(input(), #{ tolerance: 0.02 });\nhorse.add_loop(12, 24, #{ times: times }) // pin(3, x)\n     .pin(3, [0.5, -1e-3]);\n";

    #[test]
    fn calls_are_found_outside_comments_and_strings() {
        let names: Vec<_> = calls(RECIPE)
            .into_iter()
            .map(|call| (call.name, call.method, call.arguments.len()))
            .collect();
        let expected = [
            ("fit", false, 2),
            ("input", false, 0),
            ("add_loop", true, 3),
            ("pin", true, 2),
        ];
        assert_eq!(
            names,
            expected.map(|(name, method, count)| (name.to_string(), method, count))
        );
        assert!(
            calls("let s = \"f(1)\"; if (a) { g(|x, y| x + y, 2) }")
                .iter()
                .all(|call| call.name == "g" && call.arguments.len() == 2)
        );
    }

    #[test]
    fn amending_keeps_every_other_byte() {
        let call = calls(RECIPE).pop().unwrap();
        let amended = amend(RECIPE, &call, 1, "[1, 2]");
        assert_eq!(amended, RECIPE.replace("[0.5, -1e-3]", "[1, 2]"));
    }

    #[test]
    fn only_numbers_are_literal() {
        let pin = calls(RECIPE).pop().unwrap();
        assert!(is_literal(RECIPE, &pin.arguments[0]) && is_literal(RECIPE, &pin.arguments[1]));
        let text = "f(a, 2 * 3, [x, 1], \"1\")";
        assert!(
            calls(text)[0]
                .arguments
                .iter()
                .all(|argument| !is_literal(text, argument))
        );
    }

    #[test]
    fn a_method_joins_the_chain_it_follows() {
        let appended = |text: &str| {
            let end = result_chain(text).unwrap().range.end;
            insert_method(text, end, "d()")
        };
        let cases = [
            ("fit(input())\n", "fit(input())\n    .d()\n", 2),
            (
                "a.b()\n  .c() // end\n",
                "a.b()\n  .c() // end\n  .d()\n",
                3,
            ),
            ("a.b()\n  .c() // end", "a.b()\n  .c() // end\n  .d()", 3),
            ("a /* end */", "a\n    .d() /* end */", 2),
        ];
        for (before, after, line) in cases {
            assert_eq!(appended(before), (after.to_string(), line));
        }
    }

    #[test]
    fn the_result_is_the_last_expression_and_its_own_calls() {
        let names = |text: &str| -> Option<Vec<String>> {
            let calls = result_chain(text)?.calls;
            Some(calls.into_iter().map(|call| call.name).collect())
        };
        let text = "let a = f(1).g();\na.b(c.d(), #{ e: x.f(1) })\n .h(|t| t.k()).l[0].m()";
        assert_eq!(names(text).unwrap(), ["b", "h", "m"]);
        assert_eq!(names("fn f(x) { x.y() }\nf(2).z()").unwrap(), ["z"]);
        assert_eq!(names(RECIPE), None);
        for text in [
            "",
            "let a = 1",
            "if a { b.c() }",
            "for i in 0..3 { }",
            "// only",
        ] {
            assert_eq!(names(text), None, "{text}");
        }
    }

    #[test]
    fn numbers_have_four_digits() {
        let cases = [
            (0.5, "0.5"),
            (1.0 / 3.0, "0.3333"),
            (-12.345678, "-12.35"),
            (2.0, "2"),
            (123456.0, "123456"),
            (0.0, "0"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(number(1.25e-7).parse::<f64>().unwrap(), 1.25e-7);
    }

    #[test]
    fn positions_count_characters() {
        assert_eq!(position("aß\nc", 4), (2, 1));
        assert_eq!(position("aßc", 3), (1, 3));
    }

    #[test]
    fn imports_are_found_where_they_are_code() {
        let text =
            "// import \"no\"\nimport \"lib/a\" as a;\nlet b = \"import\"; import \"b\" as b;";
        assert_eq!(imports(text), ["lib/a", "b"]);
    }
}
