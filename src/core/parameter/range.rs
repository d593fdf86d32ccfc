use super::Value;
use crate::math::list;
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
    /// Numbers between both.
    Between(T, T),
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
                Self::Between(min, max) => min < value && value < max,
            }
    }
}

impl Range<f32> {
    /// Returns what `numbers` are and what they must be, as texts, unless all of them are in the
    /// range: `1.5`, and `a number from 0 to 1`.
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
    /// Bounds as keywords of a JSON Schema.
    pub fn schema(self) -> Vec<(&'static str, serde_json::Value)> {
        // Numbers are read from their text, whose digits are those of the documentation: 32-bit floats have others as doubles.
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
        /// A number as people write it: `1e10` for 10000000000.
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
