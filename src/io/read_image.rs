use super::FileError;
use crate::film::RgbImage;
use ::exr::prelude as exr;
use std::path::Path;

/// Reads `R G B` of the first layer of an EXR file.
pub fn read_exr(path: &Path) -> Result<RgbImage, FileError> {
    let image = exr::read_first_rgba_layer_from_file(
        path,
        |size: exr::Vec2<usize>, _| RgbImage {
            width: size.width(),
            height: size.height(),
            pixels: vec![[0.0; 3]; size.area()],
        },
        |image: &mut RgbImage, at, (r, g, b, _): (f32, f32, f32, f32)| {
            image.pixels[at.y() * image.width + at.x()] = [r, g, b];
        },
    );
    let image = image.map_err(|e| {
        let error = FileError::new(path, format!("cannot read this as an EXR image with R, G and B: {e}"));
        error.help("give an .exr file that a renderer wrote")
    })?;
    Ok(image.layer_data.channel_data.pixels)
}
