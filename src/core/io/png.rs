//! PNG files: 8-bit pictures for display, after exposure and tone curve (`color/tone.rs`).

use super::{FileError, Metadata, Output};
use crate::color::Tone;
use crate::film::{Image, metered};
use std::io::{self, Write};
use std::path::Path;

impl Image {
    /// Writes `R G B` as `tone` shows them, and `A` where there is one, to the PNG file `path`: 8 bits for an sRGB display. An automatic exposure is metered in the
    /// image. [`Output::write_image`] does the same and says in the file how the picture was made.
    ///
    /// # Errors
    ///
    /// A file that cannot be written; one that was there is kept then.
    pub fn save_png(&self, path: impl AsRef<Path>, tone: &Tone) -> Result<(), FileError> {
        let tone = metered(*tone, self);
        Output::prepare(path)?.write(|writer| write_as(writer, self, self.alpha(), &tone, software()))
    }
}

/// Name and version of the program, as image files call it.
pub(super) fn software() -> String {
    format!("embrasure {}", env!("CARGO_PKG_VERSION"))
}

/// Writes the `R G B` channels as `tone` shows them, and `A` beside them if there is one. An automatic exposure is metered in `image`.
///
/// A crop becomes a picture of its own size, since PNG has no data window.
pub(super) fn write(writer: impl Write, image: &Image, metadata: &Metadata, tone: &Tone) -> io::Result<()> {
    write_as(
        writer,
        image,
        image.alpha(),
        &metered(*tone, image),
        metadata.software(),
    )
}

/// Writes the `R G B` channels as `tone` shows them, whose exposure must be known, in 8 bits for an sRGB display, with `alpha` beside them where it is given.
///
/// PNG has colours that are not premultiplied (PNG specification, 3rd edition, §6.2), while `R G B` are: they are divided by `alpha` before the tone curve,
/// so that the rim of an object has the object's own colour.
pub(super) fn write_as(
    writer: impl Write,
    image: &Image,
    alpha: Option<&[f32]>,
    tone: &Tone,
    software: String,
) -> io::Result<()> {
    let size = image.crop.size().to_array();
    let texts = [("Software", software), ("embrasure.tone", tone.to_string())];
    let color = if alpha.is_some() {
        png::ColorType::Rgba
    } else {
        png::ColorType::Rgb
    };
    encode_as(writer, color, size, &display_bytes(image, alpha, tone), &texts)
}

/// `R G B` of `image` as `tone` shows them, whose exposure must be known, in 8 bits for an sRGB display, row by row from the top; where `alpha` is given,
/// colours are divided by it, and it follows them as a fourth channel.
pub fn display_bytes(image: &Image, alpha: Option<&[f32]>, tone: &Tone) -> Vec<u8> {
    let Some(alpha) = alpha else {
        return image.rgb().flat_map(|rgb| tone.encode_u8(rgb)).collect();
    };
    let pixels = image.rgb().zip(alpha).flat_map(|(rgb, &alpha)| {
        // `max` maps NaN to 0.
        let alpha = f32::max(alpha, 0.0).min(1.0);
        let straight = if alpha > 0.0 { rgb.map(|v| v / alpha) } else { [0.0; 3] };
        let [r, g, b] = tone.encode_u8(straight);
        [r, g, b, (alpha * 255.0).round() as u8]
    });
    pixels.collect()
}

/// Writes 8-bit sRGB pixels, row by row from the top, with texts by their keywords.
pub(super) fn encode(writer: impl Write, size: [u32; 2], bytes: &[u8], texts: &[(&str, String)]) -> io::Result<()> {
    encode_as(writer, png::ColorType::Rgb, size, bytes, texts)
}

/// An 8-bit PNG file in memory: sRGB colours with three `channels`, with alpha as a fourth, or a grey with one, row by row from the top.
pub fn png_bytes(channels: usize, size: [u32; 2], bytes: &[u8]) -> io::Result<Vec<u8>> {
    let color = match channels {
        1 => png::ColorType::Grayscale,
        4 => png::ColorType::Rgba,
        _ => png::ColorType::Rgb,
    };
    let mut file = Vec::new();
    encode_as(&mut file, color, size, bytes, &[])?;
    Ok(file)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{Curve, Spectrum};
    use crate::film::{Block, Film, Rect};
    use crate::math::UVec2;
    use std::fs::File;
    use std::io::BufReader;

    /// Shadows on a ground, and pixel filters with negative lobes, give negative light.
    #[test]
    fn negative_light_is_black() {
        let tones = [Curve::Srgb, Curve::AcesHill, Curve::Agx].map(|curve| Tone {
            curve,
            ..Tone::default()
        });
        let size = UVec2::new(1, 1);
        let mut film = Film::new(size, Rect::full(size));
        let mut block = Block::default();
        block.add(Spectrum::rgb(-0.25, -1e-6, 0.5), None);
        film.tile_at_mut(UVec2::ZERO)
            .unwrap()
            .sums_mut(UVec2::ZERO)
            .unwrap()
            .add(&block);
        let image = film.develop();
        for tone in tones {
            let expected = tone.encode_u8([0.0, 0.0, 0.5]);
            assert_eq!(display_bytes(&image, None, &tone), expected);
            assert_eq!(display_bytes(&image, Some(&[1.0]), &tone)[..3], expected);
        }
    }

    /// The pixels of a saved picture are those that the tone curve gives, and a file in a folder that is not there is an error.
    #[test]
    fn saved_pictures_are_as_the_tone_shows_them() {
        let size = UVec2::new(2, 1);
        let mut film = Film::new(size, Rect::full(size));
        for (x, light) in [[0.5, 0.25, 0.1], [2.0, 0.0, 1.0]].into_iter().enumerate() {
            let pixel = UVec2::new(x as u32, 0);
            let mut block = Block::default();
            block.add(Spectrum::rgb(light[0], light[1], light[2]), None);
            film.tile_at_mut(pixel).unwrap().sums_mut(pixel).unwrap().add(&block);
        }
        let (image, tone) = (film.develop(), Tone::default());
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        image.save_png(&path, &tone).unwrap();
        let file = BufReader::new(File::open(&path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        let expected = [tone.encode_u8([0.5, 0.25, 0.1]), tone.encode_u8([2.0, 0.0, 1.0])];
        assert_eq!(bytes, expected.concat());
        assert!(image.save_png(folder.path().join("none/a.png"), &tone).is_err());
    }
}
