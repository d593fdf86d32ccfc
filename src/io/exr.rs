//! EXR files: images with their metadata. Names and attributes of channels are in docs/conventions.md.

use super::ascii::ascii;
use super::{State, cryptomatte};
use crate::color::{Exposure, Tone};
use crate::compare::CommonErrors;
use crate::film::{Aov, Image, Rect, metered};
use crate::math::{UVec2, encode_fields};
use crate::options::names::named;
use crate::options::{Value, name_of};
use ::exr::block::{BlockIndex, UncompressedBlock};
use ::exr::image::write::channels::{ChannelsWriter, WritableChannels};
use ::exr::math::RoundingMode;
use ::exr::meta::attribute::{ChannelDescription, ChannelList, LevelMode};
use ::exr::meta::header::Header as ExrHeader;
use ::exr::prelude::{self as exr, WritableImage};
use serde::{Deserialize, Serialize};
use std::io::{self, Seek, Write};

// Names of attributes
const VERSION: &str = "embrasure.version";
const BUILD: &str = "embrasure.build";
const SCENE_HASH: &str = "embrasure.sceneHash";
pub(super) const SETTINGS: &str = "embrasure.settings";
pub(super) const COMMON_ERRORS: &str = "embrasure.commonErrors";
const SAMPLES: &str = "embrasure.samples";
const TOTAL: &str = "embrasure.totalSamples";
const SEED: &str = "embrasure.seed";
const BACKEND: &str = "embrasure.backend";
const BACKEND_VERSION: &str = "embrasure.backendVersion";
const COMPLETE: &str = "embrasure.complete";
const FEATURES: &str = "embrasure.features";
const DENOISER: &str = "embrasure.denoiser";
pub(super) const TONE: &str = "embrasure.tone";
pub(super) const BIAS: &str = "embrasure.bias";
const RENDER_TIME: &str = "renderTime";

/// How an image came to be; written beside its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Name and version of this program.
    pub version: String,
    /// Name of the build of this program: bits are only promised within one. Empty in files that do not tell.
    pub build: String,
    /// Hash of the frozen scene and the camera.
    pub scene_hash: String,
    /// What was rendered: integrator, sampler, depth and the like, as `key=value` pairs.
    pub settings: String,
    /// Which errors pixels have in common; `None` in files of earlier builds.
    pub common_errors: Option<CommonErrors>,
    /// First sample index.
    pub first_sample: u32,
    /// One past the last sample index that was asked for.
    pub end_sample: u32,
    /// Samples of a pixel of the whole picture, of which these may be a part.
    pub total_samples: u32,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Name of the ray-tracing backend.
    pub backend: String,
    /// Its version and instruction set.
    pub backend_version: String,
    /// Wall-clock seconds of rendering.
    pub render_seconds: f64,
    /// Whether all samples were taken.
    pub complete: bool,
    /// What further channels are of, if there are any.
    pub features: Option<FeatureNames>,
    /// What took noise out of the picture, if anything did.
    pub denoiser: Option<String>,
    /// How PNG files show the picture, `tone=NAME exposure=STOPS`, where the exposure was metered; values are as they are.
    pub tone: Option<String>,
    /// The setting that makes the picture's mean another one than that of all light, `key=value`, if there is one.
    pub bias: Option<String>,
}

encode_fields!(Metadata {
    version,
    build,
    scene_hash,
    settings,
    common_errors,
    first_sample,
    end_sample,
    total_samples,
    seed,
    backend,
    backend_version,
    render_seconds,
    complete,
    features,
    denoiser,
    tone,
    bias,
});

/// Channels that were asked for, and the names of what they number.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FeatureNames {
    /// By the names in [`Aov::NAMES`](crate::film::Aov::NAMES).
    pub aovs: Vec<String>,
    /// Objects of the scene, from the first.
    pub objects: Vec<String>,
    /// Materials of the scene, from the first.
    pub materials: Vec<String>,
    /// Groups of lights, where these are told apart.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<String>,
    /// Strategies of a bidirectional method, where these are told apart: `sS_tT`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strategies: Vec<String>,
}

encode_fields!(FeatureNames {
    aovs,
    objects,
    materials,
    lights,
    strategies,
});

impl FeatureNames {
    /// Layers of the parts of the light that a film sums by themselves, in their order.
    pub fn parts(&self) -> Vec<String> {
        let lights = self.lights.iter().map(|name| format!("light_{name}"));
        let of_strategy = |name| [format!("strategy_{name}"), format!("unweighted_{name}")];
        lights.chain(self.strategies.iter().flat_map(of_strategy)).collect()
    }

    /// The channels that were asked for.
    pub fn aovs(&self) -> Vec<Aov> {
        let known = Aov::NAMES
            .iter()
            .filter(|(name, _)| self.aovs.iter().any(|aov| aov == name));
        known.map(|&(_, aov)| aov).collect()
    }
}

impl Metadata {
    /// Name and version of the program, as image files call it.
    pub fn software(&self) -> String {
        format!("embrasure {}", self.version)
    }

    /// Notes the exposure of `image` where `tone` leaves it to be metered.
    pub fn note_exposure(&mut self, tone: Tone, image: &Image) {
        self.tone = (tone.exposure == Exposure::Auto).then(|| metered(tone, image).to_string());
    }

    /// What attributes say that [`Metadata`] wrote; `None` where one is missing or makes no sense.
    pub(super) fn of_attributes(attributes: &exr::LayerAttributes) -> Option<Self> {
        let text = |name: &str| match attributes.other.get(&exr::Text::from(name))? {
            exr::AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        };
        let (first, end) = {
            let range = text(SAMPLES)?;
            let (first, end) = range.split_once("..")?;
            (first.parse().ok()?, end.parse().ok()?)
        };
        let seconds = attributes.other.get(&exr::Text::from(RENDER_TIME))?;
        Some(Self {
            version: text(VERSION)?,
            build: text(BUILD).unwrap_or_default(),
            scene_hash: text(SCENE_HASH)?,
            settings: text(SETTINGS)?,
            common_errors: text(COMMON_ERRORS).and_then(|name| CommonErrors::of_text(&name)),
            first_sample: first,
            end_sample: end,
            total_samples: text(TOTAL)?.parse().ok()?,
            seed: text(SEED)?.parse().ok()?,
            backend: text(BACKEND)?,
            backend_version: text(BACKEND_VERSION)?,
            render_seconds: match seconds {
                exr::AttributeValue::F32(seconds) => *seconds as f64,
                _ => return None,
            },
            complete: text(COMPLETE)? == "yes",
            features: match text(FEATURES) {
                Some(json) => Some(serde_json::from_str(&json).ok()?),
                None => None,
            },
            denoiser: text(DENOISER),
            tone: text(TONE),
            bias: text(BIAS),
        })
    }

    /// What keeps two files from being of one picture, in words: what they say, this one first.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let pairs = [
            ("version", &self.version, &other.version),
            ("build", &self.build, &other.build),
            ("scene hash", &self.scene_hash, &other.scene_hash),
            ("backend", &self.backend, &other.backend),
            ("version of the backend", &self.backend_version, &other.backend_version),
        ];
        let differs = |(name, a, b): (&str, &str, &str)| (a != b).then(|| format!("{name} {a} and {b}"));
        let (seed, other_seed) = (self.seed.to_string(), other.seed.to_string());
        let words = pairs.into_iter().find_map(|(name, a, b)| differs((name, a, b)));
        words
            .or_else(|| differs(("seed", &seed, &other_seed)))
            .or_else(|| setting_that_differs(&self.settings, &other.settings))
    }

    /// Attributes of the EXR header, by name.
    fn attributes(&self) -> Vec<(&'static str, exr::AttributeValue)> {
        let text = |s: &str| exr::AttributeValue::Text(exr_text(s));
        // Names alone: nothing can go wrong.
        let features = self.features.as_ref();
        let features = features.map(|names| serde_json::to_string(names).unwrap_or_default());
        let mut attributes = vec![
            (VERSION, text(&self.version)),
            (BUILD, text(&self.build)),
            (SCENE_HASH, text(&self.scene_hash)),
            (SETTINGS, text(&self.settings)),
            // 64 and 32 unsigned bits do not fit EXR's signed 32-bit attribute, so counts and the seed are text.
            (SAMPLES, text(&format!("{}..{}", self.first_sample, self.end_sample))),
            (TOTAL, text(&self.total_samples.to_string())),
            (SEED, text(&self.seed.to_string())),
            (BACKEND, text(&self.backend)),
            (BACKEND_VERSION, text(&self.backend_version)),
            (COMPLETE, text(if self.complete { "yes" } else { "no" })),
            (RENDER_TIME, exr::AttributeValue::F32(self.render_seconds as f32)),
        ];
        let common = self.common_errors.map(|common| name_of(CommonErrors::NAMES, common));
        attributes.extend(common.map(|name| (COMMON_ERRORS, text(name))));
        attributes.extend(features.map(|names| (FEATURES, text(&names))));
        attributes.extend(self.denoiser.as_ref().map(|denoiser| (DENOISER, text(denoiser))));
        attributes.extend(self.tone.as_ref().map(|tone| (TONE, text(tone))));
        attributes.extend(self.bias.as_ref().map(|bias| (BIAS, text(bias))));
        attributes
    }
}

/// Text of an EXR file. Conversions of the exr crate (1.74) panic over letters beyond Latin-1, and write the others in that encoding.
fn exr_text(text: &str) -> exr::Text {
    ascii(text).as_str().into()
}

/// The first `key=value` pair that is not in both.
fn setting_that_differs(ours: &str, theirs: &str) -> Option<String> {
    let pair = |text: &'_ str, i: usize| text.split(' ').nth(i).unwrap_or("nothing").to_string();
    (ours != theirs).then(|| {
        let count = ours.split(' ').count().max(theirs.split(' ').count());
        let first = (0..count).find(|&i| pair(ours, i) != pair(theirs, i)).unwrap_or(0);
        format!("settings {} and {}", pair(ours, first), pair(theirs, first))
    })
}

/// Linear Rec.709 primaries and white point, the meaning of `R G B`.
const REC_709: exr::attribute::Chromaticities = exr::attribute::Chromaticities {
    red: exr::Vec2(0.64, 0.33),
    green: exr::Vec2(0.30, 0.60),
    blue: exr::Vec2(0.15, 0.06),
    white: exr::Vec2(0.3127, 0.3290),
};

/// How an EXR file holds its channels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ExrFormat {
    /// How they are compressed.
    pub compression: Compression,
    /// Layers that are held as half floats, of [`ExrFormat::HALF_LAYERS`]; the others are float32.
    pub half: Vec<&'static str>,
}

impl ExrFormat {
    /// Layers that may be held as half floats. `picture` is `R G B` and `A`, `lights` are those of all light groups. Not among them are depths and variances,
    /// which leave the range of a half float, and counts, ids and mattes, which leave its whole numbers.
    pub const HALF_LAYERS: &[&str] = &["picture", "raw", "albedo", "N", "P", "uv", "motion", "error", "lights"];

    /// How the channel of this name is held.
    fn kind(&self, channel: &str) -> exr::SampleType {
        let layer = match channel.rsplit_once('.') {
            Some((layer, _)) if layer.starts_with("light_") => "lights",
            Some((layer, _)) => layer,
            None if ["R", "G", "B", "A"].contains(&channel) => "picture",
            None => channel,
        };
        match Self::HALF_LAYERS.contains(&layer) && self.half.contains(&layer) {
            true => exr::SampleType::F16,
            false => exr::SampleType::F32,
        }
    }
}

/// How EXR files are compressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Deflate, 16 rows at a time.
    #[default]
    Zip,
    /// Deflate, row by row.
    Zips,
    /// Wavelets: the smallest files of noisy pictures.
    Piz,
    /// Repeated bytes.
    Rle,
    /// Not at all: the quickest.
    None,
}

// What the exr crate cannot write (DWAA, DWAB) is not there, nor what changes values (PXR24, B44): mattes are numbers of which each bit
// counts.
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

/// A channel as it is written: its values are asked for row by row, so that there is no copy of them all.
pub(super) struct RowChannel<'a> {
    /// Name, `layer.component`.
    pub name: String,
    pub kind: exr::SampleType,
    pub fill: FillRow<'a>,
}

/// Puts the values of a row, counted from the top of the crop, in the machine's byte order.
pub(super) type FillRow<'a> = Box<dyn Fn(usize, &mut [u8]) + Sync + 'a>;

impl<'a> RowChannel<'a> {
    /// Of values that are there, rows of `width`.
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

/// The nearest half float; what is larger than all of them becomes the largest, since not every tool reads infinities.
fn to_half(value: f32) -> exr::f16 {
    let most = exr::f16::MAX.to_f32();
    exr::f16::from_f32(value.clamp(-most, most))
}

/// What a file says of itself besides its pixels.
pub(super) struct Header<'a> {
    /// Size of the full image: the display window.
    pub resolution: UVec2,
    /// The part of it that is in the file: the data window.
    pub crop: Rect,
    /// How the picture came to be, if it is a render.
    pub metadata: Option<&'a Metadata>,
    /// Further attributes, by name.
    pub attributes: Vec<(String, String)>,
    pub compression: exr::Compression,
}

/// Writes the channels of `image`, and `state` beside them.
pub(super) fn write(
    writer: impl Write + Seek,
    image: &Image,
    format: &ExrFormat,
    state: Option<&State>,
    metadata: &Metadata,
) -> io::Result<()> {
    let mut attributes = state.map_or(Vec::new(), |state| state.attributes(metadata));
    let features = metadata.features.as_ref();
    attributes.extend(features.map_or(Vec::new(), cryptomatte::attributes));
    let header = Header {
        resolution: image.resolution,
        crop: image.crop,
        metadata: Some(metadata),
        attributes,
        compression: format.compression.code(),
    };
    let mut channels = rows_of(image, format);
    channels.extend(state.map_or(Vec::new(), State::channels));
    write_rows(writer, header, channels)
}

/// The channels of `image`.
pub(super) fn rows_of<'a>(image: &'a Image, format: &ExrFormat) -> Vec<RowChannel<'a>> {
    let width = image.crop.size().x as usize;
    let channels = image.channels.iter();
    let channels = channels.map(|c| RowChannel::of_values(&c.name, &c.values, width, format.kind(&c.name)));
    channels.collect()
}

/// Writes `channels`, in the order of their names as the format wants it.
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
        software_name: Some(exr_text(&format!("embrasure {}", env!("CARGO_PKG_VERSION")))),
        ..Default::default()
    };
    let own = metadata.map_or(Vec::new(), Metadata::attributes).into_iter();
    let own = own.map(|(name, value)| (name.to_string(), value));
    let further = header.attributes.into_iter();
    let further = further.map(|(name, text)| (name, exr::AttributeValue::Text(exr_text(&text))));
    attributes
        .other
        .extend(own.chain(further).map(|(name, value)| (exr_text(&name), value)));
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

/// Channels in the order of their names.
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
    fn half_floats_are_finite_and_as_near_as_can_be() {
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
    fn layers_are_known_by_their_channels() {
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
