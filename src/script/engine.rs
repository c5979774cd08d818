//! The engine and its limits. A recipe is untrusted: limited in steps, depth, sizes and memory, cut off
//! from clocks, processes and the network, and it can be cancelled at any step.

use std::sync::Arc;

use rhai::{Dynamic, Engine, OptimizationLevel};

use super::context::Context;
use super::diagnostics::{raise, token};
use super::functions;
use super::modules::Modules;
use crate::diag::Diagnostic;

/// Steps of the interpreter in one run; about ten seconds of nothing but script.
const OPERATIONS: u64 = 50_000_000;
/// Functions calling functions.
const CALL_LEVELS: usize = 64;
/// Nesting of expressions: globally, and inside functions.
const EXPRESSION_DEPTHS: (usize, usize) = (128, 64);
/// Bytes of all texts in one value.
const TEXT_BYTES: usize = 256 * 1024;
/// Items of all arrays, or of all maps, in one value.
const ITEMS: usize = 10_000;
/// Variables of one function at one time.
const VARIABLES: usize = 1_000;
/// After so many steps it is measured what the process holds.
const MEASURED: u64 = 4096;
/// Modules of one run.
const MODULES: usize = 100;

/// An engine that knows our functions, without a recipe: for checking and for the reference.
pub(super) fn bare() -> Engine {
    let mut engine = Engine::new();
    engine.set_max_operations(OPERATIONS);
    engine.set_max_call_levels(CALL_LEVELS);
    engine.set_max_expr_depths(EXPRESSION_DEPTHS.0, EXPRESSION_DEPTHS.1);
    engine.set_max_string_size(TEXT_BYTES);
    engine.set_max_array_size(ITEMS);
    engine.set_max_map_size(ITEMS);
    engine.set_max_variables(VARIABLES);
    engine.set_max_modules(MODULES);
    // The optimizer may run functions while it compiles; a recipe is to run once.
    engine.set_optimization_level(OptimizationLevel::None);
    engine.disable_symbol("eval");
    for name in ["sleep", "timestamp"] {
        let refuse = move || {
            let error = Diagnostic::error(format!("`{name}` is not for recipes"));
            raise::<Dynamic>(error.hint("a recipe gives the same result at any time"))
        };
        // The language's own functions are found by the exact types of their arguments.
        engine.register_fn(name, refuse);
        engine.register_fn(name, move |_: i64| refuse());
        engine.register_fn(name, move |_: f64| refuse());
    }
    functions::register(&mut engine);
    engine
}

/// An engine for one run.
pub(super) fn for_run(context: &Arc<Context>) -> Engine {
    let mut engine = bare();
    engine.set_default_tag(Dynamic::from(Arc::clone(context)));
    engine.set_module_resolver(Modules::new(
        context.folder().to_path_buf(),
        Arc::clone(context),
    ));
    let watched = Arc::clone(context);
    engine.on_progress(move |steps| {
        if steps % MEASURED == 0
            && let Err(error) = watched.bench().check_growth()
        {
            return Some(token(*error));
        }
        watched.task().cancelled().then_some(Dynamic::UNIT)
    });
    let messages = Arc::clone(context);
    engine.on_print(move |text| messages.message(text));
    let messages = Arc::clone(context);
    engine.on_debug(move |text, _, _| messages.message(text));
    engine
}
