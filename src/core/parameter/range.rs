use super::Value;
use crate::math::list;
use std::fmt;

/// Valid values of a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Range<T> {
    /// All finite numbers.
    Any,
    /// Numbers from the first to the second, including both.
    FromTo(T, T),
    /// This number and all larger numbers.
    AtLeast(T),
    /// Numbers larger than this number.
    Above(T),
    /// Numbers above the first, up to and including the second.
    AboveTo(T, T),
    /// Numbers between the first and the second, without both.
    Between(T, T),
}

impl<T: Value + PartialOrd> Range<T> {
    /// Returns true if `value` is in the range; false for NaN and infinities.
    pub fn contains(self, value: T) -> bool {
        value.is_finite()
            && match self {
                Self::Any => true,
                Self::FromTo(min, max) => min <= value && value <= max,
                Self::AtLeast(min) => min <= value,
                Self::Above(min) => min < value,
                Self::AboveTo(min, max) => min < value && value <= max,
                Self::Between(min, max) => min < value && value < max,
            }
    }
}

impl Range<f32> {
    /// If any of `numbers` is out of the range, returns two texts: the numbers, such as `1.5`, and
    /// the rule, such as `a number from 0 to 1`. `None` if all numbers are in the range.
    pub fn violation(self, numbers: &[f32]) -> Option<(String, String)> {
        if numbers.iter().all(|&number| self.contains(number)) {
            return None;
        }
        let (value, count) = match numbers {
            [number] => (number.to_string(), "a"),
            [_, _] => (list(numbers), "two"),
            _ => (list(numbers), "three"),
        };
        let plural = if numbers.len() > 1 { "s" } else { "" };
        let rule = match self {
            Self::Any => format!("{count} finite number{plural}"),
            Self::AtLeast(_) => format!("{count} finite number{plural}, {self}"),
            Self::Above(_) => format!("{count} finite number{plural} {self}"),
            Self::FromTo(..) | Self::AboveTo(..) | Self::Between(..) => format!("{count} number{plural} {self}"),
        };
        Some((value, rule))
    }
}

impl<T: Value> Range<T> {
    /// Bounds of the range as keywords of a JSON Schema.
    pub fn schema(self) -> Vec<(&'static str, serde_json::Value)> {
        // Parse the number from its text, so that it has the same digits as the documentation. A
        // 32-bit float that is converted to a double has other digits.
        let number = |value: T| serde_json::from_str(&value.text()).unwrap_or_default();
        match self {
            Self::Any => Vec::new(),
            Self::FromTo(min, max) => vec![("minimum", number(min)), ("maximum", number(max))],
            Self::AtLeast(min) => vec![("minimum", number(min))],
            Self::Above(min) => vec![("exclusiveMinimum", number(min))],
            Self::AboveTo(min, max) => vec![("exclusiveMinimum", number(min)), ("maximum", number(max))],
            Self::Between(min, max) => vec![("exclusiveMinimum", number(min)), ("exclusiveMaximum", number(max))],
        }
    }
}

impl<T: Value> fmt::Display for Range<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// Short text of a number: `1e10` for 10000000000.
        fn short<T: Value>(number: &T) -> String {
            let text = number.text();
            match text.parse::<f64>() {
                Ok(number)
                    if text.len() > 8 && text.trim_start_matches(['-', '0', '.']).trim_end_matches('0') == "1" =>
                {
                    format!("{number:e}")
                }
                _ => text,
            }
        }
        match self {
            Self::Any => Ok(()),
            Self::FromTo(min, max) => write!(f, "from {} to {}", short(min), short(max)),
            Self::AtLeast(min) => write!(f, "{} or more", short(min)),
            Self::Above(min) => write!(f, "above {}", short(min)),
            Self::AboveTo(min, max) => write!(f, "above {}, at most {}", short(min), short(max)),
            Self::Between(min, max) => write!(f, "between {} and {}", short(min), short(max)),
        }
    }
}
