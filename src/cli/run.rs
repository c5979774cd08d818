//! `meshloom run RECIPE [INPUT..]`: runs a recipe, once or whenever it or what it reads changes.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, TryRecvError};
use std::time::{Duration, SystemTime};

use serde_json::{Value as Json, json};

use super::args::{Part, positive};
use super::print;
use super::reading::{Reading, entries, saved};
use super::recipes;
use super::report;
use super::runs::{Runs, object};
use super::session::{Outcome, Session};
use crate::diag::{Result, Severity};
use crate::io::{Disk, Wake};
use crate::pipeline::Listing;
use crate::recipe::{self, Input, Param, Request};
use crate::task::Task;

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

    /// End a run whose values take more memory, in GiB (8)
    #[arg(long, value_name = "GIB", value_parser = positive)]
    memory_limit: Option<f64>,

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
            memory: self
                .memory_limit
                .map(|gib| (gib * (1_u64 << 30) as f64) as usize),
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
    let mut reading = Reading::of(&[path.to_path_buf()]);
    loop {
        let mut folders = reading.folders();
        let mut watch = session.keep(entries(&folders)?);
        let task = session.task.sibling();
        reading = reading.again();
        let begun = SystemTime::now();
        let mut run = job.start(&task);
        while !run.is_over() {
            if matches!(watch.wait(LOOK), Wake::Changed(_)) && reading.changed(None) {
                task.cancel();
                run.wait(DROPPED);
                break;
            }
        }
        session.progress.rest();
        let interrupted = task.cancelled();
        if let Some(run) = run.answer {
            show(session, path, &run);
            reading = reading.after(&run.reads, &run.listings, begun);
        }
        // What was saved before it was watched has to be asked for.
        let mut look = true;
        while !(interrupted || look && reading.changed(None)) {
            let now = reading.folders();
            look = now != folders;
            if look {
                watch = session.keep(entries(&now)?);
                folders = now;
            } else {
                look = matches!(watch.wait(WAIT), Wake::Changed(_));
            }
        }
        saved(&watch);
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
    listings: Vec<Listing>,
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
                    listings: Vec::new(),
                    outcome: Err(error),
                };
            }
        };
        let request = &self.request;
        match self.runs.run(&recipe, request, self.time_limit, task) {
            Err(failure) => Live {
                reads: failure.reads,
                listings: failure.listings,
                outcome: Err(failure.diagnostic),
            },
            Ok(outcome) => {
                let output = self.output.as_deref();
                let written = self.runs.write(&outcome, output, request, task);
                Live {
                    reads: outcome.reads.clone(),
                    listings: outcome.listings.clone(),
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
