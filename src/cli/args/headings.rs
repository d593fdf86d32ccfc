//! Headings under which `--help` lists commands and flags, and the flags that `-h` shows.
//!
//! `-h` shows the first line of each help text. `--help` shows all lines, and
//! `embrasure help COMMAND` also shows rare flags. The headings of [`FIRST_TITLES`] come first, in
//! that order. Other headings are in the order of their first flags. Within a heading, flags are in
//! the order of the fields in `cli/args`, and parameters are in the order of their entries in
//! `options`.

use clap::builder::{Resettable, StyledStr};
use clap::{Arg, Command};

/// Groups of commands, as `--help` of the program lists them: the title and the commands of each
/// group.
const COMMANDS: [(&str, &[&str]); 4] = [
    (
        "Every day",
        &["render", "view", "views", "init", "info", "check", "help"],
    ),
    ("Pictures", &["develop", "compare"]),
    ("Farms and shells", &["merge", "completions", "man"]),
    (
        "Teaching and checking",
        &["lab", "explain", "paths", "points", "selftest", "audit", "bench"],
    ),
];

/// The program with its commands in groups.
pub(super) fn with_groups(program: Command) -> Command {
    let mut lists = String::new();
    for (title, names) in COMMANDS {
        lists += &format!("{title}:\n");
        // Skip commands that this build does not have.
        for command in names.iter().filter_map(|name| program.find_subcommand(name)) {
            let about = command.get_about().map_or(String::new(), ToString::to_string);
            lists += &format!("  {:<12}{about}\n", command.get_name());
        }
        lists.push('\n');
    }
    program.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{lists}Options:\n{{options}}{{after-help}}"
    ))
}

/// Groups of flags, for commands that load a scene: the title and the flags of each group. Other
/// flags are under "Options", or have their own heading.
const HEADINGS: [(&str, &[&str]); 6] = [
    (
        "Image",
        &[
            "scale",
            "dpi",
            "crop",
            "filter",
            "filter-radius",
            "background",
            "ground",
            "no-ground",
            "exposure",
            "tone",
        ],
    ),
    (
        "Materials and files",
        &[
            "material",
            "part",
            "set",
            "hide",
            "only",
            "cut",
            "cut-light",
            "cut-caps",
            "texture-dir",
            "texture-filter",
            "maps-by-name",
            "subdivide",
            "crease-angle",
            "displacement",
            "line-width",
            "vertex-colors",
            "vertex-color-space",
            "mtl-dialect",
            "obj-reader",
            "smooth",
            "panes",
            "strict",
        ],
    ),
    ("Sampling", &["seed", "sampler", "denoise-radius"]),
    (
        "Machine",
        &["backend", "threads", "max-memory", "compact", "audit-rays"],
    ),
    (
        "Further output",
        &[
            "lines-width",
            "lines-angle",
            "aov",
            "compression",
            "half",
            "write-every",
            "tev",
            "dump-scene",
            "write-cameras",
            "stats",
            "warnings",
        ],
    ),
    (
        "Parts and checkpoints",
        &["samples", "checkpoint", "checkpoint-interval", "resume"],
    ),
];

/// Groups of flags of single commands: command, title of the group, and flags. These entries
/// override [`HEADINGS`]. An empty title stands for "Options".
const HEADINGS_OF_COMMANDS: [(&str, &str, &[&str]); 8] = [
    // In `paths`, the flag `samples` means samples to record, not a part of a render
    ("paths", "", &["samples"]),
    (
        "develop",
        "Picture",
        &["exposure", "tone", "denoise", "denoise-radius", "crop", "scale"],
    ),
    ("develop", "EXR files", &["compression", "half"]),
    ("merge", "Picture", &["exposure", "tone"]),
    ("merge", "EXR files", &["compression", "half"]),
    ("merge", "Parts and checkpoints", &["checkpoint", "allow-gaps"]),
    ("audit", "Rays", &["rays", "replay", "size", "seed"]),
    ("audit", "Machine", &["backend", "against", "threads"]),
];

/// Flags that `-h` shows for every command that loads a scene, even if they are under a heading.
const BRIEF: [&str; 4] = ["view", "orbit", "material", "integrator"];

/// Flags that `-h` shows in addition to [`BRIEF`], for commands with many flags. For other commands
/// `-h` shows all flags that have no heading.
const BRIEF_OF_COMMANDS: [(&str, &[&str]); 5] = [
    (
        "render",
        &[
            "output",
            "size",
            "spp",
            "quality",
            "time-limit",
            "denoise",
            "exposure",
            "tone",
            "background",
            "env",
            "sun",
            "position",
            "smooth",
            "texture-dir",
        ],
    ),
    (
        "view",
        &[
            "port",
            "no-open",
            "compare",
            "reference",
            "size",
            "spp",
            "noise",
            "env",
            "sun",
        ],
    ),
    (
        "lab",
        &[
            "methods",
            "bounces",
            "spp",
            "time",
            "reference",
            "output",
            "html",
            "size",
            "max-depth",
        ],
    ),
    (
        "paths",
        &["pixel", "sample", "samples", "output", "json", "size", "spp"],
    ),
    (
        "develop",
        &[
            "output", "channel", "list", "json", "exposure", "tone", "denoise", "crop", "scale", "quiet",
        ],
    ),
];

/// Flags that `--help` leaves out, for commands that load a scene.
const RARE: [&str; 49] = [
    "aperture-blades",
    "aperture-rotation",
    "audit-rays",
    "camera",
    "cameras",
    "checkpoint-interval",
    "compact",
    "compression",
    "convergence",
    "crease-angle",
    "cut-caps",
    "cut-light",
    "denoise-radius",
    "displacement",
    "distortion",
    "dpi",
    "elevation",
    "eye-distance",
    "filter-radius",
    "fisheye-fov",
    "fisheye-mapping",
    "half",
    "intrinsics",
    "line-width",
    "lines-angle",
    "lines-width",
    "maps-by-name",
    "mtl-dialect",
    "obj-reader",
    "origin",
    "ortho-height",
    "panes",
    "plan",
    "pose",
    "scale",
    "sensor-height",
    "shift",
    "shutter",
    "stereo",
    "strict",
    "tev",
    "texture-filter",
    "unit",
    "vertex-color-space",
    "vertex-colors",
    "warnings",
    "write-cameras",
    "write-every",
    "yaw",
];

/// Parameters of integrators that `--help` shows. `--help` leaves out all others.
const USUAL_PARAMETERS: [&str; 4] = ["integrator", "max-depth", "clamp-indirect", "photons"];

/// Returns true if `--help` of a command that loads a scene leaves `arg` out.
fn is_rare(arg: &Arg) -> bool {
    let is_parameter = arg.get_help_heading() == Some(LAST_TITLE);
    arg.get_long()
        .is_some_and(|flag| RARE.contains(&flag) || is_parameter && !USUAL_PARAMETERS.contains(&flag))
}

/// Returns true if `command` loads a scene, and so has the flags of [`HEADINGS`].
fn loads_a_scene(command: &Command) -> bool {
    command.get_arguments().any(|arg| arg.get_long() == Some("texture-dir"))
}

/// Title of the group of `flag` in `command`. `None` if neither table has a group for the flag. The
/// flag then keeps its own heading, or is under "Options".
fn heading_of(command: &Command, flag: &str) -> Option<&'static str> {
    let of_command = HEADINGS_OF_COMMANDS
        .iter()
        .find(|(name, _, flags)| *name == command.get_name() && flags.contains(&flag));
    if let Some((_, heading, _)) = of_command {
        return Some(*heading).filter(|heading| !heading.is_empty());
    }
    let group = HEADINGS.iter().find(|(_, flags)| flags.contains(&flag));
    group.map(|(heading, _)| *heading).filter(|_| loads_a_scene(command))
}

/// Titles that `--help` lists first, in this order. [`LAST_TITLE`], the title of the integrators,
/// comes last.
const FIRST_TITLES: [&str; 4] = ["Camera", "Light", "Image", "Materials and files"];
const LAST_TITLE: &str = "Integrator";

/// The program with the flags of its commands in groups.
pub(super) fn grouped(program: Command) -> Command {
    program.mut_subcommands(|command| {
        let rank = |title: &str| match FIRST_TITLES.iter().position(|first| *first == title) {
            Some(rank) => rank,
            None if title == LAST_TITLE => usize::MAX,
            None => FIRST_TITLES.len(),
        };
        let of = |arg: &Arg| {
            let heading = heading_of(&command, arg.get_long()?);
            let title = heading.or(arg.get_help_heading())?;
            Some((rank(title), arg.get_id().clone(), heading))
        };
        let mut headings: Vec<_> = command.get_arguments().filter_map(of).collect();
        // Sort the flags by group, because `mut_arg` moves a flag to the end.
        headings.sort_by_key(|(rank, ..)| *rank);
        headings.into_iter().fold(command, |command, (_, id, heading)| {
            command.mut_arg(id, |arg| match heading {
                Some(heading) => arg.help_heading(heading),
                None => arg,
            })
        })
    })
}

/// The program for `--help`: without rare flags.
pub(super) fn usual(program: Command) -> Command {
    program.mut_subcommands(|command| {
        let count = command.get_arguments().filter(|arg| is_rare(arg)).count();
        if count == 0 || !loads_a_scene(&command) {
            return command;
        }
        let more = format!("embrasure help {} shows {count} rare flags too.", command.get_name());
        let more = with_examples(&command, more);
        command
            .mut_args(|arg| if is_rare(&arg) { arg.hide(true) } else { arg })
            .after_help(more)
    })
}

/// `words` followed by the examples of `command`.
fn with_examples(command: &Command, words: String) -> String {
    match command.get_after_help() {
        Some(examples) => format!("{words}\n\n{examples}"),
        None => words,
    }
}

/// The program with the complete help of each flag in one column. The long help of clap would have
/// three lines per flag.
pub(super) fn full(program: Command) -> Command {
    program.mut_subcommands(|command| {
        command.mut_args(|arg| match arg.get_long_help().map(StyledStr::to_string) {
            Some(text) => arg
                .help(text.replace("\n\n", "\n"))
                .long_help(Resettable::<StyledStr>::Reset),
            None => arg,
        })
    })
}

/// The program for `-h`: the most important flags with the first line of their help, and a hint to
/// the other flags.
pub(super) fn brief(program: Command) -> Command {
    program.mut_subcommands(|command| {
        let name = command.get_name().to_string();
        let flags = BRIEF_OF_COMMANDS.iter().find(|(of, _)| *of == name);
        if flags.is_none() && !loads_a_scene(&command) {
            return command;
        }
        let is_shown = |arg: &Arg| match (arg.get_long(), flags) {
            (Some(flag), _) if BRIEF.contains(&flag) => true,
            (Some(flag), Some((_, flags))) => flags.contains(&flag),
            (Some(_), None) => arg.get_help_heading().is_none(),
            (None, _) => true,
        };
        let is_more = |arg: &&Arg| !(is_shown(arg) || is_rare(arg) && loads_a_scene(&command));
        let count = command.get_arguments().filter(is_more).count();
        let more = with_examples(&command, format!("embrasure {name} --help shows {count} more flags."));
        command
            .mut_args(|arg| {
                if is_shown(&arg) {
                    arg.help_heading(None)
                } else {
                    arg.hide(true)
                }
            })
            .after_help(more)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::Args;
    use clap::CommandFactory;

    /// Every flag in the tables is a flag of its command. Every heading is used.
    #[test]
    fn headings_have_flags() {
        let program = Args::program();
        let flag = |command: &str, flag: &str| {
            let command = program.find_subcommand(command).unwrap();
            let arg = command.get_arguments().find(|arg| arg.get_long() == Some(flag));
            arg.unwrap_or_else(|| panic!("{} has no --{flag}", command.get_name()))
        };
        for (heading, flags) in HEADINGS {
            for name in flags {
                assert_eq!(flag("render", name).get_help_heading(), Some(heading), "{name}");
            }
        }
        for (command, heading, flags) in HEADINGS_OF_COMMANDS {
            for name in flags {
                let expected = Some(heading).filter(|heading| !heading.is_empty());
                assert_eq!(flag(command, name).get_help_heading(), expected, "{command} --{name}");
            }
        }
        for name in BRIEF {
            flag("render", name);
        }
        for (command, flags) in BRIEF_OF_COMMANDS
            .iter()
            .filter(|(command, _)| program.find_subcommand(command).is_some())
        {
            for name in *flags {
                flag(command, name);
            }
        }
    }

    /// Each command is in one group.
    #[test]
    fn commands_have_groups() {
        let program = Args::program();
        let mut grouped: Vec<&str> = COMMANDS.iter().flat_map(|(_, names)| *names).copied().collect();
        grouped.retain(|name| program.find_subcommand(name).is_some());
        let mut known: Vec<&str> = program.get_subcommands().map(Command::get_name).collect();
        grouped.sort_unstable();
        known.sort_unstable();
        assert_eq!(grouped, known);
        let help = Args::program().render_help().to_string();
        let places: Vec<usize> = COMMANDS
            .iter()
            .map(|(title, _)| help.find(&format!("{title}:\n  ")).unwrap())
            .collect();
        assert!(places.is_sorted(), "{help}");
    }

    /// Camera, light and image are the first groups of `render`, and the integrator is the last.
    #[test]
    fn render_begins_with_the_camera() {
        let mut program = Args::program();
        program.build();
        let help = program.find_subcommand_mut("render").unwrap().render_help().to_string();
        let titles: Vec<&str> = help
            .lines()
            .filter(|line| line.ends_with(':') && !line.starts_with(' ') && *line != "Examples:")
            .collect();
        let after_options: Vec<&str> = titles
            .iter()
            .copied()
            .skip_while(|title| *title != "Options:")
            .skip(1)
            .collect();
        assert_eq!(after_options[..3], ["Camera:", "Light:", "Image:"], "{titles:?}");
        assert_eq!(after_options.last(), Some(&"Integrator:"), "{titles:?}");
    }

    /// Fewer than 20 flags of a command have no heading. Commands with 12 or more flags have
    /// groups.
    #[test]
    fn long_helps_have_groups() {
        for command in Args::program().get_subcommands() {
            let flags = || command.get_arguments().filter(|arg| arg.get_long().is_some());
            let general = flags().filter(|arg| arg.get_help_heading().is_none()).count();
            assert!(
                general < 20,
                "{}: {general} flags without a heading",
                command.get_name()
            );
            if flags().count() >= 12 {
                assert!(general < flags().count(), "{} has no groups", command.get_name());
            }
        }
    }

    #[test]
    fn brief_help_is_a_screen_of_flags() {
        let mut program = brief(grouped(Args::command()));
        program.build();
        let names: Vec<String> = program.get_subcommands().map(|c| c.get_name().into()).collect();
        for name in names {
            let command = program.find_subcommand_mut(&name).unwrap();
            let help = command.render_help().to_string();
            // Continued lines are indented further.
            let is_flag = |line: &&str| line.starts_with("  -") || line.starts_with("      --");
            let flags = help.lines().filter(is_flag).count();
            assert!((1..=20).contains(&flags), "{name}: {flags}\n{help}");
            let is_cut = command.get_arguments().any(Arg::is_hide_set);
            assert_eq!(
                help.contains(&format!("embrasure {name} --help shows ")),
                is_cut,
                "{help}"
            );
        }
        let help = program.find_subcommand_mut("render").unwrap().render_help().to_string();
        for flag in [
            "--sun",
            "--background",
            "--tone",
            "--position",
            "--smooth",
            "--texture-dir",
        ] {
            assert!(help.contains(flag), "{flag}: {help}");
        }
        assert!(!help.contains("--photon-alpha"), "{help}");
    }

    /// `--help` of `render` has two screens of flags, and `embrasure help render` has all flags.
    /// The parser accepts rare flags too.
    #[test]
    fn rare_flags_are_left_out_of_the_help() {
        let flags = |mut program: Command| {
            program.build();
            let help = program.find_subcommand_mut("render").unwrap().render_help().to_string();
            let flag = |line: &str| line.split_once("--").map(|(_, flag)| flag.to_string());
            let lines = help
                .lines()
                .filter(|line| line.starts_with("  -") || line.starts_with("      --"));
            (lines.filter_map(flag).count(), help)
        };
        let [(usual, help), (all, _)] = [usual(Args::program()), Args::program()].map(flags);
        assert!(usual <= 60 && all > 90, "{usual} of {all}\n{help}");
        let more = format!("embrasure help render shows {} rare flags too.", all - usual);
        assert!(help.contains(&more) && help.contains("Examples:"), "{help}");
        assert!(help.contains("--photons") && !help.contains("--photon-alpha"), "{help}");
        for name in RARE.iter().chain(&USUAL_PARAMETERS) {
            let program = Args::program();
            let render = program.find_subcommand("render").unwrap();
            assert!(render.get_arguments().any(|arg| arg.get_long() == Some(name)), "{name}");
        }
        let line = "embrasure render a.obj --photon-alpha 0.5 --sensor-height 0.01 --f-stop 8 --half all";
        assert!(Args::of(line.split(' ')).is_ok());
    }

    /// `-h` shows the first line of a help text, `--help` all lines.
    #[test]
    fn help_is_brief_or_full() {
        let help = |mut program: Command| {
            program.build();
            let render = program.find_subcommand_mut("develop").unwrap();
            render.render_help().to_string()
        };
        let [short, long] = [brief(grouped(Args::command())), Args::program()].map(help);
        assert!(!short.contains("--half") && long.contains("float32"), "{long}");
        assert!(
            Args::program()
                .get_subcommands()
                .all(|command| command.get_arguments().all(|arg| arg.get_long_help().is_none()))
        );
    }
}
