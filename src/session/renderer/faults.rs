//! Reports about a picture that shows little: the position of the camera, darkness, and emptiness.

use super::Renderer;
use crate::film::Image;
use crate::io::{FileError, Finding, Warning};
use crate::lint::{dark_lamps, inspect_lamps, reason_for_darkness, reason_for_emptiness};
use crate::options::IntegratorKind;
use crate::session::inspect_camera;
use std::path::Path;

/// Maximum mean radiance of a picture that is called nearly black: 12 stops below mid-grey.
const NEARLY_BLACK: f64 = 0.18 / 4096.0;

impl Renderer<'_> {
    /// Warning about the position and the view of the camera, if its position is given and there is
    /// something to report. `name` is the scene file.
    pub fn camera_warning(&self, name: &Path) -> Option<Warning> {
        let (session, settings) = (self.session, self.session.settings());
        session.given_camera.position?;
        let accel = self.accel.as_dyn();
        let finding = inspect_camera(
            &session.given_camera,
            (session.scene(), accel),
            (session.camera(), settings.resolution),
            &|message| FileError::new(name, message),
        );
        finding.map(|finding| finding.warning())
    }

    /// Text that describes how dark `image` is, and why. `None` if the image is bright enough, or
    /// dark by intent. If the image is nearly black but not black, only faults of lamps are
    /// reported as reasons.
    pub fn darkness(&self, image: &Image) -> Option<String> {
        let (session, settings) = (self.session, self.session.settings());
        let (mut sum, mut count) = (0.0, 0.0);
        for rgb in image.rgb() {
            sum += f64::from(rgb.iter().fold(0f32, |max, &v| max.max(v)));
            count += 1.0;
        }
        if sum > NEARLY_BLACK * count || settings.chosen_integrator().kind() == IntegratorKind::Debug {
            return None;
        }
        let accel = self.accel.as_dyn();
        let (scene, camera) = (session.scene(), session.camera());
        // A denoiser may make a black picture slightly brighter.
        let has_light = scene.lights().iter().any(|light| light.power(1.0) > 0.0);
        if sum > 0.0 && has_light {
            let lamps = dark_lamps(accel, scene, camera, settings.resolution)?;
            return Some(format!("nearly black: {lamps}"));
        }
        let whole = |message: String| FileError::new(Path::new(""), message);
        let reason = reason_for_darkness(accel, scene, camera, settings.resolution, &whole);
        Some(format!("black: {reason}"))
    }

    /// Warnings about flat lamps that face a near surface, for a picture that is too dark. `name`
    /// is the scene file.
    pub fn warnings_of_lamps(&self, name: &Path) -> Vec<Warning> {
        let findings = inspect_lamps(self.accel.as_dyn(), self.session.scene(), &|message| {
            FileError::new(name, message)
        });
        findings.iter().map(Finding::warning).collect()
    }

    /// Text with the reason why no surface of the scene is visible in the picture; `None` if a
    /// surface is visible.
    pub fn reason_for_emptiness(&self) -> Option<String> {
        let (session, accel) = (self.session, self.accel.as_dyn());
        reason_for_emptiness(accel, session.scene(), session.camera(), session.settings().resolution)
    }
}
