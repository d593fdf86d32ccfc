//! Colour maps for numbers, in 8-bit sRGB.

/// The colour map `magma` of Nathaniel Smith and Stéfan van der Walt (2015, matplotlib, CC0), every
/// eighth entry: even steps of lightness from black over purple and orange to pale yellow.
const MAGMA: [u32; 33] = [
    0x000004, 0x030311, 0x0a0822, 0x130d33, 0x1d1146, 0x28115a, 0x36106a, 0x430f76, 0x50127c, 0x5d177f, 0x691c81,
    0x762181, 0x822681, 0x8f2a81, 0x9c2e7f, 0xa9327d, 0xb63779, 0xc33b75, 0xcf4170, 0xdb486a, 0xe65163, 0xee5c5e,
    0xf5695c, 0xf9785d, 0xfb8761, 0xfd9668, 0xfea571, 0xfeb47b, 0xfec387, 0xfed194, 0xfde0a2, 0xfceeb0, 0xfcfdbf,
];

/// Colours at both ends and in the middle of the map of Moreland 2009, "Diverging Color Maps for
/// Scientific Visualization".
const COOL_TO_WARM: [u32; 3] = [0x3b4cc0, 0xdddddd, 0xb40426];

/// Colour of the map magma at the position `share`, from 0 (black) to 1 (pale yellow).
pub fn magma(share: f32) -> [u8; 3] {
    between(&MAGMA, share)
}

/// Colour of Moreland's map for `value`: blue for −1, light grey for 0, red for 1.
pub fn diverging(value: f32) -> [u8; 3] {
    between(&COOL_TO_WARM, 0.5 + 0.5 * value)
}

/// Interpolated colour of the map `colors` at the position `share`, 0 to 1. NaN gives the first
/// colour.
fn between(colors: &[u32], share: f32) -> [u8; 3] {
    let place = f32::max(share, 0.0).min(1.0) * colors.len().saturating_sub(1) as f32;
    let (first, rest) = (place as usize, place.fract());
    let at = |i: usize| {
        colors
            .get(i)
            .or(colors.last())
            .copied()
            .unwrap_or_default()
            .to_be_bytes()
    };
    let (from, to) = (at(first), at(first + 1));
    [1, 2, 3].map(|c| (from[c] as f32 + rest * (to[c] as f32 - from[c] as f32)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_middles() {
        assert_eq!(
            (magma(0.0), magma(1.0), magma(9.0)),
            ([0, 0, 4], [252, 253, 191], [252, 253, 191])
        );
        // Entry 127.5 of matplotlib's 256 lies between (181, 54, 122) and (183, 55, 121).
        assert_eq!(magma(0.5), [182, 55, 121]);
        assert_eq!(
            (diverging(-1.0), diverging(0.0), diverging(1.0)),
            ([59, 76, 192], [221; 3], [180, 4, 38])
        );
        assert_eq!((diverging(-7.0), magma(f32::NAN)), ([59, 76, 192], [0, 0, 4]));
    }

    #[test]
    fn magma_gets_lighter() {
        let lightness = |i: usize| {
            let [r, g, b] = magma(i as f32 / 255.0).map(|v| crate::color::srgb::decode(v as f32 / 255.0));
            0.2126 * r + 0.7152 * g + 0.0722 * b
        };
        assert!((1..256).all(|i| lightness(i) > lightness(i - 1)));
    }
}
