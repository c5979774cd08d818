//! Recipes by file or by name: the stock recipes are part of the program.

use std::path::{Path, PathBuf};

use crate::diag::{Diagnostic, Result};
use crate::recipe::Recipe;
use crate::world::{World, folder_of};

/// The stock recipes: name and text.
pub(super) const STOCK: &[(&str, &str)] = &[
    ("loop", include_str!("../../scripts/loop.rhai")),
    (
        "longer-walk",
        include_str!("../../scripts/longer-walk.rhai"),
    ),
    (
        "slow-motion",
        include_str!("../../scripts/slow-motion.rhai"),
    ),
    ("frame-rate", include_str!("../../scripts/frame-rate.rhai")),
    (
        "contact-sheet",
        include_str!("../../scripts/contact-sheet.rhai"),
    ),
    (
        "quality-gate",
        include_str!("../../scripts/quality-gate.rhai"),
    ),
    ("transfer", include_str!("../../scripts/transfer.rhai")),
    (
        "from-scratch",
        include_str!("../../scripts/from-scratch.rhai"),
    ),
];

/// The folder to watch for a recipe that may change; none for a stock recipe.
pub(super) fn folder(path: &Path) -> Option<PathBuf> {
    let stock = STOCK.iter().any(|(name, _)| Path::new(name) == path);
    let named_only = stock && !path.exists();
    (!named_only).then(|| folder_of(path).to_path_buf())
}

/// The recipe of that file, or the stock recipe of that name; a file goes first.
///
/// # Errors
/// Neither exists, or the file is not text.
pub(super) fn find(world: &dyn World, path: &Path) -> Result<Recipe> {
    if let Some(found) = world.identity(path)? {
        if found.folder {
            return Diagnostic::error("a recipe is a file, this is a folder")
                .in_file(path)
                .hint("name a file that ends in .rhai")
                .err();
        }
        let text = String::from_utf8(world.read(path)?);
        return match text {
            Ok(text) if text.trim().is_empty() => Diagnostic::error("the recipe is empty")
                .in_file(path)
                .hint("`meshloom run --list` shows stock recipes to start from")
                .err(),
            Ok(text) => Ok(Recipe {
                path: path.to_path_buf(),
                text,
            }),
            Err(error) => {
                let line = error.as_bytes()[..error.utf8_error().valid_up_to()]
                    .iter()
                    .filter(|byte| **byte == b'\n')
                    .count()
                    + 1;
                Diagnostic::error("the recipe is not UTF-8 text")
                    .in_file(path)
                    .at_line(line)
                    .hint("save it as UTF-8")
                    .err()
            }
        };
    }
    let name = path.to_string_lossy();
    match STOCK.iter().find(|(stock, _)| *stock == name) {
        Some((stock, text)) => Ok(Recipe {
            path: PathBuf::from(format!("{stock}.rhai")),
            text: (*text).to_string(),
        }),
        None => Diagnostic::error("no such recipe")
            .in_file(path)
            .hint(format!(
                "a file that ends in .rhai, or one of {}",
                STOCK
                    .iter()
                    .map(|(name, _)| *name)
                    .collect::<Vec<_>>()
                    .join(", ")
            ))
            .err(),
    }
}

/// The first comment line of a stock recipe: what it does.
pub(super) fn about(text: &str) -> &str {
    text.lines()
        .next()
        .unwrap_or_default()
        .trim_start_matches("//")
        .trim()
}
