//! `meshloom completions SHELL`: what makes a shell complete our arguments.

use clap::CommandFactory;
use clap_complete::Shell;
use serde_json::json;

use super::Cli;
use super::session::{Outcome, Session};
use crate::diag::Result;

/// Print the completion script of a shell
#[derive(Debug, clap::Args)]
#[command(
    after_help = "For example: meshloom completions bash > ~/.local/share/bash-completion/completions/meshloom"
)]
pub(super) struct Args {
    /// The shell that is to complete
    shell: Shell,
}

pub(super) fn run(args: &Args, _: &Session) -> Result<Outcome> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "meshloom", &mut script);
    Ok(Outcome {
        object: json!({ "shell": args.shell.to_string(), "script": String::from_utf8_lossy(&script) }),
        product: script,
        ..Outcome::default()
    })
}
