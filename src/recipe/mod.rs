//! A recipe as text and as a run, without the language it is written in.

pub mod gesture;
mod options;
mod param;
mod result;
mod run;
pub mod text;

pub use gesture::Gesture;
pub use param::{Param, Setting};
pub use result::{KeyNumber, Make};
pub use run::{Failure, Input, Outcome, Recipe, Request, Runner, Save};
