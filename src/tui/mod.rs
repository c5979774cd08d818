//! The studio: a capture as a curve on a map, its signals over time, and the mesh, in a terminal.
//!
//! ```text
//! keys, mouse, size, ticks, answers --Event--> update(State) --Command--> workers, files, the terminal
//!                                                  |
//!                                          panels draw State
//! ```
//!
//! The hands ([`Desk`]) edit: a gesture is a line of the recipe, and what the recipe gives is shown.
//!
//! **Invariants:** `update` decides and draws nothing; panels draw and change nothing; work longer
//! than a frame runs on worker threads, and answers to questions that are no longer asked are dropped.

mod errors;
mod event;
mod graphics;
mod hands;
mod keys;
mod landings;
mod layout;
mod panels;
mod posed;
mod screen;
mod stage;
mod state;
mod studio;
mod terminal;
mod theme;
mod thumbs;
mod typed;
mod update;
mod wire;
mod work;

pub use graphics::{Answers, Choice, Protocol, choose, query, read_answers};
pub use hands::{Desk, Kept};
pub use landings::{Landing, News, Part, Shown, watch};
pub use studio::{Files, Opened, Options, run};
pub use terminal::{ask, restore};
