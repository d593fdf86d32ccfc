//! Metropolis light transport in path space (Veach and Guibas 1997; Veach 1997, ch. 11).
//!
//! Surface points, light points, sampling, ray origins and densities come from
//! `bidirectional/subpath`. Vertices, subpaths and weights are different, because a chain changes
//! single vertices of a path and needs all densities of the result. A vertex of `bidirectional` has
//! the throughput and the density of its subpath up to the vertex. A vertex of this module has the
//! contribution of the vertex between its neighbours. So a new neighbour changes few factors of a
//! path. All delta lobes on one side of a surface count as one lobe.
//!
//! `path` defines paths and their vertices, which do not depend on how they were sampled. `space`
//! makes and connects subpaths. `factors` computes the contribution of a path, and the densities
//! with which bidirectional strategies make the path. Both depend on the vertices only.
//! `bidirectional` and `perturbation` are mutations. `seed` finds the start paths of chains.
//!
//! The acceptance probability of a mutation depends on the changed part. For a bidirectional
//! mutation, the probability uses the sum over all splits of the new vertices between both ends.
//! For a perturbation, the probability uses the integrand per film point and directions. A mutation
//! that deletes some vertices and adds others is paired with the reverse mutation. Each pair is in
//! detailed balance, so other mutations that lead to the same path do not matter.
//!
//! The delta distributions of mirrors and glass appear in the contribution of a path and in every
//! density, and cancel. A path stores which of its vertices scatter by delta lobes. At a vertex
//! that reflects, all mirror-like lobes are summed, because they reflect in the same direction.
//!
//! - Mutations never cut a path after a vertex that scatters by a delta lobe. The new part would
//!   only repeat the direction of the lobe.
//! - A tenth of all mutations replaces the whole path. The distribution of its length comes from
//!   the seeds of the iteration, except the samples that the chain may have started from
//!   (`Seeds::lengths`). A step that depends on these samples would favour light that the samples
//!   found by chance. The bias would be a few percent if an iteration has few seeds.
//! - An iteration has one chain per 256 mutations. Chains start at paths of bidirectional path
//!   tracing. Start paths are chosen with probabilities proportional to their light, and the
//!   choices are stratified over the chains. An iteration is unbiased from the first mutation on.
//!   Many short chains are noisier than a long chain if seeds seldom find the light. Short chains
//!   are better if a long chain would never leave a corner of path space. `--chains` sets the
//!   number of chains.
//! - Seeds are weighted by the balance heuristic over all strategies. This equals the sum over
//!   splits of a mutation that deletes all vertices.
//! - Vertices store their factors. Only factors next to new vertices are computed
//!   (`PathSpace::path`), and a sum over all strategies is one pass over the path.
//! - A perturbation of light from infinity moves the ray sideways, and keeps its direction. The
//!   lens point changes only if the camera end of the path is made anew. The time changes only by a
//!   time mutation or by a new path.
//! - Film points of lens subpath mutations are stratified over the chains of an iteration. They are
//!   not stratified along a chain, because a point that depends on earlier points would depend on
//!   the state of the chain. So each chain stays unbiased.
//! - If surfaces have alpha or are thin glass, each edge has a transmittance. A traced ray passes
//!   such surfaces at random, so its density contains the transmittance. A connection is multiplied
//!   by the transmittance instead.
//!
//! `tests` checks each mutation separately, without waiting for chains to mix. The tests take one
//! step from paths sampled in proportion to their light. Statistics of the paths must have the same
//! mean before and after the step.

mod bidirectional;
mod factors;
mod lens_subpath;
mod numbers;
mod path;
mod perturbation;
mod seed;
mod space;
#[cfg(test)]
mod tests;

use super::options::{OrdinaryLight, mutations, mutations_of_chain};
use super::visits::Visits;
use crate::accel::Accel;
use crate::integrator::bidirectional::subpath::max_vertices;
use crate::integrator::{
    FoundLight, Heuristic, ImportanceImage, IterationIntegrator, Metropolis, RaySink, Roulette, SplatSink, World,
};
use crate::sampler::{SampleKey, Sampler, Stream};
use bidirectional::{Bidirectional, Lengths};
use lens_subpath::LensSubpath;
use numbers::Numbers;
use path::Path;
use perturbation::{CameraChain, PathPerturbation, caustic_start};
use seed::{SamplePaths, Seeds};
use space::PathSpace;

/// Metropolis light transport: Markov chains of paths, each a mutation of the previous path. Paths
/// are visited in proportion to their luminance divided by the importance image, so all visits to
/// one region of the image add equal luminance (Veach and Guibas 1997; Veach 1997, ch. 11).
///
/// Each iteration has separate chains, and as many mutations as pixels. Its chains start from paths
/// of bidirectional path tracing. These paths also estimate the total light, so each iteration is
/// an unbiased estimate.
#[derive(Debug)]
pub struct PathSpaceIntegrator<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// Maximum number of scattering events. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette of the start paths of chains.
    pub roulette: Roulette,
    /// Number of light samples per pixel in an iteration, if path tracing finds direct light.
    pub light_samples: u32,
    /// Options of the chains. Step sizes are not used.
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

/// Kind of a mutation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mutation {
    /// Replaces the whole path.
    Replace,
    Bidirectional,
    /// Lens or multi-chain perturbation. At most one of the two applies to a path.
    FromCamera,
    /// Caustic perturbation.
    FromLight,
    LensSubpath,
    /// Moves the path to another time, if anything moves.
    Time,
}

impl Mutation {
    /// All kinds of mutations. Each kind has its relative frequency among the kinds that apply to a
    /// path.
    const ALL: [(Self, f64); 6] = [
        (Self::Replace, 0.1),
        (Self::Bidirectional, 0.3),
        (Self::FromCamera, 0.3),
        (Self::FromLight, 0.3),
        (Self::LensSubpath, 0.1),
        (Self::Time, 0.1),
    ];

    /// Returns `true` if this kind of mutation applies to the path `x`.
    fn applies_to<'a>(self, x: &Path<'a>, space: &PathSpace<'_, 'a, impl Accel>) -> bool {
        match self {
            Self::Replace | Self::Bidirectional => true,
            Self::FromCamera => CameraChain::of(x).is_some(),
            Self::FromLight => caustic_start(x).is_some(),
            Self::LensSubpath => lens_subpath::end_of(x).is_some(),
            Self::Time => space.world.moves() && PathPerturbation { space }.can_move_in_time(x),
        }
    }

    /// Relative frequency of each kind of mutation for the path `x`; 0 for kinds that do not apply.
    fn weights<'a>(x: &Path<'a>, space: &PathSpace<'_, 'a, impl Accel>) -> [f64; 6] {
        Self::ALL.map(|(kind, weight)| if kind.applies_to(x, space) { weight } else { 0.0 })
    }

    /// Probability of choosing this kind of mutation for the path `x`.
    fn probability<'a>(self, x: &Path<'a>, space: &PathSpace<'_, 'a, impl Accel>) -> f64 {
        let weights = Self::weights(x, space);
        let own = Self::ALL.iter().zip(weights).filter(|((kind, _), _)| *kind == self);
        own.map(|(_, weight)| weight).sum::<f64>() / weights.iter().sum::<f64>()
    }
}

/// Names of mutations in statistics.
const NAMES: [&str; 7] = [
    "new path",
    "bidirectional",
    "lens",
    "multi-chain",
    "caustic",
    "lens subpath",
    "time",
];

/// A proposed path, and its acceptance probability.
#[derive(Debug)]
struct Proposal<'a> {
    path: Path<'a>,
    acceptance: f64,
}

impl<'a> Proposal<'a> {
    /// Proposal of `path` with the acceptance probability
    /// `a = min(1, f(y) T(y → x) / (f(x) T(x → y)))` (Veach 1997, eq. 11.5). `ratio` is the
    /// fraction in this formula. A ratio that is not finite gives 0.
    fn of(path: Path<'a>, ratio: f64) -> Self {
        Self {
            path,
            acceptance: if ratio > 0.0 && ratio.is_finite() {
                ratio.min(1.0)
            } else {
                0.0
            },
        }
    }
}

impl<'a, A: Accel> PathSpaceIntegrator<'a, A> {
    /// Path space of the chains.
    fn space(&self) -> PathSpace<'_, 'a, A> {
        PathSpace::new(
            &self.world,
            self.importance,
            self.metropolis.min_vertices(),
            max_vertices(self.max_depth),
            self.metropolis.carries_all(),
        )
    }

    fn seeds(&self) -> u32 {
        let usual = (mutations(&self.world) / MUTATIONS_PER_SEED).max(MIN_SEEDS) as u32;
        self.metropolis.bootstrap.unwrap_or(usual)
    }

    /// Traces the bootstrap sample `index`, and returns its paths, each with its light.
    fn seed<S: Sampler>(
        &self,
        space: &PathSpace<'_, 'a, A>,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Vec<(Path<'a>, f64)> {
        let mut numbers = Numbers::of(SampleKey::of_stream(Stream::Bootstrap, index, iteration), sampler);
        seed::sample(space, self.roulette, &mut numbers, out)
    }
}

impl<'a, A: Accel> IterationIntegrator for PathSpaceIntegrator<'a, A> {
    type PreparationPart = Vec<SamplePaths>;
    type Preparation = Seeds;

    fn preparations(&self) -> u32 {
        let space = self.space();
        if space.min_vertices <= space.max_vertices {
            self.seeds().div_ceil(SEEDS_AT_ONCE)
        } else {
            0
        }
    }

    fn prepare<S: Sampler>(
        &self,
        iteration: u32,
        index: u32,
        sampler: &mut S,
        out: &mut impl RaySink,
    ) -> Vec<SamplePaths> {
        let space = self.space();
        let first = index * SEEDS_AT_ONCE;
        let samples = first..self.seeds().min(first.saturating_add(SEEDS_AT_ONCE));
        let light_of = |(path, light): &(Path, f64)| (*light, path.len());
        samples
            .map(|index| {
                self.seed(&space, iteration, index, sampler, out)
                    .iter()
                    .map(light_of)
                    .collect()
            })
            .collect()
    }

    fn join(&self, _: u32, parts: Vec<Vec<SamplePaths>>) -> Seeds {
        let space = self.space();
        let samples: Vec<SamplePaths> = parts.into_iter().flatten().collect();
        Seeds::new(&samples, space.min_vertices, space.max_vertices)
    }

    fn repeats(&self) -> bool {
        self.world.camera.repeats()
    }

    fn sends_light(&self) -> bool {
        // Chains contribute to any pixel. Samples contribute only to their own pixel
        false
    }

    fn sample<S: Sampler>(&self, _: &Seeds, key: SampleKey, sampler: &mut S, out: &mut impl SplatSink) {
        let ordinary = OrdinaryLight {
            world: self.world,
            heuristic: Heuristic::default(),
            max_depth: self.max_depth,
            roulette: self.roulette,
            light_samples: self.light_samples,
        };
        self.metropolis.sample_pixel(&ordinary, key, sampler, out);
    }

    fn chains(&self) -> u32 {
        self.metropolis.chains(mutations(&self.world))
    }

    fn chain<S: Sampler>(&self, seeds: &Seeds, iteration: u32, index: u32, sampler: &mut S, out: &mut impl SplatSink) {
        // Choose the start path. Each chain has a stratum of the light of all seeds
        let space = self.space();
        let chains = self.chains() as u64;
        let mut numbers = Numbers::of_chain(index, iteration, sampler);
        let place = (index as f64 + numbers.next() as f64) / chains as f64;
        let Some(seed) = seeds.at(place) else { return };
        let found = self.seed(&space, iteration, seed.sample, sampler, out);
        let Some((mut x, _)) = found.into_iter().nth(seed.way as usize) else {
            return;
        };

        let lengths = seeds.lengths(seed);

        // Compute the light that one visit adds
        let mutations = mutations_of_chain(mutations(&self.world), index, self.chains());
        let light = seeds.mean * space.film.area() as f64 / (chains * mutations) as f64;
        let mut counts = [[0u64; 2]; NAMES.len()];
        let mut visits = Visits::default();
        let mut visit = |x: &Path, share: f64, out: &mut _| {
            visits.add(x.film, share);
            self.visit(x, share * light, out);
        };
        let mut stay = 0.0;
        for _ in 0..mutations {
            if out.is_cancelled() {
                return;
            }
            let (name, proposal) = self.mutate(&space, lengths, &x, &mut numbers, out);
            counts[name][0] += 1;
            let Some(Proposal { path: y, acceptance }) = proposal else {
                stay += 1.0;
                continue;
            };
            // Both the current and the proposed path are added, weighted by their probabilities
            // (Veach 1997, §11.3.3).
            stay += 1.0 - acceptance;
            if (numbers.next() as f64) < acceptance {
                visit(&x, stay, out);
                counts[name][1] += 1;
                (x, stay) = (y, acceptance);
            } else if acceptance > 0.0 {
                visit(&y, acceptance, out);
            }
        }
        visit(&x, stay, out);
        out.chain(visits.counts(mutations));
        for (name, [proposed, accepted]) in NAMES.into_iter().zip(counts) {
            if proposed > 0 {
                out.mutation(name, proposed, accepted);
            }
        }
    }
}

impl<'a, A: Accel> PathSpaceIntegrator<'a, A> {
    /// Proposes a mutation of `x` of a random kind. Returns the index of its kind in [`NAMES`], and
    /// the proposal if the mutation succeeds.
    fn mutate(
        &self,
        space: &PathSpace<'_, 'a, A>,
        lengths: &Lengths,
        x: &Path<'a>,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> (usize, Option<Proposal<'a>>) {
        let choice = numbers.choose(Mutation::weights(x, space).into_iter()).unwrap_or(0);
        self.mutate_by(Mutation::ALL[choice].0, space, lengths, x, numbers, out)
    }

    /// Proposes a mutation of `x` of the kind `kind`. Returns the index of its kind in [`NAMES`],
    /// and the proposal if the mutation succeeds.
    fn mutate_by(
        &self,
        kind: Mutation,
        space: &PathSpace<'_, 'a, A>,
        lengths: &Lengths,
        x: &Path<'a>,
        numbers: &mut Numbers,
        out: &mut impl RaySink,
    ) -> (usize, Option<Proposal<'a>>) {
        let chosen = |path: &Path<'a>| kind.probability(path, space);
        let bidirectional = Bidirectional { space, lengths };
        let perturbation = PathPerturbation { space };
        match kind {
            Mutation::Replace => (0, bidirectional.replace(x, chosen, numbers, out)),
            Mutation::Bidirectional => (1, bidirectional.mutate(x, chosen, numbers, out)),
            Mutation::FromCamera => match CameraChain::of(x) {
                None => (2, None),
                Some(chain) => (
                    if chain.is_multiple { 3 } else { 2 },
                    perturbation.move_film_point(x, chain, chosen, numbers, out),
                ),
            },
            Mutation::FromLight => (
                4,
                caustic_start(x).and_then(|start| perturbation.move_light(x, start, chosen, numbers, out)),
            ),
            Mutation::LensSubpath => (
                5,
                lens_subpath::end_of(x).and_then(|end| LensSubpath { space }.mutate(x, end, chosen, numbers, out)),
            ),
            Mutation::Time => (
                6,
                CameraChain::of(x).and_then(|chain| perturbation.move_in_time(x, chain, chosen, numbers, out)),
            ),
        }
    }

    /// Adds the amount of light `light` at the film position of the path `x`. The light has the
    /// colour of `x`.
    fn visit(&self, x: &Path, light: f64, out: &mut impl SplatSink) {
        if let Some(source) = x.source().filter(|_| light > 0.0) {
            let radiance = x.color * (light / x.target) as f32;
            let scatterings = x.vertices.len().saturating_sub(2) as u32;
            if out.records() {
                x.record(out);
            }
            out.splat(
                x.film,
                FoundLight::of(radiance, source.id, self.world.scene, scatterings),
            );
        }
    }
}
