//! The light of a scene without any: what `guess` says, as sections of a scene file.

use super::Settings;
use crate::camera::CameraParameters;
use crate::color::Spectrum;
use crate::description::{GroundSection, LightSection, SceneFile};
use crate::guess::{LightGuess, Survey};
use crate::integrator::Background;
use crate::light::sky::{DEFAULT_TURBIDITY, SUN_IRRADIANCE};
use crate::math::Vec3;
use crate::scene::RectangleParameters;
use toml::Spanned;

/// Radiance of the backdrop of a bright object, and of a dark one, W·sr⁻¹·m⁻²: each separates from it.
const BACKDROPS: [f32; 2] = [0.1, 0.9];
/// Reflectance from which on an object is bright.
const BRIGHT: f32 = 0.35;
/// Radiance of the lamp of a closed room, W·sr⁻¹·m⁻².
const LAMP: f32 = 20.0;

/// The scene file and the settings with `guess` in them, as if they said it, seen by the camera of `parameters`; and words on it.
pub(super) fn lit(
    file: &SceneFile,
    settings: &Settings,
    (guess, survey): (LightGuess, &Survey),
    parameters: &CameraParameters,
) -> (SceneFile, Settings, String) {
    let (mut file, mut settings) = (file.clone(), settings.clone());
    let guesses = std::mem::take(&mut settings.guesses);
    let camera = &mut settings.camera;
    (camera.view, camera.orbit) = (None, None);
    camera.position = Some(parameters.position);
    camera.look_at = Some(parameters.look_at);
    camera.up = Some(parameters.up);
    camera.vertical_fov = Some(parameters.vertical_fov);

    let up = survey.horizon.up();
    let said_up = (up != Vec3::Y).then_some(up);
    let words = match guess {
        LightGuess::Studio => {
            let front = survey.horizon.azimuth(parameters.position - parameters.look_at);
            let front = front.unwrap_or(0.0).round();
            file.light.push(LightSection::studio(0..0, front, said_up));
            let catches = guesses.ground && settings.method().catches_shadows();
            if catches && file.ground.is_none() {
                file.ground = Some(GroundSection {
                    up: said_up.map(|up| Spanned::new(0..0, up.to_array())),
                    ..GroundSection::default()
                });
            }
            if guesses.background && settings.method().shows_backgrounds() {
                settings.background = Background::Gradient(Spectrum::splat(match survey.reflectance >= BRIGHT {
                    true => BACKDROPS[0],
                    false => BACKDROPS[1],
                }));
            }
            match catches {
                true => {
                    "a studio, and a ground that catches shadows (--env sky, --no-ground, --background COLOUR change that)"
                }
                false => "a studio (--env sky, --background COLOUR change that)",
            }
        }
        LightGuess::Daylight(sun) => {
            file.light.push(LightSection::sky(0..0, sun, said_up));
            let section = LightSection::sun(0..0, sun, SUN_IRRADIANCE, DEFAULT_TURBIDITY, said_up);
            file.light.push(section);
            "sky and sun through the openings (--env FILE, --env sky --sun AZ,EL change that)"
        }
        LightGuess::Lamp {
            position,
            direction,
            size,
        } => {
            let lamp = RectangleParameters {
                position,
                direction,
                size: [size; 2],
                up: None,
                radiance: Spectrum::splat(LAMP),
            };
            file.light.push(LightSection::rectangle(0..0, &lamp));
            "a lamp below the ceiling, since no daylight comes in (--env COLOUR, --key-light change that)"
        }
    };
    (file, settings, words.into())
}
