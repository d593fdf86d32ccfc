//! PNG files: 8-bit pictures for display, after exposure and tone curve (`color/tone.rs`).

use super::{FileError, Metadata};
use crate::color::{Spectrum, Tone, srgb};
use crate::files::Output;
use crate::film::{Backing, Image, LINES, metered};
use crate::options::{Print, Value};
use std::io::{self, Write};
use std::path::Path;

impl Image {
    /// Writes the picture with the tone curve of `tone` ([`display_bytes`]) to the PNG file `path`:
    /// 8 bits for an sRGB display. An automatic exposure is metered in the image.
    /// [`Output::write_image`] does the same, and also writes to the file how the picture was made.
    ///
    /// # Errors
    ///
    /// The file cannot be written. An existing file is kept.
    pub fn save_png(&self, path: impl AsRef<Path>, tone: &Tone) -> Result<(), FileError> {
        let tone = metered(*tone, self);
        Output::prepare(path)?.write(|writer| write_as(writer, self, &tone, None, software()))
    }
}

/// Name and version of the program, for image files.
pub(super) fn software() -> String {
    format!("embrasure {}", env!("CARGO_PKG_VERSION"))
}

/// Writes `image` with the tone curve of `tone`. If `metadata` has a colour for lines, the lines of
/// the channel `lines` are drawn. An automatic exposure is computed from `image`.
///
/// A crop becomes a picture with the size of the crop, because PNG has no data window.
pub(super) fn write(writer: impl Write, image: &Image, metadata: &Metadata, tone: &Tone) -> io::Result<()> {
    write_printed(
        writer,
        image,
        (&metered(*tone, image), metadata.finish().lines.map(|color| color.0)),
        metadata.software(),
        metadata.print,
    )
}

/// Writes `image` as a PNG with the tone curve of `tone` ([`display_bytes`]). The exposure of
/// `tone` must not be automatic. Lines are drawn in the colour `lines`, if there is one.
pub(super) fn write_as(
    writer: impl Write,
    image: &Image,
    tone: &Tone,
    lines: Option<Spectrum>,
    software: String,
) -> io::Result<()> {
    write_printed(writer, image, (tone, lines), software, None)
}

/// Writes like [`write_as`], and adds the scale of the picture on paper.
fn write_printed(
    writer: impl Write,
    image: &Image,
    (tone, lines): (&Tone, Option<Spectrum>),
    software: String,
    print: Option<Print>,
) -> io::Result<()> {
    let size = image.crop.size().to_array();
    let mut texts = vec![("Software", software), ("embrasure.tone", tone.to_string())];
    texts.extend(print.map(|print| ("embrasure.scale", print.scale.text())));
    let (channels, mut bytes) = display_bytes(image, tone);
    if let (Some(color), Some(lines)) = (lines, image.channel(LINES)) {
        draw_lines(channels, &mut bytes, &lines.values, color);
    }
    let density = print.map(Print::pixels_per_metre_of_paper);
    encode_as(writer, (color_type(channels), density), size, &bytes, &texts)
}

/// Returns the number of channels, and `image` in 8 bits for an sRGB display, row by row from the
/// top. There are 4 channels if the background is transparent, else 3. The exposure of `tone` must
/// not be automatic.
///
/// The tone curve does not apply to a background colour: a pixel without coverage has exactly the
/// code of the background colour. Partly covered pixels are blended in linear light.
///
/// Colours over a transparent background are not premultiplied (PNG specification, 3rd edition,
/// §6.2). Browsers and most painting programs blend codes instead of light. Alpha is therefore
/// chosen so that the result of these programs over black and over white equals a blend in linear
/// light. The three channels need different values of alpha for this, so the middle between the
/// smallest and the largest value is used.
pub fn display_bytes(image: &Image, tone: &Tone) -> (usize, Vec<u8>) {
    let Some((backing, coverage)) = image.coverage() else {
        return (3, image.rgb().flat_map(|rgb| tone.encode_u8(rgb)).collect());
    };
    // `max` maps NaN to 0.
    let coverage = coverage.iter().map(|a| a.map(|a| f32::max(a, 0.0).min(1.0)));
    let pixels = image.rgb().zip(coverage);
    match backing {
        Backing::Transparent => (
            4,
            pixels.flat_map(|(rgb, [a, ..])| over_nothing(rgb, a, tone)).collect(),
        ),
        Backing::Color(color) => (3, pixels.flat_map(|(rgb, a)| over(color, rgb, a, tone)).collect()),
    }
}

/// Draws lines of the colour `color` over the 8-bit picture `bytes`, in linear light. `shares` has
/// the fraction of each pixel that lines cover. The tone curve does not apply to the colour of
/// lines.
fn draw_lines(channels: usize, bytes: &mut [u8], shares: &[f32], color: Spectrum) {
    for (pixel, share) in bytes.chunks_exact_mut(channels).zip(shares) {
        let share = share.clamp(0.0, 1.0);
        let (codes, alpha) = pixel.split_at_mut(3);
        let before = alpha.first().map_or(1.0, |alpha| f32::from(*alpha) / 255.0);
        let after = share + (1.0 - share) * before;
        if share == 0.0 || after == 0.0 {
            continue;
        }
        for (code, line) in codes.iter_mut().zip(color.to_array()) {
            let light = before * srgb::decode(f32::from(*code) / 255.0);
            *code = srgb::encode_u8((share * line + (1.0 - share) * light) / after);
        }
        alpha.fill((after * 255.0).round() as u8);
    }
}

/// 8-bit colour (not premultiplied) and alpha for a transparent background. `rgb` is the light of
/// the pixel, premultiplied by the coverage `a`.
fn over_nothing(rgb: [f32; 3], a: f32, tone: &Tone) -> [u8; 4] {
    if a == 1.0 {
        let [r, g, b] = tone.encode_u8(rgb);
        return [r, g, b, 255];
    }
    let shown = shown(rgb, a, tone);
    let over_black = shown.map(srgb::encode);
    let over_white = shown.map(|light| srgb::encode(light + 1.0 - a));
    let alphas = [0, 1, 2].map(|c| 1.0 - (over_white[c] - over_black[c]));
    let alpha = 0.5 * (Spectrum::from(alphas).max_component() + alphas.into_iter().fold(1.0, f32::min));
    let code = |v: f32| (v * 255.0).round() as u8;
    if alpha > 0.0 {
        let [r, g, b] = over_black.map(|v| code((v / alpha).min(1.0)));
        [r, g, b, code(alpha)]
    } else {
        [0; 4]
    }
}

/// 8-bit codes of a pixel over the background `color`. `a` is the coverage. The light `rgb`
/// includes the visible part of the background, `color` times 1 − `a`.
fn over(color: Spectrum, rgb: [f32; 3], a: [f32; 3], tone: &Tone) -> [u8; 3] {
    if a == [1.0; 3] {
        return tone.encode_u8(rgb);
    }
    let behind = (color * (Spectrum::ONE - Spectrum::from(a))).to_array();
    let front = [0, 1, 2].map(|c| (rgb[c] - behind[c]).max(0.0));
    let shown = shown(front, Spectrum::from(a).mean(), tone);
    [0, 1, 2].map(|c| srgb::encode_u8(shown[c] + behind[c]))
}

/// Light that a display emits for the light `rgb`, which is premultiplied by the coverage `a`. The
/// tone curve is applied to the colour without premultiplication, and the result is multiplied by
/// the coverage. So the edge of an object has the colour of the object.
fn shown(rgb: [f32; 3], a: f32, tone: &Tone) -> [f32; 3] {
    if a > 0.0 {
        tone.encode(rgb.map(|v| v / a)).map(|v| a * srgb::decode(v))
    } else {
        [0.0; 3]
    }
}

fn color_type(channels: usize) -> png::ColorType {
    match channels {
        1 => png::ColorType::Grayscale,
        4 => png::ColorType::Rgba,
        _ => png::ColorType::Rgb,
    }
}

/// Writes 8-bit sRGB pixels, row by row from the top, and text chunks by keyword.
pub(super) fn encode(writer: impl Write, size: [u32; 2], bytes: &[u8], texts: &[(&str, String)]) -> io::Result<()> {
    encode_as(writer, (png::ColorType::Rgb, None), size, bytes, texts)
}

/// Returns a PNG file of the 8-bit samples `bytes`, which are row by row from the top. `channels`
/// is 1 for grey, 3 for sRGB colours, 4 for colours and alpha.
pub fn png_bytes(channels: usize, size: [u32; 2], bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut file = Vec::new();
    encode_as(&mut file, (color_type(channels), None), size, bytes, &[])?;
    Ok(file)
}

/// Writes an 8-bit PNG file. `density` is the number of pixels per metre of paper, if the picture
/// has a scale.
fn encode_as(
    writer: impl Write,
    (color, density): (png::ColorType, Option<u32>),
    [width, height]: [u32; 2],
    bytes: &[u8],
    texts: &[(&str, String)],
) -> io::Result<()> {
    let mut encoder = png::Encoder::new(writer, width, height);
    encoder.set_color(color);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_source_srgb(png::SrgbRenderingIntent::Perceptual);
    encoder.set_pixel_dims(density.map(|density| png::PixelDimensions {
        xppu: density,
        yppu: density,
        unit: png::Unit::Meter,
    }));
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
    use crate::color::{Curve, Exposure};
    use crate::film::{Film, FilmSample, Rect, SampleChange};
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
        let tile = film.tile_at_mut(UVec2::ZERO).unwrap();
        let mut block = tile.block();
        block.add(&FilmSample {
            radiance: Spectrum::rgb(-0.25, -1e-6, 0.5),
            ..FilmSample::default()
        });
        tile.change(UVec2::ZERO, &block, SampleChange::Add);
        let image = film.develop();
        for tone in tones {
            let expected = tone.encode_u8([0.0, 0.0, 0.5]);
            assert_eq!(display_bytes(&image, &tone), (3, expected.to_vec()));
        }
    }

    /// A picture of one pixel with the light `rgb` and the coverage `coverage`, over `backing`.
    fn covered(rgb: [f32; 3], backing: Backing, coverage: f32) -> Image {
        let size = UVec2::new(1, 1);
        let mut image = Film::new(size, Rect::full(size)).with_backing(backing).develop();
        for (channel, value) in image.channels.iter_mut().zip(rgb) {
            channel.values = vec![value];
        }
        for name in backing.channels() {
            let channel = image.channels.iter_mut().find(|channel| channel.name == *name);
            channel.unwrap().values = vec![coverage];
        }
        image
    }

    fn tones() -> impl Iterator<Item = Tone> {
        Curve::NAMES.iter().map(|&(_, curve)| Tone {
            exposure: Exposure::Stops(1.5),
            curve,
        })
    }

    #[test]
    fn background_keeps_its_code_with_every_tone_curve() {
        for tone in tones() {
            for code in [[255, 255, 255], [255, 195, 86], [0, 1, 128]] {
                let color = Spectrum::from(code.map(|v| srgb::decode(f32::from(v) / 255.0)));
                let image = covered(color.to_array(), Backing::Color(color), 0.0);
                assert_eq!(display_bytes(&image, &tone), (3, code.to_vec()), "{tone}");
                // A fully covered pixel does not depend on the background.
                let light = [0.5, 0.2, 3.0];
                let image = covered(light, Backing::Color(color), 1.0);
                assert_eq!(display_bytes(&image, &tone).1, tone.encode_u8(light), "{tone}");
            }
        }
    }

    /// Blending the codes of a picture with a transparent background, as browsers do, gives the
    /// same result as rendering over a background colour. This is tested for partly covered pixels
    /// of grey light, and for shadows.
    #[test]
    fn blended_transparent_picture_equals_opaque_picture() {
        for tone in tones() {
            for (light, coverage) in [(0.05, 0.5), (0.2, 0.7), (0.0, 0.5), (0.0, 0.02)] {
                let (_, bytes) = display_bytes(&covered([light; 3], Backing::Transparent, coverage), &tone);
                let [grey, alpha] = [bytes[0], bytes[3]].map(|code| f32::from(code) / 255.0);
                for behind in [0.0, 1.0] {
                    let opaque = light + (1.0 - coverage) * behind;
                    let image = covered([opaque; 3], Backing::Color(Spectrum::splat(behind)), coverage);
                    let blended = 255.0 * (alpha * grey + (1.0 - alpha) * behind);
                    let shown = f32::from(display_bytes(&image, &tone).1[0]);
                    assert!(
                        (blended - shown).abs() < 1.1,
                        "{tone}: {light} {coverage}: {blended} {shown}"
                    );
                }
            }
        }
    }

    /// The pixels of a saved picture follow the tone curve, and a missing folder is an error.
    #[test]
    fn saved_picture_has_the_tone_curve_applied() {
        let size = UVec2::new(2, 1);
        let mut film = Film::new(size, Rect::full(size));
        for (x, light) in [[0.5, 0.25, 0.1], [2.0, 0.0, 1.0]].into_iter().enumerate() {
            let pixel = UVec2::new(x as u32, 0);
            let tile = film.tile_at_mut(pixel).unwrap();
            let mut block = tile.block();
            block.add(&FilmSample {
                radiance: Spectrum::from(light),
                ..FilmSample::default()
            });
            tile.change(pixel, &block, SampleChange::Add);
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
