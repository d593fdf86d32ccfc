use super::{FileError, Metadata, Output};
use crate::color::Tone;
use crate::film::{Image, metered};
use std::io::{self, Write};

/// Writes the `R G B` channels as `tone` shows them, in 8 bits for an sRGB display, and `A` beside them if there is one. An automatic exposure is metered
/// in `image`.
///
/// PNG has colours that are not premultiplied (PNG specification, 3rd edition, §6.2), while `R G B` are: they are divided by `A` before the tone curve, so that
/// the rim of an object has the object's own colour. A crop becomes a picture of its own size, since PNG has no data window.
pub(super) fn write(writer: impl Write, image: &Image, metadata: &Metadata, tone: &Tone) -> io::Result<()> {
    let size = image.crop.size();
    let tone = metered(*tone, image);
    let texts = [("Software", metadata.software()), ("embrasure.tone", tone.to_string())];
    let (color, bytes): (_, Vec<u8>) = match image.alpha() {
        None => (
            png::ColorType::Rgb,
            image.rgb().flat_map(|rgb| tone.encode_u8(rgb)).collect(),
        ),
        Some(alpha) => {
            let pixels = image.rgb().zip(alpha);
            let straight = |(rgb, &alpha): ([f32; 3], &f32)| {
                let [r, g, b] = match alpha > 0.0 {
                    true => tone.encode_u8(rgb.map(|v| v / alpha)),
                    false => [0; 3],
                };
                [r, g, b, (alpha.clamp(0.0, 1.0) * 255.0).round() as u8]
            };
            (png::ColorType::Rgba, pixels.flat_map(straight).collect())
        }
    };
    encode_as(writer, color, [size.x, size.y], &bytes, &texts)
}

/// Writes 8-bit sRGB pixels, row by row from the top, with texts by their keywords.
pub(super) fn encode(writer: impl Write, size: [u32; 2], bytes: &[u8], texts: &[(&str, String)]) -> io::Result<()> {
    encode_as(writer, png::ColorType::Rgb, size, bytes, texts)
}

fn encode_as(
    writer: impl Write,
    color: png::ColorType,
    [width, height]: [u32; 2],
    bytes: &[u8],
    texts: &[(&str, String)],
) -> io::Result<()> {
    let mut encoder = png::Encoder::new(writer, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    for (keyword, text) in texts {
        encoder.add_text_chunk(keyword.to_string(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(())
}

/// A picture of colours that stand for something, with a word on what.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Columns and rows.
    pub size: [u32; 2],
    /// 8-bit sRGB of each pixel, row by row from the top.
    pub pixels: Vec<[u8; 3]>,
    /// What the colours mean.
    pub legend: String,
}

impl Figure {
    /// Writes it as a PNG; the legend goes into its text.
    pub fn write(&self, output: &Output) -> Result<(), FileError> {
        let texts = [("Description", self.legend.clone())];
        output.write(|writer| encode(writer, self.size, self.pixels.as_flattened(), &texts))
    }
}
