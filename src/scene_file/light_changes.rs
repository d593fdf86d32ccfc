//! Changes that flags make to the light of a scene file. The position of a changed light may depend
//! on the camera, and the camera may be guessed only after the scene was read.

use super::{DEFAULT_SUN, LightSection, Rotation};
use crate::light::sky::DEFAULT_TURBIDITY;
use crate::math::{Horizon, Vec3};
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;

/// Changes that flags make to the light of a scene file. Each change has the text of its flag, such
/// as `--env sky`, for error messages.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightChanges {
    /// Environment that replaces all environments of the file, and text of its flag.
    pub env: Option<(Environment, String)>,
    /// Sun that is added, and text of its flag. In addition, all skies get the position of this
    /// sun.
    pub sun: Option<(Sun, String)>,
    /// Irradiance, W·m⁻², of a soft light from the camera's upper left, and text of its flag.
    pub key_light: Option<(f32, String)>,
}

/// Environment that a flag sets.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Environment {
    /// Image in latitude-longitude format.
    File(PathBuf),
    /// Constant radiance in all directions.
    Color([f32; 3]),
    /// Studio whose front is towards the camera.
    Studio,
    /// Daylight sky.
    Sky,
}

/// Position and strength of a sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sun {
    /// Azimuth and elevation of the sun in degrees.
    pub at: [f32; 2],
    /// Luminance of the sun's irradiance, W·m⁻².
    pub strength: f32,
}

/// Position and orientation of a camera. Fields are `None` if they are not known yet.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Viewpoint {
    /// Direction from the camera's target to the camera.
    pub back: Option<Vec3>,
    /// Upward direction in the image.
    pub up: Option<Vec3>,
    /// Upward direction of the scene; +y if it is unknown.
    pub scene_up: Option<Vec3>,
}

/// Changes to the light of a scene file, and the light sections before the changes.
#[derive(Clone, Debug)]
pub(super) struct ChangedLight {
    pub changes: LightChanges,
    /// Spans of the environment, the sun and the key light, for the positions of errors.
    pub spans: [Range<usize>; 3],
    /// Light sections before the changes.
    pub light: Vec<LightSection>,
}

impl LightChanges {
    /// Texts of the flags for the environment, the sun and the key light; `None` if the flag was
    /// not used.
    pub(super) fn words(&self) -> [Option<&str>; 3] {
        fn of<T>(change: &Option<(T, String)>) -> Option<&str> {
            change.as_ref().map(|(_, words)| words.as_str())
        }
        [of(&self.env), of(&self.sun), of(&self.key_light)]
    }
}

impl ChangedLight {
    /// Light sections after the changes. Lights that depend on the camera are placed for a camera
    /// at `viewpoint`.
    pub fn seen_from(&self, viewpoint: &Viewpoint) -> Vec<LightSection> {
        let mut lights = self.light.clone();
        let [at_env, at_sun, at_key_light] = self.spans.clone();
        let LightChanges { env, sun, key_light } = &self.changes;
        if let Some((env, _)) = env {
            lights.retain(|light| !light.is_environment());
            lights.push(env.section(at_env, viewpoint));
        }
        if let Some((sun, _)) = sun {
            let (mut turbidity, mut up) = (DEFAULT_TURBIDITY, viewpoint.scene_up);
            for sky in lights.iter_mut().filter(|light| light.kind.get_ref() == "sky") {
                sky.sun = Some(Spanned::new(at_sun.clone(), sun.at));
                up = Some(sky.up.as_ref().map_or(Vec3::Y, |up| Vec3::from(*up.get_ref())));
                turbidity = sky.turbidity.as_ref().map_or(turbidity, |t| *t.get_ref());
            }
            lights.push(LightSection::sun(at_sun, sun.at, sun.strength, turbidity, up));
        }
        if let Some((strength, _)) = *key_light {
            let section = LightSection::key_light(at_key_light, viewpoint.back, viewpoint.up, strength);
            lights.push(section);
        }
        lights
    }
}

impl Environment {
    /// Light section of the environment, for a camera at `viewpoint`. Errors about the section
    /// point to the bytes `span` of the file.
    pub(crate) fn section(&self, span: Range<usize>, viewpoint: &Viewpoint) -> LightSection {
        let up = viewpoint.scene_up.filter(|up| *up != Vec3::Y);
        match self {
            Self::File(path) => LightSection {
                // Rotate the picture, whose up direction is +y, to the up direction of the scene
                rotate: up.map(|up| Spanned::new(span.clone(), Rotation::Axes(upright(up)))),
                ..LightSection::environment(span, path.clone())
            },
            Self::Color(color) => LightSection::constant(span, *color),
            Self::Studio => {
                let horizon = Horizon::new(up.unwrap_or(Vec3::Y));
                let front = viewpoint.back.and_then(|back| horizon.azimuth(back));
                LightSection::studio(span, front.map_or(0.0, f32::round), up)
            }
            Self::Sky => LightSection::sky(span, DEFAULT_SUN, up),
        }
    }
}

/// Angles about x, y and z, in degrees, of the shortest rotation from +y to `up`. `up` is a
/// positive or negative coordinate axis.
fn upright(up: Vec3) -> [f32; 3] {
    if up.y < 0.0 {
        [180.0, 0.0, 0.0]
    } else {
        [90.0 * up.z, 0.0, 0.0 - 90.0 * up.x]
    }
}
