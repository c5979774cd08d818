//! Numbers of a PLY file one after the other, from text or from bytes.

use super::header::{Layout, Property, Type};
use crate::diag::{Diagnostic, Result};
use crate::format::Encoding;

/// A place in the data of a file.
pub(super) struct Scalars<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
    pub(super) encoding: Encoding,
}

impl<'a> Scalars<'a> {
    /// The next number; exact for every type of PLY.
    pub(super) fn number(&mut self, kind: Type) -> Result<f64> {
        if self.encoding == Encoding::Ascii {
            let word = self.word()?;
            return fast_float2::parse(word).map_err(|_| not_a_number(word));
        }
        Ok(match kind {
            Type::I8 => f64::from(i8::from_le_bytes(self.raw()?)),
            Type::U8 => f64::from(u8::from_le_bytes(self.raw()?)),
            Type::I16 => f64::from(i16::from_le_bytes(self.raw()?)),
            Type::U16 => f64::from(u16::from_le_bytes(self.raw()?)),
            Type::I32 => f64::from(i32::from_le_bytes(self.raw()?)),
            Type::U32 => f64::from(u32::from_le_bytes(self.raw()?)),
            Type::F32 => f64::from(f32::from_le_bytes(self.raw()?)),
            Type::F64 => f64::from_le_bytes(self.raw()?),
        })
    }

    /// The next number as a finite f32.
    pub(super) fn coordinate(&mut self, kind: Type) -> Result<f32> {
        let value = if self.encoding == Encoding::Ascii {
            let word = self.word()?;
            fast_float2::parse(word).map_err(|_| not_a_number(word))?
        } else {
            self.number(kind)? as f32
        };
        if value.is_finite() {
            return Ok(value);
        }
        Diagnostic::error("a coordinate is not a finite number")
            .hint("the capture holds a broken frame: leave it out or export it again")
            .err()
    }

    /// The next number as a whole one that is not negative.
    pub(super) fn whole(&mut self, kind: Type, what: &str) -> Result<u32> {
        let value = self.number(kind)?;
        if value >= 0.0 && value <= f64::from(u32::MAX) && value.fract() == 0.0 {
            return Ok(value as u32);
        }
        Diagnostic::error(format!("{value} is not a {what}")).err()
    }

    /// Passes over one property.
    pub(super) fn skip(&mut self, property: &Property) -> Result<()> {
        match property.layout {
            Layout::Scalar(kind) => self.number(kind).map(drop),
            Layout::List { count, item } => {
                let items = self.whole(count, "length of a list")? as usize;
                if self.encoding == Encoding::Ascii {
                    return (0..items).try_for_each(|_| self.word().map(drop));
                }
                self.advance(items * item.size())
            }
        }
    }

    /// Passes over this many bytes.
    pub(super) fn advance(&mut self, bytes: usize) -> Result<()> {
        if bytes > self.bytes.len() - self.at {
            return Err(cut_short());
        }
        self.at += bytes;
        Ok(())
    }

    /// Passes over blanks and line breaks of a text.
    pub(super) fn skip_blanks(&mut self) {
        if self.encoding == Encoding::Ascii {
            let rest = &self.bytes[self.at..];
            self.at += rest.len() - rest.trim_ascii_start().len();
        }
    }

    fn word(&mut self) -> Result<&'a [u8]> {
        self.skip_blanks();
        let rest = &self.bytes[self.at..];
        let end = rest.iter().position(u8::is_ascii_whitespace);
        let word = &rest[..end.unwrap_or(rest.len())];
        self.at += word.len();
        if word.is_empty() {
            return Err(cut_short());
        }
        Ok(word)
    }

    /// The next N bytes as little endian.
    fn raw<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some(bytes) = self.bytes[self.at..].first_chunk::<N>() else {
            return Err(cut_short());
        };
        self.at += N;
        let mut bytes = *bytes;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }
}

fn cut_short() -> Box<Diagnostic> {
    Box::new(
        Diagnostic::error("the data ends before what the header promises")
            .hint("the file is cut short"),
    )
}

fn not_a_number(word: &[u8]) -> Box<Diagnostic> {
    let word = String::from_utf8_lossy(&word[..word.len().min(40)]);
    Box::new(Diagnostic::error(format!("`{word}` is not a number")))
}
