//! Textures: keeping texels (`samples`, `levels`), filtered lookups (`lookup`) and placement (`mapping`, `wrap`). File formats are elsewhere.
//!
//! `io/read_picture.rs` reads the samples of a file, and `io/texture.rs` keeps those that the texture is for. Samples stay as compact as the file has
//! them and are decoded at each lookup: 8 bits by a table, floats as halves where that loses nothing.
//!
//! Between two levels a lookup is linear in the cone's width and not in its logarithm: exponent and fraction of the float are then level and blend.
//! Channels and borders (`-imfchan`, `-clamp`) make a texture of their own; scale, offset and range belong to the lookup (`Mapping`).

mod half;
mod levels;
mod lookup;
mod mapping;
mod samples;
mod wrap;

pub use lookup::Texture;
pub use mapping::{Channel, Mapping};
pub use samples::{Curve, Texels};
pub use wrap::Wrap;

use crate::math::{Encode, encode_variants};

/// How textures are looked up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// In levels as coarse as what a sample sees of a pixel, and between them.
    #[default]
    Mip,
    /// Between the four nearest texels of the finest level, wherever the viewer is.
    Bilinear,
}

encode_variants!(TextureFilter {
    0 => Mip,
    1 => Bilinear,
});

impl TextureFilter {
    /// Each by the name that users type.
    pub const NAMES: &[(&str, Self)] = &[("mip", Self::Mip), ("bilinear", Self::Bilinear)];
}

/// Index of a texture among those of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

impl Encode for TextureId {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.0.encode(sink);
    }
}
