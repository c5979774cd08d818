//! The `meshloom` command: see [`meshloom`] for the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    meshloom::cli::run()
}
