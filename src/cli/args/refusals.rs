//! Errors of arguments, in the words of this program.
//!
//! clap names the error and prints the usage, which does not help if a command has a hundred flags.
//! This module takes flags and values from the error contexts of clap, and adds the remedy. Errors
//! of our own value parsers are printed without the words that clap adds.

use super::unknown;
use clap::Command;
use clap::error::{ContextKind, ContextValue, Error, ErrorKind};

/// Returns `error` of clap in the words of this program. `program` has all commands and flags.
/// `words` are all arguments, with the name of the program first. Help and version are returned
/// unchanged.
pub(super) fn explained(error: Error, program: &Command, words: &[String]) -> Error {
    let command = words.iter().skip(1).find_map(|word| program.find_subcommand(word));
    let name = command.map_or("embrasure".into(), |command| command.get_name().to_string());
    let lists = match command {
        Some(_) => format!("`embrasure {name} --help` lists all flags"),
        None => "`embrasure --help` lists all commands".into(),
    };
    let invalid = text(&error, ContextKind::InvalidArg);
    let value = text(&error, ContextKind::InvalidValue);
    let (message, help) = match error.kind() {
        ErrorKind::UnknownArgument if invalid.starts_with('-') => {
            let owners = unknown::commands_with(program, &invalid);
            if command.is_some() && !owners.is_empty() {
                let help = format!("it is a flag of {}; {lists}", owners.join(", "));
                (format!("{name} has no flag {invalid}"), help)
            } else {
                let near = command.and_then(|command| unknown::advice(command, &invalid));
                let meant = near.map_or(String::new(), |near| format!("did you mean {near}? "));
                (format!("{name} has no flag {invalid}"), format!("{meant}{lists}"))
            }
        }
        ErrorKind::UnknownArgument => surplus(&name, &invalid, &lists),
        ErrorKind::InvalidSubcommand => {
            let unknown = text(&error, ContextKind::InvalidSubcommand);
            let near = text(&error, ContextKind::SuggestedSubcommand);
            let is_scene = [".obj", ".toml"]
                .iter()
                .any(|end| unknown.to_lowercase().ends_with(end));
            let meant = if is_scene {
                format!("did you mean `embrasure render {unknown}`? ")
            } else if near.is_empty() {
                near
            } else {
                format!("did you mean {near}? ")
            };
            (format!("there is no command `{unknown}`"), format!("{meant}{lists}"))
        }
        ErrorKind::ArgumentConflict => match text(&error, ContextKind::PriorArg) {
            prior if prior.is_empty() || flag(&prior) == flag(&invalid) => {
                (format!("{} is given twice", flag(&invalid)), "give it once".into())
            }
            prior => (
                format!("{} cannot be used with {}", flag(&invalid), flags(&prior)),
                "leave one of them out".into(),
            ),
        },
        ErrorKind::MissingRequiredArgument => {
            let what = invalid.replace(['<', '>'], "");
            let has_camera = words
                .iter()
                .any(|word| word == "--camera" || word.starts_with("--camera="));
            let help = if what.starts_with("--cameras") && has_camera {
                "--camera chooses a camera of the file of --cameras; for a side of the scene use --view front".into()
            } else {
                lists
            };
            (format!("{name} needs {what}"), help)
        }
        ErrorKind::InvalidValue if value.is_empty() => {
            (format!("{} needs a value", flag(&invalid)), format!("write {invalid}"))
        }
        ErrorKind::InvalidValue => {
            let all = text(&error, ContextKind::ValidValue);
            (
                format!("{} {value}: there is no such value", flag(&invalid)),
                format!("choose among {all}"),
            )
        }
        ErrorKind::NoEquals => {
            let flag = flag(&invalid);
            (
                format!("{flag} takes its value after a `=`"),
                format!("write {flag}=VALUE"),
            )
        }
        // Our own value parsers describe the expected value.
        ErrorKind::ValueValidation if !invalid.is_empty() => (format!("{} {value}", flag(&invalid)), reason(&error)),
        ErrorKind::TooManyValues | ErrorKind::TooFewValues | ErrorKind::WrongNumberOfValues => (
            format!("{} {value}: the number of values is wrong", flag(&invalid)),
            format!("write {invalid}"),
        ),
        ErrorKind::InvalidUtf8 => (
            "an argument is not valid UTF-8".into(),
            "rename the file, or correct the text".into(),
        ),
        _ => return error,
    };
    Error::raw(error.kind(), format!("{message}\n  help: {help}\n"))
}

/// Reason why a parser rejects a value. Messages of Rust's number parsers are replaced, because
/// they speak of invalid digits and float literals.
fn reason(error: &Error) -> String {
    use std::num::{IntErrorKind, ParseFloatError, ParseIntError};
    let Some(source) = std::error::Error::source(error) else {
        return String::new();
    };
    match source.downcast_ref::<ParseIntError>().map(ParseIntError::kind) {
        Some(IntErrorKind::PosOverflow | IntErrorKind::NegOverflow) => "use a smaller number".into(),
        Some(_) => "use a whole number, 0 or more".into(),
        None if source.is::<ParseFloatError>() => "use a number".into(),
        None => source.to_string(),
    }
}

/// Message and help for an argument that `command` does not accept.
fn surplus(command: &str, value: &str, lists: &str) -> (String, String) {
    let takes_a_scene = matches!(
        command,
        "render" | "info" | "check" | "view" | "views" | "lab" | "bench" | "init"
    );
    let message = if takes_a_scene {
        format!("{command} takes one scene, and `{value}` is another one")
    } else {
        format!("{command} has no place for `{value}`")
    };
    let help = match command {
        "render" => {
            "for one picture of several OBJ files, write a scene file with an [[object]] for each; for a picture of each file, see `embrasure help batch`"
        }
        _ => lists,
    };
    (message, help.into())
}

/// Text of the context `kind` of `error`, such as the invalid flag. Several values are separated by
/// commas. Empty if the error has no such context.
fn text(error: &Error, kind: ContextKind) -> String {
    match error.get(kind) {
        Some(ContextValue::String(text)) => text.clone(),
        Some(ContextValue::Strings(texts)) => texts.join(", "),
        _ => String::new(),
    }
}

/// The flag of `written` without its value: `--view` for `--view <NAME>`, as clap writes it.
fn flag(written: &str) -> &str {
    written.split_once([' ', '=', '[']).map_or(written, |(flag, _)| flag)
}

/// Names of the flags in `written`, without their values. Flags are separated by commas.
fn flags(written: &str) -> String {
    let flags: Vec<&str> = written.split(", ").map(flag).collect();
    flags.join(", ")
}

#[cfg(test)]
mod tests {
    use crate::cli::args::Args;

    #[test]
    fn errors_have_our_words() {
        for (line, expected) in [
            (
                "render a.obj b.obj",
                "error: render takes one scene, and `b.obj` is another one\n  help: for one picture of several OBJ files, write a scene file with an [[object]] for each; for a picture of each file, see `embrasure help batch`",
            ),
            (
                "compare a.exr b.exr c.exr",
                "error: compare has no place for `c.exr`\n  help: `embrasure compare --help`",
            ),
            (
                "render a.obj --view top --position 0,0,1",
                "error: --view cannot be used with --position\n  help: leave one of them out",
            ),
            ("render a.obj -q -v", "error: --quiet cannot be used with --verbose\n"),
            ("render a.obj --spp 4 --spp 5", "error: --spp is given twice\n"),
            ("render", "error: render needs SCENE\n  help: `embrasure render --help`"),
            ("render a.obj --sample 2", "error: render needs --pixel X,Y\n"),
            (
                "render a.obj --size",
                "error: --size needs a value\n  help: write --size <WxH>",
            ),
            (
                "render a.obj --size 800",
                "error: --size 800\n  help: two whole numbers",
            ),
            ("render a.obj --env '#12'", "error: --env '#12'\n  help: "),
            ("render a.obj --tone agy", "error: --tone agy\n  help: "),
            (
                "render a.obj --threads x",
                "error: --threads x\n  help: use a whole number",
            ),
            (
                "rendr a.obj",
                "error: there is no command `rendr`\n  help: did you mean render?",
            ),
            (
                "render a.obj --width 640",
                "error: render has no flag --width\n  help: did you mean --size 640x480?",
            ),
            (
                "help cmaera",
                "error: unknown topic `cmaera`\n  help: did you mean camera?",
            ),
        ] {
            let said = Args::of(format!("embrasure {line}").split(' '))
                .unwrap_err()
                .to_string();
            assert!(said.starts_with(expected), "{line}: {said}");
            let voice = ["Usage:", "For more information", "invalid value", "argument '"];
            assert!(voice.iter().all(|words| !said.contains(words)), "{line}: {said}");
        }
    }

    /// Help and version are not errors.
    #[test]
    fn help_passes() {
        let help = Args::of(["embrasure", "render", "-h"]).unwrap_err();
        assert!(!help.use_stderr() && help.to_string().contains("Usage: "));
    }
}
