//! Recipes in Rhai: the only room that knows the language. It implements [`Runner`], so that command
//! line, studio and watched folders run recipes without knowing it.

mod arguments;
mod context;
mod diagnostics;
mod engine;
mod functions;
mod modules;
mod reference;

use std::path::Path;
use std::sync::Arc;

use rhai::{Dynamic, EvalAltResult};

use crate::diag::{Diagnostic, Result};
use crate::pipeline::Memory;
use crate::recipe::{Failure, Outcome, Param, Recipe, Request, Runner, text};
use crate::task::{Cancelled, Task};
use crate::world::World;

use arguments::closest;
use context::Context;
pub use reference::{Entry, Reference};

/// Runs recipes over a world, remembering expensive results.
pub struct Scripts {
    world: Arc<dyn World>,
    memory: Arc<Memory>,
    reference: Reference,
}

impl Scripts {
    /// Recipes read from `world`, results kept in `memory`.
    pub fn new(world: Arc<dyn World>, memory: Arc<Memory>) -> Self {
        Scripts {
            world,
            memory,
            reference: reference(),
        }
    }

    fn context(&self, recipe: &Recipe, request: &Request, task: &Task) -> Result<Arc<Context>> {
        Context::new(
            Arc::clone(&self.world),
            Arc::clone(&self.memory),
            recipe,
            request,
            task,
        )
        .map(Arc::new)
    }
}

/// All functions that recipes can call.
pub fn reference() -> Reference {
    Reference::of(&engine::bare())
}

impl Runner for Scripts {
    fn run(&self, recipe: &Recipe, request: &Request, task: &Task) -> Result<Outcome, Failure> {
        let early = |diagnostic| Failure {
            diagnostic,
            reads: vec![recipe.path.clone()],
        };
        let context = self.context(recipe, request, task).map_err(early)?;
        let value = evaluate(&context, recipe, &self.reference);
        let unused = |outcome: Outcome| undeclared(&outcome.params, request).map(|()| outcome);
        let outcome = value
            .and_then(|value| context.outcome(value))
            .and_then(unused);
        outcome.map_err(|diagnostic| Failure {
            diagnostic,
            reads: context.reads(),
        })
    }

    fn check(&self, recipe: &Recipe, request: &Request) -> Result<Vec<Param>> {
        let context = self.context(recipe, request, &Task::default())?;
        compile(&engine::for_run(&context), &context, recipe)?;
        resolve_functions(recipe, &self.reference)?;
        let params = context.declared_params(recipe)?;
        undeclared(&params, request)?;
        Ok(params)
    }
}

fn compile(engine: &rhai::Engine, context: &Context, recipe: &Recipe) -> Result<rhai::AST> {
    let sources = |path: &Path| context.script(path);
    let mut ast = engine
        .compile(&recipe.text)
        .map_err(|error| diagnostics::parse_failure(&error, &recipe.path, &sources))?;
    ast.set_source(recipe.path.to_string_lossy().as_ref());
    Ok(ast)
}

fn evaluate(context: &Arc<Context>, recipe: &Recipe, reference: &Reference) -> Result<Dynamic> {
    let engine = engine::for_run(context);
    let ast = compile(&engine, context, recipe)?;
    let sources = |path: &Path| context.script(path);
    engine
        .eval_ast::<Dynamic>(&ast)
        .map_err(|error| match *error {
            EvalAltResult::ErrorTerminated(..) => Cancelled.into(),
            _ if context.task().cancelled() => Cancelled.into(),
            error => diagnostics::failure(&error, &recipe.path, reference, &sources),
        })
}

/// Every function that the recipe calls by name must exist, here or in the recipe itself.
fn resolve_functions(recipe: &Recipe, reference: &Reference) -> Result<()> {
    let own = text::definitions(&recipe.text);
    for call in text::calls(&recipe.text) {
        let qualified = recipe.text[..call.at.start].ends_with("::");
        if qualified || own.contains(&call.name) || reference.knows(&call.name) {
            continue;
        }
        let (line, column) = text::position(&recipe.text, call.at.start);
        let error = Diagnostic::error(format!("no function `{}`", call.name))
            .in_file(&recipe.path)
            .at_line(line)
            .at_column(column);
        let error = error.excerpt(text::line(&recipe.text, line));
        return match closest(&call.name, reference.names()) {
            Some(near) => error.hint(format!("did you mean `{near}`?")).err(),
            None => error.err(),
        };
    }
    Ok(())
}

/// What is set must have been declared.
fn undeclared(params: &[Param], request: &Request) -> Result<()> {
    let unknown = request
        .settings
        .iter()
        .find(|(name, _)| !params.iter().any(|param| param.name == *name));
    let Some((name, _)) = unknown else {
        return Ok(());
    };
    let error = Diagnostic::error(format!("the recipe declares no parameter `{name}`"));
    let list: Vec<_> = params.iter().map(describe).collect();
    let declared = if list.is_empty() {
        "it declares none".to_string()
    } else {
        format!("it declares {}", list.join(", "))
    };
    match closest(name, params.iter().map(|param| param.name.as_str())) {
        Some(near) => error
            .hint(format!("did you mean `{near}`?"))
            .hint(declared)
            .err(),
        None => error.hint(declared).err(),
    }
}

fn describe(param: &Param) -> String {
    match param.range {
        Some((least, greatest)) => format!(
            "{} ({least} to {greatest}, default {})",
            param.name, param.default
        ),
        None => format!("{} (default {})", param.name, param.default),
    }
}
