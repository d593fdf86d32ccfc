//! Changes of a session that keep the scene: an interactive render changes the camera, the
//! integrator or the size.

use super::memory::check_pixels;
use super::{
    CameraSettings, Error, INTEGRATOR_WARNINGS, Session, Settings, backdrop, check_groups, integrator_warnings,
    light_paths,
};
use crate::camera::CameraDescription;
use crate::guess::CameraGuess;
use crate::options::CameraOptions;
use std::sync::OnceLock;

impl Session {
    /// Shares the acceleration structure that `other` keeps, if both sessions have the same meshes,
    /// backend and number of threads. Else builds a new structure. Returns true if the structure is
    /// shared.
    ///
    /// # Errors
    ///
    /// Errors of the build.
    pub(crate) fn keep_accel_of(&mut self, other: &Self) -> Result<bool, Error> {
        let is_served =
            (self.settings.backend, self.settings.threads) == (other.settings.backend, other.settings.threads);
        match other.kept.as_ref().filter(|_| is_served) {
            Some(kept) if self.scene.share_meshes(&other.scene) => {
                self.kept = Some(kept.clone());
                Ok(true)
            }
            _ => self.keep_accel().map(|()| false),
        }
    }

    /// Returns true if the loaded scene can be used for a render of `settings`. The scene depends
    /// on the backend, the number of threads, the triangle sampling and compactness.
    pub(crate) fn serves(&self, settings: &Settings) -> bool {
        let made_for = |settings: &Settings| {
            (
                settings.chosen_integrator().triangle_sampling(),
                settings.backend,
                settings.threads,
                settings.compact,
            )
        };
        made_for(&self.settings) == made_for(settings)
    }

    /// Candidate cameras. Each has the shortest flags that select it. Camera settings of the
    /// session are ignored, except `up` and the axes of the OBJ file.
    pub(crate) fn guessed_views(&self) -> Result<Vec<(String, CameraGuess)>, Error> {
        let accel = self.accel_for_guesses()?;
        let free = CameraSettings {
            options: CameraOptions {
                up: self.given_camera.up,
                ..CameraOptions::default()
            },
            axes: self.given_camera.axes,
            ..CameraSettings::default()
        };
        let finder = || free.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.siblings);
        Ok(self.pool.install(|| finder().candidates()))
    }

    /// Changes the session to `settings` and to the camera of `description`. [`Session::serves`]
    /// must be true for `settings`. The learned visibility of lights is dropped, unless
    /// `keeps_visibility` is true. With the kept visibility, the picture is equally correct, but
    /// has other noise than the picture of a new session.
    ///
    /// # Errors
    ///
    /// Invalid settings, or an invalid camera. After an error the session is unchanged.
    pub(crate) fn change(
        &mut self,
        settings: Settings,
        description: CameraDescription,
        keeps_visibility: bool,
    ) -> Result<(), Error> {
        settings.check()?;
        check_groups(&settings, &self.scene)?;
        check_pixels(&settings, settings.parts_of_light(&self.scene), None)?;
        let camera = description.camera(settings.resolution)?;
        let views = description.views(settings.resolution)?;
        let integrator = settings.chosen_integrator();
        if self.scene.ground().is_some() {
            integrator.check_catching()?;
        }
        integrator.check_ground(&self.scene)?;
        let paths = light_paths(&settings)?;
        let choice = integrator.light_choice();
        let new =
            (choice != self.settings.chosen_integrator().light_choice()).then(|| self.scene.light_selection(choice));
        let selection = new.as_ref().unwrap_or(&self.light_selection);
        let of_integrator = integrator_warnings(&integrator, (&self.scene, selection), &camera)?;
        // Keep warnings of the scene, and replace warnings of the integrator
        self.warnings
            .retain(|warning| !INTEGRATOR_WARNINGS.contains(&warning.kind));
        self.warnings.extend(of_integrator);
        match new {
            Some(new) => self.light_selection = new,
            None if !keeps_visibility => self.light_selection.forget(),
            None => {}
        }
        self.backdrop = backdrop(&settings, &description.parameters);
        self.filter = settings.filter();
        self.scene_hash = OnceLock::new();
        self.paths = paths;
        self.camera = camera;
        self.views = views;
        self.description = description;
        self.settings = settings;
        Ok(())
    }
}
