//! Pictures as stored in files, before they become textures.

use super::FileError;
use std::path::Path;

/// A picture as stored in its file, row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    pub width: usize,
    pub height: usize,
    /// Number of channels: 1 grey, 2 grey and alpha, 3 colour, 4 colour and alpha. Alpha is not
    /// premultiplied.
    pub channels: usize,
    pub samples: Samples,
    /// Orientation from EXIF metadata, 1 to 8. 1 is the orientation as stored.
    pub orientation: u8,
}

impl Picture {
    /// Returns true if alpha is the opacity of a cut-out, such as a leaf. Alpha must fulfil two
    /// conditions. Nearly all pixels are opaque or transparent, and both exist. Nearly all
    /// transparent pixels are black, because programs store empty pixels as black.
    ///
    /// If alpha has another meaning, such as a mask of gloss or of clothes, the transparent pixels
    /// have the colours of the picture. In pictures with a white background, such as drawings, the
    /// transparent pixels are white.
    pub fn is_cut_out(&self) -> bool {
        match &self.samples {
            Samples::Bytes(all) => is_cut_out(all, self.channels, |x| f32::from(x) / f32::from(u8::MAX)),
            Samples::Shorts(all) => is_cut_out(all, self.channels, |x| f32::from(x) / f32::from(u16::MAX)),
            Samples::Floats(all) => is_cut_out(all, self.channels, |x| x),
        }
    }

    /// Removes an alpha channel that is 1 in all pixels.
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

/// [`Picture::is_cut_out`] for samples that `value` converts to numbers from 0 to 1.
fn is_cut_out<T: Copy>(samples: &[T], channels: usize, value: impl Fn(T) -> f32) -> bool {
    /// Maximum alpha of a transparent pixel, and minimum alpha of an opaque pixel.
    const ENDS: [f32; 2] = [0.04, 0.96];
    /// Maximum fraction of pixels whose alpha is between both `ENDS`.
    const GRADED: f32 = 0.05;
    /// Minimum fraction of transparent pixels, and of opaque pixels. A palette may have one
    /// transparent colour that few pixels use.
    const BOTH: f32 = 0.01;
    /// Minimum fraction of black pixels among the transparent pixels.
    const NOTHING: f32 = 0.9;
    /// Maximum sample of a black pixel.
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

/// Samples by type. The value of an integer is its fraction of the largest integer of the type.
/// Floats are linear.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Samples {
    Bytes(Vec<u8>),
    Shorts(Vec<u16>),
    Floats(Vec<f32>),
}

/// Size and sample format of a picture, from its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PictureHeader {
    pub width: u64,
    pub height: u64,
    /// Samples per texel.
    pub channels: u64,
    /// Bytes per sample.
    pub sample_bytes: u64,
}

impl PictureHeader {
    /// Size of the samples in bytes.
    pub fn bytes(&self) -> u64 {
        // Sizes have been checked: products are far below 2⁶⁴.
        self.width * self.height * self.channels * self.sample_bytes
    }

    /// Maximum memory in bytes that reading needs: the samples, one copy while they are reordered,
    /// and two packed rows.
    pub fn reading_bytes(&self) -> u64 {
        2 * self.bytes() + 2 * self.bytes() / self.height.max(1)
    }
}

/// Error for a file that a decoder cannot decode.
pub(super) fn damaged(path: &Path, error: &dyn std::fmt::Display) -> FileError {
    FileError::new(path, format!("cannot decode the picture: {error}")).help("it may be damaged; save it again")
}
