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

use rhai::Dynamic;

use crate::diag::{Diagnostic, Result};
use crate::pipeline::Memory;
use crate::recipe::{Failure, Outcome, Param, Recipe, Request, Runner, text};
use crate::task::Task;
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
            listings: Vec::new(),
        };
        let context = self.context(recipe, request, task).map_err(early)?;
        let value = evaluate(&context, recipe, &self.reference);
        let unused =
            |outcome: Outcome| undeclared(recipe, &outcome.params, request).map(|()| outcome);
        let last = |error| diagnostics::at_the_end(error, recipe);
        let outcome = value
            .and_then(|value| context.outcome(value).map_err(last))
            .and_then(unused);
        outcome.map_err(|diagnostic| Failure {
            diagnostic,
            reads: context.reads(),
            listings: context.bench().listings(),
        })
    }

    fn check(&self, recipe: &Recipe, request: &Request) -> Result<Vec<Param>> {
        let context = self.context(recipe, request, &Task::default())?;
        compile(&engine::for_run(&context), &context, recipe)?;
        resolve_functions(recipe, &self.reference)?;
        let params = context.declared_params(recipe)?;
        undeclared(recipe, &params, request)?;
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
    engine.eval_ast::<Dynamic>(&ast).map_err(|error| {
        let failed = diagnostics::failure(&error, &recipe.path, reference, &sources);
        // Whatever a cancelled step says of itself, that is why it failed.
        match context.task().cancelled() {
            true => diagnostics::interrupted(*failed),
            false => failed,
        }
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
        let error = diagnostics::no_function(&call.name, "", reference);
        return diagnostics::at(error, recipe, (line, column)).err();
    }
    Ok(())
}

/// What is set must have been declared.
fn undeclared(recipe: &Recipe, params: &[Param], request: &Request) -> Result<()> {
    let unknown = request
        .settings
        .iter()
        .find(|(name, _)| !params.iter().any(|param| param.name == *name));
    let Some((name, _)) = unknown else {
        return Ok(());
    };
    let error = Diagnostic::error(format!("the recipe declares no parameter `{name}`"));
    let error = error.in_file(&recipe.path);
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
