//! The edge-avoiding à-trous wavelet transform (Dammertz, Sewtz, Hanika and Lensch 2010, "Edge-Avoiding À-Trous Wavelet Transform for Fast Global
//! Illumination Filtering"), guided by the variance as the spatial filter of SVGF is (Schied et al. 2017, "Spatiotemporal Variance-Guided Filtering",
//! §4).
//!
//! Five passes blur by a 5 × 5 kernel whose taps lie 1, 2, 4, 8 and 16 pixels apart, so that 125 taps reach 62 pixels far. The weight of a tap falls
//! with the differences of normal, albedo, depth and light from the pixel's. Light divided by albedo is blurred, and multiplied by albedo afterwards,
//! so that textures stay sharp.
//!
//! Two steps come first, without which rooms that are lit through a window get dirty blotches: bright samples are rare there, the pixels that have one know of
//! much noise and spread it, and the others know of none and keep what they have. Outliers are brought down and shared out ([`without_outliers`]), and
//! the variance is averaged over a window ([`with_mean_variance`]). On the kitchen of docs/gallery at 32 samples this takes relMSE from 0.038 to 0.033 and FLIP
//! from 0.27 to 0.21.
//!
//! - The film has the variance of each pixel, so the filter needs no history, unlike SVGF.
//! - Depth is compared with a pixel's tangent plane, in 1 / depth, which is linear in the image wherever a surface is flat.
//! - Differences from the pixel are summed instead of values, so that constant light stays to the bit.
//! - Luminances are compared by the noise of the pixel alone. That of the other one besides takes another 5 % off the kitchen's error, but lets the light of
//!   lamps leak over their edges: the Cornell box at 8 samples gets 1.7 times the error.
//! - The sigmas leave about the smallest relMSE at 16 samples per pixel on the scenes that ship with the project. Normals may differ by somewhat more,
//!   so that pixels on edges, whose mean normals lie in between, find others to blend with.

use super::DenoiseError;
use super::layers::Layers;
use crate::color::Spectrum;
use crate::math::Vec3;
use rayon::prelude::*;

/// Passes; each reaches twice as far as the one before.
const LEVELS: u32 = 5;
/// Weights of the cubic B-spline by distance in taps; both axes have them.
const KERNEL: [f32; 3] = [6.0 / 16.0, 4.0 / 16.0, 1.0 / 16.0];
/// Standard deviations of the noise by which luminances may differ.
const SIGMA_LIGHT: f32 = 3.0;
/// Pixels both ways in which outliers and variances are judged.
const WINDOW: isize = 3;
/// Distances of the quartiles beyond the upper one from which on a pixel is an outlier.
const FENCE: f32 = 1.5;
/// Pixels that show the same surface as another one, below which that is on an edge.
const MIN_ALIKE: usize = 8;
/// Factor by which light that the filter lost is given back at most.
const MAX_FACTOR: f32 = 2.0;
/// Length by which mean normals may differ.
const SIGMA_NORMAL: f32 = 0.3;
/// Length by which albedos may differ.
const SIGMA_ALBEDO: f32 = 0.15;
/// Share of its depth by which a pixel may lie off another one's tangent plane.
const SIGMA_DEPTH: f32 = 0.1;
/// Albedos are divided by as if they were this at least: lamps and the background have none.
const MIN_ALBEDO: f32 = 0.02;

/// What the filter knows of a picture, row by row.
pub(super) struct Input {
    size: [usize; 2],
    guides: Vec<Guide>,
    light: Vec<FilteredLight>,
    /// Luminance of the light as it came, before outliers were brought down.
    raw: Vec<f32>,
}

/// What does not change from pass to pass.
#[derive(Clone, Copy)]
struct Guide {
    /// Mean normal; zero in the background.
    normal: Vec3,
    albedo: Vec3,
    /// 1 / depth, which is linear in the picture wherever the surface is flat.
    disparity: f32,
    /// How it changes from pixel to pixel, along rows and columns.
    gradient: [f32; 2],
    /// Divisor of the light.
    divisor: Vec3,
}

/// Filtered signal.
#[derive(Clone, Copy)]
struct FilteredLight {
    /// Radiance over albedo.
    value: Vec3,
    /// Variance of its luminance.
    variance: f32,
}

impl Input {
    /// Input made of `layers`. Coverage is not divided by the albedo.
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
                // Weights that sum to 1: the variance of the luminance is this at most, however the channels hang together.
                let variance = luminance(variance[i] / (divisor * divisor));
                let value = color[i] / divisor;
                FilteredLight { value, variance }
            })
            .collect();
        // One sample per pixel has no variance; that of its neighbours is used.
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
    /// The light times `factor`.
    fn scaled(self, factor: f32) -> Self {
        Self {
            value: self.value * factor,
            variance: self.variance * factor * factor,
        }
    }
}

impl Guide {
    /// Whether the pixel that lies so far off shows about the same surface.
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

/// `light` with outliers brought down to the fence of the pixels around that show the same surface, and what they had more shared out among these.
///
/// The fence is Tukey's (1977, "Exploratory Data Analysis"): the upper quartile and one and a half times the distance of the quartiles. A pixel comes
/// down no further than its noise explains: a highlight of many samples stays, a single bright sample, whose standard deviation is as large as the pixel's
/// value, does not. Pixels on edges, which have few others of their surface, stay as they are: small lamps are
/// nothing else.
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

    // Share out what was taken: each pixel that gives asks which pixels it shares with.
    let share = |i: usize| match around(i).count() {
        n if n <= MIN_ALIKE => Vec3::ZERO,
        n => (light[i].value - limited[i].value) / n as f32,
    };
    let shares: Vec<Vec3> = (0..light.len()).into_par_iter().map(share).collect();
    let pixel = |i: usize| {
        let givers = taps(size, i, 1, WINDOW).filter(|&(j, [dx, dy])| guides[j].is_alike(&guides[i], [-dx, -dy]));
        // A share is as uncertain as it is large.
        givers.fold(limited[i], |light, (j, _)| FilteredLight {
            value: light.value + shares[j],
            variance: light.variance + luminance(shares[j]).powi(2),
        })
    };
    (0..light.len()).into_par_iter().map(pixel).collect()
}

/// `light` with the mean variance of the pixels around that show the same surface: a pixel that has not seen a rare bright sample does not know how noisy
/// it is, but some pixels around do.
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

/// The picture without its noise.
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

/// For each pixel, how many times as much light its surroundings had before they were filtered.
///
/// Bright pixels, which are noisy, blend with dark ones more than these with them: light is lost. Before and after, light is averaged over what the guides
/// call the same surface, whatever its brightness; the ratio of both is smooth, and gives back what is lost near the place where it was.
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

/// One pass, with taps `step` pixels apart.
fn pass(guides: &[Guide], light: &[FilteredLight], size: [usize; 2], step: usize) -> Vec<FilteredLight> {
    let pixel = |i: usize| {
        let (guide, own) = (&guides[i], light[i]);
        let brightness = luminance(own.value);
        // Where nothing varies, nothing but the same may be blended.
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
            // Differences are summed, so that a constant stays to the bit.
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

/// The pixels up to `reach` taps from pixel `i` both ways, as far as they are inside: index and offset in pixels.
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

/// The variance around pixel `i`, weighted by (1 2 1) / 4 both ways: that of a single pixel is itself noisy.
fn blurred_variance(light: &[FilteredLight], size: [usize; 2], i: usize) -> f32 {
    let (mut sum, mut weights) = (0.0, 0.0);
    for (j, [dx, dy]) in taps(size, i, 1, 1) {
        let weight = ((2 - dx.abs()) * (2 - dy.abs())) as f32;
        sum += weight * light[j].variance;
        weights += weight;
    }
    sum / weights
}

/// Sample variance of the luminance over 7 × 7 pixels.
fn variance_around(light: &[FilteredLight], size: [usize; 2], i: usize) -> f32 {
    let luminances = || taps(size, i, 1, 3).map(|(j, _)| luminance(light[j].value));
    let n = luminances().count() as f32;
    let mean = luminances().sum::<f32>() / n;
    let spread: f32 = luminances().map(|l| (l - mean).powi(2)).sum();
    spread / (n - 1.0).max(1.0)
}

/// How `values` change at pixel `i` along rows and columns; of the differences to both neighbours the smaller one, which an edge
/// leaves alone.
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
