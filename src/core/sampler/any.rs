//! An enum of all samplers. Each draw matches on the variant.
//!
//! The renderer is not monomorphised per sampler, because compiling each pair of backend and
//! integrator once per sampler would gain little speed (docs/notebook/2026-11.md, "Shared paths").

use super::{Antithetic, Dimension, Halton, Hammersley, Independent, Orthogonal, SampleKey, Sampler};
use super::{Sobol, Stratified, ZSobol};
use crate::math::Vec2;

/// Kinds of samplers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SamplerKind {
    /// [`Sobol`].
    Sobol,
    /// [`Independent`].
    Independent,
    /// [`Stratified`].
    Stratified,
    /// [`Stratified`], multi-jittered.
    MultiJittered,
    /// [`Halton`].
    Halton,
    /// [`Hammersley`].
    Hammersley,
    /// [`ZSobol`].
    ZSobol,
    /// [`Orthogonal`].
    Orthogonal,
    /// [`Antithetic`].
    Antithetic,
}

impl SamplerKind {
    /// Names of the kinds on the command line. The default is first.
    pub const NAMES: &[(&str, Self)] = &[
        ("zsobol", Self::ZSobol),
        ("sobol", Self::Sobol),
        ("independent", Self::Independent),
        ("stratified", Self::Stratified),
        ("cmj", Self::MultiJittered),
        ("halton", Self::Halton),
        ("hammersley", Self::Hammersley),
        ("orthogonal", Self::Orthogonal),
        ("antithetic", Self::Antithetic),
    ];

    /// Returns `true` if the numbers depend on the total number of samples per pixel.
    pub fn needs_count(self) -> bool {
        match self {
            Self::Hammersley | Self::Orthogonal => true,
            Self::Sobol
            | Self::Independent
            | Self::Stratified
            | Self::MultiJittered
            | Self::Halton
            | Self::ZSobol
            | Self::Antithetic => false,
        }
    }

    /// A sampler of this kind. `count` is the number of samples per pixel; only kinds with
    /// [`SamplerKind::needs_count`] use it.
    pub fn with_seed(self, seed: u64, count: u32) -> AnySampler {
        match self {
            Self::Sobol => AnySampler::Sobol(Sobol::new(seed)),
            Self::Independent => AnySampler::Independent(Independent::new(seed)),
            Self::Stratified => AnySampler::Stratified(Stratified::new(seed)),
            Self::MultiJittered => AnySampler::Stratified(Stratified::multi_jittered(seed)),
            Self::Halton => AnySampler::Halton(Halton::new(seed)),
            Self::Hammersley => AnySampler::Hammersley(Hammersley::new(seed, count)),
            Self::ZSobol => AnySampler::ZSobol(ZSobol::new(seed)),
            Self::Orthogonal => AnySampler::Orthogonal(Orthogonal::new(seed, count)),
            Self::Antithetic => AnySampler::Antithetic(Antithetic::new(seed)),
        }
    }
}

/// A sampler that is chosen at run time. Every draw matches on the variant, which is the same for
/// the whole render.
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)] // Each variant holds the sampler of its name.
pub enum AnySampler {
    Sobol(Sobol),
    Independent(Independent),
    Stratified(Stratified),
    Halton(Halton),
    Hammersley(Hammersley),
    ZSobol(ZSobol),
    Orthogonal(Orthogonal),
    Antithetic(Antithetic),
}

/// Evaluates the expression `$use`, in which `$sampler` is the sampler inside `$any`.
macro_rules! with {
    ($any:expr, $sampler:ident => $use:expr) => {
        match $any {
            AnySampler::Sobol($sampler) => $use,
            AnySampler::Independent($sampler) => $use,
            AnySampler::Stratified($sampler) => $use,
            AnySampler::Halton($sampler) => $use,
            AnySampler::Hammersley($sampler) => $use,
            AnySampler::ZSobol($sampler) => $use,
            AnySampler::Orthogonal($sampler) => $use,
            AnySampler::Antithetic($sampler) => $use,
        }
    };
}

impl Sampler for AnySampler {
    #[inline]
    fn start(&mut self, key: SampleKey) {
        with!(self, sampler => sampler.start(key))
    }

    #[inline]
    fn separate(&mut self) {
        with!(self, sampler => sampler.separate())
    }

    #[inline]
    fn get_1d(&self, dimension: Dimension) -> f32 {
        match self {
            Self::ZSobol(sampler) => sampler.get_1d(dimension),
            _ => self.other_1d(dimension),
        }
    }

    #[inline]
    fn get_2d(&self, dimension: Dimension) -> Vec2 {
        match self {
            Self::ZSobol(sampler) => sampler.get_2d(dimension),
            _ => self.other_2d(dimension),
        }
    }

    #[inline]
    fn get_2ds<const N: usize>(&self, dimensions: [Dimension; N]) -> [Vec2; N] {
        match self {
            Self::ZSobol(sampler) => sampler.get_2ds(dimensions),
            _ => dimensions.map(|dimension| self.other_2d(dimension)),
        }
    }

    #[inline]
    fn get_2ds_of(&self, key: SampleKey, count: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        match self {
            Self::ZSobol(sampler) => sampler.get_2ds_of(key, count, dimensions),
            _ => self.other_2ds_of(key, count, dimensions),
        }
    }
}

// Most renders draw from the default sampler. The other samplers are not inlined, to keep the code
// of the default short.
impl AnySampler {
    #[inline(never)]
    fn other_1d(&self, dimension: Dimension) -> f32 {
        with!(self, sampler => sampler.get_1d(dimension))
    }

    #[inline(never)]
    fn other_2d(&self, dimension: Dimension) -> Vec2 {
        with!(self, sampler => sampler.get_2d(dimension))
    }

    #[inline(never)]
    fn other_2ds_of(&self, key: SampleKey, count: u32, dimensions: [Dimension; 2]) -> [[Vec2; 2]; 4] {
        with!(self, sampler => sampler.get_2ds_of(key, count, dimensions))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampler::{Bounce, points};

    /// All samplers. Every test of this module runs for each of them.
    fn all() -> impl Iterator<Item = (&'static str, SamplerKind)> {
        SamplerKind::NAMES.iter().copied()
    }

    #[test]
    fn any_sample_can_be_replayed() {
        for (name, kind) in all() {
            let of = |seed, x, samples| points(kind.with_seed(seed, 100), x, Dimension::LENS, samples);
            let whole = of(5, 2, 0..200);
            for sample in [0, 1, 63, 64, 99, 100, 199] {
                assert_eq!(of(5, 2, sample..sample + 1)[0], whole[sample as usize], "{name}");
            }
            assert_ne!(whole, of(6, 2, 0..200), "{name}");
            assert_ne!(whole, of(5, 3, 0..200), "{name}");
        }
    }

    /// Batched draws are bit-identical to single draws.
    #[test]
    fn batches_equal_single_draws() {
        let dimensions = [Bounce::Decisions, Bounce::LightPoint, Bounce::Direction];
        for (name, kind) in all() {
            for sample in [0, 5, 63, 1 << 20, u32::MAX - 1] {
                let mut sampler = kind.with_seed(7, 100);
                let key = SampleKey::new(3, 4, sample);
                sampler.start(key);
                for depth in [0, 1, 9] {
                    let of = dimensions.map(|what| Dimension::bounce(depth, what));
                    let alone = of.map(|one| sampler.get_2d(one));
                    assert_eq!(sampler.get_2ds(of), alone, "{name}, {sample}");
                    let four = sampler.get_2ds([of[1], of[0], of[2], of[1]]);
                    assert_eq!(four, [alone[1], alone[0], alone[2], alone[1]], "{name}, {sample}");
                }
                let pair = [Dimension::LENS, Dimension::PIXEL];
                for (i, found) in (0..3).zip(sampler.get_2ds_of(key, 3, pair)) {
                    let sample = sample.wrapping_add(i);
                    let mut alone = kind.with_seed(7, 100);
                    alone.start(SampleKey { sample, ..key });
                    assert_eq!(found, pair.map(|one| alone.get_2d(one)), "{name}, {sample}");
                }
            }
        }
    }

    /// χ² of single samples over 16 × 16 cells. The samples have different pixels and seeds, so
    /// only the distribution of each single sample is tested.
    #[test]
    fn single_samples_are_uniform() {
        let dimensions = [
            Dimension::PIXEL,
            Dimension::bounce(2, Bounce::Direction),
            Dimension::bounce(40, Bounce::Decisions),
        ];
        for (name, kind) in all() {
            for dimension in dimensions {
                for sample in [0, 3, 70] {
                    let mut counts = [0.0f64; 256];
                    let mut ones = [0.0f64; 256];
                    for i in 0..51_200u32 {
                        let mut sampler = kind.with_seed(i as u64 / 7, 64);
                        sampler.start(SampleKey::new(i % 7, i % 11, sample));
                        let (p, q) = (sampler.get_2d(dimension), sampler.get_1d(dimension));
                        assert!(p.cmpge(Vec2::ZERO).all() && p.cmplt(Vec2::ONE).all() && (0.0..1.0).contains(&q));
                        counts[(p.x * 16.0) as usize * 16 + (p.y * 16.0) as usize] += 1.0;
                        ones[(q * 256.0) as usize] += 1.0;
                    }
                    for counts in [counts, ones] {
                        let chi2: f64 = counts.iter().map(|c| (c - 200.0).powi(2) / 200.0).sum();
                        // 255 degrees of freedom: standard deviation 22.6
                        assert!(
                            chi2 < 255.0 + 5.0 * 22.6,
                            "{name}, {dimension:?}, {sample}: χ² = {chi2}"
                        );
                    }
                }
            }
        }
    }

    /// Numbers of different dimensions are independent. Numbers of neighbouring pixels are
    /// independent if [`Sampler::separate`] was called for at least one of the two pixels.
    #[test]
    fn dimensions_and_separate_pixels_are_not_correlated() {
        let here = Dimension::bounce(0, Bounce::Direction);
        let others = [
            (here, 1, [true, true]),
            (here, 1, [true, false]),
            (here, 0, [true, false]),
            (Dimension::bounce(0, Bounce::LightPoint), 0, [false, false]),
            (Dimension::bounce(1, Bounce::Direction), 0, [false, false]),
            (Dimension::PIXEL, 0, [false, false]),
            (Dimension::bounce(9, Bounce::Direction), 1, [false, false]),
        ];
        const SEEDS: u64 = 400;
        const N: u32 = 64;
        for (name, kind) in all() {
            for (dimension, dx, are_separate) in others {
                // `separate` changes only ZSobol
                if kind != SamplerKind::ZSobol && dx == 0 && dimension == here {
                    continue;
                }
                // Mean products of numbers for one seed: x with x, and x with y. Their spread over
                // the seeds shows the correlation that chance alone causes.
                let mut products = [Vec::new(), Vec::new()];
                for seed in 0..SEEDS {
                    let of = |x, dimension, is_separate| {
                        let mut sampler = kind.with_seed(seed, N);
                        if is_separate {
                            sampler.separate();
                        }
                        points(sampler, x, dimension, 0..N)
                    };
                    let (a, b) = (of(9, here, are_separate[0]), of(9 + dx, dimension, are_separate[1]));
                    for (axis, products) in products.iter_mut().enumerate() {
                        let product = |(p, q): (&Vec2, &Vec2)| (p.x as f64 - 0.5) * (q[axis] as f64 - 0.5);
                        products.push(a.iter().zip(&b).map(product).sum::<f64>() / N as f64);
                    }
                }
                let n = SEEDS as f64;
                for products in products {
                    let mean = products.iter().sum::<f64>() / n;
                    let variance = products.iter().map(|p| (p - mean).powi(2)).sum::<f64>() / (n * (n - 1.0));
                    let z = mean / variance.sqrt();
                    assert!(z.abs() < 4.5, "{name}, {dimension:?} {dx}: {z}");
                }
            }
        }
    }

    /// Every elementary interval that the sampler stratifies contains exactly one point.
    #[test]
    fn strata_hold_one_sample_each() {
        let cells = |kind: SamplerKind, seed, [columns, rows]: [u32; 2]| {
            let dimension = Dimension::bounce(3, Bounce::LightPoint);
            let points = points(kind.with_seed(seed, 64), 3, dimension, 64..128);
            let cell = |p: &Vec2| ((p.x * columns as f32) as u32, (p.y * rows as f32) as u32);
            let mut cells: Vec<_> = points.iter().map(cell).collect();
            cells.sort_unstable();
            cells.dedup();
            cells.len()
        };
        let squares = [8, 8];
        let lines = [[64, 1], [1, 64]];
        let net = [[64, 1], [32, 2], [16, 4], [8, 8], [4, 16], [2, 32], [1, 64]];
        for seed in 0..50 {
            assert_eq!(cells(SamplerKind::Stratified, seed, squares), 64);
            for kind in [SamplerKind::MultiJittered, SamplerKind::Orthogonal] {
                for shape in [squares].into_iter().chain(lines) {
                    assert_eq!(cells(kind, seed, shape), 64, "{kind:?} {shape:?}");
                }
            }
            for kind in [SamplerKind::Sobol, SamplerKind::ZSobol, SamplerKind::Hammersley] {
                for shape in net {
                    assert_eq!(cells(kind, seed, shape), 64, "{kind:?} {shape:?}");
                }
            }
        }
        // Halton's bases for the film are 2 and 3: of any 2ᵃ 3ᵇ consecutive samples, one lies in
        // each box with the sides 2⁻ᵃ and 3⁻ᵇ.
        for start in [0, 5, 1000] {
            let points = points(
                SamplerKind::Halton.with_seed(8, 64),
                3,
                Dimension::PIXEL,
                start..start + 72,
            );
            let cell = |p: &Vec2| ((p.x * 8.0) as u32, (p.y * 9.0) as u32);
            let cells: std::collections::BTreeSet<_> = points.iter().map(cell).collect();
            assert_eq!(cells.len(), 72);
        }
    }

    /// The variance of a mean falls with the expected exponent from 4 to 64 samples, for a smooth
    /// integrand and for an integrand with an edge.
    #[test]
    fn errors_fall_as_theory_says() {
        const SEEDS: u64 = 2000;
        type Integrand<'a> = (&'a dyn Fn(Vec2) -> f64, f64);
        let error = |kind: SamplerKind, n: u32, (f, exact): Integrand| {
            let one = |seed| {
                let points = points(kind.with_seed(seed, n), 3, Dimension::PIXEL, 0..n);
                (points.iter().map(|p| f(*p)).sum::<f64>() / n as f64 - exact).powi(2)
            };
            (0..SEEDS).map(one).sum::<f64>() / SEEDS as f64
        };
        let smooth = |p: Vec2| (p.x * p.x * (1.0 + p.y)) as f64;
        let edge = |p: Vec2| f64::from(u8::from(p.x * p.x + p.y * p.y < 1.0));
        for (name, kind) in all() {
            let slope = |f: Integrand| (error(kind, 64, f) / error(kind, 4, f)).log2() / 4.0;
            let slopes = [slope((&smooth, 0.5)), slope((&edge, std::f64::consts::FRAC_PI_4))];
            println!("{name}: smooth {:.2}, edge {:.2}", slopes[0], slopes[1]);
            // Slopes must be below these values. Patterns of 64 samples are not stratified at 4
            // samples, so their errors fall faster between 4 and 64.
            let [smooth, edge] = match kind {
                SamplerKind::Independent | SamplerKind::Antithetic => [-1.0, -1.0],
                SamplerKind::Stratified => [-1.4, -1.2],
                SamplerKind::MultiJittered => [-1.8, -1.2],
                SamplerKind::Orthogonal => [-2.0, -1.4],
                SamplerKind::Halton => [-2.0, -1.3],
                SamplerKind::Hammersley => [-2.3, -1.4],
                SamplerKind::Sobol | SamplerKind::ZSobol => [-2.6, -1.4],
            };
            assert!(slopes[0] < smooth + 0.2 && slopes[1] < edge + 0.2, "{name}: {slopes:?}");
        }
    }
}
