//! Numbers of 16 bits (IEEE 754-2019, binary16), those that are finite and not negative.

/// The largest of them.
const MAX: f32 = 65504.0;
/// The smallest with all 11 digits, 2⁻¹⁴.
const MIN_NORMAL: f32 = 1.0 / 16384.0;
/// Spacing of those below, 2⁻²⁴.
const STEP: f32 = 1.0 / 16_777_216.0;
/// What the exponents' biases of 127 and 15 differ by, in the place of an `f32`'s exponent.
const BIAS: u32 = (127 - 15) << 23;

/// The value of `bits`, exactly.
pub(super) fn decode(bits: u16) -> f32 {
    if bits < 1 << 10 {
        bits as f32 * STEP
    } else {
        f32::from_bits(((bits as u32) << 13) + BIAS)
    }
}

/// The nearest to `value`, which is 0 or more; of two the even one.
pub(super) fn encode(value: f32) -> u16 {
    if value < MIN_NORMAL {
        return (value / STEP).round_ties_even() as u16;
    }
    let bits = value.min(MAX).to_bits() - BIAS;
    // Half a unit of the last digit that stays, less one where that digit is even; a carry into the exponent is right.
    ((bits + 0xfff + ((bits >> 13) & 1)) >> 13) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        for (bits, value) in [
            (0, 0.0),
            (1, STEP),
            (0x3ff, 1023.0 * STEP),
            (0x400, MIN_NORMAL),
            (0x3555, 0.333_251_95),
            (0x3c00, 1.0),
            (0x4248, 3.140_625),
            (0x7bff, MAX),
        ] {
            assert_eq!(decode(bits), value);
        }
    }

    /// Against the definition: the nearest of all, and of two at one distance the one whose last bit is 0.
    #[test]
    fn the_nearest_is_chosen() {
        for bits in 0..0x7bff {
            let (low, high) = (decode(bits), decode(bits + 1));
            let middle = 0.5 * (low + high);
            let (below, above) = (
                f32::from_bits(middle.to_bits() - 1),
                f32::from_bits(middle.to_bits() + 1),
            );
            assert_eq!((encode(low), encode(below), encode(above)), (bits, bits, bits + 1));
            assert_eq!(encode(middle), bits + (bits & 1));
        }
        assert_eq!((encode(MAX), encode(1e9), encode(1e-9)), (0x7bff, 0x7bff, 0));
    }
}
