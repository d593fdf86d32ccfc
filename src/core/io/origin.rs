//! Point of a file's coordinates that becomes the origin of the scene.

use crate::math::DVec3;
use crate::parameter::Value;
use serde_json::json;

/// Point of an OBJ file's coordinates that becomes the origin of the scene. It is subtracted from
/// 64-bit coordinates before they are rounded to 32 bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Origin {
    /// The origin of the file.
    Off,
    /// A point near the geometry, if the geometry lies far from the origin of the file.
    Auto,
    /// The given point, in coordinates of the file.
    At(DVec3),
}

impl Value for Origin {
    const PLACEHOLDER: &'static str = "X,Y,Z";
    const KIND: &'static str = "auto, off, or three coordinates such as 500000,4100000,0";
    const IS_STRING: bool = true;

    fn of_text(text: &str) -> Option<Self> {
        match text.trim() {
            "auto" => Some(Self::Auto),
            "off" => Some(Self::Off),
            numbers => {
                let numbers: Result<Vec<f64>, _> = numbers.split(',').map(|number| number.trim().parse()).collect();
                let [x, y, z] = numbers.ok()?[..] else { return None };
                Some(Self::At(DVec3::new(x, y, z)))
            }
        }
    }

    fn text(&self) -> String {
        match self {
            Self::Off => "off".into(),
            Self::Auto => "auto".into(),
            Self::At(p) => format!("{},{},{}", p.x, p.y, p.z),
        }
    }

    fn schema() -> serde_json::Value {
        json!({ "type": "string", "pattern": "^(auto|off|[0-9.eE+ -]+(,[0-9.eE+ -]+){2})$" })
    }

    /// Returns true if the coordinates are finite.
    fn is_finite(&self) -> bool {
        match self {
            Self::Off | Self::Auto => true,
            Self::At(p) => p.is_finite(),
        }
    }
}
