//! `embrasure man`: manual pages from the text of `--help`.

use super::args::{Args, ManArgs};
use super::error::CliError;
use super::printing::print_bytes;
use crate::files::Output;
use clap::Command;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};
use std::io::{self, Write};
use std::process::ExitCode;

/// Writes a page for the program and a page for each command to a folder, or prints the page of the
/// program.
pub(super) fn man(args: &ManArgs) -> Result<ExitCode, CliError> {
    // `build` sets the full names of commands, such as `embrasure-render`.
    let mut program = Args::program();
    program.build();
    let Some(folder) = &args.output else {
        print_bytes(&page(&program)?);
        return Ok(ExitCode::SUCCESS);
    };
    for command in std::iter::once(&program).chain(program.get_subcommands()) {
        let text = page(command)?;
        let name = format!("{}.1", command.get_display_name().unwrap_or(command.get_name()));
        Output::prepare(folder.join(name))?.write(|w| w.write_all(&text))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// The page of a command, in roff.
fn page(command: &Command) -> Result<Vec<u8>, CliError> {
    write_page(command).map_err(|e| CliError::Failed(format!("cannot make the manual page: {e}")))
}

fn write_page(command: &Command) -> io::Result<Vec<u8>> {
    let mut page = Vec::new();
    let man = Man::new(command.clone())
        .source(concat!("embrasure ", env!("CARGO_PKG_VERSION")))
        .manual("Embrasure");
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if command.has_subcommands() {
        man.render_subcommands_section(&mut page)?;
    }
    // Keep the lines of the examples. The section that clap_mangen makes would join them.
    if let Some(words) = command.get_after_help() {
        let mut section = Roff::new();
        section.control("SH", ["NOTES AND EXAMPLES"]).control("nf", []);
        for line in words.to_string().lines() {
            section.text([roman(line)]);
        }
        section.control("fi", []).to_writer(&mut page)?;
    }
    Ok(page)
}
