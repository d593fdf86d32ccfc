//! Arguments of `embrasure init`.

use super::load::LoadArgs;
use super::values::parse_scene_output;
use clap::Parser;
use std::path::PathBuf;

#[derive(Debug, Parser)]
#[command(after_help = "\
The file renders what the OBJ does. Materials are patches that are commented out, each with its numbers and textures.
Examples:
  embrasure init room.obj
  embrasure init models/room.obj -o scenes/room.toml")]
pub(in crate::cli) struct InitArgs {
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
