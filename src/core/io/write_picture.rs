//! Writing pictures: the formats, and the file of a picture in each format.

use super::exr::{self, Header};
use super::{ExrFormat, FileError, Metadata, State, cryptomatte, png};
use crate::color::Tone;
use crate::files::Output;
use crate::film::Image;
use std::io::{self, Seek, Write};
use std::path::Path;

/// Image file formats that can be written.
#[derive(Clone, Debug, PartialEq)]
pub enum Format {
    /// OpenEXR: linear floats, all channels, metadata.
    Exr(ExrFormat),
    /// PNG: 8 bits for an sRGB display, after the tone curve.
    Png(Tone),
}

impl Format {
    /// Selects the format by the extension of the file name. The default tone curve of a PNG clips
    /// values above 1.
    pub fn of_path(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let extension = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("exr") => Ok(Self::Exr(ExrFormat::default())),
            Some("png") => Ok(Self::Png(Tone::default())),
            other => Err(FileError::new(
                path,
                match other {
                    Some(e) => format!("unknown image format `.{e}`"),
                    None => "the file name has no extension, which chooses the format".into(),
                },
            )
            .help("use .exr (linear floats) or .png (8-bit display)")),
        }
    }
}

impl Output {
    /// Writes `image` in `format`. An EXR also holds `state`, if there is one.
    pub fn write_image(
        &self,
        format: &Format,
        image: &Image,
        state: Option<&State>,
        metadata: &Metadata,
    ) -> Result<(), FileError> {
        self.write(|writer| match format {
            Format::Exr(format) => write_exr(writer, image, format, state, metadata),
            Format::Png(tone) => png::write(writer, image, metadata, tone),
        })
    }
}

/// Writes the channels of `image`, and the channels of `state` if there is a state.
fn write_exr(
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
        camera: None,
        attributes,
        compression: format.compression.code(),
    };
    let mut channels = exr::rows_of(image, format);
    channels.extend(state.map_or(Vec::new(), State::channels));
    exr::write_rows(writer, header, channels)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn format_follows_from_the_extension() {
        assert_eq!(
            Format::of_path(Path::new("a/b.EXR")),
            Ok(Format::Exr(ExrFormat::default()))
        );
        assert_eq!(Format::of_path(Path::new("b.png")), Ok(Format::Png(Tone::default())));
        assert!(
            Format::of_path(Path::new("b.jpg"))
                .unwrap_err()
                .message
                .contains(".jpg")
        );
        assert!(Format::of_path(Path::new("b")).is_err());
    }
}
