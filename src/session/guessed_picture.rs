//! Camera and light of a scene, guessed or given.

use super::camera::FoundCamera;
use super::lighting::{self, LitFile};
use super::settings::{GuessSelection, SceneSurvey};
use super::{Error, Settings};
use crate::io::Warning;
use crate::scene::Scene;
use crate::scene_file::{SceneFile, load_scene};

/// Finds the camera of `settings` in the scene of `file`. Also returns the scene file if its light
/// changes: light is guessed if `settings` allow guesses and nothing lights the view of the camera,
/// or light is placed for a guessed camera. `warnings` are the warnings of loading the scene.
///
/// In a room, hidden parts count as if they were shown. So hiding a chair moves neither the camera
/// nor the sun. The room is read a second time, with all parts.
///
/// # Errors
///
/// Errors of [`Settings::camera_of`].
pub(crate) fn camera_and_lit(
    file: &SceneFile,
    settings: &Settings,
    (scene, warnings): (&Scene, &[Warning]),
    pool: &rayon::ThreadPool,
) -> Result<(FoundCamera, Option<LitFile>), Error> {
    let mut guessed = guessed_picture(file, settings, (scene, warnings), pool)?;
    if guessed.is_interior && file.hides_parts() {
        let builder = settings.chosen_integrator().scene_builder();
        // If there is too little memory for both scenes, the guess of the smaller scene stays.
        let whole = pool.install(|| load_scene(&file.with_hidden_parts(), builder));
        let whole = whole
            .map_err(Error::File)
            .and_then(|whole| guessed_picture(file, settings, (&whole.scene, &whole.warnings), pool));
        guessed = whole.ok().filter(|whole| whole.is_interior).unwrap_or(guessed);
    }
    Ok((guessed.camera, guessed.lit))
}

/// Camera and light of a scene, guessed or given.
struct GuessedPicture {
    camera: FoundCamera,
    /// The scene file with other light or ground, if they change.
    lit: Option<LitFile>,
    /// True if the scene was surveyed and is an interior.
    is_interior: bool,
}

/// [`camera_and_lit`] for the parts of `scene` alone.
fn guessed_picture(
    file: &SceneFile,
    settings: &Settings,
    (scene, warnings): (&Scene, &[Warning]),
    pool: &rayon::ThreadPool,
) -> Result<GuessedPicture, Error> {
    let selection = GuessSelection {
        survey: lighting::may_need_ground(file, settings, scene),
        light: lighting::may_need_light(file, settings, (scene, warnings)),
    };
    let (found, surveyed) = settings.camera_and_survey(file, scene, pool, selection)?;
    let parameters = &found.description.parameters;
    let is_interior = surveyed.as_ref().is_some_and(|surveyed| surveyed.survey.is_interior);
    let lit = match surveyed {
        Some(SceneSurvey {
            survey,
            light: Some(light),
        }) => Some(lighting::lit((file, scene), settings, (light, &survey), parameters)),
        surveyed => {
            let survey = surveyed.as_ref().map(|surveyed| &surveyed.survey);
            let viewpoint = found.viewpoint(&settings.camera);
            lighting::changed((file, scene, survey), settings, &viewpoint, parameters)
        }
    };
    Ok(GuessedPicture {
        camera: found,
        lit,
        is_interior,
    })
}
