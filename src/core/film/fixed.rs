//! Exact sums: fixed-point numbers whose terms may come in any order and be subtracted again.
//!
//! Sums of floats depend on their order, so a picture made in parts would differ in its last bits from one made at once. The totals of a pixel are
//! therefore whole numbers of 2⁻⁶⁴ in 128 bits. The f64 sum of a pass is rounded once, towards zero, when it comes; all further sums are exact. Sums
//! that are too large stay at the end of the range.
//!
//! Radiance up to 2⁶³ and squares of radiance from 2⁻⁶⁴ are represented. The 208 bytes of a pixel are less than twice what floats would take. The
//! spread of blocks, from which `--noise` estimates errors, stays in f64: one render adds it in order, and joined parts have it up to rounding.

/// A whole number of 2 to the -`$fraction` in `$bits`, which are `$words` words.
macro_rules! fixed_point {
    ($(#[$doc:meta])* $name:ident: $integer:ty, $fraction:literal, $words:literal) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct $name($integer);

        impl $name {
            /// Words of 32 bits that hold one.
            pub const WORDS: usize = $words;
            /// Units in 1.
            const ONE: f64 = (1u128 << $fraction) as f64;

            /// The nearest towards zero; 0 for NaN.
            pub fn new(value: f64) -> Self {
                // Scaling by a power of two is exact, and the cast saturates.
                Self((value * Self::ONE) as $integer)
            }

            /// Rounded to a float.
            pub fn to_f64(self) -> f64 {
                self.0 as f64 / Self::ONE
            }

            /// The sum, exactly.
            pub fn plus(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }

            /// The difference, exactly.
            pub fn minus(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }

            /// Words of the number, the lowest first.
            pub fn to_words(self) -> [u32; $words] {
                std::array::from_fn(|i| (self.0 >> (32 * i)) as u32)
            }

            /// The number of these words.
            pub fn from_words(words: [u32; $words]) -> Self {
                Self(words.iter().rev().fold(0, |bits, &word| bits << 32 | word as $integer))
            }
        }
    };
}

fixed_point! {
    /// For values of any size: from 2⁻⁶⁴ to 2⁶³.
    Fixed: i128, 64, 4
}
fixed_point! {
    /// For values up to 1, of which there are less than 2³¹: they are kept to 2⁻³².
    Narrow: i64, 32, 2
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn order_does_not_matter() {
        // As floats, the small ones would vanish beside the large one.
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
    fn what_is_too_large_stays_at_the_end() {
        let max = Fixed::new(1e30);
        assert_eq!(max, Fixed::new(f64::INFINITY));
        assert_eq!(max.plus(Fixed::new(1.0)), max);
        assert_eq!(Fixed::new(f64::NAN), Fixed::default());
        assert_eq!(Fixed::new(-1e30).to_f64(), -(2f64.powi(63)));
    }

    #[test]
    fn words_hold_it() {
        for value in [0.0, 1.0, -1.0, 0.1, -1e-18, 1e18, -3e12] {
            let narrow = Narrow::new(value);
            assert_eq!(Narrow::from_words(narrow.to_words()), narrow);
            let fixed = Fixed::new(value);
            assert_eq!(Fixed::from_words(fixed.to_words()), fixed);
        }
        assert_eq!(Fixed::new(1.5).to_words(), [0, 1 << 31, 1, 0]);
    }
}
