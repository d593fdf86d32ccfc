//! Surfaces that rays pass straight on: by their opacity, or as thin glass (`material/thin_surface.rs`).

use super::Scene;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::material::ThinSurface;
use crate::math::Ray;

impl Scene {
    /// Returns true if rays may pass any surface straight on: by its opacity, as thin glass, beside a
    /// lamp within its hull, or if only the camera sees it.
    #[inline(always)]
    pub fn lets_light_pass(&self) -> bool {
        self.has_alpha || self.has_thin_surfaces || self.has_lamp_hulls || self.hides_from_light
    }

    /// Returns true if rays from the camera pass some surface that others meet.
    #[inline(always)]
    pub fn hides_from_camera(&self) -> bool {
        self.hides_from_camera
    }

    /// Returns true if a ray meets the surface at `hit`: one from the camera to what it sees first, or
    /// any other.
    pub fn is_met(&self, hit: &Hit, is_from_camera: bool) -> bool {
        let material = self.material(hit);
        if is_from_camera {
            material.camera_visible
        } else {
            material.light_visible
        }
    }

    /// Whether any surface has an opacity below 1.
    #[inline(always)]
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// Whether rays pass any thin surface straight on.
    #[inline(always)]
    pub fn has_thin_surfaces(&self) -> bool {
        self.has_thin_surfaces
    }

    /// Number of panes of solid glass that became thin dielectrics; those of a prototype count once.
    pub fn panes(&self) -> u64 {
        self.panes
    }

    /// Probability with which thin glass at `hit` lets `ray` pass straight on, and the factor of the light that passes; `None` where the surface is no
    /// such glass.
    pub fn thin_surface_along(&self, hit: &Hit, ray: &Ray) -> Option<(f32, Spectrum)> {
        if !self.has_thin_surfaces {
            return None;
        }
        let surface = self.thin_surfaces[self.shape(hit.geom).material.0 as usize].as_ref()?;
        let wo = -ray.direction.normalize_or_zero();
        let cos = self.surface_point(hit, ray.time).seen_from(wo).ns.dot(wo).abs();
        Some((surface.pass_probability(cos), surface.tint))
    }

    /// Probability with which the surface at `hit` stops rays, where that is the same for all directions; that of a mirror is left out.
    pub fn stopping_share(&self, hit: &Hit) -> f32 {
        let surface = self.thin_surfaces[self.shape(hit.geom).material.0 as usize].as_ref();
        self.opacity(hit) * surface.map_or(1.0, ThinSurface::scattered_share)
    }

    /// The share of the surface at `hit` that is there, in [0, 1].
    pub fn opacity(&self, hit: &Hit) -> f32 {
        let material = self.material(hit);
        if material.maps.varies_opacity() {
            // Edges stay sharp.
            material.opacity_at(&self.spot(hit, 0.0, 0.0))
        } else {
            material.opacity
        }
    }
}
