//! Environment maps: pictures of latitude and longitude (Radiance, EXR) for infinitely distant light.

use super::FileError;
use super::header_limits::check_size;
use super::input::Input;
use super::memory::Allowance;
pub use super::read_image::BYTES_OF_A_NEW_TEXEL;
use super::read_image::read_exr_within;
use crate::color::Spectrum;
use crate::light::LatLongImage;
use crate::math::list;
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};
use std::path::Path;

/// Bytes that a texel of an environment takes for good: its colour, and what directions are drawn by.
const BYTES_OF_A_TEXEL: u64 = 20;

/// Bytes that an environment of so many texels takes for good.
pub fn environment_bytes(texels: u64) -> u64 {
    texels * BYTES_OF_A_TEXEL
}

/// Reads a Radiance `.hdr` or an `.exr` picture of latitude and longitude, linear Rec.709.
pub fn read_environment(path: &Path, allowance: Allowance) -> Result<LatLongImage, FileError> {
    let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let image = match extension.as_deref() {
        Some("hdr" | "pic") => read_hdr(path, allowance)?,
        Some("exr") => {
            let image = read_exr_within(path, allowance)?;
            LatLongImage {
                width: image.width,
                height: image.height,
                texels: image.pixels.into_iter().map(Spectrum::from).collect(),
            }
        }
        _ => {
            return Err(FileError::new(path, "an environment must be an .hdr or .exr file"));
        }
    };
    if image.texels.is_empty() {
        return Err(FileError::new(path, "the image has no pixels"));
    }
    if let Some(i) = image.texels.iter().position(|t| !t.is_valid()) {
        let (x, y, value) = (i % image.width, i / image.width, list(&image.texels[i].to_array()));
        let message = format!("column {x}, row {y} is {value}; radiance must be finite and 0 or more");
        return Err(FileError::new(path, message));
    }
    Ok(image)
}

fn read_hdr(path: &Path, allowance: Allowance) -> Result<LatLongImage, FileError> {
    let input = Input::open(path, "the picture").map_err(|error| error.help_if_none("check the path"))?;
    let (length, failure) = (input.length(), input.failure());
    let failed = |error: &dyn std::fmt::Display| {
        failure.or(path, FileError::new(path, format!("cannot decode the image: {error}")))
    };
    let decoder = HdrDecoder::new(input.buffered(path)?).map_err(|e| failed(&e))?;
    let (width, height) = decoder.dimensions();
    check_size(path, length, width as usize, height as usize)?;
    allowance.check(path, u64::from(width) * u64::from(height) * BYTES_OF_A_NEW_TEXEL)?;
    let image = DynamicImage::from_decoder(decoder)
        .map_err(|e| failed(&e))?
        .into_rgb32f();
    Ok(LatLongImage {
        width: image.width() as usize,
        height: image.height() as usize,
        texels: image.pixels().map(|p| Spectrum::from(p.0)).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_environment(path: &Path) -> Result<LatLongImage, FileError> {
        super::read_environment(path, Allowance::default())
    }

    #[test]
    fn both_formats_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let color = |x: usize, y: usize| [0.25 * x as f32, 0.5, 2.0 * y as f32];

        let exr = folder.path().join("a.exr");
        ::exr::prelude::write_rgb_file(&exr, 4, 2, |x, y| color(x, y).into()).unwrap();
        let image = read_environment(&exr).unwrap();
        assert_eq!((image.width, image.height), (4, 2));
        assert_eq!(image.texels[4 + 3].to_array(), color(3, 1));

        let hdr = folder.path().join("a.HDR");
        let pixels: Vec<image::Rgb<f32>> = (0..8).map(|i| image::Rgb(color(i % 4, i / 4))).collect();
        let file = std::fs::File::create(&hdr).unwrap();
        image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, 4, 2).unwrap();
        let image = read_environment(&hdr).unwrap();
        let texel = image.texels[4 + 3].to_array();
        assert!(
            texel.iter().zip(color(3, 1)).all(|(a, b)| (a - b).abs() < 0.02),
            "{texel:?}"
        );
    }

    #[test]
    fn what_is_no_environment_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            read_environment(&path).unwrap_err().message
        };
        assert!(file("a.png", b"x").contains(".hdr or .exr"));
        assert!(file("a.hdr", b"#?RADIANCE\n\n-Y 2 +X").contains("decode"));
        assert!(file("a.hdr", b"#?RADIANCE\n\n-Y 900000 +X 900000\n").contains("900000x900000"));
        assert!(file("a.exr", b"no").contains("cannot read"));
        assert!(
            read_environment(Path::new("gone.hdr"))
                .unwrap_err()
                .message
                .contains("no such")
        );
        let negative = folder.path().join("n.exr");
        ::exr::prelude::write_rgb_file(&negative, 1, 1, |_, _| (-1.0f32, 0.0f32, 0.0f32)).unwrap();
        assert!(
            read_environment(&negative)
                .unwrap_err()
                .message
                .contains("column 0, row 0")
        );
    }
}
