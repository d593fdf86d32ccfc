//! Groups of pixels that share their paths (`integrator/path/reuse`).
//!
//! The errors of the pixels of a group are correlated. Groups are random within a tile, so that the
//! correlation shows no pattern, and change with each block of 64 samples. Within a block the
//! groups are fixed, so that the samples of a pixel stay stratified for every pixel of its group.
//! Tiles have the same position in a crop as in the full image, and a group includes pixels outside
//! of the crop. So the pixels of a crop are bit-identical to the pixels of the full image.
//!
//! `--pixel X,Y --sample K` also traces the companions of the sample, which are the other samples
//! of its group, and prints the light that the pixel receives from them.

use crate::film::{BLOCK, Film, Rect};
use crate::integrator::SAMPLES_AT_ONCE;
use crate::math::UVec2;
use crate::math::hash::mix;
use crate::sampler::SampleKey;

/// The pixels of the tile `cell` in random order, for the sample with index `sample`. Consecutive
/// pixels form a group.
///
/// Groups are random, so that the correlated errors of a group show no pattern. The next block of
/// samples has other groups. Within a block the groups are fixed, so that the samples of a pixel
/// stay stratified for all pixels of the group.
pub(super) fn shuffled(cell: Rect, sample: u32) -> Vec<UVec2> {
    let mut pixels: Vec<UVec2> = cell.pixels().collect();
    let place = ((cell.min.y as u64) << 32) | cell.min.x as u64;
    let mut bits = mix(mix(place).wrapping_add((sample / BLOCK) as u64));
    for last in (1..pixels.len()).rev() {
        bits = mix(bits.wrapping_add(last as u64));
        // A cell has few pixels, so the bias of the remainder is below 2⁻⁵⁶.
        pixels.swap(last, (bits % (last as u64 + 1)) as usize);
    }
    pixels
}

/// Keys of the samples that a render traces together with `key`, including `key`. `pixels_at_once`
/// is the number of pixels that the integrator traces together. To repeat one of these samples,
/// trace all of them.
pub fn companions(pixels_at_once: usize, resolution: UVec2, key: SampleKey) -> Vec<SampleKey> {
    if pixels_at_once == 1 {
        return vec![key];
    }
    let cell = Film::cell(resolution, key.pixel());
    let pixels = shuffled(cell, key.sample);
    let mut groups = pixels.chunks(pixels_at_once.min(SAMPLES_AT_ONCE));
    let group = groups.find(|group| group.contains(&key.pixel())).unwrap_or_default();
    group.iter().map(|p| SampleKey::new(p.x, p.y, key.sample)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_every_pixel_once() {
        let cell = Rect {
            min: UVec2::new(32, 16),
            max: UVec2::new(45, 32),
        };
        let in_order = |mut pixels: Vec<UVec2>| {
            pixels.sort_by_key(|p| (p.y, p.x));
            pixels
        };
        let first = shuffled(cell, 0);
        assert_eq!(in_order(first.clone()), cell.pixels().collect::<Vec<_>>());
        // Groups are equal within a block of samples, and differ in the next block.
        assert_eq!(first, shuffled(cell, 63));
        assert_ne!(first, shuffled(cell, 64));
    }

    /// Two neighbouring pixels of 256 are in the same group of 16 as often as in random groups.
    #[test]
    fn neighbours_are_not_kept_together() {
        let (mut together, cells) = (0, 4000);
        for i in 0..cells {
            let min = UVec2::new(16 * (i % 64), 16 * (i / 64));
            let cell = Rect {
                min,
                max: min + UVec2::splat(16),
            };
            let pixels = shuffled(cell, 0);
            let place = |p: UVec2| pixels.iter().position(|q| *q == p).unwrap() / 16;
            let p = min + UVec2::splat(7);
            together += u32::from(place(p) == place(p + UVec2::X));
        }
        // The number of cells with both pixels in one group is binomial with p = 15/255
        let (n, p) = (cells as f64, 15.0 / 255.0);
        let z = (together as f64 - n * p) / (n * p * (1.0 - p)).sqrt();
        assert!(z.abs() < 4.0, "{together} of {cells}: {z}");
    }
}
