//! What the program says to people on the standard error, in colour where that is wanted.

use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::{AnsiColor, Style};
use std::fmt::Display;
use std::io::{self, Write};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();

// Who reads a part of what is said and goes (`embrasure info SCENE | head`) is no reason to fail: the macros of the standard library panic there.

/// Prints to the standard output.
macro_rules! out {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = write!(std::io::stdout().lock(), $($words)*);
    }};
}

/// Prints a line to the standard output.
macro_rules! outln {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout().lock(), $($words)*);
    }};
}

/// Prints to the standard error.
macro_rules! err {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = write!(std::io::stderr().lock(), $($words)*);
    }};
}

/// Prints a line to the standard error.
macro_rules! errln {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr().lock(), $($words)*);
    }};
}

/// Says why a command ends early.
pub(super) fn error(text: impl Display) {
    let _ = writeln!(anstream::stderr(), "{ERROR}error:{ERROR:#} {text}");
}

/// Says what should be looked at.
pub(super) fn warning(text: impl Display) {
    let _ = writeln!(anstream::stderr(), "{WARNING}warning:{WARNING:#} {text}");
}

/// Whether the standard error is shown in colour: on a terminal that has it, unless `NO_COLOR`, `CLICOLOR` or `CLICOLOR_FORCE` say otherwise
/// (<https://no-color.org>, <https://bixense.com/clicolors>).
pub(super) fn in_colour() -> bool {
    AutoStream::choice(&io::stderr()) != ColorChoice::Never
}
