//! A recipe as text and as a run, without the language it is written in.

mod param;
pub mod text;

pub use param::{Param, Setting};
