//! Where the recipe lies: its file, its runs, its editor. The studio knows no files; whoever opens it
//! brings a desk.

use std::path::PathBuf;

use crate::diag::Result;
use crate::mesh::Sequence;
use crate::recipe::{Failure, Outcome, Recipe};
use crate::task::Task;

/// What became of a text that was to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Kept {
    /// It is in this file now.
    At(PathBuf),
    /// Somebody has changed the file since it was read or written here: it holds this, and was left so.
    Overtaken(String),
}

/// The recipe and what can be done with it. Called on worker threads; each call may take its time.
pub trait Desk: Send + Sync {
    /// The recipe, and whether it has a file: without one it would be written to the path it names, or
    /// near that.
    ///
    /// # Errors
    /// It cannot be read.
    fn recipe(&self) -> Result<(Recipe, bool)>;

    /// The recipe that suits these frames better than the one that was begun with before they were known;
    /// none where there is none, or where the recipe is somebody's own.
    fn suited(&self, _frames: &Sequence) -> Option<Recipe> {
        None
    }

    /// Writes `text` to the recipe's file, which it gets if it has none; never over what somebody else has
    /// written meanwhile.
    ///
    /// # Errors
    /// The file cannot be written.
    fn write(&self, text: &str) -> Result<Kept>;

    /// Runs the recipe with these parameters. Nothing is written.
    ///
    /// # Errors
    /// As [`crate::recipe::Runner::run`].
    fn run(
        &self,
        recipe: &Recipe,
        settings: &[(String, String)],
        task: &Task,
    ) -> Result<Outcome, Failure>;

    /// Waits until somebody else changes the recipe's file (its new text) or a file that the last run read
    /// (none), and the files have come to rest; none at all once the task is cancelled.
    ///
    /// # Errors
    /// Files cannot be watched, or the recipe cannot be read.
    fn change(&self, task: &Task) -> Result<Option<Option<String>>>;

    /// Opens the recipe's file, which it gets if it has none, in the user's editor, waits for its end, and
    /// says which file it is. The terminal is free meanwhile.
    ///
    /// # Errors
    /// The file cannot be written; there is no editor, or it fails.
    fn edit(&self) -> Result<PathBuf>;

    /// What [`Desk::keep`] kept in an earlier session, unless the recipe's file holds it meanwhile.
    fn kept(&self) -> Option<String>;

    /// Keeps a text for the next session; `None` forgets it.
    ///
    /// # Errors
    /// It cannot be written.
    fn keep(&self, text: Option<&str>) -> Result<()>;
}
