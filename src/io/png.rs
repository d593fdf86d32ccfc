use super::Metadata;
use crate::color::srgb;
use crate::film::Image;
use std::io::{self, Write};

/// Writes the `R G B` channels as 8-bit sRGB; values outside [0, 1] are clamped.
///
/// A crop becomes a picture of its own size, since PNG has no data window.
pub(super) fn write(writer: impl Write, image: &Image, metadata: &Metadata) -> io::Result<()> {
    let size = image.crop.size();
    let mut encoder = png::Encoder::new(writer, size.x, size.y);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.add_text_chunk("Software".into(), metadata.software())?;
    let bytes: Vec<u8> = image.rgb().flat_map(|rgb| rgb.map(srgb::encode_u8)).collect();
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&bytes)?;
    writer.finish()?;
    Ok(())
}
