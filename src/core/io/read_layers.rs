use super::exr_file::{DataWindow, ExrFile, resolution};
use super::exr_text::text_attribute;
use super::mattes::{self, Mattes};
use super::metadata::{DENOISER, FEATURES, FINISH, SETTINGS, TONE};
use super::{FeatureNames, FileError, Metadata};
use crate::camera::CameraAttributes;
use crate::files::memory::Allowance;
use crate::film::{Backing, Image, Rect};
use crate::math::UVec2;
use crate::options::{Finish, backing_of, view_size_of};
use ::exr::prelude as exr;
use std::path::Path;

/// Number of floats in memory for each float of the file: one in the decoder, and one in
/// [`Layers`].
const COPIES: u64 = 2;

/// All channels of an EXR file from any program.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Size of the full image (display window).
    pub resolution: UVec2,
    /// Size of one view of the picture, such as a face of a cube map. The size of the image if
    /// there is only one view.
    pub view: UVec2,
    /// Channels with a value for every pixel of their window, in the order of the file.
    pub channels: Vec<LayerChannel>,
    /// Settings of the render for display: denoiser, exposure and tone curve. If the file has the
    /// result of an automatic exposure, the exposure is this result. The denoiser is set only if it
    /// has not been applied to the picture yet.
    pub finish: Finish,
    /// Background of pictures for display: transparent, or a colour that is shown unchanged. `None`
    /// for other backgrounds.
    pub backing: Option<Backing>,
    /// The camera; `None` in files without its attributes.
    pub camera: Option<CameraAttributes>,
    /// Layers of mattes by name (Cryptomatte).
    pub mattes: Vec<Mattes>,
    /// Names of objects, parts and materials; `None` in files without them.
    pub names: Option<FeatureNames>,
}

impl Layers {
    /// Layers of `image`, which was computed from the sums of a checkpoint.
    pub fn of_image(image: Image, metadata: &Metadata) -> Self {
        let channels = image.channels.into_iter().map(|channel| LayerChannel {
            name: channel.name.into(),
            kind: SampleKind::Float,
            window: image.crop,
            values: channel.values,
        });
        Self {
            resolution: image.resolution,
            view: image.view,
            channels: channels.collect(),
            finish: metadata.finish(),
            backing: image.backing,
            camera: metadata.camera,
            mattes: mattes::of_names(metadata.features.as_ref()),
            names: metadata.features.clone(),
        }
    }
}

/// A channel of an EXR file.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerChannel {
    /// Name, `layer.component`. In parts of the file after the first part, the name begins with the
    /// name of the part.
    pub name: String,
    /// Type of the values in the file.
    pub kind: SampleKind,
    /// Pixels of the full image that the channel covers.
    pub window: Rect,
    /// Values of the pixels of `window`, row by row from the top.
    pub values: Vec<f32>,
}

/// Number types of EXR files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampleKind {
    /// 16-bit floats.
    Half,
    /// 32-bit floats.
    Float,
    /// 32-bit unsigned integers.
    Whole,
}

impl SampleKind {
    /// Name of the type in the specification of EXR.
    pub fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
            Self::Whole => "uint",
        }
    }
}

/// Reads all channels of an EXR file that have a value for every pixel, except the state of a
/// render. Pixels outside of the display window are left out.
///
/// # Errors
///
/// The file is not an EXR file or is damaged, has deep data, or needs more memory than is
/// available.
pub fn read_layers(path: &Path) -> Result<Layers, FileError> {
    let failed = |error: &dyn std::fmt::Display| {
        FileError::new(path, format!("cannot read this as an EXR image: {error}"))
            .help("give an .exr file that a renderer wrote, without deep data")
    };
    let file = ExrFile::open(path, &failed)?;
    let floats = file.meta.headers.iter().map(|header| {
        let channels = header.channels.list.len() as u64;
        (header.layer_size.area() as u64).saturating_mul(channels.saturating_mul(COPIES))
    });
    let floats = floats.fold(0, u64::saturating_add);
    Allowance::of_system().check(path, floats.saturating_mul(size_of::<f32>() as u64))?;
    let file = file.layers(path, &failed)?;

    let display = file.attributes.display_window;
    let text = |name| {
        let mut layers = file.layer_data.iter();
        layers.find_map(|layer| text_attribute(&layer.attributes, name))
    };
    let asked = text(FINISH).map(|text| Finish::of_text(&text)).unwrap_or_default();
    let finish = Finish {
        tone: text(TONE).map_or(asked.tone, |text| Finish::of_text(&text).tone),
        denoiser: asked.denoiser.filter(|_| text(DENOISER).is_none()),
        ..asked
    };
    let settings = text(SETTINGS);
    let names = text(FEATURES).and_then(|json| serde_json::from_str(&json).ok());
    let mut layers = file.layer_data.iter();
    let camera = layers.find_map(|layer| CameraAttributes::of_attributes(&layer.attributes));
    let mattes = mattes::of_file(path, &file);
    let mut channels = Vec::new();
    for (i, layer) in file.layer_data.into_iter().enumerate() {
        let part = layer.attributes.layer_name.as_ref().map(ToString::to_string);
        let prefix = part.filter(|name| i > 0 && !name.is_empty()).map(|name| name + ".");
        let prefix = prefix.unwrap_or_default();
        let Some(place) = DataWindow::new(&display, &layer.absolute_bounds()) else {
            continue;
        };
        for channel in layer.channel_data.list {
            // Skip chroma, which may have fewer samples than pixels, and the state of a render.
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
                name: if name.starts_with(&prefix) {
                    name
                } else {
                    prefix.clone() + &name
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
            .help("export the file again, without subsampled channels and with pixels inside its display window"));
    }
    let backing = if channels.iter().any(|c| c.name == Backing::Transparent.channels()[0]) {
        Some(Backing::Transparent)
    } else {
        settings.as_ref().and_then(|settings| backing_of(settings))
    };
    let resolution = resolution(&display);
    let view = settings.map_or(resolution, |settings| view_size_of(&settings, resolution));
    Ok(Layers {
        resolution,
        view,
        channels,
        finish,
        backing,
        camera,
        mattes,
        names,
    })
}
