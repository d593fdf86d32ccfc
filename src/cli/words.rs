//! What the program says to people on the standard error, in colour where that is wanted.

use anstream::{AutoStream, ColorChoice, eprintln};
use clap::builder::styling::{AnsiColor, Style};
use std::fmt::Display;
use std::io;

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();

/// Says why a command ends early.
pub(super) fn error(text: impl Display) {
    eprintln!("{ERROR}error:{ERROR:#} {text}");
}

/// Says what should be looked at.
pub(super) fn warning(text: impl Display) {
    eprintln!("{WARNING}warning:{WARNING:#} {text}");
}

/// Whether the standard error is shown in colour: on a terminal that has it, unless `NO_COLOR`, `CLICOLOR` or `CLICOLOR_FORCE` say otherwise
/// (<https://no-color.org>, <https://bixense.com/clicolors>).
pub(super) fn in_colour() -> bool {
    AutoStream::choice(&io::stderr()) != ColorChoice::Never
}
