//! Plans, elevations and pictures to scale. The camera and the image size are computed from the
//! bounding box of the scene.

use super::{Error, InvalidSetting, Session, Settings};
use crate::camera::ProjectionKind;
use crate::guess::{Elevation, drawing_axes};
use crate::math::{DVec3, UVec2, Vec3};
use crate::options::{SizeOptions, Value};
use crate::scene::Scene;
use crate::scene_file::SceneFile;

/// Margin around the scene, as a fraction of the larger side of the scene in the picture.
const MARGIN: f64 = 0.02;

impl Settings {
    /// If an elevation or a scale is requested, returns settings with the camera and the image size
    /// for it. Else returns the settings unchanged.
    ///
    /// # Errors
    ///
    /// An elevation has another projection than orthographic, or the scene is empty. A scale is set
    /// for a projection that is not orthographic, or the scale is too large.
    pub(crate) fn drawn(mut self, file: &SceneFile, scene: &Scene, pool: &rayon::ThreadPool) -> Result<Self, Error> {
        let metres = f64::from(self.camera.unit.unwrap_or(1.0));
        let pixels_per_unit = self.print.map(|print| print.pixels_per_metre() * metres);
        let refused = |setting, value: String, help: &str| Err(InvalidSetting::new(setting, value, help).into());
        if let Some(elevation) = self.camera.elevation {
            let kind = self.camera.projection;
            if let Some(kind) = kind.filter(|kind| *kind != ProjectionKind::Orthographic) {
                let value = format!("{}: the projection is `{}`", elevation.text(), kind.text());
                return refused(
                    "elevation",
                    value,
                    "leave out the projection: elevations are orthographic",
                );
            }
            let bounds = scene.bounds();
            if bounds.is_empty() {
                return refused("elevation", elevation.text(), "the scene is empty: add an object");
            }
            let axes = elevation.axes(self.drawing_axes(elevation, file, scene, pool)?);
            let [min, max] = [bounds.min, bounds.max].map(Vec3::as_dvec3);
            let extent = max - min;
            let along = |axis: Vec3| extent.dot(axis.as_dvec3().abs());
            let [width, height, depth] = [axes.right, axes.up, axes.back].map(along);
            let margin = MARGIN * width.max(height).max(f64::from(f32::MIN_POSITIVE));
            let [width, height] = [width, height].map(|side| side + 2.0 * margin);
            let center = 0.5 * (min + max);
            // Place the camera outside of the box, so that rays start in front of it
            let distance = 0.5 * depth + depth.max(width).max(height);
            self.camera.options.elevation = None;
            self.camera.options.projection = Some(ProjectionKind::Orthographic);
            self.camera.options.position = Some(center + distance * axes.back.as_dvec3());
            self.camera.options.look_at = Some(center);
            self.camera.options.up = Some(axes.up);
            match pixels_per_unit {
                Some(pixels) if self.is_page => {
                    let [width, height] = [width, height].map(|side| (side * pixels).ceil());
                    let page = self.resolution.as_dvec2();
                    if width > page.x || height > page.y {
                        let size = format!("{width} x {height} pixels, and the page has {} x {}", page.x, page.y);
                        let value = self.print.map(|print| print.scale.text()).unwrap_or_default();
                        let help = "use a larger --size, a smaller scale such as 1:100, or fewer --dpi";
                        return refused("scale", format!("{value}: the drawing has {size}"), help);
                    }
                    self.camera.options.ortho_height = Some((page.y / pixels) as f32);
                }
                Some(pixels) => return self.sized([width, height].map(|side| side * pixels), pixels),
                None => {
                    let aspect = f64::from(self.resolution.x) / f64::from(self.resolution.y);
                    self.camera.options.ortho_height = Some(height.max(width / aspect) as f32);
                }
            }
            return Ok(self);
        }
        let Some(pixels) = pixels_per_unit else {
            return Ok(self);
        };
        if self.camera.projection() != ProjectionKind::Orthographic {
            let value = self.print.map(|print| print.scale.text()).unwrap_or_default();
            let help = "use --plan, --elevation or --projection orthographic: other projections have no scale";
            return refused("scale", value, help);
        }
        match self.camera.ortho_height {
            Some(height) => {
                // Round to whole pixels: a height that was computed from the box has rounding
                // errors
                let height = (f64::from(height) * pixels).round();
                let aspect = f64::from(self.resolution.x) / f64::from(self.resolution.y);
                self.sized([(height * aspect).round(), height], pixels)
            }
            None => {
                self.camera.options.ortho_height = Some((f64::from(self.resolution.y) / pixels) as f32);
                Ok(self)
            }
        }
    }

    /// Upright axis and front of a drawing. If neither the settings nor the file have an upright
    /// axis, both axes are guessed, as for `--view`. The axes of a plan are not guessed if the file
    /// has sections: the sections were made before, along the usual axis.
    fn drawing_axes(
        &self,
        elevation: Elevation,
        file: &SceneFile,
        scene: &Scene,
        pool: &rayon::ThreadPool,
    ) -> Result<[Vec3; 2], Error> {
        let is_known = self.camera.up.is_some() || self.camera.axes.declared.is_some();
        if is_known || (elevation == Elevation::Plan && !file.section.is_empty()) {
            return Ok(drawing_axes(self.camera.up, &self.camera.axes));
        }
        let accel = self.backend.for_guesses().build(scene, pool)?;
        Ok(pool.install(|| self.finder(file, scene, accel.as_dyn(), pool).drawing_axes()))
    }

    /// Settings for a picture of `size` pixels, which is rounded up to whole pixels. `pixels` is
    /// the number of pixels per scene unit.
    fn sized(mut self, size: [f64; 2], pixels: f64) -> Result<Self, Error> {
        let [width, height] = size.map(|side| side.ceil().max(1.0));
        let options = SizeOptions {
            width: Some(width as u32),
            height: Some(height as u32),
        };
        let is_too_large = width > f64::from(u32::MAX) || height > f64::from(u32::MAX);
        if is_too_large || crate::options::OptionGroup::invalid(&options).is_some() {
            let value = self.print.map(|print| print.scale.text()).unwrap_or_default();
            let value = format!("{value}: the picture would have {width} x {height} pixels");
            let help =
                "use a smaller scale, such as 1:100, or fewer --dpi; --unit cm or mm sets the unit of the OBJ file";
            return Err(InvalidSetting::new("scale", value, help).into());
        }
        self.resolution = UVec2::new(width as u32, height as u32);
        self.camera.options.ortho_height = Some((height / pixels) as f32);
        Ok(self)
    }
}

impl Session {
    /// Text for a drawing to scale: the scale, the size of the paper, and the unit of the scene.
    /// `None` if no scale is set.
    pub fn words_of_scale(&self) -> Option<String> {
        let print = self.settings.print?;
        let millimetres = |pixels: u32| (25.4 * f64::from(pixels) / f64::from(print.dpi)).round();
        let [width, height] = self.settings.resolution.to_array().map(millimetres);
        let unit = match self.settings.camera.unit {
            Some(metres) => format!("a unit of the scene is {metres} m"),
            None => "a unit of the scene is a metre, since no file names the unit".into(),
        };
        Some(format!(
            "{} at {} pixels per inch, on {width} x {height} mm of paper; {unit} (--unit changes that)",
            print.scale.text(),
            print.dpi
        ))
    }

    /// Text for a drawing of the scene as `elevation`: the axis from which the scene is seen, and
    /// the axis that is up.
    pub fn words_of(&self, elevation: Elevation) -> String {
        let camera = &self.camera_description().parameters;
        let axis = |v: Vec3| {
            let at = v.abs().max_position();
            format!("{}{}", if v[at] < 0.0 { '-' } else { '+' }, ["x", "y", "z"][at])
        };
        let view = match elevation {
            Elevation::Plan => "plan".into(),
            side => format!("{} elevation", side.text()),
        };
        format!(
            "{view} seen from {}, with {} up (--up AXIS and another --elevation change that)",
            axis(camera.position - camera.look_at),
            axis(camera.up)
        )
    }
}

/// Name of the axis, such as `-z`, for a section at a height above the lowest point of the scene.
/// `up` is the upright axis of the scene.
pub(crate) fn name_of_axis(up: DVec3) -> &'static str {
    match (up.abs().max_position(), up.max_element() > 0.0) {
        (0, true) => "x",
        (1, true) => "y",
        (2, true) => "z",
        (0, false) => "-x",
        (1, false) => "-y",
        _ => "-z",
    }
}
