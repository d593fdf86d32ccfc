//! Arguments of `embrasure init`.

use super::camera::CameraArgs;
use super::load::LoadArgs;
use super::values::parse_scene_output;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The scene file gives the same picture as the OBJ with the same flags. Each material is a patch
with its numbers and textures, commented out.
Examples:
  embrasure init room.obj
  embrasure init models/room.obj -o scenes/room.toml
  embrasure init statue.obj --orbit 30,15 --fov 40")]
pub(in crate::cli) struct InitArgs {
    /// A bare .obj
    pub scene: PathBuf,

    /// Scene file to write [default: SCENE's stem + .toml, in the current folder]
    #[arg(short, long, value_name = "FILE", value_parser = parse_scene_output)]
    pub output: Option<PathBuf>,

    /// Replace an existing file
    #[arg(long)]
    pub force: bool,

    #[command(flatten)]
    pub camera: CameraArgs,

    #[command(flatten)]
    pub load: LoadArgs,
}
