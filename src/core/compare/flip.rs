//! FLIP: a measure of the difference that a viewer sees when two images alternate on a screen, from
//! 0 (equal) to 1.
//!
//! Sources: Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A
//! Difference Evaluator for Alternating Images", and for images of high dynamic range Andersson,
//! Nilsson, Shirley and Akenine-Möller 2021, "Visualizing Errors in Rendered High Dynamic Range
//! Images". The parameters are from the papers. The viewer sits 0.7 m in front of a screen that is
//! 0.7 m wide and has 3840 columns. The code is written from the papers, because the authors' tool
//! is in C++. docs/guide/reference/compare.md compares the results of both programs.

use super::metrics::{SizeMismatch, same_size};
use crate::color::tone::narkowicz;
use crate::color::xyz::{WHITE, linear_to_xyz, xyz_to_linear};
use crate::film::RgbImage;
use rayon::prelude::*;

/// Pixels per degree of the viewer's field of view: the distance in metres, times pixels per metre,
/// times one degree in radians.
const PIXELS_PER_DEGREE: f32 = 0.7 * (3840.0 / 0.7) * (std::f32::consts::PI / 180.0);

/// Exposure factor before Narkowicz's curve. With this factor, the curve is as bright as ACES.
const PRE_EXPOSURE: f32 = 0.6;

/// Perceived error of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// Error of each pixel, 0 to 1, row by row from the top.
    pub map: Vec<f32>,
    /// Mean error over the pixels.
    pub mean: f64,
    /// Exposures of the compared pictures; `None` if they were compared unchanged.
    pub exposures: Option<Exposures>,
}

/// Exposures of the compared pictures, in equal steps of stops. The factor 0.6 that is applied
/// before Narkowicz's curve is not included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exposures {
    /// Darkest exposure in stops.
    pub start: f32,
    /// Brightest exposure in stops.
    pub stop: f32,
    /// Number of exposures.
    pub count: u32,
}

impl Flip {
    /// Error map of pictures of low dynamic range: linear values, which a display clips to [0, 1].
    pub fn ldr(image: &RgbImage, reference: &RgbImage) -> Result<Self, SizeMismatch> {
        same_size(image, reference)?;
        let shown = |picture: &RgbImage| PerceivedPicture::new(picture, |v| v);
        let map = errors(&shown(image), &shown(reference));
        Ok(Self::of_map(map, None))
    }

    /// Error map of pictures of high dynamic range: the maximum error over several exposures. The
    /// darkest exposure fits the brightest pixel of the reference to the range of the display, the
    /// brightest exposure fits the median.
    pub fn hdr(image: &RgbImage, reference: &RgbImage) -> Result<Self, SizeMismatch> {
        same_size(image, reference)?;
        let exposures = Exposures::of(reference);
        let mut map = vec![0.0f32; reference.pixels.len()];
        for stops in exposures.all() {
            let gain = PRE_EXPOSURE * stops.exp2();
            let shown = |picture: &RgbImage| PerceivedPicture::new(picture, |v| narkowicz(gain * v));
            let at_exposure = errors(&shown(image), &shown(reference));
            map.iter_mut().zip(at_exposure).for_each(|(max, e)| *max = max.max(e));
        }
        Ok(Self::of_map(map, Some(exposures)))
    }

    fn of_map(map: Vec<f32>, exposures: Option<Exposures>) -> Self {
        let mean = map.iter().map(|&e| e as f64).sum::<f64>() / map.len().max(1) as f64;
        Self { map, mean, exposures }
    }
}

impl Exposures {
    /// Exposures for `reference`: from the exposure that maps the brightest pixel of `reference` to
    /// 0.85 of the display's range, to the exposure that maps the median to 0.85 (2021, section
    /// 4.2).
    fn of(reference: &RgbImage) -> Self {
        const TARGET: f32 = 0.85;
        // Input of Narkowicz's curve for the output t = `TARGET`: the larger solution of (2.51 −
        // 2.43 t) x² + (0.03 − 0.59 t) x − 0.14 t = 0
        let (a, b, c) = (2.51 - 2.43 * TARGET, 0.03 - 0.59 * TARGET, -0.14 * TARGET);
        let white = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a) / PRE_EXPOSURE;

        let mut luminances: Vec<f32> = reference
            .pixels
            .iter()
            .map(|&p| linear_to_xyz(p.map(sane))[1])
            .collect();
        luminances.sort_by(f32::total_cmp);
        let at = |i: usize| luminances.get(i).copied().unwrap_or(0.0);
        let n = luminances.len();
        let (max, median) = (at(n.saturating_sub(1)), 0.5 * (at(n.saturating_sub(1) / 2) + at(n / 2)));
        if max <= 0.0 {
            // A black reference has one exposure.
            return Self {
                start: 0.0,
                stop: 0.0,
                count: 1,
            };
        }
        let start = (white / max).log2();
        let stop = (white / median.max(f32::EPSILON)).log2().max(start);
        let count = ((stop - start).ceil() as u32).max(2);
        Self { start, stop, count }
    }

    /// All exposures in stops.
    fn all(self) -> impl Iterator<Item = f32> {
        let step = (self.stop - self.start) / self.count.saturating_sub(1).max(1) as f32;
        (0..self.count).map(move |i| self.start + i as f32 * step)
    }
}

/// Clamps `value` to [0, 10¹⁸], so that its square is finite. NaN becomes 0.
fn sane(value: f32) -> f32 {
    // `max` maps NaN to 0.
    f32::max(value, 0.0).min(1e18)
}

/// A picture as a viewer perceives it.
struct PerceivedPicture {
    /// L*a*b* of each pixel, after the filters for the eye's contrast sensitivity, with the Hunt
    /// effect in a* and b*.
    colors: Vec<[f32; 3]>,
    /// Magnitudes of the responses to edges and to points.
    features: Vec<[f32; 2]>,
}

impl PerceivedPicture {
    /// What a viewer perceives of `picture`, which has linear values. `shown` converts linear
    /// values to displayed values.
    fn new(picture: &RgbImage, shown: impl Fn(f32) -> f32 + Sync) -> Self {
        let size = (picture.width, picture.height);
        let opponent: Vec<[f32; 3]> = picture
            .pixels
            .par_iter()
            .map(|p| to_opponent(p.map(|v| shown(sane(v)).min(1.0))))
            .collect();
        let plane = |c: usize| Plane::new(opponent.iter().map(|p| p[c]).collect(), size);
        let lightness = plane(0);
        let gray = Plane::new(lightness.values.iter().map(|y| (y + 16.0) / 116.0).collect(), size);
        Self {
            colors: seen_colors([lightness, plane(1), plane(2)]),
            features: features(&gray),
        }
    }
}

/// Errors of the pixels: differences of colours, increased by differences of features (2020,
/// section 4.3).
fn errors(image: &PerceivedPicture, reference: &PerceivedPicture) -> Vec<f32> {
    let largest = {
        let [green, blue] = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|p| hunt(to_lab(linear_to_xyz(p))));
        hyab(green, blue).powf(COLOR_EXPONENT)
    };
    let colors = image.colors.par_iter().zip(&reference.colors);
    let colors = colors.map(|(a, b)| redistributed(hyab(*a, *b).powf(COLOR_EXPONENT), largest));
    let features = image.features.par_iter().zip(&reference.features);
    let features = features.map(|(f, g)| {
        let difference = f32::max((f[0] - g[0]).abs(), (f[1] - g[1]).abs());
        (difference * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0)
    });
    let raised = |(color, feature): (f32, f32)| color.powf(1.0 - feature).clamp(0.0, 1.0);
    colors.zip(features).map(raised).collect()
}

/// Exponent that compresses differences of colours.
const COLOR_EXPONENT: f32 = 0.7;

/// Maps a difference of colours to [0, 1] (2020, section 4.1.3). Differences from 0 to 0.4 ·
/// `largest` are mapped to 0 to 0.95, larger differences to 0.95 to 1.
fn redistributed(difference: f32, largest: f32) -> f32 {
    let (knee, range) = (0.4 * largest, 0.95);
    if difference < knee {
        range / knee * difference
    } else {
        range + (difference - knee) / (largest - knee) * (1.0 - range)
    }
}

// Functions for colours

/// Converts linear Rec.709 to the opponent space YCxCz, which is L*a*b* without its cube roots
/// (Flohr et al. 1993).
fn to_opponent(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = linear_to_xyz(rgb);
    let (x, y, z) = (x / WHITE[0], y / WHITE[1], z / WHITE[2]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Inverse of [`to_opponent`].
fn from_opponent([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let (x, z) = (y + cx / 500.0, y - cz / 200.0);
    xyz_to_linear([x * WHITE[0], y * WHITE[1], z * WHITE[2]])
}

/// Converts XYZ to L*a*b* (CIE 15).
fn to_lab(xyz: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |c: usize| {
        let t = xyz[c] / WHITE[c];
        if t > DELTA * DELTA * DELTA {
            t.cbrt()
        } else {
            t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
        }
    };
    let (x, y, z) = (root(0), root(1), root(2));
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// Hunt effect: dark colours look less colourful (Hunt 1952).
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// City-block distance of lightness and Euclidean distance of chroma, for large differences (Abasi,
/// Amani Tehrani and Fairchild 2020).
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

// Functions for filters

/// Colours that the eye perceives at the viewing distance. Each channel is filtered by the contrast
/// sensitivity of the eye for this channel (2020, table 1).
fn seen_colors([lightness, red_green, blue_yellow]: [Plane; 3]) -> Vec<[f32; 3]> {
    // Gaussians a √(π / b) exp(−π² x² / b), where x is in degrees
    let [narrow, red, blue, wide] = [0.0047, 0.0053, 0.04, 0.025].map(sensitivity);
    let lightness = lightness.filtered(&narrow.kernel, &narrow.kernel);
    let red_green = red_green.filtered(&red.kernel, &red.kernel);
    // The sensitivity to blue and yellow is the sum of two Gaussians.
    let shares = [34.1 * blue.volume, 13.5 * wide.volume];
    let [share, rest] = shares.map(|s| s / (shares[0] + shares[1]));
    let first = blue_yellow.filtered(&blue.kernel, &blue.kernel);
    let second = blue_yellow.filtered(&wide.kernel, &wide.kernel);
    (0..lightness.values.len())
        .into_par_iter()
        .map(|i| {
            let blue_yellow = share * first.values[i] + rest * second.values[i];
            let rgb = from_opponent([lightness.values[i], red_green.values[i], blue_yellow]);
            hunt(to_lab(linear_to_xyz(rgb.map(|v| v.clamp(0.0, 1.0)))))
        })
        .collect()
}

/// A separable Gaussian `a √(π / b) exp(−π² x² / b)`. `kernel` has the weights of the Gaussian
/// along a line, which sum to 1. `volume` is the sum of the Gaussian over all pixels of the plane
/// for a = 1.
struct Sensitivity {
    kernel: Vec<f32>,
    volume: f32,
}

fn sensitivity(b: f32) -> Sensitivity {
    use std::f32::consts::PI;
    // The radius of all kernels is three standard deviations of the widest kernel.
    let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let gaussian = |x: i32| (-(PI * x as f32 / PIXELS_PER_DEGREE).powi(2) / b).exp();
    let mut kernel: Vec<f32> = (-radius..=radius).map(gaussian).collect();
    let sum: f32 = kernel.iter().sum();
    kernel.iter_mut().for_each(|k| *k /= sum);
    Sensitivity {
        kernel,
        volume: (PI / b).sqrt() * sum * sum,
    }
}

/// Responses to edges and points: filters by derivatives of a Gaussian, with the width of the eye's
/// sensitivity (2020, section 4.2).
fn features(gray: &Plane) -> Vec<[f32; 2]> {
    let deviation = 0.5 * 0.082 * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |f: &dyn Fn(f32) -> f32| -> Vec<f32> {
        let weight = |x: i32| f(x as f32) * (-(x as f32).powi(2) / (2.0 * deviation * deviation)).exp();
        let mut kernel: Vec<f32> = (-radius..=radius).map(weight).collect();
        // Scale the kernel: positive weights sum to 1, negative weights to −1
        let positive: f32 = kernel.iter().filter(|k| **k > 0.0).sum();
        let negative: f32 = -kernel.iter().filter(|k| **k < 0.0).sum::<f32>();
        kernel
            .iter_mut()
            .for_each(|k| *k /= if *k > 0.0 { positive } else { negative });
        kernel
    };
    let smooth = kernel(&|_| 1.0);
    let slope = kernel(&|x| -x);
    let bend = kernel(&|x| (x / deviation).powi(2) - 1.0);
    let magnitudes = |kernel: &[f32]| {
        let (across, down) = (gray.filtered(kernel, &smooth), gray.filtered(&smooth, kernel));
        let pairs = across.values.into_iter().zip(down.values);
        pairs.map(|(x, y)| x.hypot(y)).collect::<Vec<f32>>()
    };
    let (edges, points) = (magnitudes(&slope), magnitudes(&bend));
    edges.into_iter().zip(points).map(|(e, p)| [e, p]).collect()
}

/// A channel of a picture.
struct Plane {
    values: Vec<f32>,
    width: usize,
    height: usize,
}

impl Plane {
    fn new(values: Vec<f32>, (width, height): (usize, usize)) -> Self {
        Self { values, width, height }
    }

    /// Returns the plane, filtered by the product of two kernels of odd length. Pixels outside of
    /// the picture have the values of the border pixels.
    fn filtered(&self, across: &[f32], down: &[f32]) -> Self {
        let (width, height) = (self.width.max(1), self.height.max(1));
        let add = |sums: &mut [f32], weight: f32, values: &[f32]| {
            sums.iter_mut().zip(values).for_each(|(sum, v)| *sum += weight * v);
        };
        let mut rows = vec![0.0; self.values.len()];
        let pairs = rows.par_chunks_mut(width).zip(self.values.par_chunks(width));
        pairs.for_each(|(to, from)| {
            let border = across.len() / 2;
            let (first, last) = (from.first().copied(), from.last().copied());
            let outside = |value: Option<f32>| std::iter::repeat_n(value.unwrap_or(0.0), border);
            let wide: Vec<f32> = outside(first)
                .chain(from.iter().copied())
                .chain(outside(last))
                .collect();
            for (weight, values) in across.iter().zip(wide.windows(width)) {
                add(to, *weight, values);
            }
        });
        let mut values = vec![0.0; rows.len()];
        values.par_chunks_mut(width).enumerate().for_each(|(y, to)| {
            for (k, weight) in down.iter().enumerate() {
                let row = (y + k).saturating_sub(down.len() / 2).min(height - 1);
                add(to, *weight, rows.get(row * width..).unwrap_or_default());
            }
        });
        Self::new(values, (self.width, self.height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (usize, usize) = (48, 40);

    fn picture(pixel: impl Fn(usize, usize) -> [f32; 3]) -> RgbImage {
        let (width, height) = SIZE;
        RgbImage {
            width,
            height,
            pixels: (0..width * height).map(|i| pixel(i % width, i / width)).collect(),
        }
    }

    /// Test picture in linear values from 0 to 1: waves with a different wavelength in each
    /// channel.
    fn waves(x: usize, y: usize) -> [f64; 3] {
        let (x, y) = (x as f64, y as f64);
        [0.0, 1.0, 2.0].map(|c| 0.5 + 0.5 * (0.31 * x + 0.17 * y * (c + 1.0) + c).sin())
    }

    /// Test picture: `waves`, slightly darker, with bright dots.
    fn dotted(x: usize, y: usize) -> [f64; 3] {
        let dot = if (x + 2 * y) % 7 == 0 { 0.06 } else { 0.0 };
        waves(x, y).map(|v| 0.93 * v + dot)
    }

    /// Expected values are results of flip-evaluator 1.7 (PyPI, the authors' own tool) for the same
    /// pictures.
    #[test]
    fn results_equal_flip_evaluator() {
        let single = |p: [f64; 3]| p.map(|v| v as f32);
        let (a, b) = (
            picture(|x, y| single(waves(x, y))),
            picture(|x, y| single(dotted(x, y))),
        );
        let ldr = Flip::ldr(&b, &a).unwrap();
        assert!((ldr.mean - 0.156_176).abs() < 2e-5, "{}", ldr.mean);
        for (place, expected) in [(0, 0.155_754), (20 * SIZE.0 + 10, 0.157_403)] {
            assert!(
                (ldr.map[place] - expected).abs() < 5e-5,
                "{} at {place}",
                ldr.map[place]
            );
        }
        assert_eq!(ldr.exposures, None);

        let cubed = |p: [f64; 3]| p.map(|v| (8.0 * (v as f32 as f64).powi(3)) as f32);
        let (a, b) = (picture(|x, y| cubed(waves(x, y))), picture(|x, y| cubed(dotted(x, y))));
        let hdr = Flip::hdr(&b, &a).unwrap();
        assert!((hdr.mean - 0.175_095).abs() < 2e-5, "{}", hdr.mean);
        assert!((hdr.map[20 * SIZE.0 + 10] - 0.204_515).abs() < 5e-5);
        let exposures = hdr.exposures.unwrap();
        assert!(
            (exposures.start + 1.903_195).abs() < 2e-3 && (exposures.stop - 0.231_750).abs() < 2e-3,
            "{exposures:?}"
        );
        assert_eq!(exposures.count, 3);
    }

    #[test]
    fn differences_of_extreme_colors_are_those_of_flip() {
        let flat = |color: [f32; 3]| picture(|_, _| color);
        let between = |a, b| Flip::ldr(&flat(a), &flat(b)).unwrap().mean;
        // In FLIP, green and blue have the maximum difference 1. The expected value for black and
        // white is a result of flip-evaluator.
        assert!((between([0.0, 1.0, 0.0], [0.0, 0.0, 1.0]) - 1.0).abs() < 1e-5);
        assert!(
            (between([0.0; 3], [1.0; 3]) - 0.967_401).abs() < 3e-5,
            "{}",
            between([0.0; 3], [1.0; 3])
        );
        assert_eq!(between([0.3, 0.2, 0.1], [0.3, 0.2, 0.1]), 0.0);
    }

    #[test]
    fn invalid_values_and_tiny_pictures_have_finite_errors() {
        let odd = [f32::NAN, f32::INFINITY, f32::MAX, -1.0, 1e-40, 0.0];
        let wild = picture(|x, y| [odd[x % 6], odd[y % 6], 0.5]);
        for reference in [picture(|_, _| [0.0; 3]), picture(|x, _| [x as f32; 3]), wild.clone()] {
            for flip in [
                Flip::ldr(&wild, &reference).unwrap(),
                Flip::hdr(&wild, &reference).unwrap(),
            ] {
                assert!(flip.map.iter().all(|e| (0.0..=1.0).contains(e)), "{}", flip.mean);
            }
        }
        for (width, height) in [(0, 0), (1, 1), (1, 3)] {
            let pixels = vec![[0.5; 3]; width * height];
            let tiny = RgbImage { width, height, pixels };
            assert_eq!(Flip::hdr(&tiny, &tiny).unwrap().mean, 0.0);
        }
        assert!(
            Flip::ldr(
                &wild,
                &RgbImage {
                    width: 1,
                    height: 1,
                    pixels: vec![[0.0; 3]]
                }
            )
            .is_err()
        );
    }
}
