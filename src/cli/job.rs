//! Validation of a render command. Flags override the scene file, and the scene file overrides the
//! defaults.

use super::aov_list::aovs;
use super::args::{LoadArgs, RenderArgs};
use super::error::CliError;
use super::printing;
use super::warnings::ShownWarnings;
use crate::color::{Curve, Exposure};
use crate::denoise::Denoiser;
use crate::film::{Aov, Rect};
use crate::guess::{Elevation, drawing_axes};
use crate::io::{FileError, LoadOptions, Warning};
use crate::math::{UVec2, Vec2};
use crate::options::{
    ChosenIntegrator, IntegratorKind, IntegratorOptions, Named, OptionGroup, Parameter, Quality, QualityOptions,
    SizeOptions, ToneOptions,
};
use crate::scene_file::{FileCamera, SceneFile, SceneOptions};
use crate::session::{CameraSettings, Guesses, MAX_SAMPLES_FOR_NOISE, Settings, name_of_axis};
use std::path::{Path, PathBuf};

/// Validated render command: flags override the scene file, and the scene file overrides the
/// defaults. Checks that need the geometry come later.
#[derive(Debug)]
pub(super) struct Job {
    pub scene: SceneFile,
    pub scene_path: PathBuf,
    pub settings: Settings,
    /// Options of the picture: the options of the scene file, overridden by flags.
    pub options: SceneOptions,
    /// Maximum render time in seconds.
    pub time_limit: Option<f64>,
    /// Pixel and index of the sample whose rays are printed, instead of a render.
    pub pixel: Option<([u32; 2], u32)>,
    pub quiet: bool,
    pub verbose: bool,
    /// Warnings about the flags.
    pub warnings: Vec<Warning>,
    /// Kinds of warnings to print.
    pub shown_warnings: ShownWarnings,
}

impl Job {
    /// Reads the scene file and resolves all settings, for commands that measure, such as `bench`.
    /// The number of samples is that of the file: the `quality` of the file is ignored.
    pub fn new(args: &RenderArgs) -> Result<Self, CliError> {
        let mut scene = read_scene(&args.scene, &args.load)?;
        scene.options.quality = QualityOptions::default();
        Self::of_scene(args, scene)
    }

    /// Reads the scene file and resolves all settings like [`Job::new`], for renders that are
    /// compared. A bare OBJ has the light that `render` guesses. It has no ground, which some
    /// integrators do not support.
    pub fn to_compare(args: &RenderArgs) -> Result<Self, CliError> {
        let mut job = Self::new(args)?;
        job.settings.guesses.light = !job.scene.is_file();
        Ok(job)
    }

    /// Reads the scene file and resolves all settings like [`Job::new`], for a picture to view. For
    /// a bare OBJ, exposure, tone curve and quality are guessed if neither a flag nor `--set` sets
    /// them.
    pub fn to_show(args: &RenderArgs) -> Result<Self, CliError> {
        Self::to_show_scene(args, read_scene(&args.scene, &args.load)?)
    }

    /// Like [`Job::to_show`], for a scene that was already read.
    pub fn to_show_scene(args: &RenderArgs, mut scene: SceneFile) -> Result<Self, CliError> {
        let guesses_exposure = guess_picture(args, &mut scene);
        let mut job = Self::of_scene(args, scene)?;
        job.settings.guesses = guesses(&job.scene, &job.options);
        job.settings.guesses.exposure = guesses_exposure;
        let says_denoiser = job.options.sampling.denoise.is_some() || job.options.quality.quality.is_some();
        if !job.scene.is_file() && args.samples.is_some() && !says_denoiser {
            job.settings.merged_denoiser = Some(Denoiser::best());
        }
        job.settings.guesses.ground &= !args.ground.no_ground;
        Ok(job)
    }

    /// Resolves all settings for a scene that was read.
    pub fn of_scene(args: &RenderArgs, mut scene: SceneFile) -> Result<Self, CliError> {
        args.ground.apply(&mut scene);
        let name = args.camera_name.as_deref();
        let read = |path: &PathBuf| FileCamera::read(path, name);
        let camera = args.cameras.as_ref().map(read).transpose()?;
        let options = options(args, &scene, camera.as_ref());
        let settings = settings(args, &scene, &options, camera.as_ref())?;
        if let Some(height) = args.plan {
            let [up, _] = drawing_axes(settings.camera.up, &settings.camera.axes);
            scene.cut_above_lowest(name_of_axis(up.as_dvec3()), height);
        }
        settings.check()?;
        scene.change_light(args.light.changes(), &settings.camera.viewpoint());
        Ok(Self {
            warnings: idle_flags(&settings.chosen_integrator(), &args.integrator.0),
            shown_warnings: args.warnings,
            pixel: args.pixel.map(|pixel| (pixel, args.sample.unwrap_or(0))),
            settings,
            options,
            time_limit: args.time_limit,
            quiet: args.quiet,
            verbose: args.verbose,
            scene_path: args.scene.clone(),
            scene,
        })
    }
}

/// Settings to guess for a bare OBJ: light, ground, and the background if `options` has none.
/// [`Job::to_show_scene`] decides about the exposure.
pub(super) fn guesses(scene: &SceneFile, options: &SceneOptions) -> Guesses {
    let is_bare = !scene.is_file();
    Guesses {
        light: is_bare,
        ground: is_bare,
        background: is_bare && options.background.background.is_none(),
        exposure: false,
    }
}

/// Sets defaults for the picture of a bare OBJ: metered exposure, the tone curve AgX and good
/// quality. Returns true if the exposure is one of these defaults.
pub(super) fn guess_picture(args: &RenderArgs, scene: &mut SceneFile) -> bool {
    if scene.is_file() {
        return false;
    }
    let options = &mut scene.options;
    // Debug views show numbers as colours, so exposure and tone curve must not change them.
    if args.integrator.0.or(options.integrator).integrator() == IntegratorKind::Debug {
        return false;
    }
    let guesses_exposure = args.tone.0.or(options.tone).exposure.is_none();
    options.tone = options.tone.or(ToneOptions {
        exposure: Some(Exposure::Auto),
        tone: Some(Curve::Agx),
    });
    // Do not guess a quality for a part of the samples (`--samples`). The whole picture then has
    // the default sample count.
    if args.samples.is_none() {
        options.quality = options.quality.or(QualityOptions {
            quality: Some(Quality::Good),
        });
    }
    guesses_exposure
}

/// Options of the picture. Flags override the scene file. Without `--size`, the size is that of the
/// picture of `camera`, the camera of `--cameras`.
fn options(args: &RenderArgs, scene: &SceneFile, camera: Option<&FileCamera>) -> SceneOptions {
    // A stereo picture has two views, each with the size in the file
    let of_file = || {
        let camera = camera?;
        let layout = args.camera.0.stereo.or(camera.options.stereo);
        let picture_size = |size| layout.map_or(size, |layout| layout.picture_size(size));
        camera.size.map(picture_size)
    };
    let size = args.size.map(UVec2::from).or_else(of_file);
    let projection = args.camera.0.or(scene.options.camera).projection();
    SceneOptions {
        camera: scene.options.camera,
        size: match size {
            Some(size) => SizeOptions {
                width: Some(size.x),
                height: Some(size.y),
            },
            None => scene.options.size.of_projection(projection),
        },
        print: args.print.0.or(scene.options.print),
        filter: args.filter.0.or(scene.options.filter),
        background: args.background.0.or(scene.options.background),
        tone: args.tone.0.or(scene.options.tone),
        lines: args.lines.0.or(scene.options.lines),
        sampling: args.quality.0.under(args.sampling.0).or(scene.options.sampling),
        quality: args.quality.0.or(scene.options.quality),
        integrator: args.integrator.0.or(scene.options.integrator),
        load: args.load.parameters.0.or(scene.options.load),
    }
}

/// Settings of a render. Flags override `of_file`, the camera of `--cameras`. `of_file` overrides
/// the camera of the scene file.
fn settings(
    args: &RenderArgs,
    scene: &SceneFile,
    options: &SceneOptions,
    of_file: Option<&FileCamera>,
) -> Result<Settings, CliError> {
    let mut settings = Settings::new(options, CameraSettings::of(scene));
    settings.crop = args.crop.map(|[x0, y0, x1, y1]| Rect {
        min: UVec2::new(x0, y0),
        max: UVec2::new(x1, y1),
    });

    let mut camera = args.camera.clone();
    if let Some(of_file) = of_file {
        let layout = camera.0.stereo.or(of_file.options.stereo);
        let size = settings.resolution;
        let view = layout.map_or(size, |layout| layout.view_size(size));
        camera.0 = camera.0.or(of_file.options(view));
        settings.camera.options = settings.camera.options.opening();
    }
    if args.plan.is_some() {
        camera.0.elevation = Some(Elevation::Plan);
    }
    camera.apply(&mut settings.camera, scene.origin());
    settings.is_page = args.size.is_some();
    let size = settings.resolution;
    let is_inside = |at: &Vec2| at.cmpge(Vec2::ZERO).all() && at.cmple(size.as_vec2()).all();
    if let Some(at) = args.camera.0.focus_at.filter(|at| !is_inside(at)) {
        return Err(CliError::Usage(format!(
            "--focus-at {},{}\n  help: choose a point inside the image, from 0,0 to {},{}",
            at.x, at.y, size.x, size.y
        )));
    }

    // `--noise` overrides the sample count of the scene file.
    let spp = args.sampling.0.samples;
    let of_quality = args.quality.0.noise(&args.sampling.0).or(settings.noise);
    settings.noise = args.noise.or(of_quality.filter(|_| args.samples.is_none()));
    if args.noise.is_some() {
        settings.spp = spp.unwrap_or(MAX_SAMPLES_FOR_NOISE);
    }
    settings.part = args.samples.map(|[first, end]| first..end);
    let too_few = |[_, end]: &[u32; 2]| spp.is_some_and(|spp| *end > spp);
    if let Some([first, end]) = args.samples.filter(too_few) {
        let spp = settings.spp;
        return Err(CliError::Usage(format!(
            "--samples {first}..{end}\n  help: the whole picture has {} per pixel: end at {spp}, or raise --spp",
            printing::count(spp.into(), "sample")
        )));
    }
    let wanted = aovs(&args.aov, scene, &settings.chosen_integrator())?;
    settings.light_paths = wanted.light_paths;
    let is_new = |aov: &Aov| !wanted.aovs.contains(aov);
    settings.aovs = settings
        .aovs
        .into_iter()
        .filter(is_new)
        .chain(wanted.aovs.clone())
        .collect();
    let style = [args.lines.0.lines_width, args.lines.0.lines_angle];
    if style.iter().any(Option::is_some) && !settings.aovs.contains(&Aov::Lines) {
        return Err(CliError::Usage(
            "--lines-width and --lines-angle: no lines are drawn\n  help: draw them with --lines black, or store them with --aov lines".into(),
        ));
    }
    settings.threads = args.threads.unwrap_or(settings.threads);
    settings.compact = args.load.compact;
    Ok(settings)
}

/// Warnings for flags that the integrator does not use. Keys of a scene file get no warning,
/// because they may serve other integrators.
fn idle_flags(integrator: &ChosenIntegrator, flags: &IntegratorOptions) -> Vec<Warning> {
    let read = integrator.kind().parameters();
    let is_idle = |parameter: &&Parameter| {
        let key = parameter.key;
        key != "integrator" && flags.given().contains(&key) && !read.contains(&key)
    };
    let idle = IntegratorOptions::PARAMETERS.iter().filter(is_idle);
    let text = |parameter: &Parameter| {
        let users = IntegratorKind::NAMES.iter();
        let users = users.filter(|(_, kind)| kind.parameters().contains(&parameter.key));
        let users: Vec<&str> = users.map(|(name, _)| *name).collect();
        let remedy = match users.as_slice() {
            [] => String::from("leave it out"),
            [only] => format!("add --integrator {only}, or leave it out"),
            _ => format!("leave it out, or choose --integrator among {}", users.join(", ")),
        };
        let flag = parameter.flag();
        format!("--{flag}: {} does not use it\n  help: {remedy}", integrator.name())
    };
    idle.map(|parameter| Warning::new("idle-flag", text(parameter)))
        .collect()
}

/// Reads a scene file or a bare OBJ with the flags `args`.
pub(super) fn read_scene(path: &Path, args: &LoadArgs) -> Result<SceneFile, CliError> {
    let scene = match kind_of(path)? {
        SceneKind::Toml => SceneFile::load_with(path, &args.set),
        SceneKind::Obj => SceneFile::of_obj_with(path, &args.set),
    };
    with_flags(scene?, args)
}

/// The scene file `path` with the contents `text` and the flags `args`.
#[cfg(feature = "view")]
pub(super) fn scene_of_text(path: &Path, text: &str, args: &LoadArgs) -> Result<SceneFile, CliError> {
    with_flags(SceneFile::of_text(path, text.into(), &args.set)?, args)
}

/// Applies the flags `args` to a scene, except `--set`, which applies when the file is read.
fn with_flags(mut scene: SceneFile, args: &LoadArgs) -> Result<SceneFile, CliError> {
    scene.patch_materials(&args.patches)?;
    scene.patch_parts(&args.parts)?;
    set_load(&mut scene, args);
    scene.settle_origin();
    scene.cut(&args.cut)?;
    Ok(scene)
}

/// Kind of a file that describes a scene: a scene file, or a bare OBJ.
pub(super) enum SceneKind {
    Toml,
    Obj,
}

/// Kind of the scene at `path`, by the extension of the file name.
pub(super) fn kind_of(path: &Path) -> Result<SceneKind, FileError> {
    let refused = |message| FileError::new(path, message).help("give a .toml scene file or an .obj file");
    if path.as_os_str() == "-" {
        return Err(refused("a scene cannot be standard input"));
    }
    if path.is_dir() {
        return Err(refused("this is a directory, not a scene"));
    }
    let is_pattern = path.to_string_lossy().contains(['*', '?']);
    if is_pattern && !path.exists() {
        let help = "name one file; `embrasure help batch` shows how to render many files";
        return Err(FileError::new(path, "no file has this name, and patterns are not expanded").help(help));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => Ok(SceneKind::Toml),
        Some("obj") => Ok(SceneKind::Obj),
        Some(extension) => match FORMATS
            .iter()
            .find(|(_, extensions, _)| extensions.contains(&extension))
        {
            Some((name, _, import)) => {
                let message = format!("{name} files cannot be read");
                let help = format!("make an OBJ file: in Blender {import}, then File > Export > Wavefront (.obj)");
                Err(FileError::new(path, message).help(help))
            }
            None if extension == "exr" => {
                let help = format!(
                    "`embrasure develop {} --list` shows what a picture contains",
                    path.display()
                );
                Err(FileError::new(path, "a picture is not a scene").help(help))
            }
            None => Err(refused("the name of a scene ends in .toml or .obj")),
        },
        None => Err(refused("the name of a scene ends in .toml or .obj")),
    }
}

/// Unsupported model formats: name, extensions, and the import command in Blender.
const FORMATS: [(&str, &[&str], &str); 8] = [
    ("glTF", &["gltf", "glb"], "File > Import > glTF 2.0"),
    ("STL", &["stl"], "File > Import > STL"),
    ("FBX", &["fbx"], "File > Import > FBX"),
    ("Blender", &["blend"], "open the file"),
    ("PLY", &["ply"], "File > Import > Stanford PLY"),
    (
        "3D Studio",
        &["3ds"],
        "enable the add-on Autodesk 3DS format, File > Import > 3D Studio",
    ),
    ("COLLADA", &["dae"], "up to version 4.5 File > Import > Collada"),
    (
        "USD",
        &["usd", "usda", "usdc", "usdz"],
        "File > Import > Universal Scene Description",
    ),
];

/// Sets the load options of a scene. Flags override the keys of the scene file.
pub(super) fn set_load(scene: &mut SceneFile, args: &LoadArgs) {
    scene.load = LoadOptions {
        parameters: args.parameters.0.or(scene.options.load),
        max_memory: args.max_memory,
        strict: args.strict,
        ..LoadOptions::default()
    };
    // A flag also overrides keys of objects.
    let flags = &args.parameters.0;
    for object in &mut scene.object {
        object.set_below(flags);
    }
    scene.texture_dirs.clone_from(&args.texture_dir);
    scene.hide.clone_from(&args.hide);
    scene.only.clone_from(&args.only);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_formats_have_a_way_to_an_obj() {
        for name in [
            "a.gltf", "a.GLB", "a.stl", "a.fbx", "a.blend", "a.ply", "a.3ds", "a.dae", "a.usd", "a.usdz",
        ] {
            let error = kind_of(Path::new(name)).err().unwrap();
            let help = error.help.unwrap_or_default();
            assert!(
                error.message.ends_with(" files cannot be read"),
                "{name}: {}",
                error.message
            );
            assert!(
                help.starts_with("make an OBJ file: in Blender ") && help.contains("Wavefront (.obj)"),
                "{help}"
            );
        }
        let error = kind_of(Path::new("a.xyz")).err().unwrap();
        assert_eq!(error.message, "the name of a scene ends in .toml or .obj");
    }
}
