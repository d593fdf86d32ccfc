//! Numeric parameters (quantities) of a material. Each has a key in scene files and a range.

use super::{Gloss, Material};
use crate::bsdf::Fresnel;
use crate::color::Spectrum;
use crate::parameter::Range;

/// Range of fractions, such as the opacity.
pub(super) const SHARE: Range<f32> = Range::FromTo(0.0, 1.0);
/// Range of factors and exponents: 0 or more.
pub(super) const NOT_NEGATIVE: Range<f32> = Range::AtLeast(0.0);
/// Range of indices of refraction.
pub(super) const POSITIVE: Range<f32> = Range::Above(0.0);

/// A numeric parameter of materials.
pub struct Quantity {
    /// Key in scene files.
    pub key: &'static str,
    /// Allowed range of each number of the quantity.
    pub range: Range<f32>,
    /// Function that returns the quantity's numbers; empty if the material does not have the
    /// quantity.
    pub numbers: fn(&Material) -> Vec<f32>,
}

impl Quantity {
    /// All quantities.
    pub fn all() -> impl Iterator<Item = &'static Self> {
        Material::FIELDS.iter().chain(OF_GLOSS)
    }
}

/// Range of the numbers of the key `key` of materials in scene files.
pub fn range_of(key: &str) -> Range<f32> {
    let mut quantities = Quantity::all();
    quantities
        .find(|quantity| quantity.key == key)
        .map_or(Range::Any, |quantity| quantity.range)
}

/// Quantities of the reflection model (`gloss`).
const OF_GLOSS: &[Quantity] = &[
    Quantity {
        key: "exponent",
        range: NOT_NEGATIVE,
        numbers: |material| match material.gloss {
            Gloss::Phong(exponent) | Gloss::Blinn(exponent, _) => vec![exponent],
            _ => Vec::new(),
        },
    },
    Quantity {
        key: "metallic",
        range: SHARE,
        numbers: |material| match material.gloss {
            Gloss::Metallic(metallic) => vec![metallic],
            _ => Vec::new(),
        },
    },
    Quantity {
        key: "f0",
        range: SHARE,
        numbers: |material| match material.gloss.fresnel() {
            Fresnel::Schlick { f0 } => f0.to_vec(),
            _ => Vec::new(),
        },
    },
    Quantity {
        key: "eta",
        range: POSITIVE,
        numbers: |material| match material.gloss.fresnel() {
            Fresnel::Dielectric { eta } => vec![eta],
            Fresnel::Conductor { eta, .. } => eta.to_vec(),
            _ => Vec::new(),
        },
    },
    Quantity {
        key: "k",
        range: NOT_NEGATIVE,
        numbers: |material| match material.gloss.fresnel() {
            Fresnel::Conductor { k, .. } => k.to_vec(),
            _ => Vec::new(),
        },
    },
];

/// Type of a field that consists of numbers.
pub(super) trait Numbers {
    fn numbers(&self) -> Vec<f32>;
}

impl Numbers for f32 {
    fn numbers(&self) -> Vec<f32> {
        vec![*self]
    }
}

impl Numbers for Option<f32> {
    fn numbers(&self) -> Vec<f32> {
        self.iter().copied().collect()
    }
}

impl Numbers for Spectrum {
    fn numbers(&self) -> Vec<f32> {
        self.to_array().to_vec()
    }
}

/// Defines [`Material`] by its fields: type, default and, for numbers, range.
macro_rules! quantities {
    ($(#[$attribute:meta])* pub struct $material:ident {
        $($(#[doc = $doc:literal])+ $field:ident: $ty:ty = $default:expr $(, in $range:expr)?;)+
    }) => {
        $(#[$attribute])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $material {
            $($(#[doc = $doc])+ pub $field: $ty,)+
        }

        $crate::math::encode_fields!($material { $($field),+ });

        impl Default for $material {
            /// Black surface.
            fn default() -> Self {
                Self {
                    $($field: $default,)+
                }
            }
        }

        impl $material {
            /// Quantities of the fields that have a range.
            const FIELDS: &'static [Quantity] = &[$($(Quantity {
                key: stringify!($field),
                range: $range,
                numbers: |material| quantities::Numbers::numbers(&material.$field),
            },)?)+];
        }
    };
}
pub(super) use quantities;
