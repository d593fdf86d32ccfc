//! Types of parameters. A type reads, writes and describes its values.

use super::{Named, join_names, name_of};
use crate::math::{DVec3, Vec2, Vec3};
use serde_json::json;

/// A type of parameters. Its values can be converted from and to text.
pub trait Value: Copy + PartialEq + 'static {
    /// Placeholder of the value in the help of a flag.
    const PLACEHOLDER: &'static str;
    /// Description of valid values, used in messages.
    const KIND: &'static str;
    /// True if scene files write the value as a string.
    const IS_STRING: bool = false;
    /// True if scene files write the value as a number.
    const IS_NUMBER: bool = true;

    /// True if scene files may also write the value as a list of numbers.
    const IS_LIST: bool = false;

    /// Parses a value.
    fn of_text(text: &str) -> Option<Self>;

    /// Text of the value in the form in which users write it.
    fn text(&self) -> String;

    /// Names of all values. Empty if values have no names.
    fn names() -> Vec<&'static str> {
        Vec::new()
    }

    /// JSON Schema of the value in a scene file. The range of a number is not included.
    fn schema() -> serde_json::Value;

    /// Returns true if the value is valid: false for NaN and infinities.
    fn is_finite(&self) -> bool {
        true
    }
}

macro_rules! scalars {
    ($($ty:ty: $kind:literal, $is_finite:expr, $schema:tt;)*) => {
        $(impl Value for $ty {
            const PLACEHOLDER: &'static str = "N";
            const KIND: &'static str = $kind;

            fn of_text(text: &str) -> Option<Self> {
                text.parse().ok()
            }

            fn text(&self) -> String {
                self.to_string()
            }

            fn schema() -> serde_json::Value {
                json!($schema)
            }

            fn is_finite(&self) -> bool {
                $is_finite(*self)
            }
        })*
    };
}

scalars! {
    u32: "a whole number", |_| true, { "type": "integer", "minimum": 0, "maximum": (u32::MAX) };
    u64: "a whole number", |_| true, { "type": "integer", "minimum": 0 };
    f32: "a number", f32::is_finite, { "type": "number" };
}

/// Implements [`Value`] for vectors.
macro_rules! vectors {
    ($($ty:ty: $number:ty, $count:literal, $placeholder:literal, $kind:literal;)*) => {
        $(impl Value for $ty {
            const PLACEHOLDER: &'static str = $placeholder;
            const KIND: &'static str = $kind;
            const IS_NUMBER: bool = false;
            const IS_LIST: bool = true;

            fn of_text(text: &str) -> Option<Self> {
                numbers::<$number>(text)?.try_into().ok().map(<[$number; $count]>::into)
            }

            fn text(&self) -> String {
                self.to_array().map(|number| number.to_string()).join(",")
            }

            fn schema() -> serde_json::Value {
                json!({ "type": "array", "items": { "type": "number" }, "minItems": $count, "maxItems": $count })
            }

            fn is_finite(&self) -> bool {
                <$ty>::is_finite(*self)
            }
        })*
    };
}

vectors! {
    Vec2: f32, 2, "X,Y", "two numbers";
    Vec3: f32, 3, "X,Y,Z", "three numbers";
    DVec3: f64, 3, "X,Y,Z", "three numbers";
}

/// Parses numbers separated by commas.
pub fn numbers<T: std::str::FromStr>(text: &str) -> Option<Vec<T>> {
    text.split(',').map(|number| number.trim().parse().ok()).collect()
}

impl<T: Named> Value for T {
    const PLACEHOLDER: &'static str = "NAME";
    const KIND: &'static str = "a name";
    const IS_STRING: bool = true;
    const IS_NUMBER: bool = false;

    fn of_text(text: &str) -> Option<Self> {
        T::NAMES.iter().find(|(name, _)| *name == text).map(|(_, value)| *value)
    }

    fn text(&self) -> String {
        name_of(T::NAMES, *self).into()
    }

    fn names() -> Vec<&'static str> {
        T::NAMES.iter().map(|(name, _)| *name).collect()
    }

    fn schema() -> serde_json::Value {
        json!({ "enum": Self::names() })
    }
}

/// Help text for an invalid value, which describes valid values. `range` is the text of the range.
pub(super) fn expected<T: Value>(range: &str) -> String {
    match T::names().as_slice() {
        [] if range.is_empty() => format!("use {}", T::KIND),
        [] => format!("use {} {range}", T::KIND),
        names => {
            let known: Vec<(&str, ())> = names.iter().map(|name| (*name, ())).collect();
            format!("choose among {}", join_names(&known))
        }
    }
}
