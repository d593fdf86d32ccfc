//! Textures: storage of texels (`samples`, `levels`), filtered lookups (`lookup`) and placement
//! (`mapping`, `wrap`). Other modules read file formats.
//!
//! `io/read_picture.rs` reads the samples of a file, and `io/texture.rs` keeps the channels that
//! the texture needs. Samples stay as compact as in the file and are decoded at each lookup: 8 bits
//! by a table, floats as halves if that is lossless.
//!
//! Between two levels, a lookup is linear in the width of the ray's cone, not in the logarithm of
//! the width. This is fast: the exponent bits of the width in texels are the level, and its
//! fraction bits are the position between the levels.
//!
//! Each choice of channels and wrap mode (`-imfchan`, `-clamp`) makes a separate texture. Scale,
//! offset and range are applied by the lookup (`Mapping`).

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

/// Filter of texture lookups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TextureFilter {
    /// Trilinear: between the two levels that match the footprint of the lookup.
    #[default]
    Mip,
    /// Bilinear in the finest level, for any distance of the viewer.
    Bilinear,
}

encode_variants!(TextureFilter {
    0 => Mip,
    1 => Bilinear,
});

impl TextureFilter {
    /// Names of the filters, as users type them.
    pub const NAMES: &[(&str, Self)] = &[("mip", Self::Mip), ("bilinear", Self::Bilinear)];
}

/// Index of a texture in its scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);

impl Encode for TextureId {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.0.encode(sink);
    }
}
