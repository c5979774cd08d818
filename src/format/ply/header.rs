//! The header of a PLY file: which elements follow, how many, and how their properties are laid out.

use memchr::memchr;

use crate::diag::{Diagnostic, Result};
use crate::format::{Encoding, nothing_in_it};

/// What follows the header.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    pub(super) fps: Option<f64>,
    /// Where the data starts, in bytes.
    pub(super) length: usize,
}

/// `element name count` and its properties.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

/// `property type name` or `property list count item name`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) layout: Layout,
}

/// One value, or a count and as many values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    Scalar(Type),
    List { count: Type, item: Type },
}

/// The types of PLY.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Type::I8,
            "uchar" | "uint8" => Type::U8,
            "short" | "int16" => Type::I16,
            "ushort" | "uint16" => Type::U16,
            "int" | "int32" => Type::I32,
            "uint" | "uint32" => Type::U32,
            "float" | "float32" => Type::F32,
            "double" | "float64" => Type::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Type::I8 | Type::U8 => 1,
            Type::I16 | Type::U16 => 2,
            Type::I32 | Type::U32 | Type::F32 => 4,
            Type::F64 => 8,
        }
    }
}

impl Element {
    /// Bytes of one entry if no property is a list.
    pub(super) fn stride(&self) -> Option<usize> {
        let sizes = self
            .properties
            .iter()
            .map(|property| match property.layout {
                Layout::Scalar(kind) => Some(kind.size()),
                Layout::List { .. } => None,
            });
        sizes.sum()
    }

    /// The fewest bytes that one entry can have.
    fn least(&self, encoding: Encoding) -> usize {
        let sizes = self
            .properties
            .iter()
            .map(|property| match property.layout {
                _ if encoding == Encoding::Ascii => "0 ".len(),
                Layout::Scalar(kind) | Layout::List { count: kind, .. } => kind.size(),
            });
        sizes.sum()
    }

    /// Refuses a count that `rest` bytes cannot hold.
    pub(super) fn check_count(&self, encoding: Encoding, rest: usize) -> Result<()> {
        let needed = self.count as u128 * self.least(encoding) as u128;
        // the last line of a text needs no line break
        if needed <= rest as u128 + u128::from(encoding == Encoding::Ascii) {
            return Ok(());
        }
        Diagnostic::error(format!(
            "the header promises {} of `{}`, at least {needed} bytes, but {rest} are left",
            self.count, self.name
        ))
        .hint("the file is cut short or its header is damaged")
        .err()
    }

    pub(super) fn property(&self, names: &[&str]) -> Option<usize> {
        let named = |property: &Property| names.contains(&property.name.as_str());
        self.properties.iter().position(named)
    }
}

impl Header {
    /// Reads the header at the start of `bytes`.
    pub(super) fn read(bytes: &[u8]) -> Result<Self> {
        if bytes.is_empty() {
            return nothing_in_it().err();
        }
        let mut header = Header {
            encoding: Encoding::Ascii,
            elements: Vec::new(),
            fps: None,
            length: 0,
        };
        let mut encoding = None;
        for line in 1.. {
            let text = header.line(bytes, line)?;
            let words: Vec<&str> = text.split_ascii_whitespace().collect();
            let read = match words.as_slice() {
                ["ply"] if line == 1 => Ok(()),
                _ if line == 1 => Diagnostic::error("not a PLY file: it does not begin with `ply`")
                    .hint("check the ending of the file")
                    .err(),
                ["end_header"] => break,
                ["format", name, ..] => named_encoding(name).map(|found| encoding = Some(found)),
                ["element", name, count] => header.element(name, count),
                ["property", rest @ ..] => header.property(rest),
                ["comment", "fps", fps] => {
                    let fps = fps.parse().ok();
                    header.fps = fps.filter(|fps: &f64| fps.is_finite() && *fps > 0.0);
                    Ok(())
                }
                [] | ["comment" | "obj_info", ..] => Ok(()),
                [word, ..] => {
                    Diagnostic::error(format!("`{word}` does not belong in a PLY header")).err()
                }
            };
            read.map_err(|error| Box::new(error.at_line(line)))?;
        }
        match encoding {
            Some(encoding) => header.encoding = encoding,
            None => return Diagnostic::error("the header names no format").err(),
        }
        Ok(header)
    }

    /// The next line of the header, as text.
    fn line<'a>(&mut self, bytes: &'a [u8], line: usize) -> Result<&'a str> {
        const LONGEST: usize = 1 << 16;
        let rest = &bytes[self.length..];
        let rest = &rest[..rest.len().min(LONGEST)];
        let text = memchr(b'\n', rest).and_then(|end| {
            self.length += end + 1;
            std::str::from_utf8(&rest[..end]).ok()
        });
        match text {
            Some(text) => Ok(text),
            None if line == 1 => Diagnostic::error("not a PLY file: it does not begin with `ply`")
                .hint("check the ending of the file")
                .err(),
            None => Diagnostic::error("the header does not end")
                .at_line(line)
                .hint("the file may be cut short")
                .err(),
        }
    }

    fn element(&mut self, name: &str, count: &str) -> Result<()> {
        let Ok(count) = count.parse() else {
            return Diagnostic::error(format!("`{count}` is not a number of elements")).err();
        };
        if self.elements.iter().any(|one| one.name == name) {
            return Diagnostic::error(format!("the element `{name}` stands there twice")).err();
        }
        self.elements.push(Element {
            name: name.to_string(),
            count,
            properties: Vec::new(),
        });
        Ok(())
    }

    fn property(&mut self, words: &[&str]) -> Result<()> {
        let kind = |name: &str| {
            Type::named(name).ok_or_else(|| {
                Box::new(Diagnostic::error(format!("`{name}` is not a type of PLY")))
            })
        };
        let (name, layout) = match words {
            ["list", count, item, name] => {
                let (count, item) = (kind(count)?, kind(item)?);
                (name, Layout::List { count, item })
            }
            [scalar, name] => (name, Layout::Scalar(kind(scalar)?)),
            _ => return Diagnostic::error("a property needs a type and a name").err(),
        };
        let Some(element) = self.elements.last_mut() else {
            return Diagnostic::error("a property before the first element").err();
        };
        element.properties.push(Property {
            name: (*name).to_string(),
            layout,
        });
        Ok(())
    }
}

fn named_encoding(name: &str) -> Result<Encoding> {
    match name {
        "ascii" => Ok(Encoding::Ascii),
        "binary_little_endian" => Ok(Encoding::LittleEndian),
        "binary_big_endian" => Ok(Encoding::BigEndian),
        _ => Diagnostic::error(format!("`{name}` is not a format of PLY")).err(),
    }
}
