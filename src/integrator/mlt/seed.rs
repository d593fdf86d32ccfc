use super::bidirectional::Lengths;
use super::numbers::Numbers;
use super::path::{Path, Vertex};
use super::space::PathSpace;
use crate::accel::Accel;
use crate::integrator::{RaySink, Roulette};

/// Paths that a chain may start with: all that bidirectional path tracing has found in its samples of a frame.
///
/// A chain whose first path is drawn from them in proportion to the light that they carry, and whose light is scaled by what they carry in the mean,
/// is unbiased from its first step on (Veach 1997, §11.3.1).
#[derive(Debug, Default)]
pub struct Seeds {
    seeds: Vec<Seed>,
    /// Light of all up to each.
    sums: Vec<f64>,
    /// Mean luminance of what a pixel sees by such paths.
    pub(super) mean: f64,
    /// Of paths that are made anew.
    pub(super) lengths: Lengths,
}

/// A path by its place: one of those that a sample finds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Seed {
    pub sample: u32,
    pub way: u32,
}

/// The light that the paths of a sample carry, and their numbers of vertices, in their order.
pub type Found = Vec<(f64, usize)>;

impl Seeds {
    /// Those of all `samples`, where paths have such numbers of vertices at least and at most.
    pub(super) fn new(samples: &[Found], lengths: (usize, usize)) -> Self {
        let mut seeds = Self::default();
        let mut total = 0.0;
        let mut by_length = vec![0.0; lengths.1 + 1];
        for (sample, found) in (0..).zip(samples) {
            for (way, &(light, n)) in (0..).zip(found) {
                total += light;
                by_length[n] += light;
                seeds.seeds.push(Seed { sample, way });
                seeds.sums.push(total);
            }
        }
        seeds.mean = total / samples.len().max(1) as f64;
        seeds.lengths = Lengths::new(&by_length, lengths);
        seeds
    }

    /// The one at `u` of [0, 1) of their light; `None` where there is none.
    pub(super) fn at(&self, u: f64) -> Option<Seed> {
        let light = u * self.sums.last()?;
        let index = self.sums.partition_point(|&sum| sum <= light);
        self.seeds.get(index.min(self.seeds.len() - 1)).copied()
    }
}

/// A subpath, and for each of its vertices what makes up for those that roulette has ended before.
struct Subpath<'a> {
    vertices: Vec<Vertex<'a>>,
    factors: Vec<f64>,
    /// That of the next one; `None` where the subpath ends.
    next: Option<f64>,
}

impl<'a> Subpath<'a> {
    /// One that begins with `first`.
    fn new(first: Option<Vertex<'a>>) -> Self {
        Self {
            next: first.as_ref().map(|_| 1.0),
            factors: vec![1.0; first.iter().len()],
            vertices: first.into_iter().collect(),
        }
    }

    fn push(&mut self, vertex: Vertex<'a>, roulette: Roulette, u: f32) {
        let scattered = self.vertices.len() as u32 - 1;
        let albedo = vertex.surface().map(|surface| surface.bsdf.albedo());
        let so_far = self.next.unwrap_or(1.0);
        self.vertices.push(vertex);
        self.factors.push(so_far);
        let factor = albedo.and_then(|albedo| roulette.play(scattered, albedo, u));
        self.next = factor.map(|factor| so_far * factor as f64);
    }
}

/// All paths that a sample of bidirectional path tracing finds, each with the light that it carries: its luminance over the density with which such
/// samples make it, by any of the ways there are (the balance heuristic, Veach 1997, §9.2.2).
pub(super) fn sample<'a, A: Accel>(
    space: &PathSpace<'_, 'a, A>,
    roulette: Roulette,
    numbers: &mut Numbers,
    out: &mut impl RaySink,
) -> Vec<(Path<'a>, f64)> {
    let mut found = Vec::new();
    let mut find = |path: Option<Path<'a>>, factor: f64| {
        let Some(path) = path else { return };
        let ways = space.inverse_contributions(&path, 0, path.len());
        let light = factor / ways.map(|(_, inverse)| inverse).sum::<f64>();
        if light > 0.0 && light.is_finite() {
            found.push((path, light));
        }
    };

    // A subpath from the camera, and each light that it meets
    let (lens, world) = (numbers.next_2d(), space.world);
    let time = match world.scene.is_moving() || world.camera.is_moving() {
        true => world.camera.time(numbers.next()),
        false => 0.0,
    };
    let mut camera = Subpath::new(Some(space.lens(lens, time)));
    while let Some(factor) = camera.next.filter(|_| camera.vertices.len() < space.most) {
        let Some((ray, kind)) = space.onwards_from_camera(&mut camera.vertices, (lens, time), numbers) else {
            break;
        };
        let met = space.meet(&ray, kind, out);
        let light = space.meet_light(met.clone(), &ray, numbers.next());
        if let Some(next) = met.as_ref().or(light.as_ref()) {
            if let Some(last) = camera.vertices.last_mut() {
                last.through = space.through(last, next, time, out);
            }
        }
        if let Some(light) = light {
            let vertices = camera.vertices.iter().cloned().chain([light]).collect();
            find(space.join(vertices, Vec::new(), (lens, time), out), factor);
        }
        let Some(next) = met else { break };
        camera.push(next, roulette, numbers.next());
    }

    // One from a light
    let mut first = Vec::new();
    let mut light = Subpath::new(
        space
            .extend_from_light(&mut first, 1, time, numbers, out)
            .and(first.pop()),
    );
    while light.next.is_some() && light.vertices.len() + 1 < space.most {
        if space
            .extend_from_light(&mut light.vertices, 1, time, numbers, out)
            .is_none()
        {
            break;
        }
        if let Some(next) = light.vertices.pop() {
            light.push(next, roulette, numbers.next());
        }
    }

    // All ways to join them
    for t in 1..=camera.vertices.len() {
        for s in 1..=light.vertices.len() {
            if (space.least..=space.most).contains(&(s + t)) {
                let ends = (camera.vertices[..t].to_vec(), light.vertices[..s].to_vec());
                let factor = camera.factors[t - 1] * light.factors[s - 1];
                find(space.join(ends.0, ends.1, (lens, time), out), factor);
            }
        }
    }
    found
}
