//! One run of a recipe: what goes in, what comes out. Whoever knows the language implements [`Runner`].

use std::path::PathBuf;

use super::Param;
use crate::diag::{Diagnostic, Result};
use crate::pipeline::{Completion, InputSpec, Listing, LoomValue, Step, Value};
use crate::task::Task;

/// The text of a recipe and where it came from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Recipe {
    /// Its file; modules are looked for in the same folder.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
}

/// What `input()` gives.
#[derive(Debug, Clone)]
pub enum Input {
    /// Files named on the command line.
    Files(InputSpec),
    /// A built-in capture.
    Demo(String),
}

/// What a run is given besides the recipe.
#[derive(Debug, Clone, Default)]
pub struct Request {
    /// What `input()` gives, if anything was named.
    pub input: Option<Input>,
    /// `--set name=value`, in order.
    pub settings: Vec<(String, String)>,
    /// Folders that may be read besides the inputs' and the recipe's own.
    pub readable: Vec<PathBuf>,
    /// Where `save` may write: below this folder.
    pub output: Option<PathBuf>,
    /// How many bytes the values of the run may take, the language's and native ones together.
    pub memory: Option<usize>,
}

/// A value that the recipe wants written, and where. Nothing is written before the whole recipe has run.
#[derive(Debug, Clone)]
pub struct Save {
    /// What.
    pub value: Value,
    /// Where, resolved and checked.
    pub path: PathBuf,
}

/// What a run gave.
#[derive(Debug, Clone, Default)]
pub struct Outcome {
    /// The last value of the script.
    pub value: Value,
    /// The loom that the value's frames were sampled from, where they were.
    pub sampled: Option<LoomValue>,
    /// The key poses that the value's frames were completed from, and how, where they were.
    pub completed: Option<Completion>,
    /// What the value's poses, or the keys that it was completed from, are called; empty where they have no
    /// names.
    pub names: Vec<String>,
    /// The declared parameters with their values.
    pub params: Vec<Param>,
    /// What is to be written.
    pub saves: Vec<Save>,
    /// Every file that was read, the recipe and its modules among them: what a live run watches.
    pub reads: Vec<PathBuf>,
    /// What inputs were found to stand for: it may be more later.
    pub listings: Vec<Listing>,
    /// The expensive steps.
    pub steps: Vec<Step>,
    /// What the recipe printed.
    pub messages: Vec<String>,
    /// What should be known about the result.
    pub warnings: Vec<Diagnostic>,
}

/// Whoever can run a recipe.
pub trait Runner: Send + Sync {
    /// Runs the recipe; nothing is written.
    ///
    /// # Errors
    /// Whatever is wrong with the recipe or fails in it, at its place, with the files read so far in
    /// [`Failure::reads`] so that a live run can wait for a better one.
    fn run(&self, recipe: &Recipe, request: &Request, task: &Task) -> Result<Outcome, Failure>;

    /// Parses the recipe and resolves its functions and parameters; runs nothing.
    ///
    /// # Errors
    /// The first thing that is wrong.
    fn check(&self, recipe: &Recipe, request: &Request) -> Result<Vec<Param>>;
}

/// A run that failed.
#[derive(Debug, Clone)]
pub struct Failure {
    /// Why.
    pub diagnostic: Box<Diagnostic>,
    /// What was read before.
    pub reads: Vec<PathBuf>,
    /// What inputs were found to stand for before.
    pub listings: Vec<Listing>,
}
