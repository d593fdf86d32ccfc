//! `embrasure completions`: completion scripts for shells.

use super::args::{Args, CompletionsArgs};
use super::error::CliError;
use super::printing::print_bytes;
use clap::CommandFactory;
use std::process::ExitCode;

/// Prints the completion script of a shell.
pub(super) fn completions(args: &CompletionsArgs) -> Result<ExitCode, CliError> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Args::command(), "embrasure", &mut script);
    print_bytes(&script);
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Arg;
    use clap_complete::Shell;

    fn script(shell: Shell) -> String {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Args::command(), "embrasure", &mut script);
        String::from_utf8(script).unwrap()
    }

    /// Names of the values of a flag.
    fn names(arg: &Arg) -> Vec<String> {
        let values = arg.get_possible_values();
        values.iter().map(|value| value.get_name().to_string()).collect()
    }

    /// Scripts for bash, zsh and fish have the value names of every flag with named values.
    #[test]
    fn scripts_have_values_of_flags() {
        let [bash, zsh, fish] = [Shell::Bash, Shell::Zsh, Shell::Fish].map(script);
        let program = Args::command();
        let mut count = 0;
        for arg in program.get_subcommands().flat_map(|command| command.get_arguments()) {
            let (Some(flag), names) = (arg.get_long(), names(arg)) else {
                continue;
            };
            if names.is_empty() || !arg.get_action().takes_values() {
                continue;
            }
            let list = names.join(" ");
            let after = |script: &str, head: &str| script.split(head).skip(1).map(str::to_string).collect::<Vec<_>>();
            let has = |script: &str, head: &str, tail: &str| {
                let found = after(script, head);
                found.iter().any(|text| text.contains(tail))
            };
            assert!(
                has(&bash, &format!(" --{flag})"), &format!("compgen -W \"{list}\"")),
                "bash --{flag}"
            );
            assert!(has(&zsh, &format!("--{flag}=["), &format!("({list})")), "zsh --{flag}");
            let list = names.iter().map(|name| format!("{name}\\t''")).collect::<Vec<_>>();
            assert!(has(&fish, &format!(" -l {flag} "), &list.join("\n")), "fish --{flag}");
            count += 1;
        }
        assert!(count > 40, "{count} flags");
    }

    /// zsh separates the parts of a flag's description by colons, so a placeholder must not have a
    /// colon.
    #[test]
    fn placeholders_are_plain() {
        let program = Args::command();
        for arg in program.get_subcommands().flat_map(|command| command.get_arguments()) {
            let placeholders = arg.get_value_names().unwrap_or_default();
            let is_plain = placeholders.iter().all(|name| !name.contains(':'));
            assert!(is_plain, "{}: {placeholders:?}", arg.get_id());
        }
    }
}
