//! What `guess` says of the light, as sections of a scene file: that of a scene without any, and the ground below an object.

use super::{Guesses, LitFile, Settings};
use crate::camera::CameraParameters;
use crate::color::Spectrum;
use crate::description::{GroundSection, LightSection, SceneFile, Viewpoint};
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

/// The settings with the camera of `parameters`, and nothing left to guess.
fn settled(settings: &Settings, parameters: &CameraParameters) -> Settings {
    let mut settings = settings.clone();
    settings.guesses = Guesses::default();
    let camera = &mut settings.camera;
    (camera.view, camera.orbit) = (None, None);
    camera.position = Some(parameters.position);
    camera.look_at = Some(parameters.look_at);
    camera.up = Some(parameters.up);
    camera.vertical_fov = Some(parameters.vertical_fov);
    settings
}

/// The ground that catches the shadows of an object.
fn ground(up: Option<Vec3>) -> GroundSection {
    GroundSection {
        up: up.map(|up| Spanned::new(0..0, up.to_array())),
        ..GroundSection::default()
    }
}

/// Whether an object gets a ground though its light is said: in the environment of a flag.
pub(super) fn may_want_ground(file: &SceneFile, settings: &Settings) -> bool {
    let guessed = settings.guesses.ground && settings.method().catches_shadows();
    guessed && file.ground.is_none() && file.has_changed_environment()
}

/// The scene file and the settings with light and ground of a bare OBJ for a camera that stands at `viewpoint`: where flags give the light, as it is seen
/// from there, and on a ground if they give an environment to an object. `None` where that changes nothing.
pub(super) fn changed(
    file: &SceneFile,
    settings: &Settings,
    survey: &Survey,
    viewpoint: &Viewpoint,
    parameters: &CameraParameters,
) -> Option<LitFile> {
    let up = viewpoint.scene_up.filter(|up| *up != Vec3::Y);
    let has_ground = may_want_ground(file, settings) && !survey.is_interior;
    // That of `--ground`
    let is_turned = up.is_some() && !file.is_file() && file.ground.as_ref().is_some_and(|ground| ground.up.is_none());
    let lights = file.lights_seen_from(viewpoint);
    if lights.is_none() && !has_ground && !is_turned {
        return None;
    }
    let mut file = file.clone();
    file.settle_light(lights);
    if has_ground || is_turned {
        file.ground = Some(ground(up));
    }
    Some(LitFile {
        file,
        settings: settled(settings, parameters),
        words: has_ground.then(|| "ground: catches shadows (--no-ground removes it)".into()),
    })
}

/// The scene file and the settings with `guess` in them, as if they said it, seen by the camera of `parameters`; and words on it.
pub(super) fn lit(
    file: &SceneFile,
    settings: &Settings,
    (guess, survey): (LightGuess, &Survey),
    parameters: &CameraParameters,
) -> LitFile {
    let (mut file, guesses) = (file.clone(), settings.guesses);
    let mut settings = settled(settings, parameters);
    let up = survey.horizon.up();
    let said_up = (up != Vec3::Y).then_some(up);
    let words: String = match guess {
        LightGuess::Studio => {
            let front = survey.horizon.azimuth(parameters.position - parameters.look_at);
            let front = front.unwrap_or(0.0).round();
            file.light.push(LightSection::studio(0..0, front, said_up));
            let catches = guesses.ground && settings.method().catches_shadows();
            if catches && file.ground.is_none() {
                file.ground = Some(ground(said_up));
            }
            if guesses.background && settings.method().shows_backgrounds() {
                settings.background = Background::Gradient(Spectrum::splat(match survey.reflectance >= BRIGHT {
                    true => BACKDROPS[0],
                    false => BACKDROPS[1],
                }));
            }
            match catches {
                true => "a studio, and a ground that catches shadows (--env sky, --no-ground, --background COLOUR change that)",
                false => "a studio (--env sky, --background COLOUR change that)",
            }
            .into()
        }
        LightGuess::Daylight(sun) => {
            file.light.push(LightSection::sky(0..0, sun, said_up));
            let section = LightSection::sun(0..0, sun, SUN_IRRADIANCE, DEFAULT_TURBIDITY, said_up);
            file.light.push(section);
            let [azimuth, elevation] = sun;
            format!(
                "sky and sun through the openings: sun at azimuth {azimuth}°, elevation {elevation}° (--env sky --sun AZ,EL or --env FILE changes that)"
            )
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
            "a lamp below the ceiling, since no daylight comes in (--env COLOUR, --key-light change that)".into()
        }
    };
    LitFile {
        file,
        settings,
        words: Some(format!("light: {words}")),
    }
}
