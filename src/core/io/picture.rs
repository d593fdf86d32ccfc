//! Pictures as files have them, before they become textures.

use super::FileError;
use std::path::Path;

/// A picture as its file has it, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    pub width: usize,
    pub height: usize,
    /// Samples of a texel: grey, grey and alpha, colours, or colours and alpha, which is not multiplied into them.
    pub channels: usize,
    pub samples: Samples,
    /// Orientation in EXIF metadata, 1 to 8; 1: as stored.
    pub orientation: u8,
}

impl Picture {
    /// Leaves out an alpha channel that is 1 in all pixels.
    pub fn drop_opaque_alpha(&mut self) {
        fn dropped<T: Copy + PartialEq>(samples: &[T], channels: usize, opaque: T) -> Option<Vec<T>> {
            let texels = samples.chunks_exact(channels);
            let is_opaque = texels.clone().all(|texel| texel.last() == Some(&opaque));
            is_opaque.then(|| texels.flat_map(|texel| texel[..channels - 1].to_vec()).collect())
        }
        if self.channels % 2 != 0 {
            return;
        }
        let samples = match &self.samples {
            Samples::Bytes(all) => dropped(all, self.channels, u8::MAX).map(Samples::Bytes),
            Samples::Shorts(all) => dropped(all, self.channels, u16::MAX).map(Samples::Shorts),
            Samples::Floats(all) => dropped(all, self.channels, 1.0).map(Samples::Floats),
        };
        if let Some(samples) = samples {
            (self.samples, self.channels) = (samples, self.channels - 1);
        }
    }
}

/// Samples by their type: shares of the largest number, or linear values.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Samples {
    Bytes(Vec<u8>),
    Shorts(Vec<u16>),
    Floats(Vec<f32>),
}

/// What a header says of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PictureHeader {
    pub width: u64,
    pub height: u64,
    /// Samples of a texel.
    pub channels: u64,
    /// Bytes of a sample.
    pub sample_bytes: u64,
}

impl PictureHeader {
    /// Bytes of its samples.
    pub fn bytes(&self) -> u64 {
        // Sizes have been checked: products are far below 2⁶⁴.
        self.width * self.height * self.channels * self.sample_bytes
    }

    /// Bytes that reading takes at most: the samples, as many again while they are put in order, and two rows as they are packed.
    pub fn reading_bytes(&self) -> u64 {
        2 * self.bytes() + 2 * self.bytes() / self.height.max(1)
    }
}

/// The error of a file that a decoder refuses.
pub(super) fn damaged(path: &Path, error: &dyn std::fmt::Display) -> FileError {
    FileError::new(path, format!("cannot decode the picture: {error}")).help("it may be damaged; save it again")
}
