//! Keys of results: a hash of what they were made from. Equal keys mean equal bytes.

use std::fmt;

/// The hash of an operation, its inputs, its parameters and the version of this program.
#[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Key([u8; 32]);

impl Key {
    /// Begins the key of a result of `operation`.
    pub fn of(operation: &str) -> KeyBuilder {
        Key::by(env!("CARGO_PKG_VERSION"), operation)
    }

    /// The same by another version of this program.
    fn by(version: &str, operation: &str) -> KeyBuilder {
        KeyBuilder(blake3::Hasher::new())
            .text(version)
            .text(operation)
    }
}

/// Sixty-four hexadecimal digits.
impl fmt::Display for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for Key {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// A key in the making. Parts are kept apart: ("a", "bc") and ("ab", "c") differ.
#[derive(Debug, Clone)]
pub struct KeyBuilder(blake3::Hasher);

impl KeyBuilder {
    /// Adds bytes.
    #[must_use]
    pub fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.update(&(bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
        self
    }

    /// Adds text: a name, options as JSON.
    #[must_use]
    pub fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes())
    }

    /// Adds a number; 0 and -0 differ.
    #[must_use]
    pub fn number(self, number: f64) -> Self {
        self.bytes(&number.to_bits().to_le_bytes())
    }

    /// Adds coordinates.
    #[must_use]
    pub fn coordinates(mut self, coordinates: &[f32]) -> Self {
        self.0.update(&(coordinates.len() as u64).to_le_bytes());
        let mut block = Vec::with_capacity(4 * 4096);
        for chunk in coordinates.chunks(4096) {
            block.clear();
            chunk.iter().for_each(|coordinate| {
                block.extend_from_slice(&coordinate.to_bits().to_le_bytes());
            });
            self.0.update(&block);
        }
        self
    }

    /// Adds the key of an input.
    #[must_use]
    pub fn key(self, key: Key) -> Self {
        self.bytes(&key.0)
    }

    /// The key.
    pub fn finish(self) -> Key {
        Key(self.0.finalize().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_kept_apart() {
        assert_ne!(
            Key::of("x").text("a").text("bc").finish(),
            Key::of("x").text("ab").text("c").finish()
        );
        assert_eq!(
            Key::of("x").number(1.0).finish(),
            Key::of("x").number(1.0).finish()
        );
    }

    #[test]
    fn another_version_remembers_nothing_of_this_one() {
        let own = env!("CARGO_PKG_VERSION");
        assert_eq!(Key::by(own, "fit").finish(), Key::of("fit").finish());
        assert_ne!(Key::by("0.0.0", "fit").finish(), Key::of("fit").finish());
    }

    #[test]
    fn one_bit_of_a_coordinate_changes_the_key() {
        let coordinates = vec![0.5_f32; 5000];
        let mut other = coordinates.clone();
        other[4999] = f32::from_bits(0.5_f32.to_bits() + 1);
        assert_ne!(
            Key::of("x").coordinates(&coordinates).finish(),
            Key::of("x").coordinates(&other).finish()
        );
    }
}
