//! Arguments of `embrasure man`.

use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure man | man -l -
  mkdir -p ~/.local/share/man/man1 && embrasure man -o ~/.local/share/man/man1")]
pub(in crate::cli) struct ManArgs {
    /// Write embrasure.1 and a page for each command to this folder
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}
