//! Arguments of `embrasure views`.

use super::flags::NameParser;
use super::load::LoadArgs;
use super::values::parse_size;
use crate::guess::NamedView;
use crate::options::Backend;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
Examples:
  embrasure views room.obj -o views.png
  embrasure views house.obj --view inside -o rooms.png
  embrasure render room.obj --orbit 30,20")]
pub(in crate::cli) struct ViewsArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Write a contact sheet of the views to this .png [default: print only the flags]
    #[arg(short, long, value_name = "SHEET.png")]
    pub output: Option<PathBuf>,

    /// Views to show; inside: cameras in the rooms, and a plan; auto: by the scene [default: auto]
    #[arg(long, value_name = "NAME", value_parser = NameParser::<NamedView>::new())]
    pub view: Option<NamedView>,

    /// Size of each picture in pixels, in the aspect ratio of your render [default: 240x240]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    /// Samples per pixel [default: 16]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,

    /// The ray-tracing backend
    #[arg(long, value_name = "NAME", value_parser = NameParser::<Backend>::new())]
    pub backend: Option<Backend>,

    /// Render and build threads, at most 64 per processor [default: one per processor]
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
