//! Films: developed images with all their channels and metadata.

use crate::errors;
use crate::job::pooled;
use crate::scene::Rows;
use embrasure::camera::CameraAttributes;
use embrasure::color::Tone;
use embrasure::compare::CommonErrors;
use embrasure::denoise::Denoiser;
use embrasure::film::{Channel, Rect, RgbImage, metered};
use embrasure::io::{DevelopedPicture, Rendering, display_bytes, png_bytes, read_layers, read_rendering};
use embrasure::math::UVec2;
use embrasure::options::{Denoising, OptionGroup, ToneOptions, Value};
use embrasure::{Error, ExrFormat, FileError, Format, Image, Metadata, Output, RenderState};
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2};
use pyo3::exceptions::{PyKeyError, PyValueError};
use pyo3::prelude::*;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// A developed image, and the render or file from which it comes.
pub struct Developed {
    pub image: Image,
    /// Tone curve and exposure of the render.
    pub tone: Tone,
    pub exr: ExrFormat,
    pub seconds: f64,
    pub warnings: Vec<String>,
    pub source: Source,
    /// Sums of samples, if the render is a part of a picture.
    pub sums: Option<RenderState>,
}

impl Developed {
    /// Makes a developed image from an image that was read from a file.
    fn of_file(image: Image, picture: Option<Rendering>, camera: Option<CameraAttributes>) -> Self {
        Self {
            image,
            tone: Tone::default(),
            exr: ExrFormat::default(),
            seconds: 0.0,
            warnings: Vec::new(),
            source: Source::Read(Box::new((picture, camera))),
            sums: None,
        }
    }
}

/// Render or file from which an image comes.
pub enum Source {
    /// The image was rendered.
    Rendered(Box<Metadata>),
    /// The image was read from a file. The first field is the picture for comparisons, if the file
    /// has colours. The second field is the camera, if the file has its attributes.
    Read(Box<(Option<Rendering>, Option<CameraAttributes>)>),
}

/// A picture with its channels.
#[pyclass(frozen, module = "embrasure._native")]
pub struct Film(Developed);

impl Film {
    pub fn new(film: Developed) -> Self {
        Self(film)
    }

    fn channel(&self, name: &str) -> PyResult<&Channel> {
        let found = self.0.image.channel(name);
        found.ok_or_else(|| PyKeyError::new_err(format!("no channel {name}")))
    }

    /// Numbers of rows and columns.
    fn shape(&self) -> [usize; 2] {
        let size = self.0.image.crop.size();
        [size.y as usize, size.x as usize]
    }

    /// Tone curve and exposure: the given values, or else the values of the render.
    fn tone(&self, tone: Option<&str>, exposure: Option<&str>) -> Result<Tone, Error> {
        let mut options = ToneOptions::default();
        for (key, text) in [("tone", tone), ("exposure", exposure)] {
            let Some(text) = text else { continue };
            if let Some(Err(invalid)) = options.set(key, embrasure::options::Input::Flag(text)) {
                return Err(Error::Setting(invalid.into()));
            }
        }
        let tone = Tone {
            curve: options.tone.unwrap_or(self.0.tone.curve),
            exposure: options.exposure.unwrap_or(self.0.tone.exposure),
        };
        Ok(metered(tone, &self.0.image))
    }

    /// The image, denoised by the denoiser that `denoise` names.
    fn denoised(&self, denoise: Option<&str>) -> Result<Cow<'_, Image>, Error> {
        let image = &self.0.image;
        let denoiser = match denoise {
            None => None,
            Some("") => Some(Denoiser::best()),
            Some(name) => match Denoising::of_text(name) {
                Some(denoising) => denoising.denoiser(),
                None => {
                    let known = <Denoising as Value>::names().join(", ");
                    let words = format!("denoise {name}: no such denoiser\n  help: choose among {known}");
                    return Err(Error::Refused(words));
                }
            },
        };
        let Some(denoiser) = denoiser else {
            return Ok(Cow::Borrowed(image));
        };
        let mut image = image.clone();
        denoiser.apply(&mut image)?;
        Ok(Cow::Owned(image))
    }

    /// 8-bit pixels for a display, and the number of their channels.
    fn shown(
        &self,
        tone: Option<&str>,
        exposure: Option<&str>,
        denoise: Option<&str>,
    ) -> Result<(Vec<u8>, usize), Error> {
        pooled(|| {
            let tone = self.tone(tone, exposure)?;
            let image = self.denoised(denoise)?;
            let (channels, bytes) = display_bytes(&image, &tone);
            Ok((bytes, channels))
        })
    }

    fn write(&self, path: &Path, tone: Option<&str>, exposure: Option<&str>) -> Result<(), Error> {
        let Developed { image, exr, .. } = &self.0;
        let format = match Format::of_path(path)? {
            Format::Exr(_) => Format::Exr(exr.clone()),
            Format::Png(_) => Format::Png(self.tone(tone, exposure)?),
        };
        let output = Output::prepare(path)?;
        match (&self.0.source, &self.0.sums) {
            (Source::Rendered(metadata), Some(sums)) => {
                let failed = sums.write(image, &[(format, output)], true, metadata);
                failed.into_iter().next().map_or(Ok(()), |error| Err(error.into()))
            }
            (Source::Rendered(metadata), None) => Ok(output.write_image(&format, image, None, metadata)?),
            (Source::Read(read), _) => {
                let image = image.clone();
                let steps = "read".into();
                let camera = read.1;
                let written = DevelopedPicture {
                    image,
                    camera,
                    lines: None,
                    steps,
                };
                match format {
                    Format::Exr(format) => written.write_exr(&output, &format)?,
                    Format::Png(tone) => written.write_png(&output, &tone)?,
                }
                Ok(())
            }
        }
    }

    /// The picture with data about its noise, for comparisons.
    pub fn rendering(&self) -> Option<Rendering> {
        let Developed { image, source, .. } = &self.0;
        match source {
            Source::Rendered(metadata) => Some(Rendering {
                bias: metadata.bias.clone(),
                ..Rendering::of_image(image, metadata.common_errors.unwrap_or(CommonErrors::Picture))
            }),
            Source::Read(read) => read.0.clone(),
        }
    }
}

#[pymethods]
impl Film {
    /// Makes a film with linear colours only. `colors` are row by row, from the top.
    #[staticmethod]
    fn of_colors(colors: PyReadonlyArray2<f32>, width: usize) -> PyResult<Self> {
        let pixels: Vec<[f32; 3]> = Rows::new("colors", &colors)?.iter().collect();
        let height = pixels.len() / width.max(1);
        let resolution = UVec2::new(width as u32, height as u32);
        if width * height != pixels.len() || !Rect::full(resolution).is_inside(resolution) {
            return Err(PyValueError::new_err("colors: rows of the same width are expected"));
        }
        let picture = Rendering {
            resolution,
            window: Rect::full(resolution),
            image: RgbImage { width, height, pixels },
            raw: None,
            noise: None,
            is_display: false,
            bias: None,
        };
        Ok(Self(Developed::of_file(
            image_of_picture(&picture),
            Some(picture),
            None,
        )))
    }

    /// Names of the channels in the order of EXR files.
    #[getter]
    fn channels(&self) -> Vec<String> {
        let channels = &self.0.image.channels;
        channels.iter().map(|channel| channel.name.to_string()).collect()
    }

    /// Width and height of the full image.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.0.image.resolution.into()
    }

    /// Corners of the rectangle of pixels that the arrays contain: x₀, y₀, x₁, y₁.
    #[getter]
    fn crop(&self) -> (u32, u32, u32, u32) {
        let (min, max) = (self.0.image.crop.min, self.0.image.crop.max);
        (min.x, min.y, max.x, max.y)
    }

    /// Time of rendering in seconds.
    #[getter]
    fn seconds(&self) -> f64 {
        self.0.seconds
    }

    /// Returns true if all samples were taken.
    #[getter]
    fn complete(&self) -> bool {
        match &self.0.source {
            Source::Rendered(metadata) => metadata.complete,
            Source::Read(..) => true,
        }
    }

    /// Settings in the form in which EXR files store them: `key=value` pairs. Empty if they are
    /// unknown.
    #[getter]
    fn settings(&self) -> &str {
        match &self.0.source {
            Source::Rendered(metadata) => &metadata.settings,
            Source::Read(..) => "",
        }
    }

    /// Warnings about the scene and the settings.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// Values of one channel, row by row from the top.
    fn plane<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyArray2<f32>>> {
        PyArray1::from_slice(py, &self.channel(name)?.values).reshape(self.shape())
    }

    /// Values of several channels, interleaved for each pixel.
    fn planes<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let channels = names
            .iter()
            .map(|name| self.channel(name))
            .collect::<PyResult<Vec<_>>>()?;
        let [rows, columns] = self.shape();
        let pixels = (0..rows * columns).flat_map(|i| channels.iter().map(move |channel| channel.values[i]));
        PyArray1::from_vec(py, pixels.collect()).reshape([rows, columns, channels.len()])
    }

    /// 8-bit pixels for an sRGB display.
    #[pyo3(signature = (tone=None, exposure=None, denoise=None))]
    fn develop<'py>(
        &self,
        py: Python<'py>,
        tone: Option<&str>,
        exposure: Option<&str>,
        denoise: Option<&str>,
    ) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let (bytes, channels) = py
            .detach(|| self.shown(tone, exposure, denoise))
            .map_err(|error| errors::of_session(py, error))?;
        let [rows, columns] = self.shape();
        PyArray1::from_vec(py, bytes).reshape([rows, columns, channels])
    }

    /// The picture as a PNG file in memory.
    #[pyo3(signature = (tone=None, exposure=None))]
    fn png<'py>(&self, py: Python<'py>, tone: Option<&str>, exposure: Option<&str>) -> PyResult<Cow<'py, [u8]>> {
        let shown = py.detach(|| self.shown(tone, exposure, None));
        let (bytes, channels) = shown.map_err(|error| errors::of_session(py, error))?;
        let size = self.0.image.crop.size().to_array();
        png_bytes(channels, size, &bytes)
            .map(Cow::Owned)
            .map_err(|error| errors::Error::new_err(error.to_string()))
    }

    /// Pickling is not supported: raises an error with help.
    fn __reduce__(&self) -> PyResult<()> {
        Err(errors::no_pickle(
            "Film",
            "save() it, and read() the file in the other process",
        ))
    }

    /// Writes an EXR or PNG file like `embrasure render -o`.
    #[pyo3(signature = (path, tone=None, exposure=None))]
    fn save(&self, py: Python, path: PathBuf, tone: Option<&str>, exposure: Option<&str>) -> PyResult<()> {
        let written = py.detach(|| pooled(|| self.write(&path, tone, exposure)));
        written.map_err(|error| errors::of_session(py, error))
    }
}

/// Reads a picture: all channels of an EXR file, or the colours of a PNG file or another image
/// file.
#[pyfunction]
pub fn read(py: Python, path: PathBuf) -> PyResult<Film> {
    let film = py.detach(|| {
        let picture = read_rendering(&path);
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr")) {
            let (image, camera) = image_of_layers(&path)?;
            // A file without colours may have other channels
            return Ok(Developed::of_file(image, picture.ok(), camera));
        }
        let picture = picture?;
        Ok(Developed::of_file(image_of_picture(&picture), Some(picture), None))
    });
    film.map(Film::new)
        .map_err(|error: FileError| errors::of_file(py, &error))
}

/// Image with all channels that have the data window of the first channel, and the camera of the
/// file.
fn image_of_layers(path: &Path) -> Result<(Image, Option<CameraAttributes>), FileError> {
    let layers = read_layers(path)?;
    let crop = layers.channels[0].window;
    let channels = layers.channels.into_iter().filter(|channel| channel.window == crop);
    let channels = channels.map(|channel| Channel {
        name: channel.name.into(),
        values: channel.values,
    });
    let mut channels: Vec<Channel> = channels.collect();
    // Sort the colours first, as in a render
    let place = |channel: &Channel| {
        ["R", "G", "B"]
            .iter()
            .position(|name| channel.name == *name)
            .unwrap_or(3)
    };
    channels.sort_by_key(place);
    let image = Image {
        resolution: layers.resolution,
        view: layers.view,
        crop,
        channels,
        backing: layers.backing,
    };
    Ok((image, layers.camera))
}

fn image_of_picture(picture: &Rendering) -> Image {
    let channels = ["R", "G", "B"].into_iter().enumerate().map(|(c, name)| Channel {
        name: name.into(),
        values: picture.image.pixels.iter().map(|pixel| pixel[c]).collect(),
    });
    Image {
        resolution: picture.resolution,
        view: picture.resolution,
        crop: picture.window,
        channels: channels.collect(),
        backing: None,
    }
}
