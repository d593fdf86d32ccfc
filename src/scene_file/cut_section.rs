//! `[[section]]`: planes that cut the scene, including the planes of the flag `--cut`.

use super::FileError;
use super::section::{key_types, section, value};
use super::source::Source;
use crate::math::{Bounds3, DVec3, excerpt};
use crate::scene::SectionPlane;
use std::ops::Range;
use toml::Spanned;

/// Names of the axes of planes. A cut keeps the part of the scene that lies below the plane along
/// the axis. A minus reverses the axis.
const AXES: &[&str] = &["x", "y", "z", "-x", "-y", "-z"];

section! {
    /// `[[section]]`: a plane that cuts the scene open. Several planes cut one after the other.
    #[derive(Default)]
    pub struct CutSection {
        required {}
        /// Axis of the plane: the part below `value` is kept, or with a minus the part above
        axis: String, names AXES;
        /// Coordinate of the plane along its axis, scene units
        value: f64;
        /// Distance of the plane from the lowest point of the scene along its axis
        ///
        /// In place of `value`.
        height: f64;
        /// Normal of a plane of any direction: the part in front of the plane is cut off
        ///
        /// In place of `axis` and `value`.
        normal: [f32; 3];
        /// Point of the plane with this normal
        point: [f32; 3], default "0 0 0";
        /// Material of the caps that close the cut, by its name
        ///
        /// The material is defined in the scene file or in an MTL file of its objects. Texture
        /// coordinates of caps are in scene units.
        material: String, default "dark grey";
    }
}

key_types! {
    f64: |number| number;
}

impl CutSection {
    /// Makes the section of the plane `AXIS=VALUE` of the flag `--cut`. Errors about the section
    /// point to `span`.
    pub(super) fn of_flag(text: &str, span: Range<usize>) -> Option<Self> {
        let (axis, number) = text.split_once('=')?;
        let (axis, number) = (axis.trim(), number.trim().parse::<f64>().ok()?);
        (AXES.contains(&axis) && number.is_finite()).then(|| Self {
            axis: Some(Spanned::new(span.clone(), axis.to_string())),
            value: Some(Spanned::new(span, number)),
            ..Self::default()
        })
    }

    /// Makes the section of the plane at `height` above the scene's lowest point along `axis`.
    /// Errors about the section point to `span`.
    pub(super) fn above_lowest(axis: &str, height: f64, span: Range<usize>) -> Self {
        Self {
            axis: Some(Spanned::new(span.clone(), axis.to_string())),
            height: Some(Spanned::new(span, height)),
            ..Self::default()
        }
    }

    /// Span of the section in the file.
    pub(super) fn span(&self) -> Range<usize> {
        let axis = self.axis.as_ref().map(Spanned::span);
        axis.or_else(|| self.normal.as_ref().map(Spanned::span))
            .or_else(|| self.value.as_ref().map(Spanned::span))
            .unwrap_or(0..0)
    }

    /// Description of the plane for messages.
    pub(super) fn words(&self) -> String {
        match (&self.axis, &self.value, &self.normal) {
            (Some(axis), None, _) => {
                let height = self.height.as_ref().map_or(f64::NAN, |height| *height.get_ref());
                format!("{} {height} above the lowest point", axis.get_ref())
            }
            (Some(axis), Some(value), _) => format!("{}={}", axis.get_ref(), value.get_ref()),
            (.., Some(normal)) => {
                let [x, y, z] = normal.get_ref();
                format!("normal {x} {y} {z}")
            }
            _ => String::new(),
        }
    }

    /// The plane in a scene with the bounding box `bounds`. If the plane is invalid, the error
    /// points to its key in `file`.
    pub(super) fn plane(&self, file: &Source, bounds: Bounds3) -> Result<SectionPlane, FileError> {
        let wrong = |span: Range<usize>, message: String, help: &str| Err(file.error(span, message).help(help));
        let help = "write axis = \"z\" and value = 1.2, or normal = [0, 0, 1] and point = [0, 0, 1.2]";
        match (&self.axis, &self.normal) {
            (Some(axis), Some(_)) => wrong(
                axis.span(),
                "both `axis` and `normal` are given".into(),
                "keep one of them",
            ),
            (None, None) => wrong(self.span(), "a [[section]] without a plane".into(), help),
            (Some(axis), None) => {
                if !AXES.contains(&axis.get_ref().as_str()) {
                    let message = format!("axis = {}", excerpt(axis.get_ref()));
                    return wrong(axis.span(), message, &format!("choose among {}", AXES.join(", ")));
                }
                let (sign, name) = match axis.get_ref().strip_prefix('-') {
                    Some(name) => (-1.0, name),
                    None => (1.0, axis.get_ref().as_str()),
                };
                let direction = match name {
                    "x" => sign * DVec3::X,
                    "y" => sign * DVec3::Y,
                    _ => sign * DVec3::Z,
                };
                let ends = [bounds.min, bounds.max].map(|corner| direction.dot(corner.as_dvec3()));
                let along = match (&self.value, &self.height) {
                    (Some(value), None) => sign * value.get_ref(),
                    (None, Some(height)) if bounds.is_empty() => *height.get_ref(),
                    (None, Some(height)) => ends[0].min(ends[1]) + height.get_ref(),
                    (Some(value), Some(_)) => {
                        return wrong(
                            value.span(),
                            "both `value` and `height` are given".into(),
                            "keep one of them",
                        );
                    }
                    (None, None) => f64::NAN,
                };
                SectionPlane::new(direction, along * direction).map_or_else(
                    || wrong(axis.span(), "`axis` needs a finite `value` or `height`".into(), help),
                    Ok,
                )
            }
            (None, Some(normal)) => {
                let point = value(&self.point).unwrap_or_default();
                let [direction, point] = [*normal.get_ref(), point].map(|v| DVec3::from(v.map(f64::from)));
                SectionPlane::new(direction, point).map_or_else(
                    || {
                        let message = "the normal must be finite and not zero, and the point finite".into();
                        wrong(normal.span(), message, help)
                    },
                    Ok,
                )
            }
        }
    }
}
