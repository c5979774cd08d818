//! What script functions reach: the session that does the work, the paths that a recipe may touch, the
//! parameters it declares, and the log of the run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rhai::{Dynamic, NativeCallContext};

use super::arguments::Raw;
use super::diagnostics::{at, raise};
use super::functions;
use crate::diag::{Diagnostic, Result};
use crate::pipeline::{InputSpec, Memory, Step, Value, Workbench};
use crate::recipe::{Input, Outcome, Param, Recipe, Request, Save, Setting, text};
use crate::task::Task;
use crate::world::{World, folder_of};

/// All that one run has; shared by the engine, the functions and the module resolver.
pub(super) struct Context {
    bench: Workbench,
    folder: PathBuf,
    request: Request,
    /// Folders that may be read, resolved.
    readable: Vec<PathBuf>,
    log: Mutex<Log>,
}

#[derive(Default)]
struct Log {
    scripts: BTreeMap<PathBuf, String>,
    params: Vec<Param>,
    saves: Vec<Save>,
    messages: Vec<String>,
    warnings: Vec<Diagnostic>,
}

impl Context {
    /// The context of one run of `recipe`.
    pub(super) fn new(
        world: Arc<dyn World>,
        memory: Arc<Memory>,
        recipe: &Recipe,
        request: &Request,
        task: &Task,
    ) -> Result<Self> {
        let folder = folder_of(&recipe.path).to_path_buf();
        let mut readable = vec![folder.clone()];
        readable.extend(request.readable.iter().cloned());
        if let Some(Input::Files(spec)) = &request.input {
            readable.extend(roots(&*world, spec));
        }
        let readable = readable
            .iter()
            .filter_map(|folder| world.resolve(folder).ok())
            .collect();
        let scripts = BTreeMap::from([(recipe.path.clone(), recipe.text.clone())]);
        let log = Mutex::new(Log {
            scripts,
            ..Log::default()
        });
        let bench = Workbench::new(world, memory, task.clone());
        let bench = match request.memory {
            Some(bytes) => bench.holding_at_most(bytes),
            None => bench,
        };
        Ok(Context {
            bench,
            folder,
            request: request.clone(),
            readable,
            log,
        })
    }

    /// The context that the engine carries for its functions.
    pub(super) fn of(call: &NativeCallContext) -> Raw<Arc<Context>> {
        let found = call
            .tag()
            .and_then(|tag| tag.clone().try_cast::<Arc<Context>>());
        found.map_or_else(
            || raise(Diagnostic::error("this function needs a running recipe")),
            Ok,
        )
    }

    /// Whoever opens, fits, samples and remembers.
    pub(super) fn bench(&self) -> &Workbench {
        &self.bench
    }

    /// Cancellation and progress.
    pub(super) fn task(&self) -> &Task {
        self.bench.task()
    }

    /// The recipe's own folder.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// What `input()` stands for.
    pub(super) fn input(&self) -> Option<&Input> {
        self.request.input.as_ref()
    }

    fn log(&self) -> MutexGuard<'_, Log> {
        // A panic while the log was held leaves whole entries behind.
        self.log.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// `path` resolved, if it lies below `root`.
    pub(super) fn resolve_within(&self, path: &Path, root: &Path) -> Option<PathBuf> {
        let root = self.bench.world().resolve(root).ok()?;
        self.bench
            .world()
            .resolve(path)
            .ok()
            .filter(|path| path.starts_with(root))
    }

    /// A script file's text, noted as read; `None` when it cannot be read as text.
    pub(super) fn read_script(&self, file: &Path) -> Option<String> {
        let text = String::from_utf8(self.bench.world().read(file).ok()?).ok()?;
        self.bench.note_read(file);
        self.log().scripts.insert(file.to_path_buf(), text.clone());
        Some(text)
    }

    /// The text of a script that took part in this run.
    pub(super) fn script(&self, file: &Path) -> Option<String> {
        self.log().scripts.get(file).cloned()
    }

    /// Where `pattern`, relative to the recipe's folder, points; refused outside what may be read.
    pub(super) fn readable(&self, pattern: &str) -> Result<PathBuf> {
        let path = self.folder.join(pattern);
        // A pattern's own name may not exist; its folder must be inside.
        let resolved = self.bench.world().resolve(&path)?;
        if self.readable.iter().any(|root| resolved.starts_with(root)) {
            return Ok(path);
        }
        Diagnostic::error(format!(
            "`{pattern}` is outside of what this recipe may read"
        ))
        .hint(
            "a recipe reads below its inputs and its own folder; `--allow-read DIR` adds a folder",
        )
        .err()
    }

    /// Notes that `value` is to be written to `path` below the output folder.
    pub(super) fn save(&self, value: Value, path: &str) -> Result<()> {
        let Some(output) = &self.request.output else {
            return Diagnostic::error(format!("`save` has nowhere to write `{path}`"))
                .hint("name the output folder with `-o`")
                .err();
        };
        let target = output.join(path);
        if self.resolve_within(&target, output).is_none() {
            return Diagnostic::error(format!("`{path}` is outside of the output folder"))
                .hint("a recipe writes below `-o` only")
                .err();
        }
        self.log().saves.push(Save {
            value,
            path: target,
        });
        Ok(())
    }

    /// Notes something to tell.
    pub(super) fn message(&self, text: &str) {
        self.log().messages.push(text.to_string());
    }

    /// Notes what should be known about a result, and gives the result.
    pub(super) fn warned<T>(&self, warned: crate::diag::Warned<T>) -> T {
        let mut warnings = Vec::new();
        let output = warned.unpack(&mut warnings);
        let mut log = self.log();
        for warning in warnings {
            if !log.warnings.contains(&warning) {
                log.warnings.push(warning);
            }
        }
        output
    }

    /// Declares a parameter and gives its value in this run. Declaring it twice alike is allowed.
    pub(super) fn declare(&self, mut param: Param) -> Result<Setting> {
        let set = self
            .request
            .settings
            .iter()
            .rev()
            .find(|(name, _)| *name == param.name);
        param.value = match set {
            Some((_, text)) => param.parse(text)?,
            None => param.within(param.default.clone())?,
        };
        let value = param.value.clone();
        let mut log = self.log();
        match log.params.iter().find(|known| known.name == param.name) {
            Some(known) if known.default != param.default || known.range != param.range => {
                return Diagnostic::error(format!(
                    "parameter `{}` is declared twice, differently",
                    param.name
                ))
                .hint(format!("the first time on line {}", known.line))
                .err();
            }
            Some(_) => {}
            None => log.params.push(param),
        }
        Ok(value)
    }

    /// The parameters whose declaration is written in plain numbers and texts, without a run.
    pub(super) fn declared_params(&self, recipe: &Recipe) -> Result<Vec<Param>> {
        for call in text::calls(&recipe.text)
            .iter()
            .filter(|call| call.name == "param" && !call.method)
        {
            let written: Vec<&str> = call
                .arguments
                .iter()
                .map(|range| &recipe.text[range.clone()])
                .collect();
            let (line, column) = text::position(&recipe.text, call.at.start);
            if let Some(param) = functions::written_param(&written, line) {
                self.declare(param)
                    .map_err(|error| Box::new(at(*error, recipe, (line, column))))?;
            }
        }
        Ok(self.log().params.clone())
    }

    /// The files read so far.
    pub(super) fn reads(&self) -> Vec<PathBuf> {
        let mut reads: Vec<PathBuf> = self.log().scripts.keys().cloned().collect();
        reads.extend(self.bench.reads());
        reads.sort();
        reads.dedup();
        reads
    }

    /// The whole outcome of a run whose last value is `value`.
    pub(super) fn outcome(&self, value: Dynamic) -> Result<Outcome> {
        let value = functions::value(value)?;
        let reads = self.reads();
        let steps: Vec<Step> = self.bench.steps();
        let sampled = match &value {
            Value::Sequence(frames) => self.bench.sampled_from(frames),
            _ => None,
        };
        let completed = match &value {
            Value::Sequence(frames) => self.bench.completed_from(frames),
            _ => None,
        };
        let named = match (&value, &completed) {
            (_, Some(completion)) => Some(completion.keys.key),
            (Value::Sequence(frames), None) => Some(frames.key),
            (Value::Statistics(found), None) => Some(found.key),
            _ => None,
        };
        let names = named.map(|key| self.bench.names_of(key));
        let log = self.log();
        Ok(Outcome {
            value,
            sampled,
            completed,
            names: names.unwrap_or_default(),
            params: log.params.clone(),
            saves: log.saves.clone(),
            reads,
            listings: self.bench.listings(),
            steps,
            messages: log.messages.clone(),
            warnings: log.warnings.clone(),
        })
    }
}

/// The folders that the inputs lie in: folders themselves, of files and patterns the folder above.
fn roots(world: &dyn World, spec: &InputSpec) -> Vec<PathBuf> {
    let is_folder =
        |path: &PathBuf| matches!(world.identity(path), Ok(Some(found)) if found.folder);
    let root = |path: &PathBuf| {
        if is_folder(path) {
            path.clone()
        } else {
            folder_of(path).to_path_buf()
        }
    };
    spec.paths.iter().chain(&spec.mesh).map(root).collect()
}
