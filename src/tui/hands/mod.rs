//! The hands of the studio: everything that edits. A gesture becomes a line of the recipe
//! ([`crate::recipe::gesture`]), the recipe is run, and what it gives is shown.
//!
//! **Invariants:** the recipe's text is the only thing that is edited, and undo goes through its earlier
//! texts; what is in hand is shown by a preview of the last good result and forgotten when it is let go;
//! answers to runs and previews that are no longer asked for are dropped.

mod act;
mod desk;
mod held;
mod history;
mod keys;
mod pointer;
mod replies;
mod runner;
mod sliders;
mod trial;

pub use desk::{Desk, Kept};

pub(super) use act::{act, key};
pub(super) use held::Held;
pub(super) use pointer::mouse;
pub(super) use replies::{leave, reply};
pub(super) use runner::{Ran, Run, Workers};
pub(super) use sliders::{VALUE, share, slider};
pub(super) use trial::Try;

use std::path::PathBuf;

#[cfg(test)]
mod key_tests;
#[cfg(test)]
mod tests;

use super::state::Content;
use crate::diag::Diagnostic;
use crate::recipe::{Param, Recipe};
use history::History;
use trial::Pinning;

/// What the hands ask for.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Errand {
    /// The recipe is run; a run under way is ended.
    Run(Run),
    /// What is in hand is shown.
    Try(Try),
    /// The recipe is opened in the user's editor.
    Edit,
    /// Text that is not in the recipe's file is kept for the next time; none: nothing is kept any more.
    Keep(Option<String>),
}

/// What comes back.
#[derive(Debug)]
pub(super) enum Reply {
    /// The recipe as it was found, whether it has a file, and what an earlier session could not save.
    Found(Recipe, bool, Option<String>),
    /// All has been opened: the recipe can be run.
    Ready,
    /// A run has ended; it is told by its number.
    Ran(u64, Result<Box<Ran>, Box<Diagnostic>>),
    /// The recipe was written to this file.
    Written(PathBuf),
    /// The recipe could not be written.
    NotWritten(Box<Diagnostic>),
    /// The recipe's file holds something else than was known: nothing was written.
    Overtaken(String),
    /// Someone has changed the recipe's file, or (none) a file that it reads.
    Changed(Option<String>),
    /// What is in hand, by the number of the preview.
    Tried(u64, Result<Content, Box<Diagnostic>>),
    /// The editor of this file has ended.
    Edited(Result<PathBuf, Box<Diagnostic>>),
}

/// Everything about the recipe and what is done to it.
#[derive(Debug, Default)]
pub(super) struct Hands {
    /// What the panel shows.
    pub(super) page: Page,
    /// What is in hand.
    pub(super) held: Option<Held>,
    /// The key pose that is chosen, from 0.
    pub(super) key: Option<usize>,
    /// Earlier and later texts.
    history: History,
    /// What the last run that succeeded gave.
    pub(super) good: Option<Content>,
    /// What pins change; none where the loom's frames are not known.
    pub(super) pinning: Option<Pinning>,
    /// Parameters set without being written.
    settings: Vec<(String, String)>,
    /// Numbers of the last run and of the last preview.
    runs: u64,
    tries: u64,
    /// Number of the first preview of what is in hand, and of the last that was shown.
    first_try: u64,
    shown_try: u64,
    /// Whether everything has been opened.
    ready: bool,
    /// Whether the view of the map is held while something is in hand.
    frozen: bool,
    /// The stretch of the last gesture over all of time, and the text that it left.
    whole: Option<(String, [f64; 2])>,
}

/// The recipe as it is shown.
#[derive(Debug, Default)]
pub(super) struct Page {
    /// Its text and its file.
    pub(super) recipe: Option<Recipe>,
    /// Whether the file holds this text.
    pub(super) saved: bool,
    /// Whether it has no file yet.
    pub(super) lacks_file: bool,
    /// Whether it is being run.
    pub(super) running: bool,
    /// The line (from 1) that changed last.
    pub(super) touched: Option<usize>,
    /// What is wrong with it.
    pub(super) error: Option<Box<Diagnostic>>,
    /// Its parameters.
    pub(super) params: Vec<Param>,
    /// What it gives, and what it says, in words.
    pub(super) told: Vec<String>,
    /// The chosen slider.
    pub(super) chosen: usize,
    /// Lines that the user has scrolled; none: the line that matters is shown.
    pub(super) scroll: Option<usize>,
    /// Text of an earlier session, offered.
    pub(super) offered: Option<String>,
}

impl Page {
    /// The recipe's text.
    pub(super) fn text(&self) -> &str {
        self.recipe.as_ref().map_or("", |recipe| &recipe.text)
    }
}
