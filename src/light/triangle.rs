use super::LightSample;
use crate::color::Spectrum;
use crate::geometry::{Mesh, PrimId, SurfacePoint, offset_origin, triangle_area};
use crate::math::{Vec2, Vec3};
use crate::sampling::warp::uniform_triangle;
use std::f64::consts::PI;

/// A triangle that emits the same radiance in every direction of its front side.
#[derive(Clone, Copy, Debug)]
pub struct TriangleLight {
    corners: [Vec3; 3],
    normal: Vec3,
    area: f32,
    radiance: Spectrum,
}

impl TriangleLight {
    /// The triangle `prim` of `mesh` emitting `radiance`, W·sr⁻¹·m⁻².
    pub fn new(mesh: &Mesh, prim: PrimId, radiance: Spectrum) -> Self {
        let corners = mesh.corners(prim);
        let [p0, p1, p2] = corners;
        Self {
            corners,
            normal: mesh.surface_point(prim, 0.0, 0.0).ng,
            area: triangle_area(p0, p1, p2) as f32,
            radiance,
        }
    }

    /// Radiance that leaves the triangle in direction `w`.
    pub fn emitted(&self, w: Vec3) -> Spectrum {
        if w.dot(self.normal) > 0.0 {
            self.radiance
        } else {
            Spectrum::ZERO
        }
    }

    /// Draws a uniform point on the triangle, seen from `p`.
    #[inline(always)]
    pub(super) fn sample(&self, p: Vec3, u: Vec2) -> Option<LightSample> {
        let (b1, b2) = uniform_triangle(u);
        let q = SurfacePoint::on_triangle(self.corners, self.normal, b1, b2);
        let wi = (q.p - p).try_normalize()?;
        let pdf = self.pdf(p, q.p, wi);
        // A light that faces away is the common reason to end here.
        if pdf <= 0.0 {
            return None;
        }
        Some(LightSample {
            wi,
            radiance: self.radiance,
            pdf,
            is_delta: false,
            target: Some(offset_origin(&q, -wi)),
        })
    }

    /// Density per solid angle at `p` of sampling the point `q` of the triangle, in direction `wi`; 0 behind it.
    ///
    /// Uniform area density `1 / A` turned into solid angle by `r² / cos θ`.
    pub fn pdf(&self, p: Vec3, q: Vec3, wi: Vec3) -> f32 {
        let cos_light = -wi.dot(self.normal);
        if cos_light <= 0.0 {
            return 0.0;
        }
        let pdf = p.distance_squared(q) / (cos_light * self.area);
        // Edge-on or vanishing triangles: a density that is no number is no sample.
        if pdf.is_finite() { pdf } else { 0.0 }
    }

    /// `π A L`.
    pub(super) fn power(&self) -> f64 {
        PI * self.area as f64 * self.radiance.luminance() as f64
    }
}
