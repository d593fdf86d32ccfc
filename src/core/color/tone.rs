//! Tone curves: from unbounded linear light to display values.
//!
//! The curve `srgb` keeps the values that a display can show and clips the rest. The other curves
//! compress highlights, so that their gradations stay visible. All curves only change the look of a
//! picture. Measurements need linear values.

use super::{Spectrum, srgb};
use std::fmt;

/// Conversion of linear light to 8-bit values of a picture for display.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tone {
    /// Exposure before the curve.
    pub exposure: Exposure,
    /// Curve that maps light to the display's range.
    pub curve: Curve,
}

/// Exposure of a picture for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Number of stops; each stop doubles the light.
    Stops(f32),
    /// Exposure that is metered in the picture (`film/metering.rs`).
    Auto,
    /// Exposure for the studio lighting. It starts from a constant, which metering changes by at
    /// most one stop. Black subjects then stay black and white subjects stay white.
    Studio,
}

impl Exposure {
    /// Number of stops; `None` before metering.
    pub fn stops(self) -> Option<f32> {
        match self {
            Self::Stops(stops) => Some(stops),
            Self::Auto | Self::Studio => None,
        }
    }
}

impl Default for Exposure {
    /// Exposure of 0 stops.
    fn default() -> Self {
        Self::Stops(0.0)
    }
}

impl fmt::Display for Exposure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stops(stops) => write!(f, "{stops}"),
            Self::Auto => write!(f, "auto"),
            Self::Studio => write!(f, "studio"),
        }
    }
}

/// Curve of a [`Tone`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Curve {
    /// Clips to [0, 1].
    #[default]
    Srgb,
    /// Luminance `L` becomes `L / (1 + L)`. The ratios of the channels stay the same until a
    /// channel clips (Reinhard, Stark, Shirley and Ferwerda 2002, "Photographic Tone Reproduction
    /// for Digital Images", eq. 3).
    Reinhard,
    /// [`narkowicz`] of each channel. It is similar to ACES, but has a slightly different curve and
    /// does not shift colours as ACES does.
    AcesNarkowicz,
    /// Stephen Hill's fit of ACES's reference rendering transform and its output transform for sRGB
    /// displays, including colours (published in Matt Pettineo's BakingLab, `ACES.hlsl`).
    AcesHill,
    /// Troy Sobotka's AgX (github.com/sobotka/AgX) without a look.
    Agx,
}

impl Curve {
    /// Names of all curves.
    pub const NAMES: &[(&str, Self)] = &[
        ("srgb", Self::Srgb),
        ("reinhard", Self::Reinhard),
        ("aces-narkowicz", Self::AcesNarkowicz),
        ("aces-hill", Self::AcesHill),
        ("agx", Self::Agx),
    ];

    /// Converts linear Rec.709 to sRGB-encoded values in [0, 1].
    pub(crate) fn encode(self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Srgb => rgb.map(srgb::encode),
            Self::Reinhard => {
                let luminance = Spectrum::from(rgb).luminance();
                rgb.map(|v| srgb::encode(v / (1.0 + luminance)))
            }
            Self::AcesNarkowicz => rgb.map(|v| srgb::encode(narkowicz(v))),
            Self::AcesHill => hill(rgb).map(srgb::encode),
            Self::Agx => agx(rgb),
        }
    }
}

impl fmt::Display for Tone {
    /// Text as in flags: `tone=NAME exposure=STOPS`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = Curve::NAMES.iter().find(|(_, curve)| *curve == self.curve);
        write!(
            f,
            "tone={} exposure={}",
            name.map_or("", |(name, _)| name),
            self.exposure
        )
    }
}

/// Maximum absolute exposure in stops. Within this limit, no light of a scene leaves the range of
/// `f32` by the exposure.
pub const MAX_EXPOSURE: f32 = 64.0;

impl Tone {
    /// Converts linear Rec.709 to the nearest 8-bit codes of an sRGB display. Negative values and
    /// NaN become black. An exposure that is not yet metered counts as 0 stops.
    pub fn encode_u8(&self, rgb: [f32; 3]) -> [u8; 3] {
        self.encode(rgb).map(|v| (v * 255.0).round() as u8)
    }

    /// sRGB-encoded values in [0, 1], which [`Tone::encode_u8`] rounds to codes.
    pub(crate) fn encode(&self, rgb: [f32; 3]) -> [f32; 3] {
        let stops = self.exposure.stops().unwrap_or(0.0);
        let gain = stops.clamp(-MAX_EXPOSURE, MAX_EXPOSURE).exp2();
        // `max` maps NaN to 0; squares of the result are finite.
        self.curve.encode(rgb.map(|v| f32::max(v * gain, 0.0).min(1e18)))
    }
}

/// Fit of the ACES rendering for an sRGB display, for one channel. Input and output are linear. 0
/// maps to 0, and infinity to 1.03: `(x (2.51 x + 0.03)) / (x (2.43 x + 0.59) + 0.14)`. The input
/// `x` is 0.6 times the input of ACES (Krzysztof Narkowicz 2016, "ACES Filmic Tone Mapping Curve").
pub fn narkowicz(x: f32) -> f32 {
    (x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14)
}

/// Hill's fit. Input and output are linear. The output for black is slightly below 0.
fn hill(rgb: [f32; 3]) -> [f32; 3] {
    // `INPUT` converts Rec.709 to the working space of ACES, and includes the desaturation of
    // ACES's rendering transform. `OUTPUT` converts the space of the output transform back to
    // Rec.709.
    const INPUT: [[f32; 3]; 3] = [
        [0.59719, 0.35458, 0.04823],
        [0.07600, 0.90834, 0.01566],
        [0.02840, 0.13383, 0.83777],
    ];
    const OUTPUT: [[f32; 3]; 3] = [
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    ];
    let fit = |v: f32| (v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081);
    product(OUTPUT, product(INPUT, rgb).map(fit))
}

fn product(matrix: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Sobotka's AgX. The input is linear, the output is encoded for the display.
fn agx(rgb: [f32; 3]) -> [f32; 3] {
    // Inset of AgX: before the curve, each colour is moved to a grey, by a fifth of the distance.
    // After the curve, this is undone. The grey is the sum of the channels, weighted by `GREY`.
    // Sobotka's configuration has a matrix and its inverse instead.
    const GREY: [f32; 3] = [0.212_005_36, 0.392_182_5, 0.395_812_14];
    const INSET: f32 = 0.2;
    let grey = |v: [f32; 3]| GREY[0] * v[0] + GREY[1] * v[1] + GREY[2] * v[2];

    let to = grey(rgb);
    let curved = rgb.map(|v| agx_curve(v + INSET * (to - v)));
    let from = grey(curved);
    curved.map(|v| ((v - INSET * from) / (1.0 - INSET)).clamp(0.0, 1.0))
}

/// AgX's curve: the sigmoid that Sobotka's configuration tabulates.
///
/// The position of the light in a range of 16.5 stops is `share`: 0 for 10 stops below middle grey
/// (0.18), and 1 for 6.5 stops above it. The curve rises from 0 to 1. At middle grey, where `share`
/// is 10 / 16.5, the curve is 1/2 and has the slope 2.
///
/// The curve is `1/2 + 2 d / (1 + a |d|^p)^(1/p)`, where `d` is `share` minus 10 / 16.5. The power
/// `p` is 3 below middle grey and 3.25 above. The factor `a` is chosen so that the curve is 0 at
/// `share` = 0, and 1 at `share` = 1.
fn agx_curve(linear: f32) -> f32 {
    const PIVOT: f32 = 10.0 / 16.5;
    const SLOPE: f32 = 2.0;
    let share = (((linear / 0.18).log2() + 10.0) / 16.5).clamp(0.0, 1.0);
    let (power, length) = if share < PIVOT {
        (3.0, PIVOT)
    } else {
        (3.25, 1.0 - PIVOT)
    };
    let distance = share - PIVOT;
    // `bend` is a · length^power. It is chosen such that the second term is 1/2 at both ends of the
    // curve, where |distance| is `length`: SLOPE · length / (1 + bend)^(1 / power) = 1/2.
    let bend = (2.0 * SLOPE * length).powf(power) - 1.0;
    0.5 + SLOPE * distance / (1.0 + bend * (distance.abs() / length).powf(power)).powf(1.0 / power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(stops: f32, curve: Curve) -> Tone {
        let exposure = Exposure::Stops(stops);
        Tone { exposure, curve }
    }

    fn all() -> impl Iterator<Item = (&'static str, Curve)> {
        Curve::NAMES.iter().copied()
    }

    #[test]
    fn black_is_black_and_greys_rise_to_white() {
        for (name, curve) in all() {
            assert_eq!(curve.encode([0.0; 3]), [0.0; 3], "{name}");
            let mut last = [0.0; 3];
            for step in 0..4000 {
                // Test greys over a range of 24 stops
                let grey = 0.18 * ((step as f32 - 2000.0) / 4000.0 * 24.0).exp2();
                let shown = curve.encode([grey; 3]);
                for c in 0..3 {
                    assert!(
                        shown[c] >= last[c] - 1e-6 && shown[c] <= 1.0,
                        "{name}: {grey} is {shown:?} after {last:?}"
                    );
                    // Greys stay grey. The tolerance is needed because Hill's matrices have five
                    // digits only.
                    assert!((shown[c] - shown[0]).abs() < 2e-4, "{name}: {grey} is {shown:?}");
                }
                last = shown;
            }
            assert!(last[0] > 0.98, "{name}: the brightest grey is {last:?}");
        }
    }

    /// Expected values for middle grey, 0.18, and for 1, computed from the formulas.
    #[test]
    fn mid_grey_and_one() {
        let expected = [
            ("srgb", [0.18, 1.0]),
            // 0.18 / 1.18 and 1 / 2
            ("reinhard", [0.152_542, 0.5]),
            // 0.086724 / 0.324932 and 2.54 / 3.16
            ("aces-narkowicz", [0.266_899, 0.803_797]),
            // 0.036733 / 0.347885 and 1.024488 / 1.654761
            ("aces-hill", [0.105_591, 0.619_115]),
        ];
        let encoded = |curve: Curve, v: f32| curve.encode([v; 3])[1];
        for ((name, curve), (expected_name, linear)) in all().zip(expected) {
            assert_eq!(name, expected_name);
            let shown = [0.18, 1.0].map(|v| srgb::decode(encoded(curve, v)));
            let error = (0..2).map(|i| (shown[i] - linear[i]).abs()).fold(0.0, f32::max);
            assert!(error < 1e-4, "{name}: {shown:?}");
        }
        // Middle grey is encoded as 1/2. For the light 1, `share` is 12.474 / 16.5, and the curve
        // is 1/2 + 0.3000 / (1 + 69.863 · 0.15^3.25)^(1/3.25).
        assert!((encoded(Curve::Agx, 0.18) - 0.5).abs() < 1e-5);
        assert!((encoded(Curve::Agx, 1.0) - 0.787_515).abs() < 1e-5);
        assert_eq!(Tone::default().encode_u8([0.18, 0.5, 7.0]), [118, 188, 255]);
    }

    #[test]
    fn exposure_is_applied_before_the_curve() {
        for (name, curve) in all() {
            let [brightened, plain] = [1.5, 0.0].map(|stops| of(stops, curve));
            let factor = 2f32.sqrt() * 2.0;
            for rgb in [[0.1, 0.2, 0.05], [0.3, 0.0, 2.0], [10.0, 4.0, 0.5]] {
                assert_eq!(
                    brightened.encode_u8(rgb),
                    plain.encode_u8(rgb.map(|v| v * factor)),
                    "{name}: {rgb:?}"
                );
            }
        }
    }

    #[test]
    fn no_value_is_out_of_range() {
        let odd = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, -1.0, 0.0, 1e-40];
        for (name, curve) in all() {
            for a in odd {
                for exposure in [-1e9, 0.0, 1e9, f32::NAN] {
                    let shown = of(exposure, curve).encode_u8([a, 0.5, f32::NAN]);
                    assert!(a.is_nan() || shown.iter().all(|&v| v as u32 <= 255), "{name}");
                }
            }
            assert_eq!(
                of(0.0, curve).encode_u8([f32::NAN, -1.0, f32::NEG_INFINITY]),
                [0; 3],
                "{name}"
            );
        }
    }

    /// The inset by a grey equals the matrices of Sobotka's configuration, with an error below
    /// 0.002.
    #[test]
    fn agx_inset_equals_its_matrix() {
        const MATRIX: [[f32; 3]; 3] = [
            [0.842_479, 0.078_433_6, 0.079_223_7],
            [0.042_328_2, 0.878_468_6, 0.079_166_1],
            [0.042_375_7, 0.078_433_6, 0.879_143],
        ];
        for rgb in [[1.0, 0.0, 0.0], [0.0, 2.0, 0.3], [0.1, 0.2, 5.0]] {
            let curved = product(MATRIX, rgb).map(agx_curve);
            let grey = 0.212_005_36 * curved[0] + 0.392_182_5 * curved[1] + 0.395_812_14 * curved[2];
            let expected = curved.map(|v| ((v - 0.2 * grey) / 0.8).clamp(0.0, 1.0));
            let shown = agx(rgb);
            for c in 0..3 {
                assert!(
                    (shown[c] - expected[c]).abs() < 2e-3,
                    "{rgb:?}: {shown:?} and {expected:?}"
                );
            }
        }
    }
}
