use super::FileError;
use super::exr_file::{ExrFile, decoding_error};
use crate::files::memory::Allowance;
use crate::film::RgbImage;
use ::exr::prelude::{self as exr, ReadChannels, ReadLayers};
use std::path::Path;

/// Memory in bytes that a pixel of an image, or a texel of an environment, needs while the file is
/// read: three floats, and the colour.
pub const BYTES_OF_A_NEW_TEXEL: u64 = 28;

/// Reads `R G B` of the first layer of an EXR file.
pub fn read_exr(path: &Path) -> Result<RgbImage, FileError> {
    read_exr_within(path, Allowance::of_system())
}

/// Reads `R G B` of the first layer of an EXR file within the memory of `allowance`.
pub(super) fn read_exr_within(path: &Path, allowance: Allowance) -> Result<RgbImage, FileError> {
    let failed = |error: &dyn std::fmt::Display| {
        let message = format!("cannot read this as an EXR image with R, G and B: {error}");
        FileError::new(path, message).help("give an .exr file that a renderer wrote")
    };
    let ExrFile { meta, reader, failure } = ExrFile::open(path, &failed)?;
    let size = meta.headers.first().map_or(0, |header| header.layer_size.area());
    allowance.check(path, size as u64 * BYTES_OF_A_NEW_TEXEL)?;
    let image = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            |size: exr::Vec2<usize>, _| RgbImage {
                width: size.width(),
                height: size.height(),
                pixels: vec![[0.0; 3]; size.area()],
            },
            |image: &mut RgbImage, at, (r, g, b, _): (f32, f32, f32, f32)| {
                image.pixels[at.y() * image.width + at.x()] = [r, g, b];
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(reader);
    let image = image.map_err(|e| failure.or(path, decoding_error(path, &e, &failed)))?;
    Ok(image.layer_data.channel_data.pixels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::WritableImage;

    /// Overwrites the numbers in the file one by one. No overwritten number may cause a panic or an
    /// excessive allocation.
    #[test]
    fn damaged_headers_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        exr::write_rgb_file(&path, 4, 2, |x, y| (x as f32, y as f32, 0.5f32)).unwrap();
        let sound = std::fs::read(&path).unwrap();
        let mut refused = 0;
        for at in 0..sound.len() - 4 {
            for value in [0, 1, -1, i32::MAX, i32::MIN, 1 << 20, 1 << 30, -(1 << 30)] {
                let mut bytes = sound.clone();
                bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
                std::fs::write(&path, bytes).unwrap();
                refused += usize::from(read_exr(&path).is_err());
            }
        }
        assert!(refused > 100, "{refused}");

        let name = b"dataWindow\0box2i\0";
        let window = sound.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        let mut bytes = sound.clone();
        bytes[window + 8..window + 16].copy_from_slice(&[0, 0, 0, 0x20, 0, 0, 0, 0x20]);
        std::fs::write(&path, bytes).unwrap();
        let message = read_exr(&path).unwrap_err().message;
        assert!(message.contains("the header says 536870913x536870913"), "{message}");
    }

    /// With tiles of 2²⁴ × 2²⁴ pixels, the exr crate accepts a damaged block length of 800 MB.
    #[test]
    fn tiles_larger_than_the_file_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let pixels = exr::SpecificChannels::rgb(|_| (0.1f32, 0.2f32, 0.3f32));
        let tiles = exr::Encoding {
            blocks: exr::Blocks::Tiles(exr::Vec2(64, 64)),
            ..exr::Encoding::UNCOMPRESSED
        };
        let layer = exr::Layer::new((4, 2), exr::LayerAttributes::default(), tiles, pixels);
        exr::Image::from_layer(layer).write().to_file(&path).unwrap();
        assert!(read_exr(&path).is_ok());

        let mut bytes = std::fs::read(&path).unwrap();
        let name = b"tiledesc\0";
        let sizes = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + 4;
        bytes[sizes..sizes + 8].copy_from_slice(&[0, 0, 0, 1, 0, 0, 0, 1]);
        std::fs::write(&path, bytes).unwrap();
        let message = read_exr(&path).unwrap_err().message;
        assert!(message.contains("the header says 16777216x16777216"), "{message}");
    }
}
