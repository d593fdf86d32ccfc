//! Multiplexed Metropolis light transport in primary sample space (Kelemen et al. 2002; Hachisuka,
//! Kaplanyan and Dachsbacher 2014).
//!
//! A chain mutates the random numbers that make a path, and does not depend on surfaces.
//! `bidirectional/connection` makes paths from the numbers as for `bdpt`. `sampler/primary.rs` is a
//! sampler with the numbers of a chain. One additional number chooses among the strategies (s, t)
//! for a path of the chain's length, so a chain prefers the best strategies for its current path.
//! The numbers of the camera end, of the light end and of this choice are different dimensions. So
//! the ends stay the same if another strategy is tried. An iteration takes half the time of an
//! iteration of `bdpt`.
//!
//! Each iteration has separate seeds and chains. A seed is one path of a sample of `bdpt`. This
//! path is chosen among all paths of the sample in proportion to their targets. The weight of the
//! seed is the sum of the targets of all these paths. Chains start at seeds in proportion to the
//! weights of the seeds. Seeds are sorted by length, and each chain chooses its seed in a separate
//! stratum of the sum of all weights. All chains share this sum; `PrimarySpaceIntegrator` derives
//! that an iteration is then unbiased.
//!
//! A seed may be on a spike of the target, where small steps find only the spike itself. Chains
//! that start at this seed stay at the spike. One pixel then gets the whole light of these chains,
//! which is the light of the seed. An alternative is to sample the length and the strategy of the
//! seed at random too (to multiplex the bootstrap). The light of the seed is then divided by both
//! probabilities, which makes it some hundred times brighter. On the scene `ring-caustic` single
//! pixels then were 64 times too bright after 2048 iterations. A seed that represents all paths of
//! its sample is as bright as in `bdpt`, times the number of mutations per seed.
//!
//! Defaults (docs/notebook/2026-11.md, "Metropolis light transport"): one chain per 256 mutations
//! is a compromise between scenes with easy light and scenes with hidden light. Step sizes and the
//! probability of large steps are from Kelemen et al.

use super::options::{FilmArea, OrdinaryLight, mutations, mutations_of_chain, name};
use super::visits::Visits;
use crate::accel::Accel;
use crate::integrator::bidirectional::connection::{Connector, Contribution, Subpaths};
use crate::integrator::bidirectional::subpath::max_vertices;
use crate::integrator::{
    Heuristic, ImportanceImage, IterationIntegrator, Metropolis, PathEvent, RaySink, Roulette, SplatSink, World,
};
use crate::math::hash::{GOLDEN_GAMMA, mix, unit_f64};
use crate::sampler::{Dimension, PrimarySampler, SampleKey, Sampler, Step, Stream};
use std::ops::RangeInclusive;

/// Metropolis light transport in the space of primary samples (Kelemen, Szirmay-Kalos, Antal and
/// Csonka 2002), multiplexed (Hachisuka, Kaplanyan and Dachsbacher 2014): Markov chains that visit
/// paths in proportion to their target.
///
/// The state of a chain is the random numbers u of a path with a fixed number of vertices n. One of
/// these numbers chooses among the n strategies of bidirectional path tracing for such a path. Let
/// f(u) be the contribution of the strategy, times its MIS weight and n. The integral of f is the
/// light of all paths of n vertices. The target f*(u) of the chain is the luminance of f(u),
/// divided by the importance image at its position, and b is the integral of f* over all u and n.
/// The chain moves from u to the proposal v with probability a = min(1, f*(v) / f*(u)). Both u and
/// v add the light b f / f* to the image. This light is multiplied by 1 − a for u and by a for v,
/// which gives the mean over the random decision (Veach and Guibas 1997).
///
/// **Each iteration is unbiased.** It first makes M seeds. For a seed, all random numbers are drawn
/// except the number that chooses the strategy. From these numbers, the paths of all strategies for
/// all n are made. Each strategy adds the target f* / n to b. One strategy is sampled in proportion
/// to this target. The weight w of the seed is the sum over all strategies, divided by M; the sum B
/// of the weights has the mean b. Chains start at seeds sampled by these weights: of C chains, `C w
/// / B` are expected to start at a seed.
///
/// If the chain at u adds g(u) = f(u) / f*(u), all chains at their starts add B / C times the sum
/// of g over the starts. Given the seeds, the mean of this light is Σ w g, whose mean over the
/// seeds is ∫ f* g = ∫ f, for any M and C. The same is true of any function in place of g. One such
/// function is the mean contribution of the chain after i steps, (Kⁱ g)(u). The mean of Σ w Kⁱ g is
/// ∫ f* Kⁱ g. This integral equals ∫ f* g = ∫ f, because steps preserve f*. There is no start-up
/// bias to be discarded (Veach 1997, §11.3.1), and a chain may have any length. The light of a
/// short chain is as noisy as the light of the seeds.
#[derive(Debug)]
pub struct PrimarySpaceIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// MIS heuristic of the strategies.
    pub heuristic: Heuristic,
    /// Maximum number of scattering events. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Number of light samples per pixel in an iteration, if path tracing finds direct light.
    pub light_samples: u32,
    /// Options of the chains.
    pub metropolis: Metropolis,
    /// Importance image. The target is the luminance of a path divided by this image.
    pub importance: &'a ImportanceImage,
}

/// Number of mutations per bootstrap sample of bidirectional path tracing.
const MUTATIONS_PER_SEED: u64 = 8;
/// Minimum number of bootstrap samples in an iteration.
const MIN_SEEDS: u64 = 512;
/// Number of bootstrap samples in a work item.
const SEEDS_AT_ONCE: u32 = 64;

/// A seed: a path that chains may start from.
#[derive(Debug)]
pub struct Seed {
    /// Key of the random numbers of the path.
    origin: u64,
    /// Number of vertices.
    length: u32,
    /// Number of camera vertices.
    from_camera: u32,
    /// Sum of the targets of all paths of the bootstrap sample. After seeds are joined: sum of the
    /// weights of all seeds up to this seed.
    weight: f64,
}

/// Properties that all paths of a chain have in common.
#[derive(Clone, Copy, Debug)]
struct PathShape {
    /// Number of vertices.
    length: usize,
    /// Offset that is added to the strategy that the numbers choose. It makes the numbers of a seed
    /// choose the strategy of the seed.
    turn: usize,
}

impl PathShape {
    /// Shape with which the numbers of `seed` make the path of the seed.
    fn of(seed: &Seed) -> Self {
        let length = seed.length as usize;
        let chosen = Self { length, turn: 0 }.camera_vertices(&PrimarySampler::new(seed.origin));
        Self {
            length,
            turn: (seed.from_camera as usize + length - chosen) % length,
        }
    }

    /// Number of camera vertices in the strategy that `numbers` choose.
    fn camera_vertices(self, numbers: &impl Sampler) -> usize {
        let choice = numbers.get_1d(Dimension::TECHNIQUE);
        let chosen = ((choice * self.length as f32) as usize).min(self.length - 1);
        1 + (chosen + self.turn) % self.length
    }
}

/// State of a chain: the path made from its random numbers.
#[derive(Default)]
struct State {
    /// Contributions of the path, each with its film position.
    found: Vec<Contribution>,
    /// Target of the path: luminance of its contributions, divided by the importance image.
    target: f32,
    /// Expected number of the chain's mutations that are in this state.
    share: f64,
    /// Recorded events of the path, if the sink records paths.
    record: Vec<PathEvent>,
}

impl State {
    /// Adds `share` to the visits of the pixel at the film position of the path.
    fn visit(&self, visits: &mut Visits) {
        let place = self.found.first().and_then(|contribution| contribution.film);
        if let Some(film) = place.filter(|_| self.target > 0.0 && self.share > 0.0) {
            visits.add(film, self.share);
        }
    }
}

impl<A: Accel> IterationIntegrator for PrimarySpaceIntegrator<'_, A> {
    type PreparationPart = Vec<Seed>;
    type Preparation = Vec<Seed>;

    fn preparations(&self) -> u32 {
        if self.lengths().is_empty() {
            0
        } else {
            self.seeds().div_ceil(SEEDS_AT_ONCE)
        }
    }

    fn prepare<S: Sampler>(&self, iteration: u32, index: u32, sampler: &mut S, out: &mut impl RaySink) -> Vec<Seed> {
        sampler.start(SampleKey::of_stream(Stream::Bootstrap, index, iteration));
        let (name, count) = (name(sampler), self.seeds());
        let first = index * SEEDS_AT_ONCE;
        let samples = first..first.saturating_add(SEEDS_AT_ONCE).min(count);
        let seed = |i: u32| {
            let origin = mix(name.wrapping_add((i as u64 + 1).wrapping_mul(GOLDEN_GAMMA)));
            self.seed(origin, out)
        };
        let mut seeds = Vec::with_capacity(samples.len());
        seeds.extend(samples.filter_map(seed));
        seeds
    }

    fn join(&self, _: u32, parts: Vec<Vec<Seed>>) -> Vec<Seed> {
        // Sort seeds by length, so that every length gets a proportional number of chains
        let mut seeds = Vec::with_capacity(parts.iter().map(Vec::len).sum());
        seeds.extend(parts.into_iter().flatten());
        seeds.sort_by_key(|seed| seed.length);
        let count = self.seeds() as f64;
        let mut sum = 0.0;
        for seed in &mut seeds {
            sum += seed.weight / count;
            seed.weight = sum;
        }
        seeds
    }

    fn repeats(&self) -> bool {
        self.world.camera.repeats()
    }

    fn sends_light(&self) -> bool {
        // Chains contribute to any pixel, also for a crop. Samples contribute only to their own
        // pixel
        false
    }

    fn sample<S: Sampler>(&self, _: &Vec<Seed>, key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        let ordinary = OrdinaryLight {
            world: self.world,
            heuristic: self.heuristic,
            max_depth: self.max_depth,
            roulette: Roulette::default(),
            light_samples: self.light_samples,
        };
        self.metropolis.sample_pixel(&ordinary, key, sampler, out);
    }

    fn chains(&self) -> u32 {
        self.metropolis.chains(mutations(&self.world))
    }

    fn chain<S: Sampler>(
        &self,
        seeds: &Vec<Seed>,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl SplatSink,
    ) {
        // Choose the seed of the chain. Each chain has a stratum of the total weight.
        sampler.start(SampleKey::of_stream(Stream::Chains, index, iteration));
        let (name, chains) = (name(sampler), self.chains());
        let light = seeds.last().map_or(0.0, |seed| seed.weight);
        let target = light * (index as f64 + unit_f64(mix(name))) / chains as f64;
        let start = seeds.partition_point(|seed| seed.weight <= target);
        let Some(seed) = seeds.get(start.min(seeds.len().saturating_sub(1))) else {
            return;
        };
        let shape = PathShape::of(seed);
        let Metropolis {
            large_step_probability,
            mutation_size,
            ..
        } = self.metropolis;
        let dimensions = Dimension::end(2 * seed.length);
        let mut numbers = PrimarySampler::chain(seed.origin, name, mutation_size, dimensions);
        let mut current = self.state(shape, &numbers, out);

        // Compute the number of mutations of the chain, and the scale of the light that they add
        let mutations = mutations_of_chain(mutations(&self.world), index, chains);
        let scale = light / (chains as f64 * mutations as f64);
        let mut counts = [[0; 2]; 2];
        let mut visits = Visits::default();
        for _ in 0..mutations {
            if out.is_cancelled() {
                return;
            }
            // ANCHOR: step
            let step = numbers.propose(large_step_probability);
            let mut proposal = self.state(shape, &numbers, out);
            let acceptance = if current.target > 0.0 {
                (proposal.target / current.target).min(1.0)
            } else {
                1.0
            };
            current.share += 1.0 - acceptance as f64;
            proposal.share = acceptance as f64;
            let is_accepted = numbers.decide(acceptance);
            if is_accepted {
                std::mem::swap(&mut current, &mut proposal);
            }
            self.add(&proposal, scale, out);
            // ANCHOR_END: step
            proposal.visit(&mut visits);
            let count = &mut counts[usize::from(step == Step::Small)];
            *count = [count[0] + 1, count[1] + u64::from(is_accepted)];
        }
        self.add(&current, scale, out);
        current.visit(&mut visits);
        out.chain(visits.counts(mutations));
        let [large, small] = counts;
        out.mutation("large", large[0], large[1]);
        out.mutation("small", small[0], small[1]);
    }
}

impl<'a, A: Accel> PrimarySpaceIntegrator<'a, A> {
    /// Number of bootstrap samples in an iteration.
    fn seeds(&self) -> u32 {
        let usual = (mutations(&self.world) / MUTATIONS_PER_SEED).max(MIN_SEEDS);
        let max = u32::MAX - SEEDS_AT_ONCE;
        self.metropolis
            .bootstrap
            .map_or(usual.min(max as u64) as u32, |n| n.clamp(1, max))
    }

    /// Minimum and maximum number of vertices of the paths of chains.
    fn lengths(&self) -> RangeInclusive<usize> {
        self.metropolis.min_vertices()..=max_vertices(self.max_depth)
    }

    /// Traces the bootstrap sample with the key `origin`, and chooses one of its paths as seed.
    /// `None` if the sample has no light for chains.
    fn seed(&self, origin: u64, out: &mut impl RaySink) -> Option<Seed> {
        // Trace both subpaths, and connect them by all strategies
        let numbers = PrimarySampler::new(origin);
        let area = FilmArea::of(&self.world);
        let film = area.at(numbers.get_2d(Dimension::PIXEL));
        let ray = self.world.ray_through(film, self.world.time(&numbers), &numbers);
        let connector = Connector::new(&self.world, self.heuristic, Roulette::default(), self.max_depth);
        let mut paths = connector.subpaths(ray, &numbers, out);
        let mut found = Vec::new();
        let min_vertices = self.metropolis.min_vertices();
        connector.all_of(min_vertices, &mut paths, &numbers, out, |contribution| {
            found.push(contribution)
        });

        // Choose one of the paths, in proportion to its target
        let size = self.world.camera.resolution().as_vec2();
        let target = |c: &Contribution| {
            let is_lamp =
                c.strategy.0 == 0 && !self.metropolis.carries_all() && paths.is_light_seen_by_delta(c.strategy.1);
            let (place, scale) = match c.film {
                Some(place) => (place, size.x * size.y),
                None => (film, area.area()),
            };
            let radiance = c.radiance * (c.weight * scale);
            let is_seen = area.contains(place) && self.world.camera.sees(place);
            let is_light = radiance.is_valid() && is_seen && !is_lamp;
            let target = radiance.luminance() as f64 / self.importance.at(place) as f64;
            if is_light && target.is_finite() { target } else { 0.0 }
        };
        let targets: Vec<f64> = found.iter().map(target).collect();
        let weight: f64 = targets.iter().sum();
        let mut left = weight * unit_f64(mix(!origin));
        let chosen = targets.iter().position(|target| {
            left -= target;
            left < 0.0
        });
        let (s, t) = found.get(chosen?)?.strategy;
        Some(Seed {
            origin,
            length: (s + t) as u32,
            from_camera: t as u32,
            weight,
        })
    }

    /// Connector for paths with up to `max_depth` scattering events. There is no roulette, because
    /// the lengths of the subpaths are given.
    fn connector(&self, max_depth: Option<u32>) -> Connector<'_, 'a, A> {
        Connector::new(&self.world, self.heuristic, Roulette::after(u32::MAX), max_depth)
    }

    /// Makes the path of `shape` from `numbers`. A path with invalid light has the target 0. Its
    /// light is dropped when [`Self::add`] passes it to the sink.
    fn state(&self, shape: PathShape, numbers: &impl Sampler, out: &mut impl RaySink) -> State {
        let mut state = State::default();
        let before = out.record_len();
        self.trace(shape, numbers, out, &mut state.found);
        if out.records() {
            state.record = out.take_record(before);
        }
        let mut target = 0.0;
        for contribution in &state.found {
            let film = contribution.film.unwrap_or_default();
            if contribution.radiance.is_valid() {
                target += contribution.radiance.luminance() / self.importance.at(film);
            } else {
                return state;
            }
        }
        // Keep the target at 0 if its reciprocal might be infinite.
        if target >= f32::MIN_POSITIVE && target.is_finite() {
            state.target = target;
        }
        state
    }

    /// Makes a path of `shape` by the strategy that `numbers` choose. Adds its contributions to
    /// `found`, with their film positions. Radiance is multiplied by the number of pixels, so that
    /// its mean over all random numbers is the sum over the film.
    fn trace(&self, shape: PathShape, numbers: &impl Sampler, out: &mut impl RaySink, found: &mut Vec<Contribution>) {
        let length = shape.length;
        let t = shape.camera_vertices(numbers);
        let s = length - t;

        // Sample a film point, and trace a camera subpath of t vertices from there
        let area = FilmArea::of(&self.world);
        let film = area.at(numbers.get_2d(Dimension::PIXEL));
        let mut paths = Subpaths {
            time: self.world.time(numbers),
            ..Subpaths::default()
        };
        if t > 1 && !self.world.camera.sees(film) {
            return;
        }
        if t > 1 {
            let ray = self.world.ray_through(film, paths.time, numbers);
            (paths.camera, paths.escape) = self.connector(Some(t as u32 - 2)).camera_path(ray, numbers, out);
            let is_whole = paths.camera.len() == t;
            let escapes = s == 0 && paths.camera.len() + 1 == t && paths.escape.is_some();
            if !is_whole && !escapes {
                return;
            }
            if s == 0 && !self.metropolis.carries_all() && paths.is_light_seen_by_delta(t) {
                return;
            }
        }

        // Trace a light subpath of s vertices. For s = 1 a light is sampled for the last camera
        // vertex
        if s > 1 {
            paths.light = self.connector(Some(s as u32 - 1)).light_path(paths.time, numbers, out);
            if paths.light.len() < s {
                return;
            }
            self.connector(None).sum_light(&mut paths.light, paths.time);
        }

        // Connect both subpaths. Radiance is scaled, because each strategy represents the whole
        // film and all strategies.
        let connector = self.connector(None);
        let size = self.world.camera.resolution();
        let scale_of_camera = length as f32 * area.size.x * area.size.y;
        let scale_of_lens = length as f32 * size.x as f32 * size.y as f32;
        let mut keep = |c: Contribution| {
            let scale = match c.film {
                Some(film) if !area.contains(film) => return,
                Some(_) => scale_of_lens,
                None => scale_of_camera,
            };
            let radiance = c.radiance * (c.weight * scale);
            if !radiance.is_black() {
                found.push(Contribution {
                    radiance,
                    film: c.film.or(Some(film)),
                    ..c
                });
            }
        };
        if paths.camera.len() < t && t > 1 {
            connector.escape(&mut paths, &mut keep)
        } else {
            connector.strategy((s, t), &paths, numbers, out, &mut keep)
        }
    }

    /// Adds the light of the path of `state` to the image, multiplied by `scale` and by the
    /// expected number of mutations in this state.
    fn add(&self, state: &State, scale: f64, out: &mut impl SplatSink) {
        for contribution in &state.found {
            let mut radiance = contribution.radiance;
            if radiance.is_valid() {
                if state.target == 0.0 || state.share == 0.0 {
                    continue;
                }
                radiance = radiance * (1.0 / state.target) * (scale * state.share) as f32;
            }
            let film = contribution.film.unwrap_or_default();
            if out.records() {
                state.record.iter().for_each(|event| out.record(*event));
                contribution.record(out);
            }
            out.splat(film, contribution.light(radiance, self.world.scene));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::brute::BruteForce;
    use crate::camera::{Camera, CameraParameters};
    use crate::color::Spectrum;
    use crate::film::{Filter, FilterKind};
    use crate::geometry::Mesh;
    use crate::integrator::{MetropolisDirect, NullRaySink};
    use crate::material::Material;
    use crate::math::{UVec2, Vec3};
    use crate::scene::SceneBuilder;

    /// A large step makes a path from new random numbers. Its mean target equals the mean target of
    /// seeds, which represent all strategies at once. The pixel filter makes the film wider than
    /// the image.
    #[test]
    fn chains_and_seeds_have_one_scale() {
        // Make a lamp close above a floor: much of its light is scattered from the floor to the
        // lens.
        let mut b = SceneBuilder::new();
        for (y, half, emission) in [(0.0, 1.0, 0.0), (0.3, 0.1, 5.0)] {
            let material = Material {
                name: "m".into(),
                diffuse: Spectrum::splat(0.5),
                emission: Spectrum::splat(emission),
                ..Material::default()
            };
            let corner = |x: f32, z: f32| Vec3::new(half * x, y, half * z);
            let square = Mesh {
                positions: vec![
                    corner(-1.0, -1.0),
                    corner(-1.0, 1.0),
                    corner(1.0, 1.0),
                    corner(1.0, -1.0),
                ],
                triangles: if emission > 0.0 {
                    vec![[0, 2, 1], [0, 3, 2]]
                } else {
                    vec![[0, 1, 2], [0, 2, 3]]
                },
                ..Mesh::default()
            };
            let material = b.add_material(material).unwrap();
            b.add_mesh(square, material).unwrap();
        }
        let scene = b.build().unwrap().0;
        let camera = CameraParameters {
            position: Vec3::new(0.0, 1.0, 2.0),
            look_at: Vec3::ZERO,
            up: Vec3::Y,
            vertical_fov: 40.0,
            lens_radius: 0.0,
            focus_distance: 1.0,
        };
        let camera = Camera::new(camera, UVec2::splat(8)).unwrap();
        let filter = Filter::new(FilterKind::Gaussian, 2.0);
        let accel = BruteForce::new(&scene);
        let selection = scene.light_selection(crate::light_sampling::LightChoice::default());
        let integrator = PrimarySpaceIntegrator {
            world: World::new(&scene, &accel, &selection, &camera, &filter),
            heuristic: Heuristic::Power,
            max_depth: Some(2),
            light_samples: 1,
            metropolis: Metropolis {
                direct: MetropolisDirect::Metropolis,
                ..Metropolis::default()
            },
            importance: &ImportanceImage::even(),
        };
        let seed = |origin| {
            integrator
                .seed(origin, &mut NullRaySink)
                .map_or(0.0, |seed| seed.weight)
        };
        let step = |origin| {
            let numbers = PrimarySampler::new(mix(origin));
            let target = |length| {
                integrator
                    .state(PathShape { length, turn: 0 }, &numbers, &mut NullRaySink)
                    .target
            };
            integrator.lengths().map(|length| target(length) as f64).sum::<f64>()
        };
        // Estimate the mean, and the variance of the mean
        let estimate = |of: &dyn Fn(u64) -> f64| {
            let n = 40_000;
            let [sum, squares] = (0..n)
                .map(of)
                .fold([0.0; 2], |[sum, squares], x| [sum + x, squares + x * x]);
            let (n, mean) = (n as f64, sum / n as f64);
            (mean, (squares / n - mean * mean) / n)
        };
        let [(seeds, of_seeds), (steps, of_steps)] = [estimate(&seed), estimate(&step)];
        let error = (of_seeds + of_steps).sqrt();
        println!("{seeds} and {steps} ± {error}");
        assert!(error < 0.02 * seeds, "{seeds} ± {error}");
        assert!((seeds - steps).abs() < 5.0 * error, "{seeds} and {steps} ± {error}");
    }
}
