//! Pictures for textures: PNG, JPEG, TIFF, WebP, GIF, TGA, BMP, DDS, Radiance and EXR files.
//!
//! The size in the header of a file is limited by the file's length (`check_size`). Files on which
//! decoders are known to fail are refused first (`check_tga`, `check_exr`). In a test, six million
//! randomly damaged files ended in errors or pictures, within 16 MB of memory.

use super::FileError;
use super::dds::{self, DdsFile};
use super::exr_file::{ExrFile, decoding_error};
use super::header_limits::check_size;
use super::picture::{Picture, PictureHeader, Samples, damaged};
use crate::files::guarded;
use crate::files::in_words;
use crate::files::input::{Input, ReadFailure};
use crate::files::memory::Allowance;
use ::exr::prelude::{self as exr, ReadChannels, ReadLayers, ReadSpecificChannel};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};
use std::fmt::Display;
use std::io::{self, BufRead};
use std::path::Path;

/// Channels to read from an EXR file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChannelSelection {
    /// Colours or greys, with alpha.
    Colors,
    /// The channel `Z`.
    Depth,
}

/// Maximum memory of a decoder, including the samples, in bytes. It is enough for the largest valid
/// picture with 16 bits per sample and alpha.
const MAX_BYTES: u64 = 1 << 31;
/// Memory in bytes that a decoder may use even if less is free, so that it can read a header.
const MIN_BYTES: u64 = 1 << 24;

/// A picture whose header has been read.
enum OpenPicture {
    Exr(Box<ExrFile>),
    Dds(Box<DdsFile>),
    /// Any other file. The flag is true for a GIF file.
    Other(Box<dyn ImageDecoder>, bool, ReadFailure),
}

/// Reads size and sample format from the header of a picture.
pub(super) fn picture_size(
    path: &Path,
    selection: ChannelSelection,
    allowance: Allowance,
) -> Result<PictureHeader, FileError> {
    Ok(open(path, selection, allowance)?.size(selection))
}

/// Reads a picture of any format of this module. The format is recognised by the first bytes of the
/// file. If they are unknown, the extension of the file name decides. Of a GIF file, the first
/// picture is returned.
pub(super) fn read_picture(
    path: &Path,
    selection: ChannelSelection,
    allowance: Allowance,
) -> Result<Picture, FileError> {
    let opened = open(path, selection, allowance)?;
    allowance.check(path, opened.size(selection).reading_bytes())?;
    let picture = match opened {
        OpenPicture::Exr(file) => read_exr(path, *file, selection)?,
        OpenPicture::Dds(file) => file.picture(path)?,
        OpenPicture::Other(mut decoder, is_gif, failure) => {
            // Damaged metadata has no orientation.
            let orientation = guarded(|| decoder.orientation());
            let orientation = orientation.ok().and_then(Result::ok).map_or(1, |o| o.to_exif());
            let image = decoded(path, || DynamicImage::from_decoder(decoder)).map_err(|e| failure.or(path, e))?;
            let mut picture = unpack(image).ok_or_else(|| damaged(path, &"an unknown layout of pixels"))?;
            // GIF files are decoded with alpha, even without a transparent colour.
            if is_gif {
                picture.drop_opaque_alpha();
            }
            Picture { orientation, ..picture }
        }
    };
    if picture.width == 0 || picture.height == 0 {
        return Err(FileError::new(path, "the picture has no pixels").help("it may be damaged; save it again"));
    }
    Ok(picture)
}

/// Reads the header of a picture, and returns an error if it is invalid.
fn open(path: &Path, selection: ChannelSelection, allowance: Allowance) -> Result<OpenPicture, FileError> {
    let input = Input::open(path, "the picture").map_err(|error| error.help_if_none("check the path"))?;
    let (length, failure) = (input.length(), input.failure());
    let mut reader = input.buffered(path)?;
    let unread = |e: io::Error| FileError::system(path, "cannot read it", &e);
    let start: Vec<u8> = reader.fill_buf().map_err(unread)?.iter().take(18).copied().collect();
    if start.starts_with(dds::MAGIC) && selection == ChannelSelection::Colors {
        let file = DdsFile::read(path, reader, &failure)?;
        let PictureHeader { width, height, .. } = file.header();
        check_size(path, length, width as usize, height as usize)?;
        return Ok(OpenPicture::Dds(Box::new(file)));
    }
    let mut reader = ImageReader::new(reader);
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format);
    }
    let reader = reader.with_guessed_format();
    let mut reader = reader.map_err(unread)?;
    match (reader.format(), selection) {
        (Some(ImageFormat::OpenExr), _) => {
            let file = ExrFile::read(path, reader.into_inner(), (length, failure), &|e| damaged(path, e))?;
            Ok(OpenPicture::Exr(Box::new(file)))
        }
        (_, ChannelSelection::Depth) => {
            let help = "-imfchan z is for .exr files with a channel Z; use -imfchan l or r for other pictures";
            Err(FileError::new(path, "this picture has no depth").help(help))
        }
        (Some(format), ChannelSelection::Colors) if format.reading_enabled() => {
            if format == ImageFormat::Tga {
                check_tga(path, &start)?;
            }
            let left = allowance.limit.map(|limit| limit.bytes.saturating_sub(allowance.kept));
            let max = left.unwrap_or(MAX_BYTES).clamp(MIN_BYTES, MAX_BYTES);
            let mut limits = Limits::no_limits();
            limits.max_alloc = Some(max);
            reader.limits(limits);
            let decoder = decoded(path, || {
                // Some decoders allocate whole rows when they read the header.
                match reader.into_decoder() {
                    Err(ImageError::Limits(_)) => Ok(Err(too_large(path, max, allowance))),
                    decoder => decoder.map(Ok),
                }
            });
            let decoder = decoder.map_err(|e| failure.or(path, e))??;
            let (width, height) = decoder.dimensions();
            check_size(path, length, width as usize, height as usize)?;
            Ok(OpenPicture::Other(
                Box::new(decoder),
                format == ImageFormat::Gif,
                failure,
            ))
        }
        _ => {
            let (message, help) = if start.starts_with(b"8BPS") {
                (
                    "pictures of Photoshop are not read",
                    "save it as PNG, in the painting program or with `magick \"a.psd[0]\" a.png` of ImageMagick",
                )
            } else {
                (
                    "this picture format is not supported",
                    "convert it to PNG, JPEG, TIFF, WebP, GIF, TGA, BMP, DDS, HDR or EXR",
                )
            };
            Err(FileError::new(path, message).help(help))
        }
    }
}

/// Error for a picture that needs more than `max` bytes, the memory that may still be used.
fn too_large(path: &Path, max: u64, allowance: Allowance) -> FileError {
    let left = in_words(max);
    let (message, help) = match allowance.limit.filter(|_| max < MAX_BYTES) {
        Some(limit) => (
            format!("decoding this picture takes more than the {left} that are left of {limit}"),
            "scale the picture down, or allow more memory",
        ),
        None => (
            format!("decoding this picture takes more than {left} of memory, the maximum for one picture"),
            "scale the picture down",
        ),
    };
    FileError::new(path, message).help(help).unreadable()
}

impl OpenPicture {
    fn size(&self, selection: ChannelSelection) -> PictureHeader {
        match self {
            Self::Exr(file) => {
                let size = file
                    .meta
                    .headers
                    .first()
                    .map_or(exr::Vec2(0, 0), |header| header.layer_size);
                PictureHeader {
                    width: size.width() as u64,
                    height: size.height() as u64,
                    channels: if selection == ChannelSelection::Depth { 1 } else { 4 },
                    sample_bytes: size_of::<f32>() as u64,
                }
            }
            Self::Dds(file) => file.header(),
            Self::Other(decoder, ..) => {
                let ((width, height), color) = (decoder.dimensions(), decoder.color_type());
                let channels = u64::from(color.channel_count());
                PictureHeader {
                    width: width.into(),
                    height: height.into(),
                    channels,
                    sample_bytes: u64::from(color.bytes_per_pixel()) / channels,
                }
            }
        }
    }
}

/// Runs a decoder of another crate and converts its errors. Some decoders panic on damaged files
/// (zune-jpeg 0.5.15 on wrong sampling factors). A panic is converted to an error.
fn decoded<T, E: Display>(path: &Path, decode: impl FnOnce() -> Result<T, E>) -> Result<T, FileError> {
    match guarded(decode) {
        Ok(decoded) => decoded.map_err(|e| damaged(path, &e)),
        Err(_) => Err(damaged(path, &"the decoder cannot read it")),
    }
}

fn unpack(image: DynamicImage) -> Option<Picture> {
    let (width, height) = (image.width() as usize, image.height() as usize);
    let channels = image.color().channel_count() as usize;
    let samples = match image {
        DynamicImage::ImageLuma8(image) => Samples::Bytes(image.into_raw()),
        DynamicImage::ImageLumaA8(image) => Samples::Bytes(image.into_raw()),
        DynamicImage::ImageRgb8(image) => Samples::Bytes(image.into_raw()),
        DynamicImage::ImageRgba8(image) => Samples::Bytes(image.into_raw()),
        DynamicImage::ImageLuma16(image) => Samples::Shorts(image.into_raw()),
        DynamicImage::ImageLumaA16(image) => Samples::Shorts(image.into_raw()),
        DynamicImage::ImageRgb16(image) => Samples::Shorts(image.into_raw()),
        DynamicImage::ImageRgba16(image) => Samples::Shorts(image.into_raw()),
        DynamicImage::ImageRgb32F(image) => Samples::Floats(image.into_raw()),
        DynamicImage::ImageRgba32F(image) => Samples::Floats(image.into_raw()),
        _ => return None,
    };
    Some(Picture {
        width,
        height,
        channels,
        samples,
        orientation: 1,
    })
}

/// Encoding exponent in the chunk gAMA of a PNG file, about 1/2.2 for sRGB. `None` for other files,
/// or if the file has a chunk of higher priority (sRGB, iCCP, cICP; PNG 3, §4.3).
pub(super) fn png_gamma(path: &Path) -> Option<f32> {
    let reader = Input::open(path, "the picture").ok()?.buffered(path).ok()?;
    let read = guarded(|| png::Decoder::new(reader).read_info().ok());
    let read = read.ok()??;
    let info = read.info();
    let is_overruled =
        info.srgb.is_some() || info.icc_profile.is_some() || info.coding_independent_code_points.is_some();
    info.gama_chunk
        .filter(|_| !is_overruled)
        .map(|gamma| gamma.into_value())
}

/// Returns an error if the header of a TGA file describes a palette that pixels do not use, and
/// whose colours have another number of bits than the pixels. The image crate (0.25.9) confuses
/// both numbers and panics.
fn check_tga(path: &Path, start: &[u8]) -> Result<(), FileError> {
    let header = <[u8; 18]>::try_from(start).map_err(|_| damaged(path, &"it ends in its header"))?;
    let [_, has_palette, kind, _, _, _, _, palette_bits, .., pixel_bits, _] = header;
    if has_palette == 1 && !matches!(kind, 1 | 9) && palette_bits != pixel_bits {
        let palette = format!("it has a palette of {palette_bits} bits, but pixels of {pixel_bits} bits");
        return Err(damaged(path, &palette));
    }
    Ok(())
}

/// Size, channels and samples of a picture.
struct Channels {
    width: usize,
    height: usize,
    sources: Vec<ExrChannel>,
    samples: Vec<f32>,
}

/// Channels of EXR files that pictures use, in the order in which they are read.
#[derive(Clone, Copy)]
enum ExrChannel {
    Red,
    Green,
    Blue,
    Grey,
    Alpha,
    Depth,
}

/// Reads the first layer of an EXR file: the channels of `selection`. Colours are `R G B`, or else
/// `Y`, with `A` if it exists. Depth is `Z`.
fn read_exr(path: &Path, file: ExrFile, selection: ChannelSelection) -> Result<Picture, FileError> {
    let ExrFile { meta, reader, failure } = file;
    let choose = |size: exr::Vec2<usize>, found: &DescribedChannels| {
        let sources = sources(found, selection);
        Channels {
            width: size.width(),
            height: size.height(),
            samples: vec![0.0; size.area() * sources.len()],
            sources,
        }
    };
    let set = |picture: &mut Channels, at: exr::Vec2<usize>, texel: (f32, f32, f32, f32, f32, f32)| {
        let texel = <[f32; 6]>::from(texel);
        let start = (at.y() * picture.width + at.x()) * picture.sources.len();
        let samples = picture.samples.iter_mut().skip(start);
        for (sample, &source) in samples.zip(&picture.sources) {
            *sample = texel[source as usize];
        }
    };
    let image = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .specific_channels()
        .optional("R", 0.0)
        .optional("G", 0.0)
        .optional("B", 0.0)
        .optional("Y", 0.0)
        .optional("A", 1.0)
        .optional("Z", 0.0)
        .collect_pixels(choose, set)
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_buffered(reader)
        .map_err(|e| failure.or(path, decoding_error(path, &e, &|e| damaged(path, e))))?;
    let Channels {
        width,
        height,
        sources,
        mut samples,
    } = image.layer_data.channel_data.pixels;

    let channels = sources.len();
    if channels == 0 {
        let list = meta.headers.iter().flat_map(|header| &header.channels.list);
        let names: Vec<String> = list.map(|channel| channel.name.to_string()).collect();
        let (message, help) = match selection {
            ChannelSelection::Colors => (
                "has neither R, G and B nor Y",
                "a texture needs R, G and B, or Y, in the first layer",
            ),
            ChannelSelection::Depth => ("has no depth", "-imfchan z needs a channel Z in the first layer"),
        };
        let message = format!("this picture {message}; its channels are {}", names.join(", "));
        return Err(FileError::new(path, message).help(help));
    }
    // Divide colours by alpha, because colours of EXR files are premultiplied ("Technical
    // Introduction to OpenEXR")
    if channels % 2 == 0 {
        for texel in samples.chunks_exact_mut(channels) {
            if let Some((&mut alpha, colors)) = texel.split_last_mut() {
                if alpha > 0.0 && alpha < 1.0 {
                    colors.iter_mut().for_each(|color| *color /= alpha);
                }
            }
        }
    }
    Ok(Picture {
        width,
        height,
        channels,
        samples: Samples::Floats(samples),
        orientation: 1,
    })
}

/// Description of each requested channel that exists.
type DescribedChannels = (
    Option<exr::ChannelDescription>,
    Option<exr::ChannelDescription>,
    Option<exr::ChannelDescription>,
    Option<exr::ChannelDescription>,
    Option<exr::ChannelDescription>,
    Option<exr::ChannelDescription>,
);

/// Channels of the picture. Empty if the requested channels do not exist.
fn sources((r, g, b, y, a, z): &DescribedChannels, selection: ChannelSelection) -> Vec<ExrChannel> {
    let mut sources = match selection {
        ChannelSelection::Depth if z.is_some() => return vec![ExrChannel::Depth],
        ChannelSelection::Colors if r.is_some() && g.is_some() && b.is_some() => {
            vec![ExrChannel::Red, ExrChannel::Green, ExrChannel::Blue]
        }
        ChannelSelection::Colors if y.is_some() => vec![ExrChannel::Grey],
        _ => return Vec::new(),
    };
    if a.is_some() {
        sources.push(ExrChannel::Alpha);
    }
    sources
}
