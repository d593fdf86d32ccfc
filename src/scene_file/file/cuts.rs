//! Adds cutting planes that flags set (`--cut`, `--plan`) to a scene file.

use super::SceneFile;
use crate::math::excerpt;
use crate::scene_file::{CutSection, FileError};

impl SceneFile {
    /// Adds the cutting plane of each flag `--cut AXIS=VALUE`. `planes` are the texts `AXIS=VALUE`,
    /// in coordinates of the OBJ file.
    ///
    /// # Errors
    ///
    /// A text is not a plane.
    pub fn cut(&mut self, planes: &[String]) -> Result<(), FileError> {
        let origin = self.origin();
        for text in planes {
            let written = format!("--cut {text}");
            let span = self.flag_span(&written);
            let Some(mut section) = CutSection::of_flag(text, span) else {
                let error = self.whole(format!("--cut {}: not a plane", excerpt(text))).of_flag();
                let help = "use AXIS=VALUE: z=1.2 keeps the part below the plane, -z=1.2 the part above";
                return Err(error.help(help));
            };
            let axis = section.axis.as_ref().map_or("", |axis| axis.get_ref());
            let shift = match axis.trim_start_matches('-') {
                "x" => origin.x,
                "y" => origin.y,
                _ => origin.z,
            };
            if let Some(value) = &mut section.value {
                *value.get_mut() -= shift;
            }
            self.section.push(section);
        }
        Ok(())
    }

    /// Adds the cutting plane of a plan, at `height` above the lowest point of the scene along
    /// `axis`.
    pub(crate) fn cut_above_lowest(&mut self, axis: &str, height: f64) {
        let span = self.flag_span(format!("--plan {height}"));
        self.section.push(CutSection::above_lowest(axis, height, span));
    }
}
