//! Runs of recipes, as `run`, `watch` and `demo` need them: with remembered results, a time limit, and
//! their values written to files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

use serde_json::{Value as Json, json};

use crate::diag::{Diagnostic, Result, Severity};
use crate::io::{Cache, Disk};
use crate::pipeline::{Memory, Output, Value, Workbench, deliver, plan_delivery};
use crate::recipe::{Failure, Input, Outcome, Param, Recipe, Request, Runner};
use crate::script::Scripts;
use crate::task::Task;
use crate::world::Store;

/// Results held in memory, in bytes.
const MEMORY: usize = 2 << 30;
/// Results kept in the user's cache folder, in bytes.
const CACHE: u64 = 2 << 30;

/// Whoever runs recipes over this machine's files.
pub(super) struct Runs {
    scripts: Scripts,
    memory: Arc<Memory>,
}

/// What a run would do to files.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub(super) struct RunPlan {
    /// Files read.
    pub(super) reads: Vec<PathBuf>,
    /// Expensive steps, computed or remembered.
    pub(super) steps: Vec<crate::pipeline::Step>,
    /// Files written or replaced.
    pub(super) writes: Vec<PathBuf>,
    /// Files removed.
    pub(super) removals: Vec<PathBuf>,
}

impl Runs {
    /// With results remembered in memory and in the user's cache folder, if there is one.
    pub(super) fn new() -> Self {
        let store =
            cache_folder().map(|folder| Arc::new(Cache::new(folder, CACHE)) as Arc<dyn Store>);
        let memory = Arc::new(Memory::new(MEMORY, store));
        Runs {
            scripts: Scripts::new(Arc::new(Disk), Arc::clone(&memory)),
            memory,
        }
    }

    /// The same memory for work that is no recipe: what is opened there is open for recipes.
    pub(super) fn bench(&self, task: &Task) -> Workbench {
        Workbench::new(Arc::new(Disk), Arc::clone(&self.memory), task.clone())
    }

    /// Parses and resolves without running.
    pub(super) fn check(&self, recipe: &Recipe, request: &Request) -> Result<Vec<Param>> {
        self.scripts.check(recipe, request)
    }

    /// Runs a recipe; nothing is written. A run over its time limit in seconds fails.
    pub(super) fn run(
        &self,
        recipe: &Recipe,
        request: &Request,
        limit: Option<f64>,
        task: &Task,
    ) -> Result<Outcome, Failure> {
        let Some(limit) = limit else {
            return self.scripts.run(recipe, request, task);
        };
        let late = Arc::new(AtomicBool::new(false));
        let (done, ended) = mpsc::channel::<()>();
        let clock = {
            let (late, task) = (Arc::clone(&late), task.clone());
            std::thread::spawn(move || {
                if ended.recv_timeout(Duration::from_secs_f64(limit))
                    == Err(RecvTimeoutError::Timeout)
                {
                    late.store(true, Ordering::Relaxed);
                    task.cancel();
                }
            })
        };
        let outcome = self.scripts.run(recipe, request, task);
        drop(done);
        // The clock ends at once when `done` is gone; it has no result to lose.
        let _ = clock.join();
        outcome.map_err(|mut failure| {
            if late.load(Ordering::Relaxed) && failure.diagnostic.severity == Severity::Cancelled {
                // where it was then
                let Diagnostic { place, excerpt, .. } = *failure.diagnostic;
                let error = Diagnostic::error(format!("the recipe took longer than {limit} s"));
                failure.diagnostic = Box::new(Diagnostic {
                    place,
                    excerpt,
                    ..error.hint("`--time-limit` sets the limit")
                });
            }
            failure
        })
    }

    /// Writes what the recipe saves and, to `output`, its last value. Gives the files in order.
    pub(super) fn write(
        &self,
        outcome: &Outcome,
        output: Option<&Path>,
        request: &Request,
        task: &Task,
    ) -> Result<Vec<PathBuf>> {
        let mut written = Vec::new();
        for (value, output) in targets(outcome, output, request) {
            written.extend(deliver(&Disk, value, &output, task)?.outputs);
        }
        Ok(written)
    }

    /// What [`Runs::write`] would do.
    pub(super) fn plan(
        &self,
        outcome: &Outcome,
        output: Option<&Path>,
        request: &Request,
    ) -> Result<RunPlan> {
        let mut plan = RunPlan {
            reads: outcome.reads.clone(),
            steps: outcome.steps.clone(),
            writes: Vec::new(),
            removals: Vec::new(),
        };
        for (value, output) in targets(outcome, output, request) {
            let (writes, removals) = plan_delivery(&Disk, value, &output)?;
            plan.writes.extend(writes);
            plan.removals.extend(removals);
        }
        Ok(plan)
    }
}

/// The values to be written and where. A last value that has no frames is told, not written.
fn targets<'a>(
    outcome: &'a Outcome,
    output: Option<&Path>,
    request: &Request,
) -> Vec<(&'a Value, Output)> {
    let inputs: &[PathBuf] = match &request.input {
        Some(Input::Files(spec)) => &spec.paths,
        _ => &[],
    };
    let saves = outcome
        .saves
        .iter()
        .map(|save| (&save.value, Output::from(&save.path).protecting(inputs)));
    let shown = !matches!(
        outcome.value,
        Value::Nothing | Value::Statistics(_) | Value::Text(_)
    );
    let last = output
        .filter(|_| shown)
        .map(|output| (&outcome.value, Output::from(output).protecting(inputs)));
    saves.chain(last).collect()
}

/// A run as the command line's JSON.
pub(super) fn object(outcome: &Outcome, outputs: &[PathBuf], seconds: &Json) -> Json {
    let (frames, report) = match &outcome.value {
        Value::Loom(loom) => (json!(loom.frames()), loom.report()),
        Value::Sequence(frames) => (json!(frames.frames()), Json::Null),
        Value::Shape(_) => (json!(1), Json::Null),
        Value::Statistics(found) => (Json::Null, json!(found.value.to_string())),
        Value::Text(text) => (Json::Null, json!(text)),
        Value::Nothing | Value::Picture(_) => (Json::Null, Json::Null),
    };
    json!({
        "outputs": super::report::paths(outputs),
        "frames": frames,
        "report": report,
        "params": outcome.params,
        "steps": outcome.steps,
        "messages": outcome.messages,
        "seconds": seconds,
        "warnings": [],
    })
}

/// Where results outlive the process: `MESHLOOM_CACHE`, or `meshloom` in the user's cache folder.
pub(super) fn cache_folder() -> Option<PathBuf> {
    let set = |name| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    let in_home = || set("HOME").map(|home| home.join(".cache"));
    set("MESHLOOM_CACHE").or_else(|| {
        set("XDG_CACHE_HOME")
            .or_else(in_home)
            .map(|cache| cache.join("meshloom"))
    })
}
