//! A folder to run recipes in.

use std::fs;
use std::path::Path;

use tempfile::{TempDir, tempdir};

use super::capture::sheet;
use super::{Run, command, run};

/// A folder with a capture `sheet` of 12 frames and a recipe.
pub fn kitchen(recipe: &str) -> TempDir {
    let folder = tempdir().unwrap();
    sheet(5, 12).write_objs(&folder.path().join("sheet"));
    fs::write(folder.path().join("r.rhai"), recipe).unwrap();
    folder
}

/// Runs the binary with a cache folder of the test's own.
pub fn meshloom(folder: &Path, args: &str) -> Run {
    let mut command = command(folder, args.split_whitespace());
    command.env("MESHLOOM_CACHE", folder.join(".cache"));
    run(command)
}

/// Runs the recipe on the sheet.
pub fn outcome(recipe: &str, args: &str) -> Run {
    let folder = kitchen(recipe);
    meshloom(folder.path(), &format!("run r.rhai sheet --json {args}"))
}
