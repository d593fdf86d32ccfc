//! Forecasts of a render's memory, and checks of them against limits and free memory.

use super::lighting::may_want_ground;
use super::{Error, Session, Settings};
use crate::description::SceneFile;
use crate::film::{Aov, Film};
use crate::io::{MemoryLimit, in_words};
use crate::lint::Forecast;
use crate::method::PictureSize;
use crate::scene::Scene;

impl Session {
    /// An error where the system does not give what the render takes besides the scene: backends and films that ask in vain end the program.
    pub(super) fn check_memory(&self) -> Result<(), Error> {
        let more = self.memory.saturating_sub(self.scene.bytes());
        match MemoryLimit::refusal(None, 0, more) {
            None => Ok(()),
            Some(refusal) => Err(Error::Failed(format!(
                "the render takes about {} besides its scene: {refusal}\n  help: allow more, or render a smaller picture or a --crop",
                in_words(more)
            ))),
        }
    }
}

/// What a render of the scene with these settings will take.
pub(crate) fn forecast(file: &SceneFile, scene: &Scene, settings: &Settings) -> Forecast {
    let paths = file.object.iter().map(|object| file.resolve(object.obj.get_ref()));
    let sizes = paths.filter_map(|path| Some(path.metadata().ok()?.len()));
    let forecast = forecast_of(scene, sizes.max().unwrap_or(0), settings);
    match settings.camera.needs_scene() || may_want_ground(file, settings, scene) {
        true => forecast.after_guess(settings.backend.for_guesses().name()),
        false => forecast,
    }
}

/// What a render of the scene will take whose largest OBJ file has so many bytes.
pub(super) fn forecast_of(scene: &Scene, largest_file: u64, settings: &Settings) -> Forecast {
    let method = settings.method().memory(&picture_size(settings, scene), scene);
    Forecast {
        prepared: method.prepared,
        sampling: method.iteration,
        channels: channel_bytes(settings, settings.parts_of_light(scene)),
        denoising: denoising_bytes(settings),
        ..Forecast::new(scene, settings.crop(), largest_file)
    }
}

/// What the memory of a method depends on.
fn picture_size(settings: &Settings, scene: &Scene) -> PictureSize {
    let classes = settings.paths().ok().flatten().map_or(0, |paths| paths.classes());
    PictureSize {
        resolution: settings.resolution,
        crop: settings.crop(),
        filter: settings.filter(),
        threads: settings.threads,
        tells_groups: settings.aovs.contains(&Aov::Lights),
        parts: settings.parts_of_light(scene) - settings.light_paths.len() + classes,
    }
}

/// An error where pixels with so many parts of the light take more memory than `limit`, or than the system gives.
pub(super) fn check_pixels(settings: &Settings, parts: usize, limit: Option<MemoryLimit>) -> Result<(), Error> {
    let crop = settings.crop();
    let of_settings = channel_bytes(settings, parts).saturating_add(denoising_bytes(settings));
    let bytes = Forecast::of_pixels(crop).saturating_add(of_settings);
    match MemoryLimit::refusal(limit, bytes, bytes) {
        None => Ok(()),
        Some(refusal) => {
            // The denoiser takes most of it.
            let denoised = settings
                .denoiser
                .map_or("", |_| "leave the denoiser out (--denoise=off), ");
            Err(Error::Failed(format!(
                "{}x{} pixels take about {}: {refusal}\n  help: {denoised}render a smaller picture (--size), or parts of it by --crop, or ask for fewer --aov",
                crop.size().x,
                crop.size().y,
                in_words(bytes)
            )))
        }
    }
}

/// The scene, compact if that is asked for or if only then its render keeps to `limit`, and about how many bytes that takes at most. An error,
/// before they are taken, where that is too much.
pub(super) fn within_memory(
    file: &SceneFile,
    settings: &Settings,
    scene: Scene,
    limit: Option<MemoryLimit>,
) -> Result<(Scene, u64), Error> {
    let needs = |scene: &Scene| {
        let forecast = forecast(file, scene, settings);
        let bytes = forecast.peak(settings.backend.name());
        let there = forecast.process + forecast.scene();
        (bytes, MemoryLimit::refusal(limit, bytes, bytes.saturating_sub(there)))
    };
    let scene = if settings.compact { scene.into_compact() } else { scene };
    let (usual, refusal) = needs(&scene);
    if refusal.is_none() {
        return Ok((scene, usual));
    }
    let scene = scene.into_compact();
    let (compact, refusal) = needs(&scene);
    let Some(refusal) = refusal else {
        return Ok((scene, compact));
    };
    let error = file.whole(format!("the render takes about {}: {refusal}", in_words(compact)));
    let help = match settings.method().kind().parameters().contains(&"photons") {
        true => "allow more, send fewer --photons, or render a smaller picture",
        false => "allow more, render a smaller picture or a --crop, or let objects share their OBJ",
    };
    Err(error.help(help).into())
}

/// Bytes of what the settings want of each pixel besides the picture, with so many parts of the light: sums and channels.
fn channel_bytes(settings: &Settings, parts: usize) -> u64 {
    let crop = settings.crop();
    let features = match settings.aovs.iter().any(|aov| aov.is_of_surface()) {
        true => Film::feature_bytes(crop),
        false => 0,
    };
    let alpha = match settings.backing().is_some() {
        true => Film::coverage_bytes(crop),
        false => 0,
    };
    let error_map = if settings.noise.is_some() { 4 * crop.area() } else { 0 };
    let all = [
        features,
        alpha,
        error_map,
        Film::aov_bytes(crop, &settings.aovs),
        Film::part_bytes(crop, parts),
    ];
    all.into_iter().fold(0, u64::saturating_add)
}

/// Bytes that denoising the picture takes besides.
fn denoising_bytes(settings: &Settings) -> u64 {
    /// Straight colours, albedos and normals of a picture with a channel of coverage.
    const ALPHA_BYTES: u64 = 120;
    let of_alpha = if settings.backing().is_some() {
        ALPHA_BYTES * settings.crop().area()
    } else {
        0
    };
    let size = settings.crop().size();
    let denoised = settings
        .denoiser
        .map(|denoiser| denoiser.bytes(denoiser.pixels(size)) + of_alpha);
    denoised.unwrap_or(0)
}
