//! Estimates of the memory that methods take beside the film.

use crate::film::{Filter, Rect};
use crate::integrator::{MAX_MERGED_PATHS, SurfaceAreas, visibility_bytes};
use crate::math::UVec2;
use crate::options::Method;
use crate::render::{Irradiance, IterationLight, iteration_bytes};
use crate::scene::Scene;

// Measured on Linux (glibc 2.41) by `peak_rss_bytes` of `--stats`, with 10⁵ and 3·10⁵ paths in plain rooms. How many vertices a path has depends on
// the scene, which is not asked: these are estimates.
/// Vertices of a path from a light: 2.4 in the Cornell box, 3.0 among the spheres.
const VERTICES_OF_A_PATH: u64 = 3;
/// Bytes of a photon of photon maps, while these are made: 93.
const BYTES_OF_A_MAPPED_PHOTON: u64 = 95;
/// Bytes of a photon of an iteration: 152 to 154; and once it has its place, by what is kept of it.
const BYTES_OF_A_NEW_PHOTON: u64 = 155;
const BYTES_OF_A_PHOTON: u64 = 80;
/// Bytes of a vertex to merge with: 494 to 512; more where materials vary.
const BYTES_OF_A_MERGED_VERTEX: u64 = 520;
/// Bytes of a sample of `pssmlt` that chains may start from: 24, in the part that made it and again when all are joined.
const BYTES_OF_A_BOOTSTRAP_PATH: u64 = 48;
/// Bytes of a sample of `mlt` that chains may start from: 222 in the Cornell box.
const BYTES_OF_A_SEED: u64 = 240;
/// Bytes of a record of irradiance, with its places in the cache, and of what finds it.
const BYTES_OF_A_RECORD: u64 = 200;

/// What the memory that a method takes depends on, beside its own parameters.
#[derive(Clone, Debug)]
pub struct PictureSize {
    /// Pixels of the whole picture.
    pub resolution: UVec2,
    /// The part of it that is rendered.
    pub crop: Rect,
    /// Pixel filter.
    pub filter: Filter,
    /// Threads that render.
    pub threads: usize,
    /// Whether groups of lights are distinguished.
    pub tells_groups: bool,
    /// Groups of lights, and classes of paths, that are distinguished.
    pub parts: usize,
}

/// Bytes that a method takes, about, beside the film.
#[derive(Clone, Copy, Debug, Default)]
pub struct MethodMemory {
    /// What all samples look at: it stays.
    pub prepared: u64,
    /// What an iteration takes while it is made.
    pub iteration: u64,
}

impl Method {
    /// About how many bytes it takes for a picture of that size.
    pub fn memory(&self, picture: &PictureSize, scene: &Scene) -> MethodMemory {
        let pixels = picture.resolution.x as u64 * picture.resolution.y as u64;
        let mut memory = self.own_memory(picture, scene, pixels);
        if self.weighs_lights() {
            memory.prepared = memory
                .prepared
                .saturating_add(visibility_bytes(scene, self.light_choice().mode, pixels));
        }
        memory
    }

    fn own_memory(&self, picture: &PictureSize, scene: &Scene, pixels: u64) -> MethodMemory {
        let vertices = VERTICES_OF_A_PATH.min(
            self.max_depth()
                .and_then(|depth| depth.0)
                .map_or(VERTICES_OF_A_PATH, u64::from),
        );
        let number = |given: Option<u32>, usual: u64| given.map_or(usual, u64::from);
        // Preparations of an iteration are made first, and kept while it runs.
        let iteration = |made: u64, kept: u64, light| MethodMemory {
            prepared: 0,
            iteration: made.max(kept.saturating_add(self.iteration_bytes(picture, light))),
        };
        match self {
            Self::Light(_) | Self::Bidirectional(_) => iteration(0, 0, IterationLight::OfPixels),
            Self::ProgressivePhotons(settings) => {
                // Those that come straight from a light are left out.
                let photons = number(settings.photons, pixels) * vertices.saturating_sub(1);
                iteration(
                    photons * BYTES_OF_A_NEW_PHOTON,
                    photons * BYTES_OF_A_PHOTON,
                    IterationLight::OfOnePixel,
                )
            }
            Self::VertexMerging(settings) => {
                let paths = number(settings.photons, pixels.min(u64::from(MAX_MERGED_PATHS)));
                iteration(0, paths * vertices * BYTES_OF_A_MERGED_VERTEX, IterationLight::OfPixels)
            }
            Self::PrimarySpace(settings) => {
                let bootstrap = number(settings.bootstrap, pixels / 8) * BYTES_OF_A_BOOTSTRAP_PATH;
                iteration(0, bootstrap, light_of_chains(settings.chains, pixels))
            }
            Self::PathSpace(settings) => {
                let seeds = number(settings.bootstrap, pixels / 8) * BYTES_OF_A_SEED;
                iteration(0, seeds, light_of_chains(settings.chains, pixels))
            }
            Self::Area(_) => MethodMemory {
                prepared: scene.placed_triangle_count() * SurfaceAreas::BYTES,
                iteration: 0,
            },
            Self::PhotonMap(settings) => MethodMemory {
                prepared: u64::from(settings.photons) * vertices * BYTES_OF_A_MAPPED_PHOTON,
                iteration: 0,
            },
            Self::IrradianceCache(_) => MethodMemory {
                prepared: Irradiance::max_records(picture.resolution) * BYTES_OF_A_RECORD,
                iteration: 0,
            },
            Self::Path(_)
            | Self::Naive(_)
            | Self::OneSample(_)
            | Self::Whitted(_)
            | Self::Distributed(_)
            | Self::Direct(_)
            | Self::AmbientOcclusion(_)
            | Self::Debug(_) => MethodMemory::default(),
        }
    }

    fn iteration_bytes(&self, picture: &PictureSize, light: IterationLight) -> u64 {
        iteration_bytes(
            picture.crop,
            (picture.tells_groups, picture.parts),
            (&picture.filter, light),
            picture.threads,
        )
    }
}

/// How light falls where Markov chains share a mutation for each of `pixels` pixels.
fn light_of_chains(chains: Option<u32>, pixels: u64) -> IterationLight {
    let chains = chains.map_or(pixels / 256, u64::from).clamp(1, pixels);
    IterationLight::OfChains {
        chains,
        mutations: pixels.div_ceil(chains),
    }
}
