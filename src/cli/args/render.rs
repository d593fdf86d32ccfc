//! Arguments of `embrasure render`.

use super::camera::CameraArgs;
use super::exr::ExrArgs;
use super::flags::{Flags, NameParser};
use super::ground::GroundArgs;
use super::light::LightFlags;
use super::load::LoadArgs;
use super::values::{
    parse_address, parse_duration, parse_height, parse_level, parse_list, parse_range, parse_scene_output, parse_share,
    parse_size,
};
use crate::cli::warnings::ShownWarnings;
use crate::options::{
    BackgroundOptions, FilterOptions, IntegratorOptions, LineOptions, PrintOptions, QualityOptions, SamplingOptions,
    ToneOptions,
};
use clap::Parser;
use std::path::PathBuf;

/// Flags of the camera's position and lens. They cannot be combined with a camera from a file.
const PLACE_AND_LENS: [&str; 17] = [
    "position",
    "look-at",
    "up",
    "fov",
    "view",
    "elevation",
    "orbit",
    "stand",
    "yaw",
    "pose",
    "projection",
    "ortho-height",
    "fisheye-fov",
    "fisheye-mapping",
    "intrinsics",
    "distortion",
    "plan",
];

/// Arguments of `render`: a flag beats the scene file, the scene file beats the default.
#[derive(Clone, Debug, Default, Parser)]
#[command(after_help = "\
Examples:
  embrasure render scenes/cornell-box.toml -o box.exr -o box.png
  embrasure render bunny.obj --size 800x600 --spp 256
  embrasure render room.obj --position 0,1,4 --look-at 0,1,0 --fov 50 -o room.png
  embrasure render room.toml --spp 4096 --checkpoint room-state.exr --resume -o room.exr
  embrasure render room.toml --spp 4096 --samples 1024..2048 -o room-2.exr   (a part)")]
pub(in crate::cli) struct RenderArgs {
    /// A .toml scene file or a bare .obj
    pub scene: PathBuf,

    /// Image to write, .exr (linear) or .png (display); repeatable [default: SCENE's stem + .exr]
    ///
    /// {face} in the name writes the faces of a cube map: right, left, up, down, front and back.
    ///
    /// A bare OBJ also gets a .png. Without -o, --samples with --checkpoint writes no image.
    #[arg(short, long, value_name = "FILE")]
    pub output: Vec<PathBuf>,

    /// Size of the image in pixels [default: 512x512]
    #[arg(long, value_name = "WxH", value_parser = parse_size)]
    pub size: Option<[u32; 2]>,

    #[command(flatten)]
    pub print: Flags<PrintOptions>,

    #[command(flatten)]
    pub camera: CameraArgs,

    /// File of cameras: transforms.json, a COLMAP folder, .gltf, .glb, .toml or .csv
    ///
    /// The camera is the only one of the file, or the one that --camera names. Without --size, the
    /// picture has the size in the file; with --size, the intrinsics of the camera are scaled.
    #[arg(long, value_name = "FILE", conflicts_with_all = PLACE_AND_LENS, help_heading = "Camera")]
    pub cameras: Option<PathBuf>,

    /// Camera of --cameras, by its name or by the name of its picture
    #[arg(long = "camera", value_name = "NAME", requires = "cameras", help_heading = "Camera")]
    pub camera_name: Option<String>,

    /// Plan: view from above, cut at this height above the lowest point of the scene
    ///
    /// An orthographic view of the whole box of the scene. --cut-light whole keeps the light of the
    /// whole scene.
    #[arg(long, value_name = "HEIGHT", value_parser = parse_height)]
    pub plan: Option<f64>,

    #[command(flatten)]
    pub light: LightFlags,

    #[command(flatten)]
    pub background: Flags<BackgroundOptions>,

    #[command(flatten)]
    pub ground: GroundArgs,

    #[command(flatten)]
    pub tone: Flags<ToneOptions>,

    #[command(flatten)]
    pub lines: Flags<LineOptions>,

    /// Render only these pixels; origin top left, X1 and Y1 excluded
    ///
    /// Integrators that trace paths from lights, and irradiance-cache, still compute the light of
    /// the whole image.
    #[arg(long, value_name = "X0,Y0,X1,Y1", value_parser = parse_list::<u32, 4>)]
    pub crop: Option<[u32; 4]>,

    #[command(flatten)]
    pub filter: Flags<FilterOptions>,

    /// Stop at this estimated relative error, such as 2%; --spp is the maximum [default: off]
    #[arg(long, value_name = "LEVEL", value_parser = parse_level)]
    pub noise: Option<f64>,

    /// Stop this long after the start, such as 90s or 10m [default: off]
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub time_limit: Option<f64>,

    /// Render only samples A to B-1, as a part for `merge`; A and B: multiples of 64
    #[arg(long, value_name = "A..B", value_parser = parse_range, conflicts_with = "noise")]
    pub samples: Option<[u32; 2]>,

    /// Write checkpoints for --resume to this EXR file, and a last one at the end
    ///
    /// The program also writes one when it is interrupted.
    #[arg(long, value_name = "FILE")]
    pub checkpoint: Option<PathBuf>,

    /// Interval of --checkpoint, such as 10s or 5m [default: 60s]
    #[arg(long, value_name = "DUR", value_parser = parse_duration, requires = "checkpoint")]
    pub checkpoint_interval: Option<f64>,

    /// Resume from --checkpoint if the file exists; a larger --spp adds samples
    #[arg(long, requires = "checkpoint")]
    pub resume: bool,

    /// Write the images so far at this interval, such as 30s [default: at the end]
    #[arg(long, value_name = "DUR", value_parser = parse_duration)]
    pub write_every: Option<f64>,

    /// Show the picture so far in the tev viewer, such as 127.0.0.1:14158
    #[arg(long, value_name = "ADDRESS", value_parser = parse_address, conflicts_with = "pixel")]
    pub tev: Option<String>,

    /// Further channels of EXR files, such as P, uv, id, cryptomatte, lines or all
    ///
    /// Also motion, points (photons or irradiance records) and strategies (bdpt, --max-depth up to
    /// 6); lights is a layer for each light group; all includes everything but lines and
    /// strategies. Light paths: emission, direct, indirect, diffuse_direct, diffuse_indirect (also
    /// specular_ and transmission_), bounces, bounces:N, bounce.N, and light path expressions such
    /// as 'lpe:caustics=LS+DE'.
    #[arg(long, value_name = "NAME,...")]
    pub aov: Vec<String>,

    #[command(flatten)]
    pub sampling: Flags<SamplingOptions>,

    #[command(flatten)]
    pub quality: Flags<QualityOptions>,

    #[command(flatten)]
    pub load: LoadArgs,

    #[command(flatten)]
    pub exr: ExrArgs,

    /// Check this fraction of the rays, 0 to 1, against another backend [default: off]
    #[arg(long, value_name = "SHARE", value_parser = parse_share)]
    pub audit_rays: Option<f64>,

    /// Render and build threads, at most 64 per processor [default: one per processor]
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,

    /// Trace one sample of this pixel, and print its rays and hits
    #[arg(long, value_name = "X,Y", value_parser = parse_list::<u32, 2>)]
    pub pixel: Option<[u32; 2]>,

    /// Index of the sample of --pixel [default: 0]
    #[arg(long, value_name = "K", requires = "pixel")]
    pub sample: Option<u32>,

    /// Print the vertices, densities, weights and contributions of --pixel as JSON
    #[arg(long, requires = "pixel")]
    pub json: bool,

    /// Write the rendered scene, with all flags applied, to a .toml scene file
    #[arg(long, value_name = "FILE", value_parser = parse_scene_output)]
    pub dump_scene: Option<PathBuf>,

    /// Write the camera to a transforms.json, or to a COLMAP folder
    ///
    /// Cameras of other pictures stay in an existing file.
    #[arg(long, value_name = "FILE")]
    pub write_cameras: Option<PathBuf>,

    /// Write statistics to FILE as JSON; - means standard output
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,

    /// Warnings to print: all, summary (one line for each kind), or none
    #[arg(long, value_name = "NAME", value_parser = NameParser::<ShownWarnings>::new(), default_value = "summary")]
    pub warnings: ShownWarnings,

    /// No progress and no summary; warnings and errors only
    #[arg(short, long)]
    pub quiet: bool,

    /// Verbose output
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,

    #[command(flatten)]
    pub integrator: Flags<IntegratorOptions>,
}
