//! A recipe as text and as a run, without the language it is written in.

pub mod text;
