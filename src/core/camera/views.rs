//! Views: pictures that are rendered separately, and shown in one picture.
//!
//! A picture is a grid of views of equal size. Each view has a camera, and random numbers that
//! depend on the pixel within the view. A view is therefore bit-identical to a single picture of
//! the same camera, with every light transport method and filter. No light, sample or pixel filter
//! crosses a border between two views.

use super::projection::{CubeLayout, FACE_FOV, Face};
use super::{Camera, CameraDescription, CameraError, CameraParameters, Projection};
use crate::math::UVec2;

/// A part of a picture, with the camera that shows it.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Camera of the view. Its resolution is the size of the view.
    pub camera: Camera,
    /// First pixel of the view in the picture.
    pub corner: UVec2,
}

impl CameraDescription {
    /// Size of a view of a picture of `resolution` pixels: the size of the picture if it has one
    /// view.
    pub fn view_size(&self, resolution: UVec2) -> UVec2 {
        match (self.projection, self.stereo) {
            (Projection::Cubemap, _) => {
                CubeLayout::of(resolution).map_or(resolution, |layout| UVec2::splat(layout.side))
            }
            (_, Some(stereo)) => stereo.layout.view_size(resolution),
            _ => resolution,
        }
    }

    /// Views of a picture of `resolution` pixels, row by row. There is one view, except in cube
    /// maps, where each face is a view, and in stereo pictures, where each eye has a view.
    ///
    /// # Errors
    ///
    /// A camera is invalid, or the picture cannot be divided into views.
    pub fn views(&self, resolution: UVec2) -> Result<Vec<View>, CameraError> {
        if let Some(stereo) = self.stereo {
            stereo.check(&self.projection, resolution)?;
            let view = |(corner, eye)| {
                let projection = stereo.projection(eye, self.projection, self.parameters.vertical_fov);
                let middle = Self {
                    projection,
                    stereo: None,
                    ..*self
                };
                let middle = middle.camera(stereo.layout.view_size(resolution))?;
                Ok(View {
                    camera: middle.with_eye(eye),
                    corner,
                })
            };
            return stereo.eyes(resolution).into_iter().map(view).collect();
        }
        let whole = self.camera(resolution)?;
        let layout = match self.projection {
            Projection::Cubemap => CubeLayout::of(resolution),
            _ => None,
        };
        let Some(layout) = layout else {
            let corner = UVec2::ZERO;
            return Ok(vec![View { camera: whole, corner }]);
        };
        let face = Self {
            parameters: CameraParameters {
                vertical_fov: FACE_FOV,
                ..self.parameters
            },
            projection: Projection::default(),
            ..*self
        };
        let front = face.camera(UVec2::splat(layout.side))?;
        let view = |(index, face)| View {
            camera: front.turned(face),
            corner: layout.corner(index),
        };
        Ok(Face::ALL.into_iter().enumerate().map(view).collect())
    }
}
