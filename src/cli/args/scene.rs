//! Arguments of `embrasure info` and `embrasure check`.

use super::light::LightFlags;
use super::load::LoadArgs;
use clap::Parser;
use std::path::PathBuf;

/// Arguments of commands that report about a scene.
#[derive(Debug, Parser)]
pub(in crate::cli) struct SceneArgs {
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

/// Arguments of `check`.
#[derive(Debug, Parser)]
pub(in crate::cli) struct CheckArgs {
    #[command(flatten)]
    pub common: SceneArgs,

    /// Also list what a render needs memory for
    #[arg(short, long)]
    pub verbose: bool,
}
