//! Prints spherical cap discrepancies of directions for each kind of points, for the table of
//! docs/benchmarks.md:
//!
//! ```text
//! cargo run --release --example discrepancy
//! ```
//!
//! Each value for n directions is the mean over 4096 / n pixels of one seed.

use embrasure::math::Vec3;
use embrasure::sampler::{
    Bounce, CubePoints, Dimension, Fibonacci, Perturbation, PerturbedQmc, SampleKey, Sampler, SamplerKind,
    cap_discrepancy,
};
use embrasure::sampling::warp::uniform_sphere;

/// Mean discrepancy of the `count` first directions of a pixel.
fn mean(count: u32, mut sampler: impl Sampler) -> f64 {
    let mut of_pixel = |x| {
        let directions: Vec<Vec3> = (0..count)
            .map(|sample| {
                sampler.start(SampleKey::new(x, 3, sample));
                uniform_sphere(sampler.get_2d(Dimension::bounce(0, Bounce::Direction)))
            })
            .collect();
        cap_discrepancy(&directions)
    };
    let pixels = 4096 / count;
    (0..pixels).map(&mut of_pixel).sum::<f64>() / f64::from(pixels)
}

fn main() {
    for count in [16, 64, 256] {
        for kind in [SamplerKind::Independent, SamplerKind::Sobol] {
            println!("{count} {kind:?}: {:.4}", mean(count, kind.with_seed(1, count)));
        }
        let others = SamplerKind::Sobol.with_seed(1, count);
        println!(
            "{count} Fibonacci: {:.4}",
            mean(count, Fibonacci::new(1, count, others))
        );
        for points in [CubePoints::Halton, CubePoints::Hammersley, CubePoints::Sobol] {
            for size in [0.0, 0.5, 1.0] {
                let options = Perturbation {
                    points,
                    size,
                    is_scrambled: false,
                };
                let sampler = PerturbedQmc::new(1, count, options, others);
                println!("{count} {points:?}, perturbed by {size}: {:.4}", mean(count, sampler));
            }
        }
    }
}
