//! Printing: errors and warnings on the standard error, results on the standard output, in colour where that is wanted.
//!
//! `anstream` decides about colour from the terminal, `NO_COLOR`, `CLICOLOR`, `CLICOLOR_FORCE` and `TERM`, as clap does. The progress bar asks here
//! too, since indicatif's own rules differ where two of these disagree.
//!
//! Control characters are escaped, because names may hold terminal escapes. The first error of the standard output is remembered, and the exit code
//! is 1 then; a closed pipe is no error.

use crate::math::{rounded, rounded_list, significant};
use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::{AnsiColor, Style};
use std::fmt::{Arguments, Display};
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
const NOTE: Style = AnsiColor::Cyan.on_default().bold();

/// What has kept words from the standard output, first.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// Prints to the standard output.
macro_rules! out {
    ($($words:tt)*) => {
        $crate::cli::words::print(format_args!($($words)*))
    };
}

/// Prints a line to the standard output.
macro_rules! outln {
    ($($words:tt)*) => {
        $crate::cli::words::print(format_args!("{}\n", format_args!($($words)*)))
    };
}

/// Prints to the standard error.
macro_rules! err {
    ($($words:tt)*) => {
        $crate::cli::words::say(format_args!($($words)*))
    };
}

/// Prints a line to the standard error.
macro_rules! errln {
    ($($words:tt)*) => {
        $crate::cli::words::say(format_args!("{}\n", format_args!($($words)*)))
    };
}

/// A number of things with their noun, whose plural has an `s` more: `1 triangle`, `2 triangles`.
pub(super) fn count(number: u64, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// A number as people write it, such as 0.04 for the `f32` nearest to it.
pub(super) fn number(value: f64) -> String {
    rounded(value)
}

/// A measured number with at most four significant digits, such as 0.004021.
pub(super) fn measured(value: f64) -> String {
    significant(value, 4)
}

/// A share in percent with at most three significant digits, such as 7.7 %.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

/// Numbers as people write them, between brackets.
pub(super) fn list(values: &[f32]) -> String {
    rounded_list(values)
}

/// Words about the panes that were recognised, if there are any.
pub(super) fn panes(number: u64) -> Option<String> {
    (number > 0).then(|| format!("{}, light passes straight", count(number, "pane")))
}

/// Prints words that may hold names to the standard output.
pub(super) fn print(words: Arguments) {
    print_bytes(escaped(&words.to_string()).as_bytes());
}

/// Prints to the standard output. What goes wrong there is told by [`finish`], since the rest of a command is worth doing.
pub(super) fn print_bytes(bytes: &[u8]) {
    remember(io::stdout().lock().write_all(bytes));
}

/// Prints words that may hold names to the standard error. A failure to print cannot be printed either, and is ignored.
pub(super) fn say(words: Arguments) {
    let _ = io::stderr().lock().write_all(escaped(&words.to_string()).as_bytes());
}

/// Ends the standard output. An error where not all of it could be written.
pub(super) fn finish() -> io::Result<()> {
    remember(io::stdout().lock().flush());
    let lost = LOST.lock().unwrap_or_else(PoisonError::into_inner).take();
    lost.map_or(Ok(()), Err)
}

/// Remembers the first error. A reader that has read enough (`embrasure info SCENE | head`) is none.
pub(super) fn remember(written: io::Result<()>) {
    if let Err(error) = written.map_err(|error| (error.kind() != io::ErrorKind::BrokenPipe).then_some(error)) {
        let mut lost = LOST.lock().unwrap_or_else(PoisonError::into_inner);
        *lost = lost.take().or(error);
    }
}

/// `text` without control characters, which names may hold and terminals obey: `\u001b`, as JSON
/// escapes them. Lines and tabs stay.
pub(super) fn escaped(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        if (c.is_control() || is_bidi_control(c)) && c != '\n' && c != '\t' {
            shown += &format!("\\u{:04x}", c as u32)
        } else {
            shown.push(c)
        }
    }
    shown
}

/// Returns true for characters that reverse the text after them on a terminal, and hide what a name is
/// (Boucher and Anderson 2021, "Trojan Source").
fn is_bidi_control(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Says why a command ends early.
pub(super) fn error(text: impl Display) {
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{ERROR}error:{ERROR:#} {text}");
}

/// Says what should be looked at.
pub(super) fn warning(text: impl Display) {
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{WARNING}warning:{WARNING:#} {text}");
}

/// Prints a note: an assumption that changes the picture.
pub(super) fn note(text: impl Display) {
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{NOTE}note:{NOTE:#} {text}");
}

/// Whether the standard error is shown in colour: on a terminal that has it, unless `NO_COLOR`, `CLICOLOR` or `CLICOLOR_FORCE` say otherwise
/// (<https://no-color.org>, <https://bixense.com/clicolors>).
pub(super) fn in_colour() -> bool {
    AutoStream::choice(&io::stderr()) != ColorChoice::Never
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_people() {
        assert_eq!(measured(4.021), "4.021");
        assert_eq!(measured(0.000_040_213_6), "0.00004021");
        assert_eq!(percent(0.077), "7.7 %");
        assert_eq!(percent(1.2345e-3), "0.123 %");
        assert_eq!(
            [count(1, "sample"), count(0, "sample"), count(64, "sample")],
            ["1 sample", "0 samples", "64 samples"]
        );
    }

    #[test]
    fn names_cannot_speak_to_terminals() {
        assert_eq!(
            escaped("a\x1b[31mb\r\u{9b}2J\x7f"),
            "a\\u001b[31mb\\u000d\\u009b2J\\u007f"
        );
        assert_eq!(escaped("Küche 木\n\tnext"), "Küche 木\n\tnext");
        assert_eq!(escaped("\u{202e}gpj.obj\u{2069}"), "\\u202egpj.obj\\u2069");
    }
}
