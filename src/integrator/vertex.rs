//! A vertex of a path from the camera: a surface point with its BSDF, as its viewer sees it.

use crate::bsdf::Bsdf;
use crate::geometry::{Side, SurfacePoint, offset_to};
use crate::light::LightSampleContext;
use crate::math::{Frame, Ray, Vec3};

/// A surface point with the local frame and the scattering that hold there.
#[derive(Clone, Copy)]
pub(crate) struct Vertex<'a> {
    pub point: SurfacePoint,
    pub frame: Frame,
    pub bsdf: &'a Bsdf,
    /// Direction to the viewer, local frame.
    pub wo: Vec3,
    /// Whether the shading normal was bent towards the viewer.
    pub is_bent: bool,
}

impl Vertex<'_> {
    /// The point as one that light falls on.
    #[inline(always)]
    pub fn light_context(&self) -> LightSampleContext {
        let n = match self.bsdf.glossy_eta(self.wo) {
            Some(_) => Vec3::ZERO,
            None => self.point.ns * 1f32.copysign(self.wo.z),
        };
        LightSampleContext { p: self.point.p, n }
    }

    /// The ray that goes on in direction `wi` (local frame).
    #[inline(always)]
    pub fn ray_along(&self, wi: Vec3) -> Ray {
        Ray::new(self.origin(wi), self.frame.to_world(wi)).when(self.point.time)
    }

    /// Where rays in direction `wi` (local frame) start: on the side that it has by the shading normal. By the geometric one it may be another;
    /// then the ray meets the surface, or what is behind a curved one's rim, but never starts behind a wall.
    #[inline(always)]
    pub fn origin(&self, wi: Vec3) -> Vec3 {
        offset_to(&self.point, Side::of(wi.z))
    }
}
