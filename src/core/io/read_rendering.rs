use super::FileError;
use super::exr_file::{DataWindow, ExrFile, resolution};
use super::exr_text::text_attribute;
use super::metadata::{BIAS, COMMON_ERRORS, SETTINGS};
use super::picture::{Picture, Samples};
use super::read_picture::{ChannelSelection, read_picture};
use crate::color::srgb;
use crate::compare::{CommonErrors, Noise};
use crate::files::memory::Allowance;
use crate::film::{Image, Rect, RgbImage};
use crate::math::UVec2;
use crate::options::Value;
use ::exr::meta::header::Header;
use ::exr::prelude as exr;
use std::path::Path;

/// Floats per pixel of a [`Rendering`] while it is read, including temporary copies.
const FLOATS_MADE: u64 = 20;

/// Channels of the picture before the denoiser.
const RAW: [&str; 3] = ["raw.R", "raw.G", "raw.B"];

/// A picture from a file, with its position in the full image and an estimate of its noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// Size of the full image.
    pub resolution: UVec2,
    /// Part of the full image that the file holds.
    pub window: Rect,
    /// Colours of the pixels of `window`, linear Rec.709.
    pub image: RgbImage,
    /// Colours before the denoiser; `None` if the picture is not denoised.
    pub raw: Option<RgbImage>,
    /// Noise of the values before the denoiser; `None` if the file does not have variances.
    pub noise: Option<Noise>,
    /// True if the file holds values for a display from 0 to 1. They have been decoded to linear
    /// light by the sRGB curve.
    pub is_display: bool,
    /// Setting that biases the mean of the picture, as the file states. `None` if the file names no
    /// such setting.
    pub bias: Option<String>,
}

impl Rendering {
    /// Converts a rendered image to the picture that would be read from its file. `common` is the
    /// kind of sampling error that several pixels have in common.
    pub fn of_image(image: &Image, common: CommonErrors) -> Self {
        let values = |name| image.channel(name).map(|channel| channel.values.as_slice());
        let variance = ["variance.R", "variance.G", "variance.B"].map(values);
        let noise = match (variance, values("samples")) {
            ([Some(r), Some(g), Some(b)], Some(samples)) => Some(Noise {
                variance: r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect(),
                samples: samples.to_vec(),
                common,
            }),
            _ => None,
        };
        Self {
            resolution: image.resolution,
            window: image.crop,
            image: image.into(),
            raw: match RAW.map(values) {
                [Some(r), Some(g), Some(b)] => Some(RgbImage {
                    width: image.crop.size().x as usize,
                    height: image.crop.size().y as usize,
                    pixels: r.iter().zip(g).zip(b).map(|((r, g), b)| [*r, *g, *b]).collect(),
                }),
                _ => None,
            },
            noise,
            is_display: false,
            bias: None,
        }
    }

    /// Part of the picture in `window`, which must be inside the picture.
    pub fn cropped(&self, window: Rect) -> Self {
        let width = self.window.size().x as usize;
        let kept = |i: usize| self.window.min + UVec2::new((i % width) as u32, (i / width) as u32);
        fn pick<T: Copy>(values: &[T], is_kept: impl Fn(usize) -> bool) -> Vec<T> {
            let values = values.iter().enumerate();
            values.filter(|(i, _)| is_kept(*i)).map(|(_, v)| *v).collect()
        }
        let is_kept = |i: usize| window.contains(kept(i));
        let window = window.intersection(self.window);
        let size = window.size();
        let picture = |whole: &RgbImage| RgbImage {
            width: size.x as usize,
            height: size.y as usize,
            pixels: pick(&whole.pixels, is_kept),
        };
        Self {
            resolution: self.resolution,
            window,
            image: picture(&self.image),
            raw: self.raw.as_ref().map(picture),
            noise: self.noise.as_ref().map(|noise| Noise {
                variance: pick(&noise.variance, is_kept),
                samples: pick(&noise.samples, is_kept),
                common: noise.common,
            }),
            is_display: self.is_display,
            bias: self.bias.clone(),
        }
    }
}

/// Reads a picture from a file of any supported format. From an EXR file, reads `R G B` or `Y` of
/// the first part that has these channels. Alpha is ignored.
pub fn read_rendering(path: &Path) -> Result<Rendering, FileError> {
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
        read_exr(path)
    } else {
        Ok(of_picture(read_picture(
            path,
            ChannelSelection::Colors,
            Allowance::of_system(),
        )?))
    }
}

fn of_picture(picture: Picture) -> Rendering {
    let is_display = !matches!(picture.samples, Samples::Floats(_));
    let values: Vec<f32> = match picture.samples {
        Samples::Bytes(codes) => codes.iter().map(|&v| srgb::decode(v as f32 / 255.0)).collect(),
        Samples::Shorts(codes) => codes.iter().map(|&v| srgb::decode(v as f32 / 65535.0)).collect(),
        Samples::Floats(values) => values,
    };
    let pixels = values.chunks_exact(picture.channels.max(1)).map(|texel| match *texel {
        [r, g, b] | [r, g, b, _] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0.0; 3],
    });
    let resolution = UVec2::new(picture.width as u32, picture.height as u32);
    Rendering {
        resolution,
        window: Rect::full(resolution),
        image: RgbImage {
            width: picture.width,
            height: picture.height,
            pixels: pixels.collect(),
        },
        raw: None,
        noise: None,
        is_display,
        bias: None,
    }
}

fn read_exr(path: &Path) -> Result<Rendering, FileError> {
    let failed = |error: &dyn std::fmt::Display| {
        FileError::new(path, format!("cannot read this as an EXR image: {error}"))
            .help("give an .exr file that a renderer wrote")
    };
    let file = ExrFile::open(path, &failed)?;
    let samples = |header: &Header| header.layer_size.area() as u64 * (header.channels.list.len() as u64 + FLOATS_MADE);
    let floats: u64 = file.meta.headers.iter().map(samples).sum();
    Allowance::of_system().check(path, floats * size_of::<f32>() as u64)?;
    let file = file.layers(path, &failed)?;
    let display = file.attributes.display_window;
    let found = file.layer_data.iter().find_map(|layer| Some((layer, colors(layer)?)));
    let Some((layer, colors)) = found else {
        let channels = file.layer_data.iter().flat_map(|layer| &layer.channel_data.list);
        let names: Vec<String> = channels.map(|channel| channel.name.to_string()).collect();
        let message = format!(
            "has neither R, G and B nor Y of every pixel; its channels are {}",
            names.join(", ")
        );
        return Err(FileError::new(path, message).help("name the channels of the picture R, G and B"));
    };

    let Some(place) = DataWindow::new(&display, &layer.absolute_bounds()) else {
        let message = "none of its pixels lies in its display window";
        return Err(
            FileError::new(path, message).help("save the picture with a display window that overlaps its data window")
        );
    };
    let rgb = |channels: &[Vec<f32>; 3]| -> Vec<[f32; 3]> {
        let value = |c: usize, i: usize| channels[c].get(i).copied().unwrap_or(0.0);
        place.indices().map(|i| [0, 1, 2].map(|c| value(c, i))).collect()
    };

    let window = place.window;
    let noise = channels(layer, ["variance.R", "variance.G", "variance.B"]).map(|variance| Noise {
        variance: rgb(&variance),
        samples: match channel(layer, "samples") {
            Some(samples) => place.pick(&samples),
            // If the file has no channel of sample counts, use infinite counts, so that variances
            // are treated as exact.
            None => vec![f32::INFINITY; window.area() as usize],
        },
        common: common_errors(&layer.attributes),
    });
    let picture = |channels: &[Vec<f32>; 3]| RgbImage {
        width: window.size().x as usize,
        height: window.size().y as usize,
        pixels: rgb(channels),
    };
    Ok(Rendering {
        resolution: resolution(&display),
        window,
        image: picture(&colors),
        raw: channels(layer, RAW).as_ref().map(picture),
        noise,
        is_display: false,
        bias: text_attribute(&layer.attributes, BIAS),
    })
}

type Layer = exr::Layer<exr::AnyChannels<exr::FlatSamples>>;

/// Values of the channel `name`, if the layer has one value for every pixel.
fn channel(layer: &Layer, name: &str) -> Option<Vec<f32>> {
    let channel = layer.channel_data.list.iter().find(|c| c.name.eq(name))?;
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    (values.len() == layer.size.area()).then_some(values)
}

fn channels(layer: &Layer, [a, b, c]: [&str; 3]) -> Option<[Vec<f32>; 3]> {
    Some([channel(layer, a)?, channel(layer, b)?, channel(layer, c)?])
}

fn colors(layer: &Layer) -> Option<[Vec<f32>; 3]> {
    channels(layer, ["R", "G", "B"]).or_else(|| {
        let grey = channel(layer, "Y")?;
        Some([grey.clone(), grey.clone(), grey])
    })
}

/// Kind of sampling error that several pixels have in common, from the attribute [`COMMON_ERRORS`].
/// Without the attribute, a file of an earlier build of this program gets `Picture` (any errors),
/// and a file of another program gets `Tile`.
fn common_errors(attributes: &exr::LayerAttributes) -> CommonErrors {
    let is_there = |name: &str| attributes.other.contains_key(&exr::Text::from(name));
    match text_attribute(attributes, COMMON_ERRORS) {
        Some(text) => CommonErrors::of_text(&text).unwrap_or(CommonErrors::Picture),
        None if is_there(COMMON_ERRORS) || is_there(SETTINGS) => CommonErrors::Picture,
        None => CommonErrors::Tile,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ::exr::prelude::WritableImage;

    /// A grey picture of 6 × 5 pixels at `corner` of a display window of 8 × 8. The value of a
    /// pixel is the column plus ten times the row.
    fn write(path: &Path, corner: (i32, i32)) {
        let values = (0..30).map(|i| (i % 6 + 10 * (i / 6)) as f32).collect();
        let list = [exr::AnyChannel::new("Y", exr::FlatSamples::F32(values))];
        let attributes = exr::LayerAttributes {
            layer_position: exr::Vec2(corner.0, corner.1),
            ..Default::default()
        };
        let channels = exr::AnyChannels::sort(list.into_iter().collect());
        let layer = exr::Layer::new((6, 5), attributes, exr::Encoding::UNCOMPRESSED, channels);
        let mut file = exr::Image::from_layer(layer);
        file.attributes.display_window = exr::IntegerBounds::from_dimensions((8, 8));
        file.write().to_file(path).unwrap();
    }

    #[test]
    fn pixels_are_at_the_position_of_the_data_window() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        for (corner, min, max) in [((1, 2), (1, 2), (7, 7)), ((-2, 5), (0, 5), (4, 8))] {
            write(&path, corner);
            let read = read_rendering(&path).unwrap();
            let window = Rect {
                min: UVec2::from(min),
                max: UVec2::from(max),
            };
            assert_eq!((read.resolution, read.window), (UVec2::new(8, 8), window));
            assert!(read.noise.is_none() && !read.is_display);
            for (at, pixel) in window.pixels().zip(&read.image.pixels) {
                let value = (at.x as i32 - corner.0) + 10 * (at.y as i32 - corner.1);
                assert_eq!(*pixel, [value as f32; 3], "{at}");
            }
            let one = Rect {
                min: UVec2::new(2, 6),
                max: UVec2::new(3, 7),
            };
            let value = (2 - corner.0 + 10 * (6 - corner.1)) as f32;
            assert_eq!(read.cropped(one).image.pixels, [[value; 3]]);
        }
        write(&path, (8, 0));
        assert!(read_rendering(&path).unwrap_err().message.contains("display window"));
    }

    /// Overwrites the numbers in the file one by one. No overwritten number may cause a panic.
    #[test]
    fn damaged_files_are_errors() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        write(&path, (1, 2));
        let sound = std::fs::read(&path).unwrap();
        let mut refused = 0;
        for at in 0..sound.len() - 4 {
            for value in [0, 1, -1, i32::MAX, i32::MIN, 1 << 20, -(1 << 30)] {
                let mut bytes = sound.clone();
                bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
                std::fs::write(&path, bytes).unwrap();
                refused += usize::from(read_rendering(&path).is_err());
            }
        }
        assert!(refused > 100, "{refused}");
    }
}
