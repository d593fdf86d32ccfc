//! Arguments of `embrasure view`.

use super::camera::CameraArgs;
use super::exr::ExrArgs;
use super::flags::Flags;
use super::ground::GroundArgs;
use super::light::LightFlags;
use super::load::LoadArgs;
use super::values::{parse_level, parse_size};
use crate::options::{
    BackgroundOptions, FilterOptions, IntegratorOptions, QualityOptions, SamplingOptions, ToneOptions,
};
use clap::Parser;
use std::net::IpAddr;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The page is part of the program and loads nothing from the network. The link contains a random
token that other users of this machine cannot guess. A browser gets the link from a temporary file
that only you can read, because other users can see the arguments of programs. If your browser
cannot read temporary files (snap), open the printed link.
Over ssh: start the viewer on the remote machine with --port 8123. On your machine run
`ssh -L 8123:127.0.0.1:8123 HOST` and open the link.
Examples:
  embrasure view scenes/cornell-box.toml
  embrasure view room.obj --size 960x540 --port 8123 --no-open
  embrasure view scenes/spheres.toml --compare path,sppm")]
pub(in crate::cli) struct ViewArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Port of the page; 0 for a free one [default: 0]
    #[arg(long, value_name = "N", hide_default_value = true, default_value_t = 0)]
    pub port: u16,

    /// Print the link, but open no browser
    #[arg(long)]
    pub no_open: bool,

    /// Address to listen on
    ///
    /// Other machines that reach this address can control the render if they have the link.
    #[arg(long, value_name = "ADDR", default_value = "127.0.0.1")]
    pub listen: IpAddr,

    /// End when the last page was closed and none is opened for 3 s
    #[arg(long)]
    pub exit_when_closed: bool,

    /// Two settings side by side at equal time: path,sppm or path,path+reuse=none
    #[arg(long, value_name = "A,B")]
    pub compare: Option<String>,

    /// Reference EXR of this view, for the errors over time that the page shows
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,

    /// Further channels of the EXR that the page saves, as in `render --aov`
    #[arg(long, value_name = "NAME,...")]
    pub aov: Vec<String>,

    /// Stop at this estimated relative error, such as 2%; --spp is the maximum [default: off]
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub noise: Option<f64>,

    /// Size of the image in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Render and build threads, at most 64 per processor [default: one per processor]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// Print only the link, warnings and errors
    #[arg(short, long)]
    pub quiet: bool,

    #[command(flatten)]
    pub camera: CameraArgs,

    #[command(flatten)]
    pub sampling: Flags<SamplingOptions>,

    #[command(flatten)]
    pub quality: Flags<QualityOptions>,

    #[command(flatten)]
    pub integrator: Flags<IntegratorOptions>,

    #[command(flatten)]
    pub filter: Flags<FilterOptions>,

    #[command(flatten)]
    pub background: Flags<BackgroundOptions>,

    #[command(flatten)]
    pub ground: GroundArgs,

    #[command(flatten)]
    pub light: LightFlags,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    #[command(flatten)]
    pub exr: ExrArgs,

    #[command(flatten)]
    pub load: LoadArgs,
}
