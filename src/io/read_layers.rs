use super::FileError;
use super::exr::TONE;
use super::memory::Allowance;
use super::read_image::ExrFile;
use crate::film::Rect;
use crate::math::UVec2;
use ::exr::prelude::{self as exr, ReadChannels, ReadLayers};
use std::path::Path;

/// Floats that reading takes for each that is there: the decoder's, and the copy that is kept.
const COPIES: u64 = 2;

/// All channels of an EXR file, whichever program wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Size of the full image: the display window.
    pub resolution: UVec2,
    /// Channels with a value for every pixel of their window, in the order of the file.
    pub channels: Vec<LayerChannel>,
    /// How the render showed the picture, `tone=NAME exposure=STOPS`, if the file says so.
    pub tone: Option<String>,
}

/// A channel of an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerChannel {
    /// Name, `layer.component`; of parts after the first one with the part's name before it.
    pub name: String,
    /// How the file holds the values.
    pub kind: SampleKind,
    /// Pixels of the full image that it has.
    pub window: Rect,
    /// Their values, row by row from the top.
    pub values: Vec<f32>,
}

/// How an EXR file holds numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Float,
    /// Whole numbers of 32 bits.
    Whole,
}

impl SampleKind {
    /// Its name in the format's specification.
    pub fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::Whole => "uint",
        }
    }
}

/// Reads all channels of an EXR file that have a value for every pixel, but for the state of a render. Pixels outside of the display window are left out.
///
/// # Errors
///
/// Files that are no EXR files or damaged, deep data, and files that take more memory than there is.
pub fn read_layers(path: &Path) -> Result<Layers, FileError> {
    let failed = |error: &dyn std::fmt::Display| {
        FileError::new(path, format!("cannot read this as an EXR image: {error}"))
            .help("give an .exr file that a renderer wrote, without deep data")
    };
    let ExrFile { meta, reader, failure } = ExrFile::open(path, &failed)?;
    let floats = meta.headers.iter().map(|header| {
        let channels = header.channels.list.len() as u64;
        (header.layer_size.area() as u64).saturating_mul(channels.saturating_mul(COPIES))
    });
    let floats = floats.fold(0, u64::saturating_add);
    Allowance::of_system().check(path, floats.saturating_mul(size_of::<f32>() as u64))?;
    let file = exr::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(reader)
        .map_err(|e| failure.or(path, failed(&e)))?;

    let display = file.attributes.display_window;
    let resolution = UVec2::new(display.size.width() as u32, display.size.height() as u32);
    let tone = file.layer_data.iter().find_map(|layer| {
        let (_, value) = layer.attributes.other.iter().find(|(name, _)| **name == *TONE)?;
        match value {
            exr::AttributeValue::Text(text) => Some(text.to_string()),
            _ => None,
        }
    });
    let mut channels = Vec::new();
    for (i, layer) in file.layer_data.into_iter().enumerate() {
        let part = layer.attributes.layer_name.as_ref().map(ToString::to_string);
        let prefix = part.filter(|name| i > 0 && !name.is_empty()).map(|name| name + ".");
        let prefix = prefix.unwrap_or_default();
        let Some(place) = Place::new(&display, &layer.absolute_bounds()) else {
            continue;
        };
        for channel in layer.channel_data.list {
            // Chroma may have fewer samples than pixels. The state of a render is no picture.
            if channel.name.to_string().starts_with("state.") || channel.sample_data.len() != layer.size.area() {
                continue;
            }
            let kind = match &channel.sample_data {
                exr::FlatSamples::F16(_) => SampleKind::Half,
                exr::FlatSamples::F32(_) => SampleKind::Float,
                exr::FlatSamples::U32(_) => SampleKind::Whole,
            };
            let name = channel.name.to_string();
            let all: Vec<f32> = channel.sample_data.values_as_f32().collect();
            channels.push(LayerChannel {
                name: match name.starts_with(&prefix) {
                    true => name,
                    false => prefix.clone() + &name,
                },
                kind,
                window: place.window,
                values: place.pick(&all),
            });
        }
    }
    if channels.is_empty() {
        let message = "none of its channels has a value for each pixel of its display window";
        return Err(FileError::new(path, message)
            .help("write it again, without subsampling and with pixels in its display window"));
    }
    Ok(Layers {
        resolution,
        channels,
        tone,
    })
}

/// Where the pixels of a part lie in the display window.
struct Place {
    /// Those that are in it, counted from its corner.
    window: Rect,
    /// Of the data window, counted from there.
    left: i64,
    top: i64,
    width: i64,
}

impl Place {
    /// `None` where no pixel of `data` is in `display`.
    fn new(display: &exr::IntegerBounds, data: &exr::IntegerBounds) -> Option<Self> {
        let size = |bounds: &exr::IntegerBounds| (bounds.size.width() as i64, bounds.size.height() as i64);
        let (full, (width, height)) = (size(display), size(data));
        let left = i64::from(data.position.x()) - i64::from(display.position.x());
        let top = i64::from(data.position.y()) - i64::from(display.position.y());
        let point = |x: i64, y: i64| UVec2::new(x.clamp(0, full.0) as u32, y.clamp(0, full.1) as u32);
        let window = Rect {
            min: point(left, top),
            max: point(left + width, top + height),
        };
        (window.area() > 0).then_some(Self {
            window,
            left,
            top,
            width,
        })
    }

    /// The values of the window, of those of the part.
    fn pick(&self, all: &[f32]) -> Vec<f32> {
        let index = |at: UVec2| ((i64::from(at.y) - self.top) * self.width + i64::from(at.x) - self.left) as usize;
        let pixels = self.window.pixels();
        pixels.map(|at| all.get(index(at)).copied().unwrap_or(0.0)).collect()
    }
}
