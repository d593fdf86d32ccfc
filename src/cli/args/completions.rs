//! Arguments of `embrasure completions`.

use clap::Parser;

#[derive(Debug, Parser)]
#[command(after_help = "\
bash and zsh complete commands, flags and all values. fish completes commands, flags and the values
of flags. PowerShell and elvish complete commands and flags only, because the generator of their
scripts supports no values.
Examples:
  embrasure completions bash > ~/.local/share/bash-completion/completions/embrasure
  embrasure completions fish > ~/.config/fish/completions/embrasure.fish
  embrasure completions zsh > /usr/local/share/zsh/site-functions/_embrasure")]
pub(in crate::cli) struct CompletionsArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}
