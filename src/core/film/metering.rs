//! Automatic exposure: the number of stops by which a picture is brightened for a display.
//!
//! Metering follows photographic tone reproduction: the log-average luminance becomes middle grey
//! (Reinhard, Stark, Shirley and Ferwerda 2002, "Photographic Tone Reproduction for Digital
//! Images", eq. 1). Metering uses the rendered picture, not the denoised one. Only pixels that show
//! a surface count, or all pixels if no pixel shows a surface.
//!
//! - Luminances are means over blocks of 4 × 4 pixels, which reduces noise and single fireflies.
//!   The blocks are aligned to the full image.
//! - The target of the log-average rises with the fraction of background pixels: linearly from 0.18
//!   without background to 0.28 if a quarter of the picture is background. The subject then stands
//!   out from the background.
//! - The log-average leaves out the darkest and the brightest 5 % of the blocks. A block that is
//!   more than 8 stops darker than the brightest 5 % counts as 8 stops darker, so that black
//!   corners have little effect on the exposure.
//! - The display code of the median block is clamped to the range 0.35 to 0.6. Codes are from 0
//!   (black) to 1 (white).
//! - At most 2 % of the blocks become white in some channel. To keep this limit, the exposure may
//!   be lowered further, until the code of the median block is 0.25.
//!
//! A picture of bright surfaces should be bright. If the picture has an albedo channel and its mean
//! albedo is above 0.4, the target rises with the mean albedo, by a factor of at most 1.8. White
//! rooms then stay white.
//!
//! The colour of a background that is shown unchanged is not metered.
//!
//! The light of the studio is fixed. A grey card that faces its key lamp needs almost no exposure.
//! `Exposure::Studio` therefore starts from a constant value, and moves a fifth of the way to the
//! metered value, by at most one stop. Black subjects then stay black, and white subjects white.
//!
//! Values are sorted before they are summed, so threads, tiles and interruptions do not change the
//! exposure. The exposure is rounded down to hundredths of a stop, so that users can enter it as a
//! number.

use super::{Image, Z_BACKGROUND};
use crate::color::Spectrum;
use crate::color::tone::{Curve, Exposure, MAX_EXPOSURE, Tone};
use std::collections::BTreeMap;

/// Middle grey, the target of the log-average.
const MIDDLE_GREY: f32 = 0.18;
/// Target of the log-average for a picture with much background.
const BEFORE_BACKGROUND: f32 = 0.28;
/// Fraction of background in the picture at which [`BEFORE_BACKGROUND`] is reached.
const BACKGROUND_SHARE: f32 = 0.25;
/// Mean albedo above which the target rises.
const BRIGHT_ALBEDO: f32 = 0.4;
/// Exponent with which the target rises above [`BRIGHT_ALBEDO`].
const BRIGHT_POWER: f32 = 0.85;
/// Maximum factor by which the target rises.
const MAX_BRIGHTER: f32 = 1.8;
/// Fraction of the blocks that the log-average leaves out at the dark end, and at the bright end.
const TRIMMED: f64 = 0.05;
/// Maximum number of stops by which a block in the log-average is darker than the brightest 5 % of
/// the blocks.
const RANGE: f32 = 8.0;
/// Range to which the code of the median block is limited. Codes are from 0 to 1.
const MEDIAN: [f32; 2] = [0.35, 0.6];
/// Minimum code of the median block, from 0 to 1, if highlights lower the exposure.
const MIN_MEDIAN: f32 = 0.25;
/// Maximum fraction of white blocks.
const CLIPPED: f64 = 0.02;
/// Minimum code of a white pixel: the nearest 8-bit code is 255.
const WHITE: f32 = 254.5 / 255.0;
/// Exposure for the light of the studio, in stops.
const STUDIO: f32 = 0.15;
/// Shift of the exposure from [`STUDIO`] towards the metered value, as a fraction of their
/// difference.
const SUBJECT: f32 = 0.2;
/// Maximum shift from [`STUDIO`], in stops.
const MAX_SHIFT: f32 = 1.0;
/// Edge of a block in pixels.
const BLOCK_EDGE: u32 = 4;
/// In pictures with fewer pixels than this, a block is one pixel, not 4 × 4 pixels.
const MIN_PIXELS: u64 = 128 * 128;

/// `tone` with an automatic exposure metered in `image`; other tones are returned unchanged.
pub fn metered(tone: Tone, image: &Image) -> Tone {
    let stops = match tone.exposure {
        Exposure::Stops(stops) => stops,
        Exposure::Auto => Meter::of(image).for_albedo(image).stops(tone.curve),
        Exposure::Studio => in_studio(Meter::of(image).stops(tone.curve)),
    };
    Tone {
        exposure: Exposure::Stops(stops),
        ..tone
    }
}

/// Exposure of a subject in the studio, from the metered stops.
fn in_studio(metered: f32) -> f32 {
    let shift = SUBJECT * (metered - STUDIO);
    rounded(STUDIO + shift.clamp(-MAX_SHIFT, MAX_SHIFT))
}

/// Factor by which the target rises for surfaces with the mean albedo `albedo`.
fn brighter(albedo: f32) -> f32 {
    (albedo / BRIGHT_ALBEDO).powf(BRIGHT_POWER).clamp(1.0, MAX_BRIGHTER)
}

/// `stops` rounded down to hundredths, and clamped to the range of exposures.
fn rounded(stops: f32) -> f32 {
    let rounded = (f64::from(stops) * 100.0).floor() / 100.0;
    // Adding 0 turns −0 into 0.
    (rounded as f32).clamp(-MAX_EXPOSURE, MAX_EXPOSURE) + 0.0
}

/// Values of three channels, if the picture has them.
fn channels<'a>(image: &'a Image, names: [&str; 3]) -> Option<[&'a [f32]; 3]> {
    let [r, g, b] = names.map(|name| image.channel(name).map(|channel| channel.values.as_slice()));
    Some([r?, g?, b?])
}

/// Returns a function that is true for indices of pixels that show a surface.
fn is_surface(image: &Image) -> impl Fn(usize) -> bool {
    let depth = image.channel("Z").map(|channel| channel.values.as_slice());
    move |i| depth.is_none_or(|depth| depth.get(i).is_some_and(|&z| z < Z_BACKGROUND))
}

/// Luminances of the blocks of a picture.
struct Meter {
    /// Luminances in ascending order.
    luminances: Vec<f32>,
    /// Largest channel of each block, in ascending order.
    peaks: Vec<f32>,
    /// Target of the log-average luminance.
    key: f32,
}

impl Meter {
    /// Meter of the pixels of `image` that show a surface, or of all pixels if no pixel shows a
    /// surface. Non-finite values are left out.
    fn of(image: &Image) -> Self {
        let channels = |names| channels(image, names);
        let Some(rgb) = channels(["raw.R", "raw.G", "raw.B"]).or_else(|| channels(["R", "G", "B"])) else {
            return Self::of_blocks(Vec::new(), 1.0);
        };
        let front = |i: usize| rgb.map(|channel| channel.get(i).copied().unwrap_or(f32::NAN));
        let coverage = image.raw_coverage();
        let light = |i: usize| match &coverage {
            None => front(i),
            Some((backing, coverage)) => {
                let covered = coverage.get(i).copied().unwrap_or([1.0; 3]);
                let behind = backing.light() * (Spectrum::ONE - Spectrum::from(covered));
                (Spectrum::from(front(i)) - behind).to_array()
            }
        };
        let is_surface = is_surface(image);
        let surfaces = (0..image.crop.area() as usize).filter(|&i| is_surface(i)).count();
        let covered = Self::of_blocks(
            blocks(image, light, is_surface),
            surfaces as f32 / image.crop.area() as f32,
        );
        if covered.luminances.is_empty() {
            Self::of_blocks(blocks(image, light, |_| true), 1.0)
        } else {
            covered
        }
    }

    /// This meter with a higher target for bright surfaces. The target stays if `image` has no
    /// albedo channel.
    fn for_albedo(mut self, image: &Image) -> Self {
        let Some(albedo) = channels(image, ["albedo.R", "albedo.G", "albedo.B"]) else {
            return self;
        };
        let is_surface = is_surface(image);
        let (mut sum, mut count) = (0.0, 0.0);
        for i in (0..image.crop.area() as usize).filter(|&i| is_surface(i)) {
            let rgb = albedo.map(|channel| channel.get(i).copied().unwrap_or(0.0));
            sum += f64::from(Spectrum::from(rgb).luminance().clamp(0.0, 1.0));
            count += 1.0;
        }
        if count > 0.0 {
            self.key *= brighter((sum / count) as f32);
        }
        self
    }

    /// Meter of blocks that cover the fraction `share` of the picture. The rest is background.
    fn of_blocks(blocks: Vec<Spectrum>, share: f32) -> Self {
        let sorted = |value: fn(&Spectrum) -> f32| {
            let mut values: Vec<f32> = blocks.iter().map(value).collect();
            values.sort_by(f32::total_cmp);
            values
        };
        Self {
            luminances: sorted(|block| block.luminance()),
            peaks: sorted(|block| block.max_component()),
            key: MIDDLE_GREY + (BEFORE_BACKGROUND - MIDDLE_GREY) * ((1.0 - share) / BACKGROUND_SHARE).min(1.0),
        }
    }

    /// Exposure in stops for a display with the tone curve `curve`; 0 for a black picture.
    fn stops(&self, curve: Curve) -> f32 {
        let Some(log_average) = self.log_average() else {
            return 0.0;
        };
        let to = |code: f32, light: f32| (light > 0.0).then(|| level(curve, code).log2() - light.log2());
        let median = at(&self.luminances, 0.5);

        // Move the log-average to the target, but keep the median in its range.
        let mut stops = self.key.log2() - log_average;
        if let (Some(min), Some(max)) = (to(MEDIAN[0], median), to(MEDIAN[1], median)) {
            stops = stops.clamp(min, max);
        }

        // Protect highlights: limit the fraction of white blocks
        if let Some(max) = to(WHITE, at(&self.peaks, 1.0 - CLIPPED)) {
            let min = to(MIN_MEDIAN, median).map_or(max, |min| min.max(max));
            stops = stops.min(min);
        }
        rounded(stops)
    }

    /// Mean of the base-2 logarithms of the luminances, without the darkest and the brightest
    /// blocks ([`TRIMMED`]). `None` for a black picture.
    fn log_average(&self) -> Option<f32> {
        let all = &self.luminances;
        let brightest = *all.last()?;
        let top = Some(at(all, 1.0 - TRIMMED))
            .filter(|&top| top > 0.0)
            .unwrap_or(brightest);
        if top <= 0.0 {
            return None;
        }
        let trimmed = (all.len() as f64 * TRIMMED) as usize;
        let kept = all.get(trimmed..all.len() - trimmed)?;
        let floor = f64::from(top.log2() - RANGE);
        let sum: f64 = kept.iter().map(|&l| f64::from(l.log2()).max(floor)).sum();
        Some((sum / kept.len().max(1) as f64) as f32)
    }
}

/// Means of `light` over the blocks of `image`. Only pixels for which `is_wanted` is true count.
fn blocks(image: &Image, light: impl Fn(usize) -> [f32; 3], is_wanted: impl Fn(usize) -> bool) -> Vec<Spectrum> {
    let edge = if image.crop.area() < MIN_PIXELS { 1 } else { BLOCK_EDGE };
    let mut sums: BTreeMap<[u32; 2], ([f64; 3], u32)> = BTreeMap::new();
    for (i, pixel) in image.crop.pixels().enumerate().filter(|&(i, _)| is_wanted(i)) {
        let values = light(i);
        if values.iter().all(|value| value.is_finite()) {
            let (sum, count) = sums.entry([pixel.y / edge, pixel.x / edge]).or_default();
            (0..3).for_each(|c| sum[c] += f64::from(values[c].max(0.0)));
            *count += 1;
        }
    }
    let mean = |(sum, count): ([f64; 3], u32)| Spectrum::from(sum.map(|s| (s / f64::from(count)) as f32));
    sums.into_values().map(mean).filter(|block| block.is_valid()).collect()
}

/// Quantile of the `sorted` values at `share`; 0 if there are no values.
fn at(sorted: &[f32], share: f64) -> f32 {
    let index = (sorted.len() as f64 * share) as usize;
    sorted.get(index).or(sorted.last()).copied().unwrap_or(0.0)
}

/// Minimum grey level that `curve` shows with at least `code`, by bisection.
fn level(curve: Curve, code: f32) -> f32 {
    let shown = |stops: f32| curve.encode([stops.exp2(); 3])[1];
    let (mut below, mut above) = (-32.0f32, 32.0f32);
    for _ in 0..32 {
        let middle = 0.5 * (below + above);
        if shown(middle) < code {
            below = middle
        } else {
            above = middle
        }
    }
    above.exp2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{Channel, Rect};
    use crate::math::UVec2;

    /// Grey picture of `size` pixels. `light` returns the grey level of a pixel, or `None` for the
    /// background.
    fn picture(size: [u32; 2], light: impl Fn(u32, u32) -> Option<f32>) -> Image {
        let resolution = UVec2::from(size);
        let crop = Rect::full(resolution);
        let values = |of: &dyn Fn(Option<f32>) -> f32| crop.pixels().map(|p| of(light(p.x, p.y))).collect::<Vec<f32>>();
        let channel = |name: &'static str, of: &dyn Fn(Option<f32>) -> f32| Channel {
            name: name.into(),
            values: values(of),
        };
        let light = |light: Option<f32>| light.unwrap_or(1000.0);
        Image {
            resolution,
            view: resolution,
            crop,
            backing: None,
            channels: vec![
                channel("R", &light),
                channel("G", &light),
                channel("B", &light),
                channel("Z", &|light| light.map_or(Z_BACKGROUND, |_| 1.0)),
            ],
        }
    }

    fn stops(image: &Image, curve: Curve) -> f32 {
        let tone = Tone {
            exposure: Exposure::Auto,
            curve,
        };
        metered(tone, image).exposure.stops().unwrap()
    }

    /// Codes of the pixels that show a surface, in ascending order.
    fn shown(image: &Image, curve: Curve) -> Vec<u8> {
        let tone = Tone {
            exposure: Exposure::Stops(stops(image, curve)),
            curve,
        };
        let depth = &image.channel("Z").unwrap().values;
        let pixels = image.rgb().zip(depth).filter(|(_, z)| **z < Z_BACKGROUND);
        let mut codes: Vec<u8> = pixels.map(|(rgb, _)| tone.encode_u8(rgb)[1]).collect();
        codes.sort_unstable();
        codes
    }

    #[test]
    fn white_rooms_stay_bright() {
        let of_albedo = |albedo: f32| {
            let mut image = picture([16, 16], |_, _| Some(albedo));
            for channel in ["albedo.R", "albedo.G", "albedo.B"] {
                image.channels.push(Channel {
                    name: channel.into(),
                    values: vec![albedo; 256],
                });
            }
            shown(&image, Curve::Agx)[128]
        };
        let [black, grey, light, white] = [0.05, 0.4, 0.6, 0.8].map(of_albedo);
        assert_eq!(black, grey);
        assert!(light > grey + 8 && white > light + 8, "{grey} {light} {white}");
    }

    #[test]
    fn a_constant_becomes_middle_grey() {
        for (_, curve) in Curve::NAMES {
            for light in [1e-6, 0.18, 1.0, 3e4] {
                let image = picture([16, 16], |_, _| Some(light));
                let expected = (0.18f32 / light).log2();
                let found = stops(&image, *curve);
                assert!(
                    (found - expected).abs() <= 0.011,
                    "{light}: {found} instead of {expected}"
                );
            }
        }
    }

    /// In the studio, black and white subjects stay black and white, and the exposure moves by at
    /// most one stop.
    #[test]
    fn subjects_shift_the_exposure_of_the_studio_a_little() {
        let studio = |light: f32| {
            let tone = Tone {
                exposure: Exposure::Studio,
                curve: Curve::Agx,
            };
            let image = picture([16, 16], |_, _| Some(light));
            metered(tone, &image).exposure.stops().unwrap()
        };
        let [black, grey, white] = [0.02, 0.162, 0.8].map(studio);
        assert!(black > grey && grey > white, "{black} {grey} {white}");
        assert!((grey - STUDIO).abs() < 0.02, "{grey}");
        let shown = |light: f32, stops: f32| light * stops.exp2();
        assert!(shown(0.02, black) < 0.3 * shown(0.162, grey) && shown(0.162, grey) < 0.3 * shown(0.8, white));
        for light in [1e-6, 1e6] {
            assert!((studio(light) - STUDIO).abs() <= MAX_SHIFT + 0.011, "{light}");
        }
    }

    #[test]
    fn pictures_without_light_have_an_exposure() {
        for light in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            assert_eq!(stops(&picture([8, 8], |_, _| Some(light)), Curve::Agx), 0.0, "{light}");
        }
        // A picture of background only
        assert!((stops(&picture([8, 8], |_, _| None), Curve::Agx) + 12.44).abs() < 0.02);
        let mut image = picture([8, 8], |_, _| Some(1.0));
        image.channels.clear();
        assert_eq!(stops(&image, Curve::Agx), 0.0);
    }

    /// Dark rooms with bright windows, gradients, half-black pictures: the median is in its range,
    /// and few pixels are white.
    #[test]
    fn medians_and_highlights_are_in_their_ranges() {
        let window = |x: u32, y: u32| {
            Some(if x < 14 && y < 14 {
                400.0
            } else {
                0.02 + 0.001 * (x % 9) as f32
            })
        };
        let gradient = |x: u32, _: u32| Some((x as f32 / 8.0 - 8.0).exp2());
        let half = |x: u32, _: u32| Some(if x < 70 { 0.0 } else { 5.0 });
        let object = |x: u32, y: u32| ((40..90).contains(&x) && y > 60).then_some(0.4 + y as f32 / 90.0);
        for (name, image) in [
            ("window", picture([128, 128], window)),
            ("gradient", picture([128, 128], gradient)),
            ("half", picture([128, 128], half)),
            ("object", picture([128, 128], object)),
        ] {
            for (curve_name, curve) in Curve::NAMES {
                let codes = shown(&image, *curve);
                let median = codes[codes.len() / 2];
                let white = codes.iter().filter(|&&code| code == 255).count() as f64 / codes.len() as f64;
                println!("{name}, {curve_name}: median {median}, white {white:.3}");
                // More than 2 % of the pixels may be white only if the median is at its lower
                // limit.
                assert!(
                    white <= 0.021 || median <= 65,
                    "{name}, {curve_name}: {white} are white"
                );
                let is_black = name == "half";
                assert!(
                    is_black || (56..=154).contains(&median),
                    "{name}, {curve_name}: median {median}"
                );
            }
        }
    }

    #[test]
    fn fireflies_change_little() {
        let light = |x: u32, y: u32| 0.3 + ((x * 7 + y * 13) % 11) as f32 / 20.0;
        let plain = picture([128, 128], |x, y| Some(light(x, y)));
        let fireflies = picture([128, 128], |x, y| {
            Some(if (x * 131 + y * 71) % 997 == 0 {
                1e4
            } else {
                light(x, y)
            })
        });
        let [a, b] = [plain, fireflies].map(|image| stops(&image, Curve::Agx));
        assert!((a - b).abs() < 0.05, "{a} and {b}");
    }

    #[test]
    fn a_metered_exposure_can_be_given_as_a_number() {
        let image = picture([16, 16], |x, y| Some(0.37 * (1 + x * y) as f32));
        let found = stops(&image, Curve::Agx);
        assert_eq!(found.to_string().parse(), Ok(found));
        assert!(found.to_string().len() <= 6, "{found}");
    }
}
