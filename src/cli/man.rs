//! `meshloom man`: the manual, one page for the command and one for each subcommand.

use std::io;

use clap::CommandFactory;
use clap_mangen::Man;
use serde_json::json;

use super::Cli;
use super::session::{Outcome, Session};
use crate::diag::{Diagnostic, Result};

/// Print the manual in roff, for `man -l -`
#[derive(Debug, clap::Args)]
#[command(after_help = "For example: meshloom man | man -l -")]
pub(super) struct Args {}

pub(super) fn run(_: &Args, _: &Session) -> Result<Outcome> {
    let pages = pages().map_err(|error| Diagnostic::error(format!("no manual: {error}")))?;
    Ok(Outcome {
        object: json!({ "manual": String::from_utf8_lossy(&pages) }),
        product: pages,
        ..Outcome::default()
    })
}

fn pages() -> io::Result<Vec<u8>> {
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let mut pages = Vec::new();
    Man::new(command.clone()).render(&mut pages)?;
    for page in command.get_subcommands() {
        let name = format!("meshloom-{}", page.get_name());
        Man::new(page.clone()).title(name).render(&mut pages)?;
    }
    Ok(pages)
}
