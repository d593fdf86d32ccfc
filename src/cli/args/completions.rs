//! Arguments of `embrasure completions`.

use clap::Parser;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure completions bash > ~/.local/share/bash-completion/completions/embrasure
  embrasure completions fish > ~/.config/fish/completions/embrasure.fish
  embrasure completions zsh > /usr/local/share/zsh/site-functions/_embrasure")]
pub(in crate::cli) struct CompletionsArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}
