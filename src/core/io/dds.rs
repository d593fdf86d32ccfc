//! DDS files: pictures in the block formats of graphics processors (BC1 to BC7), and in a few
//! uncompressed formats. The finest level of the first layer is read. The crate ddsfile reads the
//! header. BC1 to BC5 without sign are decoded by `block_compression.rs`, and all other formats by
//! the crate image_dds.

use super::FileError;
use super::block_compression::BlockFormat;
use super::picture::{Picture, PictureHeader, Samples, damaged};
use crate::files::guarded;
use crate::files::input::ReadFailure;
use ddsfile::Dds;
use image_dds::{ImageFormat, Surface, ddsfile};
use std::io::Read;
use std::path::Path;

/// First bytes of every DDS file.
pub(super) const MAGIC: &[u8] = b"DDS ";

const HELP: &str = "save it as PNG, with a painting program or with `magick a.dds a.png` of ImageMagick";

/// A DDS file in memory, and its pixel format.
pub(super) struct DdsFile {
    dds: Dds,
    format: ImageFormat,
}

impl DdsFile {
    /// Reads the file `path` from `reader`.
    pub fn read(path: &Path, mut reader: impl Read, failure: &ReadFailure) -> Result<Self, FileError> {
        let read = guarded(|| Dds::read(&mut reader)).ok();
        let dds = match read {
            Some(Ok(dds)) => dds,
            Some(Err(error)) => return Err(failure.or(path, damaged(path, &error))),
            None => return Err(damaged(path, &"its header is wrong")),
        };
        let format = guarded(|| image_dds::dds_image_format(&dds)).ok().and_then(Result::ok);
        let format = format.ok_or_else(|| {
            let message = "the pixel format of this DDS file is not supported";
            FileError::new(path, message).help(HELP)
        })?;
        Ok(Self { dds, format })
    }

    /// Returns true if pixels are decoded as 32-bit floats.
    fn is_float(&self) -> bool {
        use ImageFormat::*;
        matches!(
            self.format,
            BC6hRgbUfloat
                | BC6hRgbSfloat
                | R16Float
                | Rg16Float
                | Rgba16Float
                | R32Float
                | Rg32Float
                | Rgb32Float
                | Rgba32Float
        )
    }

    /// Returns true if the format has an alpha channel. BC1 has no alpha channel, although its
    /// pixels may be transparent.
    fn has_alpha(&self) -> bool {
        use ImageFormat::*;
        matches!(
            self.format,
            BC2RgbaUnorm
                | BC2RgbaUnormSrgb
                | BC3RgbaUnorm
                | BC3RgbaUnormSrgb
                | BC7RgbaUnorm
                | BC7RgbaUnormSrgb
                | Rgba8Unorm
                | Rgba8UnormSrgb
                | Rgba8Snorm
                | Bgra8Unorm
                | Bgra8UnormSrgb
                | Bgra4Unorm
                | Bgr5A1Unorm
                | Rgba16Unorm
                | Rgba16Snorm
                | Rgba16Float
                | Rgba32Float
        )
    }

    /// Block format that this program decodes itself.
    fn block_format(&self) -> Option<BlockFormat> {
        use ImageFormat::*;
        Some(match self.format {
            BC1RgbaUnorm | BC1RgbaUnormSrgb => BlockFormat::Bc1,
            BC2RgbaUnorm | BC2RgbaUnormSrgb => BlockFormat::Bc2,
            BC3RgbaUnorm | BC3RgbaUnormSrgb => BlockFormat::Bc3,
            BC4RUnorm => BlockFormat::Bc4,
            BC5RgUnorm => BlockFormat::Bc5,
            _ => return None,
        })
    }

    /// Size and samples of the picture.
    pub fn header(&self) -> PictureHeader {
        PictureHeader {
            width: self.dds.get_width().into(),
            height: self.dds.get_height().into(),
            channels: 4,
            sample_bytes: if self.is_float() { 4 } else { 1 },
        }
    }

    /// Decodes the picture.
    ///
    /// Blocks of two channels (BC5) are normal maps with x in red and y in green. The z of the unit
    /// vector is computed and becomes the blue. Formats without alpha have three channels, unless a
    /// pixel of BC1 is transparent.
    pub fn picture(self, path: &Path) -> Result<Picture, FileError> {
        let PictureHeader { width, height, .. } = self.header();
        let (width, height) = (width as usize, height as usize);
        let decoded = guarded(|| {
            if let Some(format) = self.block_format() {
                // The finest level of the first layer comes first. The header's size of a level is
                // not used, because it is wrong in some files.
                let decoded = format.decode(&self.dds.data, width, height);
                return Ok(Samples::Bytes(decoded.unwrap_or_default()));
            }
            let surface = Surface::from_dds(&self.dds)?;
            if self.is_float() {
                let decoded = surface.decode_layers_mipmaps_rgbaf32(0..1, 0..1)?;
                Ok(Samples::Floats(decoded.data))
            } else {
                let decoded = surface.decode_layers_mipmaps_rgba8(0..1, 0..1)?;
                Ok::<_, image_dds::error::SurfaceError>(Samples::Bytes(decoded.data))
            }
        });
        let samples = match decoded {
            Ok(Ok(samples)) => samples,
            Ok(Err(error)) => return Err(damaged(path, &error)),
            Err(_) => return Err(damaged(path, &"the decoder cannot read it")),
        };
        let mut picture = Picture {
            width,
            height,
            channels: 4,
            samples,
            orientation: 1,
        };
        let length = match &picture.samples {
            Samples::Bytes(bytes) => bytes.len(),
            Samples::Shorts(shorts) => shorts.len(),
            Samples::Floats(floats) => floats.len(),
        };
        if length != 4 * width * height {
            return Err(damaged(path, &"it has another number of pixels than its header says"));
        }
        if matches!(self.format, ImageFormat::BC5RgUnorm | ImageFormat::BC5RgSnorm) {
            add_heights(&mut picture.samples);
        }
        if !self.has_alpha() {
            picture.drop_opaque_alpha();
        }
        Ok(picture)
    }
}

/// Sets the blue of each texel to the z of the unit vector with x and y in red and green.
fn add_heights(samples: &mut Samples) {
    let Samples::Bytes(bytes) = samples else { return };
    for texel in bytes.chunks_exact_mut(4) {
        let [x, y] = [texel[0], texel[1]].map(|code| f32::from(code) / 127.5 - 1.0);
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        texel[2] = ((z + 1.0) * 127.5).round() as u8;
    }
}
