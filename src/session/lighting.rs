//! Guessed light and guessed ground, written as sections of a scene file.

use super::{Guesses, Settings};
use crate::camera::{CameraDescription, CameraParameters};
use crate::color::{Exposure, Spectrum};
use crate::guess::{LightGuess, Survey};
use crate::integrator::Background;
use crate::io::{DEFAULT_LIGHT, Warning};
use crate::light::Light;
use crate::light::sky::{DEFAULT_TURBIDITY, SUN_IRRADIANCE};
use crate::math::{Bounds3, UVec2, Vec2, Vec3};
use crate::scene::{GroundPlane, RectangleParameters, Scene};
use crate::scene_file::{ColorValue, Environment, GroundSection, LightSection, SceneFile, Viewpoint};
use toml::Spanned;

/// Radiance of the guessed backdrop, W·sr⁻¹·m⁻²: a blue grey that differs from white, grey and
/// black subjects.
const BACKDROP: Spectrum = Spectrum::rgb(0.105, 0.14, 0.19);
/// Albedo of the ground in front of the guessed backdrop. In the light of the studio, a Lambertian
/// ground of this albedo has the radiance [`BACKDROP`]. So mirrors and glass show a ground as dark
/// as the ground that the camera shows.
const GROUND_ALBEDO: [f32; 3] = [0.0675, 0.09, 0.1222];
/// Radiance of the guessed lamp of a closed room, W·sr⁻¹·m⁻².
const LAMP: f32 = 20.0;

/// A scene file with guessed light or ground, or with light that was placed for the camera.
pub(crate) struct LitFile {
    /// The scene file, with the new light sections.
    pub file: SceneFile,
    /// Settings with the camera for which the light was placed, and with the background of guessed
    /// light.
    pub settings: Settings,
    /// Description of the guess, if one was made.
    pub words: Option<LitWords>,
}

/// Description of a guess for users.
#[derive(Clone, Debug)]
pub(crate) enum LitWords {
    /// Description of guessed light. It includes the ground, if a ground was also guessed.
    Light(String),
    /// Description of a guessed ground, if no light was guessed.
    Ground(String),
}

impl LitWords {
    /// Description of the guessed light, if light was guessed.
    pub fn light(&self) -> Option<&str> {
        match self {
            Self::Light(words) => Some(words),
            Self::Ground(_) => None,
        }
    }

    /// Description of the guessed ground, if a ground was guessed and no light.
    pub fn ground(&self) -> Option<&str> {
        match self {
            Self::Light(_) => None,
            Self::Ground(words) => Some(words),
        }
    }
}

/// Copy of `settings` with the camera of `parameters` and without guesses.
pub(super) fn settled(settings: &Settings, parameters: &CameraParameters) -> Settings {
    let mut settings = settings.clone();
    settings.guesses = Guesses::default();
    let camera = &mut settings.camera;
    (camera.view, camera.orbit, camera.stand, camera.yaw) = (None, None, None, None);
    camera.position = Some(parameters.position.as_dvec3());
    camera.look_at = Some(parameters.look_at.as_dvec3());
    camera.up = Some(parameters.up);
    camera.vertical_fov = Some(parameters.vertical_fov);
    settings
}

/// Returns true if the scene may need guessed light: nothing in the scene emits, according to the
/// `warnings` of loading, or only surfaces of the OBJ file emit (they may be too weak to light the
/// scene).
pub(super) fn may_need_light(file: &SceneFile, settings: &Settings, (scene, warnings): (&Scene, &[Warning])) -> bool {
    let is_dark = || warnings.iter().any(|w| w.kind == DEFAULT_LIGHT);
    let is_lit_by_surfaces = || file.light.is_empty() && scene.lights().iter().all(|light| !light.is_infinite());
    settings.guesses.light && scene.triangle_count() > 0 && (is_dark() || is_lit_by_surfaces())
}

/// Returns true if a ground may be guessed, because `--env` lights the scene. There must be no
/// finite light, because a ground supports only few finite lights.
pub(super) fn may_need_ground(file: &SceneFile, settings: &Settings, scene: &Scene) -> bool {
    let integrator = settings.chosen_integrator();
    settings.guesses.ground
        && file.ground.is_none()
        && file.has_changed_environment()
        && integrator.catches_shadows()
        && scene.triangle_count() > 0
        && scene.lights().iter().all(Light::is_infinite)
        && matches!(integrator.check_lights(scene), Ok(None))
}

/// Returns true if light is guessed, and the ground of `file` has no `up` (such as the ground of
/// `--ground`). This ground then gets the up direction of the scene.
fn has_ground_to_turn(file: &SceneFile, guesses: Guesses) -> bool {
    guesses.light && file.ground.as_ref().is_some_and(|ground| ground.up.is_none())
}

/// `up` as the value of a key in a scene file; `None` if it is the default, +y.
fn written(up: Vec3) -> Option<Spanned<[f32; 3]>> {
    (up != Vec3::Y).then(|| Spanned::new(0..0, up.to_array()))
}

/// Places the ground of `file` below `survey.part`, if the survey covers only this part of the
/// scene.
fn place_ground(file: &mut SceneFile, survey: &Survey) {
    if let (Some(ground), Some(part)) = (&mut file.ground, survey.part) {
        let plane = GroundPlane::below(part, survey.horizon.up());
        let point = plane.point.map(|point| Spanned::new(0..0, point.to_array()));
        ground.point = ground.point.take().or(point);
        ground.radius = ground
            .radius
            .take()
            .or(plane.radius.map(|radius| Spanned::new(0..0, radius)));
    }
}

/// Returns true if the shadows on the ground of `file` end where the picture ends: its background
/// is a colour or transparency, so that a shadow that the border cuts is visible.
fn has_shadows_to_end(file: &SceneFile, settings: &Settings) -> bool {
    let shows_cuts = matches!(settings.background, Background::Transparent | Background::Color(_));
    let is_free = |ground: &GroundSection| ground.radius.is_none() && ground.shadow_radius.is_none();
    settings.guesses.ground && shows_cuts && file.ground.as_ref().is_some_and(is_free)
}

/// Ends the shadows on the ground of `file` inside the picture of the camera of `parameters`: at
/// the distance from the middle of the ground to the nearest point of the ground on the border of
/// the picture. The distance is at least the radius of the circle around the scene, so that some
/// shadow is left if the scene fills the picture.
fn end_shadows(
    file: &mut SceneFile,
    (bounds, up): (Bounds3, Vec3),
    settings: &Settings,
    parameters: &CameraParameters,
) {
    let Some(ground) = file.ground.as_mut() else { return };
    let below = GroundPlane::below(bounds, up).point;
    let given = ground.point.as_ref().map(|point| Vec3::from(*point.get_ref()));
    let camera = CameraDescription::still(*parameters).camera(settings.resolution);
    let (Some(middle), Ok(camera)) = (given.or(below), camera) else {
        return;
    };
    let distances = border(settings.resolution).filter_map(|pixel| {
        let ray = camera.ray(pixel, Vec2::splat(0.5), 0.0);
        let t = (middle - ray.origin).dot(up) / ray.direction.dot(up);
        (t > 0.0 && t.is_finite()).then(|| ray.at(t).distance(middle))
    });
    let nearest = distances.fold(f32::INFINITY, f32::min);
    let across = 0.5 * (bounds.max - bounds.min);
    let radius = nearest.max(across.reject_from_normalized(up).length());
    if radius.is_finite() && radius > 0.0 {
        ground.shadow_radius = Some(Spanned::new(0..0, radius));
    }
}

/// Points on the border of a picture, in pixels.
fn border(resolution: UVec2) -> impl Iterator<Item = Vec2> {
    /// Number of points on each side.
    const POINTS: u32 = 32;
    let size = resolution.as_vec2();
    (0..=POINTS).flat_map(move |i| {
        let along = i as f32 / POINTS as f32;
        let points = [(along, 0.0), (along, 1.0), (0.0, along), (1.0, along)];
        points.map(|(x, y)| Vec2::new(x, y) * size)
    })
}

/// The scene file with changes of light and ground, for the camera of `parameters` at `viewpoint`.
/// If `survey` shows that the scene is an object and flags set its environment, a ground is added.
/// `None` if nothing in `file` changes.
pub(super) fn changed(
    (file, scene, survey): (&SceneFile, &Scene, Option<&Survey>),
    settings: &Settings,
    viewpoint: &Viewpoint,
    parameters: &CameraParameters,
) -> Option<LitFile> {
    let up = viewpoint.scene_up.unwrap_or(Vec3::Y);
    let is_object = survey.is_some_and(|survey| !survey.is_interior);
    let has_ground = is_object && may_need_ground(file, settings, scene);
    let is_turned = up != Vec3::Y && has_ground_to_turn(file, settings.guesses);
    let lights = file.lights_seen_from(viewpoint);
    if lights.is_none() && !has_ground && !is_turned && !has_shadows_to_end(file, settings) {
        return None;
    }
    let mut file = file.clone();
    file.settle_light(lights);
    if has_ground || is_turned {
        file.ground.get_or_insert_default().up = written(up);
    }
    if has_shadows_to_end(&file, settings) {
        let bounds = survey.and_then(|survey| survey.part).unwrap_or(scene.bounds());
        end_shadows(&mut file, (bounds, up), settings, parameters);
    }
    if has_ground {
        survey.into_iter().for_each(|survey| place_ground(&mut file, survey));
    }
    Some(LitFile {
        file,
        settings: settled(settings, parameters),
        words: has_ground.then(|| LitWords::Ground("catches shadows (--no-ground removes it)".into())),
    })
}

/// Writes `guess` into copies of the scene file and of the settings, for the camera of
/// `parameters`. Also returns a description of the guess, which mentions lamps of the `scene` that
/// leave a room dark.
pub(super) fn lit(
    (file, scene): (&SceneFile, &Scene),
    settings: &Settings,
    (guess, survey): (LightGuess, &Survey),
    parameters: &CameraParameters,
) -> LitFile {
    let (mut file, guesses) = (file.clone(), settings.guesses);
    file.settle_light(None);
    let given = settings;
    let mut settings = settled(given, parameters);
    let up = survey.horizon.up();
    let said_up = (up != Vec3::Y).then_some(up);
    let words: String = match guess {
        LightGuess::Studio => {
            let viewpoint = Viewpoint {
                back: Some(parameters.position - parameters.look_at),
                up: None,
                scene_up: Some(up),
            };
            file.light.push(Environment::Studio.section(0..0, &viewpoint));
            let catches = guesses.ground && settings.chosen_integrator().catches_shadows();
            let has_backdrop = guesses.background && settings.chosen_integrator().shows_backgrounds();
            if catches {
                let ground = file.ground.get_or_insert_default();
                if has_backdrop && ground.albedo.is_none() {
                    ground.albedo = Some(Spanned::new(0..0, ColorValue(GROUND_ALBEDO)));
                }
                if has_shadows_to_end(&file, given) {
                    let bounds = survey.part.unwrap_or(scene.bounds());
                    end_shadows(&mut file, (bounds, up), &settings, parameters);
                }
                place_ground(&mut file, survey);
            }
            if has_backdrop {
                settings.background = Background::Gradient(BACKDROP);
            }
            if guesses.exposure {
                settings.tone.exposure = Exposure::Studio;
            }
            if catches {
                "a studio, and a ground that catches shadows (--env sky, --no-ground, --background COLOUR change that)"
            } else {
                "a studio (--env sky, --background COLOUR change that)"
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
    let has_lamps = survey.is_interior && scene.lights().iter().any(|light| !light.is_infinite());
    let words = if has_lamps {
        words
            + "; the lamps of the file light little of the room (`embrasure check` finds lamps that face the wrong way, and --env none leaves only the lamps)"
    } else {
        words
    };
    if has_ground_to_turn(&file, guesses) {
        file.ground.get_or_insert_default().up = written(up);
    }
    LitFile {
        file,
        settings,
        words: Some(LitWords::Light(words)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::studio_image;
    use std::f32::consts::{PI, TAU};

    #[test]
    fn ground_has_radiance_of_backdrop() {
        let image = studio_image();
        let (rows, columns) = (image.height as f32, image.width as f32);
        let irradiance: f32 = (image.texels.iter().enumerate())
            .map(|(i, radiance)| {
                let (sin, cos) = (PI * ((i / image.width) as f32 + 0.5) / rows).sin_cos();
                radiance.luminance() * cos.max(0.0) * sin * (PI / rows) * (TAU / columns)
            })
            .sum();
        let radiance = Spectrum::from(GROUND_ALBEDO) * (irradiance / PI);
        for (ground, backdrop) in radiance.to_array().into_iter().zip(BACKDROP.to_array()) {
            assert!((ground / backdrop - 1.0).abs() < 0.005, "{radiance:?}, {irradiance}");
        }
    }
}
