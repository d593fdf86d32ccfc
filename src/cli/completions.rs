//! `embrasure completions`: scripts by which a shell completes commands and flags.

use super::args::{Args, CompletionsArgs};
use super::error::CliError;
use super::words::print_bytes;
use clap::CommandFactory;
use std::process::ExitCode;

/// Prints the shell's script.
pub(super) fn completions(args: &CompletionsArgs) -> Result<ExitCode, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "embrasure", &mut script);
    print_bytes(&script);
    Ok(ExitCode::SUCCESS)
}
