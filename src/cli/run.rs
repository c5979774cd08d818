//! `meshloom run RECIPE [INPUT..]`: runs a recipe, once or whenever it or what it reads changes.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use serde_json::{Value as Json, json};

use super::args::{Part, positive};
use super::print;
use super::recipes;
use super::report;
use super::runs::{Runs, object};
use super::session::{Outcome, Session};
use crate::diag::{Result, Severity};
use crate::io::{Depth, Disk, Wake, Watch};
use crate::recipe::{self, Input, Param, Request};
use crate::task::Task;
use crate::world::World;

/// A save is taken for finished when nothing has changed for this long: editors that truncate and write,
/// or save twice in a row, are one save.
const QUIET: Duration = Duration::from_millis(30);
/// A file that keeps changing is read all the same after this long.
const PATIENCE: Duration = Duration::from_millis(500);
/// How soon a live run notices that it has ended.
const LOOK: Duration = Duration::from_millis(5);
/// A run that was cancelled and does not end for so long is no longer waited for.
const DROPPED: Duration = Duration::from_millis(60);
/// How long a live run waits for a change at a time.
const WAIT: Duration = Duration::from_secs(1);

/// Run a recipe (Rhai) on a capture
///
/// RECIPE is a file, or the name of a stock recipe: `meshloom run --list` shows them. The last value of the
/// recipe is saved to -o, like whatever it saves itself; nothing is written unless the whole recipe runs.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// A file that ends in .rhai, or the name of a stock recipe
    #[arg(value_name = "RECIPE", required_unless_present = "list")]
    recipe: Option<PathBuf>,

    /// What `input()` gives: a capture
    #[arg(value_name = "INPUT")]
    inputs: Vec<PathBuf>,

    #[command(flatten)]
    part: Part,

    /// Frames per second of the capture, where its files do not say
    #[arg(long, value_name = "F", value_parser = positive)]
    fps: Option<f64>,

    /// Where the result goes: a file, a pattern (frame_####.obj), or a folder; `save` writes below it
    #[arg(long, short, value_name = "OUT")]
    output: Option<PathBuf>,

    /// Set a parameter of the recipe
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,

    /// Say what would be read, computed, written and removed; write nothing
    #[arg(long)]
    plan: bool,

    /// Parse the recipe, resolve its functions and parameters, run nothing
    #[arg(long, conflicts_with_all = ["plan", "live"])]
    check: bool,

    /// Run again whenever the recipe, its modules or a file that it read changes
    #[arg(long)]
    live: bool,

    /// Let the recipe read below this folder too
    #[arg(long, value_name = "DIR")]
    allow_read: Vec<PathBuf>,

    /// End a run that takes longer, in seconds
    #[arg(long, value_name = "S", value_parser = positive)]
    time_limit: Option<f64>,

    /// List the stock recipes
    #[arg(long)]
    list: bool,
}

pub(super) fn setting(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or("NAME=VALUE is wanted")?;
    Ok((name.trim().to_string(), value.trim().to_string()))
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    let Some(path) = args.recipe.as_deref().filter(|_| !args.list) else {
        return Ok(listed(session));
    };
    let runs = Runs::new();
    let request = args.request();
    let recipe = recipes::find(session.world(), path)?;
    if args.check {
        return Ok(checked(session, &runs.check(&recipe, &request)?));
    }
    if args.live {
        return live(args, path, runs, session);
    }
    let outcome = runs
        .run(&recipe, &request, args.time_limit, &session.task)
        .map_err(|failure| failure.diagnostic)?;
    session.warn(&outcome.warnings);
    if args.plan {
        let plan = runs.plan(&outcome, args.output.as_deref(), &request)?;
        return Ok(Outcome {
            report: planned(session, &plan),
            object: json!(plan),
            ..Outcome::default()
        });
    }
    let written = runs.write(&outcome, args.output.as_deref(), &request, &session.task)?;
    let object = object(&outcome, &written, &session.progress.seconds(&PHASES));
    let title = recipe.path.display().to_string();
    Ok(Outcome {
        report: told(session, &title, &outcome, &written),
        object,
        ..Outcome::default()
    })
}

/// The phases whose times are reported.
const PHASES: [&str; 7] = ["load", "encode", "shape", "layout", "pose", "time", "write"];

impl Args {
    fn request(&self) -> Request {
        let spec = self.part.of(&self.inputs, self.fps);
        Request {
            input: (!self.inputs.is_empty()).then_some(Input::Files(spec)),
            settings: self.set.clone(),
            readable: self.allow_read.clone(),
            output: self.output.clone(),
        }
    }
}

/// The stock recipes and what each does.
fn listed(session: &Session) -> Outcome {
    let rows: Vec<_> = recipes::STOCK
        .iter()
        .map(|(name, text)| (*name, recipes::about(text).to_string()))
        .collect();
    let object = rows
        .iter()
        .map(|(name, about)| json!({ "name": name, "about": about }))
        .collect();
    Outcome {
        object,
        report: report::table(session.style, "stock recipes", &rows),
        ..Outcome::default()
    }
}

fn checked(session: &Session, params: &[Param]) -> Outcome {
    let row = |param: &Param| {
        let range = param
            .range
            .map(|(least, greatest)| format!(", {least} to {greatest}"))
            .unwrap_or_default();
        (param.name.clone(), format!("{}{range}", param.value))
    };
    let rows: Vec<_> = params.iter().map(row).collect();
    let rows: Vec<_> = rows
        .iter()
        .map(|(name, value)| (name.as_str(), value.clone()))
        .collect();
    Outcome {
        object: json!({ "params": params }),
        report: report::table(session.style, "parameters", &rows),
        ..Outcome::default()
    }
}

/// What would be done, for people.
fn planned(session: &Session, plan: &super::runs::RunPlan) -> String {
    let mut rows = vec![("reads", report::files(&plan.reads))];
    rows.extend(
        plan.steps
            .iter()
            .map(|step| (step.name, format!("{} ({})", step.detail, step.made))),
    );
    rows.push(("writes", report::files(&plan.writes)));
    rows.push(("removes", report::files(&plan.removals)));
    report::table(session.style, "plan", &rows)
}

/// What a run has done, for people.
fn told(session: &Session, title: &str, outcome: &recipe::Outcome, written: &[PathBuf]) -> String {
    let mut text: String = outcome
        .messages
        .iter()
        .map(|message| format!("{message}\n"))
        .collect();
    let mut rows = vec![("result", outcome.value.to_string())];
    rows.push(match written {
        [] => ("written", "nothing: `-o OUT` says where".to_string()),
        [one] => ("written", one.display().to_string()),
        [first, .., last] => (
            "written",
            format!("{} .. {}", first.display(), last.display()),
        ),
    });
    text.push_str(&report::table(session.style, title, &rows));
    text
}

/// The single run, repeated: what is watched is what the last run read. A later save cancels the run in
/// flight, whose answer is dropped if it does not end soon; an error is told and waited out. Ends when the
/// process is told to.
fn live(args: &Args, path: &Path, runs: Runs, session: &Session) -> Result<Outcome> {
    let job = Arc::new(Job {
        path: path.to_path_buf(),
        request: args.request(),
        output: args.output.clone(),
        time_limit: args.time_limit,
        runs,
    });
    let mut reads = vec![path.to_path_buf()];
    loop {
        let mut watch = session.keep(Watch::new(&folders(&reads), false)?);
        let task = session.task.sibling();
        let begun = SystemTime::now();
        let mut run = job.start(&task);
        let interrupted = changed(&watch, &reads, LOOK, || run.is_over());
        if interrupted {
            task.cancel();
            run.wait(DROPPED);
        }
        session.progress.rest();
        let mut quiet = !interrupted;
        if let Some(run) = run.answer {
            show(session, path, &run);
            if run.reads != reads {
                watch = session.keep(Watch::new(&folders(&run.reads), false)?);
            }
            reads = run.reads;
            // What was saved before it was watched has to be asked for.
            quiet &= !saved_since(&reads, begun);
        }
        if quiet {
            changed(&watch, &reads, WAIT, || false);
        }
        watch.calm(QUIET, PATIENCE, &mut BTreeSet::new());
    }
}

/// What a live run does again and again.
struct Job {
    path: PathBuf,
    request: Request,
    output: Option<PathBuf>,
    time_limit: Option<f64>,
    runs: Runs,
}

/// A run in a thread of its own. It has no answer if it was dropped, or panicked: the panic has printed
/// itself, and the next save runs again.
struct Started {
    ended: Receiver<Live>,
    answer: Option<Live>,
}

impl Started {
    /// Whether an answer is there, or none will come.
    fn is_over(&mut self) -> bool {
        if self.answer.is_none() {
            match self.ended.try_recv() {
                Ok(answer) => self.answer = Some(answer),
                Err(TryRecvError::Empty) => return false,
                Err(TryRecvError::Disconnected) => {}
            }
        }
        true
    }

    /// Waits for the answer, not longer than `time`.
    fn wait(&mut self, time: Duration) {
        if self.answer.is_none() {
            self.answer = self.ended.recv_timeout(time).ok();
        }
    }
}

/// One run of a live session.
struct Live {
    reads: Vec<PathBuf>,
    outcome: Result<(recipe::Outcome, Vec<PathBuf>)>,
}

impl Job {
    fn start(self: &Arc<Self>, task: &Task) -> Started {
        let (answer, ended) = mpsc::channel();
        let (job, task) = (Arc::clone(self), task.clone());
        std::thread::spawn(move || {
            // Nobody waits for the answer of a run that was dropped.
            let _ = answer.send(job.once(&task));
        });
        Started {
            ended,
            answer: None,
        }
    }

    fn once(&self, task: &Task) -> Live {
        let recipe = match recipes::find(&Disk, &self.path) {
            Ok(recipe) => recipe,
            Err(error) => {
                return Live {
                    reads: vec![self.path.clone()],
                    outcome: Err(error),
                };
            }
        };
        let request = &self.request;
        match self.runs.run(&recipe, request, self.time_limit, task) {
            Err(failure) => Live {
                reads: failure.reads,
                outcome: Err(failure.diagnostic),
            },
            Ok(outcome) => {
                let output = self.output.as_deref();
                let written = self.runs.write(&outcome, output, request, task);
                Live {
                    reads: outcome.reads.clone(),
                    outcome: written.map(|written| (outcome, written)),
                }
            }
        }
    }
}

fn show(session: &Session, path: &Path, run: &Live) {
    match &run.outcome {
        Ok((outcome, written)) => {
            for warning in &outcome.warnings {
                print::people(&session.style.diagnostic(warning));
            }
            print::people(told(session, &path.display().to_string(), outcome, written).trim_end());
            session.event(&object(outcome, written, &Json::Null));
        }
        Err(error) if error.severity == Severity::Cancelled => {}
        Err(error) => {
            print::people(&session.style.diagnostic(error));
            session.event(&print::failure(error, &[]));
        }
    }
}

/// Waits until one of `files` changes; gives up, with false, once `ended` says so.
fn changed(
    watch: &Watch,
    files: &[PathBuf],
    look: Duration,
    mut ended: impl FnMut() -> bool,
) -> bool {
    let files: BTreeSet<PathBuf> = files.iter().map(|file| plain(file)).collect();
    loop {
        match watch.wait(look) {
            // Events were lost: anything may have changed.
            Wake::Changed(paths) if paths.is_empty() => return true,
            Wake::Changed(paths) if paths.iter().any(|path| files.contains(&plain(path))) => {
                return true;
            }
            Wake::Changed(_) => {}
            Wake::Quiet if ended() => return false,
            Wake::Quiet => {}
        }
    }
}

/// Whether one of `files` was written between `begun` and now.
fn saved_since(files: &[PathBuf], begun: SystemTime) -> bool {
    let since_1970 = |time: SystemTime| time.duration_since(UNIX_EPOCH).unwrap_or_default();
    let run = since_1970(begun)..=since_1970(SystemTime::now());
    files.iter().any(|file| {
        let found = Disk.identity(file).ok().flatten();
        let modified = found.and_then(|found| found.modified);
        modified.is_some_and(|modified| run.contains(&modified))
    })
}

/// The folders that hold `files`; folders among them are watched themselves.
fn folders(files: &[PathBuf]) -> Vec<(PathBuf, Depth)> {
    let above = |file: &PathBuf| match file.parent() {
        Some(parent) if parent != Path::new("") => parent.to_path_buf(),
        _ => PathBuf::from("."),
    };
    let folders: BTreeSet<PathBuf> = files.iter().map(above).collect();
    folders
        .into_iter()
        .map(|folder| (folder, Depth::Entries))
        .collect()
}

/// The one name of a path: a watch gives absolute paths, a recipe those it was given.
fn plain(path: &Path) -> PathBuf {
    std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf())
}
