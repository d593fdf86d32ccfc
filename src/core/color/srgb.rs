//! The sRGB transfer curve (IEC 61966-2-1) between linear light and 8-bit display values.

/// Converts linear [0, 1] to sRGB-encoded [0, 1]. Values outside are clamped, and NaN becomes 0.
pub fn encode(linear: f32) -> f32 {
    // `max` maps NaN to 0, which `clamp` would let through.
    let x = f32::max(linear, 0.0).min(1.0);
    if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    }
}

/// Converts sRGB-encoded [0, 1] to linear [0, 1], the inverse of [`encode`] up to rounding.
pub fn decode(encoded: f32) -> f32 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Converts linear light to the nearest 8-bit sRGB code.
pub fn encode_u8(linear: f32) -> u8 {
    (encode(linear) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(encode_u8(0.0), 0);
        assert_eq!(encode_u8(1.0), 255);
        assert_eq!(encode_u8(7.0), 255);
        assert_eq!(encode_u8(-1.0), 0);
        assert_eq!(encode_u8(f32::NAN), 0);
        // Compare with the textbook values for 18 % grey and for half intensity
        assert_eq!(encode_u8(0.18), 118);
        assert_eq!(encode_u8(0.5), 188);
        // Both branches agree at their border.
        assert!((encode(0.003_130_8) - encode(0.003_130_9)).abs() < 1e-5);
    }

    #[test]
    fn decoding_is_the_inverse_of_encoding() {
        for code in 0..=255 {
            assert_eq!(encode_u8(decode(code as f32 / 255.0)), code);
        }
        assert_eq!((decode(0.0), decode(1.0)), (0.0, 1.0));
        // Compare with the textbook value for the middle grey of 8 bits
        assert!((decode(128.0 / 255.0) - 0.215_86).abs() < 1e-5);
    }
}
