//! Views of the picture of a session, and the properties of their projection.

use super::{Error, InvalidSetting, Session};
use crate::camera::{Camera, CameraDescription, Projection, View};
use crate::math::UVec2;

impl Session {
    /// Views of the picture, which are rendered separately.
    pub(crate) fn views(&self) -> &[View] {
        &self.views
    }

    /// Camera whose properties are stored in image files. For a stereo picture, it is the camera in
    /// the middle of the eyes, with the size of one view.
    pub(crate) fn mean_camera(&self) -> Camera {
        let middle = CameraDescription {
            stereo: None,
            ..self.description
        };
        let of_view = || middle.camera(self.view_size()).ok();
        let is_stereo = self.description.stereo.is_some();
        is_stereo.then(of_view).flatten().unwrap_or(self.camera)
    }

    /// Returns true if the projection is a perspective, so that a guess can set its field of view.
    pub fn has_fov(&self) -> bool {
        matches!(self.description.projection, Projection::Perspective { .. })
    }

    /// Size of the panorama of one eye; `None` if the picture is not a panorama.
    pub fn panorama_size(&self) -> Option<UVec2> {
        matches!(self.description.projection, Projection::Panorama).then(|| self.view_size())
    }

    /// Size of a view; the size of the picture if it has one view.
    pub(crate) fn view_size(&self) -> UVec2 {
        self.description.view_size(self.settings.resolution)
    }

    /// Returns an error if the picture has several views. `setting` and `value` name the request
    /// that needs a picture of one view.
    pub(crate) fn check_one_view(&self, setting: &'static str, value: &str) -> Result<(), Error> {
        if self.views.len() == 1 {
            return Ok(());
        }
        let (count, size) = (self.views.len(), self.view_size());
        let message = format!(
            "{value}: the picture consists of {count} views of {}x{} pixels, which are rendered separately",
            size.x, size.y
        );
        let help = "render one view alone: leave out --stereo, or render a face as a perspective with --fov 90";
        Err(InvalidSetting::new(setting, message, help).into())
    }
}
