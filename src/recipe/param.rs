//! Parameters that a recipe declares with `param(name, default, min, max)`: sliders in the studio,
//! `--set name=value` on the command line.

use std::fmt;

use serde::Serialize;

use crate::diag::{Diagnostic, Result};

/// The value of a parameter. Its kind is that of the default it was declared with.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Setting {
    /// `true` or `false`.
    Flag(bool),
    /// A whole number.
    Integer(i64),
    /// A number.
    Number(f64),
    /// A text.
    Text(String),
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Setting::Flag(value) => write!(f, "{value}"),
            Setting::Integer(value) => write!(f, "{value}"),
            Setting::Number(value) => write!(f, "{value}"),
            Setting::Text(value) => f.write_str(value),
        }
    }
}

/// One declared parameter and the value it has in this run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Param {
    /// Its name.
    pub name: String,
    /// The value when nothing is set.
    pub default: Setting,
    /// The least and the greatest value, where the recipe gives them.
    pub range: Option<(f64, f64)>,
    /// The value of this run.
    pub value: Setting,
    /// The line that declares it, from 1.
    pub line: usize,
}

impl Param {
    /// The value that `text` (of `--set name=text`) stands for.
    ///
    /// # Errors
    /// `text` is not of the parameter's kind or leaves its range.
    pub fn parse(&self, text: &str) -> Result<Setting> {
        let wrong = |kind: &str| {
            let message = format!("parameter `{}` is {kind}, got `{text}`", self.name);
            Diagnostic::error(message)
                .hint(format!("its default is {}", self.default))
                .err()
        };
        let value = match self.default {
            Setting::Flag(_) => text
                .parse()
                .ok()
                .map(Setting::Flag)
                .map_or_else(|| wrong("true or false"), Ok)?,
            Setting::Integer(_) => text
                .parse()
                .ok()
                .map(Setting::Integer)
                .map_or_else(|| wrong("a whole number"), Ok)?,
            Setting::Number(_) => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Setting::Number(number),
                _ => return wrong("a number"),
            },
            Setting::Text(_) => Setting::Text(text.to_string()),
        };
        self.within(value)
    }

    /// `value` if it lies in the parameter's range.
    ///
    /// # Errors
    /// It does not; the range is named.
    pub fn within(&self, value: Setting) -> Result<Setting> {
        let number = match value {
            Setting::Integer(value) => value as f64,
            Setting::Number(value) => value,
            Setting::Flag(_) | Setting::Text(_) => return Ok(value),
        };
        match self.range {
            Some((least, greatest)) if !(least <= number && number <= greatest) => {
                Diagnostic::error(format!(
                    "parameter `{}` is {least} to {greatest}, got {number}",
                    self.name
                ))
                .err()
            }
            _ => Ok(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn times() -> Param {
        let two = Setting::Integer(2);
        Param {
            name: "times".into(),
            default: two.clone(),
            range: Some((1.0, 6.0)),
            value: two,
            line: 1,
        }
    }

    #[test]
    fn settings_keep_the_kind_and_the_range() {
        assert_eq!(times().parse("3").unwrap(), Setting::Integer(3));
        for (text, message) in [
            ("7", "parameter `times` is 1 to 6, got 7"),
            ("2.5", "parameter `times` is a whole number, got `2.5`"),
        ] {
            assert_eq!(times().parse(text).unwrap_err().message, message);
        }
    }
}
