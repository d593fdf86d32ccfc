//! Seeds: the paths from which chains start.

use super::bidirectional::Lengths;
use super::numbers::Numbers;
use super::path::{CameraSample, Path, Vertex};
use super::space::{PathSpace, is_same_point};
use crate::accel::Accel;
use crate::integrator::{RaySink, Roulette};

/// Start paths of chains: all paths that the bootstrap samples of an iteration find.
///
/// The first path of a chain is sampled from these paths in proportion to their light, and the mean
/// light of the seeds scales the light of the chain. So the chain is unbiased from its first step
/// on (Veach 1997, §11.3.1).
#[derive(Debug, Default)]
pub struct Seeds {
    seeds: Vec<Seed>,
    /// Cumulative sums of the light of the seeds.
    sums: Vec<f64>,
    /// Mean luminance of a pixel, estimated from the seeds.
    pub(super) mean: f64,
    /// Two distributions of the number of vertices of new paths. The first is estimated from the
    /// samples with an even index, the second from the samples with an odd index.
    lengths: [Lengths; 2],
}

/// Index of a seed: the bootstrap sample, and the number of the path among the paths of the sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seed {
    pub sample: u32,
    pub way: u32,
}

/// Light and number of vertices of each path of a bootstrap sample.
pub type SamplePaths = Vec<(f64, usize)>;

impl Seeds {
    /// Seeds from the paths of all bootstrap samples. A path has `min` to `max`
    /// vertices.
    pub(super) fn new(samples: &[SamplePaths], min: usize, max: usize) -> Self {
        let mut seeds = Self::default();
        let mut total = 0.0;
        let mut by_length = [0, 1].map(|_| vec![0.0; max + 1]);
        for (sample, found) in (0u32..).zip(samples) {
            for (way, &(light, n)) in (0..).zip(found) {
                total += light;
                by_length[sample as usize % 2][n] += light;
                seeds.seeds.push(Seed { sample, way });
                seeds.sums.push(total);
            }
        }
        seeds.mean = total / samples.len().max(1) as f64;
        seeds.lengths = by_length.map(|light| Lengths::new(&light, min, max));
        seeds
    }

    /// Distribution of the number of vertices of new paths, for a chain that starts at `seed`. It
    /// comes from the half of the samples that does not contain `seed`. A chain must not depend on
    /// the samples that it may start from, because the chain would then favour light that these
    /// samples found by chance.
    pub(super) fn lengths(&self, seed: Seed) -> &Lengths {
        &self.lengths[1 - seed.sample as usize % 2]
    }

    /// Seed at the fraction `u` of the cumulative light, in [0, 1). `None` if there are no seeds.
    pub(super) fn at(&self, u: f64) -> Option<Seed> {
        let light = u * self.sums.last()?;
        let index = self.sums.partition_point(|&sum| sum <= light);
        self.seeds.get(index.min(self.seeds.len() - 1)).copied()
    }
}

/// A subpath, with a weight for each vertex that compensates for roulette.
struct Subpath<'a> {
    vertices: Vec<Vertex<'a>>,
    weights: Vec<f64>,
    /// Weight of the next vertex. `None` if the subpath ends.
    next: Option<f64>,
}

impl<'a> Subpath<'a> {
    /// A subpath with the first vertex `first`.
    fn new(first: Option<Vertex<'a>>) -> Self {
        Self {
            next: first.as_ref().map(|_| 1.0),
            weights: vec![1.0; first.iter().len()],
            vertices: first.into_iter().collect(),
        }
    }

    fn push(&mut self, vertex: Vertex<'a>, roulette: Roulette, u: f32) {
        let scattered = self.vertices.len() as u32 - 1;
        let albedo = vertex.surface().map(|surface| surface.bsdf.albedo());
        let so_far = self.next.unwrap_or(1.0);
        self.vertices.push(vertex);
        self.weights.push(so_far);
        let weight = albedo.and_then(|albedo| roulette.play(scattered, albedo, u));
        self.next = weight.map(|weight| so_far * weight as f64);
    }

    /// Computes the factors of all vertices whose neighbours are known. All paths that continue
    /// from these vertices share their factors.
    fn settle<A: Accel>(&mut self, space: &PathSpace<'_, 'a, A>, is_from_light: bool, time: f32) {
        let n = self.vertices.len();
        for i in n.saturating_sub(3)..n {
            let at = |i: Option<usize>| i.and_then(|i| self.vertices.get(i));
            let [back, onwards] = [[i.checked_sub(1), i.checked_sub(2)], [Some(i + 1), Some(i + 2)]];
            let (before, after) = if is_from_light {
                (at(onwards[0]), back.map(at))
            } else {
                (at(back[0]), onwards.map(at))
            };
            if let Some(factors) = space.factors(&self.vertices[i], before, after, time) {
                self.vertices[i].factors = factors;
            }
        }
    }
}

/// Traces one bootstrap sample of bidirectional path tracing. Returns all its paths, each with its
/// light. The light is the target divided by the density, summed over all strategies (the balance
/// heuristic, Veach 1997, §9.2.2).
pub(super) fn sample<'a, A: Accel>(
    space: &PathSpace<'_, 'a, A>,
    roulette: Roulette,
    numbers: &mut Numbers,
    out: &mut impl RaySink,
) -> Vec<(Path<'a>, f64)> {
    let mut found = Vec::new();
    let mut find = |path: Option<Path<'a>>, weight: f64| {
        let Some(path) = path else { return };
        let light = weight / space.inverse_contribution(&path, 0, path.len());
        if light > 0.0 && light.is_finite() {
            found.push((path, light));
        }
    };

    // Trace a camera subpath, and make a path to each light that it hits
    let (lens, world) = (numbers.next_2d(), space.world);
    let time = world.time_at(|| numbers.next());
    let camera_sample = CameraSample { lens, time };
    let mut camera = Subpath::new(Some(space.lens(camera_sample)));
    while let Some(weight) = camera.next.filter(|_| camera.vertices.len() < space.max_vertices) {
        let Some((ray, kind)) = space.onwards_from_camera(&mut camera.vertices, camera_sample, numbers) else {
            break;
        };
        let hit = space.intersect(&ray, kind, out);
        if is_same_point(&camera.vertices, &hit) {
            break;
        }
        let light = space.light_at(hit.clone(), &ray, numbers.next());
        if let Some(next) = hit.as_ref().or(light.as_ref()) {
            space.note_through(&mut camera.vertices, next, time, out);
        }
        let n = camera.vertices.len();
        if let Some(light) = light.filter(|_| n + 1 >= space.min_vertices) {
            let vertices = camera.vertices.iter().cloned().chain([light]).collect();
            let path = space.join(vertices, std::iter::empty(), n..n + 1, camera_sample, out);
            find(path, weight);
        }
        let Some(next) = hit else { break };
        camera.push(next, roulette, numbers.next());
        camera.settle(space, false, time);
    }

    // Trace a light subpath
    let mut first = Vec::new();
    let mut light = Subpath::new(
        space
            .extend_from_light(&mut first, 1, time, numbers, out)
            .and(first.pop()),
    );
    while light.next.is_some() && light.vertices.len() + 1 < space.max_vertices {
        if space
            .extend_from_light(&mut light.vertices, 1, time, numbers, out)
            .is_none()
        {
            break;
        }
        if let Some(next) = light.vertices.pop() {
            light.push(next, roulette, numbers.next());
            light.settle(space, true, time);
        }
    }

    // Connect both subpaths by all strategies
    let (camera_ends, light_ends) = (camera.vertices.iter().zip(1..), light.vertices.iter().zip(1..));
    for (a, t) in camera_ends {
        for (b, s) in light_ends.clone() {
            let fits = (space.min_vertices..=space.max_vertices).contains(&(s + t));
            if fits && a.is_smooth_somewhere() && b.is_smooth_somewhere() {
                let mut vertices = Vec::with_capacity(s + t);
                vertices.extend_from_slice(&camera.vertices[..t]);
                let others = light.vertices[..s].iter().cloned();
                let path = space.join(vertices, others, t..t, camera_sample, out);
                find(path, camera.weights[t - 1] * light.weights[s - 1]);
            }
        }
    }
    found
}
