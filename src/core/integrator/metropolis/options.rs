//! Options of both Metropolis integrators, and path tracing of the light that chains do not find.

use crate::accel::Accel;
use crate::integrator::path::state::PathState;
use crate::integrator::path_record;
use crate::integrator::{Heuristic, Integrator, PathIntegrator, RayKind, Roulette, Sink, Strategy, World};
use crate::material::BsdfSlot;
use crate::math::Vec2;
use crate::math::hash::{GOLDEN_GAMMA, mix};
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Options of Metropolis light transport.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Metropolis {
    /// Method for light that is scattered at most once, and for lamps seen in mirrors and through
    /// glass.
    pub direct: MetropolisDirect,
    /// Target function of the chains.
    pub target: MetropolisTarget,
    /// Number of chains in an iteration. `None`: chosen by the number of pixels.
    pub chains: Option<u32>,
    /// Number of bootstrap samples of bidirectional path tracing in an iteration. They estimate the
    /// total light and provide the start paths of chains. `None`: chosen by the number of pixels.
    pub bootstrap: Option<u32>,
    /// Probability of a large step, in [0, 1].
    pub large_step_probability: f32,
    /// Maximum small step, as a fraction of the range of a random number: above 0 and at most 0.5.
    pub mutation_size: f32,
}

/// Number of mutations per chain, by default. An iteration has one mutation per pixel.
const MUTATIONS_PER_CHAIN: u64 = 256;

/// Minimum default number of chains.
const MIN_CHAINS: u64 = 16;

impl Default for Metropolis {
    /// Default options. The step sizes are from Kelemen et al. (2002).
    fn default() -> Self {
        Self {
            direct: MetropolisDirect::Ordinary,
            target: MetropolisTarget::Relative,
            chains: None,
            bootstrap: None,
            large_step_probability: 0.3,
            mutation_size: 1.0 / 64.0,
        }
    }
}

/// Method for unscattered light, direct light, and lamps seen in mirrors and through glass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MetropolisDirect {
    /// Path tracing with one sample per pixel. Chains would mostly visit bright places, and would
    /// not reduce the error (Veach and Guibas 1997, §5.4).
    #[default]
    Ordinary,
    /// Chains, as for all other light.
    Metropolis,
}

/// Target function of Markov chains. Chains visit paths in proportion to the target.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MetropolisTarget {
    /// Luminance of the path.
    Luminance,
    /// Luminance of the path, divided by the
    /// [`ImportanceImage`](crate::integrator::ImportanceImage) at the film position of the path.
    /// Dark places then get about as many paths as bright places (two-stage Metropolis light
    /// transport, Veach and Guibas 1997).
    #[default]
    Relative,
}

/// Area of the film that contributes to pixels, including the width of the pixel filter.
/// Coordinates are in pixels, with the origin at the top left.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilmArea {
    min: Vec2,
    /// Width and height, in pixels.
    pub size: Vec2,
}

impl FilmArea {
    /// Film area that contributes to the pixels of `world`.
    pub fn of<A>(world: &World<A>) -> Self {
        let margin = if world.camera.repeats() {
            // Film points outside of the image have the same directions as points inside it.
            0.0
        } else {
            (world.filter.radius() - 0.5).max(0.0)
        };
        Self {
            min: Vec2::splat(-margin),
            size: world.camera.resolution().as_vec2() + 2.0 * margin,
        }
    }

    /// Size of the area, in square pixels.
    pub fn area(&self) -> f32 {
        self.size.x * self.size.y
    }

    /// Film point at the position `u` of the unit square.
    pub fn at(&self, u: Vec2) -> Vec2 {
        self.min + u * self.size
    }

    /// Returns `true` if the film point `place` contributes to any pixel.
    pub fn contains(&self, place: Vec2) -> bool {
        place.cmpge(self.min).all() && place.cmplt(self.min + self.size).all()
    }
}

/// Number of mutations of an iteration: one per pixel.
pub(crate) fn mutations<A>(world: &World<A>) -> u64 {
    let size = world.camera.resolution();
    size.x as u64 * size.y as u64
}

/// Number of mutations of chain `index` in an iteration with `chains` chains and `mutations`
/// mutations.
pub(crate) fn mutations_of_chain(mutations: u64, index: u32, chains: u32) -> u64 {
    let share = |i: u64| mutations * i / chains as u64;
    share(index as u64 + 1) - share(index as u64)
}

impl Metropolis {
    /// Traces the sample `key` of a pixel. `ordinary` finds the light that chains do not find. If
    /// chains find all light, only the first surface is found, for the auxiliary channels.
    pub(crate) fn sample_pixel<A: Accel, S: Sampler>(
        &self,
        ordinary: &OrdinaryLight<A>,
        key: SampleKey,
        sampler: &mut S,
        out: &mut impl Sink,
    ) {
        match self.direct {
            MetropolisDirect::Ordinary => ordinary.sample(key, sampler, out),
            MetropolisDirect::Metropolis => {
                ordinary.world.first_vertex(key, sampler, &BsdfSlot::new(), out);
            }
        }
    }

    /// Returns `true` if chains find all light, including the light of [`OrdinaryLight`].
    pub(crate) fn carries_all(&self) -> bool {
        self.direct == MetropolisDirect::Metropolis
    }

    /// Number of chains of an iteration with `mutations` mutations.
    pub(crate) fn chains(&self, mutations: u64) -> u32 {
        let usual = (mutations / MUTATIONS_PER_CHAIN).max(MIN_CHAINS);
        let chains = self.chains.map_or(usual, u64::from);
        chains.clamp(1, mutations) as u32
    }

    /// Minimum number of vertices of the paths of chains.
    pub(crate) fn min_vertices(&self) -> usize {
        if self.carries_all() { 2 } else { 4 }
    }
}

/// Path tracing of the light that chains do not find: light that is scattered at most once, and
/// lamps seen in mirrors and through glass. Camera paths find these lamps easily. The lamps cover
/// few bright pixels, and chains would either stay at these pixels or never visit them.
#[derive(Debug)]
pub(crate) struct OrdinaryLight<'a, A> {
    pub world: World<'a, A>,
    pub heuristic: Heuristic,
    /// Maximum number of scattering events of a path. `None`: no maximum.
    pub max_depth: Option<u32>,
    pub roulette: Roulette,
    pub light_samples: u32,
}

impl<A: Accel> OrdinaryLight<'_, A> {
    /// Traces the sample `key`.
    pub fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let direct = PathIntegrator {
            world: self.world,
            strategy: Strategy {
                heuristic: self.heuristic,
                ..Strategy::default()
            },
            max_depth: Some(self.max_depth.map_or(1, |depth| depth.min(1))),
            roulette: self.roulette,
            light_samples: self.light_samples,
            clamp_indirect: None,
        };
        direct.sample(key, sampler, out);
        self.sample_lamps(key, sampler, out);
    }

    /// Adds the emission that the camera path hits after at least two delta lobes and no other
    /// lobe.
    fn sample_lamps<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        let world = &self.world;
        let mut path = PathState::new(world.camera_ray(key, None, sampler, out));
        for depth in 0..=self.max_depth.unwrap_or(u32::MAX) {
            let (hit, transmittance) = world.intersect(&path.ray, RayKind::Bounce, out);
            path.beta *= transmittance;
            let slot = BsdfSlot::new();
            let vertex = hit.map(|hit| world.vertex(&hit, &path.ray, None, &slot));
            if let Some(vertex) = &vertex {
                path_record::vertex(depth, vertex, path.beta, out);
            }
            if depth > 1 {
                Strategy::default().add_found(world, &path, vertex.as_ref(), out);
            }
            let Some(vertex) = vertex else { return };
            let u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let sample = vertex.sample(u_lobe, u);
            let Some(sample) = sample.filter(|sample| sample.is_delta()) else {
                return;
            };
            let judged = path.beta * sample.weight * (path.roulette_scale * (sample.eta * sample.eta));
            let u = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions)).y;
            let Some(factor) = self.roulette.play(depth, judged, u) else {
                return;
            };
            path.advance(path.scatter(world, &vertex, &sample, factor, 1, out));
        }
    }
}

/// Hash of the current sample of `sampler`. It is the key of a chain's random numbers.
pub(crate) fn name(sampler: &impl Sampler) -> u64 {
    let [a, b] = [Dimension::PIXEL, Dimension::LENS].map(|dimension| sampler.get_2d(dimension));
    let word = |x: f32, y: f32| ((x.to_bits() as u64) << 32) | y.to_bits() as u64;
    mix(mix(word(a.x, a.y).wrapping_add(GOLDEN_GAMMA)) ^ word(b.x, b.y))
}
