//! Headings under which `--help` lists flags, and the dozen of them that `-h` shows.

use clap::{Arg, Command};

/// Flags of commands that load a scene, under the titles of their groups. Flags that are not here are under "Options", or say their heading themselves.
const HEADINGS: [(&str, &[&str]); 7] = [
    (
        "Image",
        &[
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
        "Camera",
        &[
            "view",
            "orbit",
            "position",
            "look-at",
            "up",
            "fov",
            "lens-radius",
            "f-stop",
            "sensor-height",
            "aperture-blades",
            "aperture-rotation",
            "focus-distance",
            "focus-at",
            "shutter",
        ],
    ),
    (
        "Materials and files",
        &[
            "material",
            "set",
            "texture-dir",
            "texture-filter",
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
            "aov",
            "compression",
            "half",
            "write-every",
            "tev",
            "dump-scene",
            "stats",
            "warnings",
        ],
    ),
    (
        "Parts and checkpoints",
        &["samples", "checkpoint", "checkpoint-interval", "resume"],
    ),
];

/// The flags of `render` that `-h` shows.
const BRIEF_OF_RENDER: [&str; 13] = [
    "output",
    "size",
    "spp",
    "noise",
    "time-limit",
    "denoise",
    "exposure",
    "view",
    "orbit",
    "env",
    "sun",
    "material",
    "integrator",
];

/// Flags below the headings that `-h` of other commands shows.
const BRIEF_OF_OTHERS: [&str; 4] = ["view", "orbit", "material", "integrator"];

/// Whether a command has the flags of [`HEADINGS`].
fn loads_a_scene(command: &Command) -> bool {
    command.get_arguments().any(|arg| arg.get_long() == Some("texture-dir"))
}

fn heading_of(flag: &str) -> Option<&'static str> {
    let group = HEADINGS.iter().find(|(_, flags)| flags.contains(&flag));
    group.map(|(heading, _)| *heading)
}

/// The program with the flags of its commands in groups.
pub(super) fn grouped(program: Command) -> Command {
    program.mut_subcommands(|command| {
        if !loads_a_scene(&command) {
            return command;
        }
        command.mut_args(|arg| match arg.get_long().and_then(heading_of) {
            Some(heading) => arg.help_heading(heading),
            None => arg,
        })
    })
}

/// The program as `-h` shows it: commands that load a scene list the flags that most people need, and say where the others are.
pub(super) fn brief(program: Command) -> Command {
    program.mut_subcommands(|command| {
        if !loads_a_scene(&command) {
            return command;
        }
        let name = command.get_name().to_string();
        let is_shown = |arg: &Arg| match arg.get_long() {
            Some(flag) if name == "render" => BRIEF_OF_RENDER.contains(&flag),
            Some(flag) => arg.get_help_heading().is_none() || BRIEF_OF_OTHERS.contains(&flag),
            None => true,
        };
        let hidden = command.get_arguments().filter(|arg| !is_shown(arg)).count();
        let examples = command
            .get_after_help()
            .map_or(String::new(), |words| format!("\n\n{words}"));
        let more = format!("embrasure {name} --help shows {hidden} more flags.{examples}");
        command
            .mut_args(|arg| match is_shown(&arg) {
                true => arg.help_heading(None),
                false => arg.hide(true),
            })
            .after_help(more)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::args::Args;

    #[test]
    fn headings_have_flags_of_render() {
        let program = Args::program();
        let render = program.find_subcommand("render").unwrap();
        for flag in HEADINGS.iter().flat_map(|(_, flags)| *flags).chain(&BRIEF_OF_RENDER) {
            let arg = render.get_arguments().find(|arg| arg.get_long() == Some(flag));
            let arg = arg.unwrap_or_else(|| panic!("render has no --{flag}"));
            assert_eq!(
                heading_of(flag).is_some(),
                HEADINGS.iter().any(|(title, _)| arg.get_help_heading() == Some(title))
            );
        }
        let general = render
            .get_arguments()
            .filter(|arg| arg.get_long().is_some() && arg.get_help_heading().is_none());
        assert!(general.count() < 20, "flags of render without a heading");
    }

    #[test]
    fn brief_help_is_a_dozen_flags() {
        let mut program = brief(Args::program());
        program.build();
        for (name, limit) in [("render", 14), ("info", 8), ("explain", 10), ("lab", 20)] {
            let help = program.find_subcommand_mut(name).unwrap().render_help().to_string();
            // Lines of a wrapped text are further to the right.
            let is_flag = |line: &&str| line.starts_with("  -") || line.starts_with("      --");
            let flags = help.lines().filter(is_flag).count();
            assert!((3..=limit).contains(&flags), "{name}: {flags}\n{help}");
            assert!(help.contains(&format!("embrasure {name} --help shows ")), "{help}");
        }
        let help = program.find_subcommand_mut("render").unwrap().render_help().to_string();
        assert!(help.contains("--sun") && !help.contains("--photon-alpha"), "{help}");
    }
}
