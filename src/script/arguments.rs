//! What a recipe may pass: integers and floats alike, points as `[x, y]`, options as `#{ name: value }`.

use rhai::{Array, Dynamic, EvalAltResult, Map};

use super::diagnostics::raise;
use crate::diag::Diagnostic;

/// What a script function gives.
pub(super) type Raw<T> = Result<T, Box<EvalAltResult>>;

/// A number, integer or float.
pub(super) fn number(value: &Dynamic, what: &str) -> Raw<f64> {
    let number = value
        .as_float()
        .or_else(|_| value.as_int().map(|integer| integer as f64));
    match number {
        Ok(number) if number.is_finite() => Ok(number),
        Ok(number) => raise(Diagnostic::error(format!(
            "{what} must be finite, got {number}"
        ))),
        Err(kind) => raise(Diagnostic::error(format!(
            "{what} must be a number, got {kind}"
        ))),
    }
}

/// No count is larger.
const MOST: f64 = 1e9;

/// A whole number of at least `least`; a float without a fraction counts.
pub(super) fn count(value: &Dynamic, what: &str, least: usize) -> Raw<usize> {
    let number = number(value, what)?;
    if number.fract() != 0.0 || number < least as f64 || number > MOST {
        return raise(Diagnostic::error(format!(
            "{what} must be a whole number from {least} to {MOST}, got {number}"
        )));
    }
    Ok(number as usize)
}

/// `[x, y]`.
pub(super) fn point(value: &Dynamic, what: &str) -> Raw<[f64; 2]> {
    let numbers = numbers(value, what)?;
    <[f64; 2]>::try_from(numbers).or_else(|numbers| {
        raise(Diagnostic::error(format!(
            "{what} must be [x, y], got {} numbers",
            numbers.len()
        )))
    })
}

/// An array of numbers.
pub(super) fn numbers(value: &Dynamic, what: &str) -> Raw<Vec<f64>> {
    items(value, what)?
        .iter()
        .map(|item| number(item, what))
        .collect()
}

/// An array of `[x, y]`.
pub(super) fn points(value: &Dynamic, what: &str) -> Raw<Vec<[f64; 2]>> {
    items(value, what)?
        .iter()
        .map(|item| point(item, what))
        .collect()
}

/// The items of an array.
pub(super) fn items(value: &Dynamic, what: &str) -> Raw<Array> {
    match value.clone().into_array() {
        Ok(array) => Ok(array),
        Err(kind) => raise(Diagnostic::error(format!(
            "{what} must be an array, got {kind}"
        ))),
    }
}

/// Named options; every name must be known, so that a misspelt one is not ignored.
pub(super) struct Options {
    map: Map,
}

impl Options {
    /// Options that may carry the names `known`.
    pub(super) fn new(map: Map, known: &[&str]) -> Raw<Self> {
        for name in map.keys() {
            if !known.contains(&name.as_str()) {
                let error = Diagnostic::error(format!("no option `{name}`"));
                let error = match closest(name, known.iter().copied()) {
                    Some(near) => error.hint(format!("did you mean `{near}`?")),
                    None => error,
                };
                return raise(error.hint(format!("the options are {}", known.join(", "))));
            }
        }
        Ok(Options { map })
    }

    /// The option as it was given.
    pub(super) fn get(&self, name: &str) -> Option<&Dynamic> {
        self.map.get(name)
    }

    /// A number, if given.
    pub(super) fn number(&self, name: &str) -> Raw<Option<f64>> {
        self.get(name).map(|value| number(value, name)).transpose()
    }

    /// A whole number of at least `least`, if given.
    pub(super) fn count(&self, name: &str, least: usize) -> Raw<Option<usize>> {
        self.get(name)
            .map(|value| count(value, name, least))
            .transpose()
    }

    /// true or false, if given.
    pub(super) fn truth(&self, name: &str) -> Raw<Option<bool>> {
        let truth = |value: &Dynamic| match value.as_bool() {
            Ok(truth) => Ok(truth),
            Err(kind) => raise(Diagnostic::error(format!(
                "{name} must be true or false, got {kind}"
            ))),
        };
        self.get(name).map(truth).transpose()
    }

    /// A word, if given.
    pub(super) fn word(&self, name: &str) -> Raw<Option<String>> {
        let word = |value: &Dynamic| match value.clone().into_string() {
            Ok(word) => Ok(word),
            Err(kind) => raise(Diagnostic::error(format!(
                "{name} must be a text, got {kind}"
            ))),
        };
        self.get(name).map(word).transpose()
    }
}

/// The known name nearest to `name`, if it is near enough to be a slip of the fingers.
pub(super) fn closest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let near = |candidate: &&str| {
        strsim::damerau_levenshtein(name, candidate) <= 1 + name.chars().count() / 4
    };
    known
        .filter(near)
        .min_by_key(|candidate| strsim::damerau_levenshtein(name, candidate))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_and_floats_are_alike() {
        assert_eq!(number(&Dynamic::from(2_i64), "a").unwrap(), 2.0);
        assert_eq!(number(&Dynamic::from(2.5_f64), "a").unwrap(), 2.5);
        assert_eq!(count(&Dynamic::from(3.0_f64), "a", 1).unwrap(), 3);
        assert!(
            number(&Dynamic::from(f64::NAN), "a").is_err()
                && count(&Dynamic::from(0_i64), "a", 1).is_err()
        );
    }

    #[test]
    fn only_known_options_are_taken() {
        let map = |name: &str| Map::from([(name.into(), Dynamic::from(2_i64))]);
        assert!(Options::new(map("tims"), &["times", "bridge"]).is_err());
        let options = Options::new(map("times"), &["times", "bridge"]).unwrap();
        assert_eq!(options.count("times", 0).unwrap(), Some(2));
        assert_eq!(options.count("bridge", 0).unwrap(), None);
    }

    #[test]
    fn slips_of_the_fingers_are_near() {
        assert_eq!(
            closest("add_lop", ["add_loop", "speed"].into_iter()),
            Some("add_loop")
        );
        assert_eq!(closest("xyz", ["add_loop", "speed"].into_iter()), None);
    }
}
