//! The state of a path from the camera between two vertices, and the step to the next vertex.

use super::strategy::PrevVertex;
use crate::accel::Accel;
use crate::bsdf::BsdfSample;
use crate::color::Spectrum;
use crate::geometry::Hit;
use crate::integrator::path_record;
use crate::integrator::vertex::Vertex;
use crate::integrator::{RayKind, Sink, World};
use crate::material::BsdfSlot;
use crate::math::Ray;
use crate::sampling::Wavelength;

/// State of a path between two vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    pub ray: Ray,
    /// Scattering events before `ray`: 0 at the camera.
    pub depth: u32,
    /// Throughput from the camera to `ray`.
    pub beta: Spectrum,
    /// Factor of `beta` in Russian roulette: the squared indices of refraction that `beta` has been
    /// divided by, and the throughput before the start of the path.
    pub roulette_scale: Spectrum,
    /// Wavelength of the light, if the scene disperses light. Its weight is 1 once glass has
    /// dispersed the path.
    pub wavelength: Option<Wavelength>,
    /// The scattering that `ray` comes from; `None` at the camera.
    pub prev: Option<PrevVertex>,
    /// Closest hit of `ray` and transmittance before it, if the ray has been traced.
    pub traced: Option<(Option<Hit>, Spectrum)>,
    /// True if the light that `ray` finds is estimated elsewhere.
    pub skips_emission: bool,
}

impl PathState {
    /// State before the first vertex.
    #[inline(always)]
    pub fn new(ray: Ray) -> Self {
        Self {
            ray,
            depth: 0,
            beta: Spectrum::ONE,
            roulette_scale: Spectrum::ONE,
            wavelength: None,
            prev: None,
            traced: None,
            skips_emission: false,
        }
    }

    /// Returns true if `ray` leaves a mirror, or the like.
    pub fn is_delta(&self) -> bool {
        self.prev.is_some_and(|prev| prev.is_delta)
    }

    /// Follows the ray to its first surface. `None` if it leaves the scene.
    ///
    /// A camera ray tells `out` what it sees. From the first glass on that disperses light, the path
    /// is of one wavelength, and its throughput gets the weight of the wavelength.
    #[inline(always)]
    pub fn next_vertex<'v, A: Accel>(
        &mut self,
        world: &'v World<A>,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Option<Vertex<'v>> {
        let (hit, transmittance) = self.traced.take().unwrap_or_else(|| {
            let kind = if self.depth == 0 {
                RayKind::Camera
            } else {
                RayKind::Bounce
            };
            world.intersect(&self.ray, kind, out)
        });
        self.beta *= transmittance;
        let vertex = world.vertex(&hit?, &self.ray, self.wavelength.as_ref(), slot);
        path_record::vertex(self.depth, &vertex, self.beta, out);
        if self.depth == 0 {
            world.see(&vertex, (&self.ray, self.beta), out);
        }
        if let Some(wavelength) = self.wavelength.as_mut().filter(|_| vertex.is_dispersing) {
            self.beta *= Spectrum::from(std::mem::replace(&mut wavelength.weight, [1.0; 3]));
        }
        Some(vertex)
    }

    /// State after `vertex` has scattered the path by `sample`. `light_samples` were taken there;
    /// `factor` makes up for paths that end there.
    #[inline(always)]
    pub fn scattered<A: Accel>(
        &self,
        world: &World<A>,
        vertex: &Vertex,
        sample: &BsdfSample,
        (factor, light_samples): (f32, u32),
        out: &mut impl Sink,
    ) -> Self {
        path_record::scatter(self.depth, vertex, sample, factor, out);
        Self {
            ray: world.ray_along(vertex, sample.wi),
            depth: self.depth + 1,
            beta: self.beta * sample.weight * factor,
            roulette_scale: self.roulette_scale * (sample.eta * sample.eta),
            wavelength: self.wavelength,
            prev: Some(PrevVertex::new(vertex, sample, light_samples)),
            traced: None,
            skips_emission: false,
        }
    }
}
