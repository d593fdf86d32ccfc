use super::exr::{self, ExrFormat, Header};
use super::{FileError, Output, png};
use crate::color::Tone;
use crate::film::Image;

/// A picture that was made of one in a file.
#[derive(Clone, Debug)]
pub struct Developed {
    /// Channels of the picture. A picture of colours has `R`, `G`, `B` and, where it has alpha, `A`, by which the colours are multiplied.
    pub image: Image,
    /// Steps of development, as `key=value` pairs.
    pub steps: String,
}

impl Developed {
    /// Writes the channels as they are.
    pub fn write_exr(&self, output: &Output, format: &ExrFormat) -> Result<(), FileError> {
        let header = Header {
            resolution: self.image.resolution,
            crop: self.image.crop,
            metadata: None,
            attributes: vec![("embrasure.develop".into(), self.steps.clone())],
            compression: format.compression.code(),
        };
        let channels = exr::rows_of(&self.image, format);
        output.write(|writer| exr::write_rows(writer, header, channels))
    }

    /// Writes `R G B` as `tone` shows them, whose exposure must be known. Alpha that is not 1 everywhere is written too, and colours are divided by it
    /// before, as the format wants it.
    pub fn write_png(&self, output: &Output, tone: &Tone) -> Result<(), FileError> {
        let alpha = self.image.alpha().filter(|alpha| alpha.iter().any(|&a| a < 1.0));
        output.write(|writer| png::write_as(writer, &self.image, alpha, tone, png::software()))
    }
}
