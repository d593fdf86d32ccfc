//! The edge-avoiding à-trous wavelet transform (Dammertz, Sewtz, Hanika and Lensch 2010,
//! "Edge-Avoiding À-Trous Wavelet Transform for Fast Global Illumination Filtering"), guided by the
//! variance like the spatial filter of SVGF (Schied et al. 2017, "Spatiotemporal Variance-Guided
//! Filtering", §4).
//!
//! Five passes blur by a 5 × 5 kernel. The tap distances are 1, 2, 4, 8 and 16 pixels, so that 5 ×
//! 25 taps reach 62 pixels. The weight of a tap decreases with the differences of normal, albedo,
//! depth and light between the tap and the filtered pixel. Light is divided by albedo before the
//! blur and multiplied by albedo afterwards, so that textures stay sharp.
//!
//! Two steps come before the passes. Without these steps, the filter leaves blotches in rooms that
//! are lit through a window, where bright samples are rare. A pixel with a bright sample has a high
//! variance, and its light spreads. Other pixels have a low variance and keep their value. The
//! first step reduces outliers and distributes their light ([`without_outliers`]). The second step
//! averages the variance over a window ([`with_mean_variance`]). On the kitchen of docs/gallery at
//! 32 samples, the steps lower relMSE from 0.038 to 0.033 and FLIP from 0.27 to 0.21.
//!
//! - The film has the variance of each pixel, so the filter needs no history, unlike SVGF.
//! - The inverse depth of a tap is compared with the inverse depth that the tangent plane of the
//!   filtered pixel has at the tap. On flat surfaces, inverse depth is linear in the image.
//! - A pass sums the differences of the taps from the filtered pixel instead of their values, so
//!   that constant light stays bit-identical.
//! - Differences of luminance are relative to the noise of the filtered pixel only. If they were
//!   relative to the noise of both pixels, the error of the kitchen would be another 5 % lower. But
//!   light of lamps would leak over the edges of the lamps, and the error of the Cornell box at 8
//!   samples would be 1.7 times as large.
//! - The sigmas give about the minimum relMSE at 16 samples per pixel on the scenes that ship with
//!   the project. The sigma of normals is larger than its optimum. The normal of a pixel on an edge
//!   is a mean of both sides, and with a smaller sigma no other pixel would be similar.

use super::DenoiseError;
use super::layers::Layers;
use crate::color::Spectrum;
use crate::math::Vec3;
use rayon::prelude::*;

/// Number of passes. Each pass has twice the tap distance of the previous pass.
const LEVELS: u32 = 5;
/// Weights of the cubic B-spline by distance in taps, for one axis. The kernel is the product of
/// the weights for both axes.
const KERNEL: [f32; 3] = [6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
/// Tolerance (sigma) for differences of luminance, in standard deviations of the noise.
const SIGMA_LIGHT: f32 = 3.0;
/// Half width in pixels of the window for outliers and variances.
const WINDOW: isize = 3;
/// Distance of the fence from the upper quartile, in interquartile ranges. Values above the fence
/// are outliers.
const FENCE: f32 = 1.5;
/// Minimum number of other pixels in the window that show the same surface. A pixel with fewer such
/// neighbours is on an edge.
const MIN_ALIKE: usize = 8;
/// Maximum factor by which a pixel is multiplied to restore light that the filter has lost.
const MAX_FACTOR: f32 = 2.0;
/// Tolerance (sigma) for the length of the difference of two mean normals.
const SIGMA_NORMAL: f32 = 0.3;
/// Tolerance (sigma) for the length of the difference of two albedos.
const SIGMA_ALBEDO: f32 = 0.15;
/// Tolerance (sigma) for the difference between the inverse depth of a tap and that of the tangent
/// plane, relative to the inverse depth of the filtered pixel.
const SIGMA_DEPTH: f32 = 0.1;
/// Minimum albedo as a divisor, because lamps and the background have albedo 0.
const MIN_ALBEDO: f32 = 0.02;

/// Input of the filter, row by row.
pub(super) struct Input {
    size: [usize; 2],
    guides: Vec<Guide>,
    light: Vec<FilteredLight>,
    /// Luminance of the light before outliers are reduced.
    raw: Vec<f32>,
}

/// Guides of a pixel, constant over all passes.
#[derive(Clone, Copy)]
struct Guide {
    /// Mean normal; zero in the background.
    normal: Vec3,
    albedo: Vec3,
    /// 1 / depth, which is linear in the picture on flat surfaces.
    disparity: f32,
    /// Change of the disparity from pixel to pixel, along rows and columns.
    gradient: [f32; 2],
    /// Divisor of the light: the albedo, or 1 if the input is not light.
    divisor: Vec3,
}

/// Light of a pixel, with its variance, between the passes of the filter.
#[derive(Clone, Copy)]
struct FilteredLight {
    /// Radiance over albedo.
    value: Vec3,
    /// Variance of the luminance of `value`.
    variance: f32,
}

impl Input {
    /// Input of the filter from `layers`. Light is divided by the albedo, coverage is not.
    pub fn new(layers: &Layers) -> Result<Self, DenoiseError> {
        let of = |layer: &Result<Vec<Vec3>, DenoiseError>| layer.clone();
        let (color, size) = (&layers.color, layers.size);
        let (albedo, normal) = (of(&layers.albedo)?, of(&layers.normal)?);
        let (depth, variance) = (layers.depth.clone()?, of(&layers.variance)?);
        let disparity: Vec<f32> = depth.iter().map(|&z| if z > 0.0 { 1.0 / z } else { 0.0 }).collect();
        let guides: Vec<Guide> = (0..color.len())
            .into_par_iter()
            .map(|i| Guide {
                normal: normal[i],
                albedo: albedo[i],
                disparity: disparity[i],
                gradient: gradient(&disparity, size, i),
                divisor: if layers.is_light {
                    albedo[i].max(Vec3::splat(MIN_ALBEDO))
                } else {
                    Vec3::ONE
                },
            })
            .collect();
        let mut light: Vec<FilteredLight> = (0..color.len())
            .map(|i| {
                let divisor = guides[i].divisor;
                // The weights of the channels in the luminance sum to 1. The weighted sum of the
                // variances is therefore an upper bound of the variance of the luminance, for any
                // correlation of the channels.
                let variance = luminance(variance[i] / (divisor * divisor));
                let value = color[i] / divisor;
                FilteredLight { value, variance }
            })
            .collect();
        // With one sample per pixel, the variance is unknown. Estimate the variance from the
        // neighbours.
        if light.iter().any(|light| !light.variance.is_finite()) {
            let estimates: Vec<f32> = (0..light.len())
                .into_par_iter()
                .map(|i| variance_around(&light, size, i))
                .collect();
            light
                .iter_mut()
                .zip(estimates)
                .for_each(|(light, v)| light.variance = v);
        }
        let raw = light.iter().map(|light| luminance(light.value)).collect();
        let light = without_outliers(&guides, &light, size);
        let light = with_mean_variance(&guides, &light, size);
        Ok(Self {
            size,
            guides,
            light,
            raw,
        })
    }
}

impl FilteredLight {
    /// Light times `factor`.
    fn scaled(self, factor: f32) -> Self {
        Self {
            value: self.value * factor,
            variance: self.variance * factor * factor,
        }
    }
}

impl Guide {
    /// Returns true if the pixel with the guide `other`, at the offset `[dx, dy]`, shows a similar
    /// surface.
    fn is_alike(&self, other: &Self, [dx, dy]: [isize; 2]) -> bool {
        let plane = self.disparity + self.gradient[0] * dx as f32 + self.gradient[1] * dy as f32;
        let distance = (other.normal - self.normal).length_squared() / (SIGMA_NORMAL * SIGMA_NORMAL)
            + (other.albedo - self.albedo).length_squared() / (SIGMA_ALBEDO * SIGMA_ALBEDO)
            + (other.disparity - plane).abs() / (SIGMA_DEPTH * self.disparity).max(f32::MIN_POSITIVE);
        distance <= 1.0
    }
}

fn luminance(value: Vec3) -> f32 {
    Spectrum::rgb(value.x, value.y, value.z).luminance()
}

/// Returns `light` with outliers reduced to a fence, which follows from the surrounding pixels on
/// the same surface. The removed light is distributed to these pixels.
///
/// The fence is Tukey's (1977, "Exploratory Data Analysis"): the upper quartile plus one and a half
/// interquartile ranges. A pixel is reduced by no more than its noise explains. A highlight of many
/// samples therefore stays. A single bright sample is reduced, because its standard deviation is as
/// large as the pixel's value. Pixels on edges have few other pixels on their surface. They stay
/// unchanged, because small lamps cannot be distinguished from them.
fn without_outliers(guides: &[Guide], light: &[FilteredLight], size: [usize; 2]) -> Vec<FilteredLight> {
    let around = |i: usize| taps(size, i, 1, WINDOW).filter(move |&(j, offset)| guides[i].is_alike(&guides[j], offset));
    let limited: Vec<FilteredLight> = (0..light.len())
        .into_par_iter()
        .map(|i| {
            let own = light[i];
            let brightness = luminance(own.value);
            let alike = around(i).filter(|&(j, _)| j != i);
            let mut others: Vec<f32> = alike.map(|(j, _)| luminance(light[j].value)).collect();
            if others.len() < MIN_ALIKE {
                return own;
            }
            others.sort_by(f32::total_cmp);
            let quartile = |n: usize| others[n * (others.len() - 1) / 4];
            let fence = quartile(3) + FENCE * (quartile(3) - quartile(1));
            let limit = fence.max(brightness - SIGMA_LIGHT * own.variance.sqrt());
            if limit < brightness {
                own.scaled(limit / brightness)
            } else {
                own
            }
        })
        .collect();

    // Distribute the removed light. For each pixel, compute the part that each similar neighbour
    // gets.
    let share = |i: usize| match around(i).count() {
        n if n <= MIN_ALIKE => Vec3::ZERO,
        n => (light[i].value - limited[i].value) / n as f32,
    };
    let shares: Vec<Vec3> = (0..light.len()).into_par_iter().map(share).collect();
    let pixel = |i: usize| {
        let givers = taps(size, i, 1, WINDOW).filter(|&(j, [dx, dy])| guides[j].is_alike(&guides[i], [-dx, -dy]));
        // The standard deviation of a part of removed light is as large as this part.
        givers.fold(limited[i], |light, (j, _)| FilteredLight {
            value: light.value + shares[j],
            variance: light.variance + luminance(shares[j]).powi(2),
        })
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// `light` with the mean variance of the surrounding pixels on the same surface. The variance of a
/// pixel without a rare bright sample is too low, but some neighbours have such a sample, and a
/// high variance.
fn with_mean_variance(guides: &[Guide], light: &[FilteredLight], size: [usize; 2]) -> Vec<FilteredLight> {
    let pixel = |i: usize| {
        let around = taps(size, i, 1, WINDOW).filter(|&(j, offset)| guides[i].is_alike(&guides[j], offset));
        let (sum, count) = around.fold((0.0, 0.0), |(sum, count), (j, _)| {
            (sum + light[j].variance, count + 1.0)
        });
        FilteredLight {
            variance: if count > 0.0 { sum / count } else { light[i].variance },
            ..light[i]
        }
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// Denoises `input` and returns its pixels, row by row.
pub(super) fn denoise(input: Input) -> Vec<Vec3> {
    let Input {
        size,
        guides,
        light,
        raw,
    } = input;
    let light = (0..LEVELS).fold(light, |light, level| pass(&guides, &light, size, 1 << level));
    let factors = lost_light(&guides, &light, raw, size);
    let pixels = light.iter().zip(&guides).zip(factors);
    pixels.map(|((l, g), factor)| l.value * factor * g.divisor).collect()
}

/// For each pixel, the light in the surroundings of the pixel before filtering, divided by the
/// light there after filtering.
///
/// A bright, noisy pixel is averaged with dark pixels, but dark pixels with little noise are not
/// averaged with the bright pixel. The picture therefore loses light. The light before filtering
/// and the light after filtering are both averaged over pixels with similar guides, whatever their
/// brightness. The ratio of the two averages is smooth, and restores lost light near its original
/// position.
fn lost_light(guides: &[Guide], light: &[FilteredLight], raw: Vec<f32>, size: [usize; 2]) -> Vec<f32> {
    let both: Vec<[f32; 2]> = raw
        .into_iter()
        .zip(light)
        .map(|(raw, light)| [raw, luminance(light.value)])
        .collect();
    let blurred = (0..LEVELS).fold(both, |both, level| {
        let step = 1 << level;
        let pixel = |i: usize| {
            let (mut sum, mut weights) = ([0.0; 2], 0.0);
            for (j, offset) in taps(size, i, step, 2) {
                let kernel = KERNEL[offset[0].unsigned_abs() / step] * KERNEL[offset[1].unsigned_abs() / step];
                if !guides[i].is_alike(&guides[j], offset) {
                    continue;
                }
                for (sum, (that, own)) in sum.iter_mut().zip(both[j].iter().zip(both[i])) {
                    *sum += kernel * (that - own);
                }
                weights += kernel;
            }
            if weights > 0.0 {
                [0, 1].map(|k| both[i][k] + sum[k] / weights)
            } else {
                both[i]
            }
        };
        (0..both.len()).into_par_iter().map(pixel).collect()
    });
    let factor = |[before, after]: [f32; 2]| {
        let factor = before / after;
        if factor.is_finite() {
            factor.clamp(MAX_FACTOR.recip(), MAX_FACTOR)
        } else {
            1.0
        }
    };
    blurred.into_iter().map(factor).collect()
}

/// A single pass with a tap distance of `step` pixels.
fn pass(guides: &[Guide], light: &[FilteredLight], size: [usize; 2], step: usize) -> Vec<FilteredLight> {
    let pixel = |i: usize| {
        let (guide, own) = (&guides[i], light[i]);
        let brightness = luminance(own.value);
        // Without noise, the tolerance is nearly 0, so that only equal values are blended.
        let tolerance = (SIGMA_LIGHT * blurred_variance(light, size, i).sqrt()).max(f32::MIN_POSITIVE);
        let depth_tolerance = (SIGMA_DEPTH * guide.disparity).max(f32::MIN_POSITIVE);
        let (mut sum, mut variance, mut weights) = (Vec3::ZERO, 0.0, 0.0);
        for (j, [dx, dy]) in taps(size, i, step, 2) {
            let (other, that) = (&guides[j], light[j]);
            let plane = guide.disparity + guide.gradient[0] * dx as f32 + guide.gradient[1] * dy as f32;
            let distance = (luminance(that.value) - brightness).abs() / tolerance
                + (other.normal - guide.normal).length_squared() / (SIGMA_NORMAL * SIGMA_NORMAL)
                + (other.albedo - guide.albedo).length_squared() / (SIGMA_ALBEDO * SIGMA_ALBEDO)
                + (other.disparity - plane).abs() / depth_tolerance;
            let kernel = KERNEL[dx.unsigned_abs() / step] * KERNEL[dy.unsigned_abs() / step];
            let weight = kernel * (-distance).exp();
            // Differences are summed, so that a constant stays bit-identical.
            sum += weight * (that.value - own.value);
            variance += weight * weight * that.variance;
            weights += weight;
        }
        FilteredLight {
            value: own.value + sum / weights,
            variance: variance / (weights * weights),
        }
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// Taps around pixel `i`: pixels inside the picture, up to `reach` taps away along rows and
/// columns, each with its index and its offset in pixels.
fn taps(size: [usize; 2], i: usize, step: usize, reach: isize) -> impl Iterator<Item = (usize, [isize; 2])> {
    let [width, height] = size;
    let (x, y) = (i % width, i / width);
    let line = move |at: usize, len: usize| {
        let offsets = (-reach..=reach).map(move |tap| tap * step as isize);
        offsets.filter_map(move |d| {
            let to = at.checked_add_signed(d).filter(|&to| to < len)?;
            Some((to, d))
        })
    };
    line(y, height).flat_map(move |(ty, dy)| line(x, width).map(move |(tx, dx)| (ty * width + tx, [dx, dy])))
}

/// Variance around pixel `i`, weighted by (1 2 1) / 4 in both directions, because the variance of a
/// single pixel is noisy.
fn blurred_variance(light: &[FilteredLight], size: [usize; 2], i: usize) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (j, [dx, dy]) in taps(size, i, 1, 1) {
        let weight = ((2 - dx.abs()) * (2 - dy.abs())) as f32;
        sum += weight * light[j].variance;
        weights += weight;
    }
    sum / weights
}

/// Sample variance of the luminance over the 7 × 7 pixels around pixel `i`.
fn variance_around(light: &[FilteredLight], size: [usize; 2], i: usize) -> f32 {
    let luminances = || taps(size, i, 1, 3).map(|(j, _)| luminance(light[j].value));
    let n = luminances().count() as f32;
    let mean = luminances().sum::<f32>() / n;
    let spread: f32 = luminances().map(|l| (l - mean).powi(2)).sum();
    spread / (n - 1.0).max(1.0)
}

/// Gradient of `values` at pixel `i` along rows and columns. Along each axis, the gradient is the
/// smaller of the differences from the two neighbours, so that an edge on one side does not affect
/// it.
fn gradient(values: &[f32], size: [usize; 2], i: usize) -> [f32; 2] {
    let [width, height] = size;
    let along = |at: usize, len: usize, stride: usize| {
        let before = (at > 0).then(|| values[i] - values[i - stride]);
        let after = (at + 1 < len).then(|| values[i + stride] - values[i]);
        match (before, after) {
            (Some(a), Some(b)) => {
                if a.abs() < b.abs() {
                    a
                } else {
                    b
                }
            }
            (a, b) => a.or(b).unwrap_or(0.0),
        }
    };
    [along(i % width, width, 1), along(i / width, height, width)]
}

#[cfg(test)]
mod tests;
