//! INPUT and the options that say how to read it.

use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use crate::diag::{Diagnostic, Result};

/// INPUT and the options that say how to read it.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct InputSpec {
    /// Folders, files, globs and patterns, as the user wrote them.
    pub paths: Vec<PathBuf>,
    /// The mesh that gives a point cache its faces.
    pub mesh: Option<PathBuf>,
    /// The part of the capture that is wanted.
    pub range: Option<FrameRange>,
    /// Frames per second; takes precedence over what the files say.
    pub fps: Option<f64>,
}

impl InputSpec {
    /// One input, all of its frames.
    pub fn new(path: impl Into<PathBuf>) -> Self {
        InputSpec {
            paths: vec![path.into()],
            ..InputSpec::default()
        }
    }
}

/// Frames A to B, both included, counted from 1; either end may be open.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FrameRange {
    /// The first frame.
    pub first: Option<usize>,
    /// The last frame.
    pub last: Option<usize>,
}

impl FromStr for FrameRange {
    type Err = String;

    /// `A:B`, `A:`, `:B`, or `A` alone.
    fn from_str(text: &str) -> Result<Self, String> {
        let frame = |text: &str| match text.trim() {
            "" => Ok(None),
            text => match text.parse() {
                Ok(0) => Err("frames are counted from 1".to_string()),
                Ok(frame) => Ok(Some(frame)),
                Err(_) => Err(format!("`{text}` is not a frame number")),
            },
        };
        let (first, last) = text.split_once(':').unwrap_or((text, text));
        let range = FrameRange {
            first: frame(first)?,
            last: frame(last)?,
        };
        match range {
            FrameRange {
                first: Some(first),
                last: Some(last),
            } if first > last => Err(format!("frame {first} comes after frame {last}")),
            range => Ok(range),
        }
    }
}

impl FrameRange {
    /// These frames of `frames`, from 0 and half open.
    ///
    /// # Errors
    /// The range leaves the capture.
    pub fn within(self, frames: usize) -> Result<Range<usize>> {
        let (first, last) = (self.first.unwrap_or(1), self.last.unwrap_or(frames));
        if first >= 1 && first <= last && last <= frames {
            return Ok(first - 1..last);
        }
        Diagnostic::error(format!(
            "the range {first}:{last} leaves the capture, which has {frames} frames"
        ))
        .hint(format!("choose within 1:{frames}"))
        .err()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn range(text: &str, frames: usize) -> Option<Range<usize>> {
        text.parse::<FrameRange>().ok()?.within(frames).ok()
    }

    #[test]
    fn ranges_count_from_one_and_include_both_ends() {
        assert_eq!(range("2:4", 9), Some(1..4));
        assert_eq!(range("2:", 9), Some(1..9));
        assert_eq!(range(":4", 9), Some(0..4));
        assert_eq!(range(":", 9), Some(0..9));
        assert_eq!(range("9", 9), Some(8..9));
        for wrong in ["0:4", "4:2", "2:10", "10", "a:b", "1:2:3", "-1:2"] {
            assert_eq!(range(wrong, 9), None, "{wrong}");
        }
    }
}
