//! The unsigned block formats BC1 to BC5. A block has 4 × 4 texels, two end values, and an index
//! per texel that selects a value between both ends.
//!
//! The rounding of values between both ends is not specified for these formats, and graphics
//! processors round differently (Giesen 2021, "GPU BCn decoding"). This decoder rounds as
//! OpenImageIO 3.2, so that texels have the same bits. First, both end colours are converted to 8
//! bits per channel. An interpolated value is the weighted sum of the ends plus 1, divided by the
//! sum of the weights.

/// A block format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BlockFormat {
    /// Colours. A texel may also be black and transparent.
    Bc1,
    /// Colours, and alpha of 4 bits.
    Bc2,
    /// Colours, and interpolated alpha.
    Bc3,
    /// One channel, decoded as grey.
    Bc4,
    /// Two channels, decoded as red and green.
    Bc5,
}

/// Columns and rows of a block.
const SIDE: usize = 4;

/// A texel: red, green, blue, alpha.
type Texel = [u8; 4];

impl BlockFormat {
    /// Size of a block in bytes.
    fn block_bytes(self) -> usize {
        match self {
            Self::Bc1 | Self::Bc4 => 8,
            Self::Bc2 | Self::Bc3 | Self::Bc5 => 16,
        }
    }

    /// Decodes a picture of `width` × `height` texels, as red, green, blue and alpha per texel.
    /// Returns `None` if `data` is too short.
    pub fn decode(self, data: &[u8], width: usize, height: usize) -> Option<Vec<u8>> {
        let columns = width.div_ceil(SIDE);
        let length = columns.checked_mul(height.div_ceil(SIDE))?;
        let data = data.get(..length.checked_mul(self.block_bytes())?)?;
        let mut picture = vec![0; width.checked_mul(height)?.checked_mul(4)?];
        for (i, block) in data.chunks_exact(self.block_bytes()).enumerate() {
            let (left, top) = (i % columns * SIDE, i / columns * SIDE);
            let texels = self.block(block);
            for (y, row) in texels.chunks_exact(SIDE).enumerate().take(height - top) {
                let used = SIDE.min(width - left);
                let start = 4 * ((top + y) * width + left);
                picture[start..start + 4 * used].copy_from_slice(row[..used].as_flattened());
            }
        }
        Some(picture)
    }

    /// Texels of a block, row by row.
    fn block(self, block: &[u8]) -> [Texel; 16] {
        let (first, second) = block.split_at(8);
        let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte));
        let mut texels = match self {
            Self::Bc1 => return colors(word(first), true),
            Self::Bc2 | Self::Bc3 => colors(word(second), false),
            Self::Bc4 => return values(word(first)).map(|grey| [grey, grey, grey, u8::MAX]),
            Self::Bc5 => {
                let (red, green) = (values(word(first)), values(word(second)));
                return std::array::from_fn(|i| [red[i], green[i], 0, u8::MAX]);
            }
        };
        let alphas: [u8; 16] = match self {
            Self::Bc2 => std::array::from_fn(|i| (word(first) >> (4 * i) & 0xf) as u8 * 17),
            _ => values(word(first)),
        };
        for (texel, alpha) in texels.iter_mut().zip(alphas) {
            texel[3] = alpha;
        }
        texels
    }
}

/// Colours of a block: two end colours of 5, 6 and 5 bits, and indices of 2 bits. Usually two
/// colours lie between the ends. If `has_holes` is true and the first end is not the larger number,
/// one colour lies between the ends, and the last index means a transparent texel.
fn colors(block: u64, has_holes: bool) -> [Texel; 16] {
    let ends = [block & 0xffff, block >> 16 & 0xffff];
    // Scale each channel to 8 bits, rounded to nearest
    let [a, b] = ends.map(|end| {
        let five = |bits: u64| ((bits & 31) * 527 + 23) >> 6;
        [five(end >> 11), ((end >> 5 & 63) * 259 + 33) >> 6, five(end)]
    });
    let mixed = |weights: [u64; 2]| {
        let sum = weights[0] + weights[1];
        let channel = |c: usize| ((weights[0] * a[c] + weights[1] * b[c] + sum / 2) / sum) as u8;
        [channel(0), channel(1), channel(2), u8::MAX]
    };
    let palette = if ends[0] > ends[1] || !has_holes {
        [mixed([1, 0]), mixed([0, 1]), mixed([2, 1]), mixed([1, 2])]
    } else {
        [mixed([1, 0]), mixed([0, 1]), mixed([1, 1]), [0; 4]]
    };
    std::array::from_fn(|i| palette[(block >> (32 + 2 * i) & 3) as usize])
}

/// Values of a block of one channel: two end values of 8 bits, and indices of 3 bits. If the first
/// end value is not larger than the second, the last two indices mean 0 and 255.
fn values(block: u64) -> [u8; 16] {
    let [a, b] = [block & 0xff, block >> 8 & 0xff];
    let last = if a > b { 7 } else { 5 };
    let palette: [u8; 8] = std::array::from_fn(|i| match i as u64 {
        0 => a as u8,
        1 => b as u8,
        i if i <= last => (((last + 1 - i) * a + (i - 1) * b + 1) / last) as u8,
        6 => 0,
        _ => u8::MAX,
    });
    std::array::from_fn(|i| palette[(block >> (16 + 3 * i) & 7) as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of one channel whose texels have the indices 0 to 7, twice.
    fn counting(ends: [u8; 2]) -> Vec<u8> {
        let indices = (0..16).fold(0u64, |bits, i| bits | (i % 8) << (3 * i));
        let word = indices << 16 | u64::from(ends[1]) << 8 | u64::from(ends[0]);
        word.to_le_bytes().into()
    }

    #[test]
    fn values_between_the_ends_have_equal_steps() {
        let reds = |ends| BlockFormat::Bc4.decode(&counting(ends), 4, 2).unwrap();
        let first = |data: Vec<u8>| data.chunks_exact(4).map(|texel| texel[0]).collect::<Vec<u8>>();
        assert_eq!(first(reds([210, 0])), [210, 0, 180, 150, 120, 90, 60, 30]);
        assert_eq!(first(reds([0, 200])), [0, 200, 40, 80, 120, 160, 0, 255]);
        // 6/7 becomes 1 and 5/7 becomes 0, because 1 is added before the division.
        assert_eq!(first(reds([1, 0])), [1, 0, 1, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn colors_have_two_or_one_between_their_ends() {
        let block = |ends: [u16; 2]| {
            let [a, b] = ends.map(u16::to_le_bytes);
            [a[0], a[1], b[0], b[1], 0b1110_0100, 0, 0, 0]
        };
        let row = |format: BlockFormat, data: &[u8]| format.decode(data, 4, 1).unwrap();
        // From white to black, and the other way round
        let two = row(BlockFormat::Bc1, &block([0xffff, 0]));
        assert_eq!(
            two,
            [[255; 4], [0, 0, 0, 255], [170, 170, 170, 255], [85, 85, 85, 255]].concat()
        );
        let one = row(BlockFormat::Bc1, &block([0, 0xffff]));
        assert_eq!(one, [[0, 0, 0, 255], [255; 4], [128, 128, 128, 255], [0; 4]].concat());
        // BC2 and BC3 have no holes.
        let alpha = [0x10, 0x32, 0, 0, 0, 0, 0, 0];
        let bc2 = row(BlockFormat::Bc2, &[alpha, block([0, 0xffff])].concat());
        assert_eq!(
            bc2,
            [[0, 0, 0, 0], [255, 255, 255, 17], [85, 85, 85, 34], [170, 170, 170, 51]].concat()
        );
    }

    #[test]
    fn texels_outside_the_picture_are_cut_off() {
        let data = counting([210, 0]).repeat(4);
        let picture = BlockFormat::Bc4.decode(&data, 5, 6).unwrap();
        assert_eq!(picture.len(), 4 * 5 * 6);
        // The fifth column is the first column of the second block.
        assert_eq!((picture[4 * 4], picture[4 * (4 * 5)]), (210, 210));
        assert_eq!(BlockFormat::Bc4.decode(&data[..31], 5, 6), None);
        assert_eq!(BlockFormat::Bc1.decode(&data, usize::MAX, usize::MAX), None);
    }
}
