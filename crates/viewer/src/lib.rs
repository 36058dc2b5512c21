//! The `manylight` program: commands, files, progress and exit codes.
//!
//! Results go to stdout, progress and messages to stderr. Absent from this crate: light transport.

#![allow(
    rustdoc::broken_intra_doc_links,
    reason = "doc comments of arguments are their help text, brackets and all"
)]

#[cfg(unix)]
mod allocator;
mod camera_path;
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
pub mod untrusted;
mod view;

use clap::Parser;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use cli::{Cli, Command};
use std::ffi::OsString;
use std::process::ExitCode;

/// Runs the program with the arguments of the process; returns what the process should end with.
///
/// Exit codes: 0 done, 1 a comparison failed, 2 bad usage or input, 3 no suitable GPU, 4 out of memory or GPU lost, 130 interrupted.
pub fn run() -> ExitCode {
    let cli = match Cli::try_parse().or_else(view_scene) {
        Ok(cli) => cli,
        Err(error) => return usage(&error),
    };
    message::set_level(cli.quiet, cli.verbose);
    let outcome = interrupt::install().and_then(|()| match &cli.command {
        Command::View(args) => view::run(args),
        Command::Render(args) => cmd::render::run(args),
        Command::Merge(args) => cmd::merge::run(args),
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

/// A scene where a command should be means to view it.
fn view_scene(error: clap::Error) -> Result<Cli, clap::Error> {
    match error.get(ContextKind::InvalidSubcommand) {
        Some(ContextValue::String(word))
            if error.kind() == ErrorKind::InvalidSubcommand && session::looks_like_scene(word) =>
        {
            let mut words: Vec<OsString> = std::env::args_os().collect();
            let at = words.iter().position(|given| given.to_str() == Some(word)).unwrap_or(1);
            words.insert(at, "view".into());
            Cli::try_parse_from(words)
        }
        _ => Err(error),
    }
}

/// Prints help, version or what is wrong with the command line.
fn usage(error: &clap::Error) -> ExitCode {
    // Whoever closed the pipe does not want the text.
    let _ = error.print();
    u8::try_from(error.exit_code()).unwrap_or(2).into()
}
