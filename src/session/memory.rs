//! Memory of a render. It is estimated from the numbers of pixels and triangles, and compared with
//! the limit of the settings and with free memory.

use super::{Error, Session, Settings};
use crate::files::{MemoryLimit, in_words};
use crate::film::{Aov, Film, Rect};
use crate::integrator::MAX_MERGED_PATHS;
use crate::options::ChosenIntegrator;
use crate::scene::Scene;
use crate::scene_file::SceneFile;

/// Bytes of the program with its libraries and threads.
const PROCESS: u64 = 25 << 20;
/// Bytes per triangle of an acceleration structure. Measurements gave 64 to 79, without memory for
/// the build.
const ACCELERATION: u64 = 80;
/// Bytes per triangle of Embree's structure for a compact scene.
const COMPACT_ACCELERATION: u64 = 40;
/// Bytes per pixel to make and write pictures.
const WRITING: u64 = 124;
/// Further bytes per pixel to denoise a picture with a backing (a transparent or coloured
/// background): colours, albedos and normals of the objects are separate.
const DENOISED_ALPHA: u64 = 120;

/// Estimated memory of a render in bytes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Memory {
    /// Bytes of the scene's arrays.
    pub scene: u64,
    /// Bytes of the acceleration structure.
    pub acceleration: u64,
    /// Bytes of light that the integrator stores, such as photons.
    pub light: u64,
    /// Bytes of sums and channels of the film.
    pub film: u64,
    /// Bytes to denoise and write the pictures.
    pub picture: u64,
}

impl Memory {
    /// Estimates the memory of a render of `scene`.
    pub fn new(scene: &Scene, settings: &Settings) -> Self {
        let per_triangle = if scene.is_compact() {
            COMPACT_ACCELERATION
        } else {
            ACCELERATION
        };
        Self {
            scene: scene.bytes(),
            acceleration: per_triangle * scene.triangle_count(),
            light: light_bytes(settings, scene),
            film: film_bytes(settings, settings.parts_of_light(scene)),
            picture: picture_bytes(settings),
        }
    }

    /// Sum of all fields, and the bytes of the program.
    pub fn peak(&self) -> u64 {
        let parts = [self.scene, self.acceleration, self.light, self.film, self.picture];
        parts.into_iter().fold(PROCESS, u64::saturating_add)
    }
}

impl Session {
    /// Returns an error if the system lacks memory for the render. The memory of the scene is not
    /// counted, because the scene is already loaded. Without this check the program would abort,
    /// because backends and films do not handle failed allocations.
    pub(super) fn check_memory(&self) -> Result<(), Error> {
        let more = self.memory.saturating_sub(self.scene.bytes());
        match MemoryLimit::refusal(None, 0, more) {
            None => Ok(()),
            Some(refusal) => Err(Error::Failed(format!(
                "the render takes about {} besides its scene: {refusal}\n  help: free memory, or render a smaller picture (--size) or a part of it (--crop)",
                in_words(more)
            ))),
        }
    }
}

/// Returns an error if the pixels need more memory than `limit`, or more than the system has.
/// `parts` is the number of light layers.
pub(super) fn check_pixels(settings: &Settings, parts: usize, limit: Option<MemoryLimit>) -> Result<(), Error> {
    let crop = settings.crop();
    let bytes = film_bytes(settings, parts).saturating_add(picture_bytes(settings));
    match MemoryLimit::refusal(limit, bytes, bytes) {
        None => Ok(()),
        Some(refusal) => {
            // The denoiser needs most of the memory for pixels
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

/// Returns the scene and the estimated bytes of the render. If the settings require a compact
/// scene, or if the render fits `limit` only with a compact scene, the scene is made compact.
/// Returns an error if the render exceeds the limit.
pub(super) fn within_memory(
    file: &SceneFile,
    settings: &Settings,
    scene: Scene,
    limit: Option<MemoryLimit>,
) -> Result<(Scene, u64), Error> {
    let needs = |scene: &Scene| {
        let memory = Memory::new(scene, settings);
        let peak = memory.peak();
        let more = peak.saturating_sub(PROCESS + memory.scene);
        (peak, MemoryLimit::refusal(limit, peak, more))
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
    let help = if settings.chosen_integrator().kind().parameters().contains(&"photons") {
        "allow more (--max-memory), send fewer --photons, or render a smaller picture (--size)"
    } else {
        "allow more (--max-memory), render a smaller picture (--size) or a part of it (--crop), or let equal objects use the same OBJ file, which is then loaded once"
    };
    Err(error.help(help).into())
}

/// Bytes of sums and channels of all pixels. `parts` is the number of light layers.
fn film_bytes(settings: &Settings, parts: usize) -> u64 {
    let crop = settings.crop();
    let optional = |is_there: bool, bytes: fn(Rect) -> u64| if is_there { bytes(crop) } else { 0 };
    let all = [
        Film::bytes(crop, settings.samples().len() as u32),
        optional(
            settings.aovs.iter().any(|aov| Aov::is_of_surface(*aov)),
            Film::feature_bytes,
        ),
        optional(settings.backing().is_some(), Film::coverage_bytes),
        optional(settings.noise.is_some(), |crop| 4 * crop.area()),
        Film::aov_bytes(crop, &settings.aovs),
        Film::part_bytes(crop, parts),
    ];
    all.into_iter().fold(0, u64::saturating_add)
}

/// Bytes to denoise and write the picture.
fn picture_bytes(settings: &Settings) -> u64 {
    let (size, area) = (settings.crop().size(), settings.crop().area());
    let denoising = settings.denoiser.map_or(0, |denoiser| {
        let alpha = if settings.backing().is_some() {
            DENOISED_ALPHA
        } else {
            0
        };
        denoiser.bytes(denoiser.pixels(size)).saturating_add(alpha * area)
    });
    denoising.saturating_add(WRITING.saturating_mul(area))
}

/// Bytes of the light that the integrator stores. They depend on the number of vertices of a path,
/// which depends on the scene. We assume three vertices, as in plain rooms.
fn light_bytes(settings: &Settings, scene: &Scene) -> u64 {
    /// Bytes of the photons of one light path. `MERGED_PATH` also includes the camera path with
    /// which vertex merging merges the light path.
    const PHOTONS: u64 = 310;
    const MERGED_PATH: u64 = 1560;
    /// Bytes of a path from which a Markov chain may start, in path space and in primary sample
    /// space.
    const SEED: u64 = 240;
    const PRIMARY_SEED: u64 = 48;
    /// Bytes per triangle that the integrator `area` samples.
    const TRIANGLE: u64 = 24;
    let pixels = u64::from(settings.resolution.x) * u64::from(settings.resolution.y);
    let number = |given: Option<u32>, usual: u64| given.map_or(usual, u64::from);
    // An iteration has its own sums. The light of some pixels is stored before it is added to these
    // sums
    let iteration = 64 * pixels + (400 * pixels).min(128 << 20);
    match settings.chosen_integrator() {
        ChosenIntegrator::Light(_) | ChosenIntegrator::Bidirectional(_) => iteration,
        ChosenIntegrator::ProgressivePhotons(set) => iteration + PHOTONS * number(set.photons, pixels),
        ChosenIntegrator::VertexMerging(set) => {
            iteration + MERGED_PATH * number(set.photons, pixels.min(u64::from(MAX_MERGED_PATHS)))
        }
        ChosenIntegrator::PrimarySpace(set) => iteration + PRIMARY_SEED * number(set.bootstrap, pixels / 8),
        ChosenIntegrator::PathSpace(set) => iteration + SEED * number(set.bootstrap, pixels / 8),
        ChosenIntegrator::PhotonMap(set) => PHOTONS * u64::from(set.photons),
        ChosenIntegrator::Area(_) => TRIANGLE * scene.placed_triangle_count(),
        _ => 0,
    }
}
