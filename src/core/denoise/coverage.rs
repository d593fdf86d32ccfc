//! Denoising of pictures with alpha.
//!
//! `R G B` are premultiplied by alpha. A filter that blends them across a rim, and leaves alpha as it
//! is, changes the colour of the rim: RGB / A was off by 3 to 14 % there, and light stood where alpha
//! is 0. Colour and coverage are therefore filtered separately, by the same filter:
//!
//! - The *straight* colour, RGB / A, is continued into the background from the pixels around, so no
//!   rim is in it. Albedo and normals, which are means over all samples too, are treated alike.
//! - Coverage is filtered as a picture of its own. It stays in the range of the raw coverage of the 5 × 5
//!   pixels around, so the inside of objects and the empty background keep it to the bit. It moves
//!   by no more than two standard deviations of its noise.
//!
//! The product of both is the result. RGB / A is the filtered colour in every pixel, and RGB is 0 if A
//! is 0. The shadow of a ground without background, which is coverage alone, is filtered too.
//!
//! Pictures over a colour are filtered alike: the light of the background is taken out before, and put
//! back behind the filtered coverage. They are those of a transparent picture over that colour.
//!
//! Pixels with a coverage below 1/4 have few samples of their own: the colour around has a part in
//! theirs.

use super::DenoiseError;
use super::layers::Layers;
use crate::math::Vec3;
use rayon::prelude::*;

/// Coverage from which on a pixel's colour is its own.
const MIN_COVERAGE: f32 = 0.25;
/// Pixels both ways whose raw coverage bounds the filtered one.
const REACH: usize = 2;
/// Half the width of the box whose spread stands for the variance of coverage, pixels.
const SPREAD_REACH: usize = 3;

/// Picture, premultiplied, and coverage, both filtered by `filter`. Pixels whose number of `samples` is
/// known have a bound of the variance of coverage. Pixels from which light was taken, `bright`, keep
/// their coverage, which that light belongs to.
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
    // A filter may colour what is grey.
    if coverage.iter().all(|a| a.x == a.y && a.y == a.z) {
        filtered
            .iter_mut()
            .for_each(|a| *a = Vec3::splat(a.element_sum() / 3.0));
    }
    if let Some(samples) = samples {
        for ((a, &raw), &n) in filtered
            .iter_mut()
            .zip(coverage)
            .zip(samples)
            .filter(|(_, n)| **n >= 2.0)
        {
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

/// Layers whose colour, albedo and normals are divided by the coverage, and continued beyond it.
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

/// Layers whose colour is the coverage.
fn as_light(layers: &Layers, coverage: &[Vec3], samples: Option<&[f32]>) -> Layers {
    let color = coverage.to_vec();
    let spread = spread(&color, layers.size);
    let variance = (0..coverage.len()).map(|i| match samples.map(|samples| samples[i]) {
        Some(n) if n < 2.0 => Vec3::INFINITY,
        // A mean of n values in [0, 1] has this variance at most.
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

/// The variance of the colours in the 7 × 7 pixels around each pixel.
fn spread(color: &[Vec3], size: [usize; 2]) -> Vec<Vec3> {
    let mean = box_mean(color, size);
    let squares: Vec<Vec3> = color.iter().map(|&c| c * c).collect();
    let squares = box_mean(&squares, size);
    let variance = |(&m, s): (&Vec3, Vec3)| (s - m * m).max(Vec3::ZERO);
    mean.iter().zip(squares).map(variance).collect()
}

/// The mean over the pixels up to [`SPREAD_REACH`] both ways, as far as they are inside.
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

/// `layer` over `coverage`, and where there is none, the mean colour around: of blocks of 2 × 2 pixels,
/// of blocks of these, and so on (Gortler et al. 1996, "The Lumigraph", §3.4, pull and push).
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

/// Sums over blocks of 2 × 2 pixels, and the size of the result.
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

/// `filtered`, moved into the range of the raw `coverage` around.
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

    /// A disc of this colour, whose rim covers its pixels in part.
    fn disc(color: Vec3) -> (Vec<Vec3>, Vec<f32>) {
        let pixel = |i: usize| {
            let (x, y) = ((i % SIZE[0]) as f32 - 5.0, (i / SIZE[0]) as f32 - 4.0);
            (4.5 - (x * x + y * y).sqrt()).clamp(0.0, 1.0)
        };
        let coverage: Vec<f32> = (0..SIZE[0] * SIZE[1]).map(pixel).collect();
        (coverage.iter().map(|&a| color * a).collect(), coverage)
    }

    #[test]
    fn continued_colors_have_no_rim() {
        let color = Vec3::new(0.8, 0.4, 1e4);
        let (picture, coverage) = disc(color);
        for v in continued(&picture, &coverage, SIZE) {
            assert!((v / color - Vec3::ONE).abs().max_element() < 1e-5, "{v}");
        }
        // Without any coverage there is no colour to continue.
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
        // In the middle, on the rim, and outside
        assert_eq!([at(5, 4), at(9, 4), at(12, 0)], [1.0, 0.5, 0.0]);
    }
}
