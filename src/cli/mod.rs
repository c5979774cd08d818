//! The command line: parses, wires, prints, exits; computes nothing.
//!
//! Each subcommand is a file with its `Args` and a `run`, and a line in the list below. What `run` gives
//! back is printed here: the JSON object on stdout if it was asked for, everything for people on
//! stderr. Exit codes: 0 done, 1 the work failed, 2 usage.

mod args;
mod desk;
mod interrupt;
mod print;
mod progress;
mod reading;
mod recipes;
mod report;
mod runs;
mod session;
mod threads;

mod compare;
mod complete;
mod completions;
mod convert;
mod demo;
mod doctor;
mod fit;
mod info;
mod man;
mod morph;
mod open;
mod plot;
mod run;
mod sample;
mod stats;
mod transfer;
mod watch;
mod watched;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use args::Global;
use session::{Outcome, Session};

use crate::diag::Result;

/// Declares the subcommands: the file, then the name in its parsed form. Their descriptions are the
/// documentation of their `Args`.
macro_rules! commands {
    ($($file:ident $name:ident,)*) => {
        #[derive(Debug, Subcommand)]
        enum Command {
            // boxed: some take many arguments, and there is one of them a run
            $($name(Box<$file::Args>),)*
        }

        impl Command {
            fn run(&self, session: &Session) -> Result<Outcome> {
                match self {
                    $(Command::$name(args) => $file::run(args, session),)*
                }
            }
        }
    };
}

commands! {
    demo Demo,
    fit Fit,
    sample Sample,
    transfer Transfer,
    complete Complete,
    morph Morph,
    stats Stats,
    open Open,
    run Run,
    watch Watch,
    compare Compare,
    info Info,
    convert Convert,
    plot Plot,
    doctor Doctor,
    completions Completions,
    man Man,
}

/// Turns deforming mesh sequences into three small editable signals, and back into frames.
///
/// A capture (many frames of one mesh) becomes a loom: a curve in a map of its poses, the map, and a few
/// shapes. Sample the loom at any times, loop it, retime it.
#[derive(Debug, Parser)]
#[command(
    name = "meshloom",
    version,
    propagate_version = true,
    arg_required_else_help = true,
    max_term_width = 100,
    after_help = "Exit codes: 0 done, 1 the work failed, 2 wrong usage."
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    global: Global,
}

/// Runs the command that the process was started with, to its exit code.
pub fn run() -> ExitCode {
    // Threads come from rayon over frames; one factorisation on one thread keeps results the same on
    // any number of them.
    faer::set_global_parallelism(faer::Par::Seq);
    match Cli::try_parse() {
        Ok(cli) => Session::begin(&cli.global).run(|session| cli.command.run(session)),
        Err(error) => print::usage(&error, std::env::args_os().any(|arg| arg == "--json")),
    }
}
