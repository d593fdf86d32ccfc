//! Exact sums in fixed point. Terms can be added in any order, and subtracted again, with
//! bit-identical results.
//!
//! Sums of floats depend on their order, so a picture made in parts would differ in its last bits
//! from a picture made at once. The totals of a pixel are therefore integer multiples of 2⁻⁶⁴ in
//! 128 bits. The f64 sum of a pass is rounded once, towards zero, before it is added; all further
//! sums are exact. Sums that overflow saturate.
//!
//! Sums can be as large as 2⁶³, and terms as small as 2⁻⁶⁴, which matters for squares of radiance.
//! Few sums use the whole range, so tiles store only the bytes that their pixels need (`packed`).
//! The spread of blocks, from which `--noise` estimates errors, stays in f64: one render updates
//! the spread in order, and the spread of merged parts is equal up to rounding.

use super::packed::Stored;

/// Defines a fixed-point type: an integer of type `$integer`, in units of 2 to the power of
/// -`$fraction`.
macro_rules! fixed_point {
    ($(#[$doc:meta])* $name:ident: $integer:ty, $fraction:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name($integer);

        impl $name {
            /// The number 1, in units of the last bit.
            const ONE: f64 = (1u128 << $fraction) as f64;

            /// Value rounded towards zero; 0 for NaN.
            pub fn new(value: f64) -> Self {
                // Scaling by a power of two is exact, and the cast saturates.
                let scaled = value * Self::ONE;
                // Fast path, because the cast to 128 bits is slow: the float is an integer, and far
                // from the limits
                let bits = scaled.to_bits();
                let shift = ((bits >> 52) as u32 & 0x7ff).wrapping_sub(1075);
                if <$integer>::BITS == 128 && shift < 74 {
                    let mantissa = (bits & ((1 << 52) - 1) | 1 << 52) as $integer;
                    let magnitude = mantissa << shift;
                    return Self(if value < 0.0 { -magnitude } else { magnitude });
                }
                Self(scaled as $integer)
            }

            /// Value rounded to a float.
            pub fn to_f64(self) -> f64 {
                self.0 as f64 / Self::ONE
            }

            /// Exact sum; saturates.
            pub fn plus(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }

            /// Exact difference; saturates.
            pub fn minus(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }

        impl Stored for $name {
            type Integer = $integer;

            fn to_integer(self) -> $integer {
                self.0
            }

            fn of_integer(integer: $integer) -> Self {
                Self(integer)
            }
        }
    };
}

fixed_point! {
    /// Sums up to 2⁶³, with a resolution of 2⁻⁶⁴.
    Fixed: i128, 64
}
fixed_point! {
    /// Sums of fewer than 2³¹ values from −1 to 1, with a resolution of 2⁻³².
    Narrow: i64, 32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_order() {
        // As floats, the small terms would vanish beside the large one.
        let values = [1e9, 1e-9, -1e9, 3e-9, 0.1, -1e-19];
        let sum = |values: &[f64]| values.iter().fold(Fixed::default(), |sum, &v| sum.plus(Fixed::new(v)));
        let mut backwards = values;
        backwards.reverse();
        assert_eq!(sum(&values), sum(&backwards));
        assert!((sum(&values).to_f64() - 0.100000004).abs() < 1e-17);
        let without = sum(&values).minus(Fixed::new(0.1));
        assert!((without.to_f64() - 4e-9).abs() < 1e-18, "{}", without.to_f64());
    }

    #[test]
    fn overflow_saturates() {
        let max = Fixed::new(1e30);
        assert_eq!(max, Fixed::new(f64::INFINITY));
        assert_eq!(max.plus(Fixed::new(1.0)), max);
        assert_eq!(Fixed::new(f64::NAN), Fixed::default());
        assert_eq!(Fixed::new(-1e30).to_f64(), -(2f64.powi(63)));
    }

    /// Floats of all exponents are truncated as by the cast, with and without the fast path.
    #[test]
    fn values_are_rounded_towards_zero() {
        for exponent in 0..0x7ff_u64 {
            for mantissa in [0, 1, 0xf_ffff_ffff_ffff, 0x8_0000_0000_0001, 0x5_5555_5555_5555] {
                for sign in [0, 1 << 63] {
                    let value = f64::from_bits(sign | exponent << 52 | mantissa);
                    let expected = (value * 2f64.powi(64)) as i128;
                    assert_eq!(Fixed::new(value).to_integer(), expected, "{value}");
                    let expected = (value * 2f64.powi(32)) as i64;
                    assert_eq!(Narrow::new(value).to_integer(), expected, "{value}");
                }
            }
        }
    }
}
