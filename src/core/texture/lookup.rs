//! Textures and their filtered lookups.

use super::levels::Level;
use super::samples::{LINEAR, Samples, StoredPicture, Texels, decode_short};
use super::{Wrap, half};
use crate::color::Spectrum;
use crate::math::{Encode, Vec2, Vec3};
use std::array;

/// Maximum number of texels that [`Texture::is_black_within`] reads.
const MAX_TEXELS: f32 = 4096.0;
/// Maximum distance from the origin, in texels, at which an `f32` represents the centres of texels
/// exactly.
const FARTHEST_TEXEL: f32 = 4_194_304.0;
/// Maximum number of texels along a side.
const LONGEST: usize = 1 << 28;

/// An immutable picture with MIP levels, each half the size of the level before (Williams 1983,
/// "Pyramidal Parametrics").
///
/// u points to the right and v upwards. The picture fills the unit square. The first row of a file
/// is its top, at v = 1. Texel centres lie at (i + ½) / n. Values are interpolated linearly in u,
/// in v and, between levels, in the footprint. The footprint is the width of a ray's cone at the
/// surface, in units of uv. If a texel is not square in units of uv, its longer side selects the
/// level. This level may be too fine along the other side, which causes noise that more samples
/// remove. A level that is too coarse would cause blur, which stays. Footprints of at most one
/// texel, and NaN, use the finest level. Coarser levels are means of linear values, with colours
/// weighted by alpha.
///
/// Lookups return finite numbers for any uv and footprint. If `uv` is not finite, the position of
/// the lookup is arbitrary.
#[derive(Clone, Debug)]
pub struct Texture {
    samples: Samples,
    /// Number of channels: 1 grey, 2 grey and alpha, 3 colour, 4 colour and alpha.
    channels: usize,
    levels: Vec<Level>,
    wrap: Wrap,
    /// Columns and rows of the picture.
    size: Vec2,
    /// Number of columns or of rows, whichever is smaller.
    short_side: f32,
    max_value: f32,
    replaced: usize,
}

/// Index of the finer level, and the position between the finer level and the next coarser level,
/// in [0, 1).
type Blend = (usize, f32);

impl Encode for Texture {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        // Leave out fields that follow from the encoded fields.
        let Self {
            samples,
            channels,
            levels: _,
            wrap,
            size,
            short_side: _,
            max_value: _,
            replaced: _,
        } = self;
        size.encode(sink);
        channels.encode(sink);
        wrap.encode(sink);
        samples.encode(sink);
    }
}

impl Texture {
    /// Creates a texture of `width` × `height` texels of `channels` samples: 1 grey, 2 grey and
    /// alpha, 3 colour, 4 colour and alpha.
    ///
    /// Floats that are NaN, infinite (or nearly so) or negative become 0 and are counted. Returns
    /// `None` if the number of samples does not match or is 0, or if a side is longer than 2²⁸
    /// texels.
    pub fn new(width: usize, height: usize, channels: usize, texels: Texels, wrap: Wrap) -> Option<Self> {
        let expected = width.checked_mul(height)?.checked_mul(channels)?;
        if !(1..=4).contains(&channels) || expected == 0 || texels.len() != expected || width.max(height) > LONGEST {
            return None;
        }
        let StoredPicture {
            samples,
            levels,
            max_value,
            replaced,
        } = texels.store((width, height), channels);
        Some(Self {
            samples,
            channels,
            levels,
            wrap,
            size: Vec2::new(width as f32, height as f32),
            short_side: width.min(height) as f32,
            max_value,
            replaced,
        })
    }

    /// Texture of one texel, the mean of this texture.
    pub fn mean(self) -> Self {
        let start = self.levels.last().map_or(0, |last| last.start);
        let level = Level {
            start: 0,
            width: 1,
            height: 1,
        };
        let mut mean = Self {
            samples: self.samples.after(start),
            levels: vec![level],
            size: Vec2::ONE,
            short_side: 1.0,
            ..self
        };
        mean.max_value = mean.color(Vec2::ZERO, 0.0).max_component();
        mean
    }

    /// Linear colour at `uv`; greys have three equal channels.
    pub fn color(&self, uv: Vec2, footprint: f32) -> Spectrum {
        if self.channels < 3 {
            let [grey] = self.filtered(0, uv, self.blend(footprint));
            Spectrum::splat(grey)
        } else {
            let rgb: [f32; 3] = self.filtered(0, uv, self.blend(footprint));
            rgb.into()
        }
    }

    /// Value of a grey texture, or luminance of a coloured texture.
    pub fn value(&self, uv: Vec2, footprint: f32) -> f32 {
        self.value_between(uv, self.blend(footprint))
    }

    /// Coverage, in [0, 1]; 1 if the texture has no alpha.
    pub fn alpha(&self, uv: Vec2, footprint: f32) -> f32 {
        if !self.has_alpha() {
            return 1.0;
        }
        let [alpha] = self.filtered(self.channels - 1, uv, self.blend(footprint));
        alpha
    }

    /// The vector `2c − 1` of the red, green and blue of a normal map, not normalised. +z if the
    /// texture has no colours.
    pub fn normal(&self, uv: Vec2, footprint: f32) -> Vec3 {
        if self.channels < 3 {
            return Vec3::Z;
        }
        let rgb: [f32; 3] = self.filtered(0, uv, self.blend(footprint));
        2.0 * Vec3::from_array(rgb) - 1.0
    }

    /// ∂/∂u and ∂/∂v of [`Texture::value`], as differences across one texel of the level in use.
    pub fn gradient(&self, uv: Vec2, footprint: f32) -> Vec2 {
        let blend = self.blend(footprint);
        // Texels per unit of u and v, interpolated between the two levels
        let (level, part) = blend;
        let texels = self.size / ((1.0 + part) * f32::from_bits((127 + level as u32) << 23));
        let step = 0.5 / texels;
        let difference = |d: Vec2| self.value_between(uv + d, blend) - self.value_between(uv - d, blend);
        let gradient = Vec2::new(difference(step.with_y(0.0)), difference(step.with_x(0.0))) * texels;
        // Very large values and small texels can make the slope overflow.
        gradient.clamp(Vec2::splat(f32::MIN), Vec2::splat(f32::MAX))
    }

    /// Returns true if the texture has an alpha channel.
    pub fn has_alpha(&self) -> bool {
        self.channels % 2 == 0
    }

    /// Maximum of all samples except alpha: an upper bound of every lookup, up to rounding. If the
    /// maximum is 1, no lookup returns more than 1.
    pub fn max_value(&self) -> f32 {
        self.max_value
    }

    /// Returns true if all values are at most 1, as reflectances and opacities are. Textures of
    /// floats can have larger values.
    pub fn is_reflectance(&self) -> bool {
        self.max_value <= 1.0
    }

    /// Returns true if lookups in the finest level at all coordinates between `low` and `high` use
    /// only black texels. Returns false if there are more than 4096 texels to test, or if the
    /// coordinates are too far from the origin for the precision of `f32`.
    pub fn is_black_within(&self, low: Vec2, high: Vec2) -> bool {
        if self.max_value == 0.0 {
            return true;
        }
        // Lookups also use the neighbours of the texels at the corners. Rounding may add one more
        // texel.
        let (first, last) = ((low * self.size).floor() - 2.0, (high * self.size).floor() + 2.0);
        let count = last - first + 1.0;
        let is_near = first.abs().max(last.abs()).max_element() < FARTHEST_TEXEL;
        if !(is_near && count.x * count.y <= MAX_TEXELS) {
            return false;
        }
        let mut texels =
            (0..count.y as u32).flat_map(|y| (0..count.x as u32).map(move |x| Vec2::new(x as f32, y as f32)));
        texels.all(|texel| self.color((first + texel + 0.5) / self.size, 0.0).is_black())
    }

    /// Number of texels with a sample that was NaN, infinite (or nearly so) or negative. These
    /// samples are now 0.
    pub fn replaced_texels(&self) -> usize {
        self.replaced
    }

    /// Number of columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.levels[0].width as usize, self.levels[0].height as usize)
    }

    /// Extension of the picture beyond the unit square.
    pub fn wrap(&self) -> Wrap {
        self.wrap
    }

    /// Size of all levels in bytes.
    pub fn bytes(&self) -> usize {
        self.samples.bytes()
    }

    fn value_between(&self, uv: Vec2, blend: Blend) -> f32 {
        if self.channels < 3 {
            let [grey] = self.filtered(0, uv, blend);
            grey
        } else {
            let rgb: [f32; 3] = self.filtered(0, uv, blend);
            Spectrum::from(rgb).luminance()
        }
    }

    /// Levels for a footprint. The width of the footprint in texels is a float: its exponent
    /// selects the level, and its fraction is the position between the levels.
    fn blend(&self, footprint: f32) -> Blend {
        let texels = footprint * self.short_side;
        let last = self.levels.len() - 1;
        if texels > 1.0 {
            let bits = texels.to_bits();
            let (level, fraction) = ((bits >> 23) as usize - 127, bits & 0x7f_ffff);
            if level < last {
                return (level, fraction as f32 * (1.0 / 8_388_608.0));
            }
            return (last, 0.0);
        }
        (0, 0.0)
    }

    /// Looks up `N` channels at `uv`, from channel `first`.
    fn filtered<const N: usize>(&self, first: usize, uv: Vec2, blend: Blend) -> [f32; N] {
        // Rows count from the top.
        let st = Vec2::new(self.wrap.fold(uv.x), 1.0 - self.wrap.fold(uv.y));
        match &self.samples {
            Samples::Bytes(codes, colors) => {
                let is_alpha = self.has_alpha() && first + 1 == self.channels;
                let table = if is_alpha { &LINEAR } else { *colors };
                self.trilinear(codes, |code| table[code as usize], first, st, blend)
            }
            Samples::Shorts(codes) => self.trilinear(codes, decode_short, first, st, blend),
            Samples::EncodedShorts(codes, _) if self.has_alpha() && first + 1 == self.channels => {
                self.trilinear(codes, decode_short, first, st, blend)
            }
            Samples::EncodedShorts(codes, table) => {
                self.trilinear(codes, |code| table[code as usize], first, st, blend)
            }
            Samples::Halves(halves) => self.trilinear(halves, half::decode, first, st, blend),
            Samples::Floats(values) => self.trilinear(values, |value| value, first, st, blend),
        }
    }

    fn trilinear<T: Copy, const N: usize>(
        &self,
        samples: &[T],
        decode: impl Fn(T) -> f32,
        first: usize,
        st: Vec2,
        (level, part): Blend,
    ) -> [f32; N] {
        let fine = self.bilinear(samples, &decode, first, st, self.levels[level]);
        if part == 0.0 {
            return fine;
        }
        let coarse = self.bilinear(samples, &decode, first, st, self.levels[level + 1]);
        between(fine, coarse, part)
    }

    fn bilinear<T: Copy, const N: usize>(
        &self,
        samples: &[T],
        decode: &impl Fn(T) -> f32,
        first: usize,
        st: Vec2,
        level: Level,
    ) -> [f32; N] {
        let (left, right, fx) = self.wrap.neighbors(st.x, level.width);
        let (top, bottom, fy) = self.wrap.neighbors(st.y, level.height);
        let texel = |x: usize, row: usize| -> [f32; N] {
            let at = (row + x) * self.channels + level.start + first;
            let texel = &samples[at..at + N];
            array::from_fn(|c| decode(texel[c]))
        };
        let (top, bottom) = (top * level.width as usize, bottom * level.width as usize);
        let above = between(texel(left, top), texel(right, top), fx);
        let below = between(texel(left, bottom), texel(right, bottom), fx);
        between(above, below, fy)
    }
}

/// Linear interpolation from `a` to `b`. Exact if `a` and `b` are equal.
fn between<const N: usize>(a: [f32; N], b: [f32; N], part: f32) -> [f32; N] {
    array::from_fn(|c| a[c] + (b[c] - a[c]) * part)
}

#[cfg(test)]
mod tests;
