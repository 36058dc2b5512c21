//! The `manylight` program: commands, files, progress and exit codes.
//!
//! Results go to stdout, progress and messages to stderr. Absent from this crate: light transport.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "doc comments of arguments are their help text, brackets and all"
)]

mod cli;
mod cmd;
mod exit;
mod interrupt;
mod machine;
mod message;
mod output;
mod plot;
mod progress;
mod session;
mod table;
mod tev;

use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use cli::{Cli, Command};
use std::process::ExitCode;

/// Runs the program with the arguments of the process; returns what the process should end with.
///
/// Exit codes: 0 done, 1 a comparison failed, 2 bad usage or input, 3 no suitable GPU, 4 out of memory, 130 interrupted.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    message::set_level(cli.quiet, cli.verbose);
    let outcome = interrupt::install().and_then(|()| match &cli.command {
        Command::Render(args) => cmd::render::run(args),
        Command::Bench(args) => cmd::bench::run(args),
        Command::Dump(args) => cmd::dump::run(args),
        Command::Compare(args) => cmd::compare::run(args),
        Command::Info(args) => cmd::info::run(args),
        Command::Estimate(args) => cmd::estimate::run(args),
    });
    match outcome {
        Ok(status) => status.into(),
        Err(error) => {
            message::error(&error);
            exit::code_of(&error)
        }
    }
}

/// Prints help, version or what is wrong with the command line.
fn usage(error: &clap::Error) -> ExitCode {
    if error.kind() == ErrorKind::InvalidSubcommand
        && let Some(ContextValue::String(word)) = error.get(ContextKind::InvalidSubcommand)
        && session::looks_like_scene(word)
    {
        message::error(&anyhow::anyhow!(
            "a scene alone does not say what to do with it, and this release has no window; \
             try `manylight render {word} -o image.png`"
        ));
        return exit::Status::Usage.into();
    }
    // Whoever closed the pipe does not want the text.
    let _ = error.print();
    u8::try_from(error.exit_code()).unwrap_or(2).into()
}
