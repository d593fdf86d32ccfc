//! Arguments of all commands that load a scene.

use super::flags::Flags;
use super::values::{parse_bytes, parse_folder};
use crate::io::LoadParameters;
use clap::Parser;
use std::path::PathBuf;

/// Flags for reading files.
#[derive(Clone, Debug, Default, Parser)]
pub(in crate::cli) struct LoadArgs {
    #[command(flatten)]
    pub parameters: Flags<LoadParameters>,

    /// Maximum memory, such as 8G; a render that needs more fails [default: the available memory]
    #[arg(long, value_name = "SIZE", value_parser = parse_bytes)]
    pub max_memory: Option<u64>,

    /// Set a key of the scene file, such as render.max_depth=8; repeatable
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,

    /// Change materials: 'Floor*.roughness=0.2', or a preset: 'ring=gold'; repeatable
    #[arg(id = "patches", long = "material", value_name = "GLOB.KEY=VALUE")]
    pub patches: Vec<String>,

    /// Change parts: 'Chair*.visible=false', or a preset: 'Ring=gold'; repeatable
    #[arg(id = "parts", long = "part", value_name = "GLOB.KEY=VALUE")]
    pub parts: Vec<String>,

    /// Folder to search for missing textures; repeatable
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub texture_dir: Vec<PathBuf>,

    /// Leave out parts by their `o` or `g` name, such as 'Chair*'; repeatable
    #[arg(long, value_name = "GLOB")]
    pub hide: Vec<String>,

    /// Show these parts alone, by their `o` or `g` name; repeatable
    #[arg(long, value_name = "GLOB")]
    pub only: Vec<String>,

    /// Cut the scene: 'z=1.2' keeps the part below, '-z=1.2' the part above; repeatable
    #[arg(long, value_name = "AXIS=VALUE", allow_hyphen_values = true)]
    pub cut: Vec<String>,

    /// Treat missing or unreadable textures and libraries, and wrong values, as errors
    #[arg(long)]
    pub strict: bool,

    /// Use less memory and more time; automatic if --max-memory requires it
    #[arg(long)]
    pub compact: bool,
}
