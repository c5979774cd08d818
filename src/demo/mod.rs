//! Built-in captures, generated: the same bytes on every run.
