use crate::film::Image;
use ::exr::prelude::{self as exr, WritableImage};
use std::io::{self, Seek, Write};

/// How an image came to be; written beside its pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Metadata {
    /// Name and version of this program.
    pub version: String,
    /// Hash of the frozen scene and the camera.
    pub scene_hash: String,
    /// What was rendered: integrator, sampler, depth and the like, as `key=value` pairs.
    pub settings: String,
    /// First sample index.
    pub first_sample: u32,
    /// One past the last sample index that was asked for.
    pub end_sample: u32,
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
}

impl Metadata {
    /// Name and version of the program, as image files call it.
    pub fn software(&self) -> String {
        format!("embrasure {}", self.version)
    }

    /// Attributes of the EXR header, by name.
    fn attributes(&self) -> Vec<(&'static str, exr::AttributeValue)> {
        let text = |s: &str| exr::AttributeValue::Text(s.into());
        vec![
            ("embrasure.version", text(&self.version)),
            ("embrasure.sceneHash", text(&self.scene_hash)),
            ("embrasure.settings", text(&self.settings)),
            // 64 and 32 unsigned bits do not fit EXR's signed 32-bit attribute, so counts and the seed are text.
            (
                "embrasure.samples",
                text(&format!("{}..{}", self.first_sample, self.end_sample)),
            ),
            ("embrasure.seed", text(&self.seed.to_string())),
            ("embrasure.backend", text(&self.backend)),
            ("embrasure.backendVersion", text(&self.backend_version)),
            ("embrasure.complete", text(if self.complete { "yes" } else { "no" })),
            ("renderTime", exr::AttributeValue::F32(self.render_seconds as f32)),
        ]
    }
}

/// Linear Rec.709 primaries and white point, the meaning of `R G B`.
const REC_709: exr::attribute::Chromaticities = exr::attribute::Chromaticities {
    red: exr::Vec2(0.64, 0.33),
    green: exr::Vec2(0.30, 0.60),
    blue: exr::Vec2(0.15, 0.06),
    white: exr::Vec2(0.3127, 0.3290),
};

/// Writes all channels as float32, losslessly compressed; the display window is the full image, the data window the crop.
pub(super) fn write(writer: impl Write + Seek, image: &Image, metadata: &Metadata) -> io::Result<()> {
    let channels: exr::SmallVec<[exr::AnyChannel<exr::FlatSamples>; 4]> = image
        .channels
        .iter()
        .map(|c| exr::AnyChannel::new(c.name, exr::FlatSamples::F32(c.values.clone())))
        .collect();

    let size = image.crop.size();
    let mut attributes = exr::LayerAttributes {
        layer_position: exr::Vec2(image.crop.min.x as i32, image.crop.min.y as i32),
        software_name: Some(metadata.software().as_str().into()),
        ..Default::default()
    };
    attributes.other.extend(
        metadata
            .attributes()
            .into_iter()
            .map(|(name, value)| (name.into(), value)),
    );
    let layer = exr::Layer::new(
        (size.x as usize, size.y as usize),
        attributes,
        exr::Encoding {
            compression: exr::Compression::ZIP16,
            blocks: exr::Blocks::ScanLines,
            line_order: exr::LineOrder::Increasing,
        },
        exr::AnyChannels::sort(channels),
    );
    let mut file = exr::Image::from_layer(layer);
    let resolution = (image.resolution.x as usize, image.resolution.y as usize);
    file.attributes.display_window = exr::IntegerBounds::from_dimensions(resolution);
    file.attributes.chromaticities = Some(REC_709);

    file.write().to_buffered(writer).map_err(|error| match error {
        exr::Error::Io(error) => error,
        other => io::Error::other(other),
    })
}
