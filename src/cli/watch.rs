//! `meshloom watch DIR --recipe R -o OUT`: every capture that lands in a folder goes through a recipe.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::{Duration, Instant};

use serde_json::{Value as Json, json};

use super::args::positive;
use super::print;
use super::recipes;
use super::report;
use super::run::setting;
use super::runs::{Runs, object};
use super::session::{Outcome, Session};
use super::watched::Studio;
use crate::diag::{Diagnostic, Result, Severity};
use crate::inbox::{Ending, Entry, Inbox, Job, Listed, Rules, State};
use crate::io::{Depth, Disk, Outbox, Wake, Watch, listing};
use crate::pipeline::{InputSpec, Key};
use crate::recipe::{self, Input, Recipe, Request};
use crate::task::Task;
use crate::world::World;

/// Everything is listed anew this often, whatever was told: events get lost.
const RELIST: Duration = Duration::from_secs(30);
/// After a change more changes follow: they are looked at together.
const GATHER: Duration = Duration::from_millis(50);
/// Listings follow each other no faster, however much changes.
const BREATH: Duration = Duration::from_millis(200);
/// While the studio is open, its end is looked for this often.
const GLANCE: Duration = Duration::from_millis(100);
/// While captures are being processed, their ends are looked for this often.
const LOOK: Duration = Duration::from_millis(20);

/// Run a recipe on every capture that lands in a folder
///
/// A capture is a subfolder, a numbered group of files, or a cache file. It is taken when its files have kept
/// still, or its `.done` file appears, and its results arrive in OUT/CAPTURE in one move.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The folder that captures land in
    #[arg(value_name = "DIR")]
    folder: PathBuf,

    /// A file that ends in .rhai, or the name of a stock recipe
    #[arg(long, value_name = "R")]
    recipe: PathBuf,

    /// Where the results go, a folder for each capture; may lie inside of DIR
    #[arg(long, short, value_name = "OUT")]
    output: PathBuf,

    /// Set a parameter of the recipe
    #[arg(long, value_name = "NAME=VALUE", value_parser = setting)]
    set: Vec<(String, String)>,

    /// Process what is there, then end
    #[arg(long)]
    once: bool,

    /// Show the captures and their states in the terminal, and open them in the studio
    #[arg(long, conflicts_with = "once")]
    studio: bool,

    /// Look for changes every two seconds instead of being told of them
    #[arg(long)]
    poll: bool,

    /// How long the files of a capture must keep still, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = positive, default_value_t = 2.0)]
    settle: f64,

    /// End a run of the recipe that takes longer, in seconds
    #[arg(long, value_name = "S", value_parser = positive)]
    time_limit: Option<f64>,
}

pub(super) fn run(args: &Args, session: &Session) -> Result<Outcome> {
    if args.studio {
        Studio::check(session)?;
    }
    let recipe = recipes::find(session.world(), &args.recipe)?;
    let runs = Runs::new();
    let request = Request {
        settings: args.set.clone(),
        ..Request::default()
    };
    runs.check(&recipe, &request)?;
    let outbox = Outbox::open(&args.output)?;
    let watch = Looked::new(args, session)?;
    let workers = session.threads.count.max(1);
    let rules = Rules {
        settle: Duration::from_secs_f64(args.settle),
        workers,
    };
    let key = recipe_key(&recipe, args);
    let inbox = Inbox::new(rules, key.clone(), journal(&outbox)?);
    let (ended, ends) = mpsc::channel();
    let shop = Shop {
        args,
        runs,
        outbox,
        ended,
    };
    let mut watcher = Watcher {
        session,
        shop: &shop,
        inbox,
        recipe,
        key,
        ends,
        counts: BTreeMap::new(),
        states: BTreeMap::new(),
        studio: None,
    };
    std::thread::scope(|scope| {
        if args.studio {
            let results = shop.outbox.folder();
            watcher.studio = Some(Studio::open(&args.folder, results, session));
        }
        let watched = watcher.run(scope, watch);
        watcher
            .studio
            .take()
            .map_or(Ok(()), |studio| studio.end(&watched))?;
        watched
    })?;
    let counts = watcher.counts;
    let count = |name: &str| counts.get(name).copied().unwrap_or(0);
    Ok(Outcome {
        object: json!({ "event": "end", "done": count("done"), "failed": count("failed") }),
        report: report::table(
            session.style,
            "watched",
            &[
                ("done", count("done").to_string()),
                ("failed", count("failed").to_string()),
            ],
        ),
        ..Outcome::default()
    })
}

/// What workers share.
struct Shop<'a> {
    args: &'a Args,
    runs: Runs,
    outbox: Outbox,
    ended: Sender<(String, Result<Json>)>,
}

/// A watch on the folder that captures land in, on the folder above it (it may vanish and return) and on
/// the recipe's.
struct Looked {
    watch: Watch,
    /// Which folder it was: another one of the same name is not watched.
    node: Option<(u64, u64)>,
}

impl Looked {
    fn new(args: &Args, session: &Session) -> Result<Self> {
        let node = Self::node(args);
        let mut folders = vec![(args.folder.clone(), Depth::Tree)];
        let whole = Disk.resolve(&args.folder)?;
        let above = whole.parent().map(Path::to_path_buf);
        let beside = above.into_iter().chain(recipes::folder(&args.recipe));
        for folder in beside {
            if Disk.resolve(&folder)? != whole && Disk.list(&folder).is_ok() {
                folders.push((folder, Depth::Entries));
            }
        }
        let watched = Watch::new(&folders, args.poll)?;
        for warning in &watched.warnings {
            tell(args, session, warning);
        }
        let watch = watched.output;
        Ok(Looked { watch, node })
    }

    /// Watches the folder that is there now, if it is another one. One that cannot be watched is listed now
    /// and then all the same.
    fn renew(&mut self, args: &Args, session: &Session) {
        let node = Self::node(args);
        if node.is_some()
            && node != self.node
            && let Ok(looked) = Looked::new(args, session)
        {
            *self = looked;
        }
    }

    fn node(args: &Args) -> Option<(u64, u64)> {
        let found = Disk.identity(&args.folder).ok().flatten();
        found.and_then(|folder| folder.node)
    }
}

/// Tells at once what should be known: a watch may never end. The studio has the terminal to itself.
fn tell(args: &Args, session: &Session, warning: &Diagnostic) {
    if args.studio {
        return session.warn(std::slice::from_ref(warning));
    }
    print::people(&session.style.diagnostic(warning));
    session.event(&json!({ "event": "warning", "warning": warning }));
}

/// The loop that lists, starts and writes down.
struct Watcher<'a> {
    session: &'a Session,
    shop: &'a Shop<'a>,
    inbox: Inbox,
    recipe: Recipe,
    key: String,
    ends: Receiver<(String, Result<Json>)>,
    counts: BTreeMap<&'static str, usize>,
    states: BTreeMap<String, State>,
    studio: Option<Studio>,
}

impl<'a> Watcher<'a> {
    fn run<'scope>(
        &mut self,
        scope: &'scope std::thread::Scope<'scope, '_>,
        mut watch: Looked,
    ) -> Result<()>
    where
        'a: 'scope,
    {
        let begun = Instant::now();
        let mut listed = None::<Instant>;
        let mut look = true;
        loop {
            let age = listed.map_or(RELIST, |at| at.elapsed());
            // What seems to have settled is listed once more before it is taken: events get lost.
            let due = look || self.inbox.wakes().is_some_and(|at| at <= begun.elapsed());
            if age >= RELIST || due && age >= BREATH {
                watch.renew(self.shop.args, self.session);
                self.list(begun.elapsed());
                self.reload();
                (listed, look) = (Some(Instant::now()), false);
            }
            // Ends first: what has ended makes room for what waits.
            while let Ok((name, result)) = self.ends.try_recv() {
                self.end(&name, result)?;
            }
            while let Some(job) = self.inbox.next_job() {
                let (shop, recipe, task) =
                    (self.shop, self.recipe.clone(), self.session.task.sibling());
                scope.spawn(move || shop.work(job, &recipe, &task));
            }
            self.tell_states();
            if self.shop.args.once && self.inbox.is_drained() {
                return Ok(());
            }
            let mut wait = self.wait(begun.elapsed(), look);
            if let Some(studio) = &mut self.studio {
                if studio.is_closed() {
                    return Ok(());
                }
                studio.show(&self.inbox);
                wait = wait.min(GLANCE);
            }
            if let Wake::Changed(_) = watch.watch.wait(wait) {
                watch.watch.calm(GATHER, BREATH, &mut Default::default());
                look = true;
            }
        }
    }

    /// How long nothing can happen that the watch would not tell.
    fn wait(&self, now: Duration, look: bool) -> Duration {
        let running = self
            .inbox
            .states()
            .any(|(_, state)| state == State::Running);
        let settles = self
            .inbox
            .wakes()
            .map_or(RELIST, |at| at.saturating_sub(now));
        if !running {
            self.session.progress.rest();
        }
        let longest = if running || look { LOOK } else { RELIST };
        settles.clamp(LOOK.min(longest), longest)
    }

    /// Lists the folder. One that has vanished is waited for: it may return.
    fn list(&mut self, now: Duration) {
        let files = listing(&self.shop.args.folder, self.shop.outbox.folder()).unwrap_or_default();
        let files: Vec<_> = files
            .into_iter()
            .map(|(path, length, modified)| Listed {
                path,
                length,
                modified,
            })
            .collect();
        self.inbox.observe(&files, now);
    }

    /// A changed recipe makes everything due again; one that does not parse is not taken.
    fn reload(&mut self) {
        let request = Request {
            settings: self.shop.args.set.clone(),
            ..Request::default()
        };
        let Ok(recipe) = recipes::find(self.session.world(), &self.shop.args.recipe) else {
            return;
        };
        let key = recipe_key(&recipe, self.shop.args);
        if key != self.key && self.shop.runs.check(&recipe, &request).is_ok() {
            self.inbox.set_recipe(key.clone());
            (self.recipe, self.key) = (recipe, key);
        }
    }

    fn end(&mut self, name: &str, result: Result<Json>) -> Result<()> {
        if let Some(studio) = &mut self.studio {
            studio.note(name, &result);
        }
        let (ending, told) = match result {
            Ok(report) => (
                Ending::Done,
                json!({ "event": "done", "capture": name, "report": report }),
            ),
            Err(error) if error.severity == Severity::Cancelled => {
                self.inbox.abandoned(name);
                return Ok(());
            }
            Err(error) => (
                Ending::Failed,
                json!({ "event": "failed", "capture": name, "error": *error }),
            ),
        };
        if let Some(entry) = self.inbox.ended(name, ending) {
            let line = serde_json::to_string(&entry)
                .map_err(|error| Diagnostic::error(error.to_string()))?;
            // Without its line a capture that is done still has its report; one that failed is tried again.
            if let Err(error) = self.shop.outbox.append(&line) {
                tell(self.shop.args, self.session, &error);
            }
        }
        *self
            .counts
            .entry(if ending == Ending::Done {
                "done"
            } else {
                "failed"
            })
            .or_default() += 1;
        self.session.event(&told);
        Ok(())
    }

    /// Tells people and scripts when a capture begins to settle, queues, or starts.
    fn tell_states(&mut self) {
        for (name, state) in self.inbox.states() {
            if self.states.get(name) == Some(&state) {
                continue;
            }
            self.states.insert(name.to_string(), state);
            if matches!(state, State::Settling | State::Queued | State::Running) {
                self.session
                    .event(&json!({ "event": state, "capture": name }));
            }
        }
        if self.states.len() > self.inbox.states().count() {
            let known: BTreeMap<String, State> = self
                .inbox
                .states()
                .map(|(name, state)| (name.to_string(), state))
                .collect();
            self.states = known;
        }
    }
}

impl Shop<'_> {
    /// Processes one capture and says how it ended.
    fn work(&self, job: Job, recipe: &Recipe, task: &Task) {
        let result = self.process(&job, recipe, task);
        if let Err(error) = &result {
            self.outbox.discard(&job.name);
            if error.severity != Severity::Cancelled {
                // A folder that cannot be written to has failed the job already.
                let _ = self.outbox.complain(&job.name, &format!("{error}\n"));
            }
        }
        // The loop listens as long as there are workers.
        let _ = self.ended.send((job.name, result));
    }

    fn process(&self, job: &Job, recipe: &Recipe, task: &Task) -> Result<Json> {
        let staged = self.outbox.stage(&job.name)?;
        let request = self.request(job, &staged);
        let outcome = self
            .runs
            .run(recipe, &request, self.args.time_limit, task)
            .map_err(|failure| failure.diagnostic)?;
        let written = self.runs.write(&outcome, Some(&staged), &request, task)?;
        self.still_the_same(job)?;
        let relative: Vec<PathBuf> = written
            .iter()
            .map(|path| path.strip_prefix(&staged).unwrap_or(path).to_path_buf())
            .collect();
        let report = json!({
            "capture": job.name,
            "inputs": job.inputs,
            "recipe": job.recipe,
            "program": env!("CARGO_PKG_VERSION"),
            "result": object(&outcome, &relative, &Json::Null),
        });
        self.outbox
            .write(&job.name, "recipe.rhai", recipe.text.as_bytes())?;
        self.outbox
            .write(&job.name, "report.json", format!("{report:#}\n").as_bytes())?;
        task.check()?;
        self.outbox.publish(&job.name)?;
        Ok(report)
    }

    fn request(&self, job: &Job, staged: &Path) -> Request {
        Request {
            input: Some(Input::Files(frames_of(
                &self.args.folder,
                &job.capture.inputs,
            ))),
            settings: self.args.set.clone(),
            output: Some(staged.to_path_buf()),
            ..Request::default()
        }
    }

    /// A capture that changed while it was read may have been read half old, half new.
    fn still_the_same(&self, job: &Job) -> Result<()> {
        for file in &job.capture.files {
            let path = self.args.folder.join(&file.path);
            let now = Disk.identity(&path)?;
            if now.is_none_or(|now| now.length != file.length || now.modified != file.modified) {
                return Diagnostic::error("the file changed while its capture was processed")
                    .in_file(path)
                    .hint("it is processed again once it keeps still")
                    .err();
            }
        }
        Ok(())
    }
}

/// How the frames of a capture are opened, whose inputs lie in the watched folder.
pub(super) fn frames_of(folder: &Path, inputs: &[PathBuf]) -> InputSpec {
    let inputs = inputs.iter().map(|input| folder.join(input));
    let cache = |path: &PathBuf| {
        path.extension()
            .is_some_and(|ending| ending == "pc2" || ending == "mdd")
    };
    let (caches, others): (Vec<PathBuf>, Vec<PathBuf>) = inputs.partition(cache);
    // A point cache comes with the mesh of the same name.
    match caches.as_slice() {
        [] => InputSpec {
            paths: others,
            ..InputSpec::default()
        },
        _ => InputSpec {
            paths: caches,
            mesh: others.into_iter().next(),
            ..InputSpec::default()
        },
    }
}

/// The hash of a recipe with its modules and parameters.
fn recipe_key(recipe: &Recipe, args: &Args) -> String {
    let mut modules = BTreeMap::new();
    let folder = recipe.path.parent().unwrap_or(Path::new(""));
    collect_modules(folder, &recipe.text, &mut modules);
    let key = Key::of("watch")
        .text(&recipe.text)
        .text(&format!("{:?}", args.set))
        .text(&format!("{modules:?}"));
    key.finish().to_string()
}

/// The texts of the modules that a script imports, and of those that these do.
fn collect_modules(folder: &Path, text: &str, modules: &mut BTreeMap<PathBuf, String>) {
    for name in recipe::text::imports(text) {
        let file = folder.join(name).with_extension("rhai");
        let Ok(bytes) = Disk.read(&file) else {
            continue;
        };
        let text = String::from_utf8_lossy(&bytes).into_owned();
        if modules.insert(file, text.clone()).is_none() {
            collect_modules(folder, &text, modules);
        }
    }
}

/// What was done before: the journal, and what published results say of themselves, in case the journal's
/// last line did not make it.
fn journal(outbox: &Outbox) -> Result<Vec<Entry>> {
    let mut entries: Vec<Entry> = outbox
        .journal()?
        .iter()
        .filter_map(|line| serde_json::from_str(line).ok())
        .collect();
    for name in outbox.names() {
        let report = outbox
            .published(&name, "report.json")
            .and_then(|text| serde_json::from_str::<Json>(&text).ok());
        let Some(report) = report else { continue };
        let text = |key: &str| report[key].as_str().map(str::to_string);
        let later = entries.iter().rev().find(|entry| entry.capture == name);
        let Some((inputs, recipe)) = text("inputs").zip(text("recipe")) else {
            continue;
        };
        if later.is_none_or(|entry| entry.ending == Ending::Done && entry.inputs != inputs) {
            entries.push(Entry {
                capture: name,
                inputs,
                recipe,
                ending: Ending::Done,
            });
        }
    }
    Ok(entries)
}
