//! The command line: `args` (typed arguments) → `job` (validated and resolved) → the module of the
//! command, such as `run`.
//!
//! Commands use the library. `run` and `merge` use only sessions, files and observers
//! (`tests/it/project/layers.rs` checks this). `audit`, `check` and `paths` also use lower layers.
//! `laboratory` has the commands that measure and explain estimators. No other command uses it.

// This module comes first, because the following modules use its macros.
#[macro_use]
mod printing;

mod aov_list;
mod args;
mod audit;
mod camera_files;
mod check;
mod checkpointer;
mod clock;
mod compare;
mod completions;
mod develop;
#[cfg(test)]
mod documentation;
mod dump;
mod error;
mod help;
mod info;
mod init;
mod job;
mod laboratory;
mod man;
mod merge;
mod outputs;
mod paths;
mod picture_warnings;
mod pixel;
mod plot;
mod progress;
mod reference;
mod request;
mod run;
mod stats;
mod stop;
mod summary;
mod tev;
#[cfg(feature = "view")]
mod view;
mod views;
mod warnings;

pub use compare::compared;
pub use request::Request;

use crate::files::is_guarded;
use args::{Args, Command};
use error::{CliError, INTERRUPTED};
use std::process::ExitCode;

/// Runs the program with the arguments of the process, and returns its exit code.
///
/// 0 success, 1 failure, 2 wrong usage, 130 interrupted.
pub fn main() -> ExitCode {
    // Do not print the message of a panic that is caught: it is reported as an error of the file
    // that was read.
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !is_guarded() {
            usual(panic);
        }
    }));
    progress::catch_interrupts();
    let code = match Args::of_process() {
        Ok(args) => match dispatch(args) {
            Ok(_) if progress::is_interrupted() => ExitCode::from(INTERRUPTED),
            Ok(code) => code,
            Err(error) => {
                printing::error(&error);
                ExitCode::from(error.exit_code())
            }
        },
        Err(error) => {
            print_of_clap(&error);
            ExitCode::from(error.exit_code() as u8)
        }
    };
    let code = match printing::finish() {
        Err(error) => {
            printing::error(format_args!("cannot write to the standard output: {error}"));
            if code == ExitCode::SUCCESS {
                ExitCode::FAILURE
            } else {
                code
            }
        }
        Ok(()) => code,
    };
    if code == ExitCode::from(INTERRUPTED) {
        progress::leave_interrupted();
    }
    code
}

/// Prints help to the standard output, and errors of arguments to the standard error. clap selects
/// the output by the kind of `error`.
fn print_of_clap(error: &clap::Error) {
    if !error.use_stderr() {
        printing::remember(error.print());
        return;
    }
    let text = error.render().to_string();
    if error.kind() == clap::error::ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        errln!("{}", text.trim_end());
        return;
    }
    printing::error(text.strip_prefix("error: ").unwrap_or(&text).trim_end());
}

fn dispatch(args: Args) -> Result<ExitCode, CliError> {
    if args.version {
        outln!("{}", crate::session::version_text());
        return Ok(ExitCode::SUCCESS);
    }
    match args.command {
        Some(Command::Render(args)) => run::render(&args),
        Some(Command::Lab(args)) => laboratory::lab(&args),
        Some(Command::Audit(args)) => audit::audit(&args),
        Some(Command::Bench(args)) => laboratory::bench(&args),
        Some(Command::Merge(args)) => merge::merge(&args),
        Some(Command::Develop(args)) => develop::develop(&args),
        Some(Command::Info(args)) => info::info(&args),
        Some(Command::Views(args)) => views::views(&args),
        #[cfg(feature = "view")]
        Some(Command::View(args)) => view::view(&args),
        Some(Command::Init(args)) => init::init(&args),
        Some(Command::Check(args)) => check::check(&args.common, args.verbose),
        Some(Command::Compare(args)) => compare::compare(&args),
        Some(Command::Explain(args)) => laboratory::explain(&args),
        Some(Command::Points(args)) => laboratory::points(&args),
        Some(Command::Paths(args)) => paths::paths(&args),
        Some(Command::Selftest(args)) => laboratory::selftest(&args),
        Some(Command::Completions(args)) => completions::completions(&args),
        Some(Command::Man(args)) => man::man(&args),
        Some(Command::Help(args)) => help::help(&args),
        None => Err(CliError::Usage(
            "no command given\n  help: embrasure --help lists them".into(),
        )),
    }
}
