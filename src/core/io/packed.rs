//! Compression of pictures for slow connections: prediction from neighbouring pixels, then DEFLATE.
//! Browsers have a decoder for DEFLATE (`DecompressionStream`). `src/view/page/coding.js` decodes
//! the pictures.
//!
//! The bits of a 16-bit float, read as an integer, are approximately the logarithm of its value.
//! The difference of two channels is therefore approximately the logarithm of their ratio. Noise
//! that changes both channels by the same factor cancels in this ratio. Green is coded directly,
//! and red and blue are coded as differences from green. Each number is predicted by the mean of
//! its neighbours to the left and above. The difference between number and prediction is mapped to
//! an unsigned number. Low and high bytes are stored in separate planes. All arithmetic wraps
//! around, so the coding is lossless for every pattern of bits. A preview picture, which will soon
//! be replaced, may be rounded to fewer bits of the mantissa before.

use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::io::Write;

/// Number of mantissa bits that rounding removes. Six of ten bits stay, with a relative error of at
/// most 0.8 %. A step of an 8-bit display is about as large.
pub const ROUNDING: u32 = 4;

/// Bits of special 16-bit floats: the largest finite number, infinity, and NaN.
const LARGEST: u16 = 0x7bff;
const INFINITY: u16 = 0x7c00;
const QUIET_NAN: u16 = 0x7e00;

/// Packs `halves`, three per pixel in rows of `width` pixels. The numbers are rounded, and their
/// last `rounding` bits are not stored.
pub fn pack(halves: &[u16], width: usize, rounding: u32) -> Vec<u8> {
    let pixels: Vec<[u16; 3]> = halves
        .chunks_exact(3)
        .map(|rgb| {
            let [r, g, b] = [0, 1, 2].map(|c| rounded(rgb[c], rounding) >> rounding);
            [g, r.wrapping_sub(g), b.wrapping_sub(g)]
        })
        .collect();
    let count = pixels.len();
    let mut planes = vec![0; 6 * count];
    for (i, pixel) in pixels.iter().enumerate() {
        let left = (i % width > 0).then(|| pixels[i - 1]);
        let above = i.checked_sub(width).map(|above| pixels[above]);
        for c in 0..3 {
            let folded = fold(pixel[c].wrapping_sub(predicted(left.map(|p| p[c]), above.map(|p| p[c]))));
            planes[2 * c * count + i] = folded as u8;
            planes[(2 * c + 1) * count + i] = (folded >> 8) as u8;
        }
    }
    let mut encoder = DeflateEncoder::new(Vec::with_capacity(planes.len() / 2), Compression::fast());
    // Writing to memory cannot fail.
    let _ = encoder.write_all(&planes);
    encoder.finish().unwrap_or_default()
}

/// Rounds a 16-bit float to the nearest number whose last `rounding` bits are 0. Finite numbers
/// stay finite, and NaN stays NaN.
fn rounded(bits: u16, rounding: u32) -> u16 {
    let (sign, size) = (bits & 0x8000, bits & 0x7fff);
    let unit = 1 << rounding;
    match size {
        _ if rounding == 0 => return bits,
        // Use a NaN whose last bits are 0, because rounding could turn another NaN into infinity.
        size if size > INFINITY => return sign | QUIET_NAN,
        INFINITY => return bits,
        _ => {}
    }
    sign | ((size + unit / 2) & !(unit - 1)).min(LARGEST & !(unit - 1))
}

/// Value predicted from the neighbours to the left and above; 0 for the first pixel.
fn predicted(left: Option<u16>, above: Option<u16>) -> u16 {
    match (left, above) {
        // Use the signed mean, because differences of channels are signed
        (Some(left), Some(above)) => ((i32::from(left as i16) + i32::from(above as i16)) >> 1) as u16,
        (Some(one), None) | (None, Some(one)) => one,
        (None, None) => 0,
    }
}

/// Maps a signed difference to an unsigned number: 0, −1, 1, −2, … to 0, 1, 2, 3, …
fn fold(difference: u16) -> u16 {
    (difference << 1) ^ (((difference as i16) >> 15) as u16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use flate2::read::DeflateDecoder;
    use std::io::Read;

    /// Decodes a picture as the page does (`coding.js`).
    fn unpack(packed: &[u8], width: usize, rounding: u32) -> Vec<u16> {
        let mut planes = Vec::new();
        DeflateDecoder::new(packed).read_to_end(&mut planes).unwrap();
        let count = planes.len() / 6;
        let mut pixels: Vec<[u16; 3]> = Vec::new();
        for i in 0..count {
            let left = (i % width > 0).then(|| pixels[i - 1]);
            let above = i.checked_sub(width).map(|above| pixels[above]);
            pixels.push([0, 1, 2].map(|c| {
                let folded = u16::from(planes[2 * c * count + i]) | (u16::from(planes[(2 * c + 1) * count + i]) << 8);
                let difference = (folded >> 1) ^ (folded & 1).wrapping_neg();
                difference.wrapping_add(predicted(left.map(|p| p[c]), above.map(|p| p[c])))
            }));
        }
        let back = |[g, r, b]: [u16; 3]| [r.wrapping_add(g), g, b.wrapping_add(g)].map(|code| code << rounding);
        pixels.into_iter().flat_map(back).collect()
    }

    /// All patterns of bits are restored, including infinities and NaN.
    #[test]
    fn packing_is_lossless() {
        let mut halves: Vec<u16> = (0..=u16::MAX).collect();
        // Add all patterns in another order, in which neighbours differ a lot
        halves.extend((0..=u16::MAX).map(|i| i.wrapping_mul(40_503)));
        halves.push(0);
        assert_eq!(halves.len() % 3, 0);
        for width in [1, 7, 128] {
            assert_eq!(unpack(&pack(&halves, width, 0), width, 0), halves, "{width}");
        }
        assert!(unpack(&pack(&[], 1, 0), 1, 0).is_empty());
    }

    #[test]
    fn rounding_is_to_the_nearest() {
        let halves: Vec<u16> = (0..=u16::MAX - 1).collect();
        let back = unpack(&pack(&halves, 64, ROUNDING), 64, ROUNDING);
        for (&bits, &back) in halves.iter().zip(&back) {
            let [value, shown] = [bits, back].map(|bits| half::f16::from_bits(bits).to_f32());
            assert_eq!(value.is_nan(), shown.is_nan(), "{bits:x}");
            assert_eq!(value.is_finite(), shown.is_finite(), "{bits:x}");
            if value.is_finite() {
                // Maximum error: half a unit of the last stored bit, for normal or for subnormal
                // numbers
                let max = (value.abs() / 128.0).max(2f32.powi(-24 + ROUNDING as i32 - 1));
                assert!(
                    (value - shown).abs() <= max || shown.abs() == 65_024.0,
                    "{value} {shown}"
                );
            }
        }
    }

    /// A smooth picture is compressed to a small part of its bytes.
    #[test]
    fn smooth_pictures_are_small() {
        let halves: Vec<u16> = (0..64 * 64)
            .flat_map(|i| {
                let (x, y) = ((i % 64) as f32, (i / 64) as f32);
                [1.0, 0.5, 0.25].map(|c| half::f16::from_f32(c * (1.0 + 0.01 * x + 0.02 * y)).to_bits())
            })
            .collect();
        let packed = pack(&halves, 64, 0).len();
        assert!(packed < halves.len() * 2 / 4, "{packed}");
    }
}
