//! The `meshloom` command: see [`meshloom`] for the library.

fn main() {}
