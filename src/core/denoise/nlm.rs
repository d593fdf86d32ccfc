//! Non-local means (Buades, Coll and Morel 2005, "A Non-Local Algorithm for Image Denoising"), by the variance of each pixel: the distance of two patches
//! is what their squared difference is above the one that noise alone makes (Rousselle, Knaus and Zwicker 2012, "Adaptive Rendering with Non-Local
//! Means Filtering", equation 3):
//!
//! `d²(p, q) = ((u_p − u_q)² − (σ²_p + min(σ²_p, σ²_q))) / (ε + k² (σ²_p + σ²_q))`, `w = exp(−max(0, mean of d² over patch and channels))`
//!
//! One offset of the window after the other is taken for all pixels: the distances of an offset, summed over patches by a box filter along rows and columns.

use super::DenoiseError;
use super::layers::Layers;
use crate::math::Vec3;
use rayon::prelude::*;
use std::iter::Sum;
use std::ops::Div;

/// Half the width of the window in pixels where none is given.
pub(super) const RADIUS: f32 = 7.0;
/// Half the width of patches, pixels.
const PATCH: usize = 3;
/// Sharpness k: noise by which patches may differ.
const SHARPNESS: f32 = 0.5;
/// Keeps distances finite where neither pixel has any variance.
const EPSILON: f32 = 1e-10;
/// Half the width of the box over which variances are averaged: that of a pixel with few samples is itself noisy.
const VARIANCE_REACH: usize = 1;
/// Half the width of the box whose spread stands for variances that are not known.
const SPREAD_REACH: usize = 3;

/// The picture of `layers` without its noise. The window reaches `radius` pixels both ways.
pub(super) fn denoise(layers: &Layers, radius: f32) -> Result<Vec<Vec3>, DenoiseError> {
    let (color, size) = (&layers.color, layers.size);
    let given = layers.variance.as_ref().map_err(Clone::clone)?;
    let variance = match given.iter().all(|v| v.is_finite()) {
        true => box_mean(given, size, VARIANCE_REACH),
        // One sample per pixel has no variance; that of its neighbours is used.
        false => spread(color, size),
    };
    Ok(filter(color, &variance, size, radius.round().max(1.0) as isize))
}

fn filter(color: &[Vec3], variance: &[Vec3], size: [usize; 2], reach: isize) -> Vec<Vec3> {
    let [width, height] = size;
    let mut sums: Vec<(Vec3, f32)> = vec![(Vec3::ZERO, 0.0); color.len()];
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let other = |i: usize| {
                let x = (i % width).checked_add_signed(dx).filter(|&x| x < width)?;
                let y = (i / width).checked_add_signed(dy).filter(|&y| y < height)?;
                Some(y * width + x)
            };
            let distances: Vec<f32> = (0..color.len())
                .into_par_iter()
                .map(|i| match other(i) {
                    Some(j) => distance([color[i], color[j]], [variance[i], variance[j]]),
                    None => 0.0,
                })
                .collect();
            let distances = box_mean(&distances, size, PATCH);
            sums.par_iter_mut().enumerate().for_each(|(i, (sum, weights))| {
                if let Some(j) = other(i) {
                    let weight = (-distances[i].max(0.0)).exp();
                    // Differences are summed, so that a constant stays to the bit.
                    *sum += weight * (color[j] - color[i]);
                    *weights += weight;
                }
            });
        }
    }
    let mean = |(&own, (sum, weights)): (&Vec3, (Vec3, f32))| own + sum / weights;
    color.iter().zip(sums).map(mean).collect()
}

/// The distance of two pixels, the mean over the channels.
fn distance([a, b]: [Vec3; 2], [of_a, of_b]: [Vec3; 2]) -> f32 {
    let squared = (a - b) * (a - b);
    let by_noise = of_a + of_a.min(of_b);
    let scale = Vec3::splat(EPSILON) + SHARPNESS * SHARPNESS * (of_a + of_b);
    ((squared - by_noise) / scale).element_sum() / 3.0
}

/// The mean over the pixels up to `reach` both ways, as far as they are inside.
fn box_mean<T: Copy + Send + Sync + Sum + Div<f32, Output = T>>(
    values: &[T],
    size: [usize; 2],
    reach: usize,
) -> Vec<T> {
    let [width, height] = size;
    let along = |values: &[T], place: &(dyn Fn(usize) -> [usize; 2] + Sync), stride: usize| -> Vec<T> {
        let pixel = |i: usize| {
            let [x, len] = place(i);
            let (first, last) = (x.saturating_sub(reach), (x + reach).min(len - 1));
            let sum: T = (first..=last).map(|at| values[i + at * stride - x * stride]).sum();
            sum / (last - first + 1) as f32
        };
        (0..values.len()).into_par_iter().map(pixel).collect()
    };
    let rows = along(values, &|i| [i % width, width], 1);
    along(&rows, &|i| [i / width, height], width)
}

/// The variance of the colours around each pixel.
pub(super) fn spread(color: &[Vec3], size: [usize; 2]) -> Vec<Vec3> {
    let mean = box_mean(color, size, SPREAD_REACH);
    let squares: Vec<Vec3> = color.iter().map(|&c| c * c).collect();
    let squares = box_mean(&squares, size, SPREAD_REACH);
    mean.iter()
        .zip(squares)
        .map(|(&m, s)| (s - m * m).max(Vec3::ZERO))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::hash::{GOLDEN_GAMMA, mix};

    const SIZE: [usize; 2] = [48, 32];

    /// A step in the middle, with noise of this standard deviation; and its variance.
    fn step(levels: [f32; 2], noise: f32) -> (Vec<Vec3>, Vec<Vec3>) {
        let pixel = |i: usize| {
            let level = levels[usize::from(i % SIZE[0] >= SIZE[0] / 2)];
            let u = (mix((i as u64 + 1).wrapping_mul(GOLDEN_GAMMA)) >> 40) as f32 / (1 << 23) as f32 - 1.0;
            Vec3::splat(level + noise * 3f32.sqrt() * u)
        };
        let color: Vec<Vec3> = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
        let variance = vec![Vec3::splat(noise * noise); color.len()];
        (color, variance)
    }

    #[test]
    fn constants_stay_to_the_bit() {
        let (color, variance) = step([0.7, 0.7], 0.0);
        assert_eq!(filter(&color, &variance, SIZE, 3), color);
    }

    #[test]
    fn noise_falls_and_edges_stay() {
        let (color, variance) = step([1.0, 2.0], 0.1);
        let filtered = filter(&color, &variance, SIZE, 7);
        let error = |picture: &[Vec3]| -> f32 {
            let pixels = picture.iter().enumerate();
            let squared = |(i, v): (usize, &Vec3)| (v.x - if i % SIZE[0] >= SIZE[0] / 2 { 2.0 } else { 1.0 }).powi(2);
            pixels.map(squared).sum::<f32>() / picture.len() as f32
        };
        let (before, after) = (error(&color), error(&filtered));
        println!("{before} becomes {after}");
        assert!(after < 0.1 * before, "{before} becomes {after}");
    }

    /// Where variances are not known, the spread around each pixel stands for them.
    #[test]
    fn the_spread_of_even_noise_is_its_variance() {
        let (color, _) = step([1.0, 1.0], 0.1);
        let spread = spread(&color, SIZE);
        let mean: f32 = spread.iter().map(|v| v.y).sum::<f32>() / spread.len() as f32;
        assert!((mean / 0.01 - 1.0).abs() < 0.1, "{mean}");
    }
}
