//! Denoising of pictures with alpha.
//!
//! `R G B` are premultiplied by alpha. If a filter blends these channels across an edge of alpha,
//! and keeps alpha unchanged, the colour at the edge is wrong. The error of RGB / A was 3 to 14 %,
//! and pixels with alpha 0 had light. Colour and coverage are therefore filtered separately, by the
//! same filter:
//!
//! - The *straight* colour, RGB / A, is extended into the background from the surrounding pixels,
//!   so it has no edge of alpha. Albedo and normals, which are also means over all samples, are
//!   treated in the same way.
//! - Coverage is filtered as a separate picture. The result is clamped to the range of the raw
//!   coverage of the 5 × 5 pixels around, so the inside of objects and the empty background stay
//!   bit-identical. Coverage changes by at most two standard deviations of its noise.
//! - The shadow on a ground is coverage, too. The values of its samples are not only 0 or 1, and
//!   may even be far outside of [0, 1]. In pixels without objects, the shadow is filtered as a
//!   third picture. The filter may change it by any amount within the range of the surrounding
//!   pixels.
//!
//! The result is the product of colour and coverage. In every pixel, RGB / A is therefore the
//! filtered colour, and RGB is 0 if A is 0.
//!
//! Pictures over a background colour are filtered in the same way. The light of the background is
//! subtracted before the filter, and added again behind the filtered coverage. The result equals
//! the filtered transparent picture over this colour.
//!
//! Pixels with a coverage below 1/4 have few samples, so their colour is blended with the
//! surrounding colour.

use super::DenoiseError;
use super::layers::Layers;
use crate::math::Vec3;
use rayon::prelude::*;

/// Minimum coverage of a pixel that keeps its colour. Below this coverage, the colour is blended
/// with the surrounding colour.
const MIN_COVERAGE: f32 = 0.25;
/// Half width in pixels of the window whose raw coverage bounds the filtered coverage.
const REACH: usize = 2;
/// Half width in pixels of a window. The variance of coverage is estimated by the sample variance
/// over this window.
const SPREAD_REACH: usize = 3;

/// Returns the premultiplied picture and the coverage, both filtered by `filter`. `samples` has the
/// number of samples of each pixel, if known, which limits the variance of coverage. `bright` is
/// the light that was removed before the filter. Pixels with such light keep their coverage.
pub(super) fn denoise(
    layers: &Layers,
    coverage: &[Vec3],
    (samples, bright): (Option<&[f32]>, Option<&[Vec3]>),
    filter: impl Fn(&Layers) -> Result<Vec<Vec3>, DenoiseError>,
) -> Result<(Vec<Vec3>, Vec<Vec3>), DenoiseError> {
    let means: Vec<f32> = coverage.iter().map(|a| a.element_sum() / 3.0).collect();
    let straight = filter(&straight(layers, &means))?;
    let filtered = filter(&as_light(layers, coverage, samples))?;
    let mut filtered = within_range(coverage, &filtered, layers.size);
    let mut is_ground = ground_pixels(layers);
    match shadow_layers(layers, coverage, (samples, &is_ground)) {
        Some(shadow) => {
            let shadow = within_range(coverage, &filter(&shadow)?, layers.size);
            let pixels = filtered.iter_mut().zip(shadow).zip(&is_ground);
            let of_ground = pixels.filter(|(_, is_ground)| **is_ground);
            of_ground.for_each(|((a, shadow), _)| *a = shadow);
        }
        None => is_ground.fill(false),
    }
    // Keep grey values grey, because a filter may colour them.
    if coverage.iter().all(|a| a.x == a.y && a.y == a.z) {
        filtered
            .iter_mut()
            .for_each(|a| *a = Vec3::splat(a.element_sum() / 3.0));
    }
    if let Some(samples) = samples {
        let of_objects = filtered
            .iter_mut()
            .enumerate()
            .filter(|(i, _)| !is_ground[*i] && samples[*i] >= 2.0);
        for (i, a) in of_objects {
            let (raw, n) = (coverage[i], samples[i]);
            let variance = (raw * (1.0 - raw) + Vec3::splat(0.25 / n)).max(Vec3::ZERO) / n;
            let noise = 2.0 * variance.map(f32::sqrt);
            *a = a.clamp(raw - noise, raw + noise);
        }
    }
    for (i, _) in bright
        .into_iter()
        .flatten()
        .enumerate()
        .filter(|(_, v)| **v != Vec3::ZERO)
    {
        filtered[i] = coverage[i];
    }
    let picture = straight.iter().zip(&filtered);
    let picture = picture.map(|(&color, a)| color * (a.element_sum() / 3.0)).collect();
    Ok((picture, filtered))
}

/// For each pixel, true if it shows no object. All pixels show objects if normals are unknown.
fn ground_pixels(layers: &Layers) -> Vec<bool> {
    match &layers.normal {
        Ok(normals) => normals.iter().map(|&n| n == Vec3::ZERO).collect(),
        Err(_) => vec![false; layers.color.len()],
    }
}

/// Layers with the shadow on the ground as their colour. The shadow is the coverage of pixels that
/// show no object (`is_ground`). It is extended to pixels that show objects, so that the filter
/// also removes the noise of the shadow where objects touch the ground. `None` if there is no
/// shadow.
fn shadow_layers(
    layers: &Layers,
    coverage: &[Vec3],
    (samples, is_ground): (Option<&[f32]>, &[bool]),
) -> Option<Layers> {
    let has_shadow = coverage.iter().zip(is_ground).any(|(&a, &is)| is && a != Vec3::ZERO);
    if !has_shadow {
        return None;
    }
    let weights: Vec<f32> = is_ground.iter().map(|&is| f32::from(is)).collect();
    let values: Vec<Vec3> = coverage.iter().zip(&weights).map(|(&a, &w)| w * a).collect();
    let shadow = continued(&values, &weights, layers.size);
    let flat = || Ok(vec![Vec3::ZERO; coverage.len()]);
    Some(Layers {
        albedo: flat(),
        normal: flat(),
        ..as_light(layers, &shadow, samples)
    })
}

/// Layers with colour, albedo and normals divided by the coverage, and extended beyond the covered
/// pixels.
fn straight(layers: &Layers, coverage: &[f32]) -> Layers {
    let straight = |layer: &[Vec3]| continued(layer, coverage, layers.size);
    let of_colors = |variance: &Vec<Vec3>| {
        let pairs = variance.iter().zip(coverage);
        pairs.map(|(&v, &a)| v / a.max(MIN_COVERAGE).powi(2)).collect()
    };
    Layers {
        size: layers.size,
        color: straight(&layers.color),
        variance: layers.variance.as_ref().map(of_colors).map_err(Clone::clone),
        albedo: layers.albedo.as_deref().map(straight).map_err(Clone::clone),
        normal: layers.normal.as_deref().map(straight).map_err(Clone::clone),
        depth: layers.depth.clone(),
        is_light: layers.is_light,
    }
}

/// Layers with the coverage as their colour.
fn as_light(layers: &Layers, coverage: &[Vec3], samples: Option<&[f32]>) -> Layers {
    let color = coverage.to_vec();
    let spread = spread(&color, layers.size);
    let variance = (0..coverage.len()).map(|i| match samples.map(|samples| samples[i]) {
        Some(n) if n < 2.0 => Vec3::INFINITY,
        // The estimated variance of a mean of n values in [0, 1] is at most mean (1 − mean) / (n −
        // 1).
        Some(n) => spread[i].min((coverage[i] * (1.0 - coverage[i])).max(Vec3::ZERO) / (n - 1.0)),
        None => spread[i],
    });
    Layers {
        variance: Ok(variance.collect()),
        color,
        is_light: false,
        ..layers.clone()
    }
}

/// Sample variance of the colours in the 7 × 7 pixels around each pixel.
fn spread(color: &[Vec3], size: [usize; 2]) -> Vec<Vec3> {
    let mean = box_mean(color, size);
    let squares: Vec<Vec3> = color.iter().map(|&c| c * c).collect();
    let squares = box_mean(&squares, size);
    let variance = |(&m, s): (&Vec3, Vec3)| (s - m * m).max(Vec3::ZERO);
    mean.iter().zip(squares).map(variance).collect()
}

/// For each pixel, mean over a square of pixels inside the picture: up to [`SPREAD_REACH`] pixels
/// away along rows and columns.
fn box_mean(values: &[Vec3], size: [usize; 2]) -> Vec<Vec3> {
    let [width, height] = size;
    let along = |values: &[Vec3], place: &(dyn Fn(usize) -> [usize; 2] + Sync), stride: usize| -> Vec<Vec3> {
        let pixel = |i: usize| {
            let [x, len] = place(i);
            let (first, last) = (x.saturating_sub(SPREAD_REACH), (x + SPREAD_REACH).min(len - 1));
            let sum: Vec3 = (first..=last).map(|at| values[i + at * stride - x * stride]).sum();
            sum / (last - first + 1) as f32
        };
        (0..values.len()).into_par_iter().map(pixel).collect()
    };
    let rows = along(values, &|i| [i % width, width], 1);
    along(&rows, &|i| [i / width, height], width)
}

/// `layer` divided by `coverage`. Pixels without coverage get the mean colour of the surrounding
/// pixels. Pixels with a coverage below [`MIN_COVERAGE`] are blended with this mean. The means are
/// taken over blocks of 2 × 2 pixels, then over blocks of 2 × 2 such blocks, and so on (Gortler et
/// al. 1996, "The Lumigraph", §3.4, pull and push).
fn continued(layer: &[Vec3], coverage: &[f32], size: [usize; 2]) -> Vec<Vec3> {
    let own = |(&v, &a): (&Vec3, &f32)| if a > 0.0 { (v, a) } else { (Vec3::ZERO, 0.0) };
    let mut levels = vec![(size, layer.iter().zip(coverage).map(own).collect::<Vec<_>>())];
    while let Some((size, finer)) = levels.last().filter(|(size, _)| size[0] * size[1] > 1) {
        let coarser = halved(finer, *size);
        levels.push(coarser);
    }
    let mut around = vec![Vec3::ZERO];
    let mut width = 1;
    for ([w, _], sums) in levels.into_iter().rev() {
        let pixel = |(i, &(sum, weight)): (usize, &(Vec3, f32))| {
            let behind = around[(i / w / 2) * width + i % w / 2];
            let share = (weight / MIN_COVERAGE).min(1.0);
            if weight > 0.0 {
                behind.lerp(sum / weight, share)
            } else {
                behind
            }
        };
        around = sums.par_iter().enumerate().map(pixel).collect();
        width = w;
    }
    around
}

/// Returns half of the size, rounded up, and the sums over blocks of 2 × 2 pixels.
fn halved(pixels: &[(Vec3, f32)], [width, height]: [usize; 2]) -> ([usize; 2], Vec<(Vec3, f32)>) {
    let size = [width.div_ceil(2), height.div_ceil(2)];
    let block = |i: usize| {
        let (x, y) = (2 * (i % size[0]), 2 * (i / size[0]));
        let places = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let inside = places.into_iter().filter(|&(x, y)| x < width && y < height);
        inside.fold((Vec3::ZERO, 0.0), |(sum, weights), (x, y)| {
            let (v, weight) = pixels[y * width + x];
            (sum + v, weights + weight)
        })
    };
    (size, (0..size[0] * size[1]).into_par_iter().map(block).collect())
}

/// `filtered`, clamped to the range of the surrounding raw `coverage`.
fn within_range(coverage: &[Vec3], filtered: &[Vec3], size: [usize; 2]) -> Vec<Vec3> {
    let [width, height] = size;
    let around = |at: usize, len: usize| at.saturating_sub(REACH)..=(at + REACH).min(len - 1);
    let pixel = |i: usize| {
        let pixels = around(i / width, height).flat_map(|y| around(i % width, width).map(move |x| y * width + x));
        let (low, high) = pixels.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), j| {
            (low.min(coverage[j]), high.max(coverage[j]))
        });
        filtered[i].max(low).min(high)
    };
    (0..coverage.len()).into_par_iter().map(pixel).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [13, 9];

    /// Test picture: a disc of the colour `color`, and its coverage. Pixels on the edge are partly
    /// covered.
    fn disc(color: Vec3) -> (Vec<Vec3>, Vec<f32>) {
        let pixel = |i: usize| {
            let (x, y) = ((i % SIZE[0]) as f32 - 5.0, (i / SIZE[0]) as f32 - 4.0);
            (4.5 - (x * x + y * y).sqrt()).clamp(0.0, 1.0)
        };
        let coverage: Vec<f32> = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
        (coverage.iter().map(|&a| color * a).collect(), coverage)
    }

    #[test]
    fn extended_colors_are_constant_around_a_disc() {
        let color = Vec3::new(0.8, 0.4, 1e4);
        let (picture, coverage) = disc(color);
        for v in continued(&picture, &coverage, SIZE) {
            assert!((v / color - Vec3::ONE).abs().max_element() < 1e-5, "{v}");
        }
        // No pixel has coverage, so there is no colour to extend.
        let nothing = continued(&picture, &vec![0.0; picture.len()], SIZE);
        assert!(nothing.iter().all(|&v| v == Vec3::ZERO));
    }

    #[test]
    fn coverage_stays_in_the_range_around() {
        let (_, coverage) = disc(Vec3::ONE);
        let filtered = vec![Vec3::splat(0.5); coverage.len()];
        let coverage: Vec<Vec3> = coverage.into_iter().map(Vec3::splat).collect();
        let bounded = within_range(&coverage, &filtered, SIZE);
        let at = |x: usize, y: usize| bounded[y * SIZE[0] + x].y;
        // Coverage in the middle, on the edge, and outside
        assert_eq!([at(5, 4), at(9, 4), at(12, 0)], [1.0, 0.5, 0.0]);
    }
}
