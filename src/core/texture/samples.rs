//! Samples of textures in memory, in the precision of their files.

use super::half;
use super::levels::{self, Level};
use crate::color::srgb;
use crate::math::Encode;
use std::sync::LazyLock;

/// Transfer curve of codes of 8 or 16 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Curve {
    /// Linear: the code divided by the largest code. For data that are not colours.
    Linear,
    /// Colours: the sRGB curve (IEC 61966-2-1). Alpha is linear even with this curve.
    Srgb,
}

/// Samples of a picture, row by row from the top. The samples of a texel are adjacent.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// 8 bits per sample.
    Bytes(Vec<u8>, Curve),
    /// 16 bits per sample.
    Shorts(Vec<u16>, Curve),
    /// Linear values.
    Floats(Vec<f32>),
}

/// Samples of all levels.
#[derive(Clone, Debug)]
pub(super) enum Samples {
    Bytes(Vec<u8>, &'static Codes),
    /// Equal steps from 0 to 1.
    Shorts(Vec<u16>),
    /// sRGB-encoded, except alpha. If they were stored as linear shorts, eleven of twelve codes of
    /// dark colours would be lost.
    EncodedShorts(Vec<u16>, &'static ShortCodes),
    /// Floats that 16-bit floats represent exactly.
    Halves(Vec<u16>),
    Floats(Vec<f32>),
}

/// Values of the 8-bit codes.
pub(super) type Codes = [f32; 256];

/// Values of the codes 0 to 65535.
pub(super) type ShortCodes = [f32; 1 << 16];

pub(super) static LINEAR: Codes = {
    let mut codes = [0.0; 256];
    let mut i = 0;
    while i < 256 {
        codes[i] = i as f32 / 255.0;
        i += 1;
    }
    codes
};
static SRGB: LazyLock<Codes> = LazyLock::new(|| LINEAR.map(srgb::decode));
static LINEAR_QUANTIZER: LazyLock<Quantizer> = LazyLock::new(|| Quantizer::new(&LINEAR));
static SRGB_QUANTIZER: LazyLock<Quantizer> = LazyLock::new(|| Quantizer::new(&SRGB));
static SRGB_SHORTS: LazyLock<Box<ShortCodes>> = LazyLock::new(|| {
    let mut codes = Box::new([0.0; 1 << 16]);
    for (code, value) in codes.iter_mut().enumerate() {
        *value = srgb::decode(code as f32 / 65535.0);
    }
    codes
});

/// Floats above this number are treated as infinite, so that a mean of floats is always finite.
pub(super) const LARGEST: f32 = f32::MAX / 4.0;
/// A picture with its levels, as stored.
pub(super) struct StoredPicture {
    pub samples: Samples,
    pub levels: Vec<Level>,
    /// Maximum of all samples except alpha.
    pub max_value: f32,
    /// Number of texels with a sample that was negative, NaN or larger than [`LARGEST`].
    pub replaced: usize,
}

impl Texels {
    /// Number of samples.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Bytes(samples, _) => samples.len(),
            Self::Shorts(samples, _) => samples.len(),
            Self::Floats(samples) => samples.len(),
        }
    }

    /// Adds the coarser levels to a picture of `size` (columns, rows). The samples are stored in
    /// the most compact lossless format.
    pub(super) fn store(self, size: (usize, usize), channels: usize) -> StoredPicture {
        let is_alpha = |c| channels % 2 == 0 && c + 1 == channels;
        let mut replaced = 0;
        let (samples, levels, max_value);
        match self {
            Self::Bytes(mut codes, curve) => {
                let linear = &*LINEAR_QUANTIZER;
                let quantizer = match curve {
                    Curve::Linear => linear,
                    Curve::Srgb => &*SRGB_QUANTIZER,
                };
                let of = |c| if is_alpha(c) { linear } else { quantizer };
                let decode = |c, code: u8| of(c).codes[code as usize];
                max_value = quantizer.codes[largest(&codes, channels) as usize];
                levels = levels::append(&mut codes, size, channels, decode, |c, value| of(c).nearest(value));
                samples = Samples::Bytes(codes, quantizer.codes);
            }
            Self::Shorts(mut codes, Curve::Srgb) => {
                let table: &ShortCodes = &SRGB_SHORTS;
                let decode = |c, code: u16| {
                    if is_alpha(c) {
                        decode_short(code)
                    } else {
                        table[code as usize]
                    }
                };
                let encode = |c, value: f32| {
                    let encoded = if is_alpha(c) { value } else { srgb::encode(value) };
                    (encoded * 65535.0).round() as u16
                };
                max_value = table[largest(&codes, channels) as usize];
                levels = levels::append(&mut codes, size, channels, decode, encode);
                samples = Samples::EncodedShorts(codes, table);
            }
            Self::Shorts(mut codes, Curve::Linear) => {
                let encode = |_, value: f32| (value * 65535.0).round() as u16;
                max_value = decode_short(largest(&codes, channels));
                levels = levels::append(&mut codes, size, channels, |_, code| decode_short(code), encode);
                samples = Samples::Shorts(codes);
            }
            Self::Floats(mut values) => {
                replaced = repair(&mut values, channels);
                max_value = largest(&values, channels);
                if values.iter().all(|&value| half::decode(half::encode(value)) == value) {
                    let mut halves: Vec<u16> = values.into_iter().map(half::encode).collect();
                    let decode = |_, bits| half::decode(bits);
                    levels = levels::append(&mut halves, size, channels, decode, |_, value| half::encode(value));
                    samples = Samples::Halves(halves);
                } else {
                    // Clamp the means, which rounding could make larger than the largest sample.
                    let max = |c| if is_alpha(c) { 1.0 } else { max_value };
                    levels = levels::append(&mut values, size, channels, |_, v| v, |c, v: f32| v.min(max(c)));
                    samples = Samples::Floats(values);
                }
            }
        }
        StoredPicture {
            samples,
            levels,
            max_value,
            replaced,
        }
    }
}

impl Samples {
    /// The samples from index `start` on.
    pub fn after(&self, start: usize) -> Self {
        fn rest<T: Copy>(samples: &[T], start: usize) -> Vec<T> {
            samples.get(start..).unwrap_or_default().to_vec()
        }
        match self {
            Self::Bytes(samples, codes) => Self::Bytes(rest(samples, start), codes),
            Self::Shorts(samples) => Self::Shorts(rest(samples, start)),
            Self::EncodedShorts(samples, codes) => Self::EncodedShorts(rest(samples, start), codes),
            Self::Halves(samples) => Self::Halves(rest(samples, start)),
            Self::Floats(samples) => Self::Floats(rest(samples, start)),
        }
    }

    /// Size of all levels in bytes.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Bytes(samples, _) => size_of_val(samples.as_slice()),
            Self::Shorts(samples) | Self::EncodedShorts(samples, _) | Self::Halves(samples) => {
                size_of_val(samples.as_slice())
            }
            Self::Floats(samples) => size_of_val(samples.as_slice()),
        }
    }
}

impl Encode for Samples {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        match self {
            Self::Bytes(codes, table) => {
                sink(&[0]);
                table.encode(sink);
                codes.len().encode(sink);
                sink(codes);
            }
            Self::Shorts(codes) => {
                sink(&[1]);
                codes.encode(sink);
            }
            Self::Halves(codes) => {
                sink(&[2]);
                codes.encode(sink);
            }
            Self::Floats(values) => {
                sink(&[3]);
                values.encode(sink);
            }
            Self::EncodedShorts(codes, _) => {
                sink(&[4]);
                codes.encode(sink);
            }
        }
    }
}

/// Value from 0 to 1 of a 16-bit sample. 65535 gives exactly 1.
pub(super) fn decode_short(code: u16) -> f32 {
    code as f32 * (1.0 / 65535.0)
}

/// Number of equal parts of the interval from 0 to 1, in each of which a search for a code begins.
/// sRGB has most codes near 0, where a part has one code at most.
const PARTS: usize = 4096;

/// The values of 8-bit codes, with the places where a search for a value begins.
struct Quantizer {
    codes: &'static Codes,
    /// For each part of the interval, the smallest code whose value is not below the part's start.
    first: [u8; PARTS],
}

impl Quantizer {
    fn new(codes: &'static Codes) -> Self {
        let first = |part: usize| codes.partition_point(|&v| v < part as f32 / PARTS as f32) as u8;
        Self {
            codes,
            first: std::array::from_fn(first),
        }
    }

    /// Code whose value is nearest to `value`.
    fn nearest(&self, value: f32) -> u8 {
        let part = (value * PARTS as f32) as usize;
        let mut above = self.first[part.min(PARTS - 1)].max(1) as usize;
        while above < 255 && self.codes[above] < value {
            above += 1;
        }
        let below = above - 1;
        let is_below = value - self.codes[below] < self.codes[above] - value;
        if is_below { below as u8 } else { above as u8 }
    }
}

/// Maximum of all samples except alpha.
fn largest<T: Copy + Default + PartialOrd>(samples: &[T], channels: usize) -> T {
    let larger = |max, &sample: &T| if sample > max { sample } else { max };
    if channels % 2 == 1 {
        return samples.iter().fold(T::default(), larger);
    }
    let colors = samples.chunks_exact(channels).flat_map(|texel| &texel[..channels - 1]);
    colors.fold(T::default(), larger)
}

/// Replaces values that are negative, NaN or larger than [`LARGEST`] by 0, and clamps alpha to 1.
/// Returns the number of texels with a replaced value.
fn repair(values: &mut [f32], channels: usize) -> usize {
    let mut replaced = 0;
    for texel in values.chunks_exact_mut(channels) {
        let mut is_sound = true;
        for (c, value) in texel.iter_mut().enumerate() {
            let max = if channels % 2 == 0 && c + 1 == channels {
                1.0
            } else {
                LARGEST
            };
            // −0 is valid; `abs` removes its sign.
            if (0.0..=LARGEST).contains(value) {
                *value = value.abs().min(max);
            } else {
                (*value, is_sound) = (0.0, false);
            }
        }
        replaced += usize::from(!is_sound);
    }
    replaced
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearest_code_has_the_smallest_error() {
        for quantizer in [&*LINEAR_QUANTIZER, &*SRGB_QUANTIZER] {
            for (code, &value) in quantizer.codes.iter().enumerate() {
                assert_eq!(quantizer.nearest(value) as usize, code);
            }
            for value in (0..1000).map(|i| i as f32 / 999.0).chain([-1.0, 2.0]) {
                let error = |code: u8| (quantizer.codes[code as usize] - value).abs();
                let code = quantizer.nearest(value);
                assert!((0..=255).all(|other| error(code) <= error(other)));
            }
        }
        assert_eq!(decode_short(u16::MAX), 1.0);
    }

    #[test]
    fn coarser_levels_keep_each_code_of_16_bits() {
        for curve in [Curve::Linear, Curve::Srgb] {
            for code in 0..=u16::MAX {
                let StoredPicture { samples, .. } = Texels::Shorts(vec![code; 2], curve).store((2, 1), 1);
                let codes = match samples {
                    Samples::Shorts(codes) | Samples::EncodedShorts(codes, _) => codes,
                    _ => Vec::new(),
                };
                assert_eq!(codes, [code; 3]);
            }
        }
    }
}
