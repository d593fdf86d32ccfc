/// A sum whose terms may come in any order, and be taken out again: a whole number of 2⁻⁶⁴ths.
///
/// Floats round each time they are added, so their sums depend on the order. Here only a term is rounded, towards zero, when it
/// comes. Sums beyond ±2⁶³ stay there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Fixed(i128);

/// Units in 1.
const ONE: f64 = (1u128 << 64) as f64;

impl Fixed {
    /// Words that hold one.
    pub const WORDS: usize = 4;

    /// The nearest towards zero; 0 for NaN.
    pub fn new(value: f64) -> Self {
        // Scaling by a power of two is exact, and the cast saturates.
        Self((value * ONE) as i128)
    }

    /// Rounded to a float.
    pub fn to_f64(self) -> f64 {
        self.0 as f64 / ONE
    }

    /// The sum, exactly.
    pub fn plus(self, other: Self) -> Self {
        Self(self.0.saturating_add(other.0))
    }

    /// The difference, exactly.
    pub fn minus(self, other: Self) -> Self {
        Self(self.0.saturating_sub(other.0))
    }

    /// The word of 32 bits at place `i`, the lowest at 0.
    pub fn word(self, i: usize) -> u32 {
        (self.0 >> (32 * i)) as u32
    }

    /// The one of these words.
    pub fn from_words(words: [u32; Self::WORDS]) -> Self {
        let bits = words.iter().rev().fold(0u128, |bits, &word| bits << 32 | word as u128);
        Self(bits as i128)
    }
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
        let most = Fixed::new(1e30);
        assert_eq!(most, Fixed::new(f64::INFINITY));
        assert_eq!(most.plus(Fixed::new(1.0)), most);
        assert_eq!(Fixed::new(f64::NAN), Fixed::default());
        assert_eq!(Fixed::new(-1e30).to_f64(), -(2f64.powi(63)));
    }

    #[test]
    fn words_hold_it() {
        for value in [0.0, 1.0, -1.0, 0.1, -1e-18, 1e18, -3e12] {
            let fixed = Fixed::new(value);
            assert_eq!(Fixed::from_words([0, 1, 2, 3].map(|i| fixed.word(i))), fixed);
        }
        assert_eq!([0, 1, 2, 3].map(|i| Fixed::new(1.5).word(i)), [0, 1 << 31, 1, 0]);
    }
}
