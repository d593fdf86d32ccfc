use super::{Texture, Wrap};
use crate::color::Spectrum;
use crate::math::{Vec2, Vec3, encode_fields, encode_variants};

/// Channel of a picture that a map of single values uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Red, or grey if the picture has no colours.
    Red,
    /// Green, or grey if the picture has no colours.
    Green,
    /// Blue, or grey if the picture has no colours.
    Blue,
    /// Alpha; 1 if the picture has no alpha.
    Matte,
    /// Luminance of Rec.709 primaries.
    Luminance,
    /// Depth channel (`Z`) of OpenEXR pictures.
    Depth,
    /// Alpha if the picture has an alpha channel and is not fully opaque, else luminance. The
    /// default of opacity maps.
    Opacity,
}

encode_variants!(Channel {
    0 => Red,
    1 => Green,
    2 => Blue,
    3 => Matte,
    4 => Luminance,
    5 => Depth,
    6 => Opacity,
});

impl Channel {
    /// Names of the channels after the option `-imfchan` of MTL files.
    pub const NAMES: &[(&str, Self)] = &[
        ("r", Self::Red),
        ("g", Self::Green),
        ("b", Self::Blue),
        ("m", Self::Matte),
        ("l", Self::Luminance),
        ("z", Self::Depth),
    ];
}

/// Placement of a texture on a surface and mapping of its values: the options of a `map_…`
/// statement ("MTL material format", Alias|Wavefront, Advanced Visualizer 3.0, appendix B1).
///
/// All numbers are finite. `wrap` and `channel` select the texture when it is read; lookups apply
/// the other fields.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mapping {
    /// `-s u v`: repetitions of the picture per unit of u and v.
    pub scale: Vec2,
    /// `-o u v`: position in the picture of the texture coordinates (0, 0).
    pub offset: Vec2,
    /// Extension of the picture beyond the unit square; `-clamp on` is [`Wrap::Clamp`].
    pub wrap: Wrap,
    /// Channel of the picture to use (`-imfchan`), if given.
    pub channel: Option<Channel>,
    /// First number of `-mm`: added to all values.
    pub base: f32,
    /// Second number of `-mm`: factor of all values.
    pub gain: f32,
    /// `-bm`: factor of heights, and of the slopes of a normal map.
    pub bump: f32,
    /// True if the green of a normal map points down the picture, as in DirectX.
    pub flips_green: bool,
}

encode_fields!(Mapping {
    scale,
    offset,
    wrap,
    channel,
    base,
    gain,
    bump,
    flips_green,
});

impl Default for Mapping {
    fn default() -> Self {
        Self {
            scale: Vec2::ONE,
            offset: Vec2::ZERO,
            wrap: Wrap::Repeat,
            channel: None,
            base: 0.0,
            gain: 1.0,
            bump: 1.0,
            flips_green: false,
        }
    }
}

impl Mapping {
    /// Position in the picture of the texture coordinates `uv`.
    pub fn st(&self, uv: Vec2) -> Vec2 {
        uv * self.scale + self.offset
    }

    /// Width, in the picture, of a `footprint` in texture coordinates. The axis with the smaller
    /// scale determines the width, so the level of the texture may be too fine along the other
    /// axis. This causes noise, which more samples remove. A level that is too coarse would cause
    /// blur, which stays.
    pub fn footprint(&self, footprint: f32) -> f32 {
        footprint * self.scale.abs().min_element()
    }

    /// [`Texture::color`] times the gain, plus the base; negative values become 0.
    pub fn color(&self, texture: &Texture, uv: Vec2, footprint: f32) -> Spectrum {
        let color = texture.color(self.st(uv), self.footprint(footprint));
        color.to_array().map(|value| self.ranged(value).max(0.0)).into()
    }

    /// [`Texture::value`] times the gain, plus the base. The result may be negative.
    pub fn value(&self, texture: &Texture, uv: Vec2, footprint: f32) -> f32 {
        self.ranged(texture.value(self.st(uv), self.footprint(footprint)))
    }

    /// [`Texture::alpha`]. Base and gain do not apply.
    pub fn alpha(&self, texture: &Texture, uv: Vec2, footprint: f32) -> f32 {
        texture.alpha(self.st(uv), self.footprint(footprint))
    }

    /// [`Texture::normal`] in the frame of the picture's axes, with its slopes multiplied by
    /// `bump`. Base and gain do not apply.
    pub fn normal(&self, texture: &Texture, uv: Vec2, footprint: f32) -> Vec3 {
        let normal = texture.normal(self.st(uv), self.footprint(footprint));
        let up = if self.flips_green { -normal.y } else { normal.y };
        Vec3::new(self.bump * normal.x, self.bump * up, normal.z)
    }

    /// ∂h/∂u and ∂h/∂v of the height h, which is `bump` times [`Mapping::value`], by the chain rule
    /// on [`Texture::gradient`].
    pub fn gradient(&self, texture: &Texture, uv: Vec2, footprint: f32) -> Vec2 {
        let gradient = texture.gradient(self.st(uv), self.footprint(footprint));
        gradient * self.scale * (self.gain * self.bump)
    }

    fn ranged(&self, value: f32) -> f32 {
        self.base + self.gain * value
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Curve, Texels};
    use super::*;

    /// Test texture whose values rise by 1 to the right and by ½ upwards over the picture.
    fn ramp() -> Texture {
        let texel = |i: usize| (i % 64) as f32 / 64.0 + (63 - i / 64) as f32 / 128.0;
        let texels = Texels::Floats((0..64 * 64).map(texel).collect());
        Texture::new(64, 64, 1, texels, Wrap::Clamp).unwrap()
    }

    #[test]
    fn scale_offset_and_range_are_applied() {
        let texture = ramp();
        let mapping = Mapping {
            scale: Vec2::new(0.5, -0.25),
            offset: Vec2::new(0.25, 0.5),
            base: 0.125,
            gain: 2.0,
            bump: 3.0,
            ..Mapping::default()
        };
        let uv = Vec2::new(0.7, 0.3);
        let st = Vec2::new(0.6, 0.425);
        assert!(mapping.st(uv).distance(st) < 1e-6);
        let value = texture.value(st, 0.0);
        assert!((mapping.value(&texture, uv, 0.0) - (0.125 + 2.0 * value)).abs() < 1e-6);
        let grey = mapping.color(&texture, uv, 0.0);
        assert!((grey.max_component() - (0.125 + 2.0 * value)).abs() < 1e-6);
        // Over the whole picture, heights rise by 1 to the right and by ½ upwards.
        let gradient = mapping.gradient(&texture, uv, 0.0);
        let expected = 6.0 * Vec2::new(0.5 * 1.0, -0.25 * 0.5);
        assert!(gradient.distance(expected) < 1e-3, "{gradient}");
        // Compare with finite differences of the mapped values
        let d = 1.0 / 32.0;
        let height = |du, dv| mapping.bump * mapping.value(&texture, uv + Vec2::new(du, dv), 0.0);
        let differences = Vec2::new(height(d, 0.0) - height(-d, 0.0), height(0.0, d) - height(0.0, -d)) / (2.0 * d);
        assert!(gradient.distance(differences) < 1e-3, "{gradient} {differences}");
    }

    #[test]
    fn negative_colors_become_0_and_alpha_is_unchanged() {
        let texels = Texels::Bytes(vec![255, 0, 51, 51], Curve::Linear);
        let texture = Texture::new(1, 1, 4, texels, Wrap::Repeat).unwrap();
        let mapping = Mapping {
            base: -0.5,
            gain: -1.0,
            ..Mapping::default()
        };
        assert_eq!(mapping.color(&texture, Vec2::ZERO, 0.0), Spectrum::ZERO);
        assert!(mapping.value(&texture, Vec2::ZERO, 0.0) < -0.5);
        assert_eq!(mapping.alpha(&texture, Vec2::ZERO, 0.0), 0.2);
    }

    #[test]
    fn default_mapping_changes_nothing() {
        let (texture, plain, uv) = (ramp(), Mapping::default(), Vec2::new(0.3, 0.8));
        assert_eq!(plain.st(uv), uv);
        assert_eq!(plain.value(&texture, uv, 0.1), texture.value(uv, 0.1));
        assert_eq!(plain.gradient(&texture, uv, 0.1), texture.gradient(uv, 0.1));
        // The scale repeats the picture in u only, so the footprint along v does not change.
        let tiled = Mapping {
            scale: Vec2::new(-10.0, 1.0),
            ..plain
        };
        assert_eq!(tiled.footprint(0.25), 0.25);
    }
}
