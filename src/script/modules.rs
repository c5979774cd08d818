//! `import` of modules beside the recipe: stays inside the recipe's folder and sees every change, as
//! nothing is kept between runs.

use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use std::sync::{Arc, Mutex};

use rhai::{Engine, EvalAltResult, Module, ModuleResolver, Position, Scope, Shared};

use super::context::Context;
use super::diagnostics::{parse_failure, raise};
use crate::diag::Diagnostic;

/// Finds modules in one folder; one for each run.
pub(super) struct Modules {
    folder: PathBuf,
    context: Arc<Context>,
    loaded: Mutex<BTreeMap<PathBuf, Shared<Module>>>,
}

impl Modules {
    /// Modules of the recipe in `folder`.
    pub(super) fn new(folder: PathBuf, context: Arc<Context>) -> Self {
        Modules {
            folder,
            context,
            loaded: Mutex::default(),
        }
    }

    /// The file of module `name`, below the folder however it is written.
    fn file(&self, name: &str) -> Result<PathBuf, Box<Diagnostic>> {
        let outside = || {
            Diagnostic::error(format!("module `{name}` is outside the recipe's folder"))
                .hint("modules are `.rhai` files in the recipe's own folder or below it")
        };
        let relative = Path::new(name);
        if !relative
            .components()
            .all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        {
            return Err(Box::new(outside()));
        }
        let file = self.folder.join(relative).with_extension("rhai");
        self.context
            .resolve_within(&file, &self.folder)
            .ok_or_else(|| Box::new(outside()))?;
        Ok(file)
    }
}

impl ModuleResolver for Modules {
    fn resolve(
        &self,
        engine: &Engine,
        _source: Option<&str>,
        name: &str,
        position: Position,
    ) -> Result<Shared<Module>, Box<EvalAltResult>> {
        let at = |mut error: Box<EvalAltResult>| {
            error.set_position(position);
            error
        };
        let file = self.file(name).or_else(raise).map_err(at)?;
        let loaded = || {
            self.loaded
                .lock()
                .unwrap_or_else(std::sync::PoisonError::into_inner)
        };
        if let Some(module) = loaded().get(&file) {
            return Ok(Shared::clone(module));
        }
        let missing = || {
            Box::new(EvalAltResult::ErrorModuleNotFound(
                name.to_string(),
                position,
            ))
        };
        let text = self.context.read_script(&file).ok_or_else(missing)?;
        let mut ast = match engine.compile(&text) {
            Ok(ast) => ast,
            Err(error) => {
                return raise(parse_failure(&error, &file, &|path| {
                    self.context.script(path)
                }))
                .map_err(at);
            }
        };
        ast.set_source(file.to_string_lossy().as_ref());
        let module = Module::eval_ast_as_new(Scope::new(), &ast, engine).map_err(|error| {
            Box::new(EvalAltResult::ErrorInModule(
                file.to_string_lossy().into(),
                error,
                position,
            ))
        })?;
        let module = Shared::new(module);
        loaded().insert(file, Shared::clone(&module));
        Ok(module)
    }
}
