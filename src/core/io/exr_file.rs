//! Reading EXR files: header, layers, and position of a layer in the image.

use super::FileError;
use super::header_limits::check_exr;
use crate::files::input::{Input, ReadFailure};
use crate::film::Rect;
use crate::math::UVec2;
use ::exr::image::FlatImage;
use ::exr::prelude::{self as exr, ReadChannels, ReadLayers};
use std::io::{BufReader, Seek};
use std::path::Path;

/// An EXR file whose header has been read and checked.
pub(super) struct ExrFile {
    pub meta: exr::MetaData,
    /// Reader, positioned at the start of the file.
    pub reader: BufReader<Input>,
    pub failure: ReadFailure,
}

impl ExrFile {
    /// Opens the file. `failed` takes a description and returns the error for an invalid header.
    pub fn open(path: &Path, failed: &dyn Fn(&dyn std::fmt::Display) -> FileError) -> Result<Self, FileError> {
        let input = Input::open(path, "the EXR file").map_err(|error| error.help_if_none("check the path"))?;
        let known = (input.length(), input.failure());
        Self::read(path, input.buffered(path)?, known, failed)
    }

    /// Reads the header from the start of a file of `length` bytes.
    pub fn read(
        path: &Path,
        mut reader: BufReader<Input>,
        (length, failure): (u64, ReadFailure),
        failed: &dyn Fn(&dyn std::fmt::Display) -> FileError,
    ) -> Result<Self, FileError> {
        let meta = exr::MetaData::read_from_buffered(&mut reader, false);
        let meta = meta.map_err(|e| failure.or(path, decoding_error(path, &e, failed)))?;
        check_exr(path, length, &meta)?;
        let rewound = reader.rewind();
        rewound.map_err(|e| FileError::system(path, "cannot read it", &e))?;
        Ok(Self { meta, reader, failure })
    }

    /// Reads all channels of all layers, at the largest resolution. `failed` takes a description
    /// and returns the error for a damaged file.
    pub fn layers(
        self,
        path: &Path,
        failed: &dyn Fn(&dyn std::fmt::Display) -> FileError,
    ) -> Result<FlatImage, FileError> {
        exr::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .non_parallel()
            .from_buffered(self.reader)
            .map_err(|e| self.failure.or(path, decoding_error(path, &e, failed)))
    }
}

/// Converts an error of the decoder. The new error says that this kind of file is not supported, or
/// that the file is damaged. `failed` takes a description and returns the error for a damaged file.
pub(super) fn decoding_error(
    path: &Path,
    error: &::exr::error::Error,
    failed: &dyn Fn(&dyn std::fmt::Display) -> FileError,
) -> FileError {
    let ::exr::error::Error::NotSupported(reason) = error else {
        return failed(error);
    };
    let (message, help) = if reason.contains("deep") {
        (
            "this EXR file has deep data, with several values for each pixel".into(),
            "flatten it to one value for each pixel with `oiiotool IN.exr --flatten -o OUT.exr`",
        )
    } else {
        (
            format!("this kind of EXR file is not supported: {reason}"),
            "write it again, as scan lines with ZIP compression",
        )
    };
    FileError::new(path, message).help(help)
}

/// Position of a layer relative to the top left corner of the display window. Pixels outside of the
/// display window are left out.
pub(super) struct DataWindow {
    /// Pixels of the layer that are in the display window.
    pub window: Rect,
    /// Left edge, top edge and width of the layer in pixels, relative to the display window.
    left: i64,
    top: i64,
    width: i64,
}

impl DataWindow {
    /// Position of a layer with the data window `data` in the display window `display`. `None` if
    /// no pixel of `data` is in `display`.
    pub fn new(display: &exr::IntegerBounds, data: &exr::IntegerBounds) -> Option<Self> {
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

    /// Index in the layer of each pixel of the window, row by row from the top.
    pub fn indices(&self) -> impl Iterator<Item = usize> {
        let index = |at: UVec2| ((i64::from(at.y) - self.top) * self.width + i64::from(at.x) - self.left) as usize;
        self.window.pixels().map(index)
    }

    /// Selects the values of the window from all values of the layer.
    pub fn pick(&self, all: &[f32]) -> Vec<f32> {
        self.indices()
            .map(|index| all.get(index).copied().unwrap_or(0.0))
            .collect()
    }
}

/// Size of the display window in pixels.
pub(super) fn resolution(display: &exr::IntegerBounds) -> UVec2 {
    UVec2::new(display.size.width() as u32, display.size.height() as u32)
}
