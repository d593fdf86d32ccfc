//! Machine-independent bytes of values, as input for hashes.

use super::{Affine3A, DVec3, Quat, UVec2, Vec2, Vec3};
use std::ops::Range;

/// A value that is part of the input of a hash.
///
/// Values that lead to different renders have different bytes, even if the bytes of several values
/// follow each other. The bytes of a value of variable length begin with this length. The bytes of
/// an enum begin with the number of the variant. Floats are encoded by their bits, so that NaN is
/// equal to NaN.
pub trait Encode {
    /// Passes the bytes of the value to `sink`, in one or several calls.
    fn encode(&self, sink: &mut dyn FnMut(&[u8]));

    /// Returns all bytes of the value. Meant for small values.
    fn encoded(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.encode(&mut |part| bytes.extend_from_slice(part));
        bytes
    }
}

/// Implements [`Encode`] for a struct by encoding its fields in order. All fields must be listed.
/// If a field is missing, the code does not compile.
#[macro_export]
macro_rules! encode_fields {
    ($type:ident { $($field:ident),+ $(,)? }) => {
        impl $crate::math::Encode for $type {
            fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
                let Self { $($field),+ } = self;
                $($crate::math::Encode::encode($field, sink);)+
            }
        }
    };
}
pub use encode_fields;

/// Implements [`Encode`] for an enum by a number for each variant, followed by the variant's
/// fields. All variants and fields must be listed.
macro_rules! encode_variants {
    ($type:ident { $($tag:literal => $variant:ident $(($($item:ident),+))? $({ $($field:ident),+ })?),+ $(,)? }) => {
        impl $crate::math::Encode for $type {
            fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
                match self {
                    $(Self::$variant $(($($item),+))? $({ $($field),+ })? => {
                        sink(&[$tag]);
                        $($($crate::math::Encode::encode($item, sink);)+)?
                        $($($crate::math::Encode::encode($field, sink);)+)?
                    })+
                }
            }
        }
    };
}
pub(crate) use encode_variants;

macro_rules! encode_numbers {
    ($($type:ty),+) => {$(
        impl Encode for $type {
            fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
                sink(&self.to_le_bytes());
            }
        }
    )+};
}
encode_numbers!(u8, u16, u32, u64, half::f16, f32, f64);

impl Encode for usize {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        (*self as u64).encode(sink);
    }
}

impl Encode for bool {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        u8::from(*self).encode(sink);
    }
}

impl Encode for str {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.len().encode(sink);
        sink(self.as_bytes());
    }
}

impl Encode for String {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.as_str().encode(sink);
    }
}

impl<T: Encode> Encode for [T] {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.len().encode(sink);
        self.iter().for_each(|item| item.encode(sink));
    }
}

impl<T: Encode> Encode for Vec<T> {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.as_slice().encode(sink);
    }
}

impl<T: Encode, const N: usize> Encode for [T; N] {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.iter().for_each(|item| item.encode(sink));
    }
}

impl<T: Encode> Encode for Option<T> {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.is_some().encode(sink);
        if let Some(value) = self {
            value.encode(sink);
        }
    }
}

impl<T: Encode> Encode for Range<T> {
    fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
        self.start.encode(sink);
        self.end.encode(sink);
    }
}

macro_rules! encode_arrays {
    ($($type:ty => $to_array:ident),+) => {$(
        impl Encode for $type {
            fn encode(&self, sink: &mut dyn FnMut(&[u8])) {
                self.$to_array().encode(sink);
            }
        }
    )+};
}
encode_arrays!(Vec2 => to_array, Vec3 => to_array, DVec3 => to_array, UVec2 => to_array, Quat => to_array, Affine3A => to_cols_array);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn adjacent_values_have_different_bytes() {
        struct Pair {
            a: String,
            b: Vec<u8>,
        }
        encode_fields!(Pair { a, b });
        let of = |a: &str, b: &[u8]| {
            let (a, b) = (a.to_string(), b.to_vec());
            Pair { a, b }.encoded()
        };
        assert_ne!(of("x", b"yz"), of("xy", b"z"));
        assert_ne!(of("", b"x"), of("x", b""));
        assert_eq!(of("x", b"yz"), of("x", b"yz"));
        assert_ne!([Some(1u8), None].encoded(), [None, Some(1u8)].encoded());
    }

    #[test]
    fn variants_begin_with_their_number() {
        enum Shape {
            Round(f32),
            Flat { width: f32, height: f32 },
            Gone,
        }
        encode_variants!(Shape { 0 => Round(radius), 1 => Flat { width, height }, 2 => Gone });
        let [width, height] = [1.0, 2.0];
        assert_eq!(Shape::Round(1.0).encoded(), [0, 0, 0, 128, 63]);
        assert_eq!(Shape::Flat { width, height }.encoded().len(), 9);
        assert_eq!(Shape::Gone.encoded(), [2]);
    }

    #[test]
    fn floats_are_encoded_by_their_bits() {
        assert_eq!(f32::NAN.encoded(), f32::NAN.encoded());
        assert_ne!((-0.0f32).encoded(), 0.0f32.encoded());
    }
}
