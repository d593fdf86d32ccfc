use super::exr::{self, ExrFormat, Header};
use super::{FileError, png};
use crate::camera::CameraAttributes;
use crate::color::{Spectrum, Tone};
use crate::files::Output;
use crate::film::Image;

/// Picture after development: the channels of a file, with exposure, denoising and other steps
/// applied.
#[derive(Clone, Debug)]
pub struct DevelopedPicture {
    /// Channels of the picture. A colour picture has `R`, `G`, `B` and, with alpha, `A`. The
    /// colours are multiplied by alpha.
    pub image: Image,
    /// Camera of the picture, if the file has it.
    pub camera: Option<CameraAttributes>,
    /// Colour of the lines, if the channel `lines` is drawn over the picture.
    pub lines: Option<Spectrum>,
    /// Steps of development that were applied, as `key=value` pairs.
    pub steps: String,
}

impl DevelopedPicture {
    /// Writes the channels unchanged to an EXR file.
    pub fn write_exr(&self, output: &Output, format: &ExrFormat) -> Result<(), FileError> {
        let header = Header {
            resolution: self.image.resolution,
            crop: self.image.crop,
            metadata: None,
            camera: self.camera,
            attributes: vec![("embrasure.develop".into(), self.steps.clone())],
            compression: format.compression.code(),
        };
        let channels = exr::rows_of(&self.image, format);
        output.write(|writer| exr::write_rows(writer, header, channels))
    }

    /// Writes a PNG file with the tone curve of `tone`. The exposure of `tone` must not be
    /// automatic. Alpha is written unless it is 1 everywhere.
    pub fn write_png(&self, output: &Output, tone: &Tone) -> Result<(), FileError> {
        let is_covered = |(_, coverage): (_, Vec<[f32; 3]>)| coverage.iter().flatten().all(|&a| a >= 1.0);
        let is_opaque = self.image.coverage().is_none_or(is_covered);
        let opaque = is_opaque.then(|| Image {
            backing: None,
            ..self.image.clone()
        });
        let image = opaque.as_ref().unwrap_or(&self.image);
        output.write(|writer| png::write_as(writer, image, tone, self.lines, png::software()))
    }
}
