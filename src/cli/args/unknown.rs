//! Advice for unknown flags: the known flag to write instead.
//!
//! Users of other renderers write the flags that they know. A table translates these flags, because
//! the most similar flag here may have another meaning. For example, the flag most similar to
//! `--engine` is `--origin`.

use crate::options::nearest;
use clap::Command;

/// Flags of other renderers, and equivalent flags here with a typical value. The error suggests the
/// first of the equivalent flags that the command has.
const ELSEWHERE: &[(&[&str], &[&str])] = &[
    (
        &["--width", "--height", "--resolution", "--res", "-w", "-r"],
        &["--size 640x480"],
    ),
    (
        &["--sample-count", "--samples-per-pixel", "--nsamples", "-s", "-n"],
        &["--spp 64"],
    ),
    (
        &["--bounces", "--max-bounces", "--depth", "--path-depth"],
        &["--max-depth 8"],
    ),
    (&["--eye", "--from"], &["--position 0,1,5 --look-at 0,1,0"]),
    (&["--target", "--lookat"], &["--look-at 0,1,0"]),
    (&["--engine", "--method", "--algorithm"], &["--integrator bdpt"]),
    (&["--out", "--outfile", "--file"], &["--output picture.png"]),
    (&["--nthreads", "--cores", "--jobs", "-t", "-j"], &["--threads 4"]),
    (&["--envmap", "--environment", "--hdri", "--hdr"], &["--env sky.hdr"]),
    (&["--denoiser"], &["--denoise"]),
    (&["--noise-threshold", "--error"], &["--noise 0.01"]),
    (&["--timeout", "--time"], &["--time-limit 60s", "--time 1s,4s"]),
    (&["--gamma", "--tonemap", "--tonemapper"], &["--tone agx"]),
    (&["--ev"], &["--exposure 1"]),
    (
        &["--transparent", "--alpha", "--film-transparent"],
        &["--background transparent"],
    ),
    (&["--light", "--lights", "--lamp", "--sunlight"], &["--sun -45,40"]),
    (
        &["--mask", "--masks", "--mattes"],
        &["--matte 'Sofa*'", "--aov cryptomatte"],
    ),
    (
        &["--wireframe", "--edges", "--outline", "--outlines"],
        &["--lines black"],
    ),
];

/// Known flag of `command` that the user probably means by the unknown flag `flag`.
pub(super) fn advice(command: &Command, flag: &str) -> Option<String> {
    let flags: Vec<String> = command
        .get_arguments()
        .filter(|arg| !arg.is_hide_set())
        .filter_map(|arg| arg.get_long().map(|long| format!("--{long}")))
        .collect();
    let has = |known: &str| flags.iter().any(|flag| known.split(' ').next() == Some(flag));
    match ELSEWHERE.iter().find(|(theirs, _)| theirs.contains(&flag)) {
        Some((_, ours)) => ours.iter().find(|known| has(known)).map(|known| known.to_string()),
        None => nearest(flag, flags.iter().map(String::as_str)).map(String::from),
    }
}

/// Names of the commands of `program` that have the flag `flag`.
pub(super) fn commands_with(program: &Command, flag: &str) -> Vec<String> {
    let long = flag.strip_prefix("--");
    let has = |command: &&Command| {
        let mut args = command.get_arguments().filter(|arg| !arg.is_hide_set());
        long.is_some() && args.any(|arg| arg.get_long() == long)
    };
    let commands = program.get_subcommands().filter(has);
    commands
        .map(|command| format!("`{}`", command.get_name()))
        .take(3)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::Args;

    fn refusal(line: &str) -> String {
        let words = line.split(' ').map(String::from);
        Args::of(words).unwrap_err().to_string()
    }

    #[test]
    fn unknown_flag_suggests_the_known_flag() {
        for (line, expected) in [
            (
                "embrasure render a.obj --width 640",
                "render has no flag --width\n  help: did you mean --size 640x480?",
            ),
            (
                "embrasure render a.obj --eye 1,2,3",
                "did you mean --position 0,1,5 --look-at 0,1,0?",
            ),
            ("embrasure render a.obj -s 4", "did you mean --spp 64?"),
            ("embrasure render a.obj --sampels 4", "did you mean --samples?"),
            ("embrasure lab a.obj --depth=3", "did you mean --max-depth 8?"),
            ("embrasure develop a.exr --tonemap agx", "did you mean --tone agx?"),
            (
                "embrasure render a.obj --transparent",
                "did you mean --background transparent?",
            ),
            (
                "embrasure render a.obj --camera front",
                "for a side of the scene use --view front",
            ),
            (
                "embrasure check a.obj --projection panorama",
                "it is a flag of `render`",
            ),
            (
                "embrasure models/a.obj",
                "did you mean `embrasure render models/a.obj`?",
            ),
        ] {
            let words = refusal(line);
            assert!(words.contains(expected), "{line}: {words}");
        }
        // No advice for texts without a similar flag, or for flags of other commands.
        for line in ["embrasure render a.obj --xyzzy", "embrasure info a.obj --bounces 3"] {
            let words = refusal(line);
            assert!(
                !words.contains("did you mean") && words.contains("lists all flags"),
                "{words}"
            );
        }
    }

    /// All advised flags are valid flags of `render`, `lab` or `develop` with valid values.
    #[test]
    fn advice_can_be_followed() {
        for ours in ELSEWHERE.iter().flat_map(|(_, ours)| *ours) {
            let commands = ["render a.obj", "lab a.obj -o x", "develop a.exr -o a.png"];
            let takes = |command: &str| Args::of(format!("embrasure {command} {ours}").split(' ')).is_ok();
            assert!(commands.into_iter().any(takes), "{ours}");
        }
        // The flags of other renderers do not exist here.
        let program = Args::program();
        for theirs in ELSEWHERE.iter().flat_map(|(theirs, _)| *theirs) {
            let long = theirs.strip_prefix("--");
            let render = program.find_subcommand("render").unwrap();
            assert!(
                render
                    .get_arguments()
                    .all(|arg| long.is_none() || arg.get_long() != long),
                "{theirs}"
            );
        }
    }
}
