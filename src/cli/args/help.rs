//! Arguments of `embrasure help`.

use crate::cli::reference::{SCHEMA, TOPICS, codes};
use crate::options::nearest;
use clap::builder::{PossibleValue, TypedValueParser};
use clap::error::{Error, ErrorKind};
use clap::{CommandFactory, Parser};
use std::ffi::OsStr;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure help render
  embrasure help mtl
  embrasure help missing-texture
  embrasure help schema > scene.schema.json")]
pub(in crate::cli) struct HelpArgs {
    /// A command, a page of the reference, a code of `check`, or schema [default: list all]
    #[arg(value_parser = TopicParser, hide_possible_values = true)]
    pub topic: Option<String>,
}

/// Parser for the name of a topic. Shell completion offers the names. The error for an unknown name
/// does not list all names, because there are too many.
#[derive(Clone)]
struct TopicParser;

/// Names of all topics.
fn topics() -> Vec<String> {
    let program = super::Args::command();
    let commands = program.get_subcommands().map(|command| command.get_name().to_string());
    let pages = TOPICS.iter().flat_map(|topic| topic.names).copied();
    commands
        .chain(pages.chain(codes()).chain([SCHEMA]).map(String::from))
        .collect()
}

impl TypedValueParser for TopicParser {
    type Value = String;

    fn parse_ref(&self, _: &clap::Command, _: Option<&clap::Arg>, value: &OsStr) -> Result<String, Error> {
        let name = value.to_string_lossy();
        let topics = topics();
        if topics.iter().any(|topic| *topic == name) {
            return Ok(name.into_owned());
        }
        let near = nearest(&name, topics.iter().map(String::as_str))
            .map_or(String::new(), |near| format!("did you mean {near}? "));
        let refusal = format!("unknown topic `{name}`\n  help: {near}`embrasure help` lists all topics\n");
        Err(Error::raw(ErrorKind::ValueValidation, refusal))
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        Some(Box::new(topics().into_iter().map(PossibleValue::new)))
    }
}
