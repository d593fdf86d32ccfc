//! Arguments of the program, with a module for each command. `camera`, `exr`, `ground`, `light` and
//! `load` have arguments of several commands. `flags` makes the flags of [`crate::options`], and
//! `values` parses values.

mod audit;
mod bench;
mod camera;
mod compare;
mod completions;
mod develop;
mod explain;
mod exr;
mod flags;
mod ground;
mod headings;
mod help;
mod init;
mod lab;
mod light;
mod load;
mod man;
mod merge;
mod paths;
mod points;
mod refusals;
mod render;
mod scene;
mod selftest;
mod unknown;
mod values;
#[cfg(feature = "view")]
mod view;
mod views;

pub(super) use audit::AuditArgs;
pub(super) use bench::BenchArgs;
pub(super) use camera::CameraArgs;
pub(super) use compare::{CompareArgs, Map};
pub(super) use completions::CompletionsArgs;
pub(super) use develop::{DevelopArgs, Scale};
pub(super) use explain::ExplainArgs;
pub(super) use flags::Flags;
pub(super) use help::HelpArgs;
pub(super) use init::InitArgs;
pub(super) use lab::{LabArgs, MethodFlag};
pub(super) use load::LoadArgs;
pub(super) use man::ManArgs;
pub(super) use merge::MergeArgs;
pub(super) use paths::PathsArgs;
pub(super) use points::{PointSet, PointsArgs};
pub(super) use render::RenderArgs;
pub(super) use scene::{CheckArgs, SceneArgs};
pub(super) use selftest::SelftestArgs;
#[cfg(feature = "view")]
pub(super) use view::ViewArgs;
pub(super) use views::ViewsArgs;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;

/// A path tracer over Intel Embree.
#[derive(Debug, Parser)]
#[command(
    name = "embrasure",
    disable_version_flag = true,
    disable_help_subcommand = true,
    arg_required_else_help = true
)]
#[command(after_help = "\
Examples:
  embrasure render chair.obj -o chair.png
  embrasure render scenes/cornell-box.toml -o box.exr -o box.png
  embrasure check room.obj
  embrasure render --help       the usual flags; -h: the most important ones
  embrasure help camera         a page of the guide; embrasure help lists all")]
pub(super) struct Args {
    /// Print version, backends built in, and the instruction set in use
    #[arg(short = 'V', long)]
    pub version: bool,

    #[command(subcommand)]
    pub command: Option<Command>,
}

impl Args {
    /// The program with all its commands and grouped flags, for `embrasure help`.
    pub fn program() -> clap::Command {
        headings::with_groups(headings::full(headings::grouped(Self::command())))
    }

    /// Parses the arguments of the process.
    pub fn of_process() -> Result<Self, clap::Error> {
        Self::of(std::env::args_os())
    }

    /// Parses `words`. A flag with a value also accepts a negative number, so that its own parser
    /// reports an invalid value. By default, clap would treat `-1` as a flag and suggest `-- -1`.
    pub fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let negative = |arg: clap::Arg| {
            if arg.get_action().takes_values() && arg.get_long().is_some() {
                arg.allow_negative_numbers(true)
            } else {
                arg
            }
        };
        let words = with_values(words.into_iter().map(Into::into));
        let has = |wanted: &str| words.iter().any(|word| word == wanted);
        let program = if has("-h") {
            headings::with_groups(headings::brief(headings::grouped(Self::command())))
        } else if has("--help") || has("help") || words.len() < 2 {
            headings::usual(Self::program())
        } else {
            // Without help, flags need no groups. Grouping the flags of all commands takes 10 ms
            Self::command()
        };
        let mut command = program.mut_subcommands(|command| command.mut_args(negative));
        let text = words
            .iter()
            .map(|word| word.to_string_lossy().into_owned())
            .collect::<Vec<_>>();
        let matches = command.try_get_matches_from_mut(words);
        let explained = |error| refusals::explained(error, &command, &text);
        let matches = matches.map_err(explained)?;
        Self::from_arg_matches(&matches).map_err(explained)
    }
}

/// Joins `--denoise NAME` in `words` to `--denoise=NAME`, and `--key-light STRENGTH` likewise. The
/// values of these flags are optional, so clap would read a separate value as the scene. A word
/// after `--denoise` is the name of a denoiser if it has no `.`, because each scene has a `.` in
/// its name. A word after `--key-light` is a strength if it is a number.
fn with_values(words: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let is_filter = |word: &str| !word.is_empty() && !word.starts_with('-') && !word.contains(['.', '/', '\\']);
    let is_number = |word: &str| word.parse::<f32>().is_ok();
    let mut joined: Vec<OsString> = Vec::new();
    let mut is_over = false;
    for word in words {
        let is_value = |flag: &OsString| match (flag.to_str(), word.to_str()) {
            (Some("--denoise"), Some(word)) => is_filter(word),
            (Some("--key-light"), Some(word)) => is_number(word),
            _ => false,
        };
        match joined.last_mut().filter(|last| !is_over && is_value(last)) {
            Some(flag) => {
                flag.push("=");
                flag.push(word);
            }
            None => {
                is_over |= word == "--";
                joined.push(word);
            }
        }
    }
    joined
}

#[derive(Debug, Subcommand)]
pub(super) enum Command {
    /// Render a scene to EXR and PNG files
    Render(Box<RenderArgs>),
    /// Render one scene by several methods, and compare their errors and times
    Lab(Box<LabArgs>),
    /// Check a ray-tracing backend against another one, ray by ray
    Audit(AuditArgs),
    /// Measure ray rates and the cost of a render, backend by backend
    Bench(BenchArgs),
    /// Join parts of a render, sample ranges or crops: bit-identical to a single render
    Merge(MergeArgs),
    /// Make pictures from an EXR file: exposure, tone, denoising, any channel, crop and scale
    Develop(DevelopArgs),
    /// List the contents of a scene: meshes, triangles, materials, lights, bounds, memory
    #[command(after_help = "\
Examples:
  embrasure info scenes/cornell-box.toml
  embrasure info room.obj --json")]
    Info(SceneArgs),
    /// Show a render in a browser: move the camera, edit materials, inspect paths
    #[cfg(feature = "view")]
    View(Box<ViewArgs>),
    /// Show cameras to choose from, each with its flags
    Views(ViewsArgs),
    /// Write a commented scene file for an OBJ: camera, light, exposure, every material
    Init(Box<InitArgs>),
    /// Report errors, warnings and assumptions about a scene, each at file:line:column
    #[command(after_help = "\
The exit code is 1 if there is an error; warnings and notes give 0.
Examples:
  embrasure check scenes/cornell-box.toml
  embrasure check room.obj --json")]
    Check(CheckArgs),
    /// Describe how a material reflects light, and render a sphere of it
    Explain(ExplainArgs),
    /// Record the paths of a pixel: vertices, densities, weights, contributions
    Paths(Box<PathsArgs>),
    /// Show the points of a sampler: projections, discrepancy, convergence of known integrals
    Points(PointsArgs),
    /// Measure the difference between an image and a reference, and test it against noise
    Compare(CompareArgs),
    /// Render cases whose answers are known exactly, and report which are right
    Selftest(SelftestArgs),
    /// Print the completion script for a shell
    Completions(CompletionsArgs),
    /// Print the manual page, or write the pages of all commands
    Man(ManArgs),
    /// Print the help of a command, a page of the reference, or the meaning of a code of `check`
    Help(HelpArgs),
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Exposure;
    use crate::options::{Input, IntegratorOptions, OptionGroup, Value};

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn negative_coordinates_are_values() {
        let args = Args::try_parse_from(["embrasure", "render", "s.obj", "--position", "-1,2,-3"]).unwrap();
        let Some(Command::Render(args)) = args.command else {
            panic!()
        };
        assert_eq!(args.camera.0.position, Some([-1.0, 2.0, -3.0].into()));
    }

    /// A negative number is a value, and its error names the reason.
    #[test]
    fn negative_numbers_are_values() {
        let of = |flags: &str| Args::of(["embrasure", "render", "s.obj"].into_iter().chain(flags.split(' ')));
        let said = of("--photons -1").unwrap_err().to_string();
        assert!(said.contains("--photons -1") && !said.contains("-- -1"), "{said}");
        let said = of("--photon-radius -1").unwrap_err().to_string();
        assert!(
            said.contains("--photon-radius -1\n  help: use a number above 0"),
            "{said}"
        );
        let Some(Command::Render(args)) = of("--exposure -1 -q --noise -0.5").unwrap().command else {
            panic!()
        };
        assert_eq!(
            (args.tone.0.exposure, args.noise, args.quiet),
            (Some(Exposure::Stops(-1.0)), Some(-0.5), true)
        );
    }

    /// The name of a denoiser may follow `--denoise` with or without `=`, before or after the
    /// scene. `--denoise` is also valid without a name.
    #[test]
    fn denoisers_are_named_either_way() {
        for (line, expected) in [
            ("s.obj --denoise gaussian -q", "gaussian"),
            ("--denoise gaussian s.obj", "gaussian"),
            ("--denoise=atrous s.obj", "atrous"),
            ("--denoise s.obj", "oidn"),
            ("s.obj --denoise", "oidn"),
            ("s.obj --denoise -q", "oidn"),
            ("--denoise -- s.obj", "oidn"),
        ] {
            let args = Args::of(["embrasure", "render"].into_iter().chain(line.split(' '))).unwrap();
            let Some(Command::Render(args)) = args.command else {
                panic!()
            };
            assert_eq!(
                (args.sampling.0.denoise().text().as_str(), args.scene.to_str()),
                (expected, Some("s.obj")),
                "{line}"
            );
        }
    }

    /// Defaults in the help are valid values.
    #[test]
    fn defaults_in_the_help_are_taken() {
        let mut command = Args::program();
        let render = command.find_subcommand_mut("render").unwrap();
        let help = render.render_long_help().to_string();
        let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
        for parameter in IntegratorOptions::PARAMETERS {
            let flag = parameter.flag();
            let text = help.split(&format!("--{flag} <")).nth(1).unwrap();
            assert!(text.contains("[default: "), "{flag}");
            let default = text
                .split("[default: ")
                .nth(1)
                .unwrap()
                .split([']', ';'])
                .next()
                .unwrap();
            // A default with a blank is no value, because it depends on the scene.
            if !parameter.default().contains(' ') {
                let mut options = IntegratorOptions::default();
                let read = options.set(parameter.key, Input::Flag(default));
                assert_eq!(read, Some(Ok(())), "--{flag} {default}");
            }
        }
    }
}
