use crate::accel::Accel;
use crate::color::Spectrum;
use crate::integrator::path_record;
use crate::integrator::trail::Trail;
use crate::integrator::{Directions, Gathered, Integrator, RayKind, Roulette, Sink, Strategy, World};
use crate::light::LightSampleContext;
use crate::material::BsdfSlot;
use crate::sampler::{Bounce, Dimension, SampleKey, Sampler};

/// Kajiya's path tracing by brute force: light counts only where a path happens to meet it (Kajiya 1986). A surface emits or reflects, by the flip of a
/// coin.
///
/// Its probabilities are those of textbooks, where each event has a chance of its own. They are free, so that their cost can be seen; the path tracer
/// keeps them as factors of its throughput, which has less error.
#[derive(Debug)]
pub struct NaiveIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How directions are drawn.
    pub directions: Directions,
    /// Where the coin is flipped that decides between emission and reflection.
    pub emission_coin: EmissionCoin,
    /// Probability that the coin chooses emission, in (0, 1).
    pub emission_probability: f32,
    /// How absorption counts.
    pub absorption: Absorption,
    /// Maximum number of scattering events; `None` leaves the end to roulette.
    pub max_depth: Option<u32>,
    /// Russian roulette.
    pub roulette: Roulette,
}

/// Where a coin decides between emission and reflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EmissionCoin {
    /// On surfaces that do both.
    #[default]
    Emitters,
    /// On all surfaces: where the coin chooses the emission of a surface that has none, the path ends without light.
    EveryHit,
}

/// How the light counts that surfaces absorb.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Absorption {
    /// As a factor of the throughput; lobes are chosen by their shares of what is reflected.
    #[default]
    Weight,
    /// By chance: lobes are chosen by their albedos, and the path ends with the probability that remains (analog Monte Carlo).
    Chance,
}

impl<'a, A> NaiveIntegrator<'a, A> {
    /// Kajiya's own: uniform directions, a fair coin where a surface emits and reflects, and absorption as a weight.
    pub fn new(world: World<'a, A>, max_depth: Option<u32>, roulette: Roulette) -> Self {
        Self {
            world,
            directions: Directions::Uniform,
            emission_coin: EmissionCoin::Emitters,
            emission_probability: 0.5,
            absorption: Absorption::Weight,
            max_depth,
            roulette,
        }
    }
}

impl<A: Accel> Integrator for NaiveIntegrator<'_, A> {
    fn sample<S: Sampler>(&self, key: SampleKey, sampler: &mut S, out: &mut impl Sink) {
        self.follow(key, sampler, out);
    }
}

impl<A: Accel> NaiveIntegrator<'_, A> {
    /// Follows the path of the sample `key`.
    fn follow<R: Gathered>(&self, key: SampleKey, sampler: &mut impl Sampler, out: &mut impl Sink<Radiance = R>) {
        let mut trail = Trail::<R>::new();
        let world = &self.world;
        let mut ray = world.camera_ray(key, None, sampler, out);
        let mut beta = Spectrum::ONE;
        let mut eta_squared = 1.0;
        let wavelength = world.wavelength(sampler);
        let mut is_dispersed = false;

        for depth in 0.. {
            let decisions = sampler.get_2d(Dimension::bounce(depth, Bounce::Decisions));
            let kind = if depth == 0 { RayKind::Camera } else { RayKind::Bounce };
            let (hit, transmittance) = world.intersect(&ray, kind, out);
            beta *= transmittance;
            let Some(hit) = hit else {
                if depth == 0 && world.see_background(&ray, beta, out) {
                    return;
                }
                Strategy::default().record_emitted(world.scene, &ray, None, None, out);
                Strategy::default().found(world.scene, &ray, None, beta, None, |light: R| {
                    out.radiance(trail.arriving(light, world.paths));
                });
                return;
            };
            let slot = BsdfSlot::new();
            let mut vertex = world.vertex(&hit, &ray, &slot);
            let bsdf = wavelength
                .as_ref()
                .and_then(|wavelength| world.dispersed(&hit, &slot, wavelength));
            let disperses = bsdf.is_some();
            vertex.bsdf = bsdf.unwrap_or(vertex.bsdf);
            if depth == 0 {
                world.see((&hit, &vertex), (&ray, beta), out);
            }

            path_record::vertex(depth, (&hit, &vertex), beta, out);

            // Emit or reflect, by the flip of a coin
            let emitted = world.scene.emitted(
                &hit,
                &LightSampleContext::any_side(ray.origin),
                vertex.point.p,
                ray.direction,
                ray.time,
            );
            let emitted = emitted.filter(|light| !light.radiance.is_black());
            let reflects = self.max_depth.is_none_or(|max| depth < max) && !vertex.bsdf.albedo().is_black();
            let probability = match (reflects, self.emission_coin, emitted) {
                (false, ..) => 1.0,
                (true, EmissionCoin::Emitters, None) => 0.0,
                (true, ..) => self.emission_probability,
            };
            // ANCHOR: emit
            if decisions.x < probability {
                if let Some(light) = emitted {
                    Strategy::default().record_emitted(world.scene, &ray, None, Some((&hit, &vertex)), out);
                    let radiance = beta * light.radiance / probability;
                    let light = R::of_light(radiance, light.id, world.scene);
                    out.radiance(trail.arriving(light, world.paths));
                }
                return;
            }
            beta = beta / (1.0 - probability);
            // ANCHOR_END: emit

            // Choose a lobe, or absorption
            let mut u_lobe = sampler.get_1d(Dimension::bounce(depth, Bounce::Lobe));
            if self.absorption == Absorption::Chance {
                let albedo = vertex.bsdf.albedo().max_component().min(1.0);
                if u_lobe >= albedo {
                    return;
                }
                u_lobe /= albedo;
                beta = beta / albedo;
            }

            // ANCHOR: reflect
            // Go on in a direction of that lobe
            let direction = sampler.get_2d(Dimension::bounce(depth, Bounce::Direction));
            let sample = self.directions.sample(&vertex, u_lobe, direction);
            let Some(sample) = sample else { return };
            if R::TELLS_PATHS {
                trail.go_on(vertex.event(sample.wi, sample.is_delta()));
            }
            beta *= sample.weight;
            // From the first glass on that disperses it, the light is of one wavelength.
            if let Some(wavelength) = wavelength.as_ref().filter(|_| disperses && !is_dispersed) {
                beta *= Spectrum::from(wavelength.weight);
                is_dispersed = true;
            }
            eta_squared *= sample.eta * sample.eta;
            let Some(factor) = self.roulette.play(depth, beta * eta_squared, decisions.y) else {
                return;
            };
            path_record::scatter(depth, &vertex, &sample, factor, out);
            beta *= factor;
            ray = world.ray_along(&vertex, sample.wi);
            // ANCHOR_END: reflect
        }
    }
}
