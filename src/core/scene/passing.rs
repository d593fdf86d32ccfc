//! Surfaces through which rays can pass without a change of direction: surfaces with an opacity
//! below 1, and thin glass (`material/thin_surface.rs`).

use super::Scene;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::material::ThinSurface;
use crate::math::Ray;

impl Scene {
    /// Returns true if the scene has a surface through which rays can pass without a change of
    /// direction: a surface with an opacity below 1, thin glass, the hull of a light, a surface
    /// that only camera rays hit, or a surface without a back.
    #[inline(always)]
    pub fn lets_light_pass(&self) -> bool {
        self.has_alpha || self.has_thin_surfaces || self.has_lamp_hulls || self.hides_from_light || self.hides_backs
    }

    /// Returns true if a surface is hidden from camera rays but not from other rays.
    #[inline(always)]
    pub fn hides_from_camera(&self) -> bool {
        self.hides_from_camera
    }

    /// Returns true if `ray` hits the surface at `hit`. `is_from_camera` is true for rays from the
    /// camera to the first visible surface.
    pub fn is_visible(&self, hit: &Hit, ray: &Ray, is_from_camera: bool) -> bool {
        let is_visible = if is_from_camera {
            self.is_visible_to_camera(hit)
        } else {
            self.material(hit).light_visible
        };
        is_visible && !(self.hides_backs && self.passes_back(hit, ray))
    }

    /// Returns true if the material at `hit` is visible to camera rays.
    pub fn is_visible_to_camera(&self, hit: &Hit) -> bool {
        self.material(hit).camera_visible
    }

    /// Returns true if the surface at `hit` has no back ([`Mesh::is_front_only`]), and `ray`
    /// arrives from there.
    ///
    /// [`Mesh::is_front_only`]: crate::geometry::Mesh::is_front_only
    #[inline(never)]
    fn passes_back(&self, hit: &Hit, ray: &Ray) -> bool {
        self.mesh(hit.geom).is_front_only && self.surface_point(hit, ray.time).ng.dot(ray.direction) > 0.0
    }

    /// Returns true if any surface has an opacity below 1.
    #[inline(always)]
    pub fn has_alpha(&self) -> bool {
        self.has_alpha
    }

    /// Returns true if there is a thin surface through which rays can pass without a change of
    /// direction.
    #[inline(always)]
    pub fn has_thin_surfaces(&self) -> bool {
        self.has_thin_surfaces
    }

    /// Number of panes of solid glass that became thin dielectrics. Panes of a prototype count
    /// once.
    pub fn panes(&self) -> u64 {
        self.panes
    }

    /// Probability that `ray` passes through the thin glass at `hit` without a change of direction,
    /// and the factor by which light that passes is multiplied. `None` if the surface is not thin
    /// glass.
    pub fn thin_surface_along(&self, hit: &Hit, ray: &Ray) -> Option<(f32, Spectrum)> {
        if !self.has_thin_surfaces {
            return None;
        }
        let surface = self.thin_surfaces[self.shape(hit.geom).material.0 as usize].as_ref()?;
        let wo = -ray.direction.normalize_or_zero();
        let cos = self.surface_point(hit, ray.time).seen_from(wo).ns.dot(wo).abs();
        Some((surface.pass_probability(cos), surface.tint))
    }

    /// Probability with which the surface at `hit` stops a ray. The mirror reflection of thin glass
    /// is not included, because its probability depends on the direction.
    pub fn stopping_share(&self, hit: &Hit) -> f32 {
        let surface = self.thin_surfaces[self.shape(hit.geom).material.0 as usize].as_ref();
        self.opacity(hit) * surface.map_or(1.0, ThinSurface::scattered_share)
    }

    /// Opacity of the surface at `hit`, in [0, 1].
    pub fn opacity(&self, hit: &Hit) -> f32 {
        let material = self.material(hit);
        if material.maps.varies_opacity() {
            // Look up the opacity without filtering, so that edges stay sharp.
            material.opacity_at(&self.spot(hit, 0.0, 0.0))
        } else {
            material.opacity
        }
    }
}
