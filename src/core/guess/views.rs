//! Camera views that are selected by names and by angles.

use crate::math::{encode_fields, encode_variants};

/// Elevation of an isometric view, in degrees: the three axes have the same length in the image.
const ISOMETRIC: f32 = 35.264_39;

/// A named view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum NamedView {
    /// Depends on the kind of scene: an object from its front, right or left, and above; an
    /// interior from inside.
    #[default]
    Auto,
    /// From the front, level.
    Front,
    /// From behind, level.
    Back,
    /// From the viewer's left of the front, level.
    Left,
    /// From the viewer's right of the front, level.
    Right,
    /// From above; the front is at the bottom.
    Top,
    /// From 45° right of the front, where all three axes look equally short.
    Iso,
    /// From inside, at eye height.
    Inside,
}

impl NamedView {
    /// Names that users type, the default first.
    pub const NAMES: &[(&str, Self)] = &[
        ("auto", Self::Auto),
        ("front", Self::Front),
        ("back", Self::Back),
        ("left", Self::Left),
        ("right", Self::Right),
        ("top", Self::Top),
        ("iso", Self::Iso),
        ("inside", Self::Inside),
    ];

    /// Azimuth from the front and elevation, in degrees; `None` if they depend on the scene.
    pub(super) fn angles(self) -> Option<(f32, f32)> {
        match self {
            Self::Auto | Self::Inside => None,
            Self::Front => Some((0.0, 0.0)),
            Self::Back => Some((180.0, 0.0)),
            Self::Left => Some((-90.0, 0.0)),
            Self::Right => Some((90.0, 0.0)),
            Self::Top => Some((0.0, 90.0)),
            Self::Iso => Some((45.0, ISOMETRIC)),
        }
    }
}

encode_variants!(NamedView {
    0 => Auto,
    1 => Front,
    2 => Back,
    3 => Left,
    4 => Right,
    5 => Top,
    6 => Iso,
    7 => Inside,
});

/// A camera on a sphere around its target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// Azimuth in degrees, from +z towards +x if +y is up, and from −y towards +x if +z is up.
    pub azimuth: f32,
    /// Elevation in degrees above the horizon.
    pub elevation: f32,
    /// Distance in scene units from the given target, or, without a target, from the middle of the
    /// scene's box. `None`: the scene fills the image.
    pub distance: Option<f32>,
}

encode_fields!(Orbit {
    azimuth,
    elevation,
    distance
});

impl Orbit {
    /// Orbit from azimuth, elevation between -90 and 90, both in degrees, and an optional distance
    /// above 0.
    pub fn of(numbers: &[f32]) -> Option<Self> {
        let (azimuth, elevation, distance) = match *numbers {
            [azimuth, elevation] => (azimuth, elevation, None),
            [azimuth, elevation, distance] => (azimuth, elevation, Some(distance)),
            _ => return None,
        };
        let is_distance = |distance: f32| distance > 0.0 && distance.is_finite();
        let is_orbit = azimuth.is_finite() && (-90.0..=90.0).contains(&elevation) && distance.is_none_or(is_distance);
        is_orbit.then_some(Self {
            azimuth,
            elevation,
            distance,
        })
    }
}
