use super::aovs::aovs;
use super::args::{EstimatorArgs, ExrArgs, LoadArgs, RenderArgs, ToneArgs};
use super::error::CliError;
use crate::color::tone::{Curve, Tone};
use crate::description::SceneFile;
use crate::film::{FilterKind, Rect};
use crate::integrator::Roulette;
use crate::io::{Compression, ExrFormat, FileError, LoadOptions, MtlDialect, find, join_names};
use crate::math::{UVec2, Vec3};
use crate::sampler::SamplerKind;
use crate::session::{
    Backend, DENOISERS, DIRECT, DIRECTIONS, Estimator, HEURISTICS, IntegratorKind, METROPOLIS_DIRECT,
    METROPOLIS_TARGETS, MOST_FOR_NOISE, REUSES, SELECTIONS, SWITCHES, Settings, TRIANGLE_SAMPLINGS, VIEWS,
};
use crate::texture::TextureFilter;
use std::path::{Path, PathBuf};

/// What a render command means: flags over the scene file over the defaults, checked as far as is possible without loading the geometry.
#[derive(Debug)]
pub(super) struct Job {
    pub scene: SceneFile,
    pub scene_path: PathBuf,
    pub settings: Settings,
    /// Seconds of rendering after which to stop.
    pub time_limit: Option<f64>,
    /// The pixel and sample to explain instead of rendering.
    pub pixel: Option<([u32; 2], u32)>,
    pub quiet: bool,
    pub verbose: bool,
    /// What is odd about the flags, a sentence each.
    pub warnings: Vec<String>,
}

impl Job {
    /// Reads the scene file and resolves everything.
    pub fn new(args: &RenderArgs) -> Result<Self, CliError> {
        Self::of_scene(args, read_scene(&args.scene, &args.load)?)
    }

    /// Resolves everything for a scene file that was read.
    pub fn of_scene(args: &RenderArgs, scene: SceneFile) -> Result<Self, CliError> {
        let settings = settings(args, &scene)?;
        settings.check()?;
        Ok(Self {
            warnings: idle_switches(&settings.estimator, &args.estimator),
            pixel: args.pixel.map(|pixel| (pixel, args.sample.unwrap_or(0))),
            settings,
            time_limit: args.time_limit,
            quiet: args.quiet,
            verbose: args.verbose,
            scene_path: args.scene.clone(),
            scene,
        })
    }
}

/// What the scene file says, and flags over it.
fn settings(args: &RenderArgs, scene: &SceneFile) -> Result<Settings, CliError> {
    let mut settings = Settings::of(scene)?;
    set(&mut settings.resolution, args.size.map(UVec2::from));
    settings.crop = args.crop.map(|[x0, y0, x1, y1]| Rect {
        min: UVec2::new(x0, y0),
        max: UVec2::new(x1, y1),
    });
    set_named(&mut settings.filter, "filter", &args.filter, FilterKind::NAMES)?;
    settings.filter_radius = args.filter_radius.or(settings.filter_radius);
    settings.tone = tone(settings.tone, &args.tone)?;

    let camera = &mut settings.camera;
    camera.position = args.position.map(Vec3::from).or(camera.position);
    camera.look_at = args.look_at.map(Vec3::from).or(camera.look_at);
    camera.up = args.up.map(Vec3::from).or(camera.up);
    camera.vertical_fov = args.fov.or(camera.vertical_fov);
    camera.shutter = args.shutter.or(camera.shutter);

    // A flag for the noise is not held back by what the scene file says of samples.
    settings.noise = args.noise;
    set(&mut settings.spp, args.spp.or(args.noise.map(|_| MOST_FOR_NOISE)));
    settings.part = args.samples.map(|[first, end]| first..end);
    let too_few = |[_, end]: &[u32; 2]| args.spp.is_some_and(|spp| *end > spp);
    if let Some([first, end]) = args.samples.filter(too_few) {
        let spp = settings.spp;
        return Err(CliError::Usage(format!(
            "--samples {first}..{end}\n  help: the whole picture has {spp} samples a pixel: end at {spp}, or raise --spp"
        )));
    }
    set(&mut settings.seed, args.seed);
    set_named(&mut settings.sampler, "sampler", &args.sampler, SamplerKind::NAMES)?;
    estimator(&mut settings.estimator, &args.estimator)?;
    settings.aovs = aovs(&args.aov, scene, &settings.estimator)?;
    set_named(&mut settings.backend, "backend", &args.backend, Backend::NAMES)?;
    set_named(&mut settings.denoiser, "denoise", &args.denoise, DENOISERS)?;
    set(&mut settings.threads, args.threads);
    settings.compact = args.load.compact;
    Ok(settings)
}

/// Changes what flags say of the estimator.
fn estimator(estimator: &mut Estimator, args: &EstimatorArgs) -> Result<(), CliError> {
    let strategy = &mut estimator.strategy;
    set_named(
        &mut estimator.kind,
        "integrator",
        &args.integrator,
        IntegratorKind::NAMES,
    )?;
    set_named(&mut strategy.directions, "directions", &args.directions, DIRECTIONS)?;
    set_named(&mut strategy.direct, "direct", &args.direct, DIRECT)?;
    set_named(&mut strategy.heuristic, "mis", &args.mis, HEURISTICS)?;
    set_named(
        &mut estimator.light_selection,
        "light-selection",
        &args.light_selection,
        SELECTIONS,
    )?;
    set_named(
        &mut estimator.triangle_sampling,
        "triangle-sampling",
        &args.triangle_sampling,
        TRIANGLE_SAMPLINGS,
    )?;
    set_named(&mut estimator.reuse, "reuse", &args.reuse, REUSES)?;
    set_named(&mut estimator.view, "view", &args.view, VIEWS)?;
    estimator.max_depth = args.max_depth.or(estimator.max_depth);
    set(
        &mut estimator.roulette,
        args.roulette_depth.map(|depth| Roulette { depth }),
    );
    estimator.light_samples = args.light_samples.or(estimator.light_samples);
    set(&mut estimator.branching, args.branching);
    estimator.ao_distance = args.ao_distance.or(estimator.ao_distance);
    let metropolis = &mut estimator.metropolis;
    set_named(
        &mut metropolis.direct,
        "metropolis-direct",
        &args.metropolis_direct,
        METROPOLIS_DIRECT,
    )?;
    set_named(
        &mut metropolis.target,
        "metropolis-target",
        &args.metropolis_target,
        METROPOLIS_TARGETS,
    )?;
    metropolis.chains = args.chains.or(metropolis.chains);
    metropolis.bootstrap = args.bootstrap.or(metropolis.bootstrap);
    set(&mut metropolis.large_step_probability, args.large_step_probability);
    set(&mut metropolis.mutation_size, args.mutation_size);
    estimator.photons = args.photons.or(estimator.photons);
    estimator.photon_radius = args.photon_radius.or(estimator.photon_radius);
    set(&mut estimator.photon_alpha, args.photon_alpha);
    set(&mut estimator.photon_count, args.photon_count);
    set(&mut estimator.gather_rays, args.gather_rays);
    set(&mut estimator.cache_error, args.cache_error);
    set(&mut estimator.cache_rays, args.cache_rays);
    Ok(())
}

/// Says so of each flag that the method does not read. Keys of a scene file may serve whichever method is chosen.
fn idle_switches(estimator: &Estimator, args: &EstimatorArgs) -> Vec<String> {
    let idle = switches(args)
        .into_iter()
        .filter(|(name, is_given)| *is_given && !estimator.reads(name));
    idle.map(|(name, _)| format!("--{name}: {} does not use it", estimator.name()))
        .collect()
}

/// The switches of estimators, and whether they are given.
fn switches(args: &EstimatorArgs) -> [(&'static str, bool); SWITCHES.len()] {
    // All fields, so that a new one is not forgotten
    let EstimatorArgs {
        integrator: _,
        max_depth,
        roulette_depth,
        directions,
        direct,
        mis,
        light_selection,
        triangle_sampling,
        reuse,
        light_samples,
        branching,
        ao_distance,
        photons,
        photon_radius,
        photon_alpha,
        photon_count,
        gather_rays,
        cache_error,
        cache_rays,
        view,
        metropolis_direct,
        metropolis_target,
        chains,
        bootstrap,
        large_step_probability,
        mutation_size,
    } = args;
    [
        ("max-depth", max_depth.is_some()),
        ("roulette-depth", roulette_depth.is_some()),
        ("directions", directions.is_some()),
        ("direct", direct.is_some()),
        ("mis", mis.is_some()),
        ("light-selection", light_selection.is_some()),
        ("triangle-sampling", triangle_sampling.is_some()),
        ("reuse", reuse.is_some()),
        ("light-samples", light_samples.is_some()),
        ("branching", branching.is_some()),
        ("ao-distance", ao_distance.is_some()),
        ("photons", photons.is_some()),
        ("photon-radius", photon_radius.is_some()),
        ("photon-alpha", photon_alpha.is_some()),
        ("photon-count", photon_count.is_some()),
        ("gather-rays", gather_rays.is_some()),
        ("cache-error", cache_error.is_some()),
        ("cache-rays", cache_rays.is_some()),
        ("view", view.is_some()),
        ("metropolis-direct", metropolis_direct.is_some()),
        ("metropolis-target", metropolis_target.is_some()),
        ("chains", chains.is_some()),
        ("bootstrap", bootstrap.is_some()),
        ("large-step-probability", large_step_probability.is_some()),
        ("mutation-size", mutation_size.is_some()),
    ]
}

/// What the flag says, if it does.
fn set<T>(slot: &mut T, flag: Option<T>) {
    if let Some(value) = flag {
        *slot = value;
    }
}

/// What the flag names, if it does.
fn set_named<T: Copy>(slot: &mut T, what: &str, flag: &Option<String>, known: &[(&str, T)]) -> Result<(), CliError> {
    let Some(name) = flag else { return Ok(()) };
    *slot = find(known, name).ok_or_else(|| {
        let names = join_names(known);
        CliError::Usage(format!("unknown {what} `{name}`\n  help: there is {names}"))
    })?;
    Ok(())
}

/// How PNG files show a picture: `tone`, unless flags say something else.
pub(super) fn tone(mut tone: Tone, args: &ToneArgs) -> Result<Tone, CliError> {
    set(&mut tone.exposure, args.exposure);
    set_named(&mut tone.curve, "tone", &args.tone, Curve::NAMES)?;
    Ok(tone)
}

/// How EXR files hold pictures.
pub(super) fn exr_format(args: &ExrArgs) -> Result<ExrFormat, CliError> {
    let mut format = ExrFormat::default();
    set_named(
        &mut format.compression,
        "compression",
        &args.compression,
        Compression::NAMES,
    )?;
    for name in &args.half {
        let layers = ExrFormat::HALF_LAYERS;
        match layers.iter().find(|layer| *layer == name) {
            Some(layer) => format.half.push(layer),
            None if name == "all" => format.half.extend(layers),
            None => {
                return Err(CliError::Usage(format!(
                    "--half {name}: no layer that may be held as half floats\n  help: use some of {}, or all",
                    layers.join(", ")
                )));
            }
        }
    }
    Ok(format)
}

/// A scene file, or the scene that a bare OBJ stands for, to be read as `args` and itself say.
pub(super) fn read_scene(path: &Path, args: &LoadArgs) -> Result<SceneFile, CliError> {
    let mut scene = match kind_of(path)? {
        SceneKind::Toml => SceneFile::load(path)?,
        SceneKind::Obj => SceneFile::of_obj(path),
    };
    scene.options = load_options(&scene, args)?;
    Ok(scene)
}

/// What describes a scene.
pub(super) enum SceneKind {
    Toml,
    Obj,
}

/// What the file is, by its name.
pub(super) fn kind_of(path: &Path) -> Result<SceneKind, FileError> {
    let refused = |message| FileError::new(path, message).help("give a .toml scene file or an .obj file");
    if path.as_os_str() == "-" {
        return Err(refused("a scene cannot be standard input"));
    }
    if path.is_dir() {
        return Err(refused("this is a directory, not a scene"));
    }
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("toml") => Ok(SceneKind::Toml),
        Some("obj") => Ok(SceneKind::Obj),
        _ => Err(refused("not a scene by its name")),
    }
}

/// How the files of a scene are read: as it says itself, and flags over it.
pub(super) fn load_options(scene: &SceneFile, args: &LoadArgs) -> Result<LoadOptions, CliError> {
    let mut options = scene.options;
    set_named(
        &mut options.mtl_dialect,
        "mtl-dialect",
        &args.mtl_dialect,
        MtlDialect::NAMES,
    )?;
    set_named(
        &mut options.texture_filter,
        "texture-filter",
        &args.texture_filter,
        TextureFilter::NAMES,
    )?;
    if let Some(degrees) = args.smooth.filter(|&degrees| !LoadOptions::is_angle(degrees)) {
        return Err(CliError::Usage(format!(
            "--smooth {degrees}\n  help: use a number above 0"
        )));
    }
    options.smooth = args.smooth.or(options.smooth);
    options.max_memory = args.max_memory;
    options.strict = args.strict;
    Ok(options)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_switch_has_a_flag() {
        let flags: BTreeSet<&str> = switches(&EstimatorArgs::default())
            .iter()
            .map(|(name, _)| *name)
            .collect();
        assert_eq!(flags, SWITCHES.iter().map(|switch| switch.name).collect());
    }
}
