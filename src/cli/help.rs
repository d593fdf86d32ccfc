//! `embrasure help`: the help of a command, a page of the reference, the meaning of a code of
//! `check`, or the JSON Schema of scene files.

use super::args::{Args, HelpArgs};
use super::error::CliError;
use super::reference::{SCHEMA, TOPICS, Topic, meaning};
use crate::scene_file::schema_text;
use std::process::ExitCode;

/// Prints the requested help.
pub(super) fn help(args: &HelpArgs) -> Result<ExitCode, CliError> {
    let mut program = Args::program();
    program.build();
    let Some(topic) = args.topic.as_deref() else {
        outln!("{}", program.render_help());
        outln!("Pages of the guide (embrasure help PAGE):");
        for topic in TOPICS {
            outln!("  {:<12} {}", topic.names[0], topic.title());
        }
        outln!("\nembrasure help {SCHEMA} prints the JSON Schema of scene files, for editors.");
        outln!("embrasure help CODE explains a code of `embrasure check`.");
        return Ok(ExitCode::SUCCESS);
    };
    if let Some(command) = program.find_subcommand_mut(topic) {
        out!("{}", command.render_help());
    } else if topic == SCHEMA {
        out!("{}", schema_text());
    } else if let Some(page) = Topic::of(topic) {
        out!("{}", page.plain());
    } else if let Some(meaning) = meaning(topic) {
        out!("{meaning}");
    }
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::reference::codes;

    #[test]
    fn every_page_is_a_topic_of_its_own() {
        for topic in TOPICS {
            let text = topic.plain();
            assert!(text.starts_with(topic.title()), "{}", topic.names[0]);
            assert!(!text.contains("]("), "{}", topic.names[0]);
        }
        let names: Vec<&str> = TOPICS.iter().flat_map(|topic| topic.names).copied().collect();
        let program = Args::program();
        let mut all: Vec<&str> = names.into_iter().chain(codes()).chain([SCHEMA]).collect();
        all.extend(program.get_subcommands().map(|command| command.get_name()));
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count, "a name stands for two topics");
    }
}
