use super::camera_flags::CameraArgs;
use super::exr_args::ExrArgs;
use super::flags::{Flags, NameParser, value_parser};
use super::ground_args::GroundArgs;
use super::light_flags::LightFlags;
use super::values::{
    parse_address, parse_bytes, parse_chance, parse_duration, parse_folder, parse_level, parse_list, parse_range,
    parse_scene_output, parse_share, parse_size,
};
use super::warnings::ShownWarnings;
use crate::io::LoadParameters;
use crate::options::names::named;
use crate::options::{
    Backend, BackgroundOptions, FilterOptions, IntegratorKind, IntegratorOptions, MaxDepth, QualityOptions,
    SamplingOptions, ToneOptions,
};
use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use std::ffi::OsString;
use std::path::PathBuf;

/// A path tracer over Intel Embree.
#[derive(Debug, Parser)]
#[command(name = "embrasure", disable_version_flag = true, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  embrasure render scenes/cornell-box.toml -o box.exr -o box.png
  embrasure check room.obj
  embrasure help render")]
pub(super) struct Args {
    /// Print version, backends built in, and the instruction set in use
    #[arg(short = 'V', long)]
    pub version: bool,

    #[command(subcommand)]
    pub command: Option<Command>,
}

impl Args {
    /// What was typed.
    pub fn of_process() -> Result<Self, clap::Error> {
        Self::of(std::env::args_os())
    }

    /// The same of these words. Whatever flag takes a value takes a negative number too, and says itself why not: clap would call `-1` a flag, and
    /// advise to write `-- -1`.
    fn of(words: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let negative = |arg: clap::Arg| match arg.get_action().takes_values() && arg.get_long().is_some() {
            true => arg.allow_negative_numbers(true),
            false => arg,
        };
        let mut command = Self::command().mut_subcommands(|command| command.mut_args(negative));
        let words = with_values(words.into_iter().map(Into::into));
        let matches = command.try_get_matches_from_mut(words)?;
        // Refusals of values say what to write instead; the usage would say no more.
        Self::from_arg_matches(&matches).map_err(|e| match e.kind() {
            ErrorKind::ValueValidation => e,
            _ => e.format(&mut command),
        })
    }
}

/// `words` with `--denoise NAME` as `--denoise=NAME`, and `--key-light STRENGTH` likewise. These flags may stand alone, and clap would take the value for a
/// scene. A scene has a `.` in its name, a filter has none; a strength is a number.
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
    /// Render one scene by every estimator of the ladder, and compare them
    Lab(Box<LabArgs>),
    /// Check a ray-tracing backend against another one, ray by ray
    Audit(AuditArgs),
    /// Measure ray rates and the cost of a render, backend by backend
    Bench(BenchArgs),
    /// Join parts of a render, sample ranges or crops, to the bits of the whole
    Merge(MergeArgs),
    /// Make pictures of an EXR file: exposure, tone, denoising, any channel, crop and scale
    Develop(super::develop_args::DevelopArgs),
    /// Say what is in a scene: meshes, triangles, materials, lights, bounds, memory
    #[command(after_help = "\
Examples:
  embrasure info scenes/cornell-box.toml
  embrasure info room.obj --json")]
    Info(SceneArgs),
    /// Show cameras to choose from, each with the flags that give it
    Views(ViewsArgs),
    /// Write a commented scene file for an OBJ: camera, light, exposure, every material
    Init(InitArgs),
    /// Say what is wrong with a scene's files, and what is assumed: file:line:column
    #[command(after_help = "\
The exit code is 1 where something is wrong, 0 where there are warnings and notes alone.
Examples:
  embrasure check scenes/cornell-box.toml
  embrasure check room.obj --json")]
    Check(SceneArgs),
    /// Say what a material does with light, and render a sphere of it
    Explain(ExplainArgs),
    /// Say how far an image is from a reference, and whether by more than noise
    Compare(CompareArgs),
    /// Print the script that makes a shell complete commands and flags
    Completions(CompletionsArgs),
    /// Print the manual page, or write those of all commands
    Man(ManArgs),
}

#[derive(Debug, Parser)]
#[command(after_help = "\
The rays are those of a render. A disagreement is explained where the ray passes an edge, or a plane, or an end of its interval
more closely than roundings can tell; the exit code is 1 where one is not.
Examples:
  embrasure audit scenes/cornell-box.toml
  embrasure audit room.obj --rays 100000000 -o room-audit.json
  embrasure audit room.obj --replay room-audit.json")]
pub(super) struct AuditArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// About so many rays, spread evenly over the image
    #[arg(long, value_name = "N", default_value = "1000000")]
    pub rays: std::num::NonZeroU64,

    /// Check the rays of this report instead
    #[arg(long, value_name = "FILE", conflicts_with = "rays")]
    pub replay: Option<PathBuf>,

    /// Write the report here, as JSON
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// The ray-tracing backend to check
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// The one to check it against [default: another one that is built in]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub against: Option<Backend>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

/// Equal samples with --spp, equal time with --time.
#[derive(Debug, Parser)]
#[command(after_help = "\
Writes PREFIX.png (the pictures), PREFIX.csv and PREFIX.md (relMSE, seconds, efficiency = 1 / (relMSE x seconds)).
Without --reference one is made, by the last of the estimators that is unbiased and leaves no light out (path, naive, bdpt, pssmlt or mlt), with 64 times
its samples: that takes 64 times its time, with --time 10s some 11 minutes. Where it is interrupted, pictures and times are written without errors.
Examples:
  embrasure lab scenes/cornell-box.toml --size 256x256
  embrasure lab scenes/cornell-box.toml --size 256x256 --methods sppm,vcm,bdpt --spp 16
  embrasure lab scenes/veach-plates.toml --time 5s -o out/veach")]
pub(super) struct LabArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Integrators to compare instead of the ladder's estimators, such as path,bdpt,mlt,sppm: each as it is by default
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', value_parser = NameParser::<IntegratorKind>::new())]
    pub methods: Vec<IntegratorKind>,

    /// Samples a pixel of every estimator [default: 64]
    #[arg(long, value_name = "N", conflicts_with = "time")]
    pub spp: Option<u32>,

    /// Time for every estimator, such as 10s or 2m
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub time: Option<f64>,

    /// EXR to compare with [default: the picture of the last unbiased estimator at 64 times its samples, which takes 64 times as long]
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Name of the files without their extension [default: SCENE's stem + -lab]
    #[arg(short, long, value_name = "PREFIX")]
    pub output: Option<PathBuf>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Maximum number of scattering events; 0 shows emission alone, none is 1024 [default: 16]
    #[arg(long, value_name = "N", value_parser = value_parser::<MaxDepth>)]
    pub max_depth: Option<MaxDepth>,

    /// Seed of the random numbers [default: 0]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,

    /// Ray-tracing backend, of those built in
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Render and build threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Rays are those of a render with default settings. They are recorded, then traced again with nothing else in between:
`render / replay` is the cost of a render in units of its ray tracing.
Examples:
  embrasure bench scenes/cornell-box.toml
  embrasure bench scenes/cornell-box.toml bunny.obj --size 256x256 --json")]
pub(super) struct BenchArgs {
    /// .toml scene files or bare .obj files
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// This ray-tracing backend only [default: all that are built in, besides brute]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Size of the image in pixels [default: the scene's]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Measurements of which the median is taken
    #[arg(long, value_name = "N", default_value = "7")]
    pub repeat: std::num::NonZeroUsize,

    /// Threads, besides one [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Parts come from `render` with --samples, --crop or both, by -o or --checkpoint. They must be of one picture: the same scene, settings, seed,
program and backend; nothing may be missing or be there twice.
Examples:
  embrasure render room.toml --spp 512 --samples 0..256 -o a.exr
  embrasure render room.toml --spp 512 --samples 256..512 -o b.exr
  embrasure merge a.exr b.exr -o room.exr -o room.png
  embrasure merge a.exr b.exr --checkpoint ab.exr            (a part again, of many)")]
pub(super) struct MergeArgs {
    /// EXR files that hold parts
    #[arg(required = true, value_name = "PART")]
    pub parts: Vec<PathBuf>,

    /// Image to write, .exr (linear float32) or .png (display); repeatable
    #[arg(short, long, value_name = "FILE", required_unless_present = "checkpoint")]
    pub output: Vec<PathBuf>,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Keep the joined sums here, to join them further or to go on from them; without -o they may be a part of the samples
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Join what there is: pixels or samples may be missing, parts may be unfinished
    #[arg(long)]
    pub allow_gaps: bool,

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No summary
    #[arg(short, long)]
    pub quiet: bool,
}

/// A scene to look at.
#[derive(Debug, Parser)]
pub(super) struct SceneArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    #[command(flatten)]
    pub load: LoadArgs,

    #[command(flatten)]
    pub light: LightFlags,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
The file renders what the OBJ does. Materials are patches that are commented out, each with its numbers and textures.
Examples:
  embrasure init room.obj
  embrasure init models/room.obj -o scenes/room.toml")]
pub(super) struct InitArgs {
    /// A bare .obj
    pub scene: PathBuf,

    /// Scene file to write [default: SCENE's stem + .toml here]
    #[arg(short, long, value_name = "FILE", value_parser = parse_scene_output)]
    pub output: Option<PathBuf>,

    /// Replace a file that is there
    #[arg(long)]
    pub force: bool,

    #[command(flatten)]
    pub load: LoadArgs,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure views room.obj -o views.png
  embrasure render room.obj --orbit 30,20")]
pub(super) struct ViewsArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Write a contact sheet of the views here, a .png [default: the flags are printed alone]
    #[arg(short, long, value_name = "SHEET.png")]
    pub output: Option<PathBuf>,

    /// Size of each picture in pixels [default: 240x240]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Samples a pixel [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,

    /// The ray-tracing backend
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Render and build threads, 64 for each processor at most [default: one for each]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// No progress; warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub load: LoadArgs,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure explain scenes/cornell-box.toml red
  embrasure explain room.obj \"Window Glass\" -o glass.png --size 256x256")]
pub(super) struct ExplainArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Name of a material that the scene uses
    pub material: String,

    /// Render a sphere of it here, .exr or .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Samples a pixel of the sphere
    #[arg(long, value_name = "N", default_value = "64")]
    pub spp: std::num::NonZeroU32,

    /// Size of the sphere's image in pixels
    #[arg(long, value_name = "WxH", value_parser = parse_size, default_value = "512x512")]
    pub size: [u32; 2],

    /// Threads [default: all]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// No progress
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub load: LoadArgs,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure completions bash > ~/.local/share/bash-completion/completions/embrasure
  embrasure completions fish > ~/.config/fish/completions/embrasure.fish
  embrasure completions zsh > /usr/local/share/zsh/site-functions/_embrasure")]
pub(super) struct CompletionsArgs {
    /// The shell
    pub shell: clap_complete::Shell,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure man | man -l -
  mkdir -p ~/.local/share/man/man1 && embrasure man -o ~/.local/share/man/man1")]
pub(super) struct ManArgs {
    /// Write embrasure.1 and a page for each command to this folder
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
}

/// How files are read where their formats leave something open.
#[derive(Clone, Debug, Default, Parser)]
pub(super) struct LoadArgs {
    #[command(flatten)]
    pub parameters: Flags<LoadParameters>,

    /// Refuse to take more memory than this, such as 8G or 500M, before it is taken [default: what is available]
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub max_memory: Option<u64>,

    /// Set a key of the scene file, such as render.max_depth=8; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Change materials: a name or glob, a key and its value, such as 'Floor*.roughness=0.2'; repeatable
    #[arg(id = "patches", long = "material", value_name = "GLOB.KEY=VALUE")]
    pub patches: Vec<String>,

    /// Folder in which missing textures are looked for; repeatable
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub texture_dir: Vec<PathBuf>,

    /// Make missing and unreadable textures and material libraries errors
    #[arg(long)]
    pub strict: bool,

    /// Take less memory and more time; also done where only so --max-memory is kept
    #[arg(long)]
    pub compact: bool,
}

/// What was typed after `render`: a flag beats the scene file, the scene file beats the default.
#[derive(Debug, Default, Parser)]
#[command(after_help = "\
Examples:
  embrasure render scenes/cornell-box.toml -o box.exr -o box.png
  embrasure render bunny.obj --size 800x600 --spp 256
  embrasure render room.obj --position 0,1,4 --look-at 0,1,0 --fov 50 -o room.png
  embrasure render room.toml --spp 4096 --checkpoint room-state.exr --resume -o room.exr
  embrasure render room.toml --spp 4096 --samples 1024..2048 -o room-2.exr   (a part for embrasure merge)")]
pub(super) struct RenderArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Image to write, .exr (linear float32) or .png (display); repeatable [default: SCENE's stem + .exr here, of a bare OBJ .png and .exr; nothing
    /// where --samples go to a --checkpoint]
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Stop where the relative error is estimated to be LEVEL, such as 0.02 or 2%; --spp is then the most a pixel may have [default: off]
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub noise: Option<f64>,

    /// Stop after this time of rendering, such as 90s or 10m [default: off]
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub time_limit: Option<f64>,

    /// Take the samples A to B-1 alone, of the --spp of the whole picture: a part for `embrasure merge`; multiples of 64
    #[arg(long, value_name = "A..B", value_parser = parse_range, conflicts_with = "noise")]
    pub samples: Option<[u32; 2]>,

    /// Keep here, in an EXR file, all that the render knows, so that it can go on later: every so often, when it is interrupted, and at the end
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// How often --checkpoint is written, such as 10s or 5m [default: 60s]
    #[arg(long, value_name = "DUR", value_parser = parse_duration, requires = "checkpoint")]
    pub checkpoint_interval: Option<f64>,

    /// Go on from --checkpoint, if that file is there; more --spp than before add to it
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// Write the images so far every so often, such as 30s [default: at the end]
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub write_every: Option<f64>,

    /// Show the picture so far in the tev viewer that listens there, such as 127.0.0.1:14158: about every second, and all channels at the end
    #[arg(long, value_name = "HOST:PORT", value_parser = parse_address, conflicts_with = "pixel")]
    pub tev: Option<String>,

    /// Further channels of EXR files: P (position), uv, motion, id, cryptomatte, lights (light_NAME: the picture as each group of lights alone lights it),
    /// strategies (each way in which bdpt makes paths, weighed and alone, at a --max-depth of 6 at most), or all but strategies
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub aov: Vec<String>,

    /// Size of the image in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Render these pixels only: half-open, origin top left; the image keeps its full window. Light-carrying integrators
    /// (light, bdpt, pssmlt, mlt, sppm, photon-map, vcm) send the light of the whole image all the same, most of them in as much time, and
    /// irradiance-cache fills its cache for it
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_list::<u32, 4>)]
    pub crop: Option<[u32; 4]>,

    #[command(flatten)]
    pub filter: Flags<FilterOptions>,

    #[command(flatten)]
    pub background: Flags<BackgroundOptions>,

    #[command(flatten)]
    pub ground: GroundArgs,

    #[command(flatten)]
    pub sampling: Flags<SamplingOptions>,

    #[command(flatten)]
    pub quality: Flags<QualityOptions>,

    #[command(flatten)]
    pub integrator: Flags<IntegratorOptions>,

    #[command(flatten)]
    pub load: LoadArgs,

    #[command(flatten)]
    pub light: LightFlags,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Ask another backend too for this share of the rays, and report where they disagree
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub audit_rays: Option<f64>,

    /// Render and build threads, 64 for each processor at most [default: one for each]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    #[command(flatten)]
    pub camera: CameraArgs,

    /// Trace one sample of this pixel alone, and print its rays and what they found
    #[arg(long, value_name = "X,Y", value_parser = parse_list::<u32, 2>)]
    pub pixel: Option<[u32; 2]>,

    /// Which sample of --pixel [default: 0]
    #[arg(long, value_name = "K", requires = "pixel")]
    pub sample: Option<u32>,

    /// Write the scene as it is rendered, flags included, to a .toml scene file
    #[arg(long, value_name = "FILE", value_parser = parse_scene_output)]
    pub dump_scene: Option<PathBuf>,

    /// Write statistics to FILE as JSON; - is the standard output
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Warnings to print: all, several of one kind as one line (summary), or none
    #[arg(long, value_name = "NAME", value_parser = NameParser::<ShownWarnings>::new(), default_value = "summary")]
    pub warnings: ShownWarnings,

    /// No progress and no summary; warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,

    /// More words
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

#[derive(Debug, Parser)]
#[command(after_help = "\
Images are .exr, or PNG and the like, which are decoded by the sRGB curve. Where both have `variance` channels, as this program
writes them, a verdict says whether they differ by more than their noise. Of pssmlt, mlt, sppm, photon-map and irradiance-cache less is
tested, since their errors reach over many pixels: the output says what is left out (docs/compare.md). The exit code is 1 where they do, where a value is not
finite, or where a limit is passed; with limits these alone decide.
Examples:
  embrasure compare reference.exr image.exr
  embrasure compare reference.exr image.exr -o difference.png
  embrasure compare reference.png image.png --max-flip 0.02 --json")]
pub(super) struct CompareArgs {
    /// The image that is held to be right
    pub reference: PathBuf,

    /// The image to judge
    pub image: PathBuf,

    /// Print JSON
    #[arg(long)]
    pub json: bool,

    /// Chance of a false alarm that the verdict may have, over all its tests
    #[arg(long, value_name = "P", value_parser = parse_chance, default_value = "0.01")]
    pub significance: f64,

    /// Fail where relMSE is above this
    #[arg(long, value_name = "X")]
    pub max_relmse: Option<f64>,

    /// Fail where mean FLIP is above this
    #[arg(long, value_name = "X")]
    pub max_flip: Option<f64>,

    /// Write a picture of the difference here, .png
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,

    /// What it shows: error (relative difference of luminance), flip, or z (difference over its standard deviation)
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Map>::new(), default_value = "error", requires = "output")]
    pub map: Map,
}

/// What a picture of a difference shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Map {
    Error,
    Flip,
    Scores,
}

named! {
    Map: "error" => Self::Error, "flip" => Self::Flip, "z" => Self::Scores;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::Exposure;
    use crate::options::{Input, OptionGroup, Value};

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
        assert_eq!(args.camera.position, Some([-1.0, 2.0, -3.0]));
    }

    /// Who types a number that cannot be is told why.
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

    /// The name of a filter may follow with or without a `=`, before the scene or after it; the flag may stand alone.
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

    /// Defaults in the help can be typed.
    #[test]
    fn defaults_in_the_help_are_taken() {
        let mut command = Args::command();
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
            // Some depend on the scene
            if !parameter.default().contains(' ') {
                let mut options = IntegratorOptions::default();
                let read = options.set(parameter.key, Input::Flag(default));
                assert_eq!(read, Some(Ok(())), "--{flag} {default}");
            }
        }
    }
}
