//! What went wrong in a script, as data: file, line, column, the line itself, and a hint.

use std::path::Path;

use rhai::{Dynamic, EvalAltResult, ParseError, Position};

use super::arguments::{Raw, closest};
use super::reference::Reference;
use crate::diag::Diagnostic;
use crate::recipe::text;

/// A diagnostic on its way through the engine, which adds the position of the call.
#[derive(Debug, Clone)]
struct Raised(Box<Diagnostic>);

/// Fails the running script with `diagnostic`; its place becomes that of the call.
pub(super) fn raise<T>(diagnostic: impl Into<Box<Diagnostic>>) -> Raw<T> {
    Err(Box::new(EvalAltResult::ErrorRuntime(
        Dynamic::from(Raised(diagnostic.into())),
        Position::NONE,
    )))
}

/// Turns a result of ours into one that the engine passes on.
pub(super) fn pass<T>(result: crate::diag::Result<T>) -> Raw<T> {
    result.or_else(raise)
}

/// Gives the text of a script file that took part in the run, by the name the engine knows it by.
pub(super) type Sources<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// The diagnostic for a script that does not parse.
pub(super) fn parse_failure(error: &ParseError, file: &Path, sources: Sources) -> Box<Diagnostic> {
    let message = lower_first(&error.err_type().to_string());
    Box::new(placed(
        Diagnostic::error(message),
        file,
        error.position(),
        sources,
    ))
}

/// The diagnostic for a script that failed while it ran.
pub(super) fn failure(
    error: &EvalAltResult,
    file: &Path,
    reference: &Reference,
    sources: Sources,
) -> Box<Diagnostic> {
    let (error, file, position) = innermost(error, file.to_path_buf(), Position::NONE);
    if let EvalAltResult::ErrorRuntime(value, _) = error
        && let Some(Raised(diagnostic)) = value.clone().try_cast::<Raised>()
    {
        // A diagnostic about a file that the script read keeps that file's place.
        if diagnostic.place.file.is_some() {
            let line = position.line().unwrap_or(0);
            return Box::new(diagnostic.hint(format!("called from {}:{line}", file.display())));
        }
        return Box::new(placed(*diagnostic, &file, position, sources));
    }
    Box::new(placed(describe(error, reference), &file, position, sources))
}

/// The error that caused `error`, the file it happened in and the nearest known position.
fn innermost(
    error: &EvalAltResult,
    file: std::path::PathBuf,
    outer: Position,
) -> (&EvalAltResult, std::path::PathBuf, Position) {
    let own = error.position();
    let position = if own.is_none() { outer } else { own };
    match error {
        EvalAltResult::ErrorInFunctionCall(_, source, inner, _) if !source.is_empty() => {
            innermost(inner, source.into(), position)
        }
        EvalAltResult::ErrorInFunctionCall(_, _, inner, _) => innermost(inner, file, position),
        EvalAltResult::ErrorInModule(path, inner, _)
            if !path.is_empty() && !inner.position().is_none() =>
        {
            innermost(inner, path.into(), Position::NONE)
        }
        EvalAltResult::ErrorInModule(_, inner, _) => innermost(inner, file, position),
        _ => (error, file, position),
    }
}

fn describe(error: &EvalAltResult, reference: &Reference) -> Diagnostic {
    match error {
        EvalAltResult::ErrorFunctionNotFound(signature, _) => unknown_function(signature, reference),
        EvalAltResult::ErrorVariableNotFound(name, _) => Diagnostic::error(format!("no variable `{name}`")),
        EvalAltResult::ErrorDotExpr(..) | EvalAltResult::ErrorPropertyNotFound(..) => unknown_property(error, reference),
        EvalAltResult::ErrorTooManyOperations(_) => {
            Diagnostic::error("the recipe takes too many steps").hint("a loop that never ends? heavy work belongs into the native functions")
        }
        EvalAltResult::ErrorStackOverflow(_) => Diagnostic::error("functions call each other too deeply").hint("a recursion without an end?"),
        EvalAltResult::ErrorDataTooLarge(what, _) => Diagnostic::error(format!("too large: {}", lower_first(what)))
            .hint("texts hold at most 256 KiB, arrays and maps 10000 items; sequences and looms are held natively"),
        EvalAltResult::ErrorModuleNotFound(name, _) => {
            Diagnostic::error(format!("no module `{name}`")).hint("modules are `.rhai` files in the recipe's own folder")
        }
        EvalAltResult::ErrorRuntime(value, _) => Diagnostic::error(value.to_string()),
        EvalAltResult::ErrorParsing(kind, _) => Diagnostic::error(lower_first(&kind.to_string())),
        _ => Diagnostic::error(lower_first(&without_position(error))),
    }
}

/// `add_lop (Loom, i64)`: the function is unknown, or known with other arguments.
fn unknown_function(signature: &str, reference: &Reference) -> Diagnostic {
    let (name, arguments) = signature
        .split_once('(')
        .map_or((signature, ""), |(name, rest)| {
            (name.trim(), rest.trim_end_matches(')'))
        });
    let name = name.rsplit("::").next().unwrap_or(name).trim();
    if let Some(forms) = reference.forms(name) {
        let message = format!("`{name}` does not take ({})", friendly(arguments));
        return Diagnostic::error(message).hint(format!("it is called as {forms}"));
    }
    let on = match arguments.split(',').next().map(str::trim) {
        Some(first) if reference.is_type(first) => format!(" for {first}"),
        _ => String::new(),
    };
    let error = Diagnostic::error(format!("no function `{name}`{on}"));
    match closest(name, reference.names()) {
        Some(near) => error.hint(format!("did you mean `{near}`?")),
        None => error,
    }
}

fn unknown_property(error: &EvalAltResult, reference: &Reference) -> Diagnostic {
    let text = without_position(error);
    let name = text.split('\'').nth(1).unwrap_or_default().to_string();
    let diagnostic = Diagnostic::error(if name.is_empty() {
        lower_first(&text)
    } else {
        format!("no field `{name}`")
    });
    match closest(&name, reference.names()) {
        Some(near) => diagnostic.hint(format!("did you mean `{near}`?")),
        None => diagnostic,
    }
}

/// The engine's names of types as a person would say them.
fn friendly(arguments: &str) -> String {
    let word = |name: &str| match name.trim().rsplit("::").next().unwrap_or(name).trim() {
        "i64" => "integer".to_string(),
        "f64" => "number".to_string(),
        "ImmutableString" | "&str" | "&str | ImmutableString | String" | "string" => {
            "text".to_string()
        }
        name => name.to_lowercase(),
    };
    arguments
        .split(',')
        .filter(|name| !name.trim().is_empty())
        .map(word)
        .collect::<Vec<_>>()
        .join(", ")
}

fn placed(diagnostic: Diagnostic, file: &Path, position: Position, sources: Sources) -> Diagnostic {
    let diagnostic = diagnostic.in_file(file);
    let Some(line) = position.line() else {
        return diagnostic;
    };
    let diagnostic = diagnostic
        .at_line(line)
        .at_column(position.position().unwrap_or(1));
    match sources(file) {
        Some(source) => diagnostic.excerpt(text::line(&source, line)),
        None => diagnostic,
    }
}

/// The engine's message without its trailing `(line 1, position 2)`.
fn without_position(error: &EvalAltResult) -> String {
    let text = error.to_string();
    text.rfind(" (line ")
        .map_or(text.clone(), |at| text[..at].to_string())
}

fn lower_first(text: &str) -> String {
    let mut letters = text.chars();
    letters
        .next()
        .map(|first| first.to_lowercase().chain(letters).collect())
        .unwrap_or_default()
}
