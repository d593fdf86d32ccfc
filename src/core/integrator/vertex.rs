//! A vertex of a camera path: a surface point with its local frame and its BSDF.

use crate::bsdf::{Bsdf, BsdfSample, BsdfView, ScatteringEvent, TransportMode};
use crate::color::Spectrum;
use crate::geometry::{Hit, SurfacePoint};
use crate::light_sampling::LightSampleContext;
use crate::material::BsdfSlot;
use crate::math::{Frame, Vec2, Vec3};

/// A vertex of a camera path: a surface point with its local frame and BSDF.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a> {
    /// Hit of the ray that found the vertex.
    pub hit: Hit,
    /// Surface point of the hit.
    pub point: SurfacePoint,
    /// Local frame, whose z axis is the shading normal.
    pub frame: Frame,
    /// BSDF of the surface at the point.
    pub bsdf: &'a Bsdf,
    /// Unit direction from which the path arrives (towards the camera), local frame.
    pub wo: Vec3,
    /// `bsdf` prepared for the direction `wo` by [`Vertex::view_in`]. `None` if `bsdf` has a single
    /// lobe, which needs no preparation.
    pub view: Option<&'a BsdfView<'a>>,
    /// True if the shading normal was bent so that the viewer is above it.
    pub is_bent: bool,
    /// True if `bsdf` is the BSDF of one wavelength.
    pub is_dispersing: bool,
    /// Index of the absorbing body behind the surface, as in [`Ray::body`](crate::math::Ray::body);
    /// 0 if there is none.
    pub body: u32,
}

impl<'a> Vertex<'a> {
    /// Prepares `bsdf` for the direction `wo`, and stores the result in `slot`. `None` if `bsdf`
    /// has a single lobe, which needs no preparation.
    #[inline(always)]
    pub fn view_in(slot: &'a BsdfSlot<'a>, bsdf: &'a Bsdf, wo: Vec3) -> Option<&'a BsdfView<'a>> {
        Self::needs_view(bsdf).then(|| slot.view.get_or_init(|| BsdfView::new(bsdf, wo)))
    }

    /// Returns `true` if a vertex with the BSDF `bsdf` needs a [`BsdfView`], because it has several
    /// lobes.
    #[inline(always)]
    pub fn needs_view(bsdf: &Bsdf) -> bool {
        !matches!(bsdf, Bsdf::Single(_))
    }

    /// Value of the BSDF for light from `wi` (local frame) without the cosine, and the density per
    /// solid angle with which [`Vertex::sample`] samples `wi`.
    #[inline(always)]
    pub fn eval_pdf(&self, wi: Vec3) -> (Spectrum, f32) {
        match self.view {
            Some(view) => view.eval_pdf(wi),
            None => self.bsdf.eval_pdf(self.wo, wi),
        }
    }

    /// Samples a direction `wi` from the BSDF: `u_lobe` chooses a lobe, and `u` a direction.
    #[inline(always)]
    pub fn sample(&self, u_lobe: f32, u: Vec2) -> Option<BsdfSample> {
        match self.view {
            Some(view) => view.sample(u_lobe, u, TransportMode::Radiance),
            None => self.bsdf.sample(self.wo, u_lobe, u, TransportMode::Radiance),
        }
    }

    /// Directional albedo per channel: fraction of uniform incident light that the surface scatters
    /// to the viewer.
    #[inline(always)]
    pub fn albedo(&self) -> Spectrum {
        match self.view {
            Some(view) => view.directional_albedo(),
            None => self.bsdf.directional_albedo(self.wo),
        }
    }

    /// Scattering event of light from `wi` (local frame). If `is_delta`, a delta lobe scatters the
    /// light, otherwise the smooth lobes.
    pub fn event(&self, wi: Vec3, is_delta: bool) -> ScatteringEvent {
        self.bsdf.event(self.wo, wi, is_delta)
    }

    /// Probability that [`Vertex::sample`] chooses a smooth lobe.
    pub fn smooth_probability(&self) -> f32 {
        match self.view {
            Some(view) => view.smooth_probability(),
            None => self.bsdf.smooth_probability(self.wo),
        }
    }

    /// Light sampling context of the point. Its normal is zero if light may arrive from both sides.
    #[inline(always)]
    pub fn light_context(&self) -> LightSampleContext {
        let n = match self.bsdf.glossy_eta(self.wo) {
            Some(_) => Vec3::ZERO,
            None => self.point.ns * 1f32.copysign(self.wo.z),
        };
        LightSampleContext { p: self.point.p, n }
    }

    /// Returns `true` if the unit direction `w` (world frame) is on different sides of the shading
    /// normal and of the geometric normal. Photons and light subpaths carry no light in such
    /// directions.
    pub fn is_one_way(&self, w: Vec3) -> bool {
        !self.point.sides_agree(w)
    }

    /// Index of the absorbing body in which rays in the direction `wi` (local frame) start, as in
    /// [`Ray::body`](crate::math::Ray::body).
    #[inline(always)]
    pub fn body_towards(&self, wi: Vec3) -> u32 {
        if wi.z < 0.0 { self.body } else { 0 }
    }
}
