//! A session that changes while its scene stays: an interactive render sees it by another camera, by another method or in another size.

use super::memory::check_pixels;
use super::{
    CameraSettings, Error, METHOD_WARNINGS, Session, Settings, backdrop, check_groups, light_paths, method_warnings,
};
use crate::camera::CameraDescription;
use crate::guess::CameraGuess;
use crate::options::CameraOptions;
use std::sync::OnceLock;

impl Session {
    /// Shares the acceleration structure that `other` keeps, where both scenes have the same meshes, or else builds one. Gives whether it is shared.
    ///
    /// # Errors
    ///
    /// Those of building one.
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

    /// Returns true if the scene as it was loaded serves a render of `settings`: backend, threads, and how
    /// triangles are sampled, belong to it.
    pub(crate) fn serves(&self, settings: &Settings) -> bool {
        let made_for = |settings: &Settings| {
            (
                settings.method().triangle_sampling(),
                settings.backend,
                settings.threads,
                settings.compact,
            )
        };
        made_for(&self.settings) == made_for(settings)
    }

    /// Cameras to choose from, whatever camera was said, each with the shortest flags that name it.
    ///
    /// # Errors
    ///
    /// Those of building an acceleration structure.
    pub(crate) fn views(&self) -> Result<Vec<(String, CameraGuess)>, Error> {
        let accel = self.accel_for_guesses()?;
        let free = CameraSettings {
            options: CameraOptions {
                up: self.said_camera.up,
                ..CameraOptions::default()
            },
            axes: self.said_camera.axes,
            ..CameraSettings::default()
        };
        let finder = || free.finder(&self.scene, accel.as_dyn(), self.settings.resolution, self.sisters);
        Ok(self.pool.install(|| finder().candidates()))
    }

    /// Makes it a session of `settings`, which it [serves](Session::serves), seen by the camera of `description`. What was learned of visible lights is
    /// forgotten unless `keeps_visibility`: then the picture is as right, but its noise is not that of a session of its own.
    ///
    /// # Errors
    ///
    /// Settings that cannot be, or a camera that sees nothing; the session is as before then.
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
        let method = settings.method();
        if self.scene.ground().is_some() {
            method.check_catching()?;
        }
        method.check_ground(&self.scene)?;
        let paths = light_paths(&settings)?;
        let choice = method.light_choice();
        let new = (choice != self.settings.method().light_choice()).then(|| self.scene.light_selection(choice));
        let selection = new.as_ref().unwrap_or(&self.light_selection);
        let of_method = method_warnings(&method, (&self.scene, selection), &camera)?;
        // Warnings of the scene stay; those of the method are the new one's.
        self.warnings.retain(|warning| !METHOD_WARNINGS.contains(&warning.kind));
        self.warnings.extend(of_method);
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
        self.description = description;
        self.settings = settings;
        Ok(())
    }
}
