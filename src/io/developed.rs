use super::exr::{self, ExrFormat, Header};
use super::{FileError, Output, png};
use crate::color::Tone;
use crate::film::Image;
use std::io::{self, Write};

/// A picture that was made of one in a file.
#[derive(Clone, Debug)]
pub struct Developed {
    /// Its channels: of a picture of colours `R`, `G`, `B` and, where it has alpha, `A`, by which the colours are multiplied.
    pub image: Image,
    /// What was done to it, as `key=value` pairs.
    pub steps: String,
}

impl Developed {
    /// Writes the channels as they are.
    pub fn write_exr(&self, output: &Output, format: &ExrFormat) -> Result<(), FileError> {
        let header = Header {
            resolution: self.image.resolution,
            crop: self.image.crop,
            metadata: None,
            attributes: vec![("embrasure.develop".into(), self.steps.clone())],
            compression: format.compression.code(),
        };
        let channels = exr::rows_of(&self.image, format);
        output.write(|writer| exr::write_rows(writer, header, channels))
    }

    /// Writes `R G B` as `tone` shows them, whose exposure must be known. Alpha that is not 1 everywhere is written too, and colours are divided by it
    /// before, as the format wants it.
    pub fn write_png(&self, output: &Output, tone: &Tone) -> Result<(), FileError> {
        let size = self.image.crop.size().to_array();
        let texts = [
            ("Software", format!("embrasure {}", env!("CARGO_PKG_VERSION"))),
            ("embrasure.tone", tone.to_string()),
        ];
        let alpha = self.image.channel("A").map(|channel| &channel.values);
        match alpha.filter(|alpha| alpha.iter().any(|&a| a < 1.0)) {
            None => {
                let bytes: Vec<u8> = self.image.rgb().flat_map(|rgb| tone.encode_u8(rgb)).collect();
                output.write(|writer| png::encode(writer, size, &bytes, &texts))
            }
            Some(alpha) => {
                let pixels = self.image.rgb().zip(alpha).flat_map(|(rgb, &alpha)| {
                    let alpha = f32::max(alpha, 0.0).min(1.0);
                    let straight = if alpha > 0.0 { rgb.map(|v| v / alpha) } else { [0.0; 3] };
                    let [r, g, b] = tone.encode_u8(straight);
                    [r, g, b, (alpha * 255.0).round() as u8]
                });
                let bytes: Vec<u8> = pixels.collect();
                output.write(|writer| encode_rgba(writer, size, &bytes, &texts))
            }
        }
    }
}

/// Writes 8-bit sRGB pixels with straight alpha, row by row from the top.
fn encode_rgba(
    writer: impl Write,
    [width, height]: [u32; 2],
    bytes: &[u8],
    texts: &[(&str, String)],
) -> io::Result<()> {
    let mut encoder = ::png::Encoder::new(writer, width, height);
    encoder.set_color(::png::ColorType::Rgba);
    encoder.set_depth(::png::BitDepth::Eight);
    encoder.set_source_srgb(::png::SrgbRenderingIntent::Perceptual);
    for (keyword, text) in texts {
        encoder.add_text_chunk(keyword.to_string(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    writer.finish()?;
    Ok(())
}
