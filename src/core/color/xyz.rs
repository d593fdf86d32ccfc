//! Conversion between CIE XYZ and linear Rec.709 with the white D65.

/// XYZ of the white D65, with Y = 1.
pub const WHITE: [f32; 3] = [0.950_455_9, 1.0, 1.089_057_8];

/// Converts linear Rec.709 to XYZ, in which white has Y = 1 (IEC 61966-2-1).
pub fn linear_to_xyz([r, g, b]: [f32; 3]) -> [f32; 3] {
    [
        0.412_390_8 * r + 0.357_584_33 * g + 0.180_480_8 * b,
        0.212_639 * r + 0.715_168_65 * g + 0.072_192_32 * b,
        0.019_330_818 * r + 0.119_194_78 * g + 0.950_532_15 * b,
    ]
}

/// Converts XYZ, in which white has Y = 1, to linear Rec.709.
pub fn xyz_to_linear([x, y, z]: [f32; 3]) -> [f32; 3] {
    [
        3.240_97 * x - 1.537_383_2 * y - 0.498_610_76 * z,
        -0.969_243_65 * x + 1.875_967_5 * y + 0.041_555_06 * z,
        0.055_630_08 * x - 0.203_976_96 * y + 1.056_971_5 * z,
    ]
}

/// Converts XYZ in which white is (1, 1, 1) (equal energy) to linear Rec.709: each coordinate is
/// multiplied by the same coordinate of [`WHITE`]. Greys are converted exactly.
pub fn equal_energy_to_linear(xyz: [f32; 3]) -> [f32; 3] {
    match xyz {
        [x, y, z] if x == y && y == z => xyz,
        [x, y, z] => xyz_to_linear([x * WHITE[0], y * WHITE[1], z * WHITE[2]]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn white_is_d65_and_both_are_inverse() {
        let white = linear_to_xyz([1.0; 3]);
        for (c, expected) in [0.9505, 1.0, 1.089].into_iter().enumerate() {
            assert!((white[c] - expected).abs() < 1e-3, "{white:?}");
        }
        for rgb in [[1.0; 3], [0.2, 0.5, 0.9], [1.0, 0.0, 0.0]] {
            let back = xyz_to_linear(linear_to_xyz(rgb));
            assert!((0..3).all(|c| (back[c] - rgb[c]).abs() < 1e-5), "{rgb:?}: {back:?}");
        }
        assert_eq!(equal_energy_to_linear([0.5; 3]), [0.5; 3]);
        let almost = equal_energy_to_linear([0.5, 0.5, 0.500_001]);
        assert!(almost.iter().all(|c| (c - 0.5).abs() < 1e-5), "{almost:?}");
    }
}
