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
    /// Returns true if alpha is a cut-out: nearly all pixels are opaque or transparent, there are
    /// both, and nearly all transparent ones are black, as programs store nothing. Masks of gloss or
    /// of clothes have details of the picture below, and a white that was not meant to be seen is
    /// the colour of paper in others.
    pub fn is_cut_out(&self) -> bool {
        match &self.samples {
            Samples::Bytes(all) => is_cut_out(all, self.channels, |x| f32::from(x) / f32::from(u8::MAX)),
            Samples::Shorts(all) => is_cut_out(all, self.channels, |x| f32::from(x) / f32::from(u16::MAX)),
            Samples::Floats(all) => is_cut_out(all, self.channels, |x| x),
        }
    }

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

/// [`Picture::is_cut_out`] of samples, of which `value` gives the numbers from 0 to 1.
fn is_cut_out<T: Copy>(samples: &[T], channels: usize, value: impl Fn(T) -> f32) -> bool {
    /// Alpha of transparent pixels at most, and of opaque ones at least.
    const ENDS: [f32; 2] = [0.04, 0.96];
    /// Share of pixels between the ends, at most.
    const GRADED: f32 = 0.05;
    /// Share of transparent pixels, and of opaque ones, at least: one colour of a palette is
    /// transparent.
    const BOTH: f32 = 0.01;
    /// Share of the transparent pixels that are black, at least, and the largest sample of black.
    const NOTHING: f32 = 0.9;
    const BLACK: f32 = 0.06;
    if channels % 2 != 0 {
        return false;
    }
    let (mut transparent, mut black, mut opaque) = (0usize, 0usize, 0usize);
    for texel in samples.chunks_exact(channels) {
        let alpha = value(texel[channels - 1]);
        opaque += usize::from(alpha >= ENDS[1]);
        if alpha <= ENDS[0] {
            transparent += 1;
            black += usize::from(texel[..channels - 1].iter().all(|&sample| value(sample) <= BLACK));
        }
    }
    let all = (samples.len() / channels).max(1) as f32;
    let [transparent_share, opaque_share] = [transparent, opaque].map(|count| count as f32 / all);
    transparent_share.min(opaque_share) >= BOTH
        && transparent_share + opaque_share >= 1.0 - GRADED
        && black as f32 >= NOTHING * transparent as f32
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
