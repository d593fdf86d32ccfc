//! Input of the filters: the layers of an image.

use super::{ALBEDO, COLOR, DenoiseError, NORMAL, RAW, VARIANCE, values, vectors};
use crate::film::Image;
use crate::math::Vec3;

/// A layer of pixels, or the error that the channel of this layer is missing. A filter returns this
/// error only if it needs the layer.
type Layer<T> = Result<Vec<T>, DenoiseError>;

/// Layers of an image as input of the filters, row by row.
#[derive(Clone, Debug)]
pub(super) struct Layers {
    pub size: [usize; 2],
    /// Picture to filter: light or coverage.
    pub color: Vec<Vec3>,
    /// Variance of `color`; infinite if unknown.
    pub variance: Layer<Vec3>,
    pub albedo: Layer<Vec3>,
    pub normal: Layer<Vec3>,
    pub depth: Layer<f32>,
    /// True if `color` is light, which is proportional to the albedo.
    pub is_light: bool,
}

impl Layers {
    /// Layers of `image`. The layer `color` is the raw picture, before any denoising.
    pub fn of(image: &Image) -> Result<Self, DenoiseError> {
        let size = image.crop.size();
        Ok(Self {
            size: [size.x as usize, size.y as usize],
            color: vectors(image, RAW).or_else(|_| vectors(image, COLOR))?,
            variance: vectors(image, VARIANCE),
            albedo: vectors(image, ALBEDO),
            normal: vectors(image, NORMAL),
            depth: values(image, "Z").map(<[f32]>::to_vec),
            is_light: true,
        })
    }
}
