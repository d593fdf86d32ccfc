//! Multiplexed Metropolis light transport in primary sample space (Kelemen et al. 2002; Hachisuka, Kaplanyan and Dachsbacher 2014).
//!
//! A chain mutates the random numbers that make a path, and needs to know nothing of surfaces: `bidirectional/connection` makes paths of numbers as
//! for `bdpt`, and `sampler/primary.rs` is a sampler whose numbers are those of a chain. One more number chooses among the strategies (s, t) that
//! make a path of the chain's length, so that a chain prefers the strategies that work where it is. The numbers of the camera's end, of the light's
//! end and of the choice are different dimensions: the ends stay what they are when another strategy is tried. An iteration takes half the time of
//! one of `bdpt`.
//!
//! An iteration has bootstrap paths and chains of its own. Chains start at bootstrap paths in proportion to their weight, with one stratum for each
//! chain, sorted by length. The sum of the weights is what all chains share; `PrimarySpaceIntegrator` derives that an iteration is then unbiased.
//! Lengths of bootstrap paths are geometric: each is four fifths as likely as the length before.
//!
//! Defaults (docs/benchmarks.md, "Metropolis light transport"): one chain for 256 mutations is between what scenes of easy light and scenes of hidden
//! light would choose. One bootstrap path for four mutations: an eighth to a half differ by less than a tenth. Step sizes and the probability of
//! large steps are those of Kelemen et al.

use super::options::{FilmArea, OrdinaryLight, mutations, mutations_of_chain, name};
use crate::accel::Accel;
use crate::integrator::bidirectional::connection::{Connector, Contribution, Subpaths};
use crate::integrator::bidirectional::subpath::max_vertices;
use crate::integrator::{
    Gathered, Heuristic, ImportanceImage, IterationIntegrator, Metropolis, PathEvent, RaySink, Roulette, SplatSink,
    World,
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
/// **An iteration is unbiased by itself.** It first traces M bootstrap paths, each with a length drawn with probability p(n), of weights w = f* / (p(n)
/// M), whose sum B has the mean b. Chains start at bootstrap paths drawn by these weights: of C chains, C w / B are expected to start at a path.
/// Where the chain at u adds g(u) = f(u) / f*(u), all of them at their starts add B / C times the sum of g over them; given the bootstrap paths the
/// mean of that is Σ w g = Σ f / (p M), whose mean over the bootstrap paths is ∫ f, whatever M and C are. The same holds for any function in place of
/// g, so also for what the chain adds in the mean after i steps, (Kⁱ g)(u): Σ w Kⁱ g has the mean ∫ f* Kⁱ g, and that is ∫ f* g = ∫ f since steps
/// keep f* as it is. There is no bias of the start to be discarded (Veach 1997, §11.3.1), and a chain may be as short as one likes: it then is as
/// noisy as the bootstrap paths are.
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

/// Mutations for which there is a bootstrap path.
const MUTATIONS_PER_BOOTSTRAP: u64 = 4;
/// Minimum number of bootstrap paths in an iteration.
const MIN_BOOTSTRAP: u64 = 1024;
/// Bootstrap paths that are traced together.
const PIECE: u32 = 1024;
/// Ratio of the number of bootstrap paths of a length to that of the previous length.
const LENGTH_RATIO: f64 = 0.8;

/// A bootstrap path that has found light.
#[derive(Debug)]
pub struct Seed {
    /// Names its numbers.
    origin: u64,
    /// Vertices.
    length: usize,
    /// Weight of the path; once all are joined, the sum of the weights up to this one.
    weight: f64,
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

impl<A: Accel> IterationIntegrator for PrimarySpaceIntegrator<'_, A> {
    type Part = Vec<Seed>;
    type Prepared = Vec<Seed>;

    fn preparations(&self) -> u32 {
        match self.lengths().is_empty() {
            true => 0,
            false => self.bootstrap_paths().div_ceil(PIECE),
        }
    }

    fn prepare<S: Sampler>(&self, iteration: u32, index: u32, sampler: &mut S, out: &mut impl RaySink) -> Vec<Seed> {
        sampler.start(SampleKey::of_stream(Stream::Bootstrap, index, iteration));
        let (name, count) = (name(sampler), self.bootstrap_paths());
        let first = index * PIECE;
        let mut seeds = Vec::new();
        for i in first..(first + PIECE).min(count) {
            let origin = mix(name.wrapping_add((i as u64 + 1).wrapping_mul(GOLDEN_GAMMA)));
            let (length, probability) = self.length((i as f64 + unit_f64(mix(origin))) / count as f64);
            let state = self.state(length, &PrimarySampler::new(origin), out);
            if state.target > 0.0 {
                let weight = state.target as f64 / (probability * count as f64);
                seeds.push(Seed { origin, length, weight });
            }
        }
        seeds
    }

    fn join(&self, _: u32, parts: Vec<Vec<Seed>>) -> Vec<Seed> {
        // By length, so that every length gets its share of the chains
        let mut seeds: Vec<Seed> = parts.into_iter().flatten().collect();
        seeds.sort_by_key(|seed| seed.length);
        let mut sum = 0.0;
        for seed in &mut seeds {
            sum += seed.weight;
            seed.weight = sum;
        }
        seeds
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
        let Some(&Seed { origin, length, .. }) = seeds.get(start.min(seeds.len().saturating_sub(1))) else {
            return;
        };
        let Metropolis {
            large_step_probability,
            mutation_size,
            ..
        } = self.metropolis;
        let mut numbers = PrimarySampler::chain(origin, name, mutation_size, Dimension::end(2 * length as u32));
        let mut current = self.state(length, &numbers, out);

        // Its share of the iteration's mutations, of whose mean the picture gets its share
        let mutations = mutations_of_chain(mutations(&self.world), index, chains);
        let scale = light / (chains as f64 * mutations as f64);
        let mut counts = [[0; 2]; 2];
        for _ in 0..mutations {
            if out.is_cancelled() {
                return;
            }
            // ANCHOR: step
            let step = numbers.propose(large_step_probability);
            let mut proposal = self.state(length, &numbers, out);
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
            let count = &mut counts[usize::from(step == Step::Small)];
            *count = [count[0] + 1, count[1] + u64::from(is_accepted)];
        }
        self.add(&current, scale, out);
        let [large, small] = counts;
        out.mutation("large", large[0], large[1]);
        out.mutation("small", small[0], small[1]);
    }
}

impl<'a, A: Accel> PrimarySpaceIntegrator<'a, A> {
    /// Bootstrap paths in an iteration.
    fn bootstrap_paths(&self) -> u32 {
        let usual = (mutations(&self.world) / MUTATIONS_PER_BOOTSTRAP).max(MIN_BOOTSTRAP);
        let most = u32::MAX - PIECE;
        self.metropolis
            .bootstrap
            .map_or(usual.min(most as u64) as u32, |n| n.clamp(1, most))
    }

    /// Numbers of vertices of the paths that chains carry.
    fn lengths(&self) -> RangeInclusive<usize> {
        self.metropolis.min_vertices()..=max_vertices(self.max_depth)
    }

    /// The number of vertices of a bootstrap path, drawn with `u`, and its probability: a geometric distribution.
    fn length(&self, u: f64) -> (usize, f64) {
        let (least, most) = self.lengths().into_inner();
        let count = (most - least + 1) as i32;
        let all = 1.0 - LENGTH_RATIO.powi(count);
        let i = ((1.0 - u * all).ln() / LENGTH_RATIO.ln()) as i32;
        let i = i.clamp(0, count - 1);
        let probability = LENGTH_RATIO.powi(i) * (1.0 - LENGTH_RATIO) / all;
        (least + i as usize, probability)
    }

    /// Joins subpaths of paths that scatter `max_depth` times at most. Their lengths are given: there is nothing for roulette to decide.
    fn connector(&self, max_depth: Option<u32>) -> Connector<'_, 'a, A> {
        Connector::new(&self.world, self.heuristic, Roulette::after(u32::MAX), max_depth)
    }

    /// What the path of `length` vertices that `numbers` name finds. What is no light is dropped where it is added; it attracts no chain.
    fn state(&self, length: usize, numbers: &impl Sampler, out: &mut impl RaySink) -> State {
        let mut state = State::default();
        let before = out.record_len();
        self.trace(length, numbers, out, &mut state.found);
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

    /// Makes a path of `length` vertices by the technique that `numbers` choose, and gives what it finds to `found`, with its place on the film: radiance
    /// times pixels, whose mean over all numbers is the sum over the film.
    fn trace(&self, length: usize, numbers: &impl Sampler, out: &mut impl RaySink, found: &mut Vec<Contribution>) {
        let choice = numbers.get_1d(Dimension::TECHNIQUE);
        let t = 1 + ((choice * length as f32) as usize).min(length - 1);
        let s = length - t;

        // A point of the film that any pixel sees, and a subpath of t vertices from there
        let area = FilmArea::of(&self.world);
        let film = area.at(numbers.get_2d(Dimension::PIXEL));
        let mut paths = Subpaths {
            time: self.world.time(numbers),
            ..Subpaths::default()
        };
        if t > 1 {
            let ray = self.world.ray_through(film, paths.time, numbers);
            (paths.camera, paths.escape) = self.connector(Some(t as u32 - 2)).camera_path(ray, numbers, out);
            let is_whole = paths.camera.len() == t;
            let escapes = s == 0 && paths.camera.len() + 1 == t && paths.escape.is_some();
            if !is_whole && !escapes {
                return;
            }
            let mut between = paths.camera[1..].iter().take(t - 2);
            if s == 0 && !self.metropolis.carries_all() && between.all(|vertex| vertex.is_delta) {
                return;
            }
        }

        // One of s vertices from a light; a single one is drawn for the camera's
        if s > 1 {
            paths.light = self.connector(Some(s as u32 - 1)).light_path(paths.time, numbers, out);
            if paths.light.len() < s {
                return;
            }
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
            out.splat(film, Gathered::of_light(radiance, contribution.light, self.world.scene));
        }
    }
}
