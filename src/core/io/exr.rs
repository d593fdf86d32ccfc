//! Writing EXR files: images with their metadata. Names of channels are in
//! docs/guide/reference/output.md.

use super::ascii::ascii;
use super::exr_text::exr_text;
use super::{Metadata, png};
use crate::camera::CameraAttributes;
use crate::film::{Image, Rect};
use crate::math::UVec2;
use crate::parameter::named;
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::image::write::channels::{ChannelsWriter, WritableChannels};
use ::exr::math::RoundingMode;
use ::exr::meta::attribute::{ChannelDescription, ChannelList, LevelMode};
use ::exr::meta::header::Header as ExrHeader;
use ::exr::prelude::{self as exr, WritableImage};
use std::io::{self, Seek, Write};

/// Primaries and white point of Rec.709. The channels `R G B` are linear Rec.709.
const REC_709: exr::attribute::Chromaticities = exr::attribute::Chromaticities {
    red: exr::Vec2(0.64, 0.33),
    green: exr::Vec2(0.30, 0.60),
    blue: exr::Vec2(0.15, 0.06),
    white: exr::Vec2(0.3127, 0.3290),
};

/// Format of the channels of an EXR file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct ExrFormat {
    /// Compression of the channels. All kinds are lossless.
    pub compression: Compression,
    /// Layers that are stored as half floats, from [`ExrFormat::HALF_LAYERS`]. Other layers are
    /// float32.
    pub half: Vec<&'static str>,
}

impl ExrFormat {
    /// Layers that may be stored as half floats. `picture` means the channels `R G B` and `A`, and
    /// `lights` means the layers of all light groups. Depths and variances are excluded because
    /// they exceed the range of a half float. Counts, ids and mattes are excluded because a half
    /// float does not represent them exactly.
    pub const HALF_LAYERS: &[&str] = &["picture", "raw", "albedo", "N", "P", "uv", "motion", "error", "lights"];

    /// Sample type of a channel.
    fn kind(&self, channel: &str) -> exr::SampleType {
        let layer = match channel.rsplit_once('.') {
            Some((layer, _)) if layer.starts_with("light_") => "lights",
            Some((layer, _)) => layer,
            None if ["R", "G", "B", "A"].contains(&channel) => "picture",
            None => channel,
        };
        if Self::HALF_LAYERS.contains(&layer) && self.half.contains(&layer) {
            exr::SampleType::F16
        } else {
            exr::SampleType::F32
        }
    }
}

/// Compression of EXR files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Compression {
    /// Deflate, 16 rows at a time.
    #[default]
    Zip,
    /// Deflate, row by row.
    Zips,
    /// Wavelet compression: the smallest files for noisy pictures.
    Piz,
    /// Run-length encoding of repeated bytes.
    Rle,
    /// No compression: the fastest.
    None,
}

// DWAA and DWAB are missing because the exr crate cannot write them. PXR24 and B44 are missing
// because they are lossy, and the ids of mattes must be exact.
named! {
    Compression: "zip" => Self::Zip, "zips" => Self::Zips, "piz" => Self::Piz, "rle" => Self::Rle, "none" => Self::None;
}

impl Compression {
    pub(super) fn code(self) -> exr::Compression {
        match self {
            Self::Zip => exr::Compression::ZIP16,
            Self::Zips => exr::Compression::ZIP1,
            Self::Piz => exr::Compression::PIZ,
            Self::Rle => exr::Compression::RLE,
            Self::None => exr::Compression::Uncompressed,
        }
    }
}

/// A channel to write. The writer requests its values row by row, so that no copy of all values is
/// needed.
pub(super) struct RowChannel<'a> {
    /// Name, `layer.component`.
    pub name: String,
    pub kind: exr::SampleType,
    pub fill: FillRow<'a>,
}

/// Function that writes the values of a row to the buffer, in the machine's byte order. Rows count
/// from the top of the crop.
pub(super) type FillRow<'a> = Box<dyn Fn(usize, &mut [u8]) + Sync + 'a>;

impl<'a> RowChannel<'a> {
    /// Channel with `values`, stored row by row, `width` values per row.
    fn of_values(name: &str, values: &'a [f32], width: usize, kind: exr::SampleType) -> Self {
        let fill: FillRow = match kind {
            exr::SampleType::F16 => Box::new(move |row, bytes| {
                for (bytes, &value) in bytes.chunks_exact_mut(2).zip(values.iter().skip(row * width)) {
                    bytes.copy_from_slice(&to_half(value).to_ne_bytes());
                }
            }),
            _ => Box::new(move |row, bytes| {
                for (bytes, value) in bytes.chunks_exact_mut(4).zip(values.iter().skip(row * width)) {
                    bytes.copy_from_slice(&value.to_ne_bytes());
                }
            }),
        };
        Self {
            name: name.into(),
            kind,
            fill,
        }
    }
}

/// Nearest finite half float. Larger values become the largest half float, because not all programs
/// can read infinity.
fn to_half(value: f32) -> exr::f16 {
    let max = exr::f16::MAX.to_f32();
    exr::f16::from_f32(value.clamp(-max, max))
}

/// Header of an EXR file.
pub(super) struct Header<'a> {
    /// Size of the full image (display window).
    pub resolution: UVec2,
    /// Part of the image that the file holds (data window).
    pub crop: Rect,
    /// Metadata of the picture, if it is a render.
    pub metadata: Option<&'a Metadata>,
    /// Camera of a picture that is not a render.
    pub camera: Option<CameraAttributes>,
    /// Additional attributes, by name.
    pub attributes: Vec<(String, String)>,
    pub compression: exr::Compression,
}

/// Channels of `image`.
pub(super) fn rows_of<'a>(image: &'a Image, format: &ExrFormat) -> Vec<RowChannel<'a>> {
    let width = image.crop.size().x as usize;
    let channels = image.channels.iter();
    let channels = channels.map(|c| RowChannel::of_values(&c.name, &c.values, width, format.kind(&c.name)));
    channels.collect()
}

/// Writes `channels`, sorted by name as the format requires.
pub(super) fn write_rows(writer: impl Write + Seek, header: Header, mut channels: Vec<RowChannel>) -> io::Result<()> {
    for channel in &mut channels {
        channel.name = ascii(&channel.name);
    }
    channels.sort_by(|a, b| a.name.cmp(&b.name));
    let Header {
        resolution,
        crop,
        metadata,
        ..
    } = header;
    let mut attributes = exr::LayerAttributes {
        layer_position: exr::Vec2(crop.min.x as i32, crop.min.y as i32),
        software_name: Some(exr_text(&png::software())),
        ..Default::default()
    };
    let own = metadata.map_or(Vec::new(), Metadata::attributes).into_iter();
    let own = own.map(|(name, value)| (name.to_string(), value));
    let further = header.attributes.into_iter();
    let further = further.map(|(name, text)| (name, exr::AttributeValue::Text(exr_text(&text))));
    attributes
        .other
        .extend(own.chain(further).map(|(name, value)| (exr_text(&name), value)));
    attributes.horizontal_density = metadata.and_then(|metadata| metadata.print).map(|print| print.dpi);
    if let Some(camera) = metadata.and_then(|metadata| metadata.camera).or(header.camera) {
        camera.write_to(&mut attributes);
    }
    let layer = exr::Layer::new(
        (crop.size().x as usize, crop.size().y as usize),
        attributes,
        exr::Encoding {
            compression: header.compression,
            blocks: exr::Blocks::ScanLines,
            line_order: exr::LineOrder::Increasing,
        },
        Rows(channels),
    );
    let mut file = exr::Image::from_layer(layer);
    let resolution = (resolution.x as usize, resolution.y as usize);
    file.attributes.display_window = exr::IntegerBounds::from_dimensions(resolution);
    file.attributes.chromaticities = Some(REC_709);

    file.write().to_buffered(writer).map_err(|error| match error {
        exr::Error::Io(error) => error,
        other => io::Error::other(other),
    })
}

/// Channels sorted by name.
struct Rows<'a>(Vec<RowChannel<'a>>);

impl<'s, 'a: 's> WritableChannels<'s> for Rows<'a> {
    type Writer = &'s Self;

    fn infer_channel_list(&self) -> ChannelList {
        let description = |channel: &RowChannel| ChannelDescription {
            name: channel.name.as_str().into(),
            sample_type: channel.kind,
            quantize_linearly: false,
            sampling: exr::Vec2(1, 1),
        };
        ChannelList::new(self.0.iter().map(description).collect())
    }

    fn infer_level_modes(&self) -> (LevelMode, RoundingMode) {
        (LevelMode::Singular, RoundingMode::Down)
    }

    fn create_writer(&'s self, _: &ExrHeader) -> Self::Writer {
        self
    }
}

impl ChannelsWriter for &Rows<'_> {
    fn extract_uncompressed_block(&self, header: &ExrHeader, block: BlockIndex) -> Vec<u8> {
        UncompressedBlock::collect_block_data_from_lines(&header.channels, block, |line| {
            let at = line.location;
            (self.0[at.channel].fill)(at.position.y(), line.value);
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_floats_are_finite_and_nearest() {
        for (value, expected) in [
            (0.1, 0.099_975_586),
            (1.0, 1.0),
            (-7e4, -65504.0),
            (1e30, 65504.0),
            (1e-9, 0.0),
        ] {
            assert_eq!(to_half(value).to_f32(), expected, "{value}");
        }
    }

    #[test]
    fn sample_type_follows_from_layer_of_channel() {
        let format = ExrFormat {
            half: vec!["picture", "N", "lights"],
            ..ExrFormat::default()
        };
        let is_half = |channel| format.kind(channel) == exr::SampleType::F16;
        assert!(["R", "A", "N.X", "light_key.G"].into_iter().all(is_half));
        assert!(
            !["Z", "raw.R", "samples", "id.object", "CryptoObject00.R"]
                .into_iter()
                .any(is_half)
        );
    }
}
