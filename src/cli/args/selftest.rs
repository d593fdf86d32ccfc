//! Arguments of `embrasure selftest`.

use super::flags::NameParser;
use crate::options::Backend;
use clap::Parser;

#[derive(Debug, Parser)]
#[command(after_help = "\
Each case renders a small scene whose answer is known exactly, and compares the result with it. The
exit code is 1 if a case is wrong.
Examples:
  embrasure selftest
  embrasure selftest --full --backend obvhs
  embrasure selftest --json")]
pub(in crate::cli) struct SelftestArgs {
    /// Run only the cases that take seconds (the default)
    #[arg(long, conflicts_with = "full")]
    pub quick: bool,

    /// Run all cases, also those that compare integrators
    #[arg(long)]
    pub full: bool,

    /// Test this ray-tracing backend only [default: all that are built in, except brute]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
