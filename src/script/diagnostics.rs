//! What went wrong in a script, as data: file, line, column, the line itself, and a hint.

use std::path::Path;

use rhai::{Dynamic, EvalAltResult, LexError, ParseError, ParseErrorType, Position};

use super::arguments::{Raw, closest};
use super::reference::Reference;
use crate::diag::Diagnostic;
use crate::recipe::{Recipe, text};
use crate::task::Cancelled;

/// A diagnostic on its way through the engine, which adds the position of the call.
#[derive(Debug, Clone)]
struct Raised(Box<Diagnostic>);

/// Fails the running script with `diagnostic`; its place becomes that of the call.
pub(super) fn raise<T>(diagnostic: impl Into<Box<Diagnostic>>) -> Raw<T> {
    Err(Box::new(EvalAltResult::ErrorRuntime(
        token(*diagnostic.into()),
        Position::NONE,
    )))
}

/// What ends the running script with `diagnostic`.
pub(super) fn token(diagnostic: Diagnostic) -> Dynamic {
    Dynamic::from(Raised(Box::new(diagnostic)))
}

/// Turns a result of ours into one that the engine passes on.
pub(super) fn pass<T>(result: crate::diag::Result<T>) -> Raw<T> {
    result.or_else(raise)
}

/// Gives the text of a script file that took part in the run, by the name the engine knows it by.
pub(super) type Sources<'a> = &'a dyn Fn(&Path) -> Option<String>;

/// The diagnostic for a script that does not parse.
pub(super) fn parse_failure(error: &ParseError, file: &Path, sources: Sources) -> Box<Diagnostic> {
    let diagnostic = unparsed(error.err_type());
    Box::new(placed(diagnostic, file, error.position(), sources))
}

fn unparsed(kind: &ParseErrorType) -> Diagnostic {
    use ParseErrorType as Kind;
    if let Kind::Reserved(name) | Kind::BadInput(LexError::ImproperSymbol(name, _)) = kind
        && name == "eval"
    {
        return Diagnostic::error("`eval` is not for recipes")
            .hint("a recipe runs as it is written");
    }
    let hint = match kind {
        Kind::UnexpectedEOF => "a bracket or a quote is open where the text ends",
        Kind::BadInput(LexError::UnterminatedString) => "a text ends with the quote it began with",
        Kind::BadInput(_) | Kind::UnknownOperator(_) => "the language has no such sign here",
        Kind::MissingToken(..) | Kind::MissingSymbol(_) => {
            "a semicolon or a bracket is missing here or on the line before"
        }
        Kind::VariableExpected => "a variable is declared by `let name = value;`",
        Kind::ForbiddenVariable(_) | Kind::Reserved(_) => {
            "this word belongs to the language; another name will do"
        }
        Kind::AssignmentToConstant(_) => "`let` instead of `const` declares what may change",
        Kind::AssignmentToInvalidLHS(_) => {
            "only a variable or its items can be assigned to; `==` compares"
        }
        Kind::ExprTooDeep => "split the expression: `let part = ..;`",
        Kind::LiteralTooLarge(..) => SIZES,
        Kind::LoopBreak => "`break` and `continue` belong into a loop",
        _ => "`meshloom run RECIPE --check` looks for such errors without running",
    };
    Diagnostic::error(lower_first(&kind.to_string())).hint(hint)
}

/// What values of the language may hold.
const SIZES: &str = "texts hold at most 256 KiB, arrays and maps 10000 items; sequences and looms are held natively";

/// The diagnostic for a script that failed while it ran.
pub(super) fn failure(
    error: &EvalAltResult,
    file: &Path,
    reference: &Reference,
    sources: Sources,
) -> Box<Diagnostic> {
    let (error, file, position) = innermost(error, file.to_path_buf(), Position::NONE);
    if let EvalAltResult::ErrorRuntime(value, _) | EvalAltResult::ErrorTerminated(value, _) = error
        && let Some(Raised(diagnostic)) = value.clone().try_cast::<Raised>()
    {
        // A diagnostic about a file that the script read keeps that file's place.
        if diagnostic.place.file.is_some() {
            let line = position.line().unwrap_or(0);
            return Box::new(diagnostic.hint(format!("called from {}:{line}", file.display())));
        }
        let placed = placed(*diagnostic, &file, position, sources);
        return Box::new(match called(&placed, reference) {
            Some(forms) if placed.hints.is_empty() => {
                placed.hint(format!("it is called as {forms}"))
            }
            _ => placed,
        });
    }
    Box::new(placed(describe(error, reference), &file, position, sources))
}

/// The forms of the function that is called where `error` is.
fn called<'a>(error: &Diagnostic, reference: &'a Reference) -> Option<&'a str> {
    let (line, column) = error.excerpt.as_ref().zip(error.place.column)?;
    let letters = line.chars().skip(column.saturating_sub(1));
    let name: String = letters
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect();
    reference.forms(&name)
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
        EvalAltResult::ErrorVariableNotFound(name, _) => Diagnostic::error(format!("no variable `{name}`"))
            .hint("a variable is declared before it is used, by `let name = value;`; functions do not see those outside of them"),
        EvalAltResult::ErrorTerminated(..) => *Box::<Diagnostic>::from(Cancelled),
        EvalAltResult::ErrorDotExpr(..) | EvalAltResult::ErrorPropertyNotFound(..) => unknown_property(error, reference),
        EvalAltResult::ErrorTooManyOperations(_) => {
            Diagnostic::error("the recipe takes too many steps").hint("a loop that never ends? heavy work belongs into the native functions")
        }
        EvalAltResult::ErrorStackOverflow(_) => Diagnostic::error("functions call each other too deeply").hint("a recursion without an end?"),
        EvalAltResult::ErrorDataTooLarge(what, _) => Diagnostic::error(format!("too large: {}", lower_first(what)))
            .hint(SIZES),
        EvalAltResult::ErrorModuleNotFound(name, _) => {
            Diagnostic::error(format!("no module `{name}`")).hint("modules are `.rhai` files in the recipe's own folder")
        }
        EvalAltResult::ErrorRuntime(value, _) => {
            Diagnostic::error(value.to_string()).hint("the recipe itself says so, by `throw`")
        }
        EvalAltResult::ErrorParsing(kind, _) => unparsed(kind),
        _ => Diagnostic::error(lower_first(&without_position(error))).hint(advice(error)),
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
    no_function(name, &on, reference)
}

/// No function has this name; ` for Loom` says on what.
pub(super) fn no_function(name: &str, on: &str, reference: &Reference) -> Diagnostic {
    let error = Diagnostic::error(format!("no function `{name}`{on}"));
    error.hint(match closest(name, reference.names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "`scripts/reference.md` lists all functions".to_string(),
    })
}

/// What could be done about an error of the language's own.
fn advice(error: &EvalAltResult) -> &'static str {
    match error {
        EvalAltResult::ErrorArithmetic(..) => {
            "a number is zero, or too large for what is done with it"
        }
        EvalAltResult::ErrorArrayBounds(..) | EvalAltResult::ErrorStringBounds(..) => {
            "items are counted from 0; `len()` tells how many there are"
        }
        EvalAltResult::ErrorMismatchDataType(..) | EvalAltResult::ErrorMismatchOutputType(..) => {
            "`type_of(value)` tells what a value is"
        }
        EvalAltResult::ErrorTooManyVariables(_) => {
            "a block `{ .. }` forgets its variables at its end"
        }
        EvalAltResult::ErrorTooManyModules(_) => "at most 100 modules belong to a recipe",
        EvalAltResult::ErrorAssignmentToConstant(..) => {
            "`let` instead of `const` declares what may change"
        }
        EvalAltResult::ErrorFor(_) => "`for` runs over ranges `0..n`, arrays and maps",
        _ => "`print(value)` before this line shows what it works on",
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
    diagnostic.hint(match closest(&name, reference.names()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => FIELDS.to_string(),
    })
}

/// Fields that values have.
const FIELDS: &str = "a loom has frames, fps, controls, sites, modes, space, error, left_out, report; a sequence frames, fps, vertices; a mesh vertices";

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

/// The diagnostic with the place of a line and a column of the recipe.
pub(super) fn at(
    diagnostic: Diagnostic,
    recipe: &Recipe,
    (line, column): (usize, usize),
) -> Diagnostic {
    let diagnostic = diagnostic.in_file(&recipe.path).at_line(line);
    diagnostic
        .at_column(column)
        .excerpt(text::line(&recipe.text, line))
}

/// What is wrong with the last value of the recipe, at the line that gives it.
pub(super) fn at_the_end(error: Box<Diagnostic>, recipe: &Recipe) -> Box<Diagnostic> {
    let written = |(_, line): &(usize, &str)| !line.trim().is_empty();
    let Some((index, line)) = recipe.text.lines().enumerate().filter(written).last() else {
        return error;
    };
    let indent = line.chars().take_while(|c| c.is_whitespace()).count();
    Box::new(at(*error, recipe, (index + 1, indent + 1)))
}

/// A run that was cancelled, where it was then.
pub(super) fn interrupted(failed: Diagnostic) -> Box<Diagnostic> {
    let cancelled = Box::<Diagnostic>::from(Cancelled);
    Box::new(Diagnostic {
        place: failed.place,
        excerpt: failed.excerpt,
        ..*cancelled
    })
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
