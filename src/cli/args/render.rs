//! Arguments of `embrasure render`.

use super::camera::CameraArgs;
use super::exr::ExrArgs;
use super::flags::{Flags, NameParser};
use super::ground::GroundArgs;
use super::light::LightFlags;
use super::load::LoadArgs;
use super::values::{
    parse_address, parse_duration, parse_level, parse_list, parse_range, parse_scene_output, parse_share, parse_size,
};
use crate::cli::warnings::ShownWarnings;
use crate::options::{
    BackgroundOptions, FilterOptions, IntegratorOptions, QualityOptions, SamplingOptions, ToneOptions,
};
use clap::Parser;
use std::path::PathBuf;

/// What was typed after `render`: a flag beats the scene file, the scene file beats the default.
#[derive(Debug, Default, Parser)]
#[command(after_help = "\
Examples:
  embrasure render scenes/cornell-box.toml -o box.exr -o box.png
  embrasure render bunny.obj --size 800x600 --spp 256
  embrasure render room.obj --position 0,1,4 --look-at 0,1,0 --fov 50 -o room.png
  embrasure render room.toml --spp 4096 --checkpoint room-state.exr --resume -o room.exr
  embrasure render room.toml --spp 4096 --samples 1024..2048 -o room-2.exr   (a part for embrasure merge)")]
pub(in crate::cli) struct RenderArgs {
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

    /// Verbose output
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}
