//! Random numbers: pure functions of (seed, pixel, sample index, dimension).
//!
//! Samplers keep no state between samples, so the image does not depend on threads or on the order
//! of work. Dimensions have fixed blocks: one for the camera, and one for each vertex (light
//! choice, light point, lobe, direction, roulette). A skipped draw therefore does not shift later
//! draws. Random numbers that belong to no pixel, such as the numbers of photons and Markov chains,
//! use row numbers that no image has ([`Stream`]).

mod antithetic;
mod any;
mod ball;
mod discrepancy;
mod fibonacci;
mod halton;
mod hash;
mod independent;
mod orthogonal;
mod perturbed;
mod primary;
mod render_sampler;
mod sobol;
mod sphere;
mod stratified;
mod z_sobol;

pub use antithetic::Antithetic;
pub use any::{AnySampler, SamplerKind};
pub use ball::CubePoints;
pub use discrepancy::{cap_discrepancy, star_discrepancy};
pub use fibonacci::Fibonacci;
pub use halton::{Halton, Hammersley};
pub use independent::Independent;
pub use orthogonal::Orthogonal;
pub use perturbed::{Perturbation, PerturbedQmc};
pub use primary::{PrimarySampler, Step};
pub use render_sampler::RenderSampler;
pub use sobol::Sobol;
pub use stratified::Stratified;
pub use z_sobol::ZSobol;

use crate::math::{UVec2, Vec2};

/// Key of one sample of one pixel. Samples are rendered and replayed by their keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct SampleKey {
    /// Column, from the left of the full image.
    pub x: u32,
    /// Row, from the top of the full image.
    pub y: u32,
    /// Index of the sample within the pixel.
    pub sample: u32,
}

impl SampleKey {
    /// Sample `sample` of the pixel in column `x` of row `y`.
    pub fn new(x: u32, y: u32, sample: u32) -> Self {
        Self { x, y, sample }
    }

    /// Key of the sample `sample` in the column `x` of `stream`.
    pub fn of_stream(stream: Stream, x: u32, sample: u32) -> Self {
        Self::new(x, stream.row(), sample)
    }

    /// Pixel coordinates.
    pub fn pixel(self) -> UVec2 {
        UVec2::new(self.x, self.y)
    }
}

/// Streams of random numbers that belong to no pixel. Their sample keys use row numbers that no
/// image has: `u32::MAX` and the numbers just before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Markov chains of Metropolis light transport: a column for each chain.
    Chains,
    /// Paths from which Markov chains may start: a column for each path or work item.
    Bootstrap,
    /// Photon paths: a column for each work item.
    Photons,
    /// Random numbers that all paths of an iteration share, such as their time.
    Iteration,
    /// Paths that make an importance image: a column for each of its cells.
    ImportanceImage,
    /// Paths and rays that find the visible parts of the sky: a column for each path or grid cell.
    Visibility,
}

impl Stream {
    /// Row of the keys of the stream. Two streams have the same row only if no integrator draws
    /// from both.
    fn row(self) -> u32 {
        match self {
            Self::Chains => u32::MAX,
            Self::Bootstrap | Self::Photons => u32::MAX - 1,
            Self::Iteration | Self::ImportanceImage => u32::MAX - 2,
            Self::Visibility => u32::MAX - 3,
        }
    }
}

/// Index of one random decision along a path. Each path vertex has a fixed block of indices, so a
/// skipped draw never shifts a later draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimension(u32);

/// Random decisions at each path vertex.
#[derive(Clone, Copy, Debug)]
#[repr(u32)]
pub enum Bounce {
    /// Choice of the light, and Russian roulette (2-D).
    Decisions,
    /// Point on the light (2-D).
    LightPoint,
    /// Choice of the BSDF lobe.
    Lobe,
    /// Direction from the lobe (2-D).
    Direction,
}

impl Dimension {
    const BLOCK: u32 = 8;

    /// Position within the pixel (2-D).
    pub const PIXEL: Self = Self(0);
    /// Position on the lens (2-D).
    pub const LENS: Self = Self(1);
    /// Time between shutter open and close.
    pub const TIME: Self = Self(2);
    /// Choice of the sampling technique, if an integrator chooses one of several for each path.
    pub const TECHNIQUE: Self = Self(3);
    /// Choice between passing and scattering, if a camera ray hits a thin surface.
    pub const THIN_SURFACES: Self = Self(4);
    /// Wavelength of a path, in scenes with glass that disperses light.
    pub const WAVELENGTH: Self = Self(5);

    /// Dimension of the decision `what` at the path vertex after `depth` scattering events.
    pub fn bounce(depth: u32, what: Bounce) -> Self {
        Self(
            Self::BLOCK
                .wrapping_mul(depth.wrapping_add(1))
                .wrapping_add(what as u32),
        )
    }

    /// Dimension of repetition `index` of this decision, for decisions that are repeated at a
    /// vertex.
    pub fn nth(self, index: u32) -> Self {
        // Use bits from 16 up, because dimensions of path depths below 8191 end at bit 15
        Self(self.0.wrapping_add(index.wrapping_add(1) << 16))
    }

    /// Returns `true` if the dimension is the decision `what` of any path vertex.
    fn is(self, what: Bounce) -> bool {
        self.0 >= Self::BLOCK && self.0 % Self::BLOCK == what as u32
    }

    /// Position of the dimension in a numbering without gaps of all decisions along a path.
    fn ordinal(self) -> u32 {
        const OF_CAMERA: u32 = Dimension::LENS.0 + 1;
        /// Position of the time in the numbering: after all practical path depths, because few
        /// scenes move. The other dimensions then keep low positions.
        const OF_TIME: u32 = (1 << 20) - 1;
        /// Position of thin surfaces in the numbering: also after all path depths, because few
        /// scenes have thin glass.
        const OF_THIN_SURFACES: u32 = OF_TIME - 1;
        /// Position of the wavelength in the numbering: also after all path depths, because few
        /// scenes have glass that disperses light.
        const OF_WAVELENGTH: u32 = OF_TIME - 2;
        const OF_BOUNCE: u32 = Bounce::Direction as u32 + 1;
        let (block, within) = (self.0 / Self::BLOCK, self.0 % Self::BLOCK);
        match block {
            0 if self == Self::TIME => OF_TIME,
            0 if self == Self::THIN_SURFACES => OF_THIN_SURFACES,
            0 if self == Self::WAVELENGTH => OF_WAVELENGTH,
            0 => within.min(OF_CAMERA - 1),
            _ => OF_CAMERA + (block - 1) * OF_BOUNCE + within.min(OF_BOUNCE - 1),
        }
    }

    /// Upper bound of the dimension indices of paths with `depth` scattering events, without
    /// repetitions ([`Dimension::nth`]).
    pub fn end(depth: u32) -> u32 {
        Self::BLOCK.saturating_mul(depth.saturating_add(2))
    }

    /// Index of the dimension. The block of the camera comes first, then one block for each path
    /// vertex.
    pub fn index(self) -> u32 {
        self.0
    }
}

/// Source of uniform variates in [0, 1), addressed by sample and dimension. It keeps no state
/// between draws.
pub trait Sampler: Clone + Send + Sync {
    /// Starts the sample `key`.
    fn start(&mut self, key: SampleKey);

    /// Makes the numbers of different pixels independent of each other, from the next
    /// [`Sampler::start`] on.
    fn separate(&mut self) {}

    /// One variate of the current sample.
    fn get_1d(&self, dimension: Dimension) -> f32;

    /// Two variates that are stratified jointly.
    fn get_2d(&self, dimension: Dimension) -> Vec2;

    /// Two variates in each of `N` dimensions. `N` is at most 4. The variates equal the results of
    /// [`Sampler::get_2d`]. Some samplers compute several dimensions together faster.
    fn get_2ds<const N: usize>(&self, dimensions: [Dimension; N]) -> [Vec2; N] {
        dimensions.map(|dimension| self.get_2d(dimension))
    }

    /// Two variates in each of two dimensions, for `count` samples from `key` on. `count` is at
    /// most 4. The variates equal the results of [`Sampler::get_2d`]. Elements of the result from
    /// `count` on are unspecified.
    fn get_2ds_of(&self, key: SampleKey, count: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        let mut sampler = self.clone();
        std::array::from_fn(|i| {
            if i as u32 >= count {
                return [Vec2::ZERO; 2];
            }
            let sample = key.sample.wrapping_add(i as u32);
            sampler.start(SampleKey { sample, ..key });
            dimensions.map(|dimension| sampler.get_2d(dimension))
        })
    }
}

/// Two-dimensional variates of `dimension` for the samples `samples` of the pixel in column `x`.
#[cfg(test)]
fn points(mut sampler: impl Sampler, x: u32, dimension: Dimension, samples: std::ops::Range<u32>) -> Vec<Vec2> {
    let point = |sample| {
        sampler.start(SampleKey::new(x, 5, sample));
        sampler.get_2d(dimension)
    };
    samples.map(point).collect()
}
