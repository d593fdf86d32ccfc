use super::Value;
use std::fmt;

/// The values that a number may have.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range<T> {
    /// All finite numbers.
    Any,
    /// From the first number to the second, both included.
    FromTo(T, T),
    /// This number or a larger one.
    AtLeast(T),
    /// Larger numbers.
    Above(T),
    /// Larger numbers than the first, up to the second.
    AboveTo(T, T),
}

impl<T: Value + PartialOrd> Range<T> {
    /// Whether `value` may be taken; NaN and infinities never.
    pub fn contains(self, value: T) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::FromTo(min, max) => min <= value && value <= max,
                Self::AtLeast(min) => min <= value,
                Self::Above(min) => min < value,
                Self::AboveTo(min, max) => min < value && value <= max,
            }
    }
}

impl<T: Value> fmt::Display for Range<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Any => Ok(()),
            Self::FromTo(min, max) => write!(f, "from {} to {}", min.text(), max.text()),
            Self::AtLeast(min) => write!(f, "{} or more", min.text()),
            Self::Above(min) => write!(f, "above {}", min.text()),
            Self::AboveTo(min, max) => write!(f, "above {}, at most {}", min.text(), max.text()),
        }
    }
}
