//! `[part."GLOB"]`: changes of the parts of OBJ files whose names match the glob.

use super::section::{Section, section, value};
use super::{MaterialSection, Scale};
use crate::io::PartMovement;
use crate::math::Vec3;
use crate::options::Parameter;
use serde::de::{Deserializer, Error, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::sync::LazyLock;

section! {
    /// Keys of `[part."GLOB"]` that materials do not have.
    #[derive(Default)]
    pub struct PartKeys {
        required {}
        /// false: leaves the parts out; true: shows them if an earlier section hides them
        visible: bool, default "true";
        /// Material of the parts, by its name in the MTL file or in the scene file
        ///
        /// Other keys of the section change the material for these parts alone.
        material: String, default "that of the file";
        /// Translation in units of the OBJ file; applied last
        translate: [f32; 3], default "0 0 0";
        /// Rotation in degrees about the fixed x, y and z axes, in that order
        ///
        /// Each part turns about the middle of its bounding box. If the pattern matches the name of
        /// an object or of a group, all faces with this name turn together.
        rotate: [f32; 3], default "0 0 0";
        /// Scale about the same centre: one factor, or one for each axis; applied first
        scale: Scale, default "1";
    }
}

/// `[part."GLOB"]`: changes of parts. Keys of `[material.NAME]` are also valid. They change the
/// material of these parts only.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PartSection {
    /// Keys that only parts have.
    #[serde(flatten)]
    pub keys: PartKeys,
    /// Changes to the material.
    #[serde(flatten)]
    pub material: MaterialSection,
}

/// Names of all keys of the section.
static NAMES: LazyLock<Vec<&'static str>> = LazyLock::new(|| PartSection::all_keys().map(|key| key.key).collect());

impl PartSection {
    /// All keys of the section. Keys of materials come last.
    pub(crate) fn all_keys() -> impl Iterator<Item = &'static Parameter> {
        let of_materials = MaterialSection::KEYS.iter().filter(|key| key.key != "patch");
        PartKeys::KEYS.iter().chain(of_materials)
    }

    /// Sets all keys that `other` has, and replaces old values.
    pub(super) fn set_over(&mut self, other: Self) {
        self.keys.set_over(other.keys);
        self.material.set_over(other.material);
    }

    /// Keys that move the parts.
    pub(super) fn movement(&self) -> PartMovement {
        PartMovement {
            translate: value(&self.keys.translate).map(Vec3::from),
            rotate: value(&self.keys.rotate).map(Vec3::from),
            scale: value(&self.keys.scale).map(Scale::factors),
        }
    }

    /// Returns true if the section assigns another material to the parts.
    pub(super) fn has_material(&self) -> bool {
        self.keys.material.is_some() || self.changes_material()
    }

    /// Returns true if the section has keys that change the material of the parts.
    pub(super) fn changes_material(&self) -> bool {
        !self.material.given().is_empty()
    }
}

/// Name of a key of the section. If a name is unknown, the error points to it.
struct Key(&'static str);

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let names: &'static [&'static str] = &NAMES;
        let known = names.iter().find(|known| **known == name);
        known
            .map(|known| Self(known))
            .ok_or_else(|| D::Error::unknown_field(&name, names))
    }
}

impl<'de> Deserialize<'de> for PartSection {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Table;
        impl<'de> Visitor<'de> for Table {
            type Value = PartSection;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a table with keys of a part")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut table: A) -> Result<PartSection, A::Error> {
                let mut section = PartSection::default();
                while let Some(Key(key)) = table.next_key()? {
                    let is_read =
                        section.keys.read_key(key, &mut table)? || section.material.read_key(key, &mut table)?;
                    if !is_read {
                        return Err(A::Error::unknown_field(key, &NAMES));
                    }
                }
                Ok(section)
            }
        }
        deserializer.deserialize_map(Table)
    }
}
