//! Makes command-line flags from the parameters in [`crate::options`].

use crate::options::{Input, IntegratorOptions, InvalidOption, Named, OptionGroup, Parameter, Value};
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::{Error, ErrorKind};
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use std::ffi::OsStr;
use std::marker::PhantomData;

/// The options of the group `G`, with the values of the flags.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::cli) struct Flags<G>(pub G);

impl<G: OptionGroup> Args for Flags<G> {
    fn augment_args(command: Command) -> Command {
        let flags = G::PARAMETERS.iter().filter(|parameter| parameter.has_flag());
        command.args(flags.map(|parameter| arg(parameter, G::HEADING)))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl<G: OptionGroup> FromArgMatches for Flags<G> {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, Error> {
        let mut group = G::default();
        for parameter in G::PARAMETERS.iter().filter(|parameter| parameter.has_flag()) {
            if let Some(text) = matches.get_one::<String>(&parameter.flag()) {
                if let Some(Err(invalid)) = group.set(parameter.key, Input::Flag(text)) {
                    return Err(refusal(&invalid));
                }
            }
        }
        Ok(Self(group))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

/// clap's definition of the flag of `parameter`, under the heading `heading`.
fn arg(parameter: &'static Parameter, heading: &'static str) -> Arg {
    let mut default = parameter.default();
    for (integrator, value) in IntegratorOptions::other_defaults(parameter.key) {
        default += &format!("; {integrator}: {value}");
    }
    let range = match parameter.range() {
        range if range.is_empty() => range,
        range => format!("; {range}"),
    };
    // Numbers of a list may be negative, so the value may begin with a hyphen.
    let is_list = parameter.schema()["type"] == "array";
    let arg = Arg::new(parameter.flag())
        .long(parameter.flag())
        .value_name(parameter.placeholder)
        .value_parser(TextParser(parameter))
        .allow_hyphen_values(is_list)
        .help(format!("{}{range} [default: {default}]", parameter.help()));
    let arg = match heading {
        "" => arg,
        heading => arg.help_heading(heading),
    };
    match parameter.bare {
        None => arg,
        Some(value) => arg.num_args(0..=1).require_equals(true).default_missing_value(value),
    }
}

/// Error for an invalid value of a flag, formatted like clap's errors.
fn refusal(InvalidOption { flag, value, help, .. }: &InvalidOption) -> Error {
    Error::raw(
        ErrorKind::ValueValidation,
        format!("--{flag} {value}\n  help: {help}\n"),
    )
}

/// Parser that accepts any text. Shell completion offers the values of the parameter.
/// [`OptionGroup::set`] reports invalid values later.
#[derive(Clone, Copy)]
struct TextParser(&'static Parameter);

impl TypedValueParser for TextParser {
    type Value = String;

    fn parse_ref(&self, _: &Command, _: Option<&Arg>, value: &OsStr) -> Result<String, Error> {
        Ok(value.to_string_lossy().into_owned())
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let names = self.0.names();
        (!names.is_empty()).then(|| Box::new(names.into_iter().map(PossibleValue::new)) as Box<_>)
    }
}

/// Parser for the name of a value. Shell completion offers the names.
#[derive(Clone, Copy)]
pub(in crate::cli) struct NameParser<T>(PhantomData<T>);

impl<T> NameParser<T> {
    pub fn new() -> Self {
        Self(PhantomData)
    }
}

impl<T: Named + Send + Sync> TypedValueParser for NameParser<T> {
    type Value = T;

    fn parse_ref(&self, _: &Command, arg: Option<&Arg>, value: &OsStr) -> Result<T, Error> {
        let name = value.to_string_lossy();
        T::of_text(name.trim()).ok_or_else(|| {
            let flag = arg
                .and_then(Arg::get_long)
                .map_or(String::new(), |flag| format!("--{flag} "));
            let known = T::names();
            let suggestion = crate::options::nearest(&name, known.iter().copied());
            let suggestion = suggestion.map_or(String::new(), |known| format!("did you mean {known}? "));
            let help = format!("{suggestion}choose among {}", known.join(", "));
            Error::raw(
                ErrorKind::ValueValidation,
                format!("{flag}{name}: unknown name\n  help: {help}\n"),
            )
        })
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(T::names().into_iter().map(PossibleValue::new)))
    }
}

/// Parses `text` as a value of the parameter type `T`.
pub(in crate::cli) fn value_parser<T: Value>(text: &str) -> Result<T, String> {
    T::of_text(text).ok_or_else(|| format!("use {}", T::KIND))
}
