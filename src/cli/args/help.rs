//! Arguments of `embrasure help`.

use crate::cli::reference::{TOPICS, codes};
use crate::options::nearest;
use clap::Parser;
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::{Error, ErrorKind};
use std::ffi::OsStr;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure help render
  embrasure help mtl
  embrasure help missing-texture")]
pub(in crate::cli) struct HelpArgs {
    /// A command, a page of the reference (without a topic, all are listed), or a code that `check` reports
    #[arg(value_parser = TopicParser, hide_possible_values = true)]
    pub topic: Option<String>,
}

/// Takes the name of a topic. Shells complete the names; there are too many of them to list in a refusal.
#[derive(Clone)]
struct TopicParser;

/// Names of all topics.
fn topics() -> impl Iterator<Item = &'static str> {
    let pages = TOPICS.iter().flat_map(|topic| topic.names).copied();
    super::COMMANDS.iter().copied().chain(pages).chain(codes())
}

impl TypedValueParser for TopicParser {
    type Value = String;

    fn parse_ref(&self, _: &clap::Command, _: Option<&clap::Arg>, value: &OsStr) -> Result<String, Error> {
        let name = value.to_string_lossy();
        if topics().any(|topic| topic == name) {
            return Ok(name.into_owned());
        }
        let near = nearest(&name, topics()).map_or(String::new(), |near| format!("did you mean {near}? "));
        let refusal = format!("no topic is called `{name}`\n  help: {near}`embrasure help` lists all topics\n");
        Err(Error::raw(ErrorKind::ValueValidation, refusal))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(topics().map(PossibleValue::new)))
    }
}
