//! State of a camera path between two vertices, and the step to the next vertex.

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

/// Closest hit of a ray, and the transmittance up to the hit.
pub(crate) type RayResult = (Option<Hit>, Spectrum);

/// State of a camera path between two vertices.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PathState {
    pub ray: Ray,
    /// Number of scattering events before `ray`: 0 at the camera.
    pub depth: u32,
    /// Throughput from the camera to `ray`.
    pub beta: Spectrum,
    /// Factor by which Russian roulette multiplies `beta`: the squared indices of refraction by
    /// which `beta` was divided. If the path continues another path, the factor includes the
    /// throughput of that path.
    pub roulette_scale: Spectrum,
    /// Vertex at the start of `ray`, with the sampled direction; `None` at the camera.
    pub prev: Option<PrevVertex>,
    /// True if the emission that `ray` hits is added elsewhere.
    pub skips_emission: bool,
    /// True after glass dispersed the light. The path then has one wavelength.
    pub is_dispersed: bool,
}

impl PathState {
    /// State of a path before its first vertex.
    #[inline(always)]
    pub fn new(ray: Ray) -> Self {
        Self {
            ray,
            depth: 0,
            beta: Spectrum::ONE,
            roulette_scale: Spectrum::ONE,
            prev: None,
            skips_emission: false,
            is_dispersed: false,
        }
    }

    /// Returns `true` if `ray` leaves a mirror or another delta lobe.
    pub fn is_delta(&self) -> bool {
        self.prev.is_some_and(|prev| prev.is_delta)
    }

    /// Traces the ray to the first surface that stops it. Returns `None` if the ray leaves the
    /// scene. `traced` is the result of the ray query, if it was made already.
    #[inline(always)]
    pub fn intersect<A: Accel>(
        &mut self,
        world: &World<A>,
        traced: Option<RayResult>,
        out: &mut impl Sink,
    ) -> Option<Hit> {
        let (hit, transmittance) = match traced {
            Some(traced) => traced,
            None if self.depth == 0 => world.intersect(&self.ray, RayKind::Camera, out),
            None => world.intersect(&self.ray, RayKind::Bounce, out),
        };
        self.beta *= transmittance;
        hit
    }

    /// Vertex at `hit` on the ray of the path. If the ray is a camera ray, passes the surface or
    /// the ground that the ray sees to `out`.
    ///
    /// From the first dispersive glass on, the light of the path has the wavelength `wavelength`,
    /// and the throughput includes the weight of the wavelength.
    #[inline(always)]
    pub fn vertex<'v, A: Accel>(
        &mut self,
        world: &'v World<A>,
        hit: &Hit,
        wavelength: Option<&Wavelength>,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Vertex<'v> {
        let vertex = world.vertex(hit, &self.ray, wavelength, slot);
        path_record::vertex(self.depth, &vertex, self.beta, out);
        if self.depth == 0 {
            world.see(&vertex, &self.ray, self.beta, out);
        }
        if let Some(wavelength) = wavelength.filter(|_| vertex.is_dispersing && !self.is_dispersed) {
            self.beta *= Spectrum::from(wavelength.weight);
            self.is_dispersed = true;
        }
        vertex
    }

    /// Finds the next vertex, by [`PathState::intersect`] and [`PathState::vertex`].
    #[inline(always)]
    pub fn next_vertex<'v, A: Accel>(
        &mut self,
        world: &'v World<A>,
        wavelength: Option<&Wavelength>,
        slot: &'v BsdfSlot<'v>,
        out: &mut impl Sink,
    ) -> Option<Vertex<'v>> {
        let hit = self.intersect(world, None, out)?;
        Some(self.vertex(world, &hit, wavelength, slot, out))
    }

    /// Next segment of the path after `vertex` scattered the path in the direction of `sample`.
    /// `light_samples` is the number of light samples at the vertex. `factor` compensates for paths
    /// that end at the vertex.
    #[inline(always)]
    pub fn scatter<A: Accel>(
        &self,
        world: &World<A>,
        vertex: &Vertex,
        sample: &BsdfSample,
        factor: f32,
        light_samples: u32,
        out: &mut impl Sink,
    ) -> NextSegment {
        path_record::scatter(self.depth, vertex, sample, factor, out);
        NextSegment {
            ray: world.ray_along(vertex, sample.wi),
            beta: self.beta * sample.weight * factor,
            roulette_scale: self.roulette_scale * (sample.eta * sample.eta),
            prev: PrevVertex::new(vertex, sample, light_samples),
        }
    }

    /// Replaces the segment of the path by the next segment.
    #[inline(always)]
    pub fn advance(&mut self, next: NextSegment) {
        self.ray = next.ray;
        self.depth += 1;
        self.beta = next.beta;
        self.roulette_scale = next.roulette_scale;
        self.prev = Some(next.prev);
        self.skips_emission = false;
    }

    /// State of the path after the scattering event that starts `next`.
    pub fn after(mut self, next: NextSegment) -> Self {
        self.advance(next);
        self
    }
}

/// The segment of a path after a vertex. It has at most 128 bytes, so that compilers move it
/// without a call of `memcpy`.
pub(crate) struct NextSegment {
    pub ray: Ray,
    pub beta: Spectrum,
    pub roulette_scale: Spectrum,
    pub prev: PrevVertex,
}

const _: () = assert!(size_of::<Option<NextSegment>>() <= 128);
