//! The lines of an OBJ file, and the numbers in them.

use std::borrow::Cow;

use memchr::memchr;

use crate::diag::{Diagnostic, Result};

/// One statement: a line, or several joined by `\` at their ends.
pub(super) struct Statement<'a> {
    /// Where it starts in the file, in bytes.
    pub(super) start: usize,
    /// Where it ends: its line break, or the end of the file.
    pub(super) end: usize,
    /// The line it starts on, from 1.
    pub(super) line: usize,
    /// Its text, without line breaks.
    pub(super) text: Cow<'a, [u8]>,
}

/// The statements of a file, blank lines and comments included.
pub(super) struct Statements<'a> {
    bytes: &'a [u8],
    at: usize,
    line: usize,
}

impl<'a> Statements<'a> {
    /// From byte `start` on; the line there is not known and counts from 1.
    pub(super) fn new(bytes: &'a [u8], start: usize) -> Self {
        Statements {
            bytes,
            at: start,
            line: 1,
        }
    }

    /// Where the next line break is, or the end.
    fn line_end(&self) -> usize {
        memchr(b'\n', &self.bytes[self.at..]).map_or(self.bytes.len(), |length| self.at + length)
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = Statement<'a>;

    fn next(&mut self) -> Option<Statement<'a>> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let (start, line) = (self.at, self.line);
        let mut text = Cow::Borrowed(&b""[..]);
        loop {
            let end = self.line_end();
            let piece = self.bytes[self.at..end].trim_ascii_end();
            self.at = (end + 1).min(self.bytes.len());
            self.line += 1;
            let joined = piece.strip_suffix(b"\\");
            let piece = joined.unwrap_or(piece);
            if text.is_empty() {
                text = Cow::Borrowed(piece);
            } else {
                let text = text.to_mut();
                text.push(b' ');
                text.extend_from_slice(piece);
            }
            if joined.is_none() || self.at >= self.bytes.len() {
                return Some(Statement {
                    start,
                    end,
                    line,
                    text,
                });
            }
        }
    }
}

/// The words of a statement up to a comment.
pub(super) fn words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    text.split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty())
        .take_while(|word| word[0] != b'#')
}

/// The line (from 1) that byte `at` of a file stands on.
pub(super) fn line_of(bytes: &[u8], at: usize) -> usize {
    1 + memchr::memchr_iter(b'\n', &bytes[..at.min(bytes.len())]).count()
}

/// A finite coordinate.
pub(super) fn coordinate(word: Option<&[u8]>) -> Result<f32> {
    let Some(word) = word else {
        return Diagnostic::error("a vertex needs three coordinates")
            .hint("the file may be cut short")
            .err();
    };
    match fast_float2::parse::<f32, _>(word) {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(_) => {
            let word = String::from_utf8_lossy(word);
            Diagnostic::error(format!("the coordinate `{word}` is not a finite number"))
                .hint("the capture holds a broken frame: leave it out or export it again")
                .err()
        }
        Err(_) => {
            let word = String::from_utf8_lossy(word);
            Diagnostic::error(format!("`{word}` is not a number"))
                .hint("a vertex is `v x y z`; the file may be damaged")
                .err()
        }
    }
}

/// The index `word` as a place from 0 among `count`: positive ones count from 1, negative ones back
/// from the last so far.
pub(super) fn index(word: &[u8], count: usize, what: &str) -> Result<i64> {
    let number: Option<i64> = std::str::from_utf8(word)
        .ok()
        .and_then(|text| text.parse().ok());
    match number {
        Some(number) if number > 0 => Ok(number - 1),
        Some(0) => Diagnostic::error(format!("a face names {what} 0"))
            .hint("OBJ counts from 1")
            .err(),
        Some(number) if count as i64 + number >= 0 => Ok(count as i64 + number),
        Some(number) => Diagnostic::error(format!(
            "a face names {what} {number}, but only {count} stand before it"
        ))
        .hint("negative numbers count back from the last one so far")
        .err(),
        None => {
            let word = String::from_utf8_lossy(word);
            Diagnostic::error(format!("`{word}` is not a {what} number"))
                .hint("a face is `f 1 2 3` or `f 1/1/1 2/2/2 3/3/3`; the file may be damaged")
                .err()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn continued_lines_are_one_statement() {
        let bytes = b"a b \\\r\n c\\\nd\ne";
        let all: Vec<_> = Statements::new(bytes, 0)
            .map(|s| (s.line, s.start, s.end, s.text.into_owned()))
            .collect();
        assert_eq!(
            all,
            [
                (1, 0, 12, b"a b   c d".to_vec()),
                (4, 13, 14, b"e".to_vec())
            ]
        );
    }

    #[test]
    fn indices_count_from_one_or_back_from_the_last() {
        assert_eq!(index(b"3", 5, "vertex").unwrap(), 2);
        assert_eq!(index(b"-1", 5, "vertex").unwrap(), 4);
        assert_eq!(index(b"-5", 5, "vertex").unwrap(), 0);
        for bad in ["0", "-6", "x", "", "1.5", "-9223372036854775808"] {
            assert!(index(bad.as_bytes(), 5, "vertex").is_err(), "{bad}");
        }
    }
}
