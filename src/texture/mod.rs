//! Pictures on surfaces: looking texels up, filtered, and placing them. Knows no file formats.

mod half;
mod levels;
mod lookup;
mod mapping;
mod wrap;

pub use lookup::{Curve, Texels, Texture};
pub use mapping::{Channel, Mapping};
pub use wrap::Wrap;

/// Index of a texture among those of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TextureId(pub u32);
