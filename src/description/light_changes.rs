//! Light that replaces or extends the light of a scene file. Its position depends on the camera,
//! which may be guessed only after the scene is read.

use super::{DEFAULT_SUN, LightSection, Rotation};
use crate::light::sky::DEFAULT_TURBIDITY;
use crate::math::{Horizon, Vec3};
use std::ops::Range;
use std::path::PathBuf;
use toml::Spanned;

/// Changes to the light of a scene file. Each has the text that set it, such as `--env sky`, for
/// error messages.
#[derive(Clone, Debug, Default)]
pub(crate) struct LightChanges {
    /// Environment that replaces all environments of the file.
    pub env: Option<(Environment, String)>,
    /// Sun to add. The suns of all skies move to its position.
    pub sun: Option<(Sun, String)>,
    /// Irradiance, W·m⁻², of soft light from the camera's upper left.
    pub key_light: Option<(f32, String)>,
}

/// Environment of a scene.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Environment {
    /// A picture of latitude and longitude.
    File(PathBuf),
    /// Constant radiance in all directions.
    Color([f32; 3]),
    /// A studio that faces the camera.
    Studio,
    /// Daylight.
    Sky,
}

/// A sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sun {
    /// Azimuth and elevation in degrees.
    pub at: [f32; 2],
    /// Luminance of its irradiance, W·m⁻².
    pub strength: f32,
}

/// Position and orientation of a camera, as far as they are known.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Viewpoint {
    /// Direction from the target to the camera.
    pub back: Option<Vec3>,
    /// Up in the image.
    pub up: Option<Vec3>,
    /// Up in the scene; +y if unknown.
    pub scene_up: Option<Vec3>,
}

/// Changes of the light of a scene file, and the light sections before the changes.
#[derive(Clone, Debug)]
pub(super) struct ChangedLight {
    pub changes: LightChanges,
    /// Spans for errors of the environment, the sun and the key light.
    pub spans: [Range<usize>; 3],
    /// Sections before the changes.
    pub light: Vec<LightSection>,
}

impl LightChanges {
    /// Texts that set the environment, the sun and the key light; `None` if unchanged.
    pub(super) fn words(&self) -> [Option<&str>; 3] {
        fn of<T>(change: &Option<(T, String)>) -> Option<&str> {
            change.as_ref().map(|(_, words)| words.as_str())
        }
        [of(&self.env), of(&self.sun), of(&self.key_light)]
    }
}

impl ChangedLight {
    /// All lights. Lights that depend on the camera are placed for a camera at `viewpoint`.
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
    /// The section of the environment at the bytes `span` of a file, for a camera at `viewpoint`.
    pub(crate) fn section(&self, span: Range<usize>, viewpoint: &Viewpoint) -> LightSection {
        let up = viewpoint.scene_up.filter(|up| *up != Vec3::Y);
        match self {
            Self::File(path) => LightSection {
                // Pictures have +y up.
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

/// Angles about x, y and z, in degrees, of the shortest rotation from +y to `up`. `up` is an axis
/// of either direction.
fn upright(up: Vec3) -> [f32; 3] {
    match up.y < 0.0 {
        true => [180.0, 0.0, 0.0],
        false => [90.0 * up.z, 0.0, 0.0 - 90.0 * up.x],
    }
}
