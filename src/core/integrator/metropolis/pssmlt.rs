//! Multiplexed Metropolis light transport in primary sample space (Kelemen et al. 2002; Hachisuka, Kaplanyan and Dachsbacher 2014).
//!
//! A chain mutates the random numbers that make a path, and needs to know nothing of surfaces: `bidirectional/connection` makes paths of numbers as
//! for `bdpt`, and `sampler/primary.rs` is a sampler whose numbers are those of a chain. One more number chooses among the strategies (s, t) that
//! make a path of the chain's length, so that a chain prefers the strategies that work where it is. The numbers of the camera's end, of the light's
//! end and of the choice are different dimensions: the ends stay what they are when another strategy is tried. An iteration takes half the time of
//! one of `bdpt`.
//!
//! An iteration has seeds and chains of its own. A seed is one path of a sample of `bdpt`, chosen among all paths that the sample joins in
//! proportion to their target; its weight is the target of all of them. Chains start at seeds in proportion to their weight, with one stratum for
//! each chain, sorted by length. The sum of the weights is what all chains share; `PrimarySpaceIntegrator` derives that an iteration is then unbiased.
//!
//! A seed on a spike of the target, of which small steps find nothing but the spike itself, keeps its chains: the pixel gets their whole light, which is
//! that of the seed. Sampling length and strategy at random (multiplexing the bootstrap too) makes such a seed brighter by the reciprocal of both
//! probabilities, some hundred times: on `ring-caustic` single pixels then were 64 times too bright after 2048 iterations. A seed that
//! stands for all paths of its sample is as bright as in `bdpt`, times the mutations for which there is a seed.
//!
//! Defaults (docs/benchmarks.md, "Metropolis light transport"): one chain for 256 mutations is between what scenes of easy light and scenes of hidden
//! light would choose. Step sizes and the probability of large steps are those of Kelemen et al.

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

/// Metropolis light transport in the space of primary samples (Kelemen, Szirmay-Kalos, Antal and Csonka 2002), multiplexed (Hachisuka, Kaplanyan and
/// Dachsbacher 2014): Markov chains of paths that are as frequent as their light is bright.
///
/// The state of a chain is the random numbers u of a path of a fixed number of vertices n; one of them chooses among the n ways in which
/// bidirectional path tracing makes such a path. What the way finds, times its weight and n, is f(u), which integrates to the light that comes by
/// paths of n vertices. The chain's target f*(u) is its luminance, over that of the importance image where it falls, and b the integral of f* over all u and n. With probability a = min(1, f*(v) /
/// f*(u)) the chain goes from u to the proposal v; both are added to the picture, as b f / f* times 1 − a and a, which is the mean over that decision
/// (Veach and Guibas 1997).
///
/// **An iteration is unbiased by itself.** It first makes M seeds. Each is a point of all numbers but the choice of the way, with all ways of making
/// paths of all n from these numbers, in each of which f* / n is the target that the way adds to b. One way is drawn in proportion to that, and w, the
/// sum over all of them over M, is the weight of the seed; the sum B of the weights has the mean b. Chains start at seeds drawn by these weights: of
/// C chains, C w / B are expected to start at a seed. Where the chain at u adds g(u) = f(u) / f*(u), all of them at their starts add B / C times
/// the sum of g over them; given the seeds the mean of that is Σ w g, whose mean over the seeds is ∫ f* g = ∫ f, whatever M and C are. The same
/// holds for any function in place of g, so also for what the chain adds in the mean after i steps, (Kⁱ g)(u): Σ w Kⁱ g has the mean ∫ f* Kⁱ g, and
/// that is ∫ f* g = ∫ f since steps keep f* as it is. There is no bias of the start to be discarded (Veach 1997, §11.3.1), and a chain may be as
/// short as one likes: it then is as noisy as the seeds are.
#[derive(Debug)]
pub struct PrimarySpaceIntegrator<'a, A> {
    /// The scene and the camera.
    pub world: World<'a, A>,
    /// How techniques are weighed.
    pub heuristic: Heuristic,
    /// Maximum number of scattering events; `None` means as many as a path has room for, 64.
    pub max_depth: Option<u32>,
    /// Light samples of each pixel in an iteration, where direct light is found in the ordinary way.
    pub light_samples: u32,
    /// Options of the chains.
    pub metropolis: Metropolis,
    /// Importance image: the light of paths is divided by it.
    pub importance: &'a ImportanceImage,
}

/// Mutations for which there is a sample of bidirectional path tracing, one of whose paths a chain may start from.
const MUTATIONS_PER_SEED: u64 = 8;
/// Minimum number of such samples in an iteration.
const MIN_SEEDS: u64 = 512;
/// Samples of bidirectional path tracing that are made together.
const SEEDS_AT_ONCE: u32 = 64;

/// A path that chains may start from.
#[derive(Debug)]
pub struct Seed {
    /// Names its numbers.
    origin: u64,
    /// Vertices.
    length: u32,
    /// Vertices that come from the camera.
    from_camera: u32,
    /// Target of all paths of its sample; once all seeds are joined, the sum of these up to this one.
    weight: f64,
}

/// What all paths of a chain have in common.
#[derive(Clone, Copy, Debug)]
struct PathShape {
    /// Vertices.
    length: usize,
    /// Ways by which the one that numbers choose is turned on: numbers of any seed make the way in which the seed was found.
    turn: usize,
}

impl PathShape {
    /// The one in which the numbers of `seed` make its path.
    fn of(seed: &Seed) -> Self {
        let length = seed.length as usize;
        let chosen = Self { length, turn: 0 }.camera_vertices(&PrimarySampler::new(seed.origin));
        Self {
            length,
            turn: (seed.from_camera as usize + length - chosen) % length,
        }
    }

    /// Number of vertices that come from the camera, in the way that `numbers` choose.
    fn camera_vertices(self, numbers: &impl Sampler) -> usize {
        let choice = numbers.get_1d(Dimension::TECHNIQUE);
        let chosen = ((choice * self.length as f32) as usize).min(self.length - 1);
        1 + (chosen + self.turn) % self.length
    }
}

/// What a path finds.
#[derive(Default)]
struct State {
    /// Each with its place on the film.
    found: Vec<Contribution>,
    /// Luminance of all that, over that of the importance image.
    target: f32,
    /// The share of the chain's mean that the path has, so far.
    share: f64,
    /// How the path was made, where that is recorded.
    record: Vec<PathEvent>,
}

impl State {
    /// Counts the path's share of mutations where it falls.
    fn visit(&self, visits: &mut Visits) {
        let place = self.found.first().and_then(|contribution| contribution.film);
        if let Some(film) = place.filter(|_| self.target > 0.0 && self.share > 0.0) {
            visits.add(film, self.share);
        }
    }
}

impl<A: Accel> IterationIntegrator for PrimarySpaceIntegrator<'_, A> {
    type Part = Vec<Seed>;
    type Prepared = Vec<Seed>;

    fn preparations(&self) -> u32 {
        match self.lengths().is_empty() {
            true => 0,
            false => self.seeds().div_ceil(SEEDS_AT_ONCE),
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
        // By length, so that every length gets its share of the chains
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
        // Chains do, and are there whatever the crop is.
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
        // Where it starts: each chain has a stratum of all the weight.
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

        // Its share of the iteration's mutations, of whose mean the picture gets its share
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
            let acceptance = match current.target > 0.0 {
                true => (proposal.target / current.target).min(1.0),
                false => 1.0,
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
    /// Samples in an iteration whose paths chains may start from.
    fn seeds(&self) -> u32 {
        let usual = (mutations(&self.world) / MUTATIONS_PER_SEED).max(MIN_SEEDS);
        let max = u32::MAX - SEEDS_AT_ONCE;
        self.metropolis
            .bootstrap
            .map_or(usual.min(max as u64) as u32, |n| n.clamp(1, max))
    }

    /// Numbers of vertices of the paths that chains carry.
    fn lengths(&self) -> RangeInclusive<usize> {
        self.metropolis.min_vertices()..=max_vertices(self.max_depth)
    }

    /// One of the paths of the sample of bidirectional path tracing that `origin` names; `None` where it finds no light that chains carry.
    fn seed(&self, origin: u64, out: &mut impl RaySink) -> Option<Seed> {
        // Both subpaths, and all ways to join them
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

        // One of them, in proportion to its target
        let size = self.world.camera.resolution().as_vec2();
        let target = |c: &Contribution| {
            let is_lamp = c.strategy.0 == 0 && !self.metropolis.carries_all() && paths.sees_by_delta(c.strategy.1);
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

    /// Joins subpaths of paths that scatter `max_depth` times at most. Their lengths are given: there is nothing for roulette to decide.
    fn connector(&self, max_depth: Option<u32>) -> Connector<'_, 'a, A> {
        Connector::new(&self.world, self.heuristic, Roulette::after(u32::MAX), max_depth)
    }

    /// What the path of a shape that `numbers` name finds. What is no light is dropped where it is added; it attracts no chain.
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
            match contribution.radiance.is_valid() {
                true => target += contribution.radiance.luminance() / self.importance.at(film),
                false => return state,
            }
        }
        // Of numbers below these the reciprocal need not be finite.
        if target >= f32::MIN_POSITIVE && target.is_finite() {
            state.target = target;
        }
        state
    }

    /// Makes a path of a shape by the technique that `numbers` choose, and gives what it finds to `found`, with its place on the film: radiance
    /// times pixels, whose mean over all numbers is the sum over the film.
    fn trace(&self, shape: PathShape, numbers: &impl Sampler, out: &mut impl RaySink, found: &mut Vec<Contribution>) {
        let length = shape.length;
        let t = shape.camera_vertices(numbers);
        let s = length - t;

        // A point of the film that any pixel sees, and a subpath of t vertices from there
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
            if s == 0 && !self.metropolis.carries_all() && paths.sees_by_delta(t) {
                return;
            }
        }

        // One of s vertices from a light; a single one is drawn for the camera's
        if s > 1 {
            paths.light = self.connector(Some(s as u32 - 1)).light_path(paths.time, numbers, out);
            if paths.light.len() < s {
                return;
            }
            self.connector(None).sum_light(&mut paths.light, paths.time);
        }

        // Both joined. Each strategy stands for all of the film, and for all strategies.
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
        match paths.camera.len() < t && t > 1 {
            true => connector.escape(&mut paths, &mut keep),
            false => connector.strategy((s, t), &paths, numbers, out, &mut keep),
        }
    }

    /// Adds to the picture what a path has found, as its share of `scale` times all light.
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
    use crate::integrator::{MetropolisDirect, Uncounted};
    use crate::material::Material;
    use crate::math::{UVec2, Vec3};
    use crate::scene::SceneBuilder;

    /// A large step is a path of random numbers. Its mean target is that of seeds, which stand for
    /// all strategies at once, on a film that a filter makes wider than the picture.
    #[test]
    fn chains_and_seeds_have_one_scale() {
        // A lamp close above a floor: much of the light goes from the floor to the lens.
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
                triangles: match emission > 0.0 {
                    true => vec![[0, 2, 1], [0, 3, 2]],
                    false => vec![[0, 1, 2], [0, 2, 3]],
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
        let selection = scene.light_selection(crate::light::LightChoice::default());
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
        let seed = |origin| integrator.seed(origin, &mut Uncounted).map_or(0.0, |seed| seed.weight);
        let step = |origin| {
            let numbers = PrimarySampler::new(mix(origin));
            let target = |length| {
                integrator
                    .state(PathShape { length, turn: 0 }, &numbers, &mut Uncounted)
                    .target
            };
            integrator.lengths().map(|length| target(length) as f64).sum::<f64>()
        };
        // Mean and its variance
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
