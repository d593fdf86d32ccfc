//! Importance image: a coarse image of the light. The target of chains is the luminance of paths
//! divided by this image.
//!
//! If chains follow only luminance, dark parts of an image stay noisy. Two-stage Metropolis light
//! transport (Veach and Guibas 1997) divides the luminance by an importance image, so that chains
//! visit dark places as often as bright places. `--metropolis-target luminance` does not use the
//! importance image.
//!
//! The image is made once, before the first iteration, from 60 samples of `bdpt` for each of about
//! 1024 cells. Its random numbers do not belong to any iteration. Any positive function that does
//! not depend on the chains keeps the chains unbiased, and all parts of a render use the same
//! function.
//!
//! The value of a cell is the median of five estimates, which a single bright path does not change.
//! A fifth of the mean is mixed in. So at places where the image found no light, the weights of
//! paths are at most five times too large. The image includes all light, also the light that chains
//! do not find; `ImportanceImage` derives why this minimises relative errors.

use super::options::name;
use crate::accel::Accel;
use crate::integrator::bidirectional::connection::Connector;
use crate::integrator::{Heuristic, RaySink, Roulette, World};
use crate::math::{UVec2, Vec2};
use crate::sampler::{Dimension, PrimarySampler, SampleKey, Sampler, Stream};

/// Coarse image of the light. Each cell has its light relative to the mean of all cells.
///
/// The target of chains is the luminance of a path divided by the importance image. So the chains
/// visit dark places about as often as bright places (two-stage Metropolis light transport, Veach
/// and Guibas 1997). Any importance image above 0 that does not depend on the chains is valid. The
/// image with the minimum relative error includes all light, also the light that chains do not
/// find. Let a region of the image have the light I of chains, the value T of the importance image,
/// and the total light L. `I / T` paths fall on this region, each with the light T. So the sum of
/// variances `I T / L²`, for a given number of paths, is minimal if T is proportional to L.
#[derive(Clone, Debug)]
pub struct ImportanceImage {
    /// Number of cells across and down.
    size: UVec2,
    /// Number of cells per pixel, across and down.
    scale: Vec2,
    /// Value of each cell, row by row.
    values: Vec<f32>,
}

/// Approximate number of cells of the image.
const CELLS: f32 = 1024.0;
/// Minimum width and height of a cell, in pixels.
const MIN_SIDE: f32 = 4.0;
/// Number of independent estimates of each cell. The median of the estimates is used, so that a
/// single very bright path does not make a cell bright.
const ESTIMATES: u32 = 5;
/// Number of samples of a cell in each estimate.
const SAMPLES: u32 = 12;
/// Fraction of the mean that is mixed into each value. It limits the weight of paths at places
/// where the image found no light.
const EVEN: f32 = 0.2;

impl ImportanceImage {
    /// A constant image. The target of chains is then the luminance of paths.
    pub fn even() -> Self {
        Self {
            size: UVec2::ONE,
            scale: Vec2::ONE,
            values: vec![1.0],
        }
    }

    /// An image for `resolution` pixels, with the value 1 in all cells.
    fn of(resolution: UVec2) -> Self {
        let resolution = resolution.as_vec2();
        let side = (resolution.x * resolution.y / CELLS).sqrt().max(MIN_SIDE);
        let size = (resolution / side).ceil().as_uvec2().max(UVec2::ONE);
        Self {
            size,
            scale: size.as_vec2() / resolution,
            values: vec![1.0; size.element_product() as usize],
        }
    }

    /// Value of the image at the film position `film` (pixels, origin top left), interpolated
    /// bilinearly between the centres of cells. It is above 0.
    pub fn at(&self, film: Vec2) -> f32 {
        let last = (self.size - 1).as_vec2();
        let at = (film * self.scale - 0.5).clamp(Vec2::ZERO, last);
        let first = at.floor();
        let part = at - first;
        let (first, next) = (first.as_uvec2(), (first + 1.0).min(last).as_uvec2());
        let of = |x: u32, y: u32| self.values[(y * self.size.x + x) as usize];
        let row = |y: u32| of(first.x, y) + part.x * (of(next.x, y) - of(first.x, y));
        row(first.y) + part.y * (row(next.y) - row(first.y))
    }

    /// Index of the cell at the film position `film` (pixels). `None` outside of the image.
    fn cell(&self, film: Vec2) -> Option<usize> {
        let at = film * self.scale;
        let is_in = at.cmpge(Vec2::ZERO).all() && at.cmplt(self.size.as_vec2()).all();
        is_in.then(|| (at.y as u32 * self.size.x + at.x as u32) as usize)
    }
}

/// Maker of importance images, by bidirectional path tracing with few samples.
#[derive(Debug)]
pub struct ImportanceImageMaker<'a, A> {
    /// World with the scene and the camera.
    pub world: World<'a, A>,
    /// MIS heuristic of the strategies.
    pub heuristic: Heuristic,
    /// Maximum number of scattering events of a path. `None`: the maximum of a path, 64.
    pub max_depth: Option<u32>,
    /// Russian roulette of the subpaths.
    pub roulette: Roulette,
}

impl<A: Accel> ImportanceImageMaker<'_, A> {
    /// Number of work items.
    pub const WORK_ITEMS: u32 = ESTIMATES * SAMPLES;

    /// Runs work item `index`, which traces one sample of each cell. Returns the luminance of each
    /// cell.
    pub fn work_item<S: Sampler>(&self, index: u32, sampler: &mut S, out: &mut impl RaySink) -> Vec<f64> {
        let connector = Connector::new(&self.world, self.heuristic, self.roulette, self.max_depth);
        let picture = ImportanceImage::of(self.world.camera.resolution());
        let mut light = vec![0.0; picture.values.len()];
        for cell in 0..light.len() {
            sampler.start(SampleKey::of_stream(Stream::ImportanceImage, cell as u32, index));
            let numbers = PrimarySampler::new(name(sampler));
            let corner = UVec2::new(cell as u32 % picture.size.x, cell as u32 / picture.size.x);
            let film = (corner.as_vec2() + numbers.get_2d(Dimension::PIXEL)) / picture.scale;
            let ray = self.world.ray_through(film, self.world.time(&numbers), &numbers);
            let mut paths = connector.subpaths(ray, &numbers, out);
            connector.all(&mut paths, &numbers, out, |c| {
                let seen = self.world.camera.sees(film).then_some(cell);
                let place = c.film.map_or(seen, |film| picture.cell(film));
                let luminance = (c.radiance * c.weight).luminance() as f64;
                if let Some(place) = place.filter(|_| luminance.is_finite()) {
                    light[place] += luminance;
                }
            });
        }
        light
    }

    /// Makes the importance image from the results of all work items, given in the order of their
    /// indices.
    pub fn join(&self, work_items: &[Vec<f64>]) -> ImportanceImage {
        let mut picture = ImportanceImage::of(self.world.camera.resolution());
        let estimates = work_items.chunks(SAMPLES as usize);
        let median = |cell: usize| {
            let sum = |estimate: &[Vec<f64>]| estimate.iter().map(|light| light[cell]).sum::<f64>();
            let mut all: Vec<f64> = estimates.clone().map(sum).collect();
            all.sort_by(f64::total_cmp);
            all.get(all.len() / 2).copied().unwrap_or(0.0)
        };
        let light: Vec<f64> = (0..picture.values.len()).map(median).collect();
        let mean = light.iter().sum::<f64>() / light.len() as f64;
        if mean > 0.0 && mean.is_finite() {
            let value = |light: f64| (light / mean) as f32 * (1.0 - EVEN) + EVEN;
            picture.values = light.into_iter().map(value).collect();
        }
        picture
    }
}
