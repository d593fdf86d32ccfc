//! The command line: what was typed (`args`), what it means (`job`), and doing it (`run`).

// Its macros are for all that follow.
#[macro_use]
mod words;

mod aovs;
mod args;
mod audit;
mod bench;
mod bench_tables;
mod check;
mod clock;
mod compare;
mod completions;
mod error;
mod explain;
mod info;
mod job;
mod keeper;
mod lab;
mod man;
mod merge;
mod pixel;
mod progress;
mod run;
mod stats;
mod tev;
mod values;

use crate::io::is_decoding;
use args::{Args, Command};
use error::CliError;
use std::process::ExitCode;

/// Runs the program on the process's arguments and turns the outcome into an exit code.
///
/// 0 done, 1 failed, 2 wrong usage, 130 interrupted.
pub fn main() -> ExitCode {
    // Decoders that panic are heard of as errors of their files.
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !is_decoding() {
            usual(panic);
        }
    }));
    let args = match Args::of_process() {
        Ok(args) => args,
        Err(error) => {
            // Help goes to the standard output and is no failure; clap decides by the kind of error.
            let _ = error.print();
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    progress::catch_interrupts();
    match dispatch(args) {
        Ok(_) if progress::is_interrupted() => progress::leave_interrupted(),
        Ok(code) => code,
        Err(error) => {
            words::error(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

fn dispatch(args: Args) -> Result<ExitCode, CliError> {
    if args.version {
        outln!("{}", crate::session::version_text());
        return Ok(ExitCode::SUCCESS);
    }
    match args.command {
        Some(Command::Render(args)) => run::render(&args),
        Some(Command::Lab(args)) => lab::lab(&args),
        Some(Command::Audit(args)) => audit::audit(&args),
        Some(Command::Bench(args)) => bench::bench(&args),
        Some(Command::Merge(args)) => merge::merge(&args),
        Some(Command::Info(args)) => info::info(&args),
        Some(Command::Check(args)) => check::check(&args),
        Some(Command::Compare(args)) => compare::compare(&args),
        Some(Command::Explain(args)) => explain::explain(&args),
        Some(Command::Completions(args)) => completions::completions(&args),
        Some(Command::Man(args)) => man::man(&args),
        None => Err(CliError::Usage(
            "no command given\n  help: embrasure --help lists them".into(),
        )),
    }
}
