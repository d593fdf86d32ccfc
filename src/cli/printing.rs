//! Printing: errors and warnings to the standard error, results to the standard output, in colour
//! if the terminal shows colours.
//!
//! `anstream` decides about colour from the terminal, `NO_COLOR`, `CLICOLOR`, `CLICOLOR_FORCE` and
//! `TERM`, as in clap. The progress bar follows this decision, because indicatif would decide
//! differently if these variables conflict.
//!
//! Control characters are escaped, because names may have terminal escapes. The first error of
//! writing to the standard output is stored. The exit code is then 1. A closed pipe is not an
//! error.

use crate::math::{rounded, rounded_list, significant};
use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::{AnsiColor, Style};
use std::fmt::{Arguments, Display};
use std::io::{self, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
const NOTE: Style = AnsiColor::Cyan.on_default().bold();

/// First error of writing to the standard output.
static LOST: Mutex<Option<io::Error>> = Mutex::new(None);

/// True if [`note`] prints nothing.
static HIDES_NOTES: AtomicBool = AtomicBool::new(false);

/// Prints formatted text to the standard output, like `print!`.
macro_rules! out {
    ($($words:tt)*) => {
        $crate::cli::printing::print(format_args!($($words)*))
    };
}

/// Prints formatted text and a line break to the standard output, like `println!`.
macro_rules! outln {
    ($($words:tt)*) => {
        $crate::cli::printing::print(format_args!("{}\n", format_args!($($words)*)))
    };
}

/// Prints formatted text to the standard error, like `eprint!`.
macro_rules! err {
    ($($words:tt)*) => {
        $crate::cli::printing::print_error(format_args!($($words)*))
    };
}

/// Prints formatted text and a line break to the standard error, like `eprintln!`.
macro_rules! errln {
    ($($words:tt)*) => {
        $crate::cli::printing::print_error(format_args!("{}\n", format_args!($($words)*)))
    };
}

/// A number with its noun, whose plural ends in `s`: `1 triangle`, `2 triangles`.
pub(super) fn count(number: u64, noun: &str) -> String {
    format!("{number} {noun}{}", if number == 1 { "" } else { "s" })
}

/// A number with six significant digits at most, such as 0.04 for the `f32` nearest to 0.04.
pub(super) fn number(value: f64) -> String {
    rounded(value)
}

/// A measured number with at most four significant digits, such as 0.004021.
pub(super) fn measured(value: f64) -> String {
    significant(value, 4)
}

/// A fraction in percent with at most three significant digits, such as 7.7 %.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 3))
}

/// A time in seconds, rounded as people write it: `40 s`, `2 min 30 s` or `3 h 5 min`.
pub(super) fn duration(seconds: f64) -> String {
    let whole = seconds.round().max(0.0) as u64;
    let (hours, minutes) = (whole / 3600, whole / 60 % 60);
    match (hours, minutes) {
        (0, 0) if whole < 10 => format!("{} s", significant(seconds, 2)),
        (0, 0) => format!("{whole} s"),
        (0, _) => format!("{minutes} min {} s", whole % 60),
        _ => format!("{hours} h {minutes} min"),
    }
}

/// List of numbers in brackets. Each number is written as [`number`] writes it.
pub(super) fn list(values: &[f32]) -> String {
    rounded_list(values)
}

/// Text with the number of detected window panes; `None` without panes.
pub(super) fn panes(number: u64) -> Option<String> {
    (number > 0).then(|| format!("{}, light passes straight", count(number, "pane")))
}

/// Prints `words` to the standard output. Control characters are escaped, because names may have
/// them.
pub(super) fn print(words: Arguments) {
    print_bytes(escaped(&words.to_string()).as_bytes());
}

/// Prints bytes to the standard output. If this fails, the command continues, and [`finish`]
/// reports the error.
pub(super) fn print_bytes(bytes: &[u8]) {
    remember(io::stdout().lock().write_all(bytes));
}

/// Prints `words` to the standard error. Control characters are escaped, because names may have
/// them. Errors are ignored, because they cannot be printed.
pub(super) fn print_error(words: Arguments) {
    let _ = io::stderr().lock().write_all(escaped(&words.to_string()).as_bytes());
}

/// Flushes the standard output. Returns an error if a part could not be written.
pub(super) fn finish() -> io::Result<()> {
    remember(io::stdout().lock().flush());
    let lost = LOST.lock().unwrap_or_else(PoisonError::into_inner).take();
    lost.map_or(Ok(()), Err)
}

/// Stores the first error. A reader that stops early (`embrasure info SCENE | head`) is not an
/// error.
pub(super) fn remember(written: io::Result<()>) {
    if let Err(error) = written.map_err(|error| (error.kind() != io::ErrorKind::BrokenPipe).then_some(error)) {
        let mut lost = LOST.lock().unwrap_or_else(PoisonError::into_inner);
        *lost = lost.take().or(error);
    }
}

/// `text` with control characters escaped as in JSON: `\u001b`. Names may have control characters,
/// and terminals execute these characters. Line breaks and tabs are kept.
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

/// Returns true for characters that reverse the following text on a terminal, and so disguise names
/// (Boucher and Anderson 2021, "Trojan Source").
fn is_bidi_control(c: char) -> bool {
    matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// Prints the error that ends a command.
pub(super) fn error(text: impl Display) {
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{ERROR}error:{ERROR:#} {text}");
}

/// Prints a warning.
pub(super) fn warning(text: impl Display) {
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{WARNING}warning:{WARNING:#} {text}");
}

/// Hides all notes from now on, for `--quiet`.
pub(super) fn hide_notes() {
    HIDES_NOTES.store(true, Ordering::Relaxed);
}

/// Prints a note: an assumption that changes the picture.
pub(super) fn note(text: impl Display) {
    if HIDES_NOTES.load(Ordering::Relaxed) {
        return;
    }
    let text = escaped(&text.to_string());
    let _ = writeln!(anstream::stderr(), "{NOTE}note:{NOTE:#} {text}");
}

/// Returns true if the standard error shows colours: on a terminal with colours, unless `NO_COLOR`,
/// `CLICOLOR` or `CLICOLOR_FORCE` decide otherwise (<https://no-color.org>,
/// <https://bixense.com/clicolors>).
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
    fn durations_are_written_for_people() {
        let written = [0.123, 9.4, 40.4, 150.0, 11_100.0].map(duration);
        assert_eq!(written, ["0.12 s", "9.4 s", "40 s", "2 min 30 s", "3 h 5 min"]);
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
