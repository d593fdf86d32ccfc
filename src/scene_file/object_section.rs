use super::LoadParameters;
use super::key_schema::{either, list};
use super::section::{key_types, section, table};
use crate::io::Subdivision;
use crate::math::Vec3;
use crate::options::Range;
use crate::parameter::Value;
use serde::de::{self, Deserializer, Unexpected, Visitor};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::fmt;
use std::path::PathBuf;

section! {
    /// `[[object]]`
    pub struct ObjectSection {
        required {
            /// OBJ file, relative to the scene file; one `[[object]]` for each
            obj: PathBuf;
        }
        /// Name of the object in mattes
        name: String, default "the name of the OBJ file without its extension";
        /// Placement: scale, then rotate, then translate
        ///
        /// `{ translate, rotate, scale }`: scene units, degrees, factors.
        transform: TransformSection, default "as it is";
        /// Placement as four rows of four for column vectors, the last 0 0 0 1
        ///
        /// In place of `transform`.
        matrix: [[f32; 4]; 4], default "as it is";
        /// Placement at time 1, if the object moves
        transform_close: TransformSection, default "as at time 0";
        /// Placement at time 1 as four rows of four
        matrix_close: [[f32; 4]; 4], default "as at time 0";
        /// OBJ file with the same faces and the vertices at time 1
        ///
        /// Vertices move on straight lines.
        obj_close: PathBuf, default "as at time 0";
        /// Steps of subdivision, which make a smooth surface of the faces: 0 to 12, or `"pixels:W"`
        ///
        /// See [Smooth surfaces](../how-to/smooth-and-displace.md).
        subdivision: WrittenSubdivision, default "render.subdivision";
        /// Angle in degrees between faces above which subdivision keeps edges sharp
        crease_angle: f32, default "render.crease_angle", in Range::Between(0.0, 180.0);
        /// Placements of copies: a list of matrices, or a file with one per line
        ///
        /// Lines have twelve or sixteen numbers; `#` begins a comment.
        instances: Instances, default "one copy";
        /// false: camera rays pass through the object; all other rays hit it
        camera_visible: bool, default "true";
    }
}

impl ObjectSection {
    /// Removes keys of the section for which a flag sets a value for all objects.
    pub(crate) fn set_below(&mut self, flags: &LoadParameters) {
        if flags.subdivision.is_some() {
            self.subdivision = None;
        }
        if flags.crease_angle.is_some() {
            self.crease_angle = None;
        }
    }
}

section! {
    /// `transform = { … }`
    #[derive(Default)]
    pub struct TransformSection {
        required {}
        /// Translation in scene units; applied last
        translate: [f32; 3];
        /// Rotation in degrees about the fixed x, y and z axes, in that order
        rotate: [f32; 3];
        /// Scale: one factor, or one for each axis; applied first
        scale: Scale;
    }
}

/// Value of `subdivision`
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrittenSubdivision(pub Subdivision);

impl Serialize for WrittenSubdivision {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            Subdivision::Steps(steps) => serializer.serialize_u32(steps),
            Subdivision::Pixels(_) => serializer.serialize_str(&self.0.text()),
        }
    }
}

impl<'de> Deserialize<'de> for WrittenSubdivision {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(SubdivisionVisitor)
    }
}

/// Deserialiser of `subdivision`.
struct SubdivisionVisitor;

impl Visitor<'_> for SubdivisionVisitor {
    type Value = WrittenSubdivision;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(Subdivision::KIND)
    }

    fn visit_i64<E: de::Error>(self, steps: i64) -> Result<WrittenSubdivision, E> {
        let value = Subdivision::of_text(&steps.to_string()).map(WrittenSubdivision);
        value.ok_or_else(|| E::invalid_value(Unexpected::Signed(steps), &self))
    }

    fn visit_u64<E: de::Error>(self, steps: u64) -> Result<WrittenSubdivision, E> {
        let value = Subdivision::of_text(&steps.to_string()).map(WrittenSubdivision);
        value.ok_or_else(|| E::invalid_value(Unexpected::Unsigned(steps), &self))
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<WrittenSubdivision, E> {
        let value = Subdivision::of_text(text).filter(|value| value.pixels().is_some());
        let value = value.map(WrittenSubdivision);
        value.ok_or_else(|| E::invalid_value(Unexpected::Str(text), &self))
    }
}

/// Value of `instances`
#[derive(Clone, Debug, Deserialize, Serialize)]
#[serde(
    untagged,
    expecting = "instances must be a file name or a list of matrices, each four rows of four"
)]
pub enum Instances {
    /// File with one placement on each line.
    File(PathBuf),
    /// Placements as matrices.
    Matrices(Vec<[[f32; 4]; 4]>),
}

/// Scale factor of an object.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged, expecting = "scale must be a number or three numbers")]
pub enum Scale {
    /// Equal factor along all axes.
    Uniform(f32),
    /// Factors along x, y and z.
    Axes([f32; 3]),
}

impl Scale {
    /// Factors along x, y and z.
    pub(super) fn factors(self) -> Vec3 {
        match self {
            Self::Uniform(factor) => Vec3::splat(factor),
            Self::Axes(factors) => factors.into(),
        }
    }
}

key_types! {
    TransformSection: |_number| table::<Self>(None);
    WrittenSubdivision: |_number| Subdivision::schema();
    Scale: |number| either(&[number.clone(), list(3, number)]);
    Instances: |number| either(&[
        json!({ "type": "string" }),
        json!({ "type": "array", "items": <[[f32; 4]; 4]>::schema(number) }),
    ]);
}
